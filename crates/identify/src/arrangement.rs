//! Positions that stand in each other's place or have the opposite sign: where the torques do not follow the model, whether
//! they would with the columns arranged in another way.

use rayon::prelude::*;

use sinew_data::{Note, Quantity, Run, Severity};
use sinew_model::Robot;

// Seconds of a run and most joints that are looked at.
const LOOKED_AT: f64 = 10.0;
const MOST_JOINTS: usize = 8;
// The share of its torque that the model explains of every joint where nothing is looked for.
const NEARLY_ALL: f64 = 0.9;
// The same of every joint that is arranged, and what all joints gain together, or the share of what was unexplained that is left.
const EXPLAINED: f64 = 0.7;
const GAIN: f64 = 0.5;
const LEFT: f64 = 0.2;

/// How the torque of a joint follows the model's.
pub(crate) struct Followed {
    pub dof: usize,
    /// Its factor of the model's.
    pub slope: f64,
    /// The share of its square that the model explains; negative where it has the opposite sign.
    pub share: f64,
}

/// The first seconds of the first run.
pub(crate) struct Beginning<'a> {
    pub name: &'a str,
    pub run: Run,
    /// How the torques of motors follow the model as they were logged.
    pub as_logged: Vec<Followed>,
}

impl<'a> Beginning<'a> {
    /// None where nothing can be said. `explained`: how the torques of a run's motors follow the model as it stands.
    pub fn of(runs: &'a [Run], explained: impl Fn(&Run) -> Option<Vec<Followed>>) -> Option<Self> {
        let first = runs.first()?;
        let run = first.window(0.0, LOOKED_AT).ok()?;
        let as_logged = explained(&run)?;
        Some(Self { name: &first.name, run, as_logged })
    }
}

// How columns are arranged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Arrangement {
    // The opposite sign: of the positions of a joint, of all its columns.
    PositionsTurned(usize),
    JointTurned(usize),
    // Two in each other's place: their positions, their torques, all their columns.
    PositionsExchanged(usize, usize),
    TorquesExchanged(usize, usize),
    JointsExchanged(usize, usize),
}

/// What looks exchanged or turned about: the arrangement of the first seconds that explains most, if it explains much more than
/// the columns as they are, or nearly all of what they leave: friction makes much of a torque follow another joint's model. `explained` as in [`Beginning::of`].
pub(crate) fn arrangement_notes(
    robot: &Robot,
    beginning: &Beginning,
    explained: impl Fn(&Run) -> Option<Vec<Followed>> + Sync,
) -> Vec<Note> {
    let Beginning { name, run, as_logged: before } = beginning;
    let joints: Vec<usize> = before.iter().map(|f| f.dof).collect();
    if joints.len() > MOST_JOINTS || before.iter().all(|f| f.share > NEARLY_ALL) {
        return Vec::new();
    }
    let sum = |all: &[Followed]| all.iter().map(|f| f.share).sum::<f64>();
    let tried = arrangements(&joints).into_par_iter().filter_map(|arrangement| {
        let after = explained(&arrangement.of(robot, run))?;
        let share = |dof: usize| after.iter().find(|f| f.dof == dof).map_or(0.0, |f| f.share);
        let fits = arrangement.joints().iter().all(|dof| share(*dof) > EXPLAINED);
        let gain = sum(&after) - sum(before);
        let was_left = joints.len() as f64 - sum(before);
        let is_much = gain > GAIN || was_left - gain < LEFT * was_left;
        (fits && is_much).then_some((arrangement, gain))
    });
    let best = tried.max_by(|a, b| a.1.total_cmp(&b.1));
    best.map(|(arrangement, _)| arrangement.note(robot, name)).into_iter().collect()
}

fn arrangements(joints: &[usize]) -> Vec<Arrangement> {
    let alone = joints
        .iter()
        .flat_map(|&joint| [Arrangement::PositionsTurned(joint), Arrangement::JointTurned(joint)]);
    let pairs = joints.iter().enumerate().flat_map(|(k, &a)| joints[k + 1..].iter().map(move |&b| (a, b)));
    let exchanged = pairs.flat_map(|(a, b)| {
        use Arrangement::{JointsExchanged, PositionsExchanged, TorquesExchanged};
        [PositionsExchanged(a, b), TorquesExchanged(a, b), JointsExchanged(a, b)]
    });
    alone.chain(exchanged).collect()
}

