//! Measured runs: reading, checking, resampling, differentiation, noise.
