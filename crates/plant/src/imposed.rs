//! The plant with its motors' motion imposed: what the links do, and which torque the motors must give.

use core::ops::Mul;

use sinew_effect::{Coefficients, DIRECTIONS, Derivative, Kind};
use sinew_model::{Inertia, Scalar};
use sinew_rigid::{
    PARAMETERS, hybrid_dynamics_with, hybrid_response_with, inverse_dynamics_with, regressor_with,
};

use crate::{Dynamics, LinkState, Plant};

/// A motion of the motors, by degree of freedom, reflected.
#[derive(Debug, Clone, Copy)]
pub struct MotorMotion<'a, S> {
    /// θ̈.
    pub acceleration: &'a [S],
    /// True for the degrees of freedom whose link moves as told: with its motor, or as given. The springs of the others
    /// are simulated.
    pub imposed: &'a [bool],
    /// Links that move as given; without them every imposed link moves with its motor.
    pub links: Option<GivenLinks<'a, S>>,
}

/// Links on springs, some of which move as given, by degree of freedom.
#[derive(Debug, Clone, Copy)]
pub struct GivenLinks<'a, S> {
    /// True for a link that moves as given; it counts as imposed too.
    pub given: &'a [bool],
    /// q̈; read where the link moves as given.
    pub acceleration: &'a [S],
}

impl<S: Scalar> MotorMotion<'_, S> {
    // The link of `dof` moves as given.
    fn is_given(&self, dof: usize) -> bool {
        self.links.is_some_and(|links| links.given[dof])
    }
    // The link of `dof` moves with its motor.
    fn is_rigid(&self, dof: usize) -> bool {
        self.imposed[dof] && !self.is_given(dof)
    }
    // q̈ of an imposed link.
    fn of_link(&self, dof: usize) -> S {
        match self.links {
            Some(links) if links.given[dof] => links.acceleration[dof],
            _ => self.acceleration[dof],
        }
    }
}

/// What follows from an imposed motor motion.
#[derive(Debug, Clone, PartialEq)]
pub struct ImposedOut<S> {
    /// q̈.
    pub qdd: Vec<S>,
    /// Torque that the gears hand to the links, N·m.
    pub tau_j: Vec<S>,
    /// Torque that must act on the motors, N·m; filled by [`Dynamics::imposed_torque`] only.
    pub tau_m: Vec<S>,
    /// Torque that must act on a link besides, for it to move as given, N·m; zero for other links.
    pub tau_l: Vec<S>,
}

impl<S: Kind> ImposedOut<S> {
    /// Room for `nv` degrees of freedom.
    pub fn new(nv: usize) -> Self {
        let zeros = vec![S::ZERO; nv];
        Self { qdd: zeros.clone(), tau_j: zeros.clone(), tau_m: zeros.clone(), tau_l: zeros }
    }
}