impl Arrangement {
    fn joints(self) -> Vec<usize> {
        match self {
            Self::PositionsTurned(joint) | Self::JointTurned(joint) => vec![joint],
            Self::PositionsExchanged(a, b) | Self::TorquesExchanged(a, b) | Self::JointsExchanged(a, b) => {
                vec![a, b]
            }
        }
    }

    // The run arranged so; of two joints in each other's place what both have.
    fn of(self, robot: &Robot, run: &Run) -> Run {
        let is_position = |q: Quantity| matches!(q, Quantity::MotorPosition | Quantity::JointPosition);
        let is_torque =
            |q: Quantity| matches!(q, Quantity::MotorTorque | Quantity::MotorCurrent | Quantity::JointTorque);
        let name = |dof: usize| robot.model.dof_name(dof);
        let have = |q: Quantity| self.joints().iter().all(|&dof| run.signal(q, name(dof)).is_some());
        let mut arranged = run.clone();
        for signal in arranged.signals.iter_mut().filter(|s| s.quantity.is_of_joint()) {
            let takes = match self {
                Self::PositionsTurned(_) | Self::PositionsExchanged(..) => is_position(signal.quantity),
                Self::TorquesExchanged(..) => is_torque(signal.quantity),
                Self::JointTurned(_) | Self::JointsExchanged(..) => signal.quantity != Quantity::Temperature,
            };
            match self {
                Self::PositionsTurned(joint) | Self::JointTurned(joint) => {
                    if takes && signal.place == name(joint) {
                        signal.values.iter_mut().for_each(|x| *x = -*x);
                    }
                }
                Self::PositionsExchanged(a, b)
                | Self::TorquesExchanged(a, b)
                | Self::JointsExchanged(a, b) => {
                    let place = match &signal.place {
                        place if place == name(a) => name(b),
                        place if place == name(b) => name(a),
                        _ => continue,
                    };
                    if takes && have(signal.quantity) {
                        place.clone_into(&mut signal.place);
                    }
                }
            }
        }
        arranged
    }

