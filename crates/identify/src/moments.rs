//! How logged torques are taken: as held until the next, or as those of moments.

use crate::IdentifyError;
use crate::colour::Whitener;
use crate::equations::Equations;
use crate::least_squares::dot;
use crate::problem::{Candidate, Linearised};
use crate::residual::{Layout, LoggedTorques, Start};
use crate::search::Search;
use crate::settle::{FALLS, RENEWALS};

// Shares of a row by which a torque of a moment acts before the middle of its hold, (1 − 1/n)/2: of commands of which every
// second, fourth or eighth is logged, and of a torque that nothing holds; of every third, fifth, tenth or twentieth, which are
// rarer. How far off one is that the rows tell, and by how many standard deviations they tell it.
const MOMENTS: [f64; 4] = [0.25, 0.375, 0.4375, 0.5];
const RARE_MOMENTS: [f64; 4] = [1.0 / 3.0, 0.4, 0.45, 0.475];
const OFF: f64 = 0.0625;
const STRAY: f64 = 3.0;
const TOLD: f64 = 5.0;
// The share of a row by which torques are taken to act earlier to see what it changes, and the standard deviation of a share that
// tells nothing.
const STEP: f64 = 0.25;
const ROUGH: f64 = 0.1;
// The share of the objective that one of them may leave, and that below which nothing else is asked.
const CLEARLY: f64 = 0.95;
const HALF: f64 = 0.5;
// What joints may rise by in −2 log likelihood, as a share of what others fall by.
const AT_COST: f64 = 0.1;
// Times that a model is asked at most, the next about the motion that the last has given it.
const MOST_ASKED: usize = 3;

impl Search<'_> {
    /// A logged torque is taken as held until the next. Where a log keeps one of several commands, or torques that no
    /// computer holds, it is that of a moment, and the rows tell of which one: a model about a motion that it gives with
    /// such torques, if it fits clearly better. A base that lacks a lag may take a later moment for it, so a model that has one
    /// is asked again.
    pub fn with_torques_of_moments(
        &self,
        model: &mut Candidate,
        mut at: Linearised,
    ) -> Result<Linearised, IdentifyError> {
        for _ in 0..MOST_ASKED {
            match self.with_another_moment(model, &at)? {
                Some(other) => at = other,
                None => break,
            }
        }
        Ok(at)
    }

    // The same once; none where the torques are those that they are taken for.
    fn with_another_moment(
        &self,
        model: &mut Candidate,
        at: &Linearised,
    ) -> Result<Option<Linearised>, IdentifyError> {
        let form = self.problem.form;
        let Some(reference) = form.reference() else { return Ok(None) };
        let (whitener, value) = self.alone(model, at);
        let Some(earliness) = self.earliness(model, at, &whitener) else { return Ok(None) };
        let mut likeliest: Option<(LoggedTorques, Candidate, Followed)> = None;
        for share in earliness.moments() {
            let torques = LoggedTorques { early: share * form.layout().period, ..reference.torques };
            let mut tried = model.again(self.problem)?;
            let followed = (torques != reference.torques).then(|| self.followed_taking(torques, &mut tried));
            form.adopt(&reference);
            let Some(now) = followed.flatten() else { continue };
            if likeliest.as_ref().is_none_or(|(_, _, other)| now.misfit() < other.misfit()) {
                likeliest = Some((torques, tried, now));
            }
        }
        let Some((torques, tried, now)) = likeliest else { return Ok(None) };
        let present = Followed { value, misfits: reference.misfit_by_joint.clone() };
        let is_sure = earliness.moment().is_some_and(|moment| earliness.is_of(moment));
        // Of two moments the likelihood tells; that of a hold is not compared with theirs where the time is sure.
        let is_other_moment = reference.torques.early > 0.0 && is_sure;
        let is_likelier = is_other_moment && now.misfit() < present.misfit() - FALLS;
        if !(is_likelier || now.is_better_than(&present, is_sure, form.layout())) {
            return Ok(None);
        }
        form.begin_anew(torques);
        *model = tried;
        Ok(Some(self.led(model, &RENEWALS, |model| self.descended(model, &whitener), true)))
    }

    // By how much logged torques act before the middles of their holds, as the rows tell about the present motion while
    // everything that is free follows.
    //
    // z = ∂y/∂e,   S = zᵀz − zᵀJ A⁻¹ Jᵀz,   e = zᵀ(r − J d)/S,   σ = 1/√S
    fn earliness(&self, model: &Candidate, at: &Linearised, whitener: &Whitener) -> Option<Earliness> {
        let form = self.problem.form;
        let early = form.reference()?.torques.early / form.layout().period;
        let taken = form.residual_taking(STEP * form.layout().period, &model.plant, &model.p);
        let taken = Taken { early: early + STEP, rows: &taken };
        self.earliness_between(model, at, whitener, [Taken { early, rows: &at.residual }, taken])
    }

    // The same by residuals with torques taken in the present way and in another.
    fn earliness_between(
        &self,
        model: &Candidate,
        at: &Linearised,
        whitener: &Whitener,
        [present, other]: [Taken; 2],
    ) -> Option<Earliness> {
        let step = other.early - present.early;
        let change: Vec<f64> =
            present.rows.iter().zip(other.rows).map(|(present, other)| present - other).collect();
        let z = whitener.apply(self.problem.form.layout(), &change);
        let base = Equations::new(whitener, self.problem, model, at, 0.0)?;
        let g: Vec<f64> = base.columns.iter().map(|column| dot(column, &z)).collect();
        let s = dot(&z, &z) - dot(&g, &base.quadratic.normal.solve(&g));
        let share = step * (dot(&z, &base.residual) - dot(&g, &base.quadratic.step)) / s;
        let std = step.abs() / s.sqrt();
        share.is_finite().then_some(Earliness { share: present.early + share, std })
    }

    /// By how much logged torques act before the middles of their holds, s, where the rows of smoothed channels tell of another
    /// time about a fitted base than the one they are taken for. What is missing makes rows that tell of none.
    pub fn torques_told(&self, model: &Candidate, at: &Linearised) -> Option<f64> {
        let (form, period) = (self.problem.form, self.problem.form.layout().period);
        let (whitener, _) = self.alone(model, at);
        let is_centred = self.records.iter().all(|record| record.scales.held);
        let present = Taken { early: if is_centred { 0.0 } else { 2.0 * STEP }, rows: &at.residual };
        let torques = LoggedTorques { early: STEP * period, ..LoggedTorques::default() };
        let taken = form.residual_told(torques, &model.plant, &model.p);
        let told =
            self.earliness_between(model, at, &whitener, [present, Taken { early: STEP, rows: &taken }])?;
        let is_held = !is_centred && told.is_of(0.0) && told.std < ROUGH;
        let share = if is_held { 0.0 } else { told.moment()? };
        Some(share * period)
    }

    // How a model does that has followed logged torques taken so.
    fn followed_taking(&self, torques: LoggedTorques, model: &mut Candidate) -> Option<Followed> {
        self.problem.form.begin_anew(torques);
        self.followed(model, Start::Kernel);
        let (_, _, [_, value]) = self.followed(model, Start::Reference);
        let misfits = self.problem.form.reference()?.misfit_by_joint.clone();
        Some(Followed { value, misfits })
    }
}

