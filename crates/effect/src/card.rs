//! The card of an effect: everything that is said of it in one place. The catalogue's pages are printed from it.

use crate::Sensor;

/// The manual page of an effect.
#[derive(Debug)]
pub struct Card {
    /// Its name in files and on the command line.
    pub name: &'static str,
    /// What it is, in one sentence.
    pub title: &'static str,
    /// Its law as a formula.
    pub law: &'static str,
    /// How it looks in a residual.
    pub symptom: &'static str,
    /// The class of causes it belongs to.
    pub family: Family,
    /// What it does with energy.
    pub energy: Energy,
    /// Its parameters, in the order of `p`.
    pub parameters: &'static [Parameter],
    /// How the search tries it.
    pub screening: Screening,
    /// What must be so before it is offered.
    pub requires: &'static [Requirement],
    /// Other causes that look alike, and what separates them.
    pub rivals: &'static [Rival],
    /// Literature.
    pub sources: &'static [&'static str],
}

impl Card {
    /// The position of parameter `key` (its first component).
    pub fn parameter(&self, key: &str) -> Option<usize> {
        self.parameters.iter().position(|p| p.key == key)
    }
    /// How many of the parameters are strengths.
    pub fn strengths(&self) -> usize {
        self.parameters.iter().filter(|p| p.role == Role::Strength).count()
    }
}

/// A class of causes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Drag of bearings, seals, gears.
    Friction,
    /// Springs, gaps and errors of gears.
    Transmission,
    /// Masses, gravity, springs on links.
    Inertial,
    /// Repeats with position.
    Periodic,
    /// Motors, drives and sensors.
    Instrument,
    /// Touches something.
    Environment,
}

/// What an effect does with energy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Energy {
    /// Only takes it out.
    Dissipates,
    /// Keeps it and gives it back.
    Stores,
    /// Keeps some, loses some.
    StoresAndDissipates,
    /// Moves it about.
    Exchanges,
    /// Can put it in, as a drive does.
    Supplies,
    /// Has none: a sensor's error.
    None,
}

/// One number of an effect.
#[derive(Debug)]
pub struct Parameter {
    /// Its key in files.
    pub key: &'static str,
    /// Its place in the file's array, where the key holds several numbers.
    pub component: Option<usize>,
    /// Its letter in the law.
    pub symbol: &'static str,
    /// SI unit for a turning joint.
    pub unit: &'static str,
    /// Strength or shape.
    pub role: Role,
    /// Smallest and largest value that makes sense.
    pub range: (f64, f64),
    /// How well the value in a sidecar is known when nothing is said.
    pub prior: Prior,
    /// How files write it.
    pub written: Written,
}

