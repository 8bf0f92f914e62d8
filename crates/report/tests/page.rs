//! What the page must hold, on hand-made results.

use sinew_identify::*;
use sinew_model::{Robot, samples};
use sinew_report::{ReportInput, page, verdict_in_words};

const FLOOR: f64 = 0.05;

// A joint with dry friction that the first model lacks.
fn comparison(friction: f64) -> Comparison {
    let time: Vec<f64> = (0..12_000).map(|k| f64::from(k) * 1e-3).collect();
    let q: Vec<f64> = time.iter().map(|t| 0.8 * (1.3 * t).sin() + 0.2 * (3.7 * t).sin()).collect();
    let speed: Vec<f64> = time.iter().map(|t| 1.04 * (1.3 * t).cos() + 0.74 * (3.7 * t).cos()).collect();
    let noise = |k: usize| FLOOR * ((k as f64 * 12.9898).sin() * 43758.5453).fract();
    let predicted: Vec<f64> = q.iter().map(|q| 9.0 * q.cos() + 3.0 * q).collect();
    let error = |k: usize| friction * (speed[k] / 0.01).tanh() + noise(k);
    let measured: Vec<f64> = (0..time.len()).map(|k| predicted[k] + error(k)).collect();
    let rms = (measured.iter().zip(&predicted).map(|(m, p)| (m - p).powi(2)).sum::<f64>() / 12e3).sqrt();
    let run = || "unseen <b>".to_owned();
    let names = || ("motor_torque".to_owned(), "joint_2".to_owned(), "N·m".to_owned());
    let (signal, joint, unit) = names();
    let error = SignalError {
        signal,
        joint,
        unit,
        rms_error: rms,
        rms_measured: 2.9,
        noise_floor: FLOOR,
        fit_percent: 90.0,
        white: friction == 0.0,
    };
    let (signal, joint, unit) = names();
    let trace = Trace { run: run(), signal, joint, unit, time, measured, predicted, speed, position: q };
    let of_run = RunError { run: run(), duration: 12.0, rms_error: rms / FLOOR };
    Comparison {
        signals: vec![error],
        runs: vec![of_run],
        rms_error: rms / FLOOR,
        findings: vec![],
        traces: vec![trace],
    }
}

fn diagnosis() -> Diagnosis {
    let at = |effect: &str| (effect.to_owned(), "joint_2".to_owned());
    let rival = |effect: &str, probability| RivalReport {
        effect: at(effect).0,
        place: at(effect).1,
        probability,
        experiment: "strokes at three speeds: the jump stays, the slope goes".into(),
    };
    let (effect, place) = at("coulomb_friction");
    let candidate = CandidateReport {
        effect: effect.clone(),
        place: place.clone(),
        probability: 0.97,
        error_explained: 0.71,
        is_stated: false,
        contribution: 12.0,
        values: vec![],
        grounds: None,
        z: 41.0,
        rivals: vec![rival("stribeck_friction", 0.02), rival("viscous_friction", 0.01)],
    };
    let finding = Finding {
        joint: place.clone(),
        signal: "motor_torque".into(),
        regime: "reversals".into(),
        statement: "joint_2, motor torque: jumps by 3.0 ± 0.1 N·m where the velocity changes sign.".into(),
        share: 0.7,
    };
    Diagnosis {
        limits: Vec::new(),
        verdict: Verdict::Missing,
        scope: "two joints, 12 s, speeds to 1.8 rad/s.".into(),
        channels: vec![],
        false_acceptance: None,
        accepted: vec![Accepted { effect, place }],
        candidates: vec![candidate],
        findings: vec![finding],
        refusals: vec![Refusal {
            candidate: "backlash@joint_2".into(),
            step: 1,
            reason: "gate 3: z = 1.2 (at least 4)".into(),
        }],
    }
}

fn fit() -> Fit {
    let step = |added: &[&str], rms_error, check| StepReport {
        added: added.iter().map(|s| (*s).to_owned()).collect(),
        rms_error,
        check_rms_error: Some(check),
        noise_floor: 1.0,
        signals: vec![],
        check_signals: vec![],
    };
    let parameter = ParameterReport {
        name: "joint_2.coulomb".into(),
        value: 1.503,
        between_runs: 0.0,
        std: 0.012,
        unit: "N·m".into(),
        low: 1.479,
        high: 1.527,
        start: 0.0,
        note: None,
    };
    Fit {
        steps: vec![
            step(&[], 31.0, 33.0),
            step(&["coulomb_friction@joint_2"], 2.1, 2.4),
            step(&["viscous_friction@joint_2"], 1.02, 1.05),
        ],
        effects: vec![],
        parameters: vec![parameter],
        verdict: Verdict::Missing,
        diagnosis: diagnosis(),
        warnings: vec![],
        torques_early: None,
        specs: vec![],
    }
}

fn sample_page() -> String {
    let robot = Robot::rigid(samples::planar_arm(2, 1.0, 0.5));
    let (before, after) = (comparison(1.5), comparison(0.0));
    let (diagnosis, fit) = (diagnosis(), fit());
    let unseen = ["unseen <b>".to_owned()];
    page(&ReportInput {
        robot: &robot,
        unseen: &unseen,
        before: &before,
        diagnosis: &diagnosis,
        fit: Some(&fit),
        after: Some(&after),
    })
}

#[test]
fn the_page_needs_nothing_from_outside() {
    let page = sample_page();
    for foreign in ["http:", "https:", "<script", "<link", "@import", "url("] {
        assert!(!page.contains(foreign), "the page asks for {foreign}");
    }
    assert!(page.len() < 600_000, "the page has {} bytes", page.len());
}

#[test]
fn every_view_is_drawn_and_every_axis_has_its_unit() {
    let page = sample_page();
    assert_eq!(page.matches("<svg").count(), 6);
    assert_eq!(page.matches("<title>").count(), 7);
    for text in
        ["time / s", "residual, N·m", "velocity / rad/s", "position / rad", "rms residual / noise floor"]
    {
        assert!(page.contains(text), "no axis says {text}");
    }
    assert!(!page.contains("NaN") && !page.contains("inf,"));
}

#[test]
fn names_of_runs_are_text_and_never_markup() {
    assert!(!sample_page().contains("unseen <b>"));
}

#[test]
fn verdict_rivals_and_refusals_are_told() {
    let page = sample_page();
    for text in [
        "Missing: Coulomb friction at joint_2",
        "strokes at three speeds",
        "gate 3: z = 1.2",
        "1.503 ± 0.012 N·m",
    ] {
        assert!(page.contains(text), "the page does not say {text:?}");
    }
}

#[test]
fn what_is_stated_wrongly_is_not_called_missing() {
    let mut diagnosis = diagnosis();
    diagnosis.candidates[0].is_stated = true;
    diagnosis.candidates[0].values = vec![ParameterReport { start: 3.0, ..fit().parameters.remove(0) }];
    let words = verdict_in_words(&diagnosis);
    let said = "Not as stated: Coulomb friction at joint_2 (coulomb 1.5 N·m, stated 3 N·m). With it nothing predictable is left.";
    assert_eq!(words, said);
}

#[test]
fn unseen_runs_that_show_more_have_the_last_word() {
    let mut diagnosis = diagnosis();
    let (statement, regime) = ("on the unseen runs it is far off".to_owned(), UNSEEN.to_owned());
    diagnosis.findings.push(Finding { statement, regime, ..diagnosis.findings[0].clone() });
    assert!(verdict_in_words(&diagnosis).ends_with(" But on the unseen runs it is far off."));
}
