//! What a name is worth on a log: how often the search accepts an effect on surrogates of it, where none is missing.
//!
//! A surrogate is what the final model predicts plus its own residual, turned about so that it no longer belongs to the
//! motion: with a random sign for each block of a second, or shifted in time by a random amount. Its errors are as
//! large, as coloured and as uneven as those of the log; whatever is accepted on it is accepted falsely.
//!
//! Source: Theiler, Eubank, Longtin, Galdrikian, Farmer: *Testing for nonlinearity in time series: the method of
//! surrogate data*, Physica D 58, 1992.

use rand::{Rng, SeedableRng, rngs::SmallRng};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::Serialize;

use sinew_data::Run;
use sinew_effect::Catalogue;
use sinew_model::Robot;
use sinew_plant::Plant;

use crate::analysis::{Aim, LeftOver, Worked, analysed};
use crate::explore::explore;
use crate::freedom::Springs;
use crate::innovation::Reference;
use crate::problem::Problem;
use crate::residual::{Grid, Layout, ResidualForm};
use crate::search::{Search, State};
use crate::{IdentifyError, Options};

/// Surrogates of each kind.
const SURROGATES: u64 = 10;
const KINDS: [Turned; 2] = [Turned::Flipped, Turned::Shifted];
// Pairs of surrogates tried between two looks at whether the rest could still change the answer.
const PAIRS_AT_A_TIME: usize = 2;
// Chance of a false acceptance beyond which a log cannot decide.
const MOST_WRONG: f64 = 0.2;

/// How a residual is taken from its motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Turned {
    /// A random sign for each block of a second.
    Flipped,
    /// Shifted in time by a random amount, the end put before the start.
    Shifted,
}

/// What was accepted on one surrogate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SurrogateReport {
    /// How it was made.
    pub turned: Turned,
    /// The effect accepted first, `effect@place`; none if nothing was.
    pub accepted: Option<String>,
}

/// How often the search accepts an effect on surrogates of the log.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FalseAcceptance {
    /// Surrogates on which something was accepted.
    pub accepted: usize,
    /// Surrogates tried: all, or as many as it took to see that the log cannot decide.
    pub surrogates: usize,
}

/// The answer of a trial.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrialReport {
    /// Effects of the model whose residual was used, `effect@place`, beyond those of the robot.
    pub effects: Vec<String>,
    /// False acceptances in all.
    pub false_acceptance: FalseAcceptance,
    /// Surrogate by surrogate.
    pub surrogates: Vec<SurrogateReport>,
    /// What follows from it.
    pub sentence: String,
}

/// Searches the runs, and then surrogates of them on which nothing is missing: how often would an effect be accepted?
///
/// # Errors
/// If the robot is no plant or a run lacks the signals.
pub fn trial(
    robot: &Robot,
    catalogue: &Catalogue,
    runs: &[Run],
    options: &Options,
) -> Result<TrialReport, IdentifyError> {
    analysed(robot, catalogue, runs, options, Aim::Search, |search, begun| {
        let robot = begun.robot;
        let base = search.base(begun.prepared.base_specs(robot, catalogue))?;
        let explored = explore(search, base, None)?;
        let surrogates = surrogates(search, &explored.state)?;
        let false_acceptance = FalseAcceptance::of(&surrogates);
        let sentence = sentence(&false_acceptance);
        let effects = explored.state.names();
        let result = TrialReport { effects, false_acceptance, surrogates, sentence };
        Ok(Worked::of(&explored.state, result, true, LeftOver::default()))
    })
}

impl FalseAcceptance {
    fn of(surrogates: &[SurrogateReport]) -> Self {
        let accepted = surrogates.iter().filter(|s| s.accepted.is_some()).count();
        Self { accepted, surrogates: surrogates.len() }
    }
    /// The chance that the search accepts an effect where nothing is missing, by Laplace's rule of succession.
    pub(crate) fn chance(&self) -> f64 {
        (self.accepted + 1) as f64 / (self.surrogates + 2) as f64
    }
    /// True if a log with this count can carry names.
    pub(crate) fn decides(&self) -> bool {
        self.chance() <= MOST_WRONG
    }
    // The same with nothing accepted on those not tried yet.
    fn may_decide(&self) -> bool {
        Self { surrogates: KINDS.len() * SURROGATES as usize, ..*self }.decides()
    }
}

