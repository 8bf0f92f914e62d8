//! A controller's torque computation on a machine without an operating system.
//!
//! That it builds shows that `model`, `kinematics` and `rigid` need `core` and `alloc` only: with the standard library
//! in the program there would be two panic handlers, which the compiler refuses.
#![no_std]

extern crate alloc;

use alloc::alloc::{GlobalAlloc, Layout};
use core::cell::UnsafeCell;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicUsize, Ordering};

use sinew_model::samples::planar_arm;

const HEAP: usize = 1 << 20;

/// Memory that is only ever handed out.
struct Bump {
    memory: UnsafeCell<[u8; HEAP]>,
    used: AtomicUsize,
}

// SAFETY: parts of the memory are handed out once each, by an atomic counter.
unsafe impl Sync for Bump {}

// SAFETY: each piece lies within the memory, is aligned, and overlaps no other.
unsafe impl GlobalAlloc for Bump {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let room = layout.size() + layout.align();
        let first = self.used.fetch_add(room, Ordering::Relaxed);
        if first + room > HEAP {
            return core::ptr::null_mut();
        }
        let start = self.memory.get().cast::<u8>();
        // SAFETY: `first` and the aligned place after it lie within the memory.
        unsafe { start.add(first + start.add(first).align_offset(layout.align())) }
    }
    unsafe fn dealloc(&self, _: *mut u8, _: Layout) {}
}

#[global_allocator]
static HEAP_ALLOCATOR: Bump = Bump { memory: UnsafeCell::new([0; HEAP]), used: AtomicUsize::new(0) };

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    loop {}
}

/// Torque of the first joint of a planar arm of two rods at `q`, at rest.
#[unsafe(no_mangle)]
pub extern "C" fn sinew_hold(q1: f64, q2: f64) -> f64 {
    let arm = planar_arm(2, 1.5, 0.4);
    let mut ws = sinew_rigid::Workspace::new(&arm);
    let mut tau = [0.0; 2];
    sinew_rigid::inverse_dynamics_into(&arm, &mut ws, &[q1, q2], &[0.0; 2], &[0.0; 2], &mut tau);
    let place = sinew_kinematics::link_pose(&arm, &[q1, q2], arm.last_link());
    tau[0] + 0.0 * place.translation.x
}