// Residual rows with torques that act by so much of a row before the middles of their holds.
#[derive(Clone, Copy)]
struct Taken<'r> {
    early: f64,
    rows: &'r [f64],
}

// A share of a row by which logged torques act before the middles of their holds, and its standard deviation.
#[derive(Debug, Clone, Copy)]
struct Earliness {
    share: f64,
    std: f64,
}

impl Earliness {
    // The moment that it tells of, if any: a lag that the model lacks, or too much inertia, tells of other times.
    fn moment(self) -> Option<f64> {
        let common = self.nearest_of(&MOMENTS)?;
        let nearest =
            if self.is_of(common) { common } else { self.nearest_of(&[MOMENTS, RARE_MOMENTS].concat())? };
        let is_told = self.share > TOLD * self.std && self.off(nearest) < OFF + STRAY * self.std;
        is_told.then_some(nearest)
    }

    // The same with the next common one that it does not exclude: beside a lag rows tell of a moment less well than they say.
    fn moments(self) -> impl Iterator<Item = f64> {
        let nearest = self.moment();
        let others: Vec<f64> = MOMENTS.into_iter().filter(|m| nearest != Some(*m)).collect();
        let is_open = |next: &f64| self.off(*next) < 2.0 * STRAY * self.std;
        let next = self.nearest_of(&others).filter(|next| nearest.is_some() && is_open(next));
        nearest.into_iter().chain(next)
    }

    fn nearest_of(self, moments: &[f64]) -> Option<f64> {
        moments.iter().copied().min_by(|a, b| self.off(*a).total_cmp(&self.off(*b)))
    }

    fn off(self, moment: f64) -> f64 {
        (self.share - moment).abs()
    }

