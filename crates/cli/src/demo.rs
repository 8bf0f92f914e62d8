//! `sinew demo`: the whole loop on an embedded arm with a hidden effect.

mod bench;

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;
use sinew_data::Run;
use sinew_effects::CATALOGUE;
use sinew_identify::{Comparison, Diagnosis, Fit, Options, StepReport, compare, discover};
use sinew_model::Robot;
use sinew_report::{ReportInput, effect_in_words, number};
use sinew_urdf::{RobotFile, read_robot};

use crate::console::Console;
use crate::error::CliError;
use crate::fitted_robot::with_effects;
use crate::output_file;
use crate::report::write_page;
use crate::table::at_place;
use bench::Program;

/// Arguments of `sinew demo`.
#[derive(Debug, Args)]
pub(crate) struct Demo {
    /// Where its files go
    #[arg(long, default_value = "sinew-demo")]
    dir: PathBuf,
}

const URDF: &str = include_str!("demo/arm.urdf");
const SIDECAR: &str = include_str!("demo/arm.sinew.toml");
// What is written into the folder; a .run.toml stands beside every run.
const FILES: [&str; 10] = [
    "arm.urdf",
    "arm.sinew.toml",
    "waves.csv",
    "waves.run.toml",
    "swings.csv",
    "swings.run.toml",
    "unseen.csv",
    "unseen.run.toml",
    "better.sinew.toml",
    "report.html",
];

impl Demo {
    pub fn run(&self, console: &Console) -> Result<(), CliError> {
        let (file, seen, unseen) = self.prepare(console)?;
        let robot = &file.robot;
        console.tell(&introduction(&self.dir))?;

        console.tell(
            "\n1 · COMPARE: does the model agree with the measurement? (the run that no fit will see)\n",
        )?;
        let before = comparison(robot, &unseen)?;
        console.tell(&crate::compare::text(&before))?;

        console.tell("2 · DIAGNOSE: which effect is missing?\n")?;
        console.say("   searching the catalogue …");
        let found = discover(robot, &CATALOGUE, &seen, &unseen, &Options::default())?;
        let diagnosis = &found.diagnosis;
        console.tell(&crate::diagnose::text(diagnosis, false))?;

        let names: Vec<String> = diagnosis.accepted.iter().map(|a| at_place(&a.effect, &a.place)).collect();
        console.tell(&format!(
            "3 · ADD {} AND FIT to two runs; the third is only looked at.\n",
            names.join(", ")
        ))?;
        output_file::write(&file.sidecar, &found.specs, &self.dir.join("better.sinew.toml"))?;
        console.tell(&crate::fit::text(&found))?;

        console.tell("4 · COMPARE again, on the run that no fit has seen.\n")?;
        let after = comparison(&with_effects(robot, &found.specs), &unseen)?;
        console.tell(&crate::compare::text(&after))?;

        let page = self.dir.join("report.html");
        let names_unseen: Vec<String> = unseen.iter().map(|r| r.name.clone()).collect();
        let input = ReportInput {
            robot,
            unseen: &names_unseen,
            before: &before,
            diagnosis,
            fit: Some(&found),
            after: Some(&after),
        };
        write_page(&input, &page)?;
        let (first, last) = unseen_errors(&found);
        console.tell(&conclusion(diagnosis, first, last))?;
        console.tell(&self.epilogue(&names))?;
        let answer = json!({
            "hidden": bench::HIDDEN, "fit": found,
            "unseen_rms_error": { "before": first, "after": last }, "noise_floor": 1.0,
            "report": page.display().to_string(),
        });
        if console.json { console.answer(&answer, String::new) } else { Ok(()) }
    }

    // Writes the arm and its runs: two to fit, one of another motion to check on.
    fn prepare(&self, console: &Console) -> Result<(RobotFile, Vec<Run>, Vec<Run>), CliError> {
        self.check_folder()?;
        std::fs::create_dir_all(&self.dir)
            .map_err(|source| CliError::Write { path: self.dir.clone(), source })?;
        self.write("arm.urdf", URDF)?;
        self.write("arm.sinew.toml", SIDECAR)?;
        let file = read_robot(&self.dir.join("arm.sinew.toml"))?;
        console.say("   moving the arm …");
        let mut runs = Vec::new();
        for (name, program) in
            [("waves", Program::Waves), ("swings", Program::Swings), ("unseen", Program::Places)]
        {
            let run = bench::run(&file.robot, name, program)?;
            run.write_csv(&self.dir.join(format!("{name}.csv")))?;
            self.write(&format!("{name}.run.toml"), &bench::sensors())?;
            runs.push(run);
        }
        let unseen = runs.split_off(2);
        Ok((file, runs, unseen))
    }