    fn note(self, robot: &Robot, run: &str) -> Note {
        let name = |dof: usize| robot.model.dof_name(dof);
        let (statement, help) = match self {
            Self::PositionsTurned(joint) => (
                format!(
                    "the positions of joint \"{}\" look as if they had the opposite sign: turned about, torques fit the model",
                    name(joint)
                ),
                "write negative scales for them in the columns map",
            ),
            Self::JointTurned(joint) => (
                format!(
                    "joint \"{}\" looks turned about: with the opposite sign of all its columns, torques fit the model",
                    name(joint)
                ),
                "write negative scales for its columns in the map, or turn the joint's axis",
            ),
            Self::PositionsExchanged(a, b) => (
                format!(
                    "the positions of \"{}\" and \"{}\" look exchanged: in each other's place, torques fit the model",
                    name(a),
                    name(b)
                ),
                "exchange them in the columns map",
            ),
            Self::TorquesExchanged(a, b) => (
                format!(
                    "the torques of \"{}\" and \"{}\" look exchanged: in each other's place, they fit the model",
                    name(a),
                    name(b)
                ),
                "exchange them in the columns map",
            ),
            Self::JointsExchanged(a, b) => (
                format!(
                    "the columns of \"{}\" and \"{}\" look exchanged: in each other's place, torques fit the model",
                    name(a),
                    name(b)
                ),
                "exchange the two joints in the columns map",
            ),
        };
        Note { severity: Severity::Error, place: run.to_owned(), statement, help: help.to_owned() }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use sinew_data::Signal;
    use sinew_effects::CATALOGUE;
    use sinew_model::{EffectSpec, Place, samples};
    use sinew_rigid::inverse_dynamics;

    use super::*;
    use crate::{Options, torque_checks};

    // Two joints of an arm in its own plane, moved at incommensurable frequencies, with the torques of its model.
    pub(crate) fn run(robot: &Robot) -> Run {
        let period = 2e-3;
        let time: Vec<f64> = (0..4000).map(|k| period * k as f64).collect();
        let motion = |t: f64| {
            let [a, b] = [2.1, 3.7].map(|w| w * t);
            (
                [0.5 * a.sin(), 0.6 * b.sin()],
                [1.05 * a.cos(), 2.22 * b.cos()],
                [-2.205 * a.sin(), -8.214 * b.sin()],
            )
        };
        let torque = |t: f64| {
            let (q, qd, qdd) = motion(t);
            inverse_dynamics(&robot.model, &q, &qd, &qdd)
        };
        let series = |of: &dyn Fn(f64) -> f64| time.iter().map(|t| of(*t)).collect::<Vec<f64>>();
        let signals = (0..2).flat_map(|dof| {
            let name = robot.model.dof_name(dof);
            [
                Signal::new(Quantity::MotorPosition, name, series(&|t| motion(t).0[dof])),
                Signal::new(Quantity::MotorTorque, name, series(&|t| torque(t)[dof])),
            ]
        });
        Run::new("swing".to_owned(), time.clone(), signals.collect()).unwrap()
    }

    #[test]
    fn columns_that_stand_in_each_others_place_or_are_turned_are_told() {
        let robot = Robot::rigid(samples::planar_arm(2, 4.0, 0.5));
        let run = run(&robot);
        let told =
            |run: &Run| torque_checks(&robot, &CATALOGUE, std::slice::from_ref(run), &Options::default());
        assert_eq!(told(&run), []);
        let arranged = [
            (Arrangement::JointTurned(1), "turned about"),
            (Arrangement::PositionsExchanged(0, 1), "exchanged"),
            (Arrangement::JointsExchanged(0, 1), "exchanged"),
        ];
        for (arrangement, words) in arranged {
            let notes = told(&arrangement.of(&robot, &run));
            assert!(notes.iter().any(|n| n.severity == Severity::Error), "{arrangement:?}: {notes:?}");
            assert!(notes.iter().any(|n| n.statement.contains(words)), "{arrangement:?}: {notes:?}");
        }
    }

    // Friction, of which each torque has most, goes the same way in both.
    #[test]
    fn columns_are_exchanged_where_friction_makes_each_follow_the_other() {
        let mut robot = Robot::rigid(samples::planar_arm(2, 4.0, 0.5));
        let mut run = run(&robot);
        let coulomb = 30.0;
        for dof in 0..2 {
            let joint = robot.model.dof_name(dof).to_owned();
            let positions = run.signal(Quantity::MotorPosition, &joint).unwrap().values.clone();
            let torque =
                run.signals.iter_mut().find(|s| s.quantity == Quantity::MotorTorque && s.place == joint);
            let forward = |k: usize| positions[(k + 1).min(positions.len() - 1)] > positions[k.max(1) - 1];
            let friction = |k: usize| if forward(k) { coulomb } else { -coulomb };
            torque.unwrap().values.iter_mut().enumerate().for_each(|(k, x)| *x += friction(k));
            let spec = EffectSpec::new("coulomb_friction", Place::Joint(joint));
            robot.effects.push(spec.with("coulomb", coulomb));
        }
        let told =
            |run: &Run| torque_checks(&robot, &CATALOGUE, std::slice::from_ref(run), &Options::default());
        assert_eq!(told(&run), []);
        for arrangement in [Arrangement::JointsExchanged(0, 1), Arrangement::TorquesExchanged(0, 1)] {
            let notes = told(&arrangement.of(&robot, &run));
            assert!(notes.iter().any(|n| n.statement.contains("exchanged")), "{arrangement:?}: {notes:?}");
        }
    }

    // What one of two joints lacks stays where it is.
    #[test]
    fn joints_with_other_sensors_are_exchanged_in_what_both_have() {
        let robot = Robot::rigid(samples::planar_arm(2, 4.0, 0.5));
        let mut run = run(&robot);
        let name = robot.model.dof_name(1);
        let motor = run.signal(Quantity::MotorPosition, name).unwrap();
        run.signals.push(Signal::new(Quantity::JointPosition, name, motor.values.clone()));
        let exchanged = Arrangement::JointsExchanged(0, 1).of(&robot, &run);
        assert!(exchanged.signal(Quantity::JointPosition, name).is_some());
        let notes = torque_checks(&robot, &CATALOGUE, &[exchanged], &Options::default());
        assert!(notes.iter().any(|n| n.statement.contains("exchanged")), "{notes:?}");
    }
}
