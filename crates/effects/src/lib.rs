//! The catalogue of physical effects: one file each.
