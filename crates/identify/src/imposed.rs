//! The imposed residual's prediction: the measured motor motion goes in, every other sensor comes out.

use sinew_effect::{Kind, Wide};
use sinew_model::Lanes;
use sinew_plant::{Dynamics, Plant};

use crate::freedom::Freedom;
use crate::record::{Channel, Record};
use crate::series::{Predicted, Series};
use crate::walk::Walk;

/// Predicted channels on the grid, in any kind of number.
pub(crate) fn predict<S: Kind>(
    plant: &Plant,
    p: &[S],
    record: &Record,
    channels: &[Channel],
    freedom: &Freedom,
) -> Predicted<S> {
    let (series, dynamics) = walked(plant, p, record, channels, freedom);
    series.logged(&dynamics, record.scales.step())
}

/// [`predict`] for several sets of parameters in one walk. A parameter must be zero in all sets or in none.
pub(crate) fn predict_lanes(
    plant: &Plant,
    sets: &[Vec<f64>],
    record: &Record,
    channels: &[Channel],
    freedom: &Freedom,
) -> Vec<Predicted<f64>> {
    let lane = |k: usize| &sets[k.min(sets.len() - 1)];
    let p: Vec<Wide> = (0..sets[0].len()).map(|i| Lanes(std::array::from_fn(|k| lane(k)[i]))).collect();
    let (series, _) = walked(plant, &p, record, channels, freedom);
    let logged =
        |(k, p): (usize, &Vec<f64>)| series.lane(k).logged(&Dynamics::new(plant, p), record.scales.step());
    sets.iter().enumerate().map(logged).collect()
}

fn walked<'a, S: Kind>(
    plant: &'a Plant,
    p: &[S],
    record: &'a Record,
    channels: &'a [Channel],
    freedom: &'a Freedom,
) -> (Series<'a, S>, Dynamics<'a, S>) {
    let mut walk = Walk::new(Dynamics::new(plant, p), record, freedom);
    let mut series = Series::new(channels, plant.model().nv, record);
    for k in 0..record.len() {
        walk.torque(k);
        series.store(&walk.dynamics, &walk.x, freedom, &walk.out, &walk.actuation);
        if k + 1 < record.len() {
            walk.step(k);
        }
    }
    (series, walk.dynamics)
}
