//! Composite bodies in tables, so that several bodies are treated side by side.
//!
//! Everything is told in the frame of the root: of the world, or of a body that moves freely, whose own place changes
//! no mass matrix and whose axes are then those of the frame. There composites only add, and no force is moved.

use alloc::vec;
use alloc::vec::Vec;

use sinew_model::{
    Coordinates, Inertia, Matrix3, Mechanism, Motion, Pose, Scalar, SegmentKind, Symmetric3, Vector3,
};

/// Numbers of a pose and of an inertia in a table.
const POSE: usize = 12;
const INERTIA: usize = 10;

/// Room for the composite bodies of a mechanism; one place an axis, but none for a root that moves freely.
///
/// Places are numbered through blocks of a group's width, and every chain of bodies begins a new block.
#[derive(Debug, Clone)]
pub(crate) struct Places<S> {
    steps: Vec<Step>,
    place: Vec<Place>,
    // Of each place in turn: those that carry it and itself.
    first: Vec<usize>,
    carriers: Vec<Run>,
    roots: Vec<Root<S>>,
    // Tables by blocks: the first number of each place of a block, then the second, and so on.
    poses: Vec<S>,
    bodies: Vec<S>,
    composites: Vec<S>,
    // Rates of turning about and of sliding along z.
    rates: Vec<S>,
    // Axes s, forces I s.
    axes: Vec<S>,
    forces: Vec<S>,
}

/// What becomes of a segment's pose.
#[derive(Debug, Clone, Copy)]
struct Step {
    kind: StepKind,
    // Its place; of six, the first.
    at: usize,
    // The last place of the segment it stands on; none for a root.
    parent: Option<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum StepKind {
    /// It is a root that moves freely.
    Root,
    /// It has one place.
    Axis,
    /// It moves freely on another: six places.
    Free,
}

#[derive(Debug, Clone, Copy)]
struct Place {
    // Its number; blocks that are not full leave some out.
    at: usize,
    dof: usize,
    // Whose composite includes this one's: another place or a root.
    parent: Option<usize>,
    root: Option<usize>,
    // The segment whose body counts here: at the last of its places.
    body: Option<usize>,
}

/// Places of one chain from the beginning of a block on, whose degrees of freedom follow one another.
#[derive(Debug, Clone, Copy)]
struct Run {
    block: usize,
    dof: usize,
    // How many degrees of freedom carry the first of them.
    row: usize,
    length: usize,
}

#[derive(Debug, Clone)]
struct Root<S> {
    segment: usize,
    dof: usize,
    body: Inertia<S>,
    composite: Inertia<S>,
}

impl<S: Scalar> Places<S> {
    pub(crate) fn new(mechanism: &Mechanism) -> Self {
        let segments = mechanism.segments();
        let (mut steps, mut place): (Vec<Step>, Vec<Place>) = (Vec::new(), Vec::new());
        let (mut roots, mut rates): (Vec<Root<S>>, Vec<S>) = (Vec::new(), Vec::new());
        // of each segment: its last place, or its root
        let (mut last, mut root_of) = (vec![None; segments.len()], vec![None; segments.len()]);
        for (k, segment) in segments.iter().enumerate() {
            let dof = segment.first_dof;
            if segment.parent == 0 && segment.kind == SegmentKind::Free {
                root_of[k] = Some(roots.len());
                steps.push(Step { kind: StepKind::Root, at: 0, parent: None });
                roots.push(Root { segment: k, dof, body: Inertia::default(), composite: Inertia::default() });
                continue;
            }
            let below = segment.parent.checked_sub(1);
            root_of[k] = below.and_then(|p| root_of[p]);
            let mut parent = below.and_then(|p| last[p]);
            let (kind, carrier) = (if segment.nv() == 6 { StepKind::Free } else { StepKind::Axis }, parent);
            for axis in 0..segment.nv() {
                let before = place.last().map_or((0, 0), |p: &Place| (p.at + 1, p.dof + 1));
                let follows = parent.is_some_and(|p| (p + 1, dof + axis) == before);
                let at = if follows { before.0 } else { usize::next_multiple_of(before.0, S::GROUP) };
                if axis == 0 {
                    steps.push(Step { kind, at, parent: carrier });
                }
                let body = (axis + 1 == segment.nv()).then_some(k);
                place.push(Place { at, dof: dof + axis, parent, root: root_of[k], body });
                rates.resize((at / S::GROUP + 1) * 2 * S::GROUP, S::ZERO);
                let (turning, sliding) = match segment.kind {
                    SegmentKind::Turning => (segment.ratio, 0.0),
                    SegmentKind::Sliding => (0.0, segment.ratio),
                    SegmentKind::Free if axis < 3 => (1.0, 0.0),
                    SegmentKind::Free => (0.0, 1.0),
                };
                put(&mut rates, at, [S::constant(turning), S::constant(sliding)]);
                parent = Some(at);
            }
            last[k] = parent;
        }
        let (first, carriers) = runs(&place, S::GROUP);
        let table = |numbers: usize| vec![S::ZERO; numbers * rates.len() / 2];
        Self {
            steps,
            place,
            first,
            carriers,
            roots,
            poses: table(POSE),
            bodies: table(INERTIA),
            composites: table(INERTIA),
            axes: table(6),
            forces: table(6),
            rates,
        }
    }

