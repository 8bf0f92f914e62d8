//! Episodes: an error that is confined to a short time of one run. Somebody leaned on the arm, a cable caught, the log is
//! wrong there; a robot's own laws come back wherever the motion does.

use sinew_effect::Sensor;

use crate::colour::rows_of;
use crate::course::{Course, courses, total};
use crate::diagnosis::{CandidateReport, RivalReport};
use crate::fitting::ParameterReport;
use crate::record::{Record, is_within};
use crate::remainder::squares_of_seconds;
use crate::report::Finding;
use crate::residual::Layout;
use crate::search::{Accepted, Search, State};
use crate::spread::std;
use crate::trial::How;
use crate::verdict::rms;

/// A short time of one run in which something acted that no law of the robot explains.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Episode {
    /// Which run.
    pub record: usize,
    /// From and to, stamps of the run, s.
    pub window: [f64; 2],
    /// The channel with most of it.
    pub channel: usize,
    /// Its share of the squared error of that channel.
    pub share: f64,
    /// Mean square of its whitened rows, by that of the other rows.
    pub size: f64,
    /// Its excess by the chance of noise.
    pub z: f64,
    /// Stamps of the rows with most of it, s.
    pub core: Vec<f64>,
    /// Their motion is in the log without it, too.
    pub is_alone: bool,
    /// Another degree of freedom that turned round just before.
    pub turned: Option<usize>,
    /// It begins with the run.
    pub begins: bool,
}

/// The name of what acts once: a candidate of a diagnosis, no law of the catalogue.
pub const NAME: &str = "external_force_episode";
/// What tells it from what belongs to the robot.
pub(crate) const EXPERIMENT: &str =
    "repeat the run: what belongs to the robot or its surroundings comes back";

/// Most episodes of a log.
pub(crate) const MOST: usize = 2;
// Rows of an episode, at least, and their mean square in units of the other rows'.
const FEWEST_ROWS: usize = 5;
const LARGE: f64 = 20.0;
// Times the typical mean square beyond which a row speaks for an episode.
const HIGH: f64 = 3.0;
// Mean square, in units of noise, that the typical second and all rows outside may leave.
const QUIET: f64 = 1.5;
// Share of the highest peak beyond which rows stand out like it.
const OF_PEAK: f64 = 0.1;
// Seconds beside an episode in which filters still remember it.
const MEMORY: f64 = 0.3;

/// The episodes of what a model leaves; none unless the rest is noise.
pub(crate) fn episodes(search: &Search, state: &State) -> Vec<Episode> {
    let found = confined(search.problem.form.layout(), &state.fitted.white, stamps(search));
    found.iter().map(|e| e.compared(search, state, &found)).collect()
}

/// The episode that stands out of what a model leaves, whatever the rest is.
pub(crate) fn sudden(search: &Search, state: &State) -> Option<Episode> {
    let found = standing_out(search.problem.form.layout(), &state.fitted.white, stamps(search))?;
    Some(found.compared(search, state, std::slice::from_ref(&found)))
}

/// True if nearly all that an effect adds to the rows lies in one short time of one run.
pub(crate) fn is_of_one_time(search: &Search, state: &State, entry: &Accepted) -> bool {
    if !matches!(entry.trial.how, How::New { .. }) {
        return false;
    }
    let (layout, model) = (search.problem.form.layout(), &state.fitted.model);
    let mut added = vec![0.0; layout.len];
    for (unknown, column) in model.unknowns.iter().zip(&state.fitted.at.columns) {
        if unknown.id.effect == entry.effect && !unknown.shape {
            let strength = model.p[unknown.position];
            added.iter_mut().zip(column.iter()).for_each(|(sum, x)| *sum += strength * x);
        }
    }
    is_short(&courses(layout, &state.whitener.apply(layout, &added), stamps(search)))
}

