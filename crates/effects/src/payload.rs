//! Payload: a body that the tool carries.

use sinew_effect::{Act, Card, Coefficients, Energy, Entry, Family, Law, Parameter, Prior, Screening, Site};
use sinew_model::{Inertia, JointId, Pose, Scalar, Symmetric3, Vector3};

use crate::entry::{at_robot, body_of, rival, twin};

/// A body carried at the tool, with its weight and inertia.
///
/// ```text
/// m, m c, I  ←  m + m_p, m c + h_p, I + I_p  in the tool frame
/// ```
///
/// First moment and inertia about the origin of the tool frame are fitted where `first_moment_std` and `inertia_std` are stated; the
/// search tries a point at the origin, a body that is elsewhere, and one of some extent.
#[derive(Debug, Clone)]
pub struct Payload {
    /// The body that carries the tool.
    pub body: JointId,
    /// The tool frame in it.
    pub body_from_tool: Pose<f64>,
}

/// The card of [`Payload`].
static CARD: Card = Card {
    name: "payload",
    title: "A body carried at the tool, with its weight and inertia",
    law: "m, m c, I  ←  m + m_p, m c + h_p, I + I_p  in the tool frame",
    symptom: "torque residual in the shape of gravity and inertia on all joints, in the fixed ratio of the tool's lever arms",
    family: Family::Inertial,
    energy: Energy::Stores,
    parameters: &[
        Parameter::positive("mass", "m_p", "kg", Prior::Share(0.03)),
        Parameter::optional("first_moment", "h_x", "kg·m").component(0),
        Parameter::optional("first_moment", "h_y", "kg·m").component(1),
        Parameter::optional("first_moment", "h_z", "kg·m").component(2),
        Parameter::optional("inertia", "I_xx", "kg·m²").component(0),
        Parameter::optional("inertia", "I_yy", "kg·m²").component(1),
        Parameter::optional("inertia", "I_zz", "kg·m²").component(2),
        Parameter::optional("inertia", "I_xy", "kg·m²").component(3),
        Parameter::optional("inertia", "I_xz", "kg·m²").component(4),
        Parameter::optional("inertia", "I_yz", "kg·m²").component(5),
    ],
    screening: Screening::Linear,
    requires: &[],
    rivals: &[
        twin("link_first_moment", "weigh it, or repeat the motion with and without it"),
        twin("link_mass", "weigh it, or repeat the motion with and without it"),
        rival(
            "torque_constant_error",
            "repeat the motion with and without a known payload, in other postures of the wrist",
        ),
    ],
    sources: &[
        "Atkeson, An, Hollerbach: Int. J. Robotics Research 5(3), 1986",
        "Hollerbach, Khalil, Gautier: Model Identification, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// The catalogue line of [`Payload`].
pub(crate) const ENTRY: Entry = at_robot(&CARD, |ask| {
    let (body, body_from_tool) = body_of(ask, ask.tool)?;
    Ok(Box::new(Payload { body, body_from_tool }))
});

impl Law for Payload {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Robot
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Coefficients]
    }
    // I ← I + X* I_p X
    fn add_coefficients<S: Scalar>(&self, p: &[S], c: &mut Coefficients<S>) {
        let [mass, hx, hy, hz, xx, yy, zz, xy, xz, yz] = core::array::from_fn(|k| p[k]);
        let payload = Inertia {
            mass,
            first_moment: Vector3::new(hx, hy, hz),
            second_moment: Symmetric3 { xx, yy, zz, xy, xz, yz },
        };
        c.inertia[self.body.0] += Pose::constant(&self.body_from_tool).inertia_to_parent(&payload);
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        let body_from_tool = Pose::from_xyz_rpy([0.1, -0.2, 0.3], [0.4, 0.5, -0.6]);
        check(
            &Payload { body: JointId(1), body_from_tool },
            &[2.0, 0.1, 0.2, 0.3, 0.05, 0.06, 0.07, 0.001, 0.002, 0.003],
        );
    }
}
