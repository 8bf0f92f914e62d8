//! Diagnoses one case of the suite and prints everything.
//!
//! ```text
//! cargo run --release -p sinew-tests --example case -- 1|2|6[-rigid] EFFECT[+EFFECT]|CAUSE|nothing SEED [full|motor|current|link|all [fine|coarse [SIZE [imposed|innovation]]]] [stated]
//! cargo run --release -p sinew-tests --example case -- drawn SEED [EFFECT|nothing] [full|motor|current|link|all] [imposed|innovation] [stated]
//! cargo run --release -p sinew-tests --example case -- described FILE.urdf SEED [EFFECT] [imposed|innovation] [stated]
//! cargo run --release -p sinew-tests --example case -- mixed SEED [imposed|innovation] [stated]
//! ```
//!
//! Encoders are named as for `recognition`: `fine+read+places` and so on. `torque_ripple@motor` is one that follows the motor's turns.
//! With `stated`, the last word of any form, what is hidden is stated to the model, so that nothing is missing.

use std::path::Path;

use sinew_identify::{Options, Residual};
use sinew_tests::{
    Arm, Case, Conditions, Sensors, described_case, drawn_case, foreign_causes, hidden_effects, judge,
    mixed_case, null_case, turns_of_motor,
};

const USAGE: &str = "usage: case 1|2|6[-rigid] EFFECT[+EFFECT]|CAUSE|nothing SEED [full|motor|current|link|all [fine|coarse [SIZE [imposed|innovation]]]] [stated]
       case drawn SEED [EFFECT|nothing] [full|motor|current|link|all] [imposed|innovation] [stated]
       case described FILE.urdf SEED [EFFECT] [imposed|innovation] [stated]
       case mixed SEED [imposed|innovation] [stated]";

fn main() {
    let mut args: Vec<String> = std::env::args().skip(1).collect();
    let is_stated = args.pop_if(|last| last == "stated").is_some();
    let Some((arm, mut case)) = asked(&args) else { return eprintln!("{USAGE}") };
    if is_stated {
        case.model.clone_from(&case.truth);
        case.hidden.clear();
    }
    let residual = args.iter().find_map(|a| match a.as_str() {
        "imposed" => Some(Residual::Imposed),
        "innovation" => Some(Residual::Innovation),
        _ => None,
    });
    let options = Options { residual, ..Options::default() };
    let stiff = arm
        .robot
        .joints
        .iter()
        .map(|j| j.stiffness.map_or("rigid".to_owned(), |k| format!("{k:.0} N·m/rad")));
    eprintln!(
        "{}: {:?}, {:?}, {:?}",
        arm.robot.model.name,
        stiff.collect::<Vec<_>>(),
        case.hidden,
        case.conditions
    );
    let d = match judge(&arm, &case, &options) {
        Ok((_, diagnosis)) => diagnosis,
        Err(error) => return eprintln!("{error}"),
    };
    println!("{:?} {:?} → {}\n{}", case.hidden, case.conditions, d.verdict, d.scope);
    for c in &d.candidates {
        println!(
            "{}@{} P {:.2} z {:.1} expl {:.2} {:?}",
            c.effect,
            c.place,
            c.probability,
            c.z,
            c.error_explained,
            c.rivals
                .iter()
                .map(|r| format!("{}@{} {:.2}", r.effect, r.place, r.probability))
                .collect::<Vec<_>>()
        );
        for p in &c.values {
            println!("    {} {:.6} ± {:.6} {}", p.name, p.value, p.std, p.unit);
        }
    }
    for c in &d.channels {
        println!(
            "{} {} E {:.5} P {:.2} D {:.2}",
            c.signal, c.joint, c.unseen_error, c.predictable_remainder, c.distance_to_floor
        );
    }
    for f in &d.findings {
        println!("finding {}: {}", f.joint, f.statement);
    }
    for r in &d.refusals {
        println!("refused {} step {}: {}", r.candidate, r.step, r.reason);
    }
}

fn asked(args: &[String]) -> Option<(Arm, Case)> {
    if args.first()? == "drawn" {
        let sensors = args.iter().find_map(|a| Sensors::named(a));
        let is_effect = |a: &&str| !["imposed", "innovation"].contains(a) && Sensors::named(a).is_none();
        let effect = args.get(2).map(String::as_str).filter(is_effect);
        return Some(drawn_case(args.get(1)?.parse().ok()?, 1.0, effect, sensors));
    }
    if args[0] == "described" {
        let effect = args.get(3).map(String::as_str).filter(|a| !["imposed", "innovation"].contains(a));
        let case = described_case(Path::new(args.get(1)?), args.get(2)?.parse().ok()?, 1.0, effect);
        return case.inspect_err(|error| eprintln!("{error}")).ok();
    }
    if args[0] == "mixed" {
        let (arm, case, _) = mixed_case(args.get(1)?.parse().ok()?);
        return Some((arm, case));
    }
    let word = |k: usize, default: &'static str| args.get(k).cloned().unwrap_or(default.to_owned());
    let arm = Arm::named(args.first()?)?;
    let conditions = Conditions::named(&word(3, "full"), &word(4, "fine"))?;
    let seed: u64 = args.get(2)?.parse().ok()?;
    let size = args.get(5).and_then(|a| a.parse().ok()).unwrap_or(1.0);
    let dof = seed as usize % arm.robot.model.nv;
    let all = hidden_effects(&arm, dof, size);
    let of_motor = turns_of_motor(&arm, dof, size);
    // One effect, several joined by +, a cause from outside the catalogue, or nothing.
    let hidden_as = |e: &str| match e.strip_suffix("@motor") {
        Some(e) => of_motor.iter().find(|h| h.effect == e),
        None => all.iter().find(|h| h.effect == e),
    };
    let case = match foreign_causes(&arm, dof, size).iter().find(|f| f.name == args[1]) {
        Some(cause) => Case::foreign(&arm, cause, dof, conditions, seed),
        None if args[1] == "nothing" => null_case(&arm, conditions, 100_000 + seed),
        None => {
            let hidden = args[1].split('+').map(hidden_as).collect::<Option<Vec<_>>>()?;
            Case::new(&arm, &hidden, conditions, seed)
        }
    };
    Some((arm, case))
}
