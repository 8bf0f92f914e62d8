//! Linear models of a plant at any state, without allocation from one to the next.

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};
use sinew_effect::{Act, Derivative, Relaxation, Site};
use sinew_model::{Inertia, Vector3};
use sinew_plant::{Dynamics, ImposedOut, LinkState, Plant, Rates, State};
use sinew_rigid::{
    Bodies, Scratch, forward_dynamics_derivatives_with, inverse_mass_matrix_with, mass_matrix_with,
};

use crate::describing::Gain;
use crate::layout::{Coordinate, FOLLOWS, Layout};
use crate::seeds::{chunks, constants};

/// The quantities of the outputs, each of every driven joint.
pub(crate) const OUTPUTS: [&str; 5] =
    ["motor_position", "motor_velocity", "joint_position", "joint_velocity", "joint_torque"];

/// A linear system without names.
///
/// ```text
/// δẋ = A δx + B δu,   δy = C δx + D δu
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Matrices {
    /// ∂ẋ/∂x.
    pub A: Mat<f64>,
    /// ∂ẋ/∂u.
    pub B: Mat<f64>,
    /// ∂y/∂x.
    pub C: Mat<f64>,
    /// ∂y/∂u.
    pub D: Mat<f64>,
}

/// Makes linear models of one plant, state after state.
///
/// ```text
/// q̈ = M⁻¹ (τ_j + f_link − h):   δq̈ = ∂q̈/∂q δq + ∂q̈/∂q̇ δq̇ + M⁻¹ δ(τ_j + f_link)
/// θ̈ = B⁻¹ (τ_m − τ_j ∂δ/∂θ + f_motor)
/// ```
///
/// The derivatives of the rigid bodies are analytic; those of springs and effects, whose laws are cheap, come from
/// dual numbers through the same lines that a simulation runs.
#[derive(Debug)]
pub struct Linearizer<'a> {
    pub(crate) layout: Layout,
    plain: Dynamics<'a, f64>,
    seeded: Dynamics<'a, Derivative>,
    gains: Vec<Gain>,
    /// A friction in a rigid joint depends on the torque that the joint hands on, or links follow their load at once:
    /// only the whole dynamics knows it.
    whole: bool,
    x: LinkState<Derivative>,
    still: Vec<Derivative>,
    forces: ImposedOut<Derivative>,
    plain_forces: ImposedOut<f64>,
    relaxation: Vec<Relaxation<Derivative>>,
    bodies: Constants,
    work: Work,
    matrices: Matrices,
}

// The plant's constants as plain numbers.
#[derive(Debug)]
struct Constants {
    inertia: Vec<Inertia<f64>>,
    gravity: Vector3<f64>,
    rotor: Vec<f64>,
    armature: Vec<f64>,
    scratch: Scratch<f64>,
}

// nv × nv by columns, and derivatives of forces, nv × states by columns.
#[derive(Debug)]
struct Work {
    torque: Vec<f64>,
    by_position: Vec<f64>,
    by_velocity: Vec<f64>,
    by_torque: Vec<f64>,
    on_link: Vec<f64>,
    on_motor: Vec<f64>,
    spring: Vec<f64>,
    /// ∂/∂x of where joints stand, nv × states by columns.
    stands: Vec<f64>,
}

impl<'a> Linearizer<'a> {
    /// For `plant` with parameters `p`, every effect by its slope. Drives and sensors are ideal.
    ///
    /// # Panics
    /// If `p` has the wrong length.
    pub fn new(plant: &'a Plant, p: &[f64]) -> Self {
        Self::with_gains(plant, p, &[], Vec::new())
    }