    // Refuses a folder that holds files of these names that are not of the demo: they would be lost. Runs are of the demo where the
    // robot is.
    fn check_folder(&self) -> Result<(), CliError> {
        let is = |name: &str, text: &str| {
            std::fs::read(self.dir.join(name)).is_ok_and(|bytes| bytes == text.as_bytes())
        };
        let (urdf, sidecar) = (is("arm.urdf", URDF), is("arm.sinew.toml", SIDECAR));
        let is_ours = |name: &str| match name {
            "arm.urdf" => urdf,
            "arm.sinew.toml" => sidecar,
            _ => urdf && sidecar,
        };
        let mut others = FILES.iter().filter(|name| !is_ours(name)).map(|name| self.dir.join(name));
        others.find(|path| path.exists()).map_or(Ok(()), |path| {
            let what = "is there, is not the demo's, and would be replaced";
            Err(CliError::usage(path.display().to_string(), what, "give another folder with --dir"))
        })
    }

    fn write(&self, name: &str, text: &str) -> Result<(), CliError> {
        let path = self.dir.join(name);
        std::fs::write(&path, text).map_err(|source| CliError::Write { path, source })
    }

    fn epilogue(&self, names: &[String]) -> String {
        let at = |file: &str| self.dir.join(file).display().to_string();
        let (robot, waves, swings, unseen) =
            (at("arm.sinew.toml"), at("waves.csv"), at("swings.csv"), at("unseen.csv"));
        let (better, page, add) = (at("better.sinew.toml"), at("report.html"), names.join(" "));
        format!(
            "Look at {page}. Every step by hand:\n\
             \n  sinew compare  {robot} {unseen}\
             \n  sinew diagnose {robot} {waves} {swings}\
             \n  sinew fit      {robot} {waves} {swings} --add {add} --check {unseen} -o {better}\
             \n  sinew compare  {better} {unseen}\
             \n\n(`sinew` is target/release/sinew, or on your path after `cargo install --path crates/cli`.)\
             \n\nOr all at once: sinew discover {robot} {waves} {swings} --check {unseen} -o {better}"
        )
    }
}

fn comparison(robot: &Robot, runs: &[Run]) -> Result<Comparison, CliError> {
    Ok(compare(robot, &CATALOGUE, runs, &Options::default())?)
}

fn introduction(dir: &Path) -> String {
    format!(
        "An arm with two elastic joints has a model: arm.urdf, and arm.sinew.toml for what a URDF cannot say.\n\
         Three runs were logged: waves and swings to fit, unseen (another motion) to check on. All files: {}\n\
         The true arm is not quite its model: springs, rotors and friction are off by half their tolerance,\n\
         and one effect is hidden.",
        dir.display()
    )
}

// The error on the unseen run, of the model as given and of the fitted one, in noise floors.
fn unseen_errors(fit: &Fit) -> (f64, f64) {
    let of = |step: Option<&StepReport>| step.and_then(|s| s.check_rms_error).unwrap_or(f64::NAN);
    (of(fit.steps.first()), of(fit.steps.last()))
}

fn conclusion(diagnosis: &Diagnosis, before: f64, after: f64) -> String {
    let (hidden, place) = bench::HIDDEN.split_once('@').unwrap_or((bench::HIDDEN, ""));
    let named: Vec<_> = diagnosis.accepted.iter().map(|a| effect_in_words(&a.effect, &a.place)).collect();
    format!(
        "Hidden was {}; named was {}.\nOn the unseen run the error fell from {} to {} noise floors: {}\n",
        effect_in_words(hidden, place),
        if named.is_empty() { "nothing".to_owned() } else { named.join(", ") },
        number(before),
        number(after),
        if after < 1.1 { "as good as these sensors can show." } else { "something is still missing." }
    )
}
