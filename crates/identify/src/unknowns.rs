//! The free parameters of a fit and what is known of them beforehand.

use sinew_effect::{Prior, Role};
use sinew_plant::{ParameterId, Plant};

/// A free parameter.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Unknown {
    /// Which parameter of the plant.
    pub id: ParameterId,
    /// Its place in the plant's parameters.
    pub position: usize,
    /// Expected value and its standard deviation; none: nothing is known.
    pub prior: Option<(f64, f64)>,
    /// Size of a natural change, for scaling.
    pub scale: f64,
    /// Smallest and largest value.
    pub range: (f64, f64),
    /// True for a shape: it stays positive and moves by factors.
    pub shape: bool,
    /// True if it is nothing without a strength of its effect beside it.
    pub optional: bool,
}

/// A stated value is pulled this many standard deviations at the most: beyond, another cause must be found.
pub(crate) const FARTHEST: f64 = 15.0;

impl Unknown {
    /// The parameter `id` of a plant with the prior that its sidecar or card states.
    pub fn new(plant: &Plant, id: ParameterId) -> Option<Self> {
        let active = &plant.effects()[id.effect];
        let parameter = &active.effect.card().parameters[id.parameter];
        let (value, optional) = (active.values[id.parameter], parameter.role == Role::Optional);
        if parameter.role == Role::Stated || (optional && active.stds[id.parameter].is_none()) {
            return None;
        }
        let share = |s: f64| (value != 0.0).then_some((value, s * value.abs()));
        let prior = match (active.stds[id.parameter], parameter.prior) {
            (Some(std), _) if std > 0.0 => Some((value, std)),
            (_, Prior::Share(s) | Prior::Factor(s)) => share(s),
            (_, Prior::Absolute(a)) => Some((value, a)),
            (_, Prior::Free) => None,
        };
        let shape = matches!(parameter.role, Role::Shape { .. });
        // A shape that nobody knows still has a size.
        let prior = if shape { prior.or_else(|| share(1.0)) } else { prior };
        let scale = prior.map_or(if value != 0.0 { value.abs() } else { 1.0 }, |(_, std)| std);
        Some(Self { id, position: plant.position(id), prior, scale, range: parameter.range, shape, optional })
    }

    /// All parameters of one effect.
    pub fn of_effect(plant: &Plant, effect: usize) -> Vec<Self> {
        let count = plant.effects()[effect].values.len();
        (0..count).filter_map(|parameter| Self::new(plant, ParameterId { effect, parameter })).collect()
    }

    /// True if an effect is absent where all that are so are zero.
    pub fn is_strength(&self) -> bool {
        !self.shape && !self.optional
    }

    /// Weight 1/σ² of the prior; zero without one.
    pub fn weight(&self) -> f64 {
        self.prior.map_or(0.0, |(_, std)| 1.0 / (std * std))
    }

    /// Prior misfit ((x − m)/σ)².
    pub fn pull(&self, x: f64) -> f64 {
        self.prior.map_or(0.0, |(mean, std)| ((x - mean) / std).powi(2))
    }

    /// `from + step`, kept in range: a positive strength goes to a fifth instead of below zero, a shape changes by at
    /// most a factor of 2.5.
    pub fn moved(&self, from: f64, step: f64) -> f64 {
        let (low, high) = self.range;
        let mut to = from + step;
        if let (Some((mean, std)), false) = (self.prior, self.shape) {
            to = to.clamp(mean - FARTHEST * std, mean + FARTHEST * std);
        }
        if self.shape && from > 0.0 {
            to = to.clamp(from / 2.5, from * 2.5);
        }
        if to < low {
            to = if low == 0.0 { 0.2 * from.max(0.0) } else { low };
        }
        to.min(high)
    }
}
