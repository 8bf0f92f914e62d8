//! The candidates that a catalogue offers to a model: effect, place, start values.

use sinew_data::Quantity;
use sinew_effect::{
    Card, Entry, Parameter, PlaceKind, Requirement, Role, SWING_FREQUENCY, Screening, Sensor, Written,
};
use sinew_model::{EffectSpec, Place, Robot, Setting};
use sinew_plant::Plant;
use sinew_rigid::mass_matrix;

use crate::problem::{Candidate, Problem};
use crate::record::{Channel, Record, Sensors};
use crate::swings::{Swing, told};

/// How a trial changes the model.
#[derive(Debug, Clone)]
pub(crate) enum How {
    /// A new effect; `strengths` are the parameters screened, together as one secant if `exact`.
    New { spec: EffectSpec, strengths: Vec<usize>, exact: bool },
    /// The priors of these unknowns of the model fall.
    Release { unknowns: Vec<usize> },
}

/// One effect at one place with one set of start values.
#[derive(Debug, Clone)]
pub(crate) struct Trial {
    pub card: &'static Card,
    pub place: Place,
    pub how: How,
    /// New parameters that it would have if the log told all of them.
    pub parameters: usize,
    /// Which line of the residual's spectrum its start swings at.
    pub line: Option<usize>,
}

// Start values of an effect at a place.
struct Start {
    spec: EffectSpec,
    strengths: Vec<usize>,
    exact: bool,
    line: Option<usize>,
}

impl Start {
    // To be screened by derivatives along its strengths.
    fn derived(spec: EffectSpec, strengths: &[usize]) -> Self {
        Self { spec, strengths: strengths.to_vec(), exact: false, line: None }
    }

    // To be screened by switching it on with this first strength.
    fn switched(spec: EffectSpec, first: usize) -> Self {
        Self { spec, strengths: vec![first], exact: true, line: None }
    }
}

impl Trial {
    /// `effect@place`.
    pub fn label(&self) -> String {
        self.place.label(self.card.name)
    }

    /// The effect that is switched on to screen it; none of trials that are screened by a derivative.
    pub fn exact_spec(&self) -> Option<&EffectSpec> {
        match &self.how {
            How::New { spec, exact: true, .. } => Some(spec),
            _ => None,
        }
    }

    /// True if its effect swings at a frequency of its own.
    pub fn swings(&self) -> bool {
        matches!(self.card.screening, Screening::Swing { .. })
    }

    /// True if it changes which joints have springs.
    pub fn switches_springs(&self) -> bool {
        let is_spring = self.swings() || matches!(self.card.screening, Screening::Resonance { .. });
        is_spring && matches!(self.how, How::New { .. })
    }

    /// Strengths and shapes, for ties: a plain cause is preferred when the data do not care.
    pub fn complexity(&self) -> f64 {
        let count = self.parameters as f64;
        match self.card.name {
            "payload" => 0.8 * count,
            "base_tilt" => 0.85 * count,
            "presliding_friction" => 1.5 * count,
            _ if self.is_plain_friction() => 0.9,
            _ => count,
        }
    }

    /// 1/σ² of the strengths that are screened; zero where nothing is known.
    pub fn weights(&self) -> Vec<f64> {
        let How::New { spec, strengths, .. } = &self.how else { return Vec::new() };
        let weight = |&k: &usize| {
            let parameter = &self.card.parameters[k];
            let std = optional_std(parameter, spec);
            std.map_or(0.0, |std| 1.0 / (std * std))
        };
        strengths.iter().map(weight).collect()
    }

    /// Usual sizes of the strengths that are screened: of a body the robot's own mass, and what is known of the rest of it; beyond
    /// any size where nothing is optional.
    pub fn sizes(&self, robot: &Robot) -> Vec<f64> {
        let weights = self.weights();
        let of_strength = if self.has_optional() { robot.model.moving_mass() } else { f64::INFINITY };
        let size = |weight: &f64| if *weight > 0.0 { 1.0 / weight.sqrt() } else { of_strength };
        weights.iter().map(size).collect()
    }

