//! One spring at the base instead of a beam.

/// The stiffness at the tip that a base spring gives, N/m.
///
/// ```text
/// k_tip = F/δ = k_φ/L²
/// ```
///
/// # Example
/// 4500 N·m/rad and a metre and a half give 2000 N/m:
/// ```
/// assert_eq!(sinew_flex_link::tip_stiffness(4500.0, 1.5), 2000.0);
/// ```
pub fn tip_stiffness(base_spring: f64, length: f64) -> f64 {
    base_spring / (length * length)
}

/// The base spring that deflects the tip of a cantilever under a force there as the beam does, N·m/rad.
///
/// ```text
/// k_φ = 3 E I/L
/// ```
///
/// It matches this one number: the slope at the tip is F L²/3EI then, where the beam's is F L²/2EI.
///
/// # Example
/// ```
/// assert_eq!(sinew_flex_link::base_spring(1200.0, 0.8), 4500.0);
/// ```
pub fn base_spring(flexural_rigidity: f64, length: f64) -> f64 {
    3.0 * flexural_rigidity / length
}
