//! Many configurations side by side: what the batch forms share.

use alloc::vec;
use alloc::vec::Vec;
use core::array::from_fn;

#[cfg(target_arch = "x86_64")]
use crate::transpose;
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

/// The numbers of configurations `first` … side by side; past the end the last one is repeated.
///
/// `all`: the configurations one after the other, as many numbers each as `lanes` holds.
#[inline(always)]
pub fn gather<const N: usize>(all: &[f64], first: usize, lanes: &mut [Lanes<N>]) {
    let n = lanes.len();
    let last = (all.len() / n.max(1)).max(1) - 1;
    let own: [&[f64]; N] = from_fn(|lane| &all[(first + lane).min(last) * n..][..n]);
    #[cfg(target_arch = "x86_64")]
    if let (Ok(own), true) = (own[..].try_into(), wide::eight()) {
        // SAFETY: the machine has these instructions.
        return unsafe { transpose::to_eight_lanes(own, numbers_mut(lanes)) };
    } else if let (Ok(own), true) = (own[..].try_into(), wide::four()) {
        // SAFETY: the machine has these instructions.
        return unsafe { transpose::to_four_lanes(own, numbers_mut(lanes)) };
    }
    for (lane, own) in own.iter().enumerate() {
        for (lanes, &number) in lanes.iter_mut().zip(*own) {
            lanes.0[lane] = number;
        }
    }
}

/// The lanes to configurations `first` … of `all`, to as many as there are.
#[inline(always)]
pub fn scatter<const N: usize>(lanes: &[Lanes<N>], first: usize, all: &mut [f64]) {
    Rows::new(all, first, lanes.len()).put(lanes, 0);
}

/// The numbers of as many configurations as lanes, or of fewer at the end of a batch.
pub struct Rows<'a, const N: usize> {
    own: [&'a mut [f64]; N],
    whole: bool,
}

impl<'a, const N: usize> Rows<'a, N> {
    /// Those from the configuration `first` on, of `size` numbers each.
    #[inline(always)]
    pub fn new(all: &'a mut [f64], first: usize, size: usize) -> Self {
        let from = (first * size).min(all.len());
        let mut rows = all[from..].chunks_exact_mut(size.max(1));
        let whole = rows.len() >= N;
        Self { own: from_fn(|_| rows.next().unwrap_or_default()), whole }
    }

    /// The lanes to the numbers from `at` on of each.
    #[inline(always)]
    pub fn put(&mut self, lanes: &[Lanes<N>], at: usize) {
        #[cfg(target_arch = "x86_64")]
        if self.whole {
            if let (Ok(own), true) = ((&mut self.own[..]).try_into(), wide::eight()) {
                // SAFETY: the machine has these instructions.
                return unsafe { transpose::from_eight_lanes(numbers(lanes), at, own) };
            } else if let (Ok(own), true) = ((&mut self.own[..]).try_into(), wide::four()) {
                // SAFETY: the machine has these instructions.
                return unsafe { transpose::from_four_lanes(numbers(lanes), at, own) };
            }
        }
        let whole = self.whole;
        for (lane, own) in self.own.iter_mut().enumerate().filter(|(_, own)| whole || !own.is_empty()) {
            for (number, lanes) in own[at..].iter_mut().zip(lanes) {
                *number = lanes.0[lane];
            }
        }
    }
}

/// All lanes one after the other.
#[cfg(target_arch = "x86_64")]
fn numbers<const N: usize>(lanes: &[Lanes<N>]) -> &[f64] {
    // SAFETY: lanes are their N numbers and nothing else.
    unsafe { core::slice::from_raw_parts(lanes.as_ptr().cast(), N * lanes.len()) }
}

#[cfg(target_arch = "x86_64")]
fn numbers_mut<const N: usize>(lanes: &mut [Lanes<N>]) -> &mut [f64] {
    // SAFETY: lanes are their N numbers and nothing else.
    unsafe { core::slice::from_raw_parts_mut(lanes.as_mut_ptr().cast(), N * lanes.len()) }
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

    fn there_and_back<const N: usize>(size: usize, count: usize) {
        let all: Vec<f64> = (0..size * count).map(|k| k as f64).collect();
        let (mut lanes, mut back) = (zeros::<N>(size), vec![-1.0; size * count]);
        for first in (0..count).step_by(N) {
            gather(&all, first, &mut lanes);
            for (k, number) in lanes.iter().enumerate() {
                for (lane, x) in number.0.iter().enumerate() {
                    assert_eq!(*x, all[(first + lane).min(count - 1) * size + k]);
                }
            }
            scatter(&lanes, first, &mut back);
        }
        assert_eq!(back, all);
    }

    #[test]
    fn what_is_gathered_is_scattered() {
        for (size, count) in (1..20).flat_map(|size| [1, 4, 8, 13].map(|count| (size, count))) {
            there_and_back::<4>(size, count);
            there_and_back::<8>(size, count);
            there_and_back::<2>(size, count);
        }
    }

    #[test]
    fn a_part_leaves_the_rest_as_it_is() {
        let lanes: Vec<_> = (0..5).map(|k| Lanes([f64::from(k); 8])).collect();
        let mut all = vec![-1.0; 8 * 7];
        Rows::new(&mut all, 0, 7).put(&lanes, 1);
        for own in all.chunks(7) {
            assert_eq!(own, [-1.0, 0.0, 1.0, 2.0, 3.0, 4.0, -1.0]);
        }
    }
}
