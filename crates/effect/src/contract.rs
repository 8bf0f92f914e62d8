//! The contract that every effect keeps, as one check for all of them.

mod card;
mod sample;

use sinew_model::{Model, Scalar, samples};

use crate::{Act, DIRECTIONS, Derivative, Effect, Energy, Kind, LANES, Role, Wide};
use sample::{ACTS, Random, Sample, answer, energy};

// States at which the clauses are checked, besides rest.
const STATES: usize = 24;
// Exact derivative against fourth-order differences: relative, and share of the rounding of f/h.
const DIFFERENCES: f64 = 1e-6;
const STEP: f64 = 1e-3;
const ROUNDING: f64 = 1e-12;
// Two orders of the same sums.
const ALGEBRA: f64 = 1e-12;

/// The arm of two joints on which effects are checked: `JointId(0)` and `JointId(1)`, links 1 and 2.
pub fn robot() -> Model {
    samples::planar_arm(2, 1.5, 0.4)
}

/// Checks that an effect keeps the contract of [`Law`](crate::Law); a test calls it once for each effect.
///
/// The clauses: the card is complete; zero strengths change nothing; every strength leaves a fingerprint; exact
/// derivatives agree with differences; lanes agree with plain numbers; what is not declared does nothing; the
/// energy claim holds (`Dissipates`: −Σ τ·v ≥ 0; `Stores`: −Σ τ·v = dU/dt); relaxation rates are not negative; all
/// numbers are finite over the range of every parameter, and at rest.
///
/// `example`: values of the card's parameters at which the effect is fully present, on the robot of [`robot`].
///
/// # Panics
/// With a sentence that names the effect and the broken clause.
pub fn check(effect: &dyn Effect, example: &[f64]) {
    card::check(effect.card(), example);
    let model = robot();
    let mut random = Random::new(1);
    let mut states: Vec<_> =
        (0..STATES).map(|_| Sample::random(&model, effect.states(), &mut random)).collect();
    zero_strengths_change_nothing(effect, &states);
    undeclared_acts_do_nothing(effect, example, &states);
    every_strength_leaves_a_fingerprint(effect, example, &states);
    derivatives_agree_with_differences(effect, example, &states);
    lanes_agree_with_numbers(effect, example, &states);
    the_energy_claim_holds(effect, example, &states);
    states.push(Sample::rest(&model, effect.states()));
    all_numbers_are_finite(effect, example, &states);
}

fn broken(effect: &dyn Effect, clause: &str) -> ! {
    panic!("{}: {clause}", effect.card().name)
}

fn declares(effect: &dyn Effect, act: Act) -> bool {
    let acts = effect.acts();
    acts.contains(&act) || (act == Act::MotorForce && acts.contains(&Act::LoadedMotorForce))
}

// All strengths and stated numbers zero, shapes at their start.
fn absent(effect: &dyn Effect) -> Vec<f64> {
    effect.card().parameters.iter().map(|p| p.start()).collect()
}

fn zero_strengths_change_nothing(effect: &dyn Effect, states: &[Sample<f64>]) {
    let zero = absent(effect);
    for x in states {
        for act in ACTS.into_iter().filter(|&act| act != Act::State) {
            if answer(effect, act, &zero, x) != answer(&Nothing, act, &zero, x) {
                broken(effect, &format!("with all strengths zero it still changes {act:?}"));
            }
        }
        if energy(effect, &zero, x) != 0.0 {
            broken(effect, "with all strengths zero it still stores energy");
        }
    }
}

fn undeclared_acts_do_nothing(effect: &dyn Effect, p: &[f64], states: &[Sample<f64>]) {
    if declares(effect, Act::State) != (effect.states() > 0) {
        broken(effect, "Act::State must be declared by effects with own states, and only by them");
    }
    for x in states {
        for act in ACTS.into_iter().filter(|&act| act != Act::State && !declares(effect, act)) {
            if answer(effect, act, p, x) != answer(&Nothing, act, p, x) {
                broken(effect, &format!("changes {act:?} without declaring it"));
            }
        }
        let unloaded = answer(effect, Act::MotorForce, p, &x.without_load());
        let loaded = effect.acts().contains(&Act::LoadedMotorForce);
        if !loaded && answer(effect, Act::MotorForce, p, x) != unloaded {
            broken(effect, "its motor force depends on the load: declare LoadedMotorForce");
        }
    }
}

