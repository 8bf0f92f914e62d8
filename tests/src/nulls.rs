//! What the method says where nothing is missing: are its intervals and its scores what they claim to be?

use sinew_effects::CATALOGUE;
use sinew_identify::{Options, Verdict, diagnose, fit};
use sinew_model::{EffectSpec, Robot};

use crate::{Arm, Conditions, Outside, measure, null_case};

/// A fitted parameter beside the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Place and key.
    pub name: String,
    /// Distance from the truth, in its own standard deviations.
    pub z: f64,
    /// Distance from the truth as a share of it.
    pub error: f64,
}

/// What came of one case in which nothing is hidden.
#[derive(Debug, Clone, PartialEq)]
pub struct NullCase {
    /// Parameters whose true values are known.
    pub estimates: Vec<Estimate>,
    /// Score of every effect that is absent and enters linearly: standard normal if the model is right.
    pub scores: Vec<(String, f64)>,
    /// What was said if it was not `adequate`: the verdict and the names.
    pub alarm: Option<String>,
}

/// Fits and diagnoses one case in which nothing is hidden.
///
/// # Errors
/// If the truth cannot be simulated or the analysis is refused.
pub fn null_statistics(
    arm: &Arm,
    conditions: Conditions,
    seed: u64,
    options: &Options,
) -> Result<NullCase, Outside> {
    let case = null_case(arm, conditions, seed);
    let runs = measure(arm, &case)?;
    let diagnosis = diagnose(&case.model, &CATALOGUE, &runs, options)?;
    let fitted = fit(&case.model, &CATALOGUE, &runs, &[], &[], options)?;
    let estimates = fitted.parameters.iter().filter_map(|p| {
        let (place, key) = p.name.split_once('.')?;
        let truth = true_value(&case.truth, place, key)?;
        Some(Estimate {
            name: p.name.clone(),
            z: (p.value - truth) / p.std,
            error: (p.value - truth) / truth,
        })
    });
    Ok(NullCase {
        estimates: estimates.collect(),
        scores: diagnosis.limits.iter().map(|l| (format!("{}@{}", l.effect, l.place), l.score)).collect(),
        alarm: (diagnosis.verdict != Verdict::Adequate).then(|| {
            let names = diagnosis
                .candidates
                .iter()
                .map(|c| format!(" {}@{} {:.2}", c.effect, c.place, c.probability));
            format!("seed {seed}: {}{}", diagnosis.verdict, names.collect::<String>())
        }),
    })
}

// What the fit calls stiffness is the reciprocal of what the effect keeps.
fn true_value(truth: &Robot, place: &str, key: &str) -> Option<f64> {
    let dof = truth.model.require_dof(place).ok()?;
    let stated = |e: &EffectSpec| (e.place.to_string() == place).then(|| e.number(key)).flatten();
    match key {
        "stiffness" => truth.joints[dof].stiffness,
        "damping" => Some(truth.joints[dof].damping),
        "inertia" => Some(truth.joints[dof].rotor_inertia),
        "viscous" | "coulomb" | "smoothing_velocity" => truth.effects.iter().find_map(stated),
        _ => None,
    }
}
