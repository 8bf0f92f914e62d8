//! Many configurations side by side: what the batch forms share.

use alloc::vec;
use alloc::vec::Vec;

use crate::{Lanes, wide};

/// Scratch space for as many configurations side by side as the machine's registers hold.
#[derive(Debug, Clone)]
pub enum Room<E, F, O> {
    /// Eight: with AVX-512.
    Eight(E),
    /// Four: with AVX2, and on other processors than those of the x86 family.
    Four(F),
    /// One after the other.
    One(O),
}

impl<E, F, O> Room<E, F, O> {
    /// Room for this machine.
    pub fn new(eight: impl FnOnce() -> E, four: impl FnOnce() -> F, one: impl FnOnce() -> O) -> Self {
        if wide::eight() {
            Room::Eight(eight())
        } else if wide::four() || !cfg!(target_arch = "x86_64") {
            Room::Four(four())
        } else {
            Room::One(one())
        }
    }
}

/// Numbers moved at a time between lanes and configurations: what lies in the nearest cache.
const TILE: usize = 8;

/// The numbers of configurations `first` … side by side; past the end the last one is repeated.
///
/// `all`: the configurations one after the other, as many numbers each as `lanes` holds.
#[inline(always)]
pub fn gather<const N: usize>(all: &[f64], first: usize, lanes: &mut [Lanes<N>]) {
    let n = lanes.len();
    let last = (all.len() / n.max(1)).max(1) - 1;
    for lane in 0..N {
        let own = &all[(first + lane).min(last) * n..][..n];
        for (lanes, &number) in lanes.iter_mut().zip(own) {
            lanes.0[lane] = number;
        }
    }
}

/// The lanes to configurations `first` … of `all`, to as many as there are.
#[inline(always)]
pub fn scatter<const N: usize>(lanes: &[Lanes<N>], first: usize, all: &mut [f64]) {
    let size = lanes.len();
    let from = (first * size).min(all.len());
    scatter_part(lanes, 0, size, &mut all[from..]);
}

/// The lanes to the numbers from `place` on of each of the first configurations of `all`, `size` numbers each.
#[inline(always)]
pub fn scatter_part<const N: usize>(lanes: &[Lanes<N>], place: usize, size: usize, all: &mut [f64]) {
    for (tile, numbers) in lanes.chunks(TILE).enumerate() {
        for (lane, own) in all.chunks_exact_mut(size.max(1)).take(N).enumerate() {
            for (number, lanes) in own[place + tile * TILE..].iter_mut().zip(numbers) {
                *number = lanes.0[lane];
            }
        }
    }
}

/// How many configurations of `n` numbers `all` holds.
///
/// # Panics
/// If they are not whole.
pub fn count(all: &[f64], n: usize) -> usize {
    let count = all.len() / n.max(1);
    assert_eq!(all.len(), n * count, "q");
    count
}

/// Lanes for `n` numbers.
pub fn zeros<const N: usize>(n: usize) -> Vec<Lanes<N>> {
    vec![Lanes([0.0; N]); n]
}

/// Defines a function that runs an algorithm on many configurations in the lanes of a [`Room`], or one by one.
///
/// `$lanes` must be inlined and generic over the count of lanes. One function for each width: a compiler's time grows
/// faster than a function's length.
#[macro_export]
#[doc(hidden)]
macro_rules! side_by_side {
    (fn $name:ident($($argument:ident: $type:ty),* $(,)?), $lanes:ident, $one:ident) => {
        fn $name(room: &mut Room, $($argument: $type),*) {
            $crate::wide_forms! {
                avx512, fn eight(lane: &mut Lane<8>, $($argument: $type),*) {
                    $lanes(lane, $($argument),*)
                }
            }
            $crate::wide_forms! {
                avx2_only, fn four(lane: &mut Lane<4>, $($argument: $type),*) {
                    $lanes(lane, $($argument),*)
                }
            }
            match room {
                Room::Eight(lane) => eight(lane, $($argument),*),
                Room::Four(lane) => four(lane, $($argument),*),
                Room::One(ws) => $one(ws, $($argument),*),
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_gathered_is_scattered() {
        let all: Vec<f64> = (0..21).map(f64::from).collect();
        let mut back = vec![0.0; 21];
        for first in [0, 4] {
            let mut lanes = zeros::<4>(3);
            gather(&all, first, &mut lanes);
            scatter(&lanes, first, &mut back);
        }
        assert_eq!(back, all);
    }
}
