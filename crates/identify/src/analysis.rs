//! What every search begins with: runs made ready, checked, and the residual that suits them.

use sinew_data::Run;
use sinew_effect::{Catalogue, Sensor};
use sinew_model::{EffectSpec, Robot};
use sinew_plant::Plant;

use crate::before;
use crate::comparison::{Prepared, moments_told};
use crate::episode::{Episode, MOST};
use crate::first_look::FirstLook;
use crate::innovation::Innovation;
use crate::options::Residual;
use crate::problem::Problem;
use crate::report::Finding;
use crate::residual::{ResidualForm, Start};
use crate::search::{Search, State};
use crate::spread::std;
use crate::{IdentifyError, Options};

/// What a search is begun with.
pub(crate) struct Analysis<'a> {
    /// The robot with the joints that no run measures held still.
    pub robot: &'a Robot,
    /// The runs made ready.
    pub prepared: &'a Prepared,
    /// What the data checks suspect.
    pub suspicions: Vec<Finding>,
    /// What the runs leave out because something acted then.
    pub episodes: Vec<Episode>,
    // Why this residual.
    why: &'static str,
    // What was done before, if anything.
    first: Option<String>,
}

/// What came of a search.
pub(crate) struct Worked<T> {
    pub result: T,
    /// The effects that were named, `effect@place`, without what acted once.
    pub names: Vec<String>,
    /// True if all is explained.
    pub is_answered: bool,
    /// True if what is left is no more than torques leave that were held as they were logged.
    pub takes_torques_as_held: bool,
    pub left: LeftOver,
}

impl<T> Worked<T> {
    /// What a search came to that ended with `state`.
    pub fn of(state: &State, result: T, is_answered: bool, left: LeftOver) -> Self {
        let (names, takes_torques_as_held) = (state.names(), state.takes_torques_as_held());
        Self { result, names, is_answered, takes_torques_as_held, left }
    }

    // Nothing is named, and nothing missing.
    fn is_adequate(&self) -> bool {
        self.is_answered && self.names.is_empty()
    }

    // All is explained, by one name at the most.
    fn is_plain(&self) -> bool {
        self.is_answered && self.names.len() <= 1
    }

    // By the innovation residual: all is explained down to torques that were held as they were read, by no more names than the
    // imposed residual needs if that explains all, too.
    fn explains_more(&self, imposed: &Self) -> bool {
        let is_as_short = self.names.len() <= imposed.names.len() || !imposed.is_answered;
        self.is_answered && self.takes_torques_as_held && is_as_short
    }
}

/// Short times of the runs that hold what a search does not explain.
#[derive(Default)]
pub(crate) struct LeftOver {
    pub episodes: Vec<Episode>,
    /// What stood out in them is gone with the laws that were named.
    pub is_gone: bool,
    /// No push can have done what these laws take away of it.
    pub is_of_laws: bool,
    /// Outside of them nothing is left.
    pub is_rest_noise: bool,
    /// What is left of a joint's torque changes slowly and passed for noise.
    pub is_slow: bool,
}

/// What runs are analysed for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Aim {
    /// Effects are looked for: a long log is first looked at in part.
    Search,
    /// The parameters of a given model: everything from the whole log.
    Fit,
}

