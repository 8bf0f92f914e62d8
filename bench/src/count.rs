//! What the algorithms compute: operations of one evaluation, one number at a time.

use sinew_model::samples::Random;
use sinew_model::{Counted, Model};
use sinew_rigid::*;

/// Prints the operations of every algorithm of which a bound is of interest.
pub fn print_all(model: &Model) {
    let nv = model.nv;
    let inertia = inertias::<Counted>(model);
    let b = Bodies::new(model, &inertia);
    let mut random = Random::new(1);
    let counted = |x: Vec<f64>| x.into_iter().map(Counted).collect::<Vec<_>>();
    let q = counted(random.position(model));
    let (qd, x) = (counted(random.vector(nv)), counted(random.vector(nv)));
    let room = |n: usize| vec![Counted(0.0); n];
    let mut ws = Scratch::new(model);
    let mut run = |name: &str, f: &mut dyn FnMut(&mut Scratch<Counted>)| {
        let (_, done) = Counted::operations(|| f(&mut ws));
        println!(
            "{},{name},{},{},{},{}",
            model.name, done.multiplications, done.additions, done.divisions, done.functions
        );
    };
    let (mut tau, mut M) = (room(nv), room(nv * nv));
    run("rnea", &mut |ws| inverse_dynamics_with(&b, ws, &q, &qd, &x, &mut tau));
    run("crba_full", &mut |ws| mass_matrix_with(&b, ws, &q, &mut M));
    run("aba_local", &mut |ws| forward_dynamics_with(&b, ws, &q, &qd, &x, &mut tau));
    run("minv", &mut |ws| inverse_mass_matrix_with(&b, ws, &q, &mut M));
    let mut Y = room(nv * PARAMETERS * model.joints.len());
    run("regressor", &mut |ws| regressor_with(&b, ws, &q, &qd, &x, &mut Y));
    let (mut by_velocity, mut by_torque) = (room(nv * nv), room(nv * nv));
    run("aba_derivatives", &mut |ws| {
        forward_dynamics_derivatives_with(&b, ws, &q, &qd, &x, &mut M, &mut by_velocity, &mut by_torque);
    });
}
