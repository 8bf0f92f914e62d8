//! How logged torques are taken: as held until the next, or as those of moments.

use crate::IdentifyError;
use crate::colour::Whitener;
use crate::least_squares::dot;
use crate::problem::{Candidate, Equations, Linearised};
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
// The share of the objective that one of them may leave, and that below which nothing else is asked.
const CLEARLY: f64 = 0.95;
const HALF: f64 = 0.5;
// What joints may rise by in −2 log likelihood, as a share of what others fall by.
const AT_COST: f64 = 0.1;

impl Search<'_> {
    /// A logged torque is taken as held until the next. Where a log keeps one of several commands, or torques that no
    /// computer holds, it is that of a moment, and the rows tell of which one: the base about a motion that it gives with
    /// such torques, if it fits clearly better.
    pub fn with_torques_of_moments(
        &self,
        model: &mut Candidate,
        at: Linearised,
    ) -> Result<Linearised, IdentifyError> {
        let form = self.problem.form;
        let Some(reference) = form.reference() else { return Ok(at) };
        let (whitener, value) = self.alone(model, &at);
        let Some(earliness) = self.earliness(model, &at, &whitener) else { return Ok(at) };
        let Some(share) = earliness.moment() else { return Ok(at) };
        let held = Followed { value, misfits: reference.misfit_by_joint.clone() };
        let torques = LoggedTorques { early: share * form.layout().period, ..reference.torques };
        let mut tried = model.again(self.problem)?;
        let followed = self.followed_taking(torques, &mut tried);
        let is_sure = earliness.is_of(share);
        if !followed.is_some_and(|now| now.is_better_than(&held, is_sure, form.layout())) {
            form.adopt(&reference);
            return Ok(at);
        }
        form.begin_anew(torques);
        *model = tried;
        Ok(self.led(model, &RENEWALS, |model| self.descended(model, &whitener), true))
    }

    // By how much logged torques act before the middles of their holds, as the rows tell about the present motion while
    // everything that is free follows.
    //
    // z = ∂y/∂e,   S = zᵀz − zᵀJ A⁻¹ Jᵀz,   e = zᵀ(r − J d)/S,   σ = 1/√S
    fn earliness(&self, model: &Candidate, at: &Linearised, whitener: &Whitener) -> Option<Earliness> {
        let form = self.problem.form;
        let step = MOMENTS[0];
        let taken = form.residual_taking(step * form.layout().period, &model.plant, &model.p);
        let change: Vec<f64> = at.residual.iter().zip(&taken).map(|(held, taken)| held - taken).collect();
        let z = whitener.apply(form.layout(), &change);
        let base = Equations::new(whitener, self.problem, model, at, 0.0)?;
        let g: Vec<f64> = base.columns.iter().map(|column| dot(column, &z)).collect();
        let s = dot(&z, &z) - dot(&g, &base.normal.solve(&g));
        let share = step * (dot(&z, &base.residual) - dot(&g, &base.step)) / s;
        let std = step / s.sqrt();
        share.is_finite().then_some(Earliness { share, std })
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

// A share of a row by which logged torques act before the middles of their holds, and its standard deviation.
#[derive(Clone, Copy)]
struct Earliness {
    share: f64,
    std: f64,
}

impl Earliness {
    // The moment that it tells of, if any: a lag that the model lacks, or too much inertia, tells of other times.
    fn moment(self) -> Option<f64> {
        let off = |moment: f64| (self.share - moment).abs();
        let nearest_of = |moments: &[f64]| moments.iter().copied().min_by(|a, b| off(*a).total_cmp(&off(*b)));
        let common = nearest_of(&MOMENTS)?;
        let nearest =
            if self.is_of(common) { common } else { nearest_of(&[MOMENTS, RARE_MOMENTS].concat())? };
        let is_told = self.share > TOLD * self.std && off(nearest) < OFF + STRAY * self.std;
        is_told.then_some(nearest)
    }

    // True if it is that of a moment to within its own error.
    fn is_of(self, moment: f64) -> bool {
        (self.share - moment).abs() < STRAY * self.std
    }
}

// How a model does about a motion that it has led: its objective under the noise that it leaves, and −2 log likelihood by
// joint.
struct Followed {
    value: f64,
    misfits: Vec<f64>,
}

impl Followed {
    // What an effect leaves that is missing may shrink a little by a wrong time, too; the log is then less likely, which is not
    // asked where the time `is_sure`. Where `layout` says that much is left even so, only what joint after joint says counts.
    fn is_better_than(&self, other: &Self, is_sure: bool, layout: &Layout) -> bool {
        let misfit = |of: &Self| of.misfits.iter().sum::<f64>();
        let is_likelier = || is_sure || misfit(self) < misfit(other);
        let fits = self.value < HALF * other.value || (self.value < CLEARLY * other.value && is_likelier());
        let is_told_by_joints = || is_likelier_by_joints(&other.misfits, &self.misfits);
        self.value < other.value - FALLS && ((fits && !layout.is_much(self.value)) || is_told_by_joints())
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
}
