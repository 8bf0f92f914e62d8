//! Regimes of motion: when and where an error is large.

use crate::channel::{Channel, extent};

/// A regime and the root mean square of the residual in it, before and after.
pub(crate) struct Regime {
    pub name: String,
    pub before: f64,
    pub after: Option<f64>,
}

/// The regimes of a channel that have enough samples.
///
/// Slow and fast are the slowest and the fastest fifth of the samples; at reversal is |q̇| below 2 % of its largest.
pub(crate) fn regimes(before: &Channel, after: Option<&Channel>, runs: &[String]) -> Vec<Regime> {
    let (slow, fast, still) = speeds(&before.speed);
    let (low, high) = extent(&before.position);
    let third = (high - low) / 3.0;
    let mut masks: Vec<(String, Mask)> = vec![
        ("moving up".into(), Box::new(move |c, k| c.speed[k] > still)),
        ("moving down".into(), Box::new(move |c, k| c.speed[k] < -still)),
        ("at reversal".into(), Box::new(move |c, k| c.speed[k].abs() <= still)),
        ("slow".into(), Box::new(move |c, k| c.speed[k].abs() <= slow)),
        ("fast".into(), Box::new(move |c, k| c.speed[k].abs() >= fast)),
        ("low position".into(), Box::new(move |c, k| c.position[k] < low + third)),
        ("high position".into(), Box::new(move |c, k| c.position[k] > high - third)),
        ("first third of time".into(), Box::new(|c, k| c.progress[k] < 1.0 / 3.0)),
        ("last third of time".into(), Box::new(|c, k| c.progress[k] > 2.0 / 3.0)),
    ];
    if runs.len() > 1 {
        for (index, run) in runs.iter().enumerate() {
            masks.push((format!("run {run}"), Box::new(move |c, k| c.run[k] == index)));
        }
    }
    let rms = |mask: &Mask, channel: &Channel| channel.rms_where(|k| mask(channel, k));
    let regime = |(name, mask): (String, Mask)| {
        let before = rms(&mask, before)?;
        Some(Regime { name, before, after: after.and_then(|c| rms(&mask, c)) })
    };
    masks.into_iter().filter_map(regime).collect()
}

type Mask = Box<dyn Fn(&Channel, usize) -> bool>;

// The slowest and fastest fifth, and the speed below which the joint counts as reversing.
fn speeds(speed: &[f64]) -> (f64, f64, f64) {
    let mut sizes: Vec<f64> = speed.iter().map(|v| v.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let at = |p| crate::bins::quantile(&sizes, p);
    (at(0.2), at(0.8), 0.02 * at(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_in_one_direction_shows_in_that_regime_only() {
        let speed: Vec<f64> = (0..200).map(|k| (f64::from(k) * 0.1).sin()).collect();
        let channel = Channel {
            residual: speed.iter().map(|v| if *v > 0.0 { 2.0 } else { 0.0 }).collect(),
            position: speed.clone(),
            progress: (0..200).map(|k| f64::from(k) / 200.0).collect(),
            run: vec![0; 200],
            speed,
        };
        let found = regimes(&channel, None, &[]);
        let of = |name: &str| found.iter().find(|r| r.name == name).map(|r| r.before);
        assert_eq!((of("moving up"), of("moving down")), (Some(2.0), Some(0.0)));
    }
}
