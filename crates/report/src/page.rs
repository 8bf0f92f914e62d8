//! The page: everything a diagnosis found, in one HTML text.

use minijinja::{Environment, Value, context};
use sinew_identify::{CandidateReport, Comparison, Fit, Refusal, SignalError};

use crate::candidate_view::candidate_view;
use crate::channel::{Channel, most_telling};
use crate::drawing::STYLE;
use crate::ladder_view::ladder_view;
use crate::number::{number, quantity, with_std};
use crate::regime_view::regime_view;
use crate::regimes::regimes;
use crate::scatter_view::{Against, scatter_view};
use crate::time_view::time_view;
use crate::{ReportInput, verdict_in_words};

const TEMPLATE: &str = include_str!("page.html");

/// The self-contained page: verdict, ladder, tables and views as HTML with inline SVG; no network, no script.
///
/// Views are drawn for the channel that tells most: at the joint where something is missing, the one with the largest
/// error as a share of its signal. Lines are thinned to two points a pixel, and every peak stays.
pub fn page(input: &ReportInput) -> String {
    let mut environment = Environment::new();
    environment.add_template("drawing.css", STYLE).expect("the embedded style is well formed");
    environment.add_template("page.html", TEMPLATE).expect("the embedded template is well formed");
    let template = environment.get_template("page.html").expect("it was just added");
    template.render(contents(input)).expect("every name of the template is given")
}

fn contents(input: &ReportInput) -> Value {
    let diagnosis = input.diagnosis;
    context! {
        robot => &input.robot.model.name,
        joints => (0..input.robot.model.nv).map(|k| input.robot.model.dof_name(k).to_owned()).collect::<Vec<_>>(),
        runs => runs(input),
        verdict => diagnosis.verdict.to_string(),
        words => verdict_in_words(diagnosis),
        scope => &diagnosis.scope,
        tiles => tiles(input),
        ladder => input.fit.filter(|f| f.steps.len() > 1).map(|f| ladder_view(&f.steps)),
        signals => signals(input.before, input.after),
        views => views(input),
        candidates => diagnosis.candidates.iter().map(candidate).collect::<Vec<_>>(),
        candidate_view => (!diagnosis.candidates.is_empty()).then(|| candidate_view(&diagnosis.candidates)),
        parameters => input.fit.map(parameters).unwrap_or_default(),
        warnings => input.fit.map(|f| f.warnings.clone()).unwrap_or_default(),
        findings => diagnosis.findings.iter().map(|f| f.statement.clone()).collect::<Vec<_>>(),
        refusals => diagnosis.refusals.iter().map(refusal).collect::<Vec<_>>(),
    }
}

fn runs(input: &ReportInput) -> Vec<Value> {
    let line = |r: &sinew_identify::RunError| {
        let after = input.after.and_then(|c| c.runs.iter().find(|a| a.run == r.run));
        context! {
            name => &r.run,
            duration => number(r.duration),
            before => number(r.rms_error),
            after => after.map(|a| number(a.rms_error)),
            unseen => input.unseen.contains(&r.run),
        }
    };
    input.before.runs.iter().map(line).collect()
}

// The two figures that matter: the error before and after, on the runs seen and on the unseen ones.
fn tiles(input: &ReportInput) -> Vec<Value> {
    let Some((first, last)) = input.fit.and_then(|f| Some((f.steps.first()?, f.steps.last()?))) else {
        let text = number(input.before.rms_error);
        return vec![context! { label => "error, in noise floors", before => text }];
    };
    let tile = |label: &str, before: f64, after: f64| {
        context! { label => label, before => number(before), after => number(after) }
    };
    let mut tiles = vec![tile("error on the fitted runs, in noise floors", first.rms_error, last.rms_error)];
    if let (Some(before), Some(after)) = (first.check_rms_error, last.check_rms_error) {
        tiles.push(tile("error on unseen runs, in noise floors", before, after));
    }
    tiles
}

fn percent(signal: &SignalError) -> String {
    signal.share().map_or("–".to_owned(), |share| format!("{} %", number(100.0 * share)))
}

fn signals(before: &Comparison, after: Option<&Comparison>) -> Vec<Value> {
    let line = |s: &SignalError| {
        let now = after.and_then(|c| c.signals.iter().find(|a| a.signal == s.signal && a.joint == s.joint));
        context! {
            joint => &s.joint,
            signal => s.signal.replace('_', " "),
            before => quantity(s.rms_error, &s.unit),
            after => now.map(|n| quantity(n.rms_error, &n.unit)),
            of_signal => percent(s),
            of_signal_after => now.map(percent),
            floor => quantity(s.noise_floor, &s.unit),
            white => now.unwrap_or(s).white,
        }
    };
    before.signals.iter().map(line).collect()
}

fn views(input: &ReportInput) -> Option<Value> {
    let signal = most_telling(input)?;
    let before = Channel::of(input.before, signal);
    let after = input.after.map(|c| Channel::of(c, signal));
    let names: Vec<String> = input.before.runs.iter().map(|r| r.run.clone()).collect();
    let (time, run) = time_view(input, signal)?;
    Some(context! {
        signal => signal.signal.replace('_', " "),
        joint => &signal.joint,
        unseen => input.unseen.contains(&run),
        run => run,
        time => time,
        velocity => scatter_view(Against::Velocity, signal, &before, after.as_ref(), input),
        position => scatter_view(Against::Position, signal, &before, after.as_ref(), input),
        regimes => regime_view(&regimes(&before, after.as_ref(), &names), signal.noise_floor),
    })
}

fn refusal(r: &Refusal) -> Value {
    context! { step => r.step, candidate => &r.candidate, reason => &r.reason }
}

fn candidate(c: &CandidateReport) -> Value {
    context! {
        effect => &c.effect,
        place => &c.place,
        probability => number(c.probability),
        explains => c.explains().map_or("–".to_owned(), |share| format!("{} %", number(100.0 * share))),
        z => number(c.z),
        values => c.values.iter().map(|v| format!("{} {}", v.name, with_std(v.value, v.std, &v.unit))).collect::<Vec<_>>(),
        rivals => c.rivals.iter().map(|r| context! {
            effect => &r.effect, place => &r.place, probability => number(r.probability), experiment => &r.experiment,
        }).collect::<Vec<_>>(),
    }
}

fn parameters(fit: &Fit) -> Vec<Value> {
    let line = |p: &sinew_identify::ParameterReport| {
        context! {
            name => &p.name,
            start => quantity(p.start, &p.unit),
            value => with_std(p.value, p.std, &p.unit),
            note => &p.note,
        }
    };
    fit.parameters.iter().map(line).collect()
}
