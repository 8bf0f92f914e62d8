//! Joint-stiffness error: a spring that is not as stiff as the file says.

use sinew_effect::{Card, Energy, Entry, Family, Requirement, Screening};

use crate::entry::{at_joint, dof, rival};

/// A stiffness of the joint that differs from what the sidecar says.
static CARD: Card = Card {
    name: "joint_stiffness_error",
    title: "A stiffness of the joint that differs from what the sidecar says",
    law: "τ_J = (K + ΔK) δ",
    symptom: "deflection scaled by one factor; the antiresonance moved",
    family: Family::Transmission,
    energy: Energy::Stores,
    parameters: &[],
    screening: Screening::Release { effect: "joint_elasticity", parameter: "stiffness" },
    requires: &[Requirement::Elastic],
    rivals: &[
        rival("stiffness_hardening", "two levels of load"),
        rival("backlash", "two levels of load"),
        rival("time_skew", "two levels of load, held still"),
    ],
    sources: &[
        "Spong: ASME J. Dynamic Systems, Measurement, and Control 109(4), 1987",
        "De Luca, Book: Robots with Flexible Elements, Springer Handbook of Robotics, 2nd ed., 2016",
    ],
};

/// Its catalogue line. It has no law of its own: the search releases the stiffness that the joint already has.
pub(crate) const ENTRY: Entry = at_joint(&CARD, |ask| {
    let joint = ask.model.dof_name(dof(ask)?);
    Err(format!("is fitted as the stiffness of [joints.{joint}]"))
});