fn every_strength_leaves_a_fingerprint(effect: &dyn Effect, example: &[f64], states: &[Sample<f64>]) {
    let parameters = effect.card().parameters.iter().enumerate();
    let mut points = [absent(effect), example.to_vec()];
    // A shape has no meaning at its start: look at zero strength with the example's shapes.
    for (k, parameter) in parameters.clone() {
        if matches!(parameter.role, Role::Shape { .. }) {
            points[0][k] = example[k];
        }
    }
    for (k, parameter) in parameters.filter(|(_, p)| p.role == Role::Strength) {
        let seen = |p: &Vec<f64>, x: &Sample<f64>| {
            let p = directions(p, k);
            let x = x.map(Derivative::constant);
            ACTS.into_iter().any(|act| answer(effect, act, &p, &x).iter().any(|y| y.derivative[0] != 0.0))
        };
        if !points.iter().any(|p| states.iter().any(|x| seen(p, x))) {
            broken(effect, &format!("`{}` leaves no fingerprint anywhere", parameter.label()));
        }
    }
}

// p as dual numbers whose direction d is parameter first + d.
fn directions(p: &[f64], first: usize) -> Vec<Derivative> {
    let dual = |(k, &x): (usize, &f64)| match k.checked_sub(first) {
        Some(d) if d < DIRECTIONS => Derivative::variable(x, d),
        _ => Derivative::constant(x),
    };
    p.iter().enumerate().map(dual).collect()
}

// Everything an effect answers, energy included.
fn answers<S: Kind>(effect: &dyn Effect, p: &[S], x: &Sample<S>) -> Vec<S> {
    let mut all: Vec<S> = ACTS.into_iter().flat_map(|act| answer(effect, act, p, x)).collect();
    all.push(energy(effect, p, x));
    all
}

fn derivatives_agree_with_differences(effect: &dyn Effect, p: &[f64], states: &[Sample<f64>]) {
    for (k, x) in (0..p.len()).flat_map(|k| states.iter().map(move |x| (k, x))) {
        let h = STEP * if p[k] == 0.0 { 1.0 } else { p[k].abs() };
        let moved = |steps: f64| {
            let mut p = p.to_vec();
            p[k] += steps * h;
            answers(effect, &p, x)
        };
        let exact = answers(effect, &directions(p, k), &x.map(Derivative::constant));
        compare(effect, effect.card().parameters[k].key, &exact, moved, h);
    }
    let constant: Vec<_> = p.iter().map(|&x| Derivative::constant(x)).collect();
    let mut random = Random::new(2);
    for x in states {
        let along: Vec<f64> = x.numbers.iter().map(|_| random.between(-1.0, 1.0)).collect();
        let mut dual = x.map(Derivative::constant);
        for (number, slope) in dual.numbers.iter_mut().zip(&along) {
            number.derivative[0] = *slope;
        }
        let h = 0.1 * STEP;
        let moved = |steps: f64| {
            let mut x = x.clone();
            for (number, slope) in x.numbers.iter_mut().zip(&along) {
                *number += steps * h * slope;
            }
            answers(effect, p, &x)
        };
        compare(effect, "the state", &answers(effect, &constant, &dual), moved, h);
    }
}

// f' = (8 f(h) − 8 f(−h) − f(2h) + f(−2h))/12h
fn compare(effect: &dyn Effect, by: &str, exact: &[Derivative], moved: impl Fn(f64) -> Vec<f64>, h: f64) {
    let [a, b, c, d] = [1.0, -1.0, 2.0, -2.0].map(moved);
    for (k, exact) in exact.iter().enumerate() {
        let difference = (8.0 * (a[k] - b[k]) - (c[k] - d[k])) / (12.0 * h);
        let error = (exact.derivative[0] - difference).abs();
        let allowed = DIFFERENCES * difference.abs() + ROUNDING * (1.0 + exact.value.abs()) / h;
        if error.is_nan() || error > allowed {
            let got = exact.derivative[0];
            let what = format!("derivative by {by} is {got} as a dual number, {difference} by differences");
            broken(effect, &what);
        }
    }
}

