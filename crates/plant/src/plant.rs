//! The plant: a mechanism, its transmissions and its effects.

use core::ops::Range;

use sinew_effect::{Act, Catalogue, Effect};
use sinew_model::{Coupling, EffectSpec, LinkId, Model, Robot};

use crate::{Active, PlantError};

/// A parameter of a plant: which effect, and which of its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ParameterId {
    /// Index into [`Plant::effects`].
    pub effect: usize,
    /// Index into the card's parameters.
    pub parameter: usize,
}

/// A robot with its effects. Never changes after it is built; parameters are given to each evaluation.
#[derive(Debug)]
pub struct Plant {
    pub(crate) model: Model,
    pub(crate) effects: Vec<Active>,
    pub(crate) couplings: Vec<Coupling>,
    pub(crate) elastic: Vec<bool>,
    pub(crate) coupled: Vec<bool>,
    pub(crate) ranges: Vec<Range<usize>>,
    pub(crate) states: Vec<Range<usize>>,
    tool: LinkId,
}

impl Plant {
    /// The plant of a robot: rotors, springs and every stated effect.
    ///
    /// # Errors
    /// If an effect is unknown, misplaced or out of range, or the robot has parts that plants do not take.
    pub fn new(robot: &Robot, catalogue: &Catalogue) -> Result<Self, PlantError> {
        Self::with_effects(robot, &robot.all_effects(), catalogue)
    }

    /// The plant of a robot with exactly these effects, those of its joints included.
    ///
    /// # Errors
    /// As [`Plant::new`].
    pub fn with_effects(
        robot: &Robot,
        specs: &[EffectSpec],
        catalogue: &Catalogue,
    ) -> Result<Self, PlantError> {
        let model = robot.model.clone();
        refuse_unsupported(robot)?;
        let make = |spec| Active::new(&model, robot.tool, spec, catalogue);
        let effects = specs.iter().map(make).collect::<Result<Vec<_>, _>>()?;
        let mut elastic = vec![false; model.nv];
        let mut coupled = vec![false; model.nv];
        for dof in effects.iter().filter_map(|e| e.effect.elastic_dof()) {
            elastic[dof] = true;
        }
        for &dof in robot.couplings.iter().flat_map(|c| &c.dofs) {
            (elastic[dof], coupled[dof]) = (true, true);
        }
        let ranges = stack(effects.iter().map(|e| e.values.len()));
        let states = stack(effects.iter().map(|e| e.effect.states()));
        let couplings = robot.couplings.clone();
        Ok(Self { model, effects, couplings, elastic, coupled, ranges, states, tool: robot.tool })
    }

    /// The mechanism.
    pub fn model(&self) -> &Model {
        &self.model
    }
    /// The end-effector.
    pub fn tool(&self) -> LinkId {
        self.tool
    }
    /// The effects, with their values as stated.
    pub fn effects(&self) -> &[Active] {
        &self.effects
    }
    /// For each degree of freedom, whether its joint is elastic.
    pub fn elastic(&self) -> &[bool] {
        &self.elastic
    }
    /// Transmissions that couple joints.
    pub fn couplings(&self) -> &[Coupling] {
        &self.couplings
    }
    /// The values of all parameters as stated, effect by effect.
    pub fn parameters(&self) -> Vec<f64> {
        self.effects.iter().flat_map(|e| e.values.iter().copied()).collect()
    }
    /// Where the parameters of effect `effect` stand in [`Plant::parameters`].
    pub fn range(&self, effect: usize) -> Range<usize> {
        self.ranges[effect].clone()
    }
    /// The place of one parameter in [`Plant::parameters`].
    pub fn position(&self, id: ParameterId) -> usize {
        self.ranges[id.effect].start + id.parameter
    }
    /// Every parameter, in the order of [`Plant::parameters`].
    pub fn parameter_ids(&self) -> Vec<ParameterId> {
        let of = |(effect, active): (usize, &Active)| {
            (0..active.values.len()).map(move |parameter| ParameterId { effect, parameter })
        };
        self.effects.iter().enumerate().flat_map(of).collect()
    }
    /// Where the own states of effect `effect` stand among those of all.
    pub fn own_states(&self, effect: usize) -> Range<usize> {
        self.states[effect].clone()
    }
    /// Number of own states of all effects.
    pub fn state_len(&self) -> usize {
        self.states.last().map_or(0, |r| r.end)
    }
    /// The index of the effect `kind` that acts at the place called `place`.
    pub fn find(&self, kind: &str, place: &str) -> Option<usize> {
        self.effects.iter().position(|e| e.spec.kind == kind && e.spec.place.to_string() == place)
    }

    pub(crate) fn acting(&self, act: Act) -> Vec<usize> {
        let acts = |e: &Active| e.effect.acts().contains(&act);
        (0..self.effects.len()).filter(|&k| acts(&self.effects[k])).collect()
    }
    pub(crate) fn effect(&self, k: usize) -> &dyn Effect {
        self.effects[k].effect.as_ref()
    }
}

fn refuse_unsupported(robot: &Robot) -> Result<(), PlantError> {
    let unsupported = |what: String, help: &str| PlantError::Unsupported {
        robot: robot.model.name.clone(),
        what,
        help: help.to_owned(),
    };
    if robot.model.nq != robot.model.nv {
        let what = "it has a floating base, which measured runs cannot describe".to_owned();
        return Err(unsupported(
            what,
            "fix the base in the URDF; kinematics and rigid dynamics take floating bases",
        ));
    }
    if let Some(bending) = robot.bending.first() {
        let link = &robot.model.links[bending.link.0].name;
        let what = format!("link \"{link}\" is said to bend, which this version does not compute");
        return Err(unsupported(
            what,
            "remove [links.….bending], or lump the bending into the joint's stiffness",
        ));
    }
    Ok(())
}

fn stack(lengths: impl Iterator<Item = usize>) -> Vec<Range<usize>> {
    let mut end = 0;
    let mut next = |n| {
        let start = end;
        end += n;
        start..end
    };
    lengths.map(&mut next).collect()
}
