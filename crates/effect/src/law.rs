//! The law of an effect, and its object-safe twin.

use core::fmt::Debug;

use sinew_model::{Dual, JointId, Lanes, LinkId, Scalar};

use crate::{Actuation, At, Card, Coefficients, Deflection, Reading, Relaxation, Sensor};

/// Directions that one pass with dual numbers carries.
pub const DIRECTIONS: usize = 8;
/// Lanes that one batch pass carries.
pub const LANES: usize = 4;
/// The dual number of effects: eight exact derivatives a pass.
pub type Derivative = Dual<DIRECTIONS>;
/// The lanes of effects: four evaluations a pass.
pub type Wide = Lanes<LANES>;

/// Where an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Site {
    /// A degree of freedom.
    Dof(usize),
    /// The body that a joint moves.
    Body(JointId),
    /// A link.
    Link(LinkId),
    /// The whole robot.
    Robot,
}

/// What an effect acts on. A plant calls only what a law declares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Act {
    /// The constants of the robot.
    Coefficients,
    /// The position across the gear.
    Deflection,
    /// The torque of the spring.
    SpringTorque,
    /// The forces on the link side.
    LinkForce,
    /// The forces on the motor side.
    MotorForce,
    /// The forces on the motor side, which depend on the torque that the gear hands on.
    LoadedMotorForce,
    /// Own states.
    State,
    /// The path from logged to acting torque.
    Actuation,
    /// The readings of sensors.
    Reading,
}

/// The law of a physical effect, written once for every kind of number: one struct, one file, one catalogue line.
///
/// Contract, checked by [`contract::check`](crate::contract::check): all strengths zero ⇔ the effect is absent.
/// `p` are the effect's own parameters in the order of its card.
pub trait Law: Debug + Send + Sync {
    /// Name, law, symptom, energy, parameters, rivals, sources.
    fn card(&self) -> &'static Card;
    /// Where it acts.
    fn site(&self) -> Site;
    /// What it acts on.
    fn acts(&self) -> &'static [Act];
    /// The degree of freedom that becomes elastic with this effect, if any.
    fn elastic_dof(&self) -> Option<usize> {
        None
    }
    /// The degree of freedom whose rotor it couples with the link that carries it, if any.
    fn carried_rotor(&self) -> Option<usize> {
        None
    }
    /// Number of own states.
    fn states(&self) -> usize {
        0
    }
    /// Changes the constants of the robot.
    fn add_coefficients<S: Scalar>(&self, _p: &[S], _c: &mut Coefficients<S>) {}
    /// Adds to the position across the gear; `at` holds positions and velocities only.
    fn add_deflection<S: Scalar>(&self, _p: &[S], _at: &At<S>, _by_dof: &mut [Deflection<S>]) {}
    /// Adds to the torque that springs hand from motor to link, N·m.
    fn add_spring_torque<S: Scalar>(&self, _p: &[S], _at: &At<S>, _tau_j: &mut [S]) {}
    /// Adds generalised forces on the links, N·m; those of a dissipative effect oppose q̇.
    fn add_link_force<S: Scalar>(&self, _p: &[S], _at: &At<S>, _tau: &mut [S]) {}
    /// Adds torques on the motors, reflected, N·m; those of a dissipative effect oppose θ̇.
    fn add_motor_force<S: Scalar>(&self, _p: &[S], _at: &At<S>, _tau: &mut [S]) {}
    /// States where the own states go and how fast.
    fn relaxation<S: Scalar>(&self, _p: &[S], _at: &At<S>, _z: &mut [Relaxation<S>]) {}
    /// Changes the path from logged to acting motor torque; `at` holds motor position and velocity only.
    fn add_actuation<S: Scalar>(&self, _p: &[S], _at: &At<S>, _by_dof: &mut [Actuation<S>]) {}
    /// Changes the readings of the sensors of every degree of freedom.
    fn add_reading<S: Scalar>(&self, _p: &[S], _sensor: Sensor, _by_dof: &mut [Reading<S>]) {}
    /// Energy it stores, J; zero for effects that store none.
    fn energy<S: Scalar>(&self, _p: &[S], _at: &At<S>) -> S {
        S::ZERO
    }
}

