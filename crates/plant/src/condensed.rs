//! Quasi-static virtual joints: springs of links that are in balance with their load at every instant.

use sinew_effect::Kind;
use sinew_model::{Following, Scalar};
use sinew_rigid::{Bodies, hybrid_dynamics_with, hybrid_response_with, inverse_dynamics_with};

use crate::{Dynamics, LinkState, Plant};

/// Room to eliminate the quasi-static joints of a plant.
///
/// An elastic joint in front of a bending link moves, at one position of the mass behind both, against the link's own
/// spring. So its coordinate here is that of the mass, z = q + A q_s: what the joint has turned and, by its weight for
/// that joint, what the link has bent.
///
/// ```text
/// A = M_ee⁻¹ M_es,   T = ½ żᵀ M(z) ż,   q_s = argmin ½ q_sᵀ K_s q_s + ½ δᵀ K δ + V(q),   δ = θ − z + A q_s
/// ```
///
/// The inertia that a quasi-static joint has while the elastic joints are free, M_ss − M_se M_ee⁻¹ M_es, is left out of T:
/// exact where it is zero, else an error of the order (ω/ω_s)² in a motion of frequency ω.
#[derive(Debug)]
pub(crate) struct Condensation<S> {
    /// The robot as it stands, bent.
    pub settled: LinkState<S>,
    /// The state with straight links, which carries the inertia.
    pub(crate) straight: LinkState<S>,
    /// Torque of gravity where the robot stands.
    weight: Vec<S>,
    still: Vec<S>,
    pub(crate) response: Vec<S>,
    /// What the change of the levers adds to the forces, and room to find it.
    pub(crate) change: Vec<S>,
    pub(crate) coriolis: Vec<S>,
    pub(crate) pushed: Vec<S>,
    pub(crate) bend_of_all: Vec<S>,
    // Elastic joints, and quasi-static ones by their place among the virtual joints.
    pub(crate) elastic: Vec<usize>,
    quasi: Vec<usize>,
    // All that is not an elastic joint; all that is quasi-static.
    held: Vec<bool>,
    bent: Vec<bool>,
    // A, one row for each elastic joint.
    lever: Vec<S>,
    // K_s + Aᵀ K A, its Cholesky factor.
    factor: Vec<S>,
    deflection: Vec<S>,
    rate: Vec<S>,
    rest: Vec<S>,
}

/// What bends a link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum By {
    /// Springs and weight.
    Springs,
    /// Dampers too.
    SpringsAndDampers,
}

// Rounds of Newton's method; linear springs need one, weight on a bent link a few.
const ROUNDS: usize = 20;
// Change of a deflection, rad, that is rounding.
const SETTLED: f64 = 1e-15;

impl<S: Kind> Condensation<S> {
    /// None for a plant without quasi-static joints.
    pub fn new(plant: &Plant) -> Option<Box<Self>> {
        let all = plant.virtual_joints.iter().enumerate();
        let quasi: Vec<usize> =
            all.filter(|(_, v)| v.following == Following::QuasiStatic).map(|(k, _)| k).collect();
        if quasi.is_empty() {
            return None;
        }
        let nv = plant.model.nv;
        let elastic: Vec<usize> = (0..nv).filter(|&i| plant.elastic[i]).collect();
        let mut bent = vec![false; nv];
        quasi.iter().for_each(|&k| bent[plant.virtual_joints[k].dof] = true);
        let zeros = |n: usize| vec![S::ZERO; n];
        let (ne, ns) = (elastic.len(), quasi.len());
        Some(Box::new(Self {
            settled: LinkState::zero(plant),
            straight: LinkState::zero(plant),
            weight: zeros(nv),
            still: zeros(nv),
            response: zeros(nv * nv),
            change: zeros(nv),
            coriolis: zeros(nv * nv),
            pushed: zeros(nv),
            bend_of_all: zeros(nv),
            held: plant.elastic.iter().map(|e| !e).collect(),
            bent,
            lever: zeros(ne * ns),
            factor: zeros(ns * ns),
            deflection: zeros(ns),
            rate: zeros(ns),
            rest: zeros(ns),
            elastic,
            quasi,
        }))
    }

    /// An entry of A.
    pub(crate) fn lever(&self, e: usize, s: usize) -> S {
        self.lever[e * self.quasi.len() + s]
    }

    /// q_s.
    pub(crate) fn deflections(&self) -> &[S] {
        &self.deflection
    }

    /// Torque of gravity where the robot stands.
    pub(crate) fn weight(&self, dof: usize) -> S {
        self.weight[dof]
    }

    /// The degree of freedom of a quasi-static joint.
    pub(crate) fn dof(&self, plant: &Plant, s: usize) -> usize {
        plant.virtual_joints[self.quasi[s]].dof
    }