    /// True if it has more to it than its strength.
    pub fn has_optional(&self) -> bool {
        self.weights().iter().any(|weight| *weight > 0.0)
    }

    /// True for the friction that every drive has.
    pub fn is_plain_friction(&self) -> bool {
        matches!(self.card.name, "viscous_friction" | "coulomb_friction")
    }

    /// The sentence that refuses strengths of an impossible sign.
    pub fn wrong_sign(&self, strengths: &[f64]) -> Option<String> {
        let How::New { strengths: screened, exact, .. } = &self.how else { return None };
        if *exact {
            return (strengths[0] <= 0.0).then(|| "the residual asks for its opposite".to_owned());
        }
        screened.iter().zip(strengths).find_map(|(&k, &a)| {
            let parameter = &self.card.parameters[k];
            let (low, high) = parameter.range;
            let what = format!("the residual asks for {} {a:.3} {}", parameter.key, parameter.unit);
            (a < low || a > high).then(|| format!("{what}, which cannot be"))
        })
    }
}

/// What the enumeration looks at.
pub(crate) struct Offer<'a> {
    pub problem: &'a Problem<'a>,
    pub model: &'a Candidate,
    pub sensors: &'a Sensors,
    pub records: &'a [Record],
    /// Harmonics found by the position scan: degree of freedom and periods a turn.
    pub harmonics: &'a [(usize, f64)],
    /// Lines in the spectrum of the residual: degree of freedom and line.
    pub swings: &'a [(usize, Swing)],
}