/// One question to an effect, in one kind of number.
#[derive(Debug)]
pub enum Call<'a, S> {
    /// [`Law::add_coefficients`].
    Coefficients(&'a mut Coefficients<S>),
    /// [`Law::add_deflection`].
    Deflection(&'a At<'a, S>, &'a mut [Deflection<S>]),
    /// [`Law::add_spring_torque`].
    SpringTorque(&'a At<'a, S>, &'a mut [S]),
    /// [`Law::add_link_force`].
    LinkForce(&'a At<'a, S>, &'a mut [S]),
    /// [`Law::add_motor_force`].
    MotorForce(&'a At<'a, S>, &'a mut [S]),
    /// [`Law::relaxation`].
    Relaxation(&'a At<'a, S>, &'a mut [Relaxation<S>]),
    /// [`Law::add_actuation`].
    Actuation(&'a At<'a, S>, &'a mut [Actuation<S>]),
    /// [`Law::add_reading`].
    Reading(Sensor, &'a mut [Reading<S>]),
    /// [`Law::energy`], added to the number given.
    Energy(&'a At<'a, S>, &'a mut S),
}

/// A physical effect as plants, simulators and fitters hold it. Every [`Law`] is one.
pub trait Effect: Debug + Send + Sync {
    /// [`Law::card`].
    fn card(&self) -> &'static Card;
    /// [`Law::site`].
    fn site(&self) -> Site;
    /// [`Law::acts`].
    fn acts(&self) -> &'static [Act];
    /// [`Law::elastic_dof`].
    fn elastic_dof(&self) -> Option<usize>;
    /// [`Law::carried_rotor`].
    fn carried_rotor(&self) -> Option<usize>;
    /// [`Law::states`].
    fn states(&self) -> usize;
    #[doc(hidden)]
    fn call_f64(&self, p: &[f64], call: Call<'_, f64>);
    #[doc(hidden)]
    fn call_derivative(&self, p: &[Derivative], call: Call<'_, Derivative>);
    #[doc(hidden)]
    fn call_wide(&self, p: &[Wide], call: Call<'_, Wide>);
}

impl<L: Law> Effect for L {
    fn card(&self) -> &'static Card {
        Law::card(self)
    }
    fn site(&self) -> Site {
        Law::site(self)
    }
    fn acts(&self) -> &'static [Act] {
        Law::acts(self)
    }
    fn elastic_dof(&self) -> Option<usize> {
        Law::elastic_dof(self)
    }
    fn carried_rotor(&self) -> Option<usize> {
        Law::carried_rotor(self)
    }
    fn states(&self) -> usize {
        Law::states(self)
    }
    fn call_f64(&self, p: &[f64], call: Call<'_, f64>) {
        dispatch(self, p, call);
    }
    fn call_derivative(&self, p: &[Derivative], call: Call<'_, Derivative>) {
        dispatch(self, p, call);
    }
    fn call_wide(&self, p: &[Wide], call: Call<'_, Wide>) {
        dispatch(self, p, call);
    }
}

#[inline(always)]
fn dispatch<L: Law, S: Scalar>(law: &L, p: &[S], call: Call<'_, S>) {
    match call {
        Call::Coefficients(c) => law.add_coefficients(p, c),
        Call::Deflection(at, d) => law.add_deflection(p, at, d),
        Call::SpringTorque(at, tau) => law.add_spring_torque(p, at, tau),
        Call::LinkForce(at, tau) => law.add_link_force(p, at, tau),
        Call::MotorForce(at, tau) => law.add_motor_force(p, at, tau),
        Call::Relaxation(at, z) => law.relaxation(p, at, z),
        Call::Actuation(at, a) => law.add_actuation(p, at, a),
        Call::Reading(sensor, r) => law.add_reading(p, sensor, r),
        Call::Energy(at, sum) => *sum += law.energy(p, at),
    }
}

/// A kind of number in which erased effects can be called.
pub trait Kind: Scalar {
    /// Puts one question to an effect.
    fn call(effect: &dyn Effect, p: &[Self], call: Call<'_, Self>);
}

impl Kind for f64 {
    #[inline(always)]
    fn call(effect: &dyn Effect, p: &[Self], call: Call<'_, Self>) {
        effect.call_f64(p, call);
    }
}
impl Kind for Derivative {
    #[inline(always)]
    fn call(effect: &dyn Effect, p: &[Self], call: Call<'_, Self>) {
        effect.call_derivative(p, call);
    }
}
impl Kind for Wide {
    #[inline(always)]
    fn call(effect: &dyn Effect, p: &[Self], call: Call<'_, Self>) {
        effect.call_wide(p, call);
    }
}