/// Does `work` with a search of the runs. Where springs swing between the samples of a fast log, its torques are asked whether they
/// were held, and both residuals where something is missing and not one name explains all. Where a misfit passed for torque noise
/// in every joint, or in one and nothing is named, the work is done once more with the imposed residual; where all that is left is
/// confined to episodes, once more without them. Where one stands out of what the base leaves, the work is tried without it, too:
/// what acts once bends a model so far that the rest fits no longer, or that another law passes for it.
///
/// # Errors
/// If the robot is no plant, a run lacks the signals or fails a check, or the work fails.
pub(crate) fn analysed<T>(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[Run],
    options: &Options,
    aim: Aim,
    work: impl Fn(&mut Search, &Analysis) -> Result<Worked<T>, IdentifyError>,
) -> Result<T, IdentifyError> {
    let without = |episodes: &[Episode]| {
        if episodes.is_empty() {
            return worked(robot, catalogue, runs, options, aim, Vec::new(), &work);
        }
        let mut rest = runs.to_vec();
        for episode in episodes {
            if episode.begins {
                // Springs forget as slowly in every run.
                let lasts = episode.window[1] - runs[episode.record].time[0];
                rest.iter_mut().for_each(|run| run.left_out.push([run.time[0], run.time[0] + lasts]));
            } else {
                rest[episode.record].left_out.push(episode.window);
            }
        }
        worked(robot, catalogue, &rest, options, aim, episodes.to_vec(), &work)
    };
    Ok(answered(without(&[])?, &[], &without)?.result)
}

// The best that can be said of a work that was done without `acted`. Where what stood out of the base only is gone with the laws
// that were named, and these explain all, the same laws without that time say no more; where what stood out is just what a law does, as
// a drive's limit that is met once, no others do.
fn answered<T>(
    whole: Worked<T>,
    acted: &[Episode],
    without: &impl Fn(&[Episode]) -> Result<Worked<T>, IdentifyError>,
) -> Result<Worked<T>, IdentifyError> {
    let mut next = whole.left.episodes.clone();
    // Beginnings are left out once, and are no episodes.
    let has_begun = acted.iter().any(|e| e.begins);
    next.retain(|e| !(has_begun && e.begins));
    let is_named = whole.is_answered && !whole.names.is_empty();
    let is_of_laws = is_named && whole.left.is_of_laws;
    if next.is_empty() || is_of_laws || acted.iter().filter(|e| !e.begins).count() >= MOST {
        return Ok(whole);
    }
    let acted = [acted, &next].concat();
    let rest = answered(without(&acted)?, &acted, without)?;
    let says_no_more =
        is_named && whole.left.is_gone && whole.names.iter().all(|name| rest.names.contains(name));
    let is_better = !says_no_more && (rest.is_answered || (whole.left.is_rest_noise && !whole.is_answered));
    Ok(if is_better { rest } else { whole })
}

fn worked<T>(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[Run],
    options: &Options,
    aim: Aim,
    episodes: Vec<Episode>,
    work: impl Fn(&mut Search, &Analysis) -> Result<Worked<T>, IdentifyError>,
) -> Result<Worked<T>, IdentifyError> {
    let (robot, prepared, suspicions) = before::begun(robot, catalogue, runs, options)?;
    let robot = &robot;
    let imposed = prepared.form(robot);
    let problem = Problem::new(robot, catalogue, &imposed, options);
    let mut search = Search::new(&problem, &prepared.records, &prepared.sensors);
    let (suits, why) = suits(&prepared, options)?;
    let mut begun = Analysis { robot, prepared: &prepared, suspicions, episodes, why, first: None };
    let look = || FirstLook::of(robot, catalogue, runs, &prepared, options);
    let look = (suits && aim == Aim::Search).then(look).flatten();
    let may_suit = suits || (options.residual.is_none() && may_be_held(&prepared));
    let about_base = || about_base(robot, catalogue, runs, &prepared, look.as_ref());
    let innovation = if may_suit { about_base()? } else { None };
    if let Some(innovation) = innovation {
        let records = innovation.present().motion();
        let own = Problem { form: &innovation, ..problem };
        let mut about = Search::new(&own, &records, &prepared.sensors)
            .filtered_by(innovation.present().records())
            .told_by(Some(&search))
            .after(look.as_ref());
        if !suits {
            let is_held = are_held(&about, prepared.base_specs(robot, catalogue));
            let mut imposed = Search::new(&problem, &prepared.records, &prepared.sensors);
            let mut imposed = |begun: &mut Analysis| {
                begun.why = why;
                work(&mut imposed, begun)
            };
            let mut held = |begun: &mut Analysis| {
                begun.why = if is_held { HELD } else { HELD_WITH_NAMES };
                work(&mut about, begun)
            };
            // What one of the two residuals calls adequate is: a name that only the other needs makes up for what it takes the
            // torques between the samples for.
            let mut first = None;
            if is_held {
                let held = held(&mut begun)?;
                if aim == Aim::Fit || held.is_adequate() {
                    return Ok(held);
                }
                first = Some(held);
            }
            let imposed = imposed(&mut begun)?;
            if first.is_none() && (aim == Aim::Fit || imposed.is_plain()) {
                return Ok(imposed);
            }
            let held = first.or_else(|| held(&mut begun).ok());
            return Ok(held.filter(|held| held.explains_more(&imposed)).unwrap_or(imposed));
        }
        begun.first = look.as_ref().map(FirstLook::told);
        about.refusals.extend(look.iter().flat_map(FirstLook::refusals));
        let worked = work(&mut about, &begun)?;
        let drowned = drowned(&prepared, &innovation.present().torque_noise);
        // A name counts beside one joint that is drowned, not where all are.
        let none_counts = worked.names.is_empty() || !drowned.contains(&false);
        let is_slow = worked.names.is_empty() && worked.left.is_slow;
        let is_drowned = is_slow || (drowned.contains(&true) && none_counts);
        if options.residual.is_some() || !is_drowned {
            return Ok(worked);
        }
        (begun.why, begun.first) = (if is_slow { SLOW } else { DROWNED }, None);
    }
    work(&mut search, &begun)
}