/// What a model leaves in the time of an episode.
pub(crate) struct Left {
    // Mean square by that of the rest, and its rows.
    times: f64,
    count: f64,
    // The same before laws were looked for.
    was: f64,
}

impl Left {
    /// In this episode.
    pub fn of(search: &Search, state: &State, episode: &Episode) -> Self {
        let mut courses = courses(search.problem.form.layout(), &state.fitted.white, stamps(search));
        let (all, counted) = total(&courses);
        courses.retain(|course| course.record == episode.record);
        courses.iter_mut().for_each(|course| course.retain(|time| is_within(time, episode.window)));
        let (inside, count) = total(&courses);
        let rest = (all - inside) / (counted - count).max(1.0);
        let count = count.max(1.0);
        Self { times: inside / (rest * count), count, was: episode.size }
    }

    /// True if it is no more than in the rest: what stood out was something else.
    pub fn is_noise(&self) -> bool {
        self.times < 1.0 + CHANCE * (2.0 / self.count).sqrt()
    }

    /// True if it is so little of what stood out so far that laws acted: by chance one has the shape of a push, but not to the
    /// hundredth of it.
    pub fn is_of_laws(&self) -> bool {
        self.times - 1.0 < HUNDREDTH * (self.was - 1.0) && self.was * HUNDREDTH > 1.0
    }
}

// Standard deviations by which a sum of squares may be larger by chance.
const CHANCE: f64 = 4.0;
const HUNDREDTH: f64 = 0.01;

// Share of the squares that one time must hold.
const NEARLY_ALL: f64 = 0.9;

fn is_short(courses: &[Course]) -> bool {
    let (square, count) = total(courses);
    let of = |course: &Course| {
        let (_, first, end) = course.highest(HIGH * square / count.max(1.0));
        course.is_short(first, end) && course.sums(first, end).0 > NEARLY_ALL * square
    };
    courses.iter().any(of)
}

// The stamp of a row of a run.
fn stamps(search: &Search) -> impl Fn(usize, usize) -> f64 {
    move |record, row| search.records[record].stamp(row)
}

fn confined(layout: &Layout, white: &[f64], stamp: impl Fn(usize, usize) -> f64) -> Vec<Episode> {
    let mut courses = courses(layout, white, &stamp);
    let Some(typical) = typical(layout, white).map(|typical| typical.max(1.0)) else { return Vec::new() };
    let mut found: Vec<Window> = Vec::new();
    while found.len() < MOST {
        let Some(window) = Window::highest(&courses, HIGH * typical) else { break };
        if window.mean < LARGE * typical {
            break;
        }
        window.forget(&mut courses);
        found.push(window);
    }
    let (square, count) = total(&courses);
    if typical > QUIET || square > QUIET * count {
        return Vec::new();
    }
    found.iter().map(|window| window.told(layout, white, square / count.max(1.0))).collect()
}

// A fit that somebody's push has bent leaves much everywhere, so the level is set by the peak.
fn standing_out(layout: &Layout, white: &[f64], stamp: impl Fn(usize, usize) -> f64) -> Option<Episode> {
    let mut courses = courses(layout, white, &stamp);
    let peak = courses.iter().map(Course::peak).fold(0.0, f64::max);
    let window = Window::highest(&courses, OF_PEAK * peak)?;
    window.forget(&mut courses);
    let (square, count) = total(&courses);
    let rest = square / count.max(1.0);
    (window.mean > LARGE * rest).then(|| window.told(layout, white, rest))
}

// Rows of a run.
struct Window {
    course: usize,
    record: usize,
    first: usize,
    end: usize,
    // Stamps, with what filters remember.
    time: [f64; 2],
    mean: f64,
    // Stamps of the rows that are no smaller than half of the mean.
    core: Vec<f64>,
    // No row of the run counts before it.
    begins: bool,
}

