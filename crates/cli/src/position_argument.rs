//! A position on the command line: numbers in order, or `joint=value` pairs.

use std::f64::consts::TAU;

use sinew_model::Model;

use crate::error::{CliError, did_you_mean};

/// The position that `text` names, one number for each degree of freedom; joints not named are 0.
pub(crate) fn position(text: &str, model: &Model) -> Result<Vec<f64>, CliError> {
    let (mut q, mut stated) = (vec![0.0; model.nv], vec![false; model.nv]);
    let names: Vec<String> = (0..model.nv).map(|dof| model.dof_name(dof).to_owned()).collect();
    let help = || format!("the joints are {}; write numbers in this order, or joint=value", names.join(", "));
    let parts: Vec<&str> = text.split(',').map(str::trim).filter(|p| !p.is_empty()).collect();
    let named = parts.iter().any(|p| p.contains('='));
    if !named && !parts.is_empty() && parts.len() != model.nv {
        let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
        let what = format!("{} for {}", count(parts.len(), "number"), count(model.nv, "joint"));
        return Err(CliError::usage(format!("position \"{text}\""), what, help()));
    }
    for (k, part) in parts.iter().enumerate() {
        let wrong = |what: String| CliError::usage(format!("position \"{text}\""), what, help());
        let (dof, value) = match part.split_once('=') {
            None if named => return Err(wrong(format!("\"{part}\" names no joint"))),
            None => (k, *part),
            Some((joint, value)) => {
                let joint = joint.trim();
                let meant = did_you_mean(joint, &names).map(|m| format!("; {m}"));
                let unknown = || wrong(format!("no joint \"{joint}\"{}", meant.unwrap_or_default()));
                (names.iter().position(|n| n == joint).ok_or_else(unknown)?, value.trim())
            }
        };
        if std::mem::replace(&mut stated[dof], true) {
            return Err(wrong(format!("joint \"{}\" is named twice", names[dof])));
        }
        let number = value.parse().ok().filter(|x: &f64| x.is_finite());
        q[dof] = number.ok_or_else(|| wrong(format!("\"{value}\" is not a number")))?;
        in_rad(&format!("position \"{text}\""), model, dof, q[dof])?;
    }
    Ok(q)
}

/// Refuses an angle that is far outside the limits of its joint, as one in degrees is; `place` is where it stands.
pub(crate) fn in_rad(place: &str, model: &Model, dof: usize, angle: f64) -> Result<(), CliError> {
    let Some(limits) = far_outside(model, dof, angle) else { return Ok(()) };
    let what = format!("\"{angle}\" is far outside the limits of {}, {limits} rad", model.dof_name(dof));
    Err(CliError::usage(place, what, "angles are in rad"))
}

// The limits of a joint that turns, if an angle is outside of them by more than a turn: one in degrees.
fn far_outside(model: &Model, dof: usize, angle: f64) -> Option<String> {
    let joint = &model.joints[model.joint_of_dof(dof).0];
    let (lower, upper) = (joint.limits.lower, joint.limits.upper);
    let is_far = !joint.kind.slides() && !(lower - TAU..=upper + TAU).contains(&angle);
    is_far.then(|| format!("{lower} to {upper}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_model::samples;

    #[test]
    fn numbers_in_order_and_pairs_by_name_mean_the_same() {
        let arm = samples::planar_arm(2, 1.0, 0.5);
        assert_eq!(position("0.1, -2", &arm).unwrap(), [0.1, -2.0]);
        assert_eq!(position("joint_2=-2,joint_1=0.1", &arm).unwrap(), [0.1, -2.0]);
        assert_eq!(position("joint_2=3", &arm).unwrap(), [0.0, 3.0]);
        assert_eq!(position("", &arm).unwrap(), [0.0, 0.0]);
    }

    #[test]
    fn a_wrong_position_is_answered_with_the_joints() {
        let mut arm = samples::planar_arm(2, 1.0, 0.5);
        (arm.joints[0].limits.lower, arm.joints[0].limits.upper) = (-1.0, 1.5);
        assert_eq!(position("2,0", &arm).unwrap(), [2.0, 0.0]);
        let message = position("joint_1=45", &arm).unwrap_err().to_string();
        assert!(message.contains("-1 to 1.5 rad") && message.contains("angles are in rad"), "{message}");
        let message = position("joint_1=1,joint_1=2", &arm).unwrap_err().to_string();
        assert!(message.contains("\"joint_1\" is named twice"), "{message}");
        for text in ["1", "1,2,3", "x,1", "joint_9=1", "joint_1=1,2", "nan,0"] {
            let message = position(text, &arm).unwrap_err().to_string();
            assert!(message.contains("the joints are joint_1, joint_2"), "{message}");
        }
    }
}
