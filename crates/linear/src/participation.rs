//! Which springs bend and which parts move in a mode.

use faer::Mat;
use sinew_effect::{Act, DIRECTIONS};
use sinew_model::{Inertia, JointId, VirtualJoint};
use sinew_plant::{Dynamics, ImposedOut, Plant};
use sinew_rigid::{
    Bodies, Scratch, inverse_dynamics_derivatives_with, kinetic_energy_with, mass_matrix_with,
};

use crate::describing::Port;
use crate::linearizer::mass;
use crate::seeds::{constants, lift};
use crate::state_space::Mechanical;

/// A part of the robot and its share in the energy of a mode.
#[derive(Debug, Clone, PartialEq)]
pub struct Share {
    /// In words: "shoulder spring", "forearm bending", "gravity", "forearm", "elbow motor", or `effect@place`.
    pub part: String,
    /// Its energy by the sum of the sizes of all; negative for what pushes the robot over.
    pub share: f64,
}

// Shares below this are not told.
const TOLD: f64 = 1e-4;
// Potential energy below this share of a mode's would-be energy ½ ω_max² is rounding.
const NOTHING: f64 = 1e-11;

/// The mechanics' mass and gravity at rest, and what is asked of them mode by mode.
pub(crate) struct Energies<'m, 'a> {
    mechanical: &'m Mechanical<'a>,
    plant: &'a Plant,
    p: &'m [f64],
    inertia: Vec<Inertia<f64>>,
    rotor: Vec<f64>,
    // What rotors and the links that carry them have in common, nv × nv by columns.
    coupling: Option<Vec<f64>>,
    scratch: Scratch<f64>,
    /// ∂g/∂q, nv × nv by columns.
    gravity: Vec<f64>,
    /// M over all positions: links with the rotors of rigid joints, rotors of elastic ones, and what couples them.
    pub mass: Mat<f64>,
}

impl<'m, 'a> Energies<'m, 'a> {
    pub fn new(plant: &'a Plant, p: &'m [f64], mechanical: &'m Mechanical<'a>) -> Self {
        let layout = &mechanical.linearizer.layout;
        let nv = layout.nv;
        let mut dynamics = Dynamics::new(plant, p);
        let coupling = dynamics.rotor_link_coupling(&mechanical.stands.q);
        let c = dynamics.coefficients();
        let armature: Vec<f64> =
            (0..nv).map(|i| if layout.is_elastic(i) { 0.0 } else { c.rotor[i] }).collect();
        let bodies =
            Bodies { model: plant.model(), inertia: &c.inertia, gravity: c.gravity, armature: &armature };
        let mut scratch = Scratch::new(plant.model());
        let (still, zeros) = (vec![0.0; nv], || vec![0.0; nv * nv]);
        let (mut gravity, mut by_velocity, mut links) = (zeros(), zeros(), zeros());
        let q = &mechanical.stands.q;
        inverse_dynamics_derivatives_with(
            &bodies,
            &mut scratch,
            q,
            &still,
            &still,
            &mut gravity,
            &mut by_velocity,
            &mut links,
        );
        if layout.follows() {
            // They carry no inertia, and the others are where they are with straight links.
            mass_matrix_with(&bodies, &mut scratch, &mechanical.x.q, &mut links);
        }
        let mass = mass(layout, &links, &c.rotor, coupling.as_deref());
        let (inertia, rotor) = (c.inertia.clone(), c.rotor.clone());
        Self { mechanical, plant, p, inertia, rotor, coupling, scratch, gravity, mass }
    }

    /// Potential energy by part: springs, gravity, effects; none for a motion that meets no stiffness. Shapes are
    /// columns with φᵀMφ = 1; `stiffest` is the largest ω².
    pub fn potential(&self, shapes: &Mat<f64>, stiffest: f64) -> Vec<Vec<Share>> {
        let layout = &self.mechanical.linearizer.layout;
        let (nv, np) = (layout.nv, layout.positions());
        let (m, C) = (layout.driven.len(), &self.mechanical.matrices.C);
        let mut all: Vec<Vec<Share>> = Vec::new();
        for mode in 0..shapes.ncols() {
            let shape: Vec<f64> = shapes.col(mode).iter().copied().collect();
            let moves = self.mechanical.linearizer.displacement(&shape);
            let mut parts = Vec::new();
            for (row, &dof) in layout.driven.iter().enumerate().filter(|&(_, &i)| layout.is_elastic(i)) {
                // ½ δ ∂τ_j
                let torque: f64 = (0..np).map(|k| C[(4 * m + row, k)] * shape[k]).sum();
                let deflection = shape[layout.motor[dof]] - moves[dof];
                let part = format!("{} spring", self.plant.model().dof_name(dof));
                parts.push(Share { part, share: 0.5 * deflection * torque });
            }
            for v in self.plant.virtual_joints() {
                // ½ K v²
                let bend = moves[v.dof];
                add(&mut parts, self.bending(v), 0.5 * v.stiffness * bend * bend);
            }
            // ½ φᵀ (∂g/∂q) φ
            let row = |i: usize| (0..nv).map(|j| self.gravity[i + nv * j] * moves[j]).sum::<f64>();
            let weight = (0..nv).map(|i| 0.5 * moves[i] * row(i)).sum();
            parts.push(Share { part: "gravity".into(), share: weight });
            all.push(parts);
        }
        self.add_effects(shapes, &mut all);
        all.into_iter().map(|parts| shared(parts, NOTHING * stiffest)).collect()
    }

    // "forearm bending", and about which axis where there are several.
    fn bending(&self, joint: &VirtualJoint) -> String {
        let link = &self.plant.model().links[joint.link.0].name;
        let several =
            self.plant.virtual_joints().iter().any(|v| v.link == joint.link && v.axis != joint.axis);
        if several { format!("{link} bending about {}", joint.axis) } else { format!("{link} bending") }
    }

