//! Where the columns of a robot's axes stand, so that those of a subtree can be moved side by side.

use core::ops::Range;

use sinew_model::{Force, Mechanism, Pose, Scalar};

/// A place for each axis in a row of groups.
///
/// Each chain of segments begins a new group. So the groups that hold a subtree's axes hold no others but those of the
/// same chain nearer to the base, whose columns are not yet written when the subtree is moved.
#[derive(Debug, Clone)]
pub(crate) struct Slots {
    // Of each axis.
    slot: Vec<usize>,
    // Of each segment: groups of its subtree.
    groups: Vec<Range<usize>>,
    // Of each segment: its own axes and those of its subtree, slot and degree of freedom.
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
                subtree.extend(axes.map(|l| (slot[other.first_axis + l], other.first_dof + l)));
            }
            first.push(subtree.len());
        }
        Self { slot, groups, first, subtree, room: 6 * usize::next_multiple_of(next, width) }
    }

    /// Numbers of all groups: each is six rows of as many columns as the group is wide.
    pub(crate) fn room(&self) -> usize {
        self.room
    }

    /// The slot of an axis.
    #[inline(always)]
    pub(crate) fn of(&self, axis: usize) -> usize {
        self.slot[axis]
    }

    /// Groups of the axes of segment `k` and its subtree.
    #[inline(always)]
    pub(crate) fn groups(&self, k: usize) -> Range<usize> {
        self.groups[k].clone()
    }

    /// Slot and degree of freedom of the axes of segment `k` from its axis `from` on, and of its subtree.
    #[inline(always)]
    pub(crate) fn subtree(&self, k: usize, from: usize) -> &[(usize, usize)] {
        &self.subtree[self.first[k] + from..self.first[k + 1]]
    }
}

/// Component `row` of the force in slot `slot`.
#[inline(always)]
pub(crate) fn component<S: Scalar>(forces: &[S], slot: usize, row: usize) -> S {
    forces[(slot / S::GROUP * 6 + row) * S::GROUP + slot % S::GROUP]
}

/// Puts a force into slot `slot`.
#[inline(always)]
pub(crate) fn put<S: Scalar>(forces: &mut [S], slot: usize, F: Force<S>) {
    let column = &mut forces[slot / S::GROUP * 6 * S::GROUP + slot % S::GROUP..];
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
        let row = |k: usize| S::group(&group[k * S::GROUP..][..S::GROUP]);
        let (n, f) = ([row(0), row(1), row(2)], [row(3), row(4), row(5)]);
        let F = X.force_to_parent(Force::new(n.into(), f.into())).to_array();
        for (to, from) in group.chunks_exact_mut(S::GROUP).zip(F) {
            S::ungroup(from, to);
        }
    }
}