    // True if it is that of a moment to within its own error.
    fn is_of(self, moment: f64) -> bool {
        self.off(moment) < STRAY * self.std
    }
}

// How a model does about a motion that it has led: its objective under the noise that it leaves, and −2 log likelihood by
// joint.
struct Followed {
    value: f64,
    misfits: Vec<f64>,
}

impl Followed {
    fn misfit(&self) -> f64 {
        self.misfits.iter().sum()
    }

    // What an effect leaves that is missing may shrink a little by a wrong time, too; the log is then less likely, which is not
    // asked where the time `is_sure`. Where `layout` says that much is left even so, only what joint after joint says counts. Behind
    // coarse encoders what a wrong time leaves is taken for torque noise, and no rows under it shrink: where the time is sure,
    // what the joints say is enough.
    fn is_better_than(&self, other: &Self, is_sure: bool, layout: &Layout) -> bool {
        let is_likelier = || is_sure || self.misfit() < other.misfit();
        let fits = self.value < HALF * other.value || (self.value < CLEARLY * other.value && is_likelier());
        let is_told_by_joints = is_likelier_by_joints(&other.misfits, &self.misfits);
        let leaves_less = self.value < other.value - FALLS;
        (leaves_less && fits && !layout.is_much(self.value))
            || (is_told_by_joints && (leaves_less || is_sure))
    }
}

// True if another way to take logged torques makes the log likelier by joint after joint: it is the same for all of them,
// where an effect that one of them lacks may ask for it at the cost of others.
fn is_likelier_by_joints(before: &[f64], after: &[f64]) -> bool {
    let changes = || before.iter().zip(after).map(|(before, after)| after - before);
    let (rise, fall) = changes().fold((0.0, 0.0), |(rise, fall), x| (rise + x.max(0.0), fall - x.min(0.0)));
    changes().filter(|x| *x < -FALLS).count() > 1 && rise < AT_COST * fall
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn how_torques_are_logged_is_the_same_for_all_joints() {
        let before = [-5000.0, -7000.0, -6000.0];
        let with =
            |changes: [f64; 3]| -> Vec<f64> { before.iter().zip(changes).map(|(b, c)| b + c).collect() };
        assert!(is_likelier_by_joints(&before, &with([-900.0, -40.0, 20.0])));
        // One joint alone asks for it: it may lack an effect.
        assert!(!is_likelier_by_joints(&before, &with([-900.0, 30.0, 20.0])));
        assert!(!is_likelier_by_joints(&before, &with([-900.0, -900.0, 2000.0])));
    }

    // Under a noise that has shrunk, rows leave as much as before.
    #[test]
    fn a_sure_moment_that_joint_after_joint_asks_for_is_taken() {
        let layout = Layout::of(&[], &[], 0.0, |_, _| 0.0);
        let before = Followed { value: 3600.0, misfits: vec![-5000.0, -7000.0, -6000.0] };
        let with = |misfits: [f64; 3]| Followed { value: 3700.0, misfits: misfits.to_vec() };
        assert!(with([-6500.0, -9000.0, -6900.0]).is_better_than(&before, true, &layout));
        assert!(!with([-6500.0, -9000.0, -6900.0]).is_better_than(&before, false, &layout));
        assert!(!with([-6500.0, -6990.0, -6000.0]).is_better_than(&before, true, &layout));
    }

    #[test]
    fn only_a_time_that_a_log_can_have_is_that_of_a_moment() {
        let moment = |share, std| Earliness { share, std }.moment();
        assert_eq!(moment(0.35, 0.03), Some(0.375));
        assert_eq!(moment(0.247, 0.001), Some(0.25));
        assert_eq!(moment(0.436, 0.001), Some(0.4375));
        assert_eq!(moment(0.451, 0.001), Some(0.45));
        // Not sure, late, and a time of something else.
        assert_eq!(moment(0.35, 0.08), None);
        assert_eq!(moment(-0.4, 0.01), None);
        assert_eq!(moment(0.1, 0.01), None);
        assert_eq!(moment(0.7, 0.02), None);
    }

    #[test]
    fn of_two_moments_that_rows_leave_open_both_are_tried() {
        let moments = |share, std| Earliness { share, std }.moments().collect::<Vec<f64>>();
        assert_eq!(moments(0.388, 0.0105), [0.375, 0.4375]);
        assert_eq!(moments(0.436, 0.001), [0.4375]);
        assert_eq!(moments(0.451, 0.001), [0.45]);
        assert!(moments(0.1, 0.01).is_empty());
    }
}