    /// The same in which the effects `described` are replaced by gains.
    pub(crate) fn with_gains(plant: &'a Plant, p: &[f64], described: &[usize], gains: Vec<Gain>) -> Self {
        let smooth = |k: usize| !described.contains(&k);
        let layout = Layout::new(plant, smooth);
        let (nv, n, m) = (layout.nv, layout.len(), layout.driven.len());
        let plain = Dynamics::new(plant, p);
        let c = plain.coefficients();
        let armature = (0..nv).map(|i| if layout.is_elastic(i) { 0.0 } else { c.rotor[i] }).collect();
        let bodies = Constants {
            inertia: c.inertia.clone(),
            gravity: c.gravity,
            rotor: c.rotor.clone(),
            armature,
            scratch: Scratch::new(plant.model()),
        };
        let whole = layout.follows()
            || plant.couples_rotors()
            || plant.effects().iter().enumerate().any(|(k, e)| {
                let rigid = match e.effect.site() {
                    Site::Dof(dof) => !layout.is_elastic(dof),
                    _ => true,
                };
                smooth(k) && rigid && e.effect.acts().contains(&Act::LoadedMotorForce)
            });
        let work = Work {
            torque: vec![0.0; nv],
            by_position: vec![0.0; nv * nv],
            by_velocity: vec![0.0; nv * nv],
            by_torque: vec![0.0; nv * nv],
            on_link: vec![0.0; nv * n],
            on_motor: vec![0.0; nv * n],
            spring: vec![0.0; nv * n],
            stands: vec![0.0; nv * n],
        };
        let outputs = OUTPUTS.len() * m;
        let matrices = Matrices {
            A: Mat::zeros(n, n),
            B: Mat::zeros(n, m),
            C: Mat::zeros(outputs, n),
            D: Mat::zeros(outputs, m),
        };
        let x = LinkState::zero(plant);
        Self {
            seeded: Dynamics::of_some(plant, &constants(p), smooth, smooth),
            still: constants(&vec![0.0; nv]),
            forces: ImposedOut::new(nv),
            plain_forces: ImposedOut::new(nv),
            relaxation: vec![Relaxation::default(); plant.state_len()],
            layout,
            plain,
            gains,
            whole,
            x,
            bodies,
            work,
            matrices,
        }
    }

    /// The linear model about the state `x` under the acting motor torque `tau_m`, N·m (N). It need not be at rest.
    ///
    /// # Panics
    /// If `x` is of another plant, or `tau_m` has the wrong length.
    pub fn at(&mut self, x: &State<f64>, tau_m: &[f64]) -> &Matrices {
        assert_eq!(tau_m.len(), self.layout.nv, "tau_m: one torque for each degree of freedom");
        if self.whole {
            self.by_dual_numbers(x, tau_m);
        } else {
            self.forces(x);
            self.torques(x, tau_m);
            let c = &mut self.bodies;
            let bodies = Bodies {
                model: self.plain.plant().model(),
                inertia: &c.inertia,
                gravity: c.gravity,
                armature: &c.armature,
            };
            let Work { torque, by_position, by_velocity, by_torque, .. } = &mut self.work;
            let scratch = &mut c.scratch;
            forward_dynamics_derivatives_with(
                &bodies,
                scratch,
                &x.q,
                &x.qd,
                torque,
                by_position,
                by_velocity,
                by_torque,
            );
            self.assemble();
        }
        &self.matrices
    }

    /// How far each degree of freedom moves in a motion of the positions `shape`, at the state last taken: links that
    /// follow their load included.
    pub(crate) fn displacement(&self, shape: &[f64]) -> Vec<f64> {
        let layout = &self.layout;
        if !layout.follows() {
            return layout.link.iter().map(|&place| shape[place]).collect();
        }
        let by_position = |dof: usize, k: usize| self.work.stands[dof + layout.nv * k];
        let of = |dof: usize| shape.iter().enumerate().map(|(k, s)| by_position(dof, k) * s).sum();
        (0..layout.nv).map(of).collect()
    }

    // Derivatives of the forces of springs and effects, and the rates of own states.
    fn forces(&mut self, x: &State<f64>) {
        let Self { layout, seeded, x: state, still, forces, relaxation, work, matrices, .. } = self;
        let (nv, np, n) = (layout.nv, layout.positions(), layout.len());
        state.set_values(x);
        for chunk in chunks(n) {
            for (direction, k) in chunk.clone().enumerate() {
                layout.seed(state, k, direction, 1.0);
            }
            seeded.gear_torque(state, still, forces);
            let (gears, link_force) = (seeded.gears(), seeded.link_force());
            for i in 0..nv {
                let elastic = layout.is_elastic(i);
                let (spring, pull) = (forces.tau_j[i], forces.tau_m[i]);
                // f_motor − τ_j ∂δ/∂θ of elastic joints, f_motor of rigid ones
                let motor = if elastic { -pull } else { spring * (gears[i].slope + 1.0) - pull };
                let link = link_force[i] + if elastic { spring } else { motor };
                for (direction, k) in chunk.clone().enumerate() {
                    work.on_link[i + nv * k] = link.derivative[direction];
                    work.on_motor[i + nv * k] = motor.derivative[direction];
                    work.spring[i + nv * k] = if elastic { spring.derivative[direction] } else { 0.0 };
                }
                work.torque[i] = link.value;
            }
            if !layout.own.is_empty() {
                seeded.relaxations(state, relaxation);
                for (row, &own) in layout.own.iter().enumerate() {
                    // ż = rate (target − z)
                    let r = relaxation[own];
                    let rate = r.rate * (r.target - state.z[own]);
                    for (direction, k) in chunk.clone().enumerate() {
                        matrices.A[(2 * np + row, k)] = rate.derivative[direction];
                    }
                }
            }
            for (direction, k) in chunk.enumerate() {
                layout.seed(state, k, direction, 0.0);
            }
        }
        for gain in &self.gains {
            let Work { on_link, on_motor, spring, .. } = &mut *work;
            gain.add(layout, on_link, on_motor, spring);
        }
    }

