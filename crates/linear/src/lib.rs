//! Linearisation, modes and poles of a plant.