impl Window {
    // The one with the largest sum of squares beyond `level` a channel and row, if it is short.
    fn highest(courses: &[Course], level: f64) -> Option<Self> {
        let sums = courses.iter().enumerate().map(|(course, rows)| (course, rows.highest(level)));
        let (course, (_, first, end)) = sums.max_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
        let own = &courses[course];
        if end < first + FEWEST_ROWS || !own.is_short(first, end) {
            return None;
        }
        let time = [own.time[first] - MEMORY, own.time[end - 1] + MEMORY];
        let (square, count) = own.sums(first, end);
        let mean = square / count.max(1.0);
        let is_core = |k: &usize| own.counts[*k] > 0.0 && own.squares[*k] >= 0.5 * mean * own.counts[*k];
        let core = (first..end).filter(is_core).map(|k| own.time[k]).collect();
        let begins = own.sums(0, first).1 == 0.0;
        Some(Self { course, record: own.record, first, end, time, mean, core, begins })
    }

    fn forget(&self, courses: &mut [Course]) {
        courses[self.course].retain(|time| !is_within(time, self.time));
    }

    // By the mean square of what is left besides.
    fn told(&self, layout: &Layout, white: &[f64], rest: f64) -> Episode {
        let own = |c: usize| layout.of_channel(c).filter(move |s| s.record == self.record);
        let square = |c: usize| -> f64 {
            own(c).flat_map(|s| &white[s.first + self.first..s.first + self.end]).map(|w| w * w).sum()
        };
        let channel =
            (0..layout.channels.len()).max_by(|&a, &b| square(a).total_cmp(&square(b))).unwrap_or(0);
        let all: f64 = rows_of(layout, channel).map(|k| white[k] * white[k]).sum();
        let (inside, count) = (square(channel), (self.end - self.first) as f64);
        Episode {
            record: self.record,
            window: self.time,
            channel,
            share: inside / all.max(1e-300),
            size: inside / count / rest.max(1e-300),
            z: (inside - count) / (2.0 * count).sqrt(),
            core: self.core.clone(),
            is_alone: false,
            turned: None,
            begins: self.begins,
        }
    }
}

// When a joint whose rows of velocity these are turns round, at the earliest: the row before the last that goes the old way, for
// the smoother's width.
fn turns(rates: &[f64], stamp: impl Fn(usize) -> f64) -> impl Iterator<Item = f64> {
    let is_turn = |pair: &[f64]| pair[0] * pair[1] <= 0.0 && pair[0] != pair[1];
    let last = rates.windows(2).enumerate().filter(move |(_, pair)| is_turn(pair));
    last.map(move |(row, _)| stamp(row.saturating_sub(1)))
}

// True if all of these times are shortly after a turn.
fn is_within_shakes(times: &[f64], turn: f64) -> bool {
    times.iter().all(|time| is_within(time - turn, [0.0, SHAKES]))
}

// The median of the mean squares of all seconds.
fn typical(layout: &Layout, white: &[f64]) -> Option<f64> {
    let kept = (0..layout.len).filter(|&k| layout.keep[k]);
    let squares = squares_of_seconds(layout, kept, white, 1.0);
    squares.get(squares.len() / 2).copied()
}

// A row of the log, about one joint.
struct Row {
    record: usize,
    time: f64,
    at: [f64; 3],
}

// Part of their standard deviations by which rows of like motion differ, and the share of an episode's that must come back.
const NEAR: f64 = 0.5;
const USUAL: f64 = 0.7;
// Seconds for which a joint that turns round shakes the others: its friction lets go within a sample, which no row of it shows.
const SHAKES: f64 = 0.1;

// How often such a statement is right, by estimate: what happened once in one run cannot be told from a fault of the log.
const ONCE: f64 = 0.7;
const AMONG_OTHERS: f64 = 0.3;