    // What accelerates the links.
    fn torques(&mut self, x: &State<f64>, tau_m: &[f64]) {
        let layout = &self.layout;
        let rigid = |i: usize| !layout.is_elastic(i);
        if !self.gains.is_empty() {
            // Replaced effects have no slope, but a value.
            self.plain_forces.tau_m.fill(0.0);
            let zero = &self.plain_forces.qdd.clone();
            self.plain.gear_torque(x, zero, &mut self.plain_forces);
            let (gears, link_force) = (self.plain.gears(), self.plain.link_force());
            for i in 0..layout.nv {
                let spring = self.plain_forces.tau_j[i];
                let motor = spring * (gears[i].slope + 1.0) - self.plain_forces.tau_m[i];
                self.work.torque[i] = link_force[i] + if rigid(i) { motor } else { spring };
            }
        }
        for &i in layout.driven.iter().filter(|&&i| rigid(i)) {
            self.work.torque[i] += tau_m[i];
        }
    }

    fn assemble(&mut self) {
        let Self { layout, work: w, bodies, matrices, .. } = self;
        let Matrices { A, B, C, D } = matrices;
        let (nv, np, n, m) = (layout.nv, layout.positions(), layout.len(), layout.driven.len());
        A.submatrix_mut(0, 0, 2 * np, n).fill(0.0);
        for k in 0..np {
            A[(k, np + k)] = 1.0;
        }
        for k in 0..n {
            // δq̈ = M⁻¹ δf + ∂q̈/∂q δq + ∂q̈/∂q̇ δq̇
            for j in 0..nv {
                let force = w.on_link[j + nv * k];
                if force != 0.0 {
                    for i in 0..nv {
                        A[(np + layout.link[i], k)] += w.by_torque[i + nv * j] * force;
                    }
                }
            }
            let slope = match k {
                k if k < np => Some((&w.by_position, layout.coordinates[k])),
                k if k < 2 * np => Some((&w.by_velocity, layout.coordinates[k - np])),
                _ => None,
            };
            if let Some((slope, Coordinate::Link(dof) | Coordinate::Bend(dof))) = slope {
                for i in 0..nv {
                    A[(np + layout.link[i], k)] += slope[i + nv * dof];
                }
            }
            // δθ̈ = B⁻¹ δ(f_motor − τ_j ∂δ/∂θ)
            for i in (0..nv).filter(|&i| layout.is_elastic(i)) {
                A[(np + layout.motor[i], k)] = w.on_motor[i + nv * k] / bodies.rotor[i];
            }
        }
        B.fill(0.0);
        C.fill(0.0);
        D.fill(0.0);
        for (column, &dof) in layout.driven.iter().enumerate() {
            if layout.is_elastic(dof) {
                B[(np + layout.motor[dof], column)] = 1.0 / bodies.rotor[dof];
            } else {
                for i in 0..nv {
                    B[(np + layout.link[i], column)] = w.by_torque[i + nv * dof];
                }
            }
        }
        for (row, &dof) in layout.driven.iter().enumerate() {
            let (link, motor, torque) = (layout.link[dof], layout.motor[dof], 4 * m + row);
            C[(row, motor)] = 1.0;
            C[(m + row, np + motor)] = 1.0;
            C[(2 * m + row, link)] = 1.0;
            C[(3 * m + row, np + link)] = 1.0;
            let elastic = layout.is_elastic(dof);
            for k in 0..n {
                // τ_j of the spring, or of a rigid joint what its rotor leaves: τ_m + f_motor − B q̈
                C[(torque, k)] = if elastic {
                    w.spring[dof + nv * k]
                } else {
                    w.on_motor[dof + nv * k] - bodies.rotor[dof] * A[(np + link, k)]
                };
            }
            if !elastic {
                for column in 0..m {
                    D[(torque, column)] = -bodies.rotor[dof] * B[(np + link, column)];
                }
                D[(torque, row)] += 1.0;
            }
        }
    }