// True if nothing is known of the torques between the samples: they may have been held.
fn may_be_held(prepared: &Prepared) -> bool {
    is_fast(prepared) && prepared.scales.parts > 1 && Innovation::impossible(&prepared.sensors).is_none()
}

// True if the fitted base leaves so little that the torques are what the residual takes them for; not so where it cannot be
// followed.
fn are_held(search: &Search, specs: Vec<EffectSpec>) -> bool {
    search.base(specs).is_ok_and(|base| base.takes_torques_as_held())
}

fn is_fast(prepared: &Prepared) -> bool {
    1.0 / prepared.scales.period >= 0.99 * FAST
}

// Sample rate, Hz, from which the torque noise of single samples tells on the encoders.
const FAST: f64 = 200.0;

const SUITED: &str = "motor torque and encoders at 200 Hz or more: their noise is treated together";
const HELD: &str =
    "motor torques act as they were logged, held from sample to sample, with no more than their noise";
const HELD_WITH_NAMES: &str = "with what is named, motor torques act as they were logged, held from sample to sample, with no more than their noise";
const DROWNED: &str =
    "the innovation residual finds more torque noise than there is torque: a misfit passes for noise";
const SLOW: &str =
    "the innovation residual takes for torque noise what changes slowly: a misfit passes for noise";

// Whether the innovation residual is taken, and why or why not.
fn suits(prepared: &Prepared, options: &Options) -> Result<(bool, &'static str), IdentifyError> {
    match (options.residual, Innovation::impossible(&prepared.sensors)) {
        (Some(Residual::Innovation), Some(reason)) => Err(IdentifyError::Question {
            what: format!("these runs have no innovation residual: {reason}"),
            help: "leave --residual out, or say --residual imposed".to_owned(),
        }),
        (Some(asked), _) => Ok((asked == Residual::Innovation, "as asked")),
        (None, _) => Ok(unsuited(prepared).map_or((true, SUITED), |why| (false, why))),
    }
}

/// The innovation residual about the base as it is stated, or as a first look has settled it; none where it is impossible.
///
/// # Errors
/// If the robot is no plant.
pub(crate) fn about_base(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[Run],
    prepared: &Prepared,
    look: Option<&FirstLook>,
) -> Result<Option<Innovation>, IdentifyError> {
    let Some(form) = Innovation::new(robot, runs, &prepared.sensors, prepared.scales) else {
        return Ok(None);
    };
    let specs = prepared.base_specs(robot, catalogue);
    let plant = Plant::with_effects(robot, &specs, catalogue)?;
    let known = look.and_then(|look| look.values(&specs));
    let p = known.map_or_else(|| plant.parameters(), <[f64]>::to_vec);
    let from = look.map_or(Start::Kernel, |look| {
        form.begin_known(look.torques, look.torque_noise.clone());
        Start::Reference
    });
    form.renew(&plant, &p, from);
    Ok(Some(if prepared.sensors.few_move() { form.sure() } else { form }))
}