impl Parameter {
    /// A strength that may take either sign.
    pub const fn signed(key: &'static str, symbol: &'static str, unit: &'static str, prior: Prior) -> Self {
        let range = (f64::NEG_INFINITY, f64::INFINITY);
        Self {
            key,
            component: None,
            symbol,
            unit,
            role: Role::Strength,
            range,
            prior,
            written: Written::Plain,
        }
    }
    /// A strength that cannot be negative.
    pub const fn positive(key: &'static str, symbol: &'static str, unit: &'static str, prior: Prior) -> Self {
        let range = (0.0, f64::INFINITY);
        Self {
            key,
            component: None,
            symbol,
            unit,
            role: Role::Strength,
            range,
            prior,
            written: Written::Plain,
        }
    }
    /// A shape: start values to try, and the range in which it stays.
    pub const fn shape(
        key: &'static str,
        symbol: &'static str,
        unit: &'static str,
        grid: &'static [f64],
        range: (f64, f64),
        prior: Prior,
    ) -> Self {
        Self {
            key,
            component: None,
            symbol,
            unit,
            role: Role::Shape { grid },
            range,
            prior,
            written: Written::Plain,
        }
    }
    /// A number taken from the file (zero without one) and never fitted.
    pub const fn stated(key: &'static str, symbol: &'static str, unit: &'static str) -> Self {
        let range = (f64::NEG_INFINITY, f64::INFINITY);
        Self {
            key,
            component: None,
            symbol,
            unit,
            role: Role::Stated,
            range,
            prior: Prior::Free,
            written: Written::Plain,
        }
    }
    /// The same, fitted where the file states its standard deviation.
    pub const fn optional(key: &'static str, symbol: &'static str, unit: &'static str) -> Self {
        let mut parameter = Self::stated(key, symbol, unit);
        parameter.role = Role::Optional;
        parameter
    }
    /// True if it is in the file or is nothing.
    pub const fn is_stated(&self) -> bool {
        matches!(self.role, Role::Stated | Role::Optional)
    }
    /// The same parameter, written as its reciprocal in files: 1/K inside, K outside.
    pub const fn reciprocal(mut self) -> Self {
        self.written = Written::Reciprocal;
        self
    }
    /// The same parameter as one component of an array.
    pub const fn component(mut self, index: usize) -> Self {
        self.component = Some(index);
        self
    }
    /// The value at which an effect of only zero strengths starts: 0, or the middle of a shape's grid.
    pub fn start(&self) -> f64 {
        match self.role {
            Role::Strength | Role::Stated | Role::Optional => 0.0,
            Role::Shape { grid } => grid[grid.len() / 2],
        }
    }
    /// The unit of what files hold: that of the reciprocal where they hold one.
    ///
    /// ```
    /// use sinew_effect::{Parameter, Prior};
    /// let compliance = Parameter::positive("stiffness", "1/K", "rad/(N·m)", Prior::Free).reciprocal();
    /// assert_eq!(compliance.written_unit(), "N·m/rad");
    /// let limit = Parameter::positive("limit", "1/τ", "1/(N·m)", Prior::Free).reciprocal();
    /// assert_eq!(limit.written_unit(), "N·m");
    /// ```
    pub fn written_unit(&self) -> String {
        let Written::Reciprocal = self.written else { return self.unit.to_owned() };
        let (above, below) = self.unit.split_once('/').unwrap_or((self.unit, "1"));
        let below = below.trim_start_matches('(').trim_end_matches(')');
        if above == "1" { below.to_owned() } else { format!("{below}/{above}") }
    }
    /// Key with its component, as in `first_moment.x` or `inertia.yy`.
    pub fn label(&self) -> String {
        let names = match self.key {
            "inertia" => ["xx", "yy", "zz", "xy", "xz", "yz"].as_slice(),
            _ => &["x", "y", "z"],
        };
        match self.component {
            None => self.key.to_owned(),
            Some(k) => format!("{}.{}", self.key, names.get(k).unwrap_or(&"?")),
        }
    }
}

/// How files write a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Written {
    /// As it is.
    Plain,
    /// As its reciprocal, absent for zero: a compliance as a stiffness.
    Reciprocal,
}

/// Strength or shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Role {
    /// Zero means that the effect is absent.
    Strength,
    /// Has no meaning at zero strength; the search starts from these values.
    Shape {
        /// Start values. More than one asks for a screen over all of them.
        grid: &'static [f64],
    },
    /// Stated in the file, never fitted.
    Stated,
    /// Stated in the file, and fitted where its standard deviation is stated, too. The search tries the effect without and with it.
    Optional,
}

/// How well a stated value is known when the user says nothing, as one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prior {
    /// This share of the value.
    Share(f64),
    /// This much, in the parameter's unit.
    Absolute(f64),
    /// This factor: the logarithm is normal with this standard deviation.
    Factor(f64),
    /// Nothing is known.
    Free,
}

/// Which parameter of an effect that swings is its frequency.
pub const SWING_FREQUENCY: usize = 1;

