//! A robot as its files describe it: the model, and as plain data what a URDF cannot say.

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use crate::{Bending, LinkId, Model};

/// A model with its springs, rotors and effects: what `arm.urdf` and `arm.sinew.toml` say together.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// The mechanism, gravity included.
    pub model: Model,
    /// One entry for each degree of freedom, in order.
    pub joints: Vec<JointSettings>,
    /// Transmissions that couple joints.
    pub couplings: Vec<Coupling>,
    /// Links that bend.
    pub bending: Vec<Bending>,
    /// Every other physical effect.
    pub effects: Vec<EffectSpec>,
    /// The link whose frame is the end-effector.
    pub tool: LinkId,
    /// How far the inertias of the URDF are trusted.
    pub trust: Trust,
}

impl Robot {
    /// The rigid robot that a model is without a sidecar.
    pub fn rigid(model: Model) -> Self {
        let joints = vec![JointSettings::default(); model.nv];
        let tool = model.last_link();
        Self {
            model,
            joints,
            couplings: Vec::new(),
            bending: Vec::new(),
            effects: Vec::new(),
            tool,
            trust: Trust::Nominal,
        }
    }

    /// Every effect of the robot: rotors and springs of `[joints.…]` first, then `[[effects]]`.
    pub fn all_effects(&self) -> Vec<EffectSpec> {
        let settings = self.joints.iter().enumerate();
        let of_joints = settings.flat_map(|(dof, j)| j.effects(self.model.dof_name(dof)));
        of_joints.chain(self.effects.iter().cloned()).collect()
    }
}

impl JointSettings {
    /// The spring and the rotor as effects, in the words of the catalogue.
    fn effects(&self, joint: &str) -> Vec<EffectSpec> {
        let place = || Place::Joint(joint.to_owned());
        let mut effects = Vec::new();
        if self.rotor_inertia != 0.0 {
            let rotor = EffectSpec::new("rotor_inertia", place()).with("inertia", self.rotor_inertia);
            effects.push(rotor.with_optional("inertia_std", self.rotor_inertia_std));
        }
        if let Some(stiffness) = self.stiffness {
            let spring = EffectSpec::new("joint_elasticity", place()).with("stiffness", stiffness);
            let spring =
                spring.with("damping", self.damping).with_optional("stiffness_std", self.stiffness_std);
            effects.push(spring.with_optional("damping_std", self.damping_std));
        }
        effects
    }
}

/// How far the inertias of the URDF are trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Trust {
    /// To 0.1 %.
    Exact,
    /// To a few per cent.
    #[default]
    Nominal,
    /// Not at all: placeholders.
    Unknown,
}

/// The transmission of one joint. Standard deviations are statements of the user or of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct JointSettings {
    /// K, N·m/rad (N/m), link side; none for a rigid joint.
    pub stiffness: Option<f64>,
    /// D, N·m·s/rad across the spring.
    pub damping: f64,
    /// B, kg·m² reflected to the link side.
    pub rotor_inertia: f64,
    /// Motor turns per joint turn.
    pub gear_ratio: Option<f64>,
    /// N·m/A reflected to the link side.
    pub torque_constant: Option<f64>,
    /// Axis of the rotor in the frame of the link that carries it; none for the joint's own.
    pub rotor_axis: Option<[f64; 3]>,
    /// The link that carries the rotor; none for the parent link.
    pub carried_by: Option<LinkId>,
    /// Standard deviation of K.
    pub stiffness_std: Option<f64>,
    /// Standard deviation of D.
    pub damping_std: Option<f64>,
    /// Standard deviation of B.
    pub rotor_inertia_std: Option<f64>,
}

impl Default for JointSettings {
    fn default() -> Self {
        Self {
            stiffness: None,
            damping: 0.0,
            rotor_inertia: 0.0,
            gear_ratio: None,
            torque_constant: None,
            rotor_axis: None,
            carried_by: None,
            stiffness_std: None,
            damping_std: None,
            rotor_inertia_std: None,
        }
    }
}