    /// The same by dual numbers through the whole dynamics.
    pub(crate) fn by_dual_numbers(&mut self, x: &State<f64>, tau_m: &[f64]) -> &Matrices {
        let Self { layout, seeded, x: state, matrices, work, .. } = self;
        let (n, m, nv) = (layout.len(), layout.driven.len(), layout.nv);
        state.set_values(x);
        let mut tau = constants(tau_m);
        let mut rates = Rates::new(seeded.plant());
        for chunk in chunks(n + m) {
            for (direction, k) in chunk.clone().enumerate() {
                match k {
                    k if k < n => layout.seed(state, k, direction, 1.0),
                    k => tau[layout.driven[k - n]].derivative[direction] = 1.0,
                }
            }
            seeded.forward(state, &tau, &mut rates);
            let by_coordinate = |link: &[Derivative], motor: &[Derivative]| -> Vec<Derivative> {
                let of = |c: &Coordinate| match *c {
                    Coordinate::Link(dof) | Coordinate::Bend(dof) => link[dof],
                    Coordinate::Motor(dof) => motor[dof],
                };
                layout.coordinates.iter().map(of).collect()
            };
            let own = layout.own.iter().map(|&z| rates.zd[z]).collect();
            let speeds = by_coordinate(&state.qd, &state.thetad);
            let rate = [speeds, by_coordinate(&rates.qdd, &rates.thetadd), own].concat();
            let stands = seeded.settled().unwrap_or(state);
            let output = [&state.theta[..], &state.thetad, &stands.q, &stands.qd, &rates.tau_j];
            for (direction, k) in chunk.clone().enumerate() {
                let (into_rate, into_output, column) = match k {
                    k if k < n => (&mut matrices.A, &mut matrices.C, k),
                    k => (&mut matrices.B, &mut matrices.D, k - n),
                };
                for (dof, q) in stands.q.iter().enumerate().filter(|_| k < n) {
                    work.stands[dof + nv * k] = q.derivative[direction];
                }
                for (row, value) in rate.iter().enumerate() {
                    into_rate[(row, column)] = value.derivative[direction];
                }
                for (quantity, values) in output.iter().enumerate() {
                    for (row, &dof) in layout.driven.iter().enumerate() {
                        into_output[(quantity * m + row, column)] = values[dof].derivative[direction];
                    }
                }
            }
            for (direction, k) in chunk.enumerate() {
                match k {
                    k if k < n => layout.seed(state, k, direction, 0.0),
                    k => tau[layout.driven[k - n]].derivative[direction] = 0.0,
                }
            }
        }
        if !self.gains.is_empty() {
            self.add_gains(x);
        }
        &self.matrices
    }

