//! Times the rigid-body algorithms of Sinew on robots given as URDF files.
//!
//! Prints one line for each robot and algorithm: `robot,algorithm,library,min_ns,median_ns`, library `sinew` for the
//! plain form and `sinew-batch` for the batch form, per configuration. Names with `elastic` are those of joints with springs
//! on the same mechanism, `…_beside_aba` its rigid forward dynamics timed just before. Beside a file `ROBOT.urdf` a file `ROBOT.check`
//! of expected torques, mass matrices and accelerations is compared with first. Environment: `BUDGET_MS`, time of one
//! measurement (60); `ONLY`, part of the name of the algorithms wanted.
//!
//! With `--count` first it prints what each algorithm computes instead: `robot,algorithm,multiplications,additions,divisions,functions`.

#![allow(non_snake_case)]

mod check;
mod count;
mod elastic;
mod robot;
mod suite;
mod timer;

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut paths: Vec<String> = std::env::args().skip(1).collect();
    let counts = paths.first().is_some_and(|first| first == "--count");
    paths.drain(..usize::from(counts));
    if paths.is_empty() {
        eprintln!("usage: sinew-bench [--count] ROBOT.urdf...");
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
        if counts {
            count::print_all(&model);
            continue;
        }
        check::compare(&model, path);
        suite::time_all(&model);
    }
    ExitCode::SUCCESS
}
