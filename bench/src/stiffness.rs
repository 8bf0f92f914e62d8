//! Times the Cartesian compliance of a robot in 100 000 configurations, beside the same in another language.
//!
//! `stiffness ROBOT.urdf TOOL [FILE]`: prints ns per configuration on one thread, least and median of several calls.
//! All joints have springs of 1000, 1100, 1200 … N·m/rad. With FILE the configurations are written there as raw 64-bit
//! numbers, and the sum of all compliances is printed, so that another program can do and check the same.
#![allow(non_snake_case)]

use std::hint::black_box;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use nalgebra::DMatrix;
use sinew_kinematics::{ComplianceWorkspace, compliance_batch_into};
use sinew_model::samples::Random;

const CONFIGURATIONS: usize = 100_000;
const CALLS: usize = 15;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (Some(path), Some(tool)) = (arguments.first(), arguments.get(1)) else {
        eprintln!("usage: stiffness ROBOT.urdf TOOL [FILE]");
        return ExitCode::from(2);
    };
    let model = match sinew_urdf::read_urdf(Path::new(path)) {
        Ok(read) => read.model,
        Err(error) => {
            eprintln!("{error}");
            return ExitCode::from(2);
        }
    };
    let Some(link) = model.link(tool) else {
        eprintln!("{path}: no link \"{tool}\"");
        return ExitCode::from(2);
    };
    let mut random = Random::new(1);
    let q: Vec<f64> = (0..CONFIGURATIONS * model.nv).map(|_| random.uniform(-3.0, 3.0)).collect();
    let spring = |k: usize| 1.0 / (1000.0 + 100.0 * k as f64);
    let springs = DMatrix::from_fn(model.nv, model.nv, |i, j| if i == j { spring(i) } else { 0.0 });
    let mut ws = ComplianceWorkspace::new(&model);
    let mut C = vec![0.0; 36 * CONFIGURATIONS];
    time(&model.name, || compliance_batch_into(&model, &mut ws, link, &springs, &q, black_box(&mut C)));
    println!("{},sum of all entries,sinew-batch,{:.12e}", model.name, C.iter().sum::<f64>());
    if let Some(file) = arguments.get(2) {
        let bytes: Vec<u8> = q.iter().flat_map(|x| x.to_le_bytes()).collect();
        if let Err(error) = std::fs::write(file, bytes) {
            eprintln!("{file}: {error}");
            return ExitCode::from(2);
        }
    }
    ExitCode::SUCCESS
}

fn time(robot: &str, mut f: impl FnMut()) {
    let mut call = || {
        let start = Instant::now();
        f();
        start.elapsed().as_nanos() as f64 / CONFIGURATIONS as f64
    };
    let mut samples: Vec<f64> = (0..CALLS).map(|_| call()).collect();
    samples.sort_by(f64::total_cmp);
    println!("{robot},compliance,sinew-batch,{:.1},{:.1}", samples[0], samples[CALLS / 2]);
}
