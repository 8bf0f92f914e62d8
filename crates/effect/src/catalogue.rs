//! A catalogue: what effects there are, and how each is made for a place.

use sinew_model::{EffectSpec, Extended, Hinge, LinkId, Model, Robot};

use crate::{Card, Effect, Site};

/// What an effect may ask when it is made.
#[derive(Debug, Clone, Copy)]
pub struct Ask<'a> {
    /// The robot's mechanism.
    pub model: &'a Model,
    /// The end-effector.
    pub tool: LinkId,
    /// Where it shall act.
    pub site: Site,
    /// What the sidecar says besides numbers (`from`, `signal`, `side` …).
    pub spec: &'a EffectSpec,
    /// The degree of freedom of its own hinge, if it has one.
    pub hinge: Option<usize>,
}

/// Says where an effect's hinge stands; the error is a sentence that says what is missing.
pub type MakeHinge = fn(&Ask) -> Result<Hinge, String>;

/// One line of a catalogue.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// The effect's card.
    pub card: &'static Card,
    /// The kind of place it acts at; the index or name in it is of no meaning.
    pub place: PlaceKind,
    /// Words it reads besides its parameters.
    pub words: &'static [&'static str],
    /// The virtual joint that it adds to the robot, if any; `hinge` of what it asks is of no meaning yet.
    pub hinge: Option<MakeHinge>,
    /// Makes the effect; the error is a sentence that says what is missing.
    pub build: fn(&Ask) -> Result<Box<dyn Effect>, String>,
}

/// The kind of place an effect acts at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaceKind {
    /// A joint.
    Joint,
    /// A link.
    Link,
    /// The whole robot.
    Robot,
}

/// A catalogue of effects, handed to whoever searches it.
#[derive(Debug, Clone, Copy)]
pub struct Catalogue {
    /// Its lines.
    pub entries: &'static [Entry],
    /// Splits the links of a robot that bend; the error is a message that says what is wrong and how to mend it.
    pub extend: fn(&Robot) -> Result<Extended, String>,
}

impl Catalogue {
    /// The line of the effect called `name`.
    pub fn find(&self, name: &str) -> Option<&'static Entry> {
        self.entries.iter().find(|e| e.card.name == name)
    }
}