// By joint with a motor torque: true if its noise is larger than what was logged of it.
fn drowned(prepared: &Prepared, noise: &[f64]) -> Vec<bool> {
    let torques = prepared.sensors.channels.iter().filter(|c| c.sensor == Sensor::MotorTorque);
    let logged = torques.map(|c| {
        let values: Vec<f64> = prepared.sensors.motor_torque(&prepared.records, c.dof).collect();
        std(&values)
    });
    logged.zip(noise).map(|(logged, noise)| *noise > logged).collect()
}

// Why the innovation residual does not suit the runs; none if it does.
fn unsuited(prepared: &Prepared) -> Option<&'static str> {
    if !is_fast(prepared) {
        return Some("the log is too slow for torque noise to show in it sample by sample");
    }
    if prepared.scales.parts > 1 {
        return Some("springs swing between the samples, where no torque is known");
    }
    Innovation::impossible(&prepared.sensors)
}

// Numbers by motor, and their unit after the last of each kind.
fn noise_told(search: &Search, noise: &[f64]) -> String {
    let model = &search.problem.robot.model;
    let torques = search.sensors.channels.iter().filter(|c| c.sensor == Sensor::MotorTorque);
    let units: Vec<&str> = torques.map(|c| c.unit(model)).collect();
    let told = |(k, x): (usize, &f64)| match (units.get(k), units.get(k + 1)) {
        (Some(unit), next) if next != Some(unit) => format!("{x:.2} {unit}"),
        _ => format!("{x:.2}"),
    };
    noise.iter().enumerate().map(told).collect::<Vec<_>>().join(", ")
}

/// Which residual a search looks at, and why.
pub(crate) fn residual_told(search: &Search, begun: &Analysis) -> String {
    let name = if search.problem.form.is_white() { "innovation" } else { "imposed" };
    let noise = search.problem.form.reference().map_or(String::new(), |reference| {
        let acts = if reference.torques.move_without_noise { " that moves the joints" } else { "" };
        let noise = noise_told(search, &reference.torque_noise);
        let unsure = if reference.torques.unsure_friction {
            "; how friction near rest changes within a sample is unsure"
        } else {
            ""
        };
        let noise = format!(", torque noise{acts} {noise} a sample{unsure}");
        match reference.torques.early {
            0.0 => noise,
            early => format!("{noise}; logged torques are {}", moments_told(early)),
        }
    });
    let first = begun.first.iter().map(|first| format!("; {first}")).collect::<String>();
    format!("residual: {name} ({}){noise}{first}", begun.why)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worked(names: usize, is_answered: bool, takes_torques_as_held: bool) -> Worked<()> {
        let names = (0..names).map(|k| format!("effect_{k}")).collect();
        Worked { result: (), names, is_answered, takes_torques_as_held, left: LeftOver::default() }
    }

    #[test]
    fn held_torques_are_believed_where_they_explain_all_by_no_more_names() {
        let held = worked(1, true, true);
        assert!(held.explains_more(&worked(1, true, false)) && held.explains_more(&worked(2, true, false)));
        assert!(held.explains_more(&worked(0, false, false)));
        // What the other calls adequate is.
        assert!(!held.explains_more(&worked(0, true, false)));
        // A misfit that passes for noise, or something that is left.
        assert!(!worked(1, true, false).explains_more(&worked(2, false, false)));
        assert!(!worked(1, false, true).explains_more(&worked(2, false, false)));
        assert!(worked(1, true, false).is_plain() && !worked(2, true, false).is_plain());
    }
}
