//! The imposed residual's prediction: the measured motor motion goes in, every other sensor comes out.

use sinew_effect::{Kind, Wide};
use sinew_model::Lanes;
use sinew_plant::{Dynamics, Plant};
use sinew_rigid::{Bodies, Scratch, inertias, mass_matrix_with};

use crate::record::{Channel, Record, Reduction};
use crate::series::Series;
use crate::walk::Walk;

// A spring is simulated while its mode turns by less than this in a grid step; a stiffer one follows its load.
const FASTEST_TURN: f64 = 0.7;

// The same about a reference that the model has smoothed: it has no noise that a coarse step would let through.
const FASTEST_TURN_ABOUT_MODEL: f64 = 1.5;

/// The degrees of freedom that move with their motor in this plant: rigid ones, and springs too stiff for the grid.
pub(crate) fn imposed_dofs(plant: &Plant, p: &[f64], record: &Record) -> Vec<bool> {
    let most = match record.reduction {
        Reduction::Kernel | Reduction::Thinned(_) => FASTEST_TURN,
        Reduction::Mean | Reduction::Innovations(_) => FASTEST_TURN_ABOUT_MODEL,
    };
    let turns = turns(plant, p, record);
    turns.into_iter().map(|turn| !turn.is_some_and(|turn| turn < most)).collect()
}

// By how much the mode of each spring against its own link turns in a grid step, ω h; none of rigid joints.
fn turns(plant: &Plant, p: &[f64], record: &Record) -> Vec<Option<f64>> {
    let nv = plant.model().nv;
    let dynamics = Dynamics::new(plant, p);
    let middle = record.len() / 2;
    let q: Vec<f64> = record.theta.iter().map(|t| t[middle]).collect();
    let bodies_inertia = inertias::<f64>(plant.model());
    let armature = vec![0.0; nv];
    let bodies = Bodies {
        model: plant.model(),
        inertia: &bodies_inertia,
        gravity: plant.model().gravity,
        armature: &armature,
    };
    let mut mass = vec![0.0; nv * nv];
    mass_matrix_with(&bodies, &mut Scratch::new(plant.model()), &q, &mut mass);
    let mut stiffness: Vec<f64> = dynamics
        .coefficients()
        .compliance
        .iter()
        .map(|&c| if c > 0.0 { 1.0 / c } else { f64::INFINITY })
        .collect();
    for coupling in plant.couplings() {
        let n = coupling.dofs.len();
        for (k, &dof) in coupling.dofs.iter().enumerate() {
            stiffness[dof] = coupling.stiffness[k * n + k];
        }
    }
    (0..nv)
        .map(|i| {
            let omega = (stiffness[i] / mass[i * nv + i].max(1e-12)).sqrt();
            plant.elastic()[i].then_some(omega * record.scales.step())
        })
        .collect()
}

/// Predicted channels on the grid, in any kind of number.
pub(crate) fn predict<S: Kind>(
    plant: &Plant,
    p: &[S],
    record: &Record,
    channels: &[Channel],
    imposed: &[bool],
) -> Vec<Vec<S>> {
    let (series, dynamics) = walked(plant, p, record, channels, imposed);
    series.logged(&dynamics, record.scales.step())
}

/// [`predict`] for several sets of parameters in one walk. A parameter must be zero in all sets or in none.
pub(crate) fn predict_lanes(
    plant: &Plant,
    sets: &[Vec<f64>],
    record: &Record,
    channels: &[Channel],
    imposed: &[bool],
) -> Vec<Vec<Vec<f64>>> {
    let lane = |k: usize| &sets[k.min(sets.len() - 1)];
    let p: Vec<Wide> = (0..sets[0].len()).map(|i| Lanes(std::array::from_fn(|k| lane(k)[i]))).collect();
    let (series, _) = walked(plant, &p, record, channels, imposed);
    let logged =
        |(k, p): (usize, &Vec<f64>)| series.lane(k).logged(&Dynamics::new(plant, p), record.scales.step());
    sets.iter().enumerate().map(logged).collect()
}

fn walked<'a, S: Kind>(
    plant: &'a Plant,
    p: &[S],
    record: &'a Record,
    channels: &'a [Channel],
    imposed: &'a [bool],
) -> (Series<'a, S>, Dynamics<'a, S>) {
    let mut walk = Walk::new(Dynamics::new(plant, p), record, imposed);
    let mut series = Series::new(channels, plant.model().nv, record.len());
    // Where every spring is slow on a fine grid, one step of the springs serves two of the motors.
    let values: Vec<f64> = p.iter().map(|x| x.value()).collect();
    let is_slow = |turn: &Option<f64>| turn.is_some_and(|turn| 2.0 * turn < FASTEST_TURN);
    let about_model = matches!(record.reduction, Reduction::Mean | Reduction::Innovations(_));
    let in_pairs =
        about_model && imposed.iter().all(|i| !i) && turns(plant, &values, record).iter().all(is_slow);
    let mut k = 0;
    while k < record.len() {
        walk.torque(k);
        series.store(&walk.dynamics, &walk.x, imposed, &walk.out, &walk.actuation);
        let left = record.len() - 1 - k;
        if in_pairs && left > 1 {
            walk.two_steps(k, |w| series.store(&w.dynamics, &w.x, imposed, &w.out, &w.actuation));
            k += 2;
        } else {
            if left > 0 {
                walk.step(k);
            }
            k += 1;
        }
    }
    (series, walk.dynamics)
}
