//! Random trees in random motion, and how numbers are compared.

use sinew_model::Model;
use sinew_model::samples::{Random, random_tree};

/// A tree and its motion.
pub struct Case {
    pub model: Model,
    pub q: Vec<f64>,
    pub qd: Vec<f64>,
    pub qdd: Vec<f64>,
}

/// Trees of 1 to 40 bodies; the seeds of the first tree and of its motion.
pub fn cases(tree: u64, motion: u64) -> impl Iterator<Item = Case> {
    (0..40).map(move |seed| {
        let model = random_tree(1 + seed as usize, seed + tree);
        let mut random = Random::new(seed + motion);
        let (q, qd, qdd) = (random.position(&model), random.vector(model.nv), random.vector(model.nv));
        Case { model, q, qd, qdd }
    })
}

/// Equal within `tolerance` of the largest number wanted, or of one.
pub fn assert_close(got: &[f64], want: &[f64], tolerance: f64) {
    let scale = want.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
    for (got, want) in got.iter().zip(want) {
        assert!((got - want).abs() <= tolerance * scale, "got {got}, want {want} of {scale}");
    }
}