impl Offer<'_> {
    /// Every trial whose requirements hold.
    pub fn trials(&self) -> Vec<Trial> {
        let entries = self.problem.catalogue.entries.iter();
        entries.flat_map(|entry| self.of_entry(entry)).collect()
    }

    fn of_entry(&self, entry: &'static Entry) -> Vec<Trial> {
        let model = &self.problem.robot.model;
        let places: Vec<(Place, Option<usize>)> = match entry.place {
            PlaceKind::Joint => (0..model.nv)
                .filter(|&d| self.sensors.imposed[d].is_some())
                .map(|d| (Place::Joint(model.dof_name(d).to_owned()), Some(d)))
                .collect(),
            PlaceKind::Link => model
                .links
                .iter()
                .filter(|l| l.body.is_some())
                .map(|l| (Place::Link(l.name.clone()), None))
                .collect(),
            PlaceKind::Robot => vec![(Place::Robot, None)],
        };
        places.into_iter().flat_map(|(place, dof)| self.at(entry, place, dof)).collect()
    }

    fn at(&self, entry: &'static Entry, place: Place, dof: Option<usize>) -> Vec<Trial> {
        let card = entry.card;
        if let Screening::Release { effect, parameter } = card.screening {
            let found = self.present(effect, &place);
            let freed = found.map(|e| self.with_prior(e, Some(parameter))).unwrap_or_default();
            return self.release(card, place, freed);
        }
        if let Some(effect) = self.present(card.name, &place) {
            let freed = self.with_prior(effect, None);
            return self.release(card, place, freed);
        }
        if entry.place == PlaceKind::Link || !card.requires.iter().all(|r| self.holds(r, &place, dof)) {
            return Vec::new();
        }
        self.starts(entry, &place, dof)
            .into_iter()
            .map(|start| {
                let Start { spec, strengths, exact, line } = start;
                let parameters = card.parameters.iter().filter(|p| is_fitted(p, &spec)).count();
                Trial {
                    card,
                    place: place.clone(),
                    how: How::New { spec, strengths, exact },
                    parameters,
                    line,
                }
            })
            .collect()
    }

    fn release(&self, card: &'static Card, place: Place, unknowns: Vec<usize>) -> Vec<Trial> {
        if unknowns.is_empty() {
            return Vec::new();
        }
        let parameters = unknowns.len();
        vec![Trial { card, place, how: How::Release { unknowns }, parameters, line: None }]
    }

    fn present(&self, kind: &str, place: &Place) -> Option<usize> {
        self.model.specs.iter().position(|s| s.kind == kind && s.place == *place)
    }

    // Unknowns of an effect (of one of its parameters) that still have a prior; strengths only.
    fn with_prior(&self, effect: usize, parameter: Option<&str>) -> Vec<usize> {
        let card = self.model.plant.effects()[effect].effect.card();
        let wanted = |k: usize| {
            let p = &card.parameters[k];
            match parameter {
                Some(key) => p.key == key,
                None => p.role == Role::Strength && !self.released_elsewhere(card, p.key),
            }
        };
        let unknowns = self.model.unknowns.iter().enumerate();
        unknowns
            .filter(|(_, u)| u.id.effect == effect && u.prior.is_some() && wanted(u.id.parameter))
            .map(|(k, _)| k)
            .collect()
    }

    // Some parameters are released under a name of their own: a wrong stiffness is no new elasticity.
    fn released_elsewhere(&self, card: &Card, key: &str) -> bool {
        self.problem.catalogue.entries.iter().any(|e| {
            matches!(e.card.screening, Screening::Release { effect, parameter } if effect == card.name && parameter == key)
        })
    }

    fn holds(&self, requirement: &Requirement, place: &Place, dof: Option<usize>) -> bool {
        let has = |sensor| dof.is_some_and(|dof| self.sensors.channels.contains(&Channel { sensor, dof }));
        let plant = &self.model.plant;
        let elastic = dof.is_some_and(|d| plant.elastic()[plant.joints()[d]]);
        let encoder = has(Sensor::JointPosition);
        let model = &self.problem.robot.model;
        match requirement {
            Requirement::Parent(name) => self.present(name, place).is_some(),
            Requirement::Elastic => elastic,
            Requirement::Rigid => {
                !elastic && dof.is_some_and(|d| self.sensors.imposed[d] == Some(Quantity::MotorPosition))
            }
            Requirement::LinkBalance => elastic || has(Sensor::JointTorque),
            Requirement::LinkEncoder => encoder,
            Requirement::ElasticOrLinkEncoder => elastic || encoder,
            Requirement::MotorTorque => has(Sensor::MotorTorque),
            Requirement::Torque => has(Sensor::MotorTorque) || has(Sensor::JointTorque),
            Requirement::Joints(n) => model.nv >= *n,
            Requirement::Temperature { .. } => dof.is_some_and(|d| self.warmth(d).is_some()),
            Requirement::CarriedRotor => {
                dof.is_some_and(|dof| Plant::can_couple_rotor(self.problem.robot, dof))
            }
            Requirement::Turning => dof.is_none_or(|d| !model.joints[model.joint_of_dof(d).0].kind.slides()),
        }
    }

    // Start values: the grid of the shape, the exact strengths, or both.
    fn starts(&self, entry: &'static Entry, place: &Place, dof: Option<usize>) -> Vec<Start> {
        let card = entry.card;
        let plain = self.at_its_mean(card, dof, EffectSpec::new(card.name, place.clone()));
        let strengths: Vec<usize> =
            (0..card.parameters.len()).filter(|&k| card.parameters[k].role == Role::Strength).collect();
        let last = card.parameters.len() - 1;
        let set = |spec: &EffectSpec, k: usize, value: f64| {
            let parameter = &card.parameters[k];
            let written = if parameter.written == Written::Reciprocal { 1.0 / value } else { value };
            spec.clone().with(parameter.key, written)
        };
        match card.screening {
            Screening::Linear => {
                let grids = self.shape_grid(card, dof);
                match grids {
                    None if entry.words.contains(&"from") => self
                        .sources(dof)
                        .map(|from| Start::derived(plain.clone().said("from", from), &strengths))
                        .collect(),
                    Some((k, grid)) => {
                        grid.iter().map(|&v| Start::derived(set(&plain, k, v), &strengths)).collect()
                    }
                    None => {
                        let is_screened = |spec: &EffectSpec, k: usize| {
                            let parameter = &card.parameters[k];
                            parameter.role == Role::Strength || optional_std(parameter, spec).is_some()
                        };
                        let screened = |spec: &EffectSpec| -> Vec<usize> {
                            (0..card.parameters.len()).filter(|&k| is_screened(spec, k)).collect()
                        };
                        let more = self.with_optional(card, &plain);
                        let starts = std::iter::once(plain).chain(more);
                        starts
                            .map(|spec| (screened(&spec), spec))
                            .map(|(k, s)| Start::derived(s, &k))
                            .collect()
                    }
                }
            }
            Screening::Exact { strengths: tried } => {
                tried.iter().map(|&v| Start::switched(set(&plain, strengths[0], v), strengths[0])).collect()
            }
            Screening::Quantiles { quantiles } => {
                let values = dof.map(|d| self.quantiles(d, quantiles)).unwrap_or_default();
                let sides = if entry.words.contains(&"side") { vec!["above", "below"] } else { vec![""] };
                let mut out = Vec::new();
                for (side, v) in sides.iter().flat_map(|s| values.iter().map(move |v| (*s, *v))) {
                    let spec = set(&plain, last, v);
                    let spec = if side.is_empty() { spec } else { spec.said("side", side) };
                    out.push(Start::derived(spec, &strengths));
                }
                out
            }
            Screening::Peaks { shares } => {
                let peak = dof.map_or(0.0, |d| self.peak(d));
                let first = strengths[0];
                let of = |share: &f64| Start::switched(set(&plain, first, 1.0 / (share * peak)), first);
                if peak > 0.0 { shares.iter().map(of).collect() } else { Vec::new() }
            }
            Screening::Swing { hertz, shares } => {
                let axes: &[&str] = if entry.words.contains(&"axis") { &["x", "y", "z"] } else { &[""] };
                let starts = self.swings(card, dof, hertz, shares);
                let named = |axis: &str| {
                    if axis.is_empty() { plain.clone() } else { plain.clone().said("axis", axis) }
                };
                let of = |axis: &&str| {
                    let spec = named(axis);
                    let each = |(line, [strength, f]): &(Option<usize>, [f64; 2])| {
                        let spec = set(&set(&spec, 0, *strength), SWING_FREQUENCY, *f);
                        Start { line: *line, ..Start::switched(spec, 0) }
                    };
                    starts.iter().map(each).collect::<Vec<_>>()
                };
                axes.iter().flat_map(of).collect()
            }
            Screening::Harmonic => self
                .harmonics
                .iter()
                .filter(|(d, _)| Some(*d) == dof)
                .map(|&(_, n)| Start::derived(set(&plain, last, n), &strengths))
                .collect(),
            Screening::Resonance { hertz } => {
                dof.map_or_else(Vec::new, |d| self.resonances(d, hertz, &plain, set))
            }
            Screening::Release { .. } => Vec::new(),
        }
    }

    // The same effect with the first of what is optional of it zero and known to about its usual size, then with the second, too; none
    // if nothing is.
    fn with_optional(&self, card: &Card, spec: &EffectSpec) -> Vec<EffectSpec> {
        let mut alike: Vec<&[Parameter]> = card.parameters.chunk_by(|a, b| a.key == b.key).collect();
        alike.retain(|parameters| parameters[0].role == Role::Optional);
        let mass = self.problem.robot.model.moving_mass();
        let lever = usual_lever(self.problem.robot);
        let with = |spec: &mut EffectSpec, parameters: &[Parameter]| {
            let (Parameter { key, unit, .. }, count) = (&parameters[0], parameters.len());
            let usual = mass * if *unit == "kg·m" { lever } else { lever * lever };
            let zero = spec.clone().with_numbers(key, &vec![0.0; count]);
            *spec = zero.with_numbers(&format!("{key}_std"), &vec![usual; count]);
            Some(spec.clone())
        };
        alike.into_iter().scan(spec.clone(), |spec, parameters| with(spec, parameters)).collect()
    }

    // K = I ω², D = 2 ζ √(K I) for every frequency; none on a slow log without link encoder, which holds no antiresonance.
    fn resonances(
        &self,
        dof: usize,
        hertz: &[f64],
        plain: &EffectSpec,
        set: impl Fn(&EffectSpec, usize, f64) -> EffectSpec,
    ) -> Vec<Start> {
        if !self.shows_springs(Some(dof)) {
            return Vec::new();
        }
        let inertia = self.apparent_inertia(dof);
        let of = |f: &f64| {
            let stiffness = inertia * (std::f64::consts::TAU * f).powi(2);
            let damping = 2.0 * START_DAMPING * (stiffness * inertia).sqrt();
            Start::switched(set(&set(plain, 0, 1.0 / stiffness), 1, damping), 0)
        };
        hertz.iter().map(of).collect()
    }

    // The first shape with more than one start value; velocities only below the fastest seen.
    fn shape_grid(&self, card: &Card, dof: Option<usize>) -> Option<(usize, Vec<f64>)> {
        card.parameters.iter().enumerate().find_map(|(k, p)| match p.role {
            Role::Shape { grid } if grid.len() > 1 => {
                let top = dof.map_or(f64::INFINITY, |d| self.top_speed(d));
                let keep = |v: &&f64| !p.key.ends_with("velocity") || **v < top;
                Some((k, grid.iter().filter(keep).copied().collect()))
            }
            _ => None,
        })
    }

    // First strength and frequency of what swings, and the line of the spectrum they come from, if any. None on a slow log,
    // which holds no swing.
    fn swings(
        &self,
        card: &Card,
        dof: Option<usize>,
        hertz: &[f64],
        shares: &[f64],
    ) -> Vec<(Option<usize>, [f64; 2])> {
        if !self.shows_springs(None) {
            return Vec::new();
        }
        let compliance = card.parameters[0].unit == "rad/(N·m)";
        let joints = 0..self.problem.robot.model.nv;
        let largest = || joints.clone().map(|d| self.apparent_inertia(d)).fold(0.0, f64::max);
        let inertia = dof.map_or_else(largest, |d| self.apparent_inertia(d));
        let start = |share: f64, f: f64| {
            let alone = f * (1.0 + share).sqrt();
            let c = share / (inertia * (std::f64::consts::TAU * alone).powi(2));
            if compliance { [c, alone] } else { [share, f] }
        };
        let own = self.swings.iter().filter(|(d, _)| dof.is_none_or(|dof| dof == *d));
        let lines = told(own.map(|(_, line)| *line).collect());
        let lines = lines.iter().enumerate().map(|(n, line)| (Some(n), line.hertz));
        let all = hertz.iter().map(|&f| (None, f)).chain(lines);
        all.flat_map(|(line, f)| shares.iter().map(move |&share| (line, start(share, f)))).collect()
    }

    // The other joints whose drives log a torque.
    fn sources(&self, dof: Option<usize>) -> impl Iterator<Item = &str> {
        let drives = self.sensors.channels.iter().filter(|c| c.sensor == Sensor::MotorTorque).map(|c| c.dof);
        drives.filter(move |d| Some(*d) != dof).map(|d| self.problem.robot.model.dof_name(d))
    }

    // The largest logged torque of a joint.
    fn peak(&self, dof: usize) -> f64 {
        self.sensors.motor_torque(self.records, dof).fold(0.0, |m, u| m.max(u.abs()))
    }

    // An effect that depends on the temperature of its joint, stated about the mean of it.
    fn at_its_mean(&self, card: &Card, dof: Option<usize>, spec: EffectSpec) -> EffectSpec {
        card.requires.iter().fold(spec, |spec, requirement| match requirement {
            Requirement::Temperature { mean } => match dof.and_then(|d| self.warmth(d)) {
                Some(warmth) => spec.with(mean, warmth),
                None => spec,
            },
            _ => spec,
        })
    }

    // The mean temperature of a joint over all runs; none where a run lacks it or it hardly changes.
    fn warmth(&self, dof: usize) -> Option<f64> {
        let series: Vec<&Vec<f64>> =
            self.records.iter().map(|r| r.temperature[dof].as_ref()).collect::<Option<_>>()?;
        let all = || series.iter().flat_map(|s| s.iter().copied());
        let (low, high) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (l.min(t), h.max(t)));
        let mean = all().sum::<f64>() / all().count() as f64;
        (high - low > LEAST_WARMING).then_some(mean)
    }

    fn shows_springs(&self, dof: Option<usize>) -> bool {
        let encoder = |dof| Channel { sensor: Sensor::JointPosition, dof };
        let fast = self.records.iter().all(|r| r.scales.period <= SLOWEST_SPRING_LOG);
        fast || dof.is_some_and(|d| self.sensors.channels.contains(&encoder(d)))
    }

    fn top_speed(&self, dof: usize) -> f64 {
        self.records.iter().flat_map(|r| &r.thetad[dof]).fold(0.0, |m, v| m.max(v.abs()))
    }

    fn quantiles(&self, dof: usize, quantiles: &[f64]) -> Vec<f64> {
        let mut all: Vec<f64> = self.records.iter().flat_map(|r| r.theta[dof].iter().copied()).collect();
        all.sort_by(f64::total_cmp);
        quantiles.iter().map(|q| all[((all.len() - 1) as f64 * q) as usize]).collect()
    }

    fn apparent_inertia(&self, dof: usize) -> f64 {
        let model = &self.problem.robot.model;
        let record = &self.records[0];
        let q: Vec<f64> = record.theta.iter().map(|t| t[record.len() / 2]).collect();
        mass_matrix(model, &q)[(dof, dof)]
    }
}

