//! The forms for loops do not allocate.
#![allow(non_snake_case)]

#[path = "laws/trees.rs"]
mod trees;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use sinew_flex_joint::{Deflection, ElasticJoints, InverseScratch, MotorMotion, Workspace};
use trees::{Mounting, assert_close, cases};

struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations(f: impl FnOnce()) -> usize {
    let before = COUNT.with(Cell::get);
    f();
    COUNT.with(Cell::get) - before
}

#[test]
fn forms_with_a_workspace_do_not_allocate() {
    for mounting in [Mounting::Usual, Mounting::Anywhere] {
        for case in cases(mounting) {
            let (reduced, complete) = (ElasticJoints::new(&case.robot).unwrap(), case.complete());
            for joints in [&reduced, &complete] {
                let (nv, n) = (case.qd.len(), joints.displacement_len());
                let (q, qd, theta, thetad, tau) = (&case.q, &case.qd, &case.theta, &case.thetad, &case.tau_m);
                let (mut qdd, mut thetadd) = (vec![0.0; nv], vec![0.0; nv]);
                let [mut a, mut b, mut c, mut d, mut e] = [(); 5].map(|()| vec![0.0; 2 * nv * nv]);
                let (mut A, mut B) = (vec![0.0; n * n], vec![0.0; n * nv]);
                let (x, mut rate) = (vec![0.1; joints.state_len()], vec![0.0; joints.state_len()]);
                let mut ws = Workspace::new(joints);
                let count = allocations(|| {
                    joints.forward_dynamics_into(&mut ws, q, qd, theta, thetad, tau, &mut qdd, &mut thetadd);
                    joints.forward_dynamics_derivatives_into(
                        &mut ws, q, qd, theta, thetad, tau, &mut a, &mut b, &mut c, &mut d, &mut e,
                    );
                    joints.state_rate_into(&mut ws, &x, tau, &mut rate);
                    joints.linearize_into(&mut ws, &x, tau, &mut A, &mut B);
                });
                assert_eq!(count, 0);
                // a workspace that has served all of them gives what a fresh one gives
                let fresh = joints.forward_dynamics(q, qd, theta, thetad, tau);
                joints.forward_dynamics_into(&mut ws, q, qd, theta, thetad, tau, &mut qdd, &mut thetadd);
                assert_close("q̈", &qdd, fresh.0.as_slice(), 0.0);
            }
            let motion = [&case.q[..], &case.qd, &case.theta, &case.thetad, &case.tau_m];
            let mut ws = InverseScratch::<f64, 3>::new(&reduced);
            let mut out = MotorMotion::new(&reduced);
            let count = allocations(|| {
                reduced.inverse_dynamics_with(&mut ws, &motion, Deflection::Settled, &mut out).unwrap();
            });
            assert_eq!(count, 0);
        }
    }
}