/// A transmission that couples joints: full matrices instead of scalars.
#[derive(Debug, Clone, PartialEq)]
pub struct Coupling {
    /// The degrees of freedom it couples.
    pub dofs: Vec<usize>,
    /// K by rows, symmetric positive definite, N·m/rad.
    pub stiffness: Vec<f64>,
    /// D by rows, symmetric positive semidefinite, N·m·s/rad.
    pub damping: Vec<f64>,
}

/// Where an effect acts.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Place {
    /// At a joint, by name.
    Joint(String),
    /// At a link, by name.
    Link(String),
    /// At the whole robot.
    Robot,
}

impl Place {
    /// `effect@place`, or the effect alone where it acts on the whole robot.
    ///
    /// ```
    /// use sinew_model::Place;
    /// assert_eq!(Place::Joint("elbow".into()).label("backlash"), "backlash@elbow");
    /// assert_eq!(Place::Robot.label("payload"), "payload");
    /// ```
    pub fn label(&self, effect: &str) -> String {
        match self {
            Place::Robot => effect.to_owned(),
            place => format!("{effect}@{place}"),
        }
    }
}

impl core::fmt::Display for Place {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Place::Joint(name) | Place::Link(name) => f.write_str(name),
            Place::Robot => f.write_str("robot"),
        }
    }
}

/// One value of an effect in a sidecar.
#[derive(Debug, Clone, PartialEq)]
pub enum Setting {
    /// One number.
    Number(f64),
    /// Several numbers, as of a vector.
    Numbers(Vec<f64>),
    /// A word: a joint, a signal, a side.
    Word(String),
}

/// A physical effect as a sidecar states it: `[[effects]]`.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectSpec {
    /// Its name in the catalogue.
    pub kind: String,
    /// Where it acts.
    pub place: Place,
    /// Everything else by key, `…_std` included, in the author's order.
    pub settings: Vec<(String, Setting)>,
}

impl EffectSpec {
    /// The effect `kind` at `place` without any value yet.
    pub fn new(kind: &str, place: Place) -> Self {
        Self { kind: kind.to_owned(), place, settings: Vec::new() }
    }
    /// True if both state the same effect: the same kind at the same place in the same words, whatever their numbers. The offsets
    /// of two torque sensors of one joint are two effects.
    pub fn is_same_as(&self, other: &Self) -> bool {
        let words = |of: &Self| -> Vec<(String, Setting)> {
            let mut words: Vec<(String, Setting)> =
                of.settings.iter().filter(|(_, s)| matches!(s, Setting::Word(_))).cloned().collect();
            words.sort_by(|a, b| a.0.cmp(&b.0));
            words
        };
        self.kind == other.kind && self.place == other.place && words(self) == words(other)
    }
    /// The value of `key`.
    pub fn get(&self, key: &str) -> Option<&Setting> {
        self.settings.iter().find(|(k, _)| k == key).map(|(_, v)| v)
    }
    /// The number `key`, if it is one.
    pub fn number(&self, key: &str) -> Option<f64> {
        match self.get(key)? {
            Setting::Number(x) => Some(*x),
            _ => None,
        }
    }
    fn with_optional(self, key: &str, value: Option<f64>) -> Self {
        match value {
            Some(value) => self.with(key, value),
            None => self,
        }
    }
    /// The same effect with `key` set to a number.
    pub fn with(mut self, key: &str, value: f64) -> Self {
        self.settings.retain(|(k, _)| k != key);
        self.settings.push((key.to_owned(), Setting::Number(value)));
        self
    }
    /// The same with a list of numbers.
    pub fn with_numbers(mut self, key: &str, values: &[f64]) -> Self {
        self.settings.retain(|(k, _)| k != key);
        self.settings.push((key.to_owned(), Setting::Numbers(values.to_vec())));
        self
    }
    /// The same with a word.
    pub fn said(mut self, key: &str, word: &str) -> Self {
        self.settings.retain(|(k, _)| k != key);
        self.settings.push((key.to_owned(), Setting::Word(word.to_owned())));
        self
    }
}