impl Episode {
    /// The finding that says so.
    pub fn finding(&self, search: &Search) -> Finding {
        let (joint, signal) = self.place(search);
        let run = &search.records[self.record].name;
        let [from, to] = self.window;
        let statement = if self.begins {
            format!(
                "{run}: until {to:.2} s more is left at {joint} than later: its spring may still swing from before the log began, so the beginnings of all runs are left out of every fit as long"
            )
        } else if self.is_alone {
            format!(
                "{run}: between {from:.2} and {to:.2} s something acted at {joint} that does not come back with the same motion: this time is left out of every fit"
            )
        } else {
            let size = self.size.sqrt();
            let in_what = match self.turned {
                Some(dof) => {
                    let other = search.problem.robot.model.dof_name(dof);
                    format!("while the friction of {other}, which turns round, lets go")
                }
                None => "in a motion that comes back nowhere".to_owned(),
            };
            format!(
                "{run}: between {from:.2} and {to:.2} s {size:.0} times as much is left at {joint} as elsewhere, {in_what}: once more would tell whether something acted"
            )
        };
        Finding { statement, joint, signal, regime: format!("run {run}"), share: self.share }
    }

    /// The candidate of a diagnosis; `is_rest_explained`: nothing else is left.
    pub fn candidate(&self, search: &Search, state: &State, is_rest_explained: bool) -> CandidateReport {
        let [from, to] = self.window;
        let value = |name: &str, value: f64, unit: &str| ParameterReport {
            name: name.to_owned(),
            value,
            std: 0.0,
            between_runs: 0.0,
            unit: unit.to_owned(),
            low: value,
            high: value,
            start: value,
            note: None,
        };
        let torque = self.torque(search, state).map(|(torque, unit)| value("torque", torque, unit));
        let probability = if is_rest_explained { ONCE } else { AMONG_OTHERS };
        let place = self.place(search).0;
        CandidateReport {
            effect: NAME.to_owned(),
            place: place.clone(),
            probability,
            error_explained: self.share,
            is_stated: false,
            contribution: self.size.sqrt(),
            values: [value("from", from, "s"), value("to", to, "s")].into_iter().chain(torque).collect(),
            z: self.z,
            grounds: None,
            rivals: vec![RivalReport {
                effect: "contact".to_owned(),
                place,
                probability: 1.0 - probability,
                experiment: EXPERIMENT.to_owned(),
            }],
        }
    }

    fn place(&self, search: &Search) -> (String, String) {
        let channel = &search.problem.form.layout().channels[self.channel];
        (search.problem.robot.model.dof_name(channel.dof).to_owned(), channel.signal().to_owned())
    }

    // With whether most of the motion of its time comes back outside of all of them. Where it does not, be it that a strong
    // push made it, a law that shows there only, a stop or a limit of the drive, explains as much.
    fn compared(&self, search: &Search, state: &State, all: &[Self]) -> Self {
        let rows = self.motion(search, state);
        let scale: [f64; 3] =
            std::array::from_fn(|f| std(&rows.iter().map(|row| row.at[f]).collect::<Vec<_>>()).max(1e-300));
        let step = if let [a, b, ..] = &rows[..] { 0.5 * (b.time - a.time) } else { 0.0 };
        let is_core = |row: &Row| {
            row.record == self.record && self.core.iter().any(|time| (row.time - time).abs() <= step)
        };
        let is_in = |row: &Row, e: &Self| row.record == e.record && is_within(row.time, e.window);
        let is_near = |a: &Row, b: &Row| (0..3).all(|f| (a.at[f] - b.at[f]).abs() < NEAR * scale[f]);
        let (own, others): (Vec<&Row>, Vec<&Row>) = (
            rows.iter().filter(|row| is_core(row)).collect(),
            rows.iter().filter(|row| all.iter().all(|e| !is_in(row, e))).collect(),
        );
        let usual = own.iter().filter(|a| others.iter().any(|b| is_near(a, b))).count();
        let begins = self.begins && search.problem.robot.joints.iter().any(|joint| joint.stiffness.is_some());
        let turned = self.just_turned(search).filter(|_| !begins);
        let is_usual = usual as f64 >= USUAL * own.len() as f64;
        let is_alone = begins || (turned.is_none() && !own.is_empty() && is_usual);
        Self { is_alone, turned, begins, ..self.clone() }
    }

