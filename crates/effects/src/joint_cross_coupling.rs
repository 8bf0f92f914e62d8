//! Joint cross-coupling: a drive that acts at a joint that is not its own.

use sinew_effect::{
    Act, Ask, Card, Coefficients, Energy, Entry, Family, Law, Parameter, Prior, Requirement, Screening, Site,
};
use sinew_model::{Scalar, Setting};

use crate::entry::{at_joint, dof, rival};

/// A share of the torque of another joint's drive that acts at this joint besides.
///
/// ```text
/// τ_m,i = τ_drive,i + κ τ_drive,j
/// ```
#[derive(Debug, Clone, Copy)]
pub struct JointCrossCoupling {
    /// Degree of freedom it acts at, i.
    pub dof: usize,
    /// Degree of freedom whose drive acts there too, j.
    pub from: usize,
    /// Degrees of freedom of the robot.
    pub nv: usize,
}

/// The card of [`JointCrossCoupling`].
static CARD: Card = Card {
    name: "joint_cross_coupling",
    title: "A share of the torque of another joint's drive that acts at this joint besides",
    law: "τ_m,i = τ_drive,i + κ τ_drive,j",
    symptom: "the residual of one joint follows the torque of another, even where only the other one moves",
    family: Family::Instrument,
    energy: Energy::Supplies,
    parameters: &[Parameter {
        range: (-0.9, 0.9), ..Parameter::signed("coupling", "κ", "–", Prior::Free)
    }],
    screening: Screening::Linear,
    requires: &[Requirement::MotorTorque, Requirement::Joints(2)],
    rivals: &[
        rival(
            "base_compliance",
            "move the other joint slowly under load, then fast: a base swings at its own frequency",
        ),
        rival(
            "link_inertia",
            "hold this joint and move the other one slowly: a wrong inertia shows nothing then",
        ),
        rival("payload", "hold this joint level and load the other one with the arm folded"),
    ],
    sources: &["Gautier, Janot, Vandanjon: IEEE Trans. Control Systems Technology 21(2), 2013"],
};

/// The catalogue line of [`JointCrossCoupling`].
pub(crate) const ENTRY: Entry = Entry {
    words: &["from"],
    ..at_joint(&CARD, |ask| {
        let dof = dof(ask)?;
        Ok(Box::new(JointCrossCoupling { dof, from: source(ask, dof)?, nv: ask.model.nv }))
    })
};

// The joint that `from` names; where it says nothing, the one before.
fn source(ask: &Ask, dof: usize) -> Result<usize, String> {
    let from = match ask.spec.get("from") {
        None if ask.model.nv < 2 => return Err("needs a second joint".to_owned()),
        None => dof.checked_sub(1).unwrap_or(1),
        Some(Setting::Word(name)) => ask.model.require_dof(name).map_err(|e| format!("`from`: {e}"))?,
        Some(other) => return Err(format!("`from` must name a joint (got {other:?})")),
    };
    if from == dof {
        return Err("`from` must name another joint than its own".to_owned());
    }
    Ok(from)
}

impl Law for JointCrossCoupling {
    fn card(&self) -> &'static Card {
        &CARD
    }
    fn site(&self) -> Site {
        Site::Dof(self.dof)
    }
    fn acts(&self) -> &'static [Act] {
        &[Act::Coefficients]
    }
    // κ_ij ← κ_ij + κ
    fn add_coefficients<S: Scalar>(&self, p: &[S], c: &mut Coefficients<S>) {
        c.crosstalk[self.dof * self.nv + self.from] += p[0];
    }
}

#[cfg(test)]
mod tests {
    use sinew_effect::contract::check;

    use super::*;

    #[test]
    fn it_keeps_the_contract() {
        check(&JointCrossCoupling { dof: 1, from: 0, nv: 2 }, &[0.1]);
    }
}
