//! How much each channel varies: what shares of a signal are taken of.

use sinew_effect::Sensor;

use crate::problem::Problem;
use crate::record::{Channel, Record};
use crate::series::Predicted;

/// Standard deviation of each channel over all rows; of a link encoder beside a motor's, that of the deflection.
pub(crate) fn channel_std(problem: &Problem, records: &[Record]) -> Vec<f64> {
    let layout = problem.form.layout();
    let channels = &layout.channels;
    if problem.form.is_white() {
        return filtered_std(problem, records);
    }
    let of = |(c, channel): (usize, &Channel)| {
        let values = records.iter().flat_map(|r| {
            let series = match channel.sensor {
                Sensor::JointPosition => {
                    r.measured[c].iter().zip(&r.theta[channel.dof]).map(|(q, theta)| q - theta).collect()
                }
                _ => r.measured[c].clone(),
            };
            r.rows(&series)
        });
        std(&values.collect::<Vec<_>>())
    };
    channels.iter().enumerate().map(of).collect()
}

// The same of rows of innovations: those that the whole torque, and the whole deflection, would give.
fn filtered_std(problem: &Problem, records: &[Record]) -> Vec<f64> {
    let layout = problem.form.layout();
    let mut rows: Vec<Vec<f64>> = vec![Vec::new(); layout.channels.len()];
    for record in records {
        let series: Vec<Vec<f64>> = layout
            .channels
            .iter()
            .enumerate()
            .map(|(c, channel)| match channel.sensor {
                Sensor::JointPosition => {
                    record.measured[c].iter().zip(&record.theta[channel.dof]).map(|(q, t)| q - t).collect()
                }
                _ => record.measured[c].clone(),
            })
            .collect();
        let all = record.channel_rows(&Predicted { channels: series, links: Vec::new() });
        for (rows, part) in rows.iter_mut().zip(all.chunks(all.len() / layout.channels.len().max(1))) {
            rows.extend(part);
        }
    }
    rows.iter().map(|rows| std(rows)).collect()
}

/// Standard deviation about the mean, never quite zero.
pub(crate) fn std(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt().max(1e-300)
}