    // Another joint that turned round just before and can have shaken its joint for all of its time.
    fn just_turned(&self, search: &Search) -> Option<usize> {
        let record = &search.yardstick().records[self.record];
        let dof = search.problem.form.layout().channels[self.channel].dof;
        let shakes = |other: usize| {
            let rates = record.rows(&record.thetad[other]);
            turns(&rates, |row| record.stamp(row)).any(|turn| is_within_shakes(&self.core, turn))
        };
        (0..record.thetad.len()).filter(|&other| other != dof).find(|&other| shakes(other))
    }

    // Where its joint is in every row, how fast, and under which torque of the model, or else with which acceleration.
    fn motion(&self, search: &Search, state: &State) -> Vec<Row> {
        let told = search.yardstick();
        let layout = told.problem.form.layout();
        let dof = search.problem.form.layout().channels[self.channel].dof;
        let channel = self.torque_channel(search);
        let residual = search.told(state);
        let of_record = |(r, record): (usize, &Record)| -> Vec<Row> {
            let load = match channel {
                Some(c) => {
                    let first = layout.of_channel(c).find(|s| s.record == r).map_or(0, |s| s.first);
                    let measured = record.rows(&record.measured[c]).into_iter().zip(&residual[first..]);
                    measured.map(|(measured, left)| measured - left).collect()
                }
                None => record.rows(&record.thetadd[dof]),
            };
            let motion = record.rows(&record.theta[dof]).into_iter().zip(record.rows(&record.thetad[dof]));
            let row = |(row, ((theta, thetad), load))| Row {
                record: r,
                time: record.stamp(row),
                at: [theta, thetad, load],
            };
            motion.zip(load).enumerate().map(row).collect()
        };
        told.records.iter().enumerate().flat_map(of_record).collect()
    }

    // The channel that tells the torque of its joint, in the rows in which errors are told.
    fn torque_channel(&self, search: &Search) -> Option<usize> {
        let dof = search.problem.form.layout().channels[self.channel].dof;
        let channels = &search.yardstick().problem.form.layout().channels;
        channels.iter().position(|c| c.dof == dof && c.sensor != Sensor::JointPosition)
    }

    // Mean of what the torque lacks in the window where it is more than half of the most, as a torque on the joint, and its
    // unit.
    fn torque(&self, search: &Search, state: &State) -> Option<(f64, &'static str)> {
        let layout = search.yardstick().problem.form.layout();
        let channel = self.torque_channel(search)?;
        let residual = search.told(state);
        let record = &search.yardstick().records[self.record];
        let [from, to] = self.window;
        let inside = [from + MEMORY, to - MEMORY];
        let rows: Vec<f64> = layout
            .of_channel(channel)
            .filter(|s| s.record == self.record)
            .flat_map(|s| (0..s.len).map(move |row| (row, s.first + row)))
            .filter(|(row, _)| is_within(record.stamp(*row), inside))
            .map(|(_, k)| residual[k])
            .collect();
        let most = rows.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let high = || rows.iter().filter(|x| x.abs() > 0.5 * most);
        let mean = high().sum::<f64>() / high().count().max(1) as f64;
        let unit = layout.channels[channel].unit(&search.problem.robot.model);
        (!rows.is_empty() && rms(rows.iter().copied()) > 0.0).then_some((-mean, unit))
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng, rngs::SmallRng};

    use super::*;
    use crate::record::Channel;
    use crate::residual::Segment;

