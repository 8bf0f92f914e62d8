//! Diagnoses one case of the suite and prints everything.
//!
//! ```text
//! cargo run --release -p sinew-tests --example case -- 1|2 EFFECT|nothing SEED
//! ```

use sinew_tests::{Case, hidden_effects, judge, one_joint, two_joints};
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [_, _, _] = args.as_slice() else { return eprintln!("usage: case 1|2 EFFECT|nothing SEED") };
    let arm = if args[0] == "1" { one_joint() } else { two_joints() };
    let Ok(seed) = args[2].parse::<u64>() else { return eprintln!("SEED: a whole number") };
    let dof = seed as usize % arm.robot.model.nv;
    let all = hidden_effects(&arm, dof);
    let hidden = all.iter().find(|h| h.effect == args[1]);
    let case = Case::new(&arm, hidden, if hidden.is_some() { seed } else { 100_000 + seed });
    let d = match judge(&arm, &case, &Default::default()) {
        Ok((_, diagnosis)) => diagnosis,
        Err(error) => return eprintln!("{error}"),
    };
    println!("{:?} → {}", case.hidden, d.verdict);
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
    for r in &d.refusals {
        println!("refused {} step {}: {}", r.candidate, r.step, r.reason);
    }
}