/// How the search tries an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Screening {
    /// By its derivative at zero strength, for each shape of the grid.
    Linear,
    /// By switching it on: the derivative at zero misleads. Tries each of these first strengths, with each shape.
    Exact {
        /// First strengths to try.
        strengths: &'static [f64],
    },
    /// By removing the prior of a parameter that another effect of the model already has.
    Release {
        /// The effect that has it.
        effect: &'static str,
        /// Its parameter.
        parameter: &'static str,
    },
    /// By the position scan for harmonics: the last parameter is the number of periods a turn.
    Harmonic,
    /// By switching it on with the first strength 1/K so that the joint's antiresonance, motor held, lies here.
    Resonance {
        /// Antiresonances to try, Hz.
        hertz: &'static [f64],
    },
    /// By switching it on: one by the first strength is each of these shares of the joint's largest logged torque.
    Peaks {
        /// Shares to try.
        shares: &'static [f64],
    },
    /// By switching on something that swings at each of these frequencies: a part of the joint's body, of which its
    /// first strength is the share, or a base of compliance c under the robot, whose inertia I is this share of the
    /// base's, c = share/(I ω²). The frequency is the parameter [`SWING_FREQUENCY`]; that of a base without the robot is
    /// √(1 + share) times as high.
    Swing {
        /// Frequencies to try, Hz.
        hertz: &'static [f64],
        /// Shares to try.
        shares: &'static [f64],
    },
    /// By its derivative at zero strength, its last parameter at these quantiles of the joint's position.
    Quantiles {
        /// Quantiles to try.
        quantiles: &'static [f64],
    },
}

/// What must be so before an effect is offered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Requirement {
    /// This effect must already be in the model at the same place.
    Parent(&'static str),
    /// The joint must be elastic in the model.
    Elastic,
    /// The joint must be rigid in the model, and its motor's position measured.
    Rigid,
    /// The balance of the link must be seen beside that of the motor: an elastic joint, or torque behind the gear.
    LinkBalance,
    /// The link-side position must be measured beside the motor's.
    LinkEncoder,
    /// Either of the above two: an elastic joint or both encoders.
    ElasticOrLinkEncoder,
    /// The motor torque must be measured.
    MotorTorque,
    /// The motor torque or that behind the gear must be measured.
    Torque,
    /// The robot must have at least this many joints.
    Joints(usize),
    /// The joint must turn, not slide.
    Turning,
    /// A moving link must carry the rotor, and the robot must say how fast it turns and about which axis.
    CarriedRotor,
    /// The joint's temperature must be logged and change.
    Temperature {
        /// The stated parameter that its mean is written to.
        mean: &'static str,
    },
}

/// Another cause that looks alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rival {
    /// Its name in the catalogue.
    pub name: &'static str,
    /// True if no motion separates the two: only priors do.
    pub structural: bool,
    /// The experiment that separates them, in words.
    pub experiment: &'static str,
    /// The sensors of which it needs one besides those of the motor; none where they are enough.
    pub sensors: &'static [Sensor],
}

impl Rival {
    /// The experiment, with the sensors that it needs where none of them is `seen` yet.
    ///
    /// ```
    /// use sinew_effect::{Rival, Sensor};
    /// let sensors = &[Sensor::JointPosition, Sensor::JointTorque];
    /// let rival = Rival { name: "backlash", structural: false, experiment: "slow reversals", sensors };
    /// assert_eq!(rival.experiment_with(|_| false), "a link-side encoder or torque sensor, and slow reversals");
    /// assert_eq!(rival.experiment_with(|s| s == Sensor::JointTorque), "slow reversals");
    /// ```
    pub fn experiment_with(&self, seen: impl Fn(Sensor) -> bool) -> String {
        if self.sensors.is_empty() || self.sensors.iter().any(|&sensor| seen(sensor)) {
            return self.experiment.to_owned();
        }
        let named = |sensor: &Sensor| match sensor {
            Sensor::MotorTorque => "sensor of the motor's torque",
            Sensor::JointPosition => "link-side encoder",
            Sensor::JointTorque => "torque sensor",
        };
        let sensors: Vec<&str> = self.sensors.iter().map(named).collect();
        format!("a {}, and {}", sensors.join(" or "), self.experiment)
    }
}
