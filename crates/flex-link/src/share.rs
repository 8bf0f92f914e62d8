//! Which part of a bending link has which share of its mass.

use nalgebra::{Matrix3, SymmetricEigen};
use sinew_model::{BeamSection, Bending, Inertia, Model, Symmetric3, Vector3};

use crate::FlexLinkError;
use crate::chain::Chain;

// Share of a link's mass (of its mass times its length) that is rounding.
const ROUNDING: f64 = 1e-6;
// Share of the rod's own moment by which the link's may fall short of it: inertias are stated to two or three digits.
const SHORT: f64 = 0.02;

/// The inertia of each part in its own frame: axes of the link, origin where the part begins.
///
/// The beam's mass goes to the parts where it is. What the link has beside it rides, as a rigid body, on the part at
/// its centre of mass; where that is a moment of inertia without mass, it is spread along the link. A link that states
/// no inertia has its beam's. With all springs locked the parts are the link again.
pub(crate) fn shares(
    model: &Model,
    bending: &Bending,
    chain: &Chain,
) -> Result<Vec<Inertia<f64>>, FlexLinkError> {
    let parts = chain.springs.len() + 1;
    let link = &model.links[bending.link.0].inertia;
    let rods = bending.rods();
    let length: f64 = rods.iter().map(|s| s.length).sum();
    let mut inertia = vec![Inertia::default(); parts];
    for (k, own) in inertia.iter_mut().enumerate() {
        let (from, to) = extent(chain, k, length);
        *own += rod(&rods, from, to, chain.start(k), chain.along);
    }
    if link.mass == 0.0 && link.second_moment == Symmetric3::default() {
        return Ok(inertia);
    }
    let beam = rod(&rods, 0.0, length, 0.0, chain.along);
    let (lump, spread) = beside(link, &beam, length).map_err(|(what, got, allowed)| {
        FlexLinkError::DoesNotFit { link: model.links[bending.link.0].name.clone(), what, got, allowed }
    })?;
    let at = chain.part(lump.centre_of_mass().dot(chain.along));
    inertia[at] += lump.shifted(-(chain.along * chain.start(at)));
    for (k, own) in inertia.iter_mut().enumerate() {
        let (from, to) = extent(chain, k, length);
        let share = if length > 0.0 {
            (to - from) / length
        } else if k + 1 == parts {
            1.0
        } else {
            0.0
        };
        *own += Inertia { second_moment: scaled(&spread, share), ..Inertia::default() };
    }
    Ok(inertia)
}

// From where to where part k has the beam's mass.
fn extent(chain: &Chain, k: usize, length: f64) -> (f64, f64) {
    let last = k == chain.springs.len();
    let from = chain.start(k);
    let to = if last { length } else { chain.springs[k].station };
    (from.min(length), to.min(length))
}

/// A stretch of slender rod about the station `origin`.
///
/// ```text
/// m = ∫ μ dx,   h = e ∫ μ (x − x₀) dx,   I = (1 − e eᵀ) ∫ μ (x − x₀)² dx + e eᵀ ∫ j dx
/// ```
fn rod(sections: &[BeamSection], from: f64, to: f64, origin: f64, e: Vector3<f64>) -> Inertia<f64> {
    let (mut m, mut first, mut second, mut polar) = (0.0, 0.0, 0.0, 0.0);
    let mut start = 0.0;
    for section in sections {
        let (a, b) = (from.max(start) - origin, to.min(start + section.length) - origin);
        start += section.length;
        if b > a {
            let mu = section.mass_per_length;
            m += mu * (b - a);
            first += mu * (b * b - a * a) / 2.0;
            second += mu * (b * b * b - a * a * a) / 3.0;
            polar += section.polar_inertia_per_length * (b - a);
        }
    }
    let diagonal = |e: f64| second * (1.0 - e * e) + polar * e * e;
    let second_moment =
        Symmetric3 { xx: diagonal(e.x), yy: diagonal(e.y), zz: diagonal(e.z), ..Symmetric3::default() };
    Inertia { mass: m, first_moment: e * first, second_moment }
}

type Misfit = (&'static str, String, String);

// What a link has beside its beam: a rigid body, and moments of inertia without mass.
fn beside(
    link: &Inertia<f64>,
    beam: &Inertia<f64>,
    length: f64,
) -> Result<(Inertia<f64>, Symmetric3<f64>), Misfit> {
    if beam.mass == 0.0 && beam.second_moment == Symmetric3::default() {
        return Ok((*link, Symmetric3::default()));
    }
    let rest = Inertia {
        mass: link.mass - beam.mass,
        first_moment: link.first_moment - beam.first_moment,
        second_moment: link.second_moment + scaled(&beam.second_moment, -1.0),
    };
    if rest.mass < -ROUNDING * link.mass {
        return Err(("mass", format!("{} kg", beam.mass), format!("{} kg", link.mass)));
    }
    let largest = |s: &Symmetric3<f64>| s.xx.abs().max(s.yy.abs()).max(s.zz.abs());
    let short = SHORT * largest(&beam.second_moment_about_centre());
    let positive = |s: &Symmetric3<f64>| {
        clipped(s, short).ok_or_else(|| {
            let of = |s: &Symmetric3<f64>| format!("{}, {}, {} kg·m²", s.xx, s.yy, s.zz);
            let (beam, link) = (beam.second_moment_about_centre(), link.second_moment_about_centre());
            ("moment of inertia", of(&beam), of(&link))
        })
    };
    if rest.mass > ROUNDING * link.mass {
        let centre = rest.centre_of_mass();
        let s = positive(&rest.second_moment_about_centre())?;
        let about_centre = [s.xx, s.yy, s.zz, s.xy, s.xz, s.yz];
        return Ok((Inertia::at_centre_of_mass(rest.mass, centre, about_centre), Symmetric3::default()));
    }
    if rest.first_moment.norm() > ROUNDING * link.mass * length {
        let of = |i: &Inertia<f64>| {
            let c = i.centre_of_mass();
            format!("{}, {}, {} m", c.x, c.y, c.z)
        };
        return Err(("centre of mass", of(beam), of(link)));
    }
    Ok((Inertia::default(), positive(&rest.second_moment)?))
}

// The matrix without its negative part; none if that is larger than `short`.
fn clipped(s: &Symmetric3<f64>, short: f64) -> Option<Symmetric3<f64>> {
    let eigen = SymmetricEigen::new(Matrix3::new(s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz));
    if eigen.eigenvalues.min() < -short {
        return None;
    }
    if eigen.eigenvalues.min() >= 0.0 {
        return Some(*s);
    }
    let positive = Matrix3::from_diagonal(&eigen.eigenvalues.map(|x| x.max(0.0)));
    let m = eigen.eigenvectors * positive * eigen.eigenvectors.transpose();
    Some(Symmetric3 {
        xx: m[(0, 0)],
        yy: m[(1, 1)],
        zz: m[(2, 2)],
        xy: m[(0, 1)],
        xz: m[(0, 2)],
        yz: m[(1, 2)],
    })
}

fn scaled(s: &Symmetric3<f64>, k: f64) -> Symmetric3<f64> {
    Symmetric3 { xx: s.xx * k, yy: s.yy * k, zz: s.zz * k, xy: s.xy * k, xz: s.xz * k, yz: s.yz * k }
}