    // Brings `settled` to the present deflection, at rest where dampers do not count.
    fn bend(&mut self, plant: &Plant, x: &LinkState<S>, by: By) {
        self.settled.clone_from(x);
        if by == By::Springs {
            self.settled.qd.fill(S::ZERO);
            self.settled.thetad.fill(S::ZERO);
        }
        for s in 0..self.quasi.len() {
            let dof = self.dof(plant, s);
            (self.settled.q[dof], self.settled.qd[dof]) = (self.deflection[s], self.rate[s]);
            (self.settled.theta[dof], self.settled.thetad[dof]) = (self.deflection[s], self.rate[s]);
            for (e, &joint) in self.elastic.iter().enumerate() {
                // q = z − A q_s
                let lever = self.lever(e, s);
                self.settled.q[joint] -= lever * self.deflection[s];
                self.settled.qd[joint] -= lever * self.rate[s];
            }
        }
    }

    /// Accelerations of what has inertia, straight links carrying it, under the torque `tau` and the weight of the bent
    /// robot.
    pub fn accelerate(&self, dynamics: &mut Dynamics<S>) {
        let Dynamics { plant, coefficients, armature, scratch, tau, qdd, .. } = dynamics;
        for i in 0..plant.model.nv {
            tau[i] = tau[i] - self.weight[i] + self.change[i];
            if self.bent[i] {
                qdd[i] = S::ZERO;
            }
        }
        let gravity = sinew_model::Vector3::ZERO;
        let bodies = Bodies { model: &plant.model, inertia: &coefficients.inertia, gravity, armature };
        hybrid_dynamics_with(&bodies, scratch, &self.straight.q, &self.straight.qd, &self.bent, qdd, tau);
    }

    /// The state with straight links.
    pub fn straight(&self) -> &LinkState<S> {
        &self.straight
    }
}