impl<S: Kind> Dynamics<'_, S> {
    /// Accelerations of the links and torques of the gears. Where a link moves with its motor, `x.q` and `x.qd` must
    /// equal the motor's.
    ///
    /// ```text
    /// M(q) q̈ + C q̇ + g = τ_j + f_link + τ_l,   q̈ = θ̈ of links that move with their motor,   τ_l ≠ 0 of given links only
    /// ```
    ///
    /// Rotors that are coupled with their links are among f_link: their motors' accelerations are known.
    pub fn imposed_motion(&mut self, x: &LinkState<S>, motor: MotorMotion<S>, out: &mut ImposedOut<S>) {
        self.springs(x, |i| !motor.is_rigid(i));
        self.link_forces(x);
        self.rotors_on_links(x, motor.acceleration);
        let nv = self.plant.model.nv;
        for i in 0..nv {
            self.armature[i] = S::ZERO;
            self.qdd[i] = motor.of_link(i);
            self.tau[i] = self.tau_j[i] + self.link_force[i];
        }
        let bodies = Self::bodies(self.plant, &self.coefficients, &self.armature);
        let (qdd, tau) = (&mut self.qdd, &mut self.tau);
        if motor.imposed.iter().all(|&imposed| imposed) {
            inverse_dynamics_with(&bodies, &mut self.scratch, &x.q, &x.qd, qdd, tau);
        } else {
            hybrid_dynamics_with(&bodies, &mut self.scratch, &x.q, &x.qd, motor.imposed, qdd, tau);
        }
        for i in 0..nv {
            let needed = self.tau[i] - self.link_force[i];
            out.tau_l[i] = S::ZERO;
            if motor.is_given(i) {
                out.tau_l[i] = needed - self.tau_j[i];
            } else if motor.imposed[i] {
                self.tau_j[i] = needed;
            }
        }
        out.qdd.copy_from_slice(&self.qdd);
        out.tau_j.copy_from_slice(&self.tau_j);
    }

    /// Torques of gears and motors of a plant of which no joint is imposed: they follow from positions and velocities on
    /// both sides of the gears. The links' accelerations stay as they are in `out`; only where rotors are coupled with their
    /// links are they looked at.
    pub fn gear_torque(&mut self, x: &LinkState<S>, acceleration: &[S], out: &mut ImposedOut<S>) {
        self.springs(x, |_| true);
        self.link_forces(x);
        self.rotors_on_links(x, acceleration);
        out.tau_j.copy_from_slice(&self.tau_j);
        self.motor_torque(x, acceleration, out);
    }

    /// As [`Dynamics::imposed_motion`], and the torque that must act on the motors.
    ///
    /// ```text
    /// τ_m = B θ̈ + κB u·ω̇ + τ_j ∂δ/∂θ − f_motor
    /// ```
    ///
    /// with the second term only where rotors are coupled with links that turn with ω̇.
    pub fn imposed_torque(&mut self, x: &LinkState<S>, motor: MotorMotion<S>, out: &mut ImposedOut<S>) {
        self.imposed_motion(x, motor, out);
        self.motor_torque(x, motor.acceleration, out);
    }

    // `A`: the kind of number of the motors' accelerations.
    fn motor_torque<A: Copy>(&mut self, x: &LinkState<S>, acceleration: &[A], out: &mut ImposedOut<S>)
    where
        S: Mul<A, Output = S>,
    {
        self.motor_forces(x);
        if let Some(rotors) = &mut self.rotors {
            rotors.accelerate(&x.qd, &out.qdd);
            rotors.load_motors(&mut self.motor_force);
        }
        for i in 0..self.plant.model.nv {
            out.tau_m[i] =
                self.coefficients.rotor[i] * acceleration[i] + self.reaction(i) - self.motor_force[i];
        }
    }

    // What coupled rotors ask of the links, taken from the forces on these; they know the links' velocities then.
    fn rotors_on_links<A: Copy>(&mut self, x: &LinkState<S>, acceleration: &[A])
    where
        S: Mul<A, Output = S>,
    {
        if let Some(rotors) = &mut self.rotors {
            rotors.turn(&x.q, &x.qd);
            rotors.load_links(&x.thetad, acceleration, &mut self.link_force);
        }
    }
}

/// A motion that was evaluated, and how it answers to torques: what its derivatives are taken about.
#[derive(Debug, Clone, PartialEq)]
pub struct ImposedAt {
    /// The motion.
    pub out: ImposedOut<f64>,
    /// R, nv × nv by columns, of [`sinew_rigid::hybrid_response_with`].
    pub response: Vec<f64>,
    /// Y, nv × 10 n by columns, of [`sinew_rigid::regressor_with`].
    pub regressor: Vec<f64>,
}

impl ImposedAt {
    /// Room for the motion of `plant`.
    pub fn new(plant: &Plant) -> Self {
        let nv = plant.model.nv;
        let regressor = vec![0.0; nv * PARAMETERS * plant.model.joints.len()];
        Self { out: ImposedOut::new(nv), response: vec![0.0; nv * nv], regressor }
    }
}

/// What changes a motion by itself, besides the forces of effects.
#[derive(Debug, Clone, PartialEq)]
pub struct Moving {
    /// True if the state or gravity has a derivative.
    pub state: bool,
    /// Inertial parameters that have one, by their column in the regressor.
    pub inertial: Vec<(usize, [f64; DIRECTIONS])>,
}

impl Moving {
    /// What has a derivative among the constants of a robot whose state is constant.
    pub fn of(coefficients: &Coefficients<Derivative>) -> Self {
        let changes = |x: &Derivative| x.derivative.iter().any(|d| *d != 0.0);
        let g = coefficients.gravity;
        let ten = |i: &Inertia<Derivative>| {
            let (h, s) = (i.first_moment, i.second_moment);
            [i.mass, h.x, h.y, h.z, s.xx, s.xy, s.yy, s.xz, s.yz, s.zz]
        };
        let all = coefficients.inertia.iter().flat_map(ten).enumerate();
        let inertial = all.filter(|(_, x)| changes(x)).map(|(k, x)| (k, x.derivative)).collect();
        Self { state: [g.x, g.y, g.z].iter().any(changes), inertial }
    }
    /// True if nothing has a derivative.
    pub fn is_still(&self) -> bool {
        !self.state && self.inertial.is_empty()
    }
}

impl Dynamics<'_, f64> {
    /// [`Dynamics::imposed_torque`], and the response to torques.
    pub fn imposed_at(&mut self, x: &LinkState<f64>, motor: MotorMotion<f64>, at: &mut ImposedAt) {
        self.imposed_torque(x, motor, &mut at.out);
        let bodies = Self::bodies(self.plant, &self.coefficients, &self.armature);
        hybrid_response_with(&bodies, &mut self.scratch, &x.q, motor.imposed, &mut at.response);
        regressor_with(&bodies, &mut self.scratch, &x.q, &x.qd, &at.out.qdd, &mut at.regressor);
    }
}

