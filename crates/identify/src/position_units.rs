//! Positions in another unit: where no torque follows the model, whether torques would with positions in degrees, turns or
//! millimetres.

use std::f64::consts::TAU;

use sinew_data::{Note, Quantity, Run, Severity};
use sinew_model::{JointKind, Robot};

use crate::arrangement::{Beginning, Followed};
use crate::before::listed;

// A torque follows the model if the model explains this share of its square, with a factor within these.
const FOLLOWS: f64 = 0.5;
const FACTOR: std::ops::Range<f64> = 0.25..4.0;
// … and clearly so from this share on, if that is so much more than without a change.
const CLEARLY: f64 = 0.7;
const GAIN: f64 = 0.2;

/// A unit in which somebody's positions may be.
struct Unit {
    name: &'static str,
    // How much of the model's unit it is.
    size: f64,
    turns: bool,
    slides: bool,
}

const UNITS: [Unit; 4] = [
    Unit { name: "degrees", size: TAU / 360.0, turns: true, slides: false },
    Unit { name: "turns", size: TAU, turns: true, slides: false },
    Unit { name: "thousandths (mrad, mm)", size: 1e-3, turns: true, slides: true },
    Unit { name: "millimetres", size: 1e-3, turns: false, slides: true },
];

/// Positions that are not in rad or m, by the first seconds: no torque follows the model as they are, and those of half of
/// the joints or more do as soon as positions are taken for another unit. `explained` as in [`Beginning::of`].
///
/// ```text
/// τ = M(q) q̈ + c(q, q̇) + g(q):   a factor of q shrinks q̈, q̇² and the argument of g, each by another power
/// ```
///
/// Without gravity that factor may be one of the torque as well: then as much follows the model as before, and the factor is told
/// of the torque.
pub(crate) fn unit_notes(
    robot: &Robot,
    beginning: &Beginning,
    explained: impl Fn(&Run) -> Option<Vec<Followed>>,
) -> Vec<Note> {
    let Beginning { name, run, as_logged } = beginning;
    let follows = |f: &Followed, share: f64| f.share > share && FACTOR.contains(&f.slope);
    if as_logged.iter().any(|f| follows(f, FOLLOWS)) {
        return Vec::new();
    }
    let logged = |dof: usize| as_logged.iter().find(|f| f.dof == dof).map_or(0.0, |f| f.share);
    // A unit that no joint can have changes nothing, and no torque follows then either.
    let tried = UNITS.iter().filter_map(|unit| {
        let after = explained(&unit.taken_for(robot, run))?;
        let of_all: f64 = after.iter().map(|f| f.share).sum();
        let is_better = |f: &&Followed| follows(f, CLEARLY) && f.share > logged(f.dof) + GAIN;
        let better: Vec<&str> = after.iter().filter(is_better).map(|f| robot.model.dof_name(f.dof)).collect();
        (2 * better.len() >= after.len().max(1)).then_some((unit, better, of_all))
    });
    let best = tried.max_by(|a, b| a.1.len().cmp(&b.1.len()).then(a.2.total_cmp(&b.2)));
    let note = |(unit, better, _): (&Unit, Vec<&str>, f64)| Note {
        severity: Severity::Error,
        place: (*name).to_owned(),
        statement: format!(
            "the positions look as if they were in {}: taken for that, the torque of {} follows the model, and as they are none does",
            unit.name,
            listed(&better)
        ),
        help: format!("multiply their scales in the columns map (1 without one) by {}", unit.size),
    };
    best.map(note).into_iter().collect()
}

impl Unit {
    fn taken_for(&self, robot: &Robot, run: &Run) -> Run {
        let is_of_motion = |q: Quantity| {
            use Quantity::{JointPosition, JointVelocity, MotorPosition, MotorVelocity};
            matches!(q, JointPosition | JointVelocity | MotorPosition | MotorVelocity)
        };
        let mut taken = run.clone();
        for signal in taken.signals.iter_mut().filter(|s| is_of_motion(s.quantity)) {
            let kind = robot.model.joint(&signal.place).map(|id| &robot.model.joints[id.0].kind);
            let is_taken = match kind {
                Some(JointKind::Revolute { .. }) => self.turns,
                Some(kind) if kind.slides() => self.slides,
                _ => false,
            };
            if is_taken {
                signal.values.iter_mut().for_each(|x| *x *= self.size);
            }
        }
        taken
    }
}

#[cfg(test)]
mod tests {
    use sinew_effects::CATALOGUE;
    use sinew_model::samples;

    use super::*;
    use crate::arrangement::tests::run;
    use crate::{Options, torque_checks};

    #[test]
    fn positions_in_another_unit_are_told_and_others_not() {
        let robot = Robot::rigid(samples::planar_arm(2, 4.0, 0.5));
        let as_it_is = run(&robot);
        let told = |run: Run| torque_checks(&robot, &CATALOGUE, &[run], &Options::default());
        // Without gravity turns are a factor of the torques as well.
        for unit in [&UNITS[0], &UNITS[2]] {
            let back = Unit { name: unit.name, size: 1.0 / unit.size, turns: true, slides: true };
            let notes = told(back.taken_for(&robot, &as_it_is));
            assert!(notes.len() == 1 && notes[0].severity == Severity::Error, "{}: {notes:?}", unit.name);
            assert!(notes[0].statement.contains(unit.name), "{}: {notes:?}", unit.name);
        }
        assert_eq!(told(as_it_is), []);
    }
}
