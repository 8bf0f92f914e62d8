//! Where a model fails: conditional means of its residual, in sentences. Views, not causes.

use crate::colour::rows_of;
use crate::report::Finding;
use crate::search::Search;

// A sentence is printed if its statistic is this large, it carries this share of the variance …
const LEAST_T: f64 = 4.0;
const LEAST_SHARE: f64 = 0.05;
// … and the channel is this far above its floor.
const ABOVE_FLOOR: f64 = 1.3;
// Most sentences for a channel.
const MOST: usize = 3;

struct View {
    regime: &'static str,
    of: fn(&Instant) -> f64,
    // Sentence from the size of the coefficient with its standard error and the unit.
    sentence: fn(&str, &str, f64, f64, &str) -> String,
}

/// At most three sentences for each channel above its floor, the largest share first.
pub(crate) fn findings(search: &Search, residual: &[f64], floors: &[f64]) -> Vec<Finding> {
    let layout = search.problem.form.layout();
    let robot = &search.problem.robot.model;
    let mut found = Vec::new();
    for (c, channel) in layout.channels.iter().enumerate() {
        let rows: Vec<usize> = rows_of(layout, c).collect();
        let mut left: Vec<f64> = rows.iter().map(|&k| residual[k]).collect();
        let total: f64 = left.iter().map(|x| x * x).sum();
        let rms = (total / rows.len().max(1) as f64).sqrt();
        if rms < ABOVE_FLOOR * floors[c] {
            continue;
        }
        let (joint, signal, unit) =
            (robot.dof_name(channel.dof), channel.signal().replace('_', " "), channel.unit(robot));
        let mut views = views(search, c);
        let mut said = 0;
        while said < MOST && !views.is_empty() {
            // The view that carries most of what is left; the stronger is taken out first.
            let shares: Vec<f64> = views.iter().map(|(_, column)| explained(column, &left, &rows)).collect();
            let best = (0..shares.len()).max_by(|&a, &b| shares[a].total_cmp(&shares[b])).unwrap_or(0);
            let (view, column) = views.swap_remove(best);
            let share = shares[best] / total;
            if share < LEAST_SHARE {
                break;
            }
            let blocks: Vec<usize> = rows.iter().map(|&k| layout.block[k]).collect();
            let (slope, error) = regression(&column, &left, &rows, &blocks);
            for (x, &k) in left.iter_mut().zip(&rows) {
                *x -= slope * column[k];
            }
            if slope.abs() > LEAST_T * error {
                let mut statement = (view.sentence)(joint, &signal, slope, error, unit);
                statement.push_str(&format!(" ({:.0} % of the squared error)", 100.0 * share));
                found.push(Finding {
                    joint: joint.to_owned(),
                    signal: channel.signal().to_owned(),
                    regime: view.regime.to_owned(),
                    statement,
                    share,
                });
                said += 1;
            }
        }
        found.extend(one_run(search, residual, c, joint, &signal));
    }
    found
}

// The columns of all views of a channel.
fn views(search: &Search, c: usize) -> Vec<(&'static View, Vec<f64>)> {
    let layout = search.problem.form.layout();
    let dof = layout.channels[c].dof;
    let column = |view: &View| -> Vec<f64> {
        let mut out = vec![0.0; layout.len];
        for s in layout.of_channel(c) {
            let record = &search.records[s.record];
            let series: Vec<f64> = (0..record.len())
                .map(|k| {
                    (view.of)(&Instant {
                        position: record.theta[dof][k],
                        velocity: record.thetad[dof][k],
                        acceleration: record.thetadd[dof][k],
                        measured: record.measured[c][k],
                    })
                })
                .collect();
            out[s.first..s.first + s.len].copy_from_slice(&record.rows(&series));
        }
        out
    };
    VIEWS.iter().map(|view| (view, column(view))).collect()
}

// What a view looks at.
struct Instant {
    position: f64,
    velocity: f64,
    acceleration: f64,
    measured: f64,
}

