//! Joint-damping error: a gear that damps more or less than the file says.

use sinew_effect::{Card, Energy, Entry, Family, Requirement, Screening};

use crate::entry::{at_joint, dof, rival, twin};

/// A damping across the spring that differs from what the sidecar says.
static CARD: Card = Card {
    name: "joint_damping_error",
    title: "A damping across the spring that differs from what the sidecar says",
    law: "τ_J = K δ + (D + ΔD) δ̇",
    symptom: "width of the resonance; deflection in proportion to the rate of the load",
    family: Family::Transmission,
    energy: Energy::Dissipates,
    parameters: &[],
    screening: Screening::Release { effect: "joint_elasticity", parameter: "damping" },
    requires: &[Requirement::Elastic],
    rivals: &[
        twin("time_skew", "excite at two frequencies: a skew of d looks like D = K d"),
        rival("link_viscous_friction", "excite the antiresonance at two frequencies"),
        rival(
            "transmission_hysteresis",
            "slow load cycles at two speeds: hysteresis does not depend on the speed",
        ),
    ],
    sources: &[
        "Spong: ASME J. Dynamic Systems, Measurement, and Control 109(4), 1987",
        "De Luca, Book: Robots with Flexible Elements, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// Its catalogue line. It has no law of its own: the search releases the damping that the joint already has.
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| {
    let joint = ask.model.dof_name(dof(ask)?);
    Err(format!("is fitted as the damping of [joints.{joint}]"))
});
