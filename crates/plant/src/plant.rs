//! The plant: a mechanism, its transmissions and its effects.

use core::ops::Range;

use sinew_effect::{Act, Catalogue, Effect, Site};
use sinew_model::{
    Bending, Carried, Coupling, EffectSpec, Extended, Following, LinkId, Model, Place, Robot, VirtualJoint,
};

use crate::active::{hinge_of, refused};
use crate::rotors::{Mount, mounts};
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
    pub(crate) joints: Vec<usize>,
    pub(crate) virtual_joints: Vec<VirtualJoint>,
    pub(crate) driven: Vec<bool>,
    pub(crate) moving: Vec<usize>,
    pub(crate) effects: Vec<Active>,
    pub(crate) couplings: Vec<Coupling>,
    pub(crate) elastic: Vec<bool>,
    pub(crate) coupled: Vec<bool>,
    pub(crate) mounts: Vec<Mount>,
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
        refuse_unsupported(robot)?;
        let extended = (catalogue.extend)(robot).map_err(|message| PlantError::Bending { message })?;
        let (extended, hinges) = hinged(extended, robot, specs, catalogue)?;
        let Extended { model, joints, virtual_joints, .. } = extended;
        let mut driven = vec![true; model.nv];
        virtual_joints.iter().for_each(|v| driven[v.dof] = false);
        let follows = |dof: &usize| {
            virtual_joints.iter().any(|v| v.dof == *dof && v.following == Following::QuasiStatic)
        };
        let moving = (0..model.nv).filter(|dof| !follows(dof)).collect();
        let make = |(spec, hinge): (&EffectSpec, &Option<usize>)| {
            let active = Active::new(&model, robot.tool, spec, catalogue, *hinge)?;
            refuse_on_bending(robot, &model, &virtual_joints, &active)?;
            Ok(active)
        };
        let effects = specs.iter().zip(&hinges).map(make).collect::<Result<Vec<_>, _>>()?;
        let mut elastic = vec![false; model.nv];
        let mut coupled = vec![false; model.nv];
        for dof in effects.iter().filter_map(|e| e.effect.elastic_dof()) {
            elastic[dof] = true;
        }
        let mut couplings = robot.couplings.clone();
        for dof in couplings.iter_mut().flat_map(|c| &mut c.dofs) {
            *dof = joints[*dof];
            (elastic[*dof], coupled[*dof]) = (true, true);
        }
        let ranges = stack(effects.iter().map(|e| e.values.len()));
        let states = stack(effects.iter().map(|e| e.effect.states()));
        let mounts = mounts(robot, &model, &effects)?;
        let tool = robot.tool;
        Ok(Self {
            model,
            joints,
            virtual_joints,
            driven,
            moving,
            effects,
            couplings,
            elastic,
            coupled,
            mounts,
            ranges,
            states,
            tool,
        })
    }

    /// The mechanism, with the virtual joints of bending links among its joints.
    pub fn model(&self) -> &Model {
        &self.model
    }
    /// The degrees of freedom of the robot's own joints, in the robot's order: those that have motors and sensors.
    /// All of them unless links bend.
    pub fn joints(&self) -> &[usize] {
        &self.joints
    }
    /// The joints that stand for bending links: no motor, no sensor, a spring to zero and a damper.
    pub fn virtual_joints(&self) -> &[VirtualJoint] {
        &self.virtual_joints
    }
    /// For each degree of freedom, whether it is a robot's own joint and not a virtual one.
    pub fn driven(&self) -> &[bool] {
        &self.driven
    }
    /// The degrees of freedom that a state has: all but quasi-static virtual joints, whose position follows from the rest.
    pub fn moving(&self) -> &[usize] {
        &self.moving
    }
    /// The name of a virtual joint's coordinate: `v.LINK.K`.
    pub fn coordinate(&self, joint: &VirtualJoint) -> String {
        VirtualJoint::name(&self.model.links[joint.link.0].name, joint.number)
    }
    /// The position with the robot's own joints at `q`, in the robot's order, and the virtual ones at zero.
    ///
    /// # Panics
    /// If `q` has not one number for each of the robot's joints.
    pub fn straight(&self, q: &[f64]) -> Vec<f64> {
        assert_eq!(q.len(), self.joints.len(), "q: one number for each joint");
        let mut all = vec![0.0; self.model.nv];
        self.joints.iter().zip(q).for_each(|(&dof, &q)| all[dof] = q);
        all
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
    /// True if some effect couples a rotor with the link that carries it: what a motor gives then depends on the links'
    /// accelerations.
    pub fn couples_rotors(&self) -> bool {
        !self.mounts.is_empty()
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
    Ok(())
}

// The model with the hinges of effects, and the degree of freedom of each: what carries the robot first, as it moves all
// others up.
fn hinged(
    mut extended: Extended,
    robot: &Robot,
    specs: &[EffectSpec],
    catalogue: &Catalogue,
) -> Result<(Extended, Vec<Option<usize>>), PlantError> {
    let mut hinges = vec![None; specs.len()];
    for robot_first in [true, false] {
        for (k, spec) in specs.iter().enumerate() {
            let Some(hinge) = hinge_of(&extended.model, robot.tool, spec, catalogue)? else { continue };
            if (hinge.carries == Carried::Robot) != robot_first {
                continue;
            }
            let (next, dof) = extended.hinged(&hinge).map_err(|reason| refused(spec, reason))?;
            if robot_first {
                hinges.iter_mut().flatten().for_each(|dof| *dof += 1);
            }
            (extended, hinges[k]) = (next, Some(dof));
        }
    }
    Ok((extended, hinges))
}

// No effect reaches a virtual joint, and inertia of a link that bends is stated along it.
fn refuse_on_bending(
    robot: &Robot,
    model: &Model,
    virtual_joints: &[VirtualJoint],
    active: &Active,
) -> Result<(), PlantError> {
    // a base spring carries the whole link, wherever its mass is
    let spread = |name: &str| {
        let along = |b: &&Bending| b.stiffness.is_none() && robot.model.links[b.link.0].name == name;
        robot.bending.iter().any(|b| along(&b))
    };
    let (reason, help) = match (&active.spec.place, active.effect.site()) {
        (_, Site::Dof(dof)) if virtual_joints.iter().any(|v| v.dof == dof) => (
            format!(
                "\"{}\" stands for the bending of a link and has neither motor nor friction",
                model.dof_name(dof)
            ),
            "name a joint of the robot",
        ),
        (Place::Link(link), _) if spread(link) && active.effect.acts().contains(&Act::Coefficients) => (
            format!("the link \"{link}\" bends, and this would not say where along it"),
            "state the mass in [links.….bending] and in the link's inertia",
        ),
        _ => return Ok(()),
    };
    let (kind, place) = (active.spec.kind.clone(), active.spec.place.to_string());
    Err(PlantError::WrongPlace { kind, place, reason, help: help.to_owned() })
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