static VIEWS: [View; 10] = [
    View {
        regime: "sign of velocity",
        of: |x| (x.velocity / 3e-3).tanh(),
        sentence: |j, s, a, e, u| {
            format!(
                "{j}, {s}: jumps by {} {u} where the velocity changes sign, flat elsewhere",
                pair(2.0 * a, 2.0 * e)
            )
        },
    },
    View {
        regime: "velocity",
        of: |x| x.velocity,
        sentence: |j, s, a, e, u| {
            format!("{j}, {s}: grows with velocity, {} {u} per unit of speed", pair(a, e))
        },
    },
    View {
        regime: "slow motion",
        of: |x| (x.velocity / 3e-3).tanh() * (-(x.velocity / 0.06).powi(2)).exp(),
        sentence: |j, s, a, e, u| {
            format!(
                "{j}, {s}: {} {u} more against the motion when slow (below 0.06 per s) than when fast",
                pair(a, e)
            )
        },
    },
    View {
        regime: "size of velocity",
        of: |x| x.velocity.abs(),
        sentence: |j, s, a, e, u| {
            format!(
                "{j}, {s}: grows with speed alike in both directions, {} {u} per unit of speed",
                pair(a, e)
            )
        },
    },
    View {
        regime: "constant",
        of: |_| 1.0,
        sentence: |j, s, a, e, u| format!("{j}, {s}: off by {} {u} throughout", pair(a, e)),
    },
    View {
        regime: "acceleration",
        of: |x| x.acceleration,
        sentence: |j, s, a, e, u| {
            format!("{j}, {s}: in proportion to acceleration, {} {u} per unit", pair(a, e))
        },
    },
    View {
        regime: "position",
        of: |x| x.position,
        sentence: |j, s, a, e, u| format!("{j}, {s}: changes with position, {} {u} per unit", pair(a, e)),
    },
    View {
        regime: "cosine of position",
        of: |x| x.position.cos(),
        sentence: |j, s, a, e, u| {
            format!("{j}, {s}: follows the cosine of position like a weight, {} {u}", pair(a, e))
        },
    },
    View {
        regime: "sine of position",
        of: |x| x.position.sin(),
        sentence: |j, s, a, e, u| {
            format!("{j}, {s}: follows the sine of position like a weight, {} {u}", pair(a, e))
        },
    },
    View {
        regime: "in proportion",
        of: |x| x.measured,
        sentence: |j, s, a, e, _| {
            format!("{j}, {s}: in proportion to the signal itself, {} of it", pair(a, e))
        },
    },
];

// One run that carries most of the error.
fn one_run(search: &Search, residual: &[f64], c: usize, joint: &str, signal: &str) -> Option<Finding> {
    let layout = search.problem.form.layout();
    if search.records.len() < 2 {
        return None;
    }
    let square = |r: usize| -> (f64, f64) {
        let rows = layout.of_channel(c).filter(|s| s.record == r).flat_map(|s| s.first..s.first + s.len);
        rows.filter(|&k| layout.keep[k])
            .fold((0.0, 0.0), |(sum, n), k| (sum + residual[k] * residual[k], n + 1.0))
    };
    let all: Vec<(f64, f64)> = (0..search.records.len()).map(square).collect();
    let (sum, n): (f64, f64) = all.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
    let (worst, &(part, rows)) = all.iter().enumerate().max_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    let (share, fair) = (part / sum, rows / n);
    (share > 0.6 && share > 2.0 * fair).then(|| Finding {
        joint: joint.to_owned(),
        signal: layout.channels[c].signal().to_owned(),
        regime: search.records[worst].name.clone(),
        statement: format!(
            "{joint}, {signal}: {:.0} % of the squared error lies in run {} ({:.0} % of the data)",
            100.0 * share,
            search.records[worst].name,
            100.0 * fair
        ),
        share,
    })
}

// Squared residual that one column explains.
fn explained(column: &[f64], left: &[f64], rows: &[usize]) -> f64 {
    let (mut xx, mut xy) = (0.0, 0.0);
    for (y, &k) in left.iter().zip(rows) {
        xx += column[k] * column[k];
        xy += column[k] * y;
    }
    if xx > 0.0 { xy * xy / xx } else { 0.0 }
}

// Slope and its block-robust standard error.
fn regression(column: &[f64], left: &[f64], rows: &[usize], blocks: &[usize]) -> (f64, f64) {
    let xx: f64 = rows.iter().map(|&k| column[k] * column[k]).sum();
    if xx <= 0.0 {
        return (0.0, f64::INFINITY);
    }
    let slope = left.iter().zip(rows).map(|(y, &k)| column[k] * y).sum::<f64>() / xx;
    let mut meat = 0.0;
    let mut at = 0;
    while at < rows.len() {
        let block = blocks[at];
        let mut sum = 0.0;
        while at < rows.len() && blocks[at] == block {
            sum += column[rows[at]] * (left[at] - slope * column[rows[at]]);
            at += 1;
        }
        meat += sum * sum;
    }
    (slope, meat.sqrt() / xx)
}

// "4.1 ± 0.1": two digits of the error.
fn pair(value: f64, error: f64) -> String {
    let digits = if error > 0.0 && error.is_finite() {
        (1.0 - error.log10().floor()).clamp(0.0, 12.0) as usize
    } else {
        3
    };
    if value != 0.0 && value.abs() < 1e-3 {
        format!("{value:.2e} ± {error:.0e}")
    } else {
        format!("{value:.digits$} ± {error:.digits$}")
    }
}