/// What follows from the count.
pub(crate) fn sentence(count: &FalseAcceptance) -> String {
    let FalseAcceptance { accepted, surrogates } = count;
    let follows = if *accepted == 0 {
        "what is named is no accident of this noise, which does not make it the right name: see its probability"
    } else if count.decides() {
        "take the name that explains least with care"
    } else {
        "these runs are too short or too unlike the model to carry names: record more, at other speeds and poses"
    };
    format!(
        "on {accepted} of {surrogates} surrogates of this log, on which nothing is missing, an effect was accepted: {follows}"
    )
}

// The search of one more effect on all surrogates of the runs, with the model of `state` as the truth.
fn surrogates(search: &Search, state: &State) -> Result<Vec<SurrogateReport>, IdentifyError> {
    tried(search, state, KINDS.into_iter().flat_map(|kind| (0..SURROGATES).map(move |n| (kind, n))).collect())
}

/// How often an effect is accepted on surrogates, counted until it is plain that the log cannot decide.
pub(crate) fn false_acceptance(search: &Search, state: &State) -> Result<FalseAcceptance, IdentifyError> {
    let pairs: Vec<u64> = (0..SURROGATES).collect();
    let mut reports = Vec::new();
    for some in pairs.chunks(PAIRS_AT_A_TIME) {
        let of_both = some.iter().flat_map(|&n| KINDS.map(|kind| (kind, n))).collect();
        reports.extend(tried(search, state, of_both)?);
        if !FalseAcceptance::of(&reports).may_decide() {
            break;
        }
    }
    Ok(FalseAcceptance::of(&reports))
}

// What is accepted on each of these surrogates, by kind and number.
fn tried(
    search: &Search,
    state: &State,
    which: Vec<(Turned, u64)>,
) -> Result<Vec<SurrogateReport>, IdentifyError> {
    let layout = search.problem.form.layout();
    let residual = &state.fitted.at.residual;
    let (all, done) = (which.len(), AtomicUsize::new(0));
    let of = |(turned, number): (Turned, u64)| {
        let seed = search.problem.options.seed.wrapping_mul(1009).wrapping_add(number);
        let rows = match turned {
            Turned::Flipped => flipped(layout, residual, seed),
            Turned::Shifted => shifted(layout, residual, seed),
        };
        let accepted = first_accepted(search, state, rows)?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        search.problem.options.tell(&format!("  {done} of {all} surrogates searched"));
        Ok(SurrogateReport { turned, accepted })
    };
    which.into_par_iter().map(of).collect()
}

fn first_accepted(search: &Search, state: &State, turned: Vec<f64>) -> Result<Option<String>, IdentifyError> {
    let change = turned.iter().zip(&state.fitted.at.residual).map(|(t, r)| t - r).collect();
    let form = Surrogate { form: search.problem.form, change };
    let problem = Problem { form: &form, ..*search.problem };
    let mut search = search.on(&problem);
    let model = state.fitted.model.again(&problem)?;
    let at = model.linearise(&problem);
    let state = search.settled(model, at, state.accepted.clone())?;
    let round = search.round(&state, 1, Vec::new());
    Ok(round.passed.first().map(|r| r.trial.label()))
}

// A residual form whose measured rows differ by a constant change.
struct Surrogate<'a> {
    form: &'a dyn ResidualForm,
    change: Vec<f64>,
}

impl Surrogate<'_> {
    fn changed(&self, mut rows: Vec<f64>) -> Vec<f64> {
        rows.iter_mut().zip(&self.change).for_each(|(r, c)| *r += c);
        rows
    }
}