// The standard deviation that is stated of an optional parameter.
fn optional_std(parameter: &Parameter, spec: &EffectSpec) -> Option<f64> {
    let stated = spec.get(&format!("{}_std", parameter.key)).filter(|_| parameter.role == Role::Optional)?;
    match stated {
        Setting::Number(std) => Some(*std),
        Setting::Numbers(stds) => stds.get(parameter.component?).copied(),
        Setting::Word(_) => None,
    }
}

fn is_fitted(parameter: &Parameter, spec: &EffectSpec) -> bool {
    !parameter.is_stated() || optional_std(parameter, spec).is_some()
}

// First moment of a load about the tool, as a lever of the mass of the robot; its square for inertias, m. A tool of which no more is
// known than its link's own frame is as far from the load as the link reaches, twice as far as its centre of mass.
fn usual_lever(robot: &Robot) -> f64 {
    let model = &robot.model;
    let tool = &model.links[robot.tool.0];
    let is_own_frame = tool.body_from_link.translation.norm() < 1e-9;
    let inertia = tool.body.filter(|_| is_own_frame).map(|body| &model.joints[body.0].inertia);
    let reach = inertia.filter(|i| i.mass > 0.0).map_or(0.0, |i| 2.0 * i.centre_of_mass().norm());
    reach.max(USUAL_LEVER)
}

const USUAL_LEVER: f64 = 0.05;
// Damping ratio of a spring that nobody stated.
const START_DAMPING: f64 = 0.03;
// Span of temperatures from which friction may be seen to depend on it, K.
const LEAST_WARMING: f64 = 3.0;
// Sample period beyond which a motor-side log alone shows no spring, s.
const SLOWEST_SPRING_LOG: f64 = 0.005;
