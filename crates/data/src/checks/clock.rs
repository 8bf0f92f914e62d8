//! Whether a log was polled by a clock of its own, apart from that of the robot.

use crate::statistics::median;

/// Samples slower than this share of the top speed say nothing about time.
const FAST: f64 = 0.3;
/// Fast steps needed for a statement.
const FEWEST: usize = 50;
/// Distance from a whole tick that counts as on it, ticks.
const NEAR: f64 = 0.1;
/// Share of the steps that must lie on whole ticks, and share that must be no single tick.
const ON_TICKS: f64 = 0.9;
const NOT_ONE: f64 = 0.02;

/// Whether the time that passed for the robot between two rows comes in whole ticks, while the stamps do not.
///
/// ```text
/// u_k = Δq_k / q̇_k = m_k · tick,   m_k = 0, 1, 2, …        while Δt_k ≠ m_k · tick
/// ```
pub(super) fn repeats_or_skips_ticks(time: &[f64], q: &[f64], qd: &[f64]) -> bool {
    let top = qd.iter().fold(0.0, |top: f64, v| top.max(v.abs()));
    // (time passed by the motion, time passed by the stamps) of the fast steps
    let passed: Vec<(f64, f64)> = (1..q.len())
        .map(|k| (q[k] - q[k - 1], 0.5 * (qd[k] + qd[k - 1]), time[k] - time[k - 1]))
        .filter(|(_, v, _)| v.abs() > FAST * top)
        .map(|(dq, v, dt)| (dq / v, dt))
        .collect();
    let tick = median(passed.iter().map(|p| p.0).filter(|u| *u > 0.0).collect());
    if passed.len() < FEWEST || tick <= 0.0 {
        return false;
    }
    let share = |test: &dyn Fn(f64, f64) -> bool| {
        passed.iter().filter(|(u, dt)| test(u / tick, dt / tick)).count() as f64 / passed.len() as f64
    };
    let on_ticks = share(&|u, _| (u - u.round()).abs() < NEAR);
    let not_one = share(&|u, _| u.round() != 1.0);
    let stamps_on_ticks = share(&|u, dt| (dt - u.round()).abs() < NEAR);
    on_ticks > ON_TICKS && not_one > NOT_ONE && stamps_on_ticks < ON_TICKS
}
