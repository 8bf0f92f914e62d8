//! The population on which probabilities are calibrated: nothing, one effect, two of them, all friction and one more, as where
//! a model knows nothing of its drives, causes from outside the catalogue.

use crate::drawn::Draws;
use crate::hidden::{Hidden, are_twins, effects_by_chance};
use crate::{Arm, Case, Conditions, foreign_causes, null_case, one_joint, two_joints};

// Shares of the cases that hide nothing, one effect, a cause from outside, all friction; the others hide two effects.
const NOTHING: f64 = 0.1;
const ONE: f64 = 0.5;
const OUTSIDE: f64 = 0.2;
const FRICTION: f64 = 0.1;
// Shares of the arms that are the suite's own, in its own conditions, and of those of one joint.
const OWN: f64 = 0.5;
const SINGLE: f64 = 0.6;
// Sizes of what is hidden.
const SIZES: [f64; 2] = [0.2, 1.5];

/// A case of the population, a pure function of its seed, with what kind of case it is.
pub fn mixed_case(seed: u64) -> (Arm, Case, &'static str) {
    let draws = &mut Draws::new(seed, "mixed");
    let (arm, conditions) = if draws.uniform(0.0, 1.0) < OWN {
        let arm = if draws.uniform(0.0, 1.0) < SINGLE { one_joint() } else { two_joints() };
        let (sensors, encoder) = (draws.one_of(&["full", "motor"]), draws.one_of(&["fine", "coarse"]));
        (arm, Conditions::named(sensors, encoder).expect("names of the suite"))
    } else {
        (Arm::drawn(seed), Conditions::drawn(seed))
    };
    let size = draws.log(SIZES[0], SIZES[1]);
    let joints: Vec<usize> = (0..arm.robot.model.nv).collect();
    let mut effect = || {
        let dof = draws.one_of(&joints);
        let mut all = effects_by_chance(&arm, dof, size);
        all.retain(|h| h.is_seen_by(conditions.sensors));
        all.swap_remove(draws.below(all.len()))
    };
    let (one, other) = (effect(), effect());
    let (kind, dof) = (draws.uniform(0.0, 1.0), draws.one_of(&joints));
    let hides = |hidden: &[&Hidden]| Case::new(&arm, hidden, conditions, seed);
    let (case, kind) = if kind < NOTHING {
        (null_case(&arm, conditions, seed), "nothing")
    } else if kind < NOTHING + ONE {
        (hides(&[&one]), "one")
    } else if kind < NOTHING + ONE + OUTSIDE {
        let mut causes = foreign_causes(&arm, dof, size);
        let cause = causes.swap_remove(draws.below(causes.len()));
        (Case::foreign(&arm, &cause, dof, conditions, seed), "outside")
    } else if kind < NOTHING + ONE + OUTSIDE + FRICTION {
        let friction: Vec<Hidden> = joints.iter().flat_map(|&dof| friction(&arm, dof)).collect();
        let mut all: Vec<&Hidden> = friction.iter().filter(|h| h.is_seen_by(conditions.sensors)).collect();
        if !all.iter().any(|h| are_twins(h.effect, one.effect)) {
            all.push(&one);
        }
        (hides(&all), "friction")
    } else if are_twins(one.effect, other.effect) {
        (hides(&[&one]), "one")
    } else {
        (hides(&[&one, &other]), "two")
    };
    (arm, case, kind)
}

fn friction(arm: &Arm, dof: usize) -> impl Iterator<Item = Hidden> {
    let plain = |h: &Hidden| matches!(h.effect, "viscous_friction" | "coulomb_friction");
    effects_by_chance(arm, dof, 1.0).into_iter().filter(plain)
}
