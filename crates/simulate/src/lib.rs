//! Simulation of plants: stiff integration, controllers, sensor noise, energy audit.