    /// Takes the inertias of the segments.
    #[inline(always)]
    pub(crate) fn load(&mut self, inertia: &[Inertia<S>]) {
        for place in &self.place {
            if let Some(k) = place.body {
                put(&mut self.bodies, place.at, inertia_numbers(&inertia[k]));
            }
        }
        for root in &mut self.roots {
            root.body = inertia[root.segment];
        }
    }

    /// Axes and inertias of all bodies at the coordinates read from `q`, in the frame of their root.
    #[inline(always)]
    pub(crate) fn set_out(&mut self, mechanism: &Mechanism, q: &[S], at: &Coordinates<S>) {
        let (mut last, mut before) = (Pose::identity(), usize::MAX);
        for (k, step) in self.steps.iter().enumerate() {
            if step.kind == StepKind::Root {
                continue;
            }
            let pose = mechanism.pose(k, q, at);
            // along a chain the parent is the body before, and stays in registers
            last = match step.parent {
                None => pose,
                Some(parent) if S::FITS_REGISTERS && parent == before => last * pose,
                Some(parent) => pose_of(&get(&self.poses, parent)) * pose,
            };
            before = step.at;
            if step.kind == StepKind::Free {
                // each axis in turn as z; the last place has the segment's own frame
                for axis in 0..6 {
                    put(&mut self.poses, step.at + axis, pose_numbers(&axis_along_z(&last, axis)));
                }
                before += 5;
            } else {
                put(&mut self.poses, step.at, pose_numbers(&last));
            }
        }
        for k in 0..self.rates.len() / (2 * S::GROUP) {
            let pose = pose_of(&take::<S, POSE>(&self.poses, k));
            let I = pose.inertia_to_parent(&inertia_of(&take::<S, INERTIA>(&self.bodies, k)));
            give::<S, INERTIA>(&mut self.composites, k, inertia_numbers(&I));
            // s = [z; p × z] of a joint that turns, [0; z] of one that slides
            let [turning, sliding] = take::<S, 2>(&self.rates, k);
            let [a, b, c] = pose.rotation.rows;
            let z = Vector3::new(a.z, b.z, c.z);
            let turning = z * turning;
            let s = Motion::new(turning, pose.translation.cross(turning) + z * sliding);
            give::<S, 6>(&mut self.axes, k, s.to_array());
        }
        for root in &mut self.roots {
            root.composite = root.body;
        }
    }

    /// Adds the inertia of each body to the one that carries it, and takes the forces of unit accelerations.
    ///
    /// ```text
    /// I_c = Σ I over subtrees,   F = I_c s
    /// ```
    #[inline(always)]
    pub(crate) fn add_up(&mut self) {
        let mut carried = Inertia::default();
        for k in (0..self.place.len()).rev() {
            let place = self.place[k];
            let mut I = inertia_of(&get(&self.composites, place.at));
            if S::FITS_REGISTERS {
                I += carried;
                carried = Inertia::default();
                put(&mut self.composites, place.at, inertia_numbers(&I));
            }
            if S::FITS_REGISTERS && place.parent.is_some_and(|parent| parent + 1 == place.at) {
                carried = I;
            } else {
                self.add_to_carrier(&place, &I);
            }
        }
        // the first composites were written last: to read them in groups takes a while
        for k in (0..self.rates.len() / (2 * S::GROUP)).rev() {
            let s = motion_of(&take::<S, 6>(&self.axes, k));
            let I = inertia_of(&take::<S, INERTIA>(&self.composites, k));
            give::<S, 6>(&mut self.forces, k, I.times(s).to_array());
        }
    }