    // Adds replaced effects to a model that was made without them.
    fn add_gains(&mut self, x: &State<f64>) {
        let Self { layout, gains, work: w, bodies: c, matrices, plain, .. } = self;
        let (nv, np, n, m) = (layout.nv, layout.positions(), layout.len(), layout.driven.len());
        let bodies = Bodies {
            model: plain.plant().model(),
            inertia: &c.inertia,
            gravity: c.gravity,
            armature: &c.armature,
        };
        if layout.follows() {
            inverse_of_moving(layout, &bodies, &mut c.scratch, &x.q, &mut w.by_torque);
        } else {
            inverse_mass_matrix_with(&bodies, &mut c.scratch, &x.q, &mut w.by_torque);
        }
        for forces in [&mut w.on_link, &mut w.on_motor, &mut w.spring] {
            forces.fill(0.0);
        }
        for gain in gains {
            gain.add(layout, &mut w.on_link, &mut w.on_motor, &mut w.spring);
        }
        let coupling = plain.rotor_link_coupling(&x.q);
        let coupled = coupling.as_deref().map(|s| coupled_inverse(layout, &bodies, &c.rotor, s, &x.q));
        let Matrices { A, C, .. } = matrices;
        for k in 0..n {
            let of = |forces: &[f64], dof: usize| forces[dof + nv * k];
            let acceleration: Vec<f64> = (0..np)
                .map(|i| match (&coupled, layout.coordinates[i]) {
                    (Some(inverse), _) => {
                        let force = |j: usize| match layout.coordinates[j] {
                            Coordinate::Motor(dof) => of(&w.on_motor, dof),
                            link => of(&w.on_link, link.dof()),
                        };
                        (0..np).map(|j| inverse[(i, j)] * force(j)).sum()
                    }
                    (None, Coordinate::Motor(dof)) => of(&w.on_motor, dof) / c.rotor[dof],
                    (None, link) => {
                        (0..nv).map(|j| w.by_torque[link.dof() + nv * j] * of(&w.on_link, j)).sum()
                    }
                })
                .collect();
            for (i, a) in acceleration.iter().enumerate() {
                A[(np + i, k)] += a;
            }
            for (row, &dof) in layout.driven.iter().enumerate() {
                C[(4 * m + row, k)] += if layout.is_elastic(dof) {
                    of(&w.spring, dof)
                } else {
                    let turned = |s: &[f64]| {
                        (0..nv).map(|j| s[dof + nv * j] * acceleration[layout.link[j]]).sum::<f64>()
                    };
                    let own = c.rotor[dof] * acceleration[layout.link[dof]];
                    of(&w.on_motor, dof) - own - coupling.as_deref().map_or(0.0, turned)
                };
            }
        }
    }
}

// M⁻¹ over all positions of a robot whose rotors are coupled with their links; none of its links follows its load.
fn coupled_inverse(
    layout: &Layout,
    bodies: &Bodies<f64>,
    rotor: &[f64],
    coupling: &[f64],
    q: &[f64],
) -> Mat<f64> {
    let mut links = vec![0.0; layout.nv * layout.nv];
    mass_matrix_with(bodies, &mut Scratch::new(bodies.model), q, &mut links);
    mass(layout, &links, rotor, Some(coupling)).partial_piv_lu().inverse()
}

/// M over all positions: links (with the rotors of rigid joints; nv × nv by columns), rotors of elastic joints, and what
/// rotors have in common with the links that carry them.
pub(crate) fn mass(layout: &Layout, links: &[f64], rotor: &[f64], coupling: Option<&[f64]>) -> Mat<f64> {
    let (nv, np) = (layout.nv, layout.positions());
    let mut mass = Mat::from_fn(np, np, |i, j| match (layout.coordinates[i], layout.coordinates[j]) {
        (Coordinate::Motor(i), Coordinate::Motor(j)) if i == j => rotor[i],
        (Coordinate::Motor(_), _) | (_, Coordinate::Motor(_)) => 0.0,
        (i, j) => links[i.dof() + nv * j.dof()],
    });
    for (k, s) in coupling.into_iter().flatten().enumerate().filter(|(_, s)| **s != 0.0) {
        let (motor, link) = (layout.motor[k % nv], layout.link[k / nv]);
        mass[(motor, link)] += s;
        mass[(link, motor)] += s;
    }
    mass
}

// M⁻¹ with the joints that follow their load held straight: their rows and columns are zero.
fn inverse_of_moving(
    layout: &Layout,
    bodies: &Bodies<f64>,
    scratch: &mut Scratch<f64>,
    q: &[f64],
    inverse: &mut [f64],
) {
    let nv = layout.nv;
    mass_matrix_with(bodies, scratch, q, inverse);
    let moving: Vec<usize> = (0..nv).filter(|&i| layout.link[i] != FOLLOWS).collect();
    let M = Mat::from_fn(moving.len(), moving.len(), |i, j| inverse[moving[i] + nv * moving[j]]);
    inverse.fill(0.0);
    // A mass matrix that is not definite shows as modes that have no Cholesky factor.
    let Ok(cholesky) = M.llt(Side::Lower) else { return };
    let of_moving = cholesky.inverse();
    for (column, &j) in moving.iter().enumerate() {
        for (row, &i) in moving.iter().enumerate() {
            inverse[i + nv * j] = of_moving[(row, column)];
        }
    }
}