impl Dynamics<'_, Derivative> {
    /// The derivatives of [`Dynamics::imposed_motion`] about the motion `at`, along the directions of the state `x`
    /// and of the parameters, by the implicit function: no acceleration is solved for in dual numbers.
    ///
    /// ```text
    /// free joints      r = δτ_j + δf_link − δ(M q̈ + C q̇ + g),  q̈ held;   δq̈ = M_ff⁻¹ r_f
    /// imposed joints   r = δf_link − δ(M q̈ + C q̇ + g);                   δτ_j = M_if δq̈_f − r_i
    /// given links      r as of free joints;                               δτ_l = M_if δq̈_f − r_i
    /// ```
    ///
    /// Only derivatives are filled in beside the values of `at`. Forces may be those of some effects only ([`Dynamics::of_some`]), if no other force
    /// has a derivative.
    pub fn imposed_derivatives(
        &mut self,
        x: &LinkState<Derivative>,
        motor: MotorMotion<f64>,
        at: &ImposedAt,
        moving: &Moving,
        out: &mut ImposedOut<Derivative>,
    ) {
        let nv = self.plant.model.nv;
        self.springs(x, |i| !motor.is_rigid(i));
        self.link_forces(x);
        self.rotors_on_links(x, motor.acceleration);
        for i in 0..nv {
            self.armature[i] = Derivative::ZERO;
            self.qdd[i] = Derivative::constant(at.out.qdd[i]);
            self.tau[i] = Derivative::ZERO;
        }
        if moving.state {
            let bodies = Self::bodies(self.plant, &self.coefficients, &self.armature);
            let (qdd, tau) = (&self.qdd, &mut self.tau);
            inverse_dynamics_with(&bodies, &mut self.scratch, &x.q, &x.qd, qdd, tau);
        } else {
            // δ(M q̈ + C q̇ + g) = Y δπ
            for (column, change) in &moving.inertial {
                for i in 0..nv {
                    let entry = at.regressor[i + nv * column];
                    self.tau[i] += Derivative { value: 0.0, derivative: *change } * entry;
                }
            }
        }
        for i in 0..nv {
            let spring = if motor.is_rigid(i) { Derivative::ZERO } else { self.tau_j[i] };
            self.tau[i] = spring + self.link_force[i] - self.tau[i];
        }
        for i in 0..nv {
            let mut answer = Derivative::ZERO;
            for j in (0..nv).filter(|&j| !motor.imposed[j]) {
                answer += self.tau[j] * at.response[i + nv * j];
            }
            let (qdd, tau_j, tau_l) = if motor.is_given(i) {
                (Derivative::ZERO, self.tau_j[i], answer - self.tau[i])
            } else if motor.imposed[i] {
                (Derivative::ZERO, answer - self.tau[i], Derivative::ZERO)
            } else {
                (answer, self.tau_j[i], Derivative::ZERO)
            };
            out.tau_l[i] = Derivative { value: at.out.tau_l[i], ..tau_l };
            out.qdd[i] = Derivative { value: at.out.qdd[i], ..qdd };
            self.tau_j[i] = Derivative { value: at.out.tau_j[i], ..tau_j };
        }
        out.tau_j.copy_from_slice(&self.tau_j);
    }

    /// The derivatives of the torque on the motors; needs [`Dynamics::imposed_derivatives`] at the same state, or τ_j
    /// without derivatives.
    ///
    /// ```text
    /// δτ_m = δB θ̈ + δ(κB u·ω̇) + δ(τ_j ∂δ/∂θ) − δf_motor
    /// ```
    pub fn motor_derivatives(
        &mut self,
        x: &LinkState<Derivative>,
        motor: MotorMotion<f64>,
        at: &ImposedAt,
        out: &mut ImposedOut<Derivative>,
    ) {
        self.motor_torque(x, motor.acceleration, out);
        for (torque, value) in out.tau_m.iter_mut().zip(&at.out.tau_m) {
            torque.value = *value;
        }
    }

    /// Takes the torques of the gears for constants: what [`Dynamics::imposed_derivatives`] would find along
    /// parameters that act on the motors only.
    pub fn steady_gears(&mut self, at: &ImposedAt, out: &mut ImposedOut<Derivative>) {
        for i in 0..self.plant.model.nv {
            self.tau_j[i] = Derivative::constant(at.out.tau_j[i]);
            (out.qdd[i], out.tau_j[i]) = (Derivative::constant(at.out.qdd[i]), self.tau_j[i]);
            out.tau_l[i] = Derivative::constant(at.out.tau_l[i]);
        }
    }
}