    #[inline(always)]
    fn add_to_carrier(&mut self, place: &Place, I: &Inertia<S>) {
        match (place.parent, place.root) {
            (Some(parent), _) => {
                let sum = inertia_of(&get(&self.composites, parent)) + *I;
                put(&mut self.composites, parent, inertia_numbers(&sum));
            }
            (None, Some(root)) => self.roots[root].composite += *I,
            (None, None) => {}
        }
    }

    /// Writes the entries on and above the diagonal of M that may be other than zero, columns `stride` apart; no two joints
    /// may share a degree of freedom. `packed`: without the zeros between them.
    ///
    /// ```text
    /// M_ij = s_i·F_j   where i carries j
    /// ```
    #[inline(always)]
    pub(crate) fn write_upper(&mut self, stride: usize, packed: bool, M: &mut [S]) {
        if S::GROUP > 1 {
            self.add_up();
        }
        for k in (0..self.place.len()).rev() {
            let place = self.place[k];
            let F = if S::GROUP > 1 {
                get(&self.forces, place.at)
            } else {
                let I = inertia_of(&get(&self.composites, place.at));
                self.add_to_carrier(&place, &I);
                I.times(motion_of(&get(&self.axes, place.at))).to_array()
            };
            let column = &mut M[stride * place.dof..][..stride];
            if let Some(root) = place.root {
                let row = if packed { 0 } else { self.roots[root].dof };
                column[row..][..6].copy_from_slice(&F);
            }
            let mut each = [S::Group::ZERO; 6];
            for c in 0..6 {
                each[c] = F[c].repeated();
            }
            for run in &self.carriers[self.first[k]..self.first[k + 1]] {
                let row = if packed { run.row } else { run.dof };
                for (block, first) in (run.block..).zip((0..run.length).step_by(S::GROUP)) {
                    let entries = along(&take::<S, 6>(&self.axes, block), &each);
                    let count = (run.length - first).min(S::GROUP);
                    S::ungroup(entries, &mut column[row + first..][..count]);
                }
            }
        }
        for root in &self.roots {
            // the axes are those of the frame: I_c itself
            for axis in 0..6 {
                let column = column_of(&root.composite, axis);
                let first = if packed { 0 } else { root.dof } + stride * (root.dof + axis);
                M[first..=first + axis].copy_from_slice(&column[..=axis]);
            }
        }
    }

