//! Where the lumped springs of a beam stand, and how stiff they are.

use nalgebra::{DMatrix, SymmetricEigen};
use sinew_model::BeamSection;

/// A spring that takes over the compliance of a stretch of beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LumpedSpring {
    /// Where it stands, m from the root.
    pub station: f64,
    /// K, N·m/rad.
    pub stiffness: f64,
}

/// What a spring stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpringKind {
    /// E I: turns about an axis across the beam.
    Bending,
    /// G J: turns about the beam's own line.
    Torsion,
}

/// Points at which springs stand in a stretch of their own.
const PAIR: usize = 2;

/// `count` springs for a beam of these sections, from the root to the tip.
///
/// What a load does to a tip is an integral over the beam's compliance, and springs are a quadrature of it:
///
/// ```text
/// w = ∫ M(x) (L − x)/EI dx ≈ Σ M(xᵢ)(L − xᵢ) cᵢ,   kᵢ = 1/cᵢ
/// ```
///
/// The springs stand at the Gauss points of the measure dx/EI, two by two in equal stretches (three in the first, if
/// their number is odd). So deflection and slope are exact under forces and moments at the tip and under an even load
/// from two springs on, whatever the sections, and natural frequencies converge with the fourth power of the number. A single bending spring
/// stands at the Gauss point of (L − x) dx/EI: both deflection and slope are exact under a force at the tip. A
/// twist needs Σ cᵢ only, which is right for any number; its frequencies converge with the second power.
///
/// Sections without the rigidity asked for count as rigid. Empty if there is no spring or no section.
///
/// # Example
/// One spring of an even beam stands at a third of it, with 4EI/3L:
/// ```
/// use sinew_flex_link::{SpringKind, lumped_springs};
/// # use sinew_model::BeamSection;
/// # let beam = BeamSection { length: 3.0, flexural_rigidity: 9.0, torsional_rigidity: None, mass_per_length: 1.0, polar_inertia_per_length: 0.0 };
/// let spring = lumped_springs(&[beam], 1, SpringKind::Bending)[0];
/// approx::assert_relative_eq!(spring.station, 1.0, max_relative = 1e-14);
/// approx::assert_relative_eq!(spring.stiffness, 4.0, max_relative = 1e-14);
/// ```
/// Source: Golub, Welsch, *Calculation of Gauss quadrature rules*, Math. Comp. 23, 1969; rigid finite elements:
/// Wittbrodt, Adamiec-Wójcik, Wojciech, *Dynamics of Flexible Multibody Systems*, 2006.
pub fn lumped_springs(sections: &[BeamSection], count: usize, kind: SpringKind) -> Vec<LumpedSpring> {
    let length: f64 = sections.iter().map(|s| s.length).sum();
    let pieces = pieces(sections, kind);
    if count == 0 || pieces.is_empty() {
        return Vec::new();
    }
    if count == 1 && kind == SpringKind::Bending {
        // c (L − x) = ∫ (L − x)/EI dx at its own Gauss point
        let moment: Vec<Node> = points(&pieces)
            .into_iter()
            .map(|p| Node { weight: p.weight * (length - p.place), ..p })
            .collect();
        return gauss(&moment, 1).into_iter().map(|p| spring(p, length - p.place)).collect();
    }
    // stretches in proportion to their springs
    let (stretches, odd) = ((count / PAIR).max(1), count % PAIR);
    let mut springs = Vec::new();
    let mut taken = 0;
    for stretch in 0..stretches {
        let own = if count == 1 { 1 } else { PAIR + if stretch == 0 { odd } else { 0 } };
        let end = |springs: usize| length * springs as f64 / count as f64;
        let (from, to) = (end(taken), end(taken + own));
        let inside: Vec<Piece> = pieces.iter().filter_map(|p| p.within(from, to)).collect();
        springs.extend(gauss(&points(&inside), own).into_iter().map(|p| spring(p, 1.0)));
        taken += own;
    }
    springs
}

fn spring(point: Node, lever: f64) -> LumpedSpring {
    LumpedSpring { station: point.place, stiffness: lever / point.weight }
}

/// A stretch of even compliance per length.
#[derive(Debug, Clone, Copy)]
struct Piece {
    from: f64,
    to: f64,
    density: f64,
}

impl Piece {
    fn within(&self, from: f64, to: f64) -> Option<Self> {
        let (from, to) = (self.from.max(from), self.to.min(to));
        (to > from).then_some(Self { from, to, ..*self })
    }
}

fn pieces(sections: &[BeamSection], kind: SpringKind) -> Vec<Piece> {
    let mut from = 0.0;
    let mut pieces = Vec::new();
    for section in sections {
        let rigidity = match kind {
            SpringKind::Bending => Some(section.flexural_rigidity),
            SpringKind::Torsion => section.torsional_rigidity,
        };
        let to = from + section.length;
        pieces.extend(rigidity.filter(|r| *r > 0.0).map(|r| Piece { from, to, density: r.recip() }));
        from = to;
    }
    pieces
}

/// A point of a discrete measure.
#[derive(Debug, Clone, Copy)]
struct Node {
    place: f64,
    weight: f64,
}