impl<S: Kind> Dynamics<'_, S> {
    /// The robot as it stands at the state last evaluated: bent links, and elastic joints where they are in front of
    /// them. None for a plant without quasi-static joints.
    pub fn settled(&self) -> Option<&LinkState<S>> {
        self.condensation.as_ref().map(|c| &c.settled)
    }

    /// Takes out the condensation, settled at `x`; whoever takes it puts it back.
    pub(crate) fn settle(&mut self, x: &LinkState<S>, by: By) -> Option<Box<Condensation<S>>> {
        let mut c = self.condensation.take()?;
        let plant = self.plant;
        c.straight.clone_from(x);
        for s in 0..c.quasi.len() {
            let dof = c.dof(plant, s);
            (c.straight.q[dof], c.straight.qd[dof]) = (S::ZERO, S::ZERO);
        }
        self.levers(&mut c);
        self.stiffen(&mut c);
        c.deflection.fill(S::ZERO);
        c.rate.fill(S::ZERO);
        if by == By::SpringsAndDampers {
            // q̇_s = −(K_s + Aᵀ K A)⁻¹ Aᵀ K (θ̇ − ż)
            for s in 0..c.quasi.len() {
                let torque = |e: usize, r: usize| {
                    self.spring(c.elastic[e], c.elastic[r]) * (x.thetad[c.elastic[r]] - x.qd[c.elastic[r]])
                };
                let all = (0..c.elastic.len()).flat_map(|e| (0..c.elastic.len()).map(move |r| (e, r)));
                c.rest[s] = all.fold(S::ZERO, |sum, (e, r)| sum - c.lever(e, s) * torque(e, r));
            }
            solve(&c.factor, &mut c.rest);
            c.rate.copy_from_slice(&c.rest);
        }
        let mut settled = 0;
        for _ in 0..ROUNDS {
            c.bend(plant, x, by);
            self.missing(&mut c);
            solve(&c.factor, &mut c.rest);
            let mut largest = 0.0f64;
            for s in 0..c.quasi.len() {
                c.deflection[s] -= c.rest[s];
                largest = largest.max(c.rest[s].value().abs());
            }
            // once more for the derivatives, which follow their values a round behind
            settled += usize::from(largest <= SETTLED);
            if settled == 2 {
                break;
            }
        }
        c.bend(plant, x, By::SpringsAndDampers);
        self.weigh(&mut c);
        Some(c)
    }

    // A = M_ee⁻¹ M_es
    fn levers(&mut self, c: &mut Condensation<S>) {
        if c.elastic.is_empty() {
            return;
        }
        let nv = self.plant.model.nv;
        self.armature.fill(S::ZERO);
        let bodies = Self::bodies(self.plant, &self.coefficients, &self.armature);
        hybrid_response_with(&bodies, &mut self.scratch, &c.straight.q, &c.held, &mut c.response);
        for (e, &joint) in c.elastic.iter().enumerate() {
            for s in 0..c.quasi.len() {
                c.lever[e * c.quasi.len() + s] = c.response[c.dof(self.plant, s) + nv * joint];
            }
        }
    }

    // An entry of the joints' stiffness matrix.
    fn spring(&self, i: usize, j: usize) -> S {
        let own = if i == j && !self.plant.coupled[i] { self.stiffness[i] } else { S::ZERO };
        let mut sum = own;
        for coupling in &self.plant.couplings {
            let place = |dof| coupling.dofs.iter().position(|d| *d == dof);
            if let (Some(r), Some(c)) = (place(i), place(j)) {
                sum += S::constant(coupling.stiffness[r * coupling.dofs.len() + c]);
            }
        }
        sum
    }

    // The Cholesky factor of K_s + Aᵀ K A.
    fn stiffen(&mut self, c: &mut Condensation<S>) {
        let (ne, ns) = (c.elastic.len(), c.quasi.len());
        for (s, t) in (0..ns).flat_map(|s| (0..ns).map(move |t| (s, t))) {
            let own = self.plant.virtual_joints[c.quasi[s]].stiffness;
            let mut sum = S::constant(if s == t { own } else { 0.0 });
            for (e, r) in (0..ne).flat_map(|e| (0..ne).map(move |r| (e, r))) {
                sum += c.lever(e, s) * self.spring(c.elastic[e], c.elastic[r]) * c.lever(r, t);
            }
            c.factor[s * ns + t] = sum;
        }
        for k in 0..ns {
            for i in k..ns {
                let mut sum = c.factor[i * ns + k];
                for j in 0..k {
                    sum -= c.factor[i * ns + j] * c.factor[k * ns + j];
                }
                c.factor[i * ns + k] = if i == k { sum.sqrt() } else { sum / c.factor[k * ns + k] };
            }
        }
    }

    // K_s q_s + D_s q̇_s + g_s − f_s + Aᵀ (τ_j − g_e + f_e), which balance makes zero
    fn missing(&mut self, c: &mut Condensation<S>) {
        let plant = self.plant;
        self.springs(&c.settled, |i| plant.elastic[i]);
        self.link_forces(&c.settled);
        self.weigh(c);
        for s in 0..c.quasi.len() {
            let dof = c.dof(plant, s);
            let mut sum = c.weight[dof] - self.link_force[dof];
            for (e, &joint) in c.elastic.iter().enumerate() {
                let net = self.tau_j[joint] - c.weight[joint] + self.link_force[joint];
                sum += c.lever(e, s) * net;
            }
            c.rest[s] = sum;
        }
    }

    // g where the robot stands.
    fn weigh(&mut self, c: &mut Condensation<S>) {
        self.armature.fill(S::ZERO);
        let bodies = Self::bodies(self.plant, &self.coefficients, &self.armature);
        inverse_dynamics_with(&bodies, &mut self.scratch, &c.settled.q, &c.still, &c.still, &mut c.weight);
    }
}

impl Dynamics<'_, f64> {
    /// The position of a state in which the robot stands at `q`, its links bent as `q` says: elastic joints in front
    /// of quasi-static links count with what the links have bent, and those links as straight.
    ///
    /// ```text
    /// z = q + A q_s
    /// ```
    ///
    /// # Panics
    /// If `q` has not nv numbers.
    pub fn position_standing_at(&mut self, q: &[f64]) -> Vec<f64> {
        let Some(mut c) = self.condensation.take() else { return q.to_vec() };
        let mut z = q.to_vec();
        let bend: Vec<f64> = (0..c.quasi.len()).map(|s| q[c.dof(self.plant, s)]).collect();
        // A itself is that of z, which differs from q by a small angle
        for _ in 0..ROUNDS {
            (0..c.quasi.len()).for_each(|s| z[c.dof(self.plant, s)] = 0.0);
            c.straight.q.copy_from_slice(&z);
            self.levers(&mut c);
            for (e, &joint) in c.elastic.iter().enumerate() {
                z[joint] = q[joint] + (0..bend.len()).map(|s| c.lever(e, s) * bend[s]).sum::<f64>();
            }
        }
        self.condensation = Some(c);
        z
    }
}

// L Lᵀ x = b in place.
fn solve<S: Scalar>(factor: &[S], x: &mut [S]) {
    let n = x.len();
    for i in 0..n {
        for j in 0..i {
            let change = factor[i * n + j] * x[j];
            x[i] -= change;
        }
        x[i] = x[i] / factor[i * n + i];
    }
    for i in (0..n).rev() {
        for j in i + 1..n {
            let change = factor[j * n + i] * x[j];
            x[i] -= change;
        }
        x[i] = x[i] / factor[i * n + i];
    }
}
