//! Laws of simulated runs.

mod controlled;
mod lesson;
mod robots;
