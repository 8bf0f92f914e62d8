//! A spring that is stated far from the truth swings at another frequency: a descent from there ends in a wrong valley.

use crate::IdentifyError;
use crate::problem::{Candidate, objective};
use crate::search::{Search, State};

// Factors on a stated compliance that are tried.
const FACTORS: [f64; 6] = [0.25, 0.4, 0.63, 1.26, 1.6, 2.1];
// Share of what the stated springs leave below which others are worth a descent.
const BETTER: f64 = 0.7;

impl Search<'_> {
    /// The base, or the one that is reached from another stiffness of one joint if that fits better: where much is left,
    /// every spring is tried at other values with everything else as stated.
    pub fn with_other_springs(&self, base: State) -> Result<State, IdentifyError> {
        if !self.problem.form.layout().is_much(base.fitted.objective) {
            return Ok(base);
        }
        let Some(model) = self.at_other_springs(&base)? else { return Ok(base) };
        let other = self.settled_anew(model, |model| self.descended(model, &base.whitener), Vec::new())?;
        if self.fits_better(&other, &base) {
            return Ok(other);
        }
        base.reference.iter().for_each(|r| self.problem.form.adopt(r));
        Ok(base)
    }

    // The model as stated but for the one spring whose change explains most; none if none explains much.
    fn at_other_springs(&self, base: &State) -> Result<Option<Candidate>, IdentifyError> {
        let mut model = base.fitted.model.again(self.problem)?;
        model.straighten();
        let springs = model.unknowns.iter().filter(|u| {
            let card = model.plant.effects()[u.id.effect].effect.card();
            card.name == "joint_elasticity" && !u.shape && u.prior.is_some()
        });
        let changed = springs.flat_map(|u| FACTORS.map(|factor| (u.position, factor * model.p[u.position])));
        let changed = changed.map(|(position, value)| {
            let mut p = model.p.clone();
            p[position] = value;
            p
        });
        let sets: Vec<Vec<f64>> = std::iter::once(model.p.clone()).chain(changed).collect();
        if sets.len() == 1 {
            return Ok(None);
        }
        let objectives = model.objectives(self.problem, &base.whitener, &sets);
        let best = (1..sets.len()).min_by(|&a, &b| objectives[a].total_cmp(&objectives[b]));
        let Some(best) = best.filter(|&k| objectives[k] < BETTER * objectives[0]) else { return Ok(None) };
        model.p.clone_from(&sets[best]);
        Ok(Some(model))
    }

    // By the likelihood of all samples about motions of their own where there is one, else under the noise of the first.
    fn fits_better(&self, other: &State, first: &State) -> bool {
        let penalty = |state: &State| state.fitted.model.penalty();
        match (&other.reference, &first.reference) {
            (Some(o), Some(f)) => o.misfit() + penalty(other) < f.misfit() + penalty(first),
            _ => {
                let layout = self.problem.form.layout();
                let white = first.whitener.apply(layout, &other.fitted.at.residual);
                objective(&white, &other.fitted.model) < first.fitted.objective
            }
        }
    }
}