fn lanes_agree_with_numbers(effect: &dyn Effect, p: &[f64], states: &[Sample<f64>]) {
    for four in states.chunks_exact(LANES) {
        let share = |lane: usize| 1.0 - 0.1 * lane as f64;
        let wide: Vec<Wide> =
            p.iter().map(|&x| sinew_model::Lanes(core::array::from_fn(|lane| x * share(lane)))).collect();
        let lanes = answers(effect, &wide, &Sample::side_by_side(four));
        for (lane, x) in four.iter().enumerate() {
            let p: Vec<f64> = p.iter().map(|x| x * share(lane)).collect();
            for (lanes, number) in lanes.iter().zip(answers(effect, &p, x)) {
                if (lanes.0[lane] - number).abs() > ALGEBRA * (1.0 + number.abs()) {
                    broken(effect, &format!("lane {lane} gives {}, a plain number {number}", lanes.0[lane]));
                }
            }
        }
    }
}

fn the_energy_claim_holds(effect: &dyn Effect, p: &[f64], states: &[Sample<f64>]) {
    let claim = effect.card().energy;
    for x in states {
        let settled = x.settled(effect, p);
        let (loss, size) = loss(effect, p, if claim == Energy::Dissipates { &settled } else { x });
        let small = ALGEBRA * (1.0 + size);
        let stored = energy(effect, p, x);
        let kept = match claim {
            Energy::Dissipates => loss >= -small && stored == 0.0,
            Energy::Stores => loss.abs() <= small,
            Energy::StoresAndDissipates => loss >= -small,
            Energy::None => effect.acts().iter().all(|&act| act == Act::Reading),
            Energy::Exchanges | Energy::Supplies => true,
        };
        if !kept {
            let what =
                format!("claims {claim:?}, but loses {loss} W and stores {stored} J at {:?}", x.numbers);
            broken(effect, &what);
        }
    }
}

// Power that goes in and does not stay, and the size of its terms:
// loss = τ_spring·δ̇ − τ_link·q̇ − τ_motor·θ̇ − dU/dt
fn loss(effect: &dyn Effect, p: &[f64], x: &Sample<f64>) -> (f64, f64) {
    let at = x.at();
    let power = |act, rate: &[f64]| -> f64 {
        answer(effect, act, p, x).iter().zip(rate).map(|(tau, v)| tau * v).sum()
    };
    let terms = [
        power(Act::SpringTorque, at.deflection_rate),
        -power(Act::LinkForce, at.qd),
        -power(Act::MotorForce, at.thetad),
        -x.energy_rate(effect, p),
    ];
    (terms.iter().sum(), terms.iter().map(|t| t.abs()).sum())
}

fn all_numbers_are_finite(effect: &dyn Effect, example: &[f64], states: &[Sample<f64>]) {
    let mut points = vec![absent(effect), example.to_vec()];
    for (k, parameter) in effect.card().parameters.iter().enumerate() {
        let (low, high) = parameter.range;
        for end in [low, high].into_iter().filter(|end| end.is_finite()) {
            let mut p = example.to_vec();
            p[k] = end;
            points.push(p);
        }
    }
    for (p, x) in points.iter().flat_map(|p| states.iter().map(move |x| (p, x))) {
        let dual = x.map(|number| Derivative::variable(number, 0));
        let slopes = answers(effect, &directions(p, 0), &dual);
        if slopes.iter().any(|y| !(y.value.is_finite() && y.derivative.iter().all(|d| d.is_finite()))) {
            broken(effect, &format!("is not finite at {p:?}, {:?}", x.numbers));
        }
        if x.relaxations(effect, p).iter().any(|r| r.rate < 0.0) {
            broken(effect, &format!("a relaxation rate is negative at {p:?}"));
        }
    }
}

// The effect that is not there.
#[derive(Debug)]
struct Nothing;

impl crate::Law for Nothing {
    fn card(&self) -> &'static crate::Card {
        unreachable!("nobody asks for the card of nothing")
    }
    fn site(&self) -> crate::Site {
        crate::Site::Robot
    }
    fn acts(&self) -> &'static [Act] {
        &[]
    }
}
