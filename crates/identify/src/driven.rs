//! Models with drives that are late, led with what they foretell, or the whole of the logged torques, passing them.

use std::sync::Arc;

use crate::IdentifyError;
use crate::colour::Whitener;
use crate::innovation::Reference;
use crate::problem::Candidate;
use crate::residual::{LoggedTorques, Passing, Start};
use crate::search::Search;
use crate::settle::{Led, ONCE_MORE, RENEWALS};

const WHOLE: Passing = Passing::Whole { smoothed: 0.0 };

impl Search<'_> {
    /// A model led about a reference of its own with torques taken as held, what it foretells passing its drives: torques of moments
    /// make up for the way in which a drive is late, and what passed the drives of another model is not foretold by this one.
    pub fn led_as_held(&self, model: &Candidate, whitener: &Whitener) -> Result<Led, IdentifyError> {
        let present = self.problem.form.reference();
        self.led_passing(Passing::Foretold, &RENEWALS, model, present.as_ref(), whitener)
    }

    /// A reference of a model led from its own with the whole of the logged torques passing the drives, smoothed over a time before, s;
    /// none where there is none, and of torques of moments, of which nothing is known in between.
    pub fn reference_driven(
        &self,
        model: &Candidate,
        reference: Option<&Arc<Reference>>,
        smoothed: f64,
    ) -> Option<Arc<Reference>> {
        let form = self.problem.form;
        let own = reference.filter(|reference| reference.torques.early == 0.0)?;
        let present = form.reference();
        form.adopt(own);
        form.begin_anew(LoggedTorques { passing: Passing::Whole { smoothed }, ..own.torques });
        form.renew(&model.plant, &model.p, Start::Reference);
        let driven = form.reference();
        present.iter().for_each(|reference| form.adopt(reference));
        driven
    }

    /// −2 log likelihood about it.
    pub fn misfit_driven(
        &self,
        model: &Candidate,
        reference: Option<&Arc<Reference>>,
        smoothed: f64,
    ) -> Option<f64> {
        self.reference_driven(model, reference, smoothed).map(|driven| driven.misfit())
    }

    /// A model with its reference led once more in rows of what is left if the whole of the logged torques passes its drives.
    pub fn led_driven(
        &self,
        model: &Candidate,
        reference: Option<&Arc<Reference>>,
        whitener: &Whitener,
    ) -> Result<Led, IdentifyError> {
        // A motion that the model without it has made rough may lead astray, and so may a smooth one.
        let first = self.led_passing(WHOLE, &ONCE_MORE, model, reference, whitener)?;
        let second = self.led_passing(WHOLE, &RENEWALS, model, reference, whitener)?;
        Ok(first.or_likelier(second))
    }

    /// The same of a model that was led so, from the motion of another, if that makes the log likelier.
    pub fn led_driven_beside(
        &self,
        own: Led,
        other: &Led,
        whitener: &Whitener,
    ) -> Result<Led, IdentifyError> {
        let from = self.led_passing(WHOLE, &ONCE_MORE, &own.model, other.reference.as_ref(), whitener)?;
        Ok(own.or_likelier(from))
    }

    /// The same of a model that was led so, with what it foretells passing its drives.
    pub fn led_foretold(&self, driven: &Led, whitener: &Whitener) -> Result<Led, IdentifyError> {
        let (model, reference) = (&driven.model, driven.reference.as_ref());
        self.led_passing(Passing::Foretold, &ONCE_MORE, model, reference, whitener)
    }

    fn led_passing(
        &self,
        passing: Passing,
        starts: &[Start],
        model: &Candidate,
        reference: Option<&Arc<Reference>>,
        whitener: &Whitener,
    ) -> Result<Led, IdentifyError> {
        let form = self.problem.form;
        let mut model = model.again(self.problem)?;
        if let Some(own) = reference {
            form.adopt(own);
            form.begin_anew(LoggedTorques { passing, early: 0.0, ..own.torques });
        }
        let at = self.led(&mut model, starts, |model| self.descended(model, whitener), false);
        Ok(self.present(model, at))
    }
}