    // −½ φᵀ ∂f φ of every effect that pushes on links or motors.
    fn add_effects(&self, shapes: &Mat<f64>, all: &mut [Vec<Share>]) {
        let layout = &self.mechanical.linearizer.layout;
        let described = &self.mechanical.described;
        let moves: Vec<Vec<f64>> = (0..shapes.ncols())
            .map(|mode| {
                let shape: Vec<f64> = shapes.col(mode).iter().copied().collect();
                self.mechanical.linearizer.displacement(&shape)
            })
            .collect();
        let motor = |dof: usize, mode: usize| match layout.is_elastic(dof) {
            true => shapes[(layout.motor[dof], mode)],
            false => moves[mode][dof],
        };
        let still = constants(&vec![0.0; layout.nv]);
        let mut out = ImposedOut::new(layout.nv);
        for (k, active) in self.plant.effects().iter().enumerate() {
            let label = active.label();
            let acts = active.effect.acts();
            let gains = described.iter().find(|d| d.effect == label).map(|d| &d.gains);
            if let Some(gains) = gains {
                for (mode, parts) in all.iter_mut().enumerate() {
                    let along = |port| match port {
                        Port::Motor(dof) => motor(dof, mode),
                        Port::Link(dof) => moves[mode][dof],
                        // Part of the spring already.
                        Port::Spring(_) => 0.0,
                    };
                    let energy: f64 =
                        gains.iter().map(|g| -0.5 * along(g.output) * g.position * along(g.input)).sum();
                    parts.push(Share { part: label.clone(), share: energy });
                }
                continue;
            }
            if ![Act::LinkForce, Act::MotorForce, Act::LoadedMotorForce].iter().any(|a| acts.contains(a)) {
                continue;
            }
            let mut dynamics = Dynamics::of_some(self.plant, &constants(self.p), |_| true, |j| j == k);
            for (chunk, parts) in all.chunks_mut(DIRECTIONS).enumerate() {
                let mut x = lift(&self.mechanical.stands);
                for direction in 0..parts.len() {
                    let mode = chunk * DIRECTIONS + direction;
                    for dof in 0..layout.nv {
                        x.q[dof].derivative[direction] = moves[mode][dof];
                        x.theta[dof].derivative[direction] = motor(dof, mode);
                    }
                }
                dynamics.gear_torque(&x, &still, &mut out);
                let (gears, link) = (dynamics.gears(), dynamics.link_force());
                for (direction, parts) in parts.iter_mut().enumerate() {
                    let mode = chunk * DIRECTIONS + direction;
                    let energy = |dof: usize| {
                        let pull = out.tau_j[dof] * (gears[dof].slope + 1.0) - out.tau_m[dof];
                        -0.5 * moves[mode][dof] * link[dof].derivative[direction]
                            - 0.5 * motor(dof, mode) * pull.derivative[direction]
                    };
                    // Links that bend push back too, and count for themselves.
                    let own = layout.driven.iter().map(|&dof| energy(dof)).sum();
                    parts.push(Share { part: label.clone(), share: own });
                }
            }
        }
    }

    /// Kinetic energy by part: links and motors.
    pub fn kinetic(&mut self, shape: &[f64]) -> Vec<Share> {
        let layout = &self.mechanical.linearizer.layout;
        let model = self.plant.model();
        // Links that follow their load carry no kinetic energy of their own.
        let rate = |&place: &usize| shape.get(place).copied().unwrap_or(0.0);
        let qd: Vec<f64> = layout.link.iter().map(rate).collect();
        let q = &self.mechanical.x.q;
        let mut parts: Vec<Share> = Vec::new();
        for body in 0..model.joints.len() {
            let mut alone = vec![Inertia::default(); model.joints.len()];
            alone[body] = self.inertia[body];
            let bodies = Bodies::new(model, &alone);
            let energy = kinetic_energy_with(&bodies, &mut self.scratch, q, &qd);
            // Parts of a link that bends count for the link.
            let bends =
                self.plant.virtual_joints().iter().find(|v| model.joint_of_dof(v.dof) == JointId(body));
            let carried = model.links.iter().find(|l| l.body == Some(JointId(body)));
            let link = bends.map(|v| &model.links[v.link.0]).or(carried);
            let part = link.map_or_else(|| model.joints[body].name.clone(), |l| l.name.clone());
            add(&mut parts, part, energy);
        }
        for &dof in &layout.driven {
            // ½ B θ̇² + κB θ̇ u·ω
            let rate = shape[layout.motor[dof]];
            let of_link = |s: &Vec<f64>| (0..qd.len()).map(|j| s[dof + qd.len() * j] * qd[j]).sum::<f64>();
            let turned = self.coupling.as_ref().map_or(0.0, of_link);
            let part = format!("{} motor", model.dof_name(dof));
            parts.push(Share { part, share: (0.5 * self.rotor[dof] * rate + turned) * rate });
        }
        shared(parts, 0.0)
    }
}

fn add(parts: &mut Vec<Share>, part: String, energy: f64) {
    match parts.iter_mut().find(|known| known.part == part) {
        Some(known) => known.share += energy,
        None => parts.push(Share { part, share: energy }),
    }
}

// Energies as shares, the largest first.
fn shared(mut parts: Vec<Share>, nothing: f64) -> Vec<Share> {
    let total: f64 = parts.iter().map(|p| p.share.abs()).sum();
    if total <= nothing {
        return Vec::new();
    }
    parts.iter_mut().for_each(|p| p.share /= total);
    parts.retain(|p| p.share.abs() >= TOLD);
    parts.sort_by(|a, b| b.share.abs().total_cmp(&a.share.abs()));
    parts
}
