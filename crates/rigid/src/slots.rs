//! Where the columns of a robot's axes stand, so that those of a subtree can be moved side by side.

use alloc::vec;
use alloc::vec::Vec;

use core::ops::Range;

use sinew_model::{Force, Mechanism, Pose, Scalar};

/// A place for each axis in a row of groups.
///
/// Each chain of segments begins a new group. So the groups that hold a subtree's axes hold no others but those of the
/// same chain nearer to the base, whose columns are not yet written when the subtree is moved.
#[derive(Debug, Clone)]
pub(crate) struct Slots {
    // Of each axis: where the first component of its force stands.
    place: Vec<usize>,
    // Of each segment: groups of its subtree.
    groups: Vec<Range<usize>>,
    // Of each segment: its own axes and those of its subtree, place and degree of freedom.
    first: Vec<usize>,
    subtree: Vec<(usize, usize)>,
    room: usize,
}

impl Slots {
    pub(crate) fn new(mechanism: &Mechanism, width: usize) -> Self {
        let segments = mechanism.segments();
        let mut slot = vec![0; mechanism.axes()];
        // children next to their parents: depth first, whatever the order of the segments
        let mut order = Vec::new();
        let mut open: Vec<usize> = (0..segments.len()).rev().filter(|&k| segments[k].parent == 0).collect();
        while let Some(k) = open.pop() {
            order.push(k);
            open.extend((0..segments.len()).rev().filter(|&j| segments[j].parent == k + 1));
        }
        let (mut next, mut last) = (0, 0);
        let mut ends = vec![0; segments.len()];
        for &k in &order {
            if segments[k].parent == 0 || segments[k].parent != last {
                next = usize::next_multiple_of(next, width);
            }
            for axis in segments[k].first_axis..segments[k].first_axis + segments[k].nv() {
                slot[axis] = next;
                next += 1;
            }
            last = k + 1;
            // the subtree of every carrier reaches at least here
            let mut row = k + 1;
            while row > 0 {
                ends[row - 1] = next;
                row = segments[row - 1].parent;
            }
        }
        let range = |k: usize| slot[segments[k].first_axis] / width..usize::div_ceil(ends[k], width);
        let groups = (0..segments.len()).map(range).collect();
        let place: Vec<usize> = slot.iter().map(|slot| slot / width * 6 * width + slot % width).collect();
        let (mut first, mut subtree) = (vec![0], Vec::new());
        for k in 0..segments.len() {
            let carried = |mut row: usize| {
                while row > k + 1 {
                    row = segments[row - 1].parent;
                }
                row == k + 1
            };
            for other in (k..segments.len()).filter(|&j| carried(j + 1)).map(|j| &segments[j]) {
                let axes = 0..other.nv();
                subtree.extend(axes.map(|l| (place[other.first_axis + l], other.first_dof + l)));
            }
            first.push(subtree.len());
        }
        Self { place, groups, first, subtree, room: 6 * usize::next_multiple_of(next, width) }
    }

    /// Numbers of all groups: each is six rows of as many columns as the group is wide.
    pub(crate) fn room(&self) -> usize {
        self.room
    }

    /// Where the first component of the force of an axis stands; the others follow at the width of a group.
    #[inline(always)]
    pub(crate) fn place(&self, axis: usize) -> usize {
        self.place[axis]
    }

    /// Groups of the axes of segment `k` and its subtree.
    #[inline(always)]
    pub(crate) fn groups(&self, k: usize) -> Range<usize> {
        self.groups[k].clone()
    }

    /// Place and degree of freedom of the axes of segment `k` from its axis `from` on, and of its subtree.
    #[inline(always)]
    pub(crate) fn subtree(&self, k: usize, from: usize) -> &[(usize, usize)] {
        &self.subtree[self.first[k] + from..self.first[k + 1]]
    }
}

/// Puts a force at a place.
#[inline(always)]
pub(crate) fn put<S: Scalar>(forces: &mut [S], place: usize, F: Force<S>) {
    let column = &mut forces[place..][..5 * S::GROUP + 1];
    for (row, x) in F.to_array().into_iter().enumerate() {
        column[row * S::GROUP] = x;
    }
}

/// Moves all forces of the groups to the parent's frame.
#[inline(always)]
pub(crate) fn move_to_parent<S: Scalar>(forces: &mut [S], groups: Range<usize>, pose: &Pose<S>) {
    let X = pose.repeated();
    let size = 6 * S::GROUP;
    for group in forces[size * groups.start..size * groups.end].chunks_exact_mut(size) {
        let mut rows = [S::Group::ZERO; 6];
        for (to, from) in rows.iter_mut().zip(group.chunks_exact(S::GROUP)) {
            *to = S::group(from);
        }
        let [a, b, c, d, e, f] = rows;
        let F = X.force_to_parent(Force::new([a, b, c].into(), [d, e, f].into())).to_array();
        for (to, from) in group.chunks_exact_mut(S::GROUP).zip(F) {
            S::ungroup(from, to);
        }
    }
}
