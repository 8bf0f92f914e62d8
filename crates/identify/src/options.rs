//! What a user may set.

/// How runs become residual rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Residual {
    /// The measured motor motion, smoothed, is imposed; every other sensor is compared with what the model predicts.
    Imposed,
    /// Innovations of a filter about a motion that model, torque and encoders agree on: torque and encoder noise are
    /// treated together.
    Innovation,
}

/// Settings of the analyses. The defaults are those of the recognition suite.
#[derive(Debug, Clone)]
pub struct Options {
    /// At most this many effects are added.
    pub most_effects: usize,
    /// Half width of the smoothing kernel, s; none: chosen by the sample rate.
    pub smoothing: Option<f64>,
    /// Effects that explain less than this share of a channel's standard deviation are ignored.
    pub material_share: f64,
    /// Smallest z of an accepted effect.
    pub least_z: f64,
    /// Go on although a data check failed outright.
    pub force: bool,
    /// How runs become residual rows; none: as suits them.
    pub residual: Option<Residual>,
    /// Seed of the generic predictor and of the noise propagation.
    pub seed: u64,
    /// Is told what is going on, a line at a time, as searches and trials go on.
    pub progress: Option<fn(&str)>,
}

impl Options {
    pub(crate) fn tell(&self, line: &str) {
        if let Some(progress) = self.progress {
            progress(line);
        }
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            most_effects: 8,
            smoothing: None,
            material_share: 0.002,
            least_z: 4.0,
            force: false,
            residual: None,
            seed: 1,
            progress: None,
        }
    }
}