    // Twenty seconds of two channels at 50 rows a second.
    fn layout() -> Layout {
        let (rows, channels) = (1000, [Sensor::MotorTorque, Sensor::JointPosition]);
        let segment = |channel: usize| Segment { record: 0, channel, first: channel * rows, len: rows };
        Layout {
            channels: channels.map(|sensor| Channel { sensor, dof: 0 }).to_vec(),
            segments: vec![segment(0), segment(1)],
            len: 2 * rows,
            keep: vec![true; 2 * rows],
            reversal: vec![0.0; 2 * rows],
            block: (0..2 * rows).map(|k| k % rows / 50).collect(),
            fold: vec![0; 2 * rows],
            blocks: 20,
            folds: 1,
            period: 2e-3,
        }
    }

    fn noise() -> Vec<f64> {
        let mut random = SmallRng::seed_from_u64(7);
        (0..2000).map(|_| (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0).collect()
    }

    fn found(white: &[f64]) -> Vec<Episode> {
        confined(&layout(), white, |_, row| row as f64 / 50.0)
    }

    #[test]
    fn a_law_leaves_a_hundredth_of_what_stood_far_out() {
        let is_of_laws = |times, was| Left { times, count: 100.0, was }.is_of_laws();
        assert!(is_of_laws(6.7, 1026.0) && !is_of_laws(20.0, 1026.0) && !is_of_laws(1.0, 50.0));
    }

    #[test]
    fn what_a_turn_shakes_is_short_and_follows_it() {
        // Rows of 16 ms; the velocity changes its sign between 0.16 and 0.176 s.
        let rates: Vec<f64> = (0..30).map(|row| 0.1 * (f64::from(row) - 10.5)).collect();
        let turns: Vec<f64> = turns(&rates, |row| 0.016 * row as f64).collect();
        assert_eq!(turns, [0.016 * 9.0]);
        assert!(is_within_shakes(&[0.16, 0.176, 0.192], turns[0]));
        assert!(!is_within_shakes(&[0.16, 0.26], turns[0]), "too long for a shake");
        assert!(!is_within_shakes(&[0.128, 0.176], turns[0]), "it begins before the turn");
    }

    #[test]
    fn a_push_of_a_second_is_an_episode() {
        let mut white = noise();
        white[300..350].iter_mut().for_each(|w| *w += 8.0);
        let [episode] = &found(&white)[..] else { panic!("not one episode") };
        assert_eq!((episode.record, episode.channel), (0, 0));
        let [from, to] = episode.window;
        assert!((from + MEMORY - 6.0).abs() < 0.1 && (to - MEMORY - 6.98).abs() < 0.1, "{episode:?}");
        assert!(episode.share > 0.7 && episode.z > 100.0 && !episode.begins);
    }

    #[test]
    fn what_a_run_begins_with_is_told_from_what_acts_later() {
        let mut white = noise();
        white[..40].iter_mut().for_each(|w| *w += 8.0);
        let [episode] = &found(&white)[..] else { panic!("not one episode") };
        assert!(episode.begins && (episode.window[1] - MEMORY - 0.78).abs() < 0.1, "{episode:?}");
    }

    #[test]
    fn a_push_stands_out_of_what_is_missing_besides() {
        let at = |_: usize, row: usize| row as f64 / 50.0;
        let mut white: Vec<f64> = noise().iter().map(|w| 4.0 * w).collect();
        assert_eq!(standing_out(&layout(), &white, at), None);
        white[300..350].iter_mut().for_each(|w| *w += 30.0);
        let episode = standing_out(&layout(), &white, at).expect("it stands out");
        let [from, to] = episode.window;
        assert!((from + MEMORY - 6.0).abs() < 0.1 && (to - MEMORY - 6.98).abs() < 0.1, "{episode:?}");
    }

    #[test]
    fn noise_and_what_comes_back_are_none() {
        assert_eq!(found(&noise()), []);
        // At every reversal, half a second each of three.
        let mut white = noise();
        (0..1000).filter(|k| k % 150 < 25).for_each(|k| white[k] += 8.0);
        assert_eq!(found(&white), []);
        // All along.
        let white: Vec<f64> = noise().iter().map(|w| 3.0 * w).collect();
        assert_eq!(found(&white), []);
    }
}
