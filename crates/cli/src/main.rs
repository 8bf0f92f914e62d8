//! The command `sinew`: compare a robot's model with its measurements, find what is missing, watch the error fall.
#![allow(non_snake_case)]

mod add;
mod check;
mod command;
mod compare;
mod console;
mod demo;
mod diagnose;
mod discover;
mod effect_argument;
mod effects;
mod error;
mod fit;
mod fitted_robot;
mod frf;
mod info;
mod inputs;
mod linearize;
mod load_table;
mod matrix_json;
mod modes;
mod new_file;
mod noise_file;
mod output_file;
mod plot_file;
mod position_argument;
mod report;
mod rest_argument;
mod simulate;
mod stiffness;
mod stiffness_answer;
mod stiffness_measured;
mod stiffness_scan;
mod table;
mod tracking;
mod trial;
mod vector_argument;

use std::process::ExitCode;

use clap::Parser;

/// Exit status: 0 done, 1 the answer is "no", 2 wrong usage or input.
fn main() -> ExitCode {
    std::panic::set_hook(Box::new(|info| {
        let place = info.location().map_or(String::new(), |l| format!(" at {}:{}", l.file(), l.line()));
        eprintln!("internal error{place}: please report it with the command and its files ({info})");
        std::process::exit(2);
    }));
    match command::Command::parse().run() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}
