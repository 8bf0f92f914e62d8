//! Laws of linear models and modes.

mod lesson;
mod planar_arm;
mod robots;
mod symmetric;
