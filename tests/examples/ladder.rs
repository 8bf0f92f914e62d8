//! Prints the ladder of a robot and its runs: ROBOT COLUMNS FIT,FIT CHECK,CHECK.
use sinew_data::{ColumnMap, RunSpec};
use std::path::Path;
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let robot = sinew_urdf::read_robot(Path::new(&args[0])).unwrap().robot;
    let map = ColumnMap::read(Path::new(&args[1])).unwrap();
    let read = |list: &str| -> Vec<sinew_data::Run> {
        list.split(',')
            .filter(|s| !s.is_empty())
            .map(|s| s.parse::<RunSpec>().unwrap().read(Some(&map)).unwrap())
            .collect()
    };
    let (runs, check) = (read(&args[2]), read(args.get(3).map_or("", String::as_str)));
    let start = std::time::Instant::now();
    let options = sinew_identify::Options::default();
    let fit = sinew_identify::discover(&robot, &sinew_effects::CATALOGUE, &runs, &check, &options).unwrap();
    for s in &fit.steps {
        println!("{:?} {:.2} {:?}", s.added, s.rms_error, s.check_rms_error);
        let pc = |list: &[sinew_identify::SignalError]| {
            list.iter()
                .map(|e| format!("{:.1}", 100.0 * e.rms_error / e.rms_measured))
                .collect::<Vec<_>>()
                .join(" ")
        };
        println!("   fit % {}   unseen % {}", pc(&s.signals), pc(&s.check_signals));
    }
    for p in &fit.parameters {
        println!("{} {:.5} ± {:.5} {} {:?}", p.name, p.value, p.std, p.unit, p.note);
    }
    for w in &fit.warnings {
        println!("! {w}");
    }
    for c in &fit.diagnosis.candidates {
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
    }
    for c in &fit.diagnosis.channels {
        println!(
            "{} {} E {:.3} P {:.2} D {:.2}",
            c.signal, c.joint, c.unseen_error, c.predictable_remainder, c.distance_to_floor
        );
    }
    for r in &fit.diagnosis.refusals {
        println!("refused {} step {}: {}", r.candidate, r.step, r.reason);
    }
    for f in &fit.diagnosis.findings {
        println!("* {}", f.statement);
    }
    println!("{} in {:.1?}", fit.verdict, start.elapsed());
}
