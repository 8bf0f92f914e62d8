//! A robot model and its physical effects as one dynamic system: forces, sensors, energy.
