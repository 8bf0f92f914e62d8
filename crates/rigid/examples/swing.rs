//! What it takes to hold a double pendulum level; then lets it swing for two seconds and checks its energy.

use sinew_kinematics::integrate;
use sinew_model::samples;
use sinew_rigid::{forward_dynamics, gravity, kinetic_energy, potential_energy};

fn main() {
    let arm = samples::planar_arm(2, 1.5, 0.4);
    println!("torques that hold it level: {:.3?} N·m", gravity(&arm, &[0.0, 0.0]).as_slice());

    // Semi-implicit Euler: the error of the energy falls with the step.
    let (mut q, mut qd, step) = (vec![0.0, 0.0], vec![0.0, 0.0], 1e-4);
    let start = potential_energy(&arm, &q);
    for k in 0..=20_000 {
        if k % 4_000 == 0 {
            let (kinetic, potential) = (kinetic_energy(&arm, &q, &qd), potential_energy(&arm, &q));
            println!(
                "t = {:.1} s   q = {:6.3}, {:6.3} rad   kinetic {kinetic:7.4} J   total off by {:+.1e} J",
                f64::from(k) * step,
                q[0],
                q[1],
                kinetic + potential - start
            );
        }
        let qdd = forward_dynamics(&arm, &q, &qd, &[0.0, 0.0]);
        qd.iter_mut().zip(&qdd).for_each(|(qd, qdd)| *qd += step * qdd);
        q = integrate(&arm, &q, &qd.iter().map(|qd| step * qd).collect::<Vec<_>>());
    }
}