// Gauss and Legendre's points of four: exact for all products of polynomials that up to three points need.
const LEGENDRE: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// A measure with the same integrals of all polynomials up to the seventh degree.
fn points(pieces: &[Piece]) -> Vec<Node> {
    let of = |p: &Piece| {
        let (middle, half, density) = (0.5 * (p.from + p.to), 0.5 * (p.to - p.from), p.density);
        LEGENDRE.map(|(x, w)| Node { place: middle + half * x, weight: w * half * density })
    };
    pieces.iter().flat_map(of).collect()
}

/// The `n` Gauss points of a measure: nodes are the eigenvalues of its Jacobi matrix.
fn gauss(measure: &[Node], n: usize) -> Vec<Node> {
    let total: f64 = measure.iter().map(|p| p.weight).sum();
    if total <= 0.0 {
        return Vec::new();
    }
    let mut jacobi = DMatrix::zeros(n, n);
    let (mut before, mut now, mut norm) = (vec![0.0; measure.len()], vec![1.0; measure.len()], total);
    let mut beta = 0.0;
    for k in 0..n {
        // α = ⟨x p, p⟩/⟨p, p⟩,   p_next = (x − α) p − β p_before,   β = ⟨p, p⟩/⟨p_before, p_before⟩
        let moment: f64 = measure.iter().zip(&now).map(|(m, p)| m.weight * m.place * p * p).sum();
        let alpha = moment / norm;
        jacobi[(k, k)] = alpha;
        let next: Vec<f64> =
            (0..measure.len()).map(|i| (measure[i].place - alpha) * now[i] - beta * before[i]).collect();
        (before, now) = (now, next);
        let next_norm: f64 = measure.iter().zip(&now).map(|(m, p)| m.weight * p * p).sum();
        beta = next_norm / norm;
        norm = next_norm;
        if k + 1 < n {
            jacobi[(k, k + 1)] = beta.sqrt();
            jacobi[(k + 1, k)] = beta.sqrt();
        }
    }
    let eigen = SymmetricEigen::new(jacobi);
    let mut nodes: Vec<Node> = (0..n)
        .map(|k| Node {
            place: eigen.eigenvalues[k],
            weight: total * eigen.eigenvectors[(0, k)] * eigen.eigenvectors[(0, k)],
        })
        .collect();
    nodes.sort_by(|a, b| a.place.total_cmp(&b.place));
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn section(length: f64, flexural_rigidity: f64) -> BeamSection {
        BeamSection {
            length,
            flexural_rigidity,
            torsional_rigidity: Some(0.4 * flexural_rigidity),
            mass_per_length: 1.0,
            polar_inertia_per_length: 0.0,
        }
    }

    // Σ cᵢ (L − xᵢ)^power against ∫ (L − x)^power/EI dx.
    fn moment(springs: &[LumpedSpring], length: f64, power: i32) -> f64 {
        springs.iter().map(|s| (length - s.station).powi(power) / s.stiffness).sum()
    }

    fn exact(sections: &[BeamSection], power: i32) -> f64 {
        let length: f64 = sections.iter().map(|s| s.length).sum();
        let mut from = 0.0;
        let mut sum = 0.0;
        for s in sections {
            let (a, b) = (length - from, length - from - s.length);
            sum += (a.powi(power + 1) - b.powi(power + 1)) / (f64::from(power + 1) * s.flexural_rigidity);
            from += s.length;
        }
        sum
    }

    #[test]
    fn from_two_springs_on_tip_loads_and_even_loads_are_exact() {
        let stepped = [section(0.8, 1200.0), section(0.6, 500.0), section(0.1, 2000.0)];
        for sections in [&stepped[..1], &stepped[..2], &stepped] {
            let length: f64 = sections.iter().map(|s| s.length).sum();
            for n in 2..=9 {
                let springs = lumped_springs(sections, n, SpringKind::Bending);
                assert_eq!(springs.len(), n);
                assert!(springs.windows(2).all(|w| w[0].station < w[1].station));
                assert!(springs[0].station > 0.0 && springs[n - 1].station < length);
                for power in 0..=3 {
                    let (got, want) = (moment(&springs, length, power), exact(sections, power));
                    assert!((got / want - 1.0).abs() < 1e-12, "{n} springs, power {power}: {got} {want}");
                }
            }
        }
    }

    #[test]
    fn one_spring_gives_deflection_and_slope_of_a_tip_force() {
        let stepped = [section(0.8, 1200.0), section(0.6, 500.0)];
        let springs = lumped_springs(&stepped, 1, SpringKind::Bending);
        for power in [1, 2] {
            let (got, want) = (moment(&springs, 1.4, power), exact(&stepped, power));
            assert!((got / want - 1.0).abs() < 1e-13);
        }
    }

    #[test]
    fn any_number_of_springs_has_the_twist_of_the_beam() {
        let stepped = [section(0.8, 1200.0), section(0.6, 500.0)];
        for n in 1..=9 {
            let springs = lumped_springs(&stepped, n, SpringKind::Torsion);
            let (got, want) = (moment(&springs, 1.4, 0), exact(&stepped, 0) / 0.4);
            assert!((got / want - 1.0).abs() < 1e-13, "{n}: {got} {want}");
        }
        assert!((lumped_springs(&stepped[..1], 1, SpringKind::Torsion)[0].station - 0.4).abs() < 1e-15);
    }
}
