//! Times the rigid-body algorithms of Sinew on robots given as URDF files.
//!
//! Prints one line for each robot and algorithm: `robot,algorithm,library,min_ns,median_ns`, library `sinew` for the
//! plain form and `sinew-batch` for the batch form, per configuration. Names with `elastic` are those of joints with springs
//! on the same mechanism, `…_beside_aba` its rigid forward dynamics timed just before. Beside a file `ROBOT.urdf` a file `ROBOT.check`
//! of expected torques, mass matrices and accelerations is compared with first. Environment: `BUDGET_MS`, time of one
//! measurement (60); `ONLY`, part of the name of the algorithms wanted.

#![allow(non_snake_case)]

mod check;
mod elastic;
mod robot;
mod suite;
mod timer;

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let paths: Vec<String> = std::env::args().skip(1).collect();
    if paths.is_empty() {
        eprintln!("usage: sinew-bench ROBOT.urdf...");
        return ExitCode::from(2);
    }
    for path in paths {
        let path = Path::new(&path);
        let model = match robot::read(path) {
            Ok(model) => model,
            Err(message) => {
                eprintln!("{message}");
                return ExitCode::from(2);
            }
        };
        check::compare(&model, path);
        suite::time_all(&model);
    }
    ExitCode::SUCCESS
}
