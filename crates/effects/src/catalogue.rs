//! The catalogue: one line for each effect.

use sinew_effect::Catalogue;
use sinew_flex_joint::JOINT_ELASTICITY;

/// Every physical effect that Sinew knows, in the order in which its page lists them.
///
/// # Example
/// ```
/// let entry = sinew_effects::CATALOGUE.find("coulomb_friction").unwrap();
/// assert_eq!(entry.card.parameters[0].key, "coulomb");
/// ```
pub static CATALOGUE: Catalogue = Catalogue {
    extend: |robot| sinew_flex_link::extend(robot).map_err(|error| error.to_string()),
    entries: &[
        crate::payload::ENTRY,
        crate::link_mass::ENTRY,
        crate::link_first_moment::ENTRY,
        crate::link_inertia::ENTRY,
        crate::rotor_inertia::ENTRY,
        crate::rotor_link_coupling::ENTRY,
        crate::balancer_spring::ENTRY,
        crate::base_tilt::ENTRY,
        crate::base_compliance::ENTRY,
        crate::viscous_friction::ENTRY,
        crate::coulomb_friction::ENTRY,
        crate::stribeck_friction::ENTRY,
        crate::asymmetric_friction::ENTRY,
        crate::load_dependent_friction::ENTRY,
        crate::quadratic_viscous_friction::ENTRY,
        crate::temperature_dependent_friction::ENTRY,
        crate::presliding_friction::ENTRY,
        crate::link_viscous_friction::ENTRY,
        crate::link_coulomb_friction::ENTRY,
        JOINT_ELASTICITY,
        crate::joint_stiffness_error::ENTRY,
        crate::joint_damping_error::ENTRY,
        crate::stiffness_hardening::ENTRY,
        crate::backlash::ENTRY,
        crate::transmission_hysteresis::ENTRY,
        crate::transmission_error::ENTRY,
        crate::link_bending_mode::ENTRY,
        crate::torque_constant_error::ENTRY,
        crate::actuator_lag::ENTRY,
        crate::actuator_delay::ENTRY,
        crate::torque_saturation::ENTRY,
        crate::joint_cross_coupling::ENTRY,
        crate::cogging_torque::ENTRY,
        crate::torque_ripple::ENTRY,
        crate::torque_sensor_offset::ENTRY,
        crate::position_sensor_offset::ENTRY,
        crate::position_sensor_scale::ENTRY,
        crate::torque_sensor_scale::ENTRY,
        crate::time_skew::ENTRY,
        crate::contact::ENTRY,
    ],
};