    /// Adds M where joints may share degrees of freedom.
    #[inline(always)]
    pub(crate) fn add_all(&self, stride: usize, M: &mut [S]) {
        let mut add = |i: usize, j: usize, x: S| {
            M[i + stride * j] += x;
        };
        for root in &self.roots {
            for axis in 0..6 {
                let column = column_of(&root.composite, axis);
                (0..6).for_each(|i| add(root.dof + i, root.dof + axis, column[i]));
            }
        }
        for (place, ends) in self.place.iter().zip(self.first.windows(2)) {
            let F: [S; 6] = get(&self.forces, place.at);
            if let Some(root) = place.root {
                for (i, x) in (self.roots[root].dof..).zip(F) {
                    add(i, place.dof, x);
                    add(place.dof, i, x);
                }
            }
            for run in &self.carriers[ends[0]..ends[1]] {
                for (at, dof) in (run.block * S::GROUP..).zip(run.dof..run.dof + run.length) {
                    let s: [S; 6] = get(&self.axes, at);
                    let x = s.iter().zip(F).fold(S::ZERO, |sum, (s, F)| sum + *s * F);
                    add(dof, place.dof, x);
                    if at != place.at {
                        add(place.dof, dof, x);
                    }
                }
            }
        }
    }
}

/// Runs of carriers of each place, itself included, ascending.
fn runs(place: &[Place], width: usize) -> (Vec<usize>, Vec<Run>) {
    let (mut first, mut runs) = (vec![0], Vec::<Run>::new());
    let number = |at: usize| place.iter().position(|p| p.at == at).expect("a parent has a place");
    for k in 0..place.len() {
        let mut own = vec![k];
        while let Some(parent) = place[own[own.len() - 1]].parent {
            own.push(number(parent));
        }
        let (start, below) = (runs.len(), if place[k].root.is_some() { 6 } else { 0 });
        for (row, &i) in (below..).zip(own.iter().rev()) {
            let Place { at, dof, .. } = place[i];
            match runs[start..].last_mut() {
                Some(run) if (run.block * width + run.length, run.dof + run.length) == (at, dof) => {
                    run.length += 1;
                }
                _ => runs.push(Run { block: at / width, dof, row, length: 1 }),
            }
        }
        first.push(runs.len());
    }
    (first, runs)
}

/// s·F for a block of axes.
#[inline(always)]
fn along<G: Scalar>(s: &[G; 6], F: &[G; 6]) -> G {
    ((s[0] * F[0] + s[1] * F[1]) + (s[2] * F[2] + s[3] * F[3])) + (s[4] * F[4] + s[5] * F[5])
}

/// The frame turned so that axis `axis` of a free joint is its z.
#[inline(always)]
fn axis_along_z<S: Scalar>(pose: &Pose<S>, axis: usize) -> Pose<S> {
    let [a, b, c] = pose.rotation.rows;
    let turn = |r: Vector3<S>| match axis % 3 {
        0 => Vector3::new(r.y, r.z, r.x),
        1 => Vector3::new(r.z, r.x, r.y),
        _ => r,
    };
    Pose::new(Matrix3 { rows: [turn(a), turn(b), turn(c)] }, pose.translation)
}

/// Column `k` of an inertia as a matrix.
#[inline(always)]
fn column_of<S: Scalar>(I: &Inertia<S>, k: usize) -> [S; 6] {
    let mut unit = [S::ZERO; 6];
    unit[k] = S::ONE;
    let [a, b, c, d, e, f] = unit;
    I.times(Motion::new([a, b, c].into(), [d, e, f].into())).to_array()
}

#[inline(always)]
fn pose_of<S: Scalar>(n: &[S; POSE]) -> Pose<S> {
    let rows = [[n[0], n[1], n[2]].into(), [n[3], n[4], n[5]].into(), [n[6], n[7], n[8]].into()];
    Pose::new(Matrix3 { rows }, [n[9], n[10], n[11]].into())
}

#[inline(always)]
fn pose_numbers<S: Scalar>(pose: &Pose<S>) -> [S; POSE] {
    let ([a, b, c], p) = (pose.rotation.rows, pose.translation);
    [a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z, p.x, p.y, p.z]
}

#[inline(always)]
fn motion_of<S: Scalar>(n: &[S; 6]) -> Motion<S> {
    Motion::new([n[0], n[1], n[2]].into(), [n[3], n[4], n[5]].into())
}

#[inline(always)]
fn inertia_of<S: Scalar>(n: &[S; INERTIA]) -> Inertia<S> {
    let [mass, x, y, z, xx, yy, zz, xy, xz, yz] = *n;
    let second_moment = Symmetric3 { xx, yy, zz, xy, xz, yz };
    Inertia { mass, first_moment: [x, y, z].into(), second_moment }
}

#[inline(always)]
fn inertia_numbers<S: Scalar>(i: &Inertia<S>) -> [S; INERTIA] {
    let (h, s) = (i.first_moment, &i.second_moment);
    [i.mass, h.x, h.y, h.z, s.xx, s.yy, s.zz, s.xy, s.xz, s.yz]
}

/// The numbers of block `k` of a table.
///
/// Blocks are found one by one, with a check: over slices of blocks the compiler takes groups apart to take the same
/// number of several blocks at a time.
#[inline(always)]
fn take<S: Scalar, const N: usize>(table: &[S], k: usize) -> [S::Group; N] {
    let block = &table[k * N * S::GROUP..][..N * S::GROUP];
    let mut numbers = [S::Group::ZERO; N];
    for c in 0..N {
        numbers[c] = S::group(&block[c * S::GROUP..][..S::GROUP]);
    }
    numbers
}

#[inline(always)]
fn give<S: Scalar, const N: usize>(table: &mut [S], k: usize, numbers: [S::Group; N]) {
    let block = &mut table[k * N * S::GROUP..][..N * S::GROUP];
    for c in 0..N {
        S::ungroup(numbers[c], &mut block[c * S::GROUP..][..S::GROUP]);
    }
}

/// The numbers of the place `at` in a table.
#[inline(always)]
fn get<S: Scalar, const N: usize>(table: &[S], at: usize) -> [S; N] {
    let own = &table[at / S::GROUP * N * S::GROUP + at % S::GROUP..][..(N - 1) * S::GROUP + 1];
    let mut numbers = [S::ZERO; N];
    for c in 0..N {
        numbers[c] = own[c * S::GROUP];
    }
    numbers
}

#[inline(always)]
fn put<S: Scalar, const N: usize>(table: &mut [S], at: usize, numbers: [S; N]) {
    let own = &mut table[at / S::GROUP * N * S::GROUP + at % S::GROUP..][..(N - 1) * S::GROUP + 1];
    for c in 0..N {
        own[c * S::GROUP] = numbers[c];
    }
}
