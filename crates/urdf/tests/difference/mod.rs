//! How far two models are apart.

use sinew_model::{Inertia, JointKind, Model, Pose};

/// The largest difference of any number of two models, inertias by their own size; infinite if their names, order or
/// kinds differ.
pub fn difference(a: &Model, b: &Model) -> f64 {
    let names = |m: &Model| {
        let joints = m.joints.iter().map(|j| (j.name.clone(), j.parent, j.first_q, j.first_dof));
        let links = m.links.iter().map(|l| (l.name.clone(), l.body));
        (m.name.clone(), joints.collect::<Vec<_>>(), links.collect::<Vec<_>>(), m.nq, m.nv)
    };
    if names(a) != names(b) {
        return f64::INFINITY;
    }
    let mut worst = 0.0f64;
    for (x, y) in a.joints.iter().zip(&b.joints) {
        worst = worst.max(poses(&x.placement, &y.placement)).max(inertias(&x.inertia, &y.inertia));
        worst = worst.max(match (x.kind, y.kind) {
            (JointKind::Revolute { axis: u }, JointKind::Revolute { axis: v })
            | (JointKind::Prismatic { axis: u }, JointKind::Prismatic { axis: v }) => (u - v).norm(),
            (JointKind::Floating, JointKind::Floating) => 0.0,
            _ => f64::INFINITY,
        });
        if x.limits != y.limits || x.mimic != y.mimic {
            return f64::INFINITY;
        }
    }
    for (x, y) in a.links.iter().zip(&b.links) {
        worst = worst.max(poses(&x.body_from_link, &y.body_from_link)).max(inertias(&x.inertia, &y.inertia));
    }
    worst
}

fn poses(a: &Pose<f64>, b: &Pose<f64>) -> f64 {
    let turn = (a.rotation - b.rotation).rows.iter().map(|r| r.norm()).fold(0.0, f64::max);
    turn.max((a.translation - b.translation).norm())
}

fn inertias(a: &Inertia<f64>, b: &Inertia<f64>) -> f64 {
    let numbers = |i: &Inertia<f64>| {
        let (h, s) = (i.first_moment, i.second_moment);
        [i.mass, h.x, h.y, h.z, s.xx, s.yy, s.zz, s.xy, s.xz, s.yz]
    };
    let (a, b) = (numbers(a), numbers(b));
    let size = a.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
    a.iter().zip(&b).map(|(x, y)| (x - y).abs() / size).fold(0.0, f64::max)
}
