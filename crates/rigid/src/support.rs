//! Which degrees of freedom act on which: the zeros of the mass matrix.

use alloc::vec;
use alloc::vec::Vec;

use sinew_model::Mechanism;

/// For each degree of freedom those that carry it, and those that share a branch with it, as ranges.
///
/// The entry (i, j) of the mass matrix and of all derivatives of torques is zero unless one of the two joints carries
/// the other. Factors of the mass matrix have the same zeros.
///
/// Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, section 6.5.
#[derive(Debug, Clone)]
pub(crate) struct Support {
    ancestors: Ranges,
    depth: Vec<usize>,
    carriers: Ranges,
    related: Ranges,
}

/// Lists of ranges one after the other.
#[derive(Debug, Clone)]
struct Ranges {
    first: Vec<usize>,
    ranges: Vec<(usize, usize)>,
}

impl Support {
    pub(crate) fn new(mechanism: &Mechanism) -> Self {
        let nv = mechanism.nv();
        // with mimic joints a degree of freedom acts in several places: all count as carried by all before
        let mut carries = vec![mechanism.has_mimic(); nv * nv];
        if !mechanism.has_mimic() {
            for segment in mechanism.segments() {
                for (k, dof) in (segment.first_dof..).take(segment.nv()).enumerate() {
                    (segment.first_dof..segment.first_dof + k).for_each(|i| carries[i + nv * dof] = true);
                    let mut row = segment.parent;
                    while row > 0 {
                        let carrier = &mechanism.segments()[row - 1];
                        let own = carrier.first_dof..carrier.first_dof + carrier.nv();
                        own.for_each(|i| carries[i + nv * dof] = true);
                        row = carrier.parent;
                    }
                }
            }
        }
        let ancestor = |i: usize, of: usize| i < of && carries[i + nv * of];
        let ancestors = Ranges::new(nv, ancestor);
        let carriers = Ranges::new(nv, |i, of| i == of || ancestor(i, of));
        let related = Ranges::new(nv, |i, of| i == of || ancestor(i, of) || ancestor(of, i));
        let depth = (0..nv).map(|of| (0..of).filter(|&i| ancestor(i, of)).count()).collect();
        Self { ancestors, depth, carriers, related }
    }

    /// Ranges of the degrees of freedom below `dof` that carry it, ascending.
    #[inline(always)]
    pub(crate) fn ancestors(&self, dof: usize) -> &[(usize, usize)] {
        self.ancestors.of(dof)
    }

    /// How many degrees of freedom carry `dof`.
    #[inline(always)]
    pub(crate) fn depth(&self, dof: usize) -> usize {
        self.depth[dof]
    }

    /// Ranges of the degrees of freedom that carry `dof`, and `dof` itself.
    #[inline(always)]
    pub(crate) fn carriers(&self, dof: usize) -> &[(usize, usize)] {
        self.carriers.of(dof)
    }

    /// Writes what stands above the diagonal of an n × n matrix below it too, without its zeros.
    #[inline(always)]
    pub(crate) fn mirror<S: Copy>(&self, M: &mut [S]) {
        let n = self.ancestors.first.len() - 1;
        for j in 0..n {
            for &(start, end) in self.ancestors(j) {
                let (before, own) = M.split_at_mut(n * j);
                let rows = before[n * start..n * end].chunks_exact_mut(n);
                for (row, x) in rows.zip(&own[start..end]) {
                    row[j] = *x;
                }
            }
        }
    }

    /// Ranges of the degrees of freedom that carry `dof` or are carried by it, itself included.
    #[inline(always)]
    pub(crate) fn related(&self, dof: usize) -> &[(usize, usize)] {
        self.related.of(dof)
    }
}

impl Ranges {
    fn new(n: usize, holds: impl Fn(usize, usize) -> bool) -> Self {
        let (mut first, mut ranges) = (vec![0], Vec::new());
        for of in 0..n {
            let mut start = None;
            for i in 0..=n {
                match (start, i < n && holds(i, of)) {
                    (None, true) => start = Some(i),
                    (Some(from), false) => {
                        ranges.push((from, i));
                        start = None;
                    }
                    _ => {}
                }
            }
            first.push(ranges.len());
        }
        Self { first, ranges }
    }

    #[inline(always)]
    fn of(&self, k: usize) -> &[(usize, usize)] {
        &self.ranges[self.first[k]..self.first[k + 1]]
    }
}

#[cfg(test)]
mod tests {
    use sinew_model::samples::{planar_arm, random_tree};

    use super::*;

    #[test]
    fn a_chain_is_carried_by_all_before() {
        let support = Support::new(&Mechanism::new(&planar_arm(4, 1.0, 1.0)));
        assert_eq!(support.ancestors(0), []);
        assert_eq!(support.ancestors(3), [(0, 3)]);
        assert_eq!(support.related(1), [(0, 4)]);
    }

    #[test]
    fn relations_are_mutual() {
        for seed in 0..20 {
            let support = Support::new(&Mechanism::new(&random_tree(12, seed)));
            let nv = support.related.first.len() - 1;
            let holds = |i: usize, of: usize| support.related(of).iter().any(|r| (r.0..r.1).contains(&i));
            for (i, j) in (0..nv).flat_map(|i| (0..nv).map(move |j| (i, j))) {
                assert_eq!(holds(i, j), holds(j, i));
            }
        }
    }
}
