//! Where the energy of a run came from and went.

/// The energy balance of a run, J.
///
/// ```text
/// H(t) − H(0) = ∫ τ_mᵀ θ̇ dt − dissipated
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnergyAudit {
    /// H at the end less H at the start.
    pub stored_change: f64,
    /// ∫ τ_mᵀ θ̇ dt, the work of the motors.
    pub work_in: f64,
    /// The rest.
    pub dissipated: f64,
    /// The most energy that appeared between any two samples beyond the work of the motors; zero but for the
    /// integrator's error in a passive robot, however long it runs.
    pub worst_defect: f64,
}

impl EnergyAudit {
    /// The balance of stored energies and supplied work by sample.
    pub(crate) fn of(energy: &[f64], supplied: &[f64]) -> Self {
        let lost = |k: usize| (supplied[k] - supplied[0]) - (energy[k] - energy[0]);
        let (mut most, mut worst) = (0.0f64, 0.0f64);
        for k in 0..energy.len() {
            most = most.max(lost(k));
            worst = worst.max(most - lost(k));
        }
        let end = energy.len() - 1;
        Self {
            stored_change: energy[end] - energy[0],
            work_in: supplied[end] - supplied[0],
            dissipated: lost(end),
            worst_defect: worst,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn energy_that_comes_back_from_losses_is_a_defect() {
        let audit = EnergyAudit::of(&[1.0, 2.0, 1.5, 1.75], &[0.0, 3.0, 3.0, 3.0]);
        assert_eq!((audit.stored_change, audit.work_in, audit.dissipated), (0.75, 3.0, 2.25));
        assert_eq!(audit.worst_defect, 0.25);
    }
}