impl ResidualForm for Surrogate<'_> {
    fn layout(&self) -> &Layout {
        self.form.layout()
    }
    fn residual(&self, plant: &Plant, p: &[f64]) -> Vec<f64> {
        self.changed(self.form.residual(plant, p))
    }
    fn residuals(&self, plant: &Plant, sets: &[Vec<f64>], springs: Springs, grid: Grid) -> Vec<Vec<f64>> {
        self.form.residuals(plant, sets, springs, grid).into_iter().map(|rows| self.changed(rows)).collect()
    }
    fn holds_on_coarse(&self, plant: &Plant, sets: &[Vec<f64>], springs: Springs) -> bool {
        self.form.holds_on_coarse(plant, sets, springs)
    }
    fn columns(&self, plant: &Plant, p: &[f64], positions: &[usize], springs: Springs) -> Vec<Vec<f64>> {
        self.form.columns(plant, p, positions, springs)
    }
    fn position_noise(&self, plant: &Plant, p: &[f64], seeds: &[u64]) -> Vec<Vec<f64>> {
        self.form.position_noise(plant, p, seeds)
    }
    fn reference(&self) -> Option<Arc<Reference>> {
        self.form.reference()
    }
    fn is_white(&self) -> bool {
        self.form.is_white()
    }
}

// One sign a block, the same in all channels.
fn flipped(layout: &Layout, rows: &[f64], seed: u64) -> Vec<f64> {
    let mut random = SmallRng::seed_from_u64(seed);
    let signs: Vec<f64> =
        (0..layout.blocks).map(|_| if random.random::<bool>() { 1.0 } else { -1.0 }).collect();
    rows.iter().zip(&layout.block).map(|(r, &block)| r * signs[block]).collect()
}

// One shift a run, as a share of its rows that count.
fn shifted(layout: &Layout, rows: &[f64], seed: u64) -> Vec<f64> {
    let mut random = SmallRng::seed_from_u64(seed);
    let runs = layout.segments.iter().map(|s| s.record + 1).max().unwrap_or(0);
    let shares: Vec<f64> = (0..runs).map(|_| 0.1 + 0.8 * random.random::<f64>()).collect();
    let mut out = rows.to_vec();
    for segment in &layout.segments {
        let kept: Vec<usize> =
            (segment.first..segment.first + segment.len).filter(|&k| layout.keep[k]).collect();
        let by = (shares[segment.record] * kept.len() as f64) as usize;
        for (n, &k) in kept.iter().enumerate() {
            out[k] = rows[kept[(n + by) % kept.len()]];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::residual::Segment;

    // Two runs of four rows, two blocks each, the first row of each at rest.
    fn layout() -> Layout {
        let segment = |record: usize| Segment { record, channel: 0, first: 4 * record, len: 4 };
        Layout {
            channels: Vec::new(),
            segments: vec![segment(0), segment(1)],
            len: 8,
            keep: (0..8).map(|k| k % 4 != 0).collect(),
            reversal: vec![0.0; 8],
            block: (0..8).map(|k| k / 2).collect(),
            fold: vec![0; 8],
            blocks: 4,
            folds: 1,
            period: 1e-3,
        }
    }

    #[test]
    fn surrogates_keep_the_sizes_of_the_rows() {
        let rows: Vec<f64> = (0..8).map(|k| f64::from(k) + 1.0).collect();
        for seed in 0..20 {
            let flipped = flipped(&layout(), &rows, seed);
            assert!(flipped.iter().zip(&rows).all(|(a, b)| a.abs() == *b));
            assert!((0..4).all(|b| flipped[2 * b].signum() == flipped[2 * b + 1].signum()));
            let shifted = shifted(&layout(), &rows, seed);
            for run in [0, 4] {
                assert_eq!(shifted[run], rows[run], "a row at rest stays");
                let mut moved = shifted[run + 1..run + 4].to_vec();
                moved.sort_by(f64::total_cmp);
                assert_eq!(moved, rows[run + 1..run + 4]);
            }
        }
    }

    #[test]
    fn counting_ends_where_the_rest_cannot_change_the_answer() {
        // (3 + 1)/(20 + 2) = 0.18, (4 + 1)/(20 + 2) = 0.23, and what was not tried can only lower the chance.
        let after = |accepted, surrogates| FalseAcceptance { accepted, surrogates };
        assert!(after(3, 4).may_decide() && !after(3, 4).decides());
        assert!(!after(4, 4).may_decide() && !after(4, 4).decides());
        assert!(!after(4, 20).may_decide() && after(3, 20).decides());
    }

    #[test]
    fn the_sentence_follows_the_count() {
        let of = |accepted| sentence(&FalseAcceptance { accepted, surrogates: 20 });
        assert!(of(0).starts_with("on 0 of 20") && of(0).ends_with("see its probability"));
        assert!(of(3).contains("with care") && of(4).contains("too short"));
    }
}
