//! What commands read: a robot, and runs through a columns map.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use sinew_data::{ColumnMap, Run, RunSpec, rebuild_clock};
use sinew_effect::{Entry, PlaceKind, Role};
use sinew_effects::CATALOGUE;
use sinew_identify::{Options, Residual};
use sinew_plant::{Plant, PlantError};
use sinew_urdf::{KindWords, Note, RobotFile, Vocabulary, read_robot};

use crate::console::Console;
use crate::error::CliError;

/// The robot and its runs, as most verbs take them.
#[derive(Debug, Args)]
pub(crate) struct Inputs {
    /// Sidecar or URDF
    pub robot: PathBuf,
    /// Measured runs, each FILE or FILE@FROM..TO (s after its first time stamp); FILE#N: the Nth recording of a file
    #[arg(required = true, value_name = "RUN")]
    pub runs: Vec<RunSpec>,
    #[command(flatten)]
    pub columns: Columns,
    /// Go on although a data check failed
    #[arg(long)]
    force: bool,
    /// How runs become residuals; default: as suits them, and the scope says which and why
    #[arg(long, value_enum)]
    residual: Option<ResidualName>,
}

/// The residuals by name.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum ResidualName {
    /// The smoothed motor motion is imposed, other sensors are compared
    Imposed,
    /// Innovations of a filter that treats torque and encoder noise together
    Innovation,
}

/// The file that says what a robot is: its sidecar, or the URDF where there is none.
pub(crate) fn name(file: &RobotFile) -> String {
    let sidecar = file.sidecar.file();
    let urdf = sidecar.strip_suffix(".sinew.toml").map(|stem| format!("{stem}.urdf"));
    match urdf {
        Some(urdf) if !Path::new(sidecar).exists() && Path::new(&urdf).exists() => urdf,
        _ => sidecar.to_owned(),
    }
}

/// How the columns of a log are called.
#[derive(Debug, Args)]
pub(crate) struct Columns {
    /// Names, scales and offsets of the columns of the runs (TOML)
    #[arg(long, value_name = "MAP")]
    columns: Option<PathBuf>,
    /// Rebuild the clock of the runs from their logged velocities: where a log repeats or skips ticks
    #[arg(long)]
    rebuild_clock: bool,
}

impl Inputs {
    /// The settings of the analyses; the console is told how they get on.
    pub fn options(&self, console: &Console) -> Options {
        let residual = self.residual.map(|name| match name {
            ResidualName::Imposed => Residual::Imposed,
            ResidualName::Innovation => Residual::Innovation,
        });
        Options { force: self.force, residual, progress: console.progress(), ..Options::default() }
    }

    /// All files that the command reads, with the runs that nothing is fitted to.
    pub fn files(&self, check: &[RunSpec]) -> Vec<PathBuf> {
        let runs = self.runs.iter().chain(check).flat_map(RunSpec::files);
        runs.chain([self.robot.clone()]).chain(self.columns.columns.clone()).collect()
    }

    /// Reads robot and runs; what is suspicious about their reading goes to standard error.
    pub fn read(&self, console: &Console) -> Result<(RobotFile, Vec<Run>), CliError> {
        let robot = robot(&self.robot)?;
        for note in &robot.notes {
            console.say(&note.to_string());
        }
        let runs = self.columns.read_pieces(&self.runs)?;
        for note in runs.iter().flat_map(|r| &r.notes) {
            console.say(&note.to_string());
        }
        Ok((robot, runs))
    }
}

impl Columns {
    /// Reads runs through the map, if there is one.
    pub fn read(&self, runs: &[RunSpec]) -> Result<Vec<Run>, CliError> {
        self.read_each(runs)?.into_iter().collect()
    }

    /// Reads runs through the map, each in the stretches between its gaps.
    pub fn read_pieces(&self, runs: &[RunSpec]) -> Result<Vec<Run>, CliError> {
        Ok(self.read(runs)?.into_iter().flat_map(Run::pieces).collect())
    }

    /// Reads runs through the map, with what is wrong with each.
    pub fn read_each(&self, runs: &[RunSpec]) -> Result<Vec<Result<Run, CliError>>, CliError> {
        if let Some(twice) = (1..runs.len()).find(|&k| runs[..k].contains(&runs[k])) {
            return Err(CliError::usage(
                runs[twice].path.display().to_string(),
                "is named twice: what it shows would count twice, and its noise as if it were two",
                "name every run once",
            ));
        }
        for run in runs {
            refuse(&run.path, ROBOTS, "is a robot, and a run is wanted here")?;
        }
        let map = self.columns.as_deref().map(ColumnMap::read).transpose()?;
        let read = |spec: &RunSpec| self.on_its_clock(spec.read(map.as_ref())?);
        // Files of one name are told apart by their folders.
        let of_same_name = |spec: &RunSpec| {
            let is_other = |other: &RunSpec| other.path != spec.path;
            runs.iter().any(|other| is_other(other) && other.path.file_name() == spec.path.file_name())
        };
        let folder = |spec: &RunSpec| {
            let folder = spec.path.parent()?.file_name()?;
            of_same_name(spec).then(|| folder.to_string_lossy().into_owned())
        };
        let named = |spec: &RunSpec| {
            let run = read(spec)?;
            Ok(match folder(spec) {
                Some(folder) => run.in_folder(&folder),
                None => run,
            })
        };
        Ok(runs.iter().map(named).collect())
    }

    fn on_its_clock(&self, run: Run) -> Result<Run, CliError> {
        if !self.rebuild_clock {
            return Ok(run);
        }
        let (mut rebuilt, note) = rebuild_clock(&run).ok_or_else(|| {
            CliError::usage(
                &run.name,
                "its clock cannot be rebuilt: no joint has a logged velocity and moves most of the time",
                "leave --rebuild-clock out",
            )
        })?;
        rebuilt.notes.push(note);
        Ok(rebuilt)
    }
}

// How the files of runs and of robots end.
pub(crate) const RUNS: &[&str] = &[".csv", ".csv.gz", ".parquet"];
const ROBOTS: &[&str] = &[".urdf", ".sinew.toml"];

/// True of the name of a file that ends in one of these ways.
pub(crate) fn ends(name: &str, endings: &[&str]) -> bool {
    endings.iter().any(|end| name.ends_with(end))
}

// Arguments in each other's place.
fn refuse(path: &Path, endings: &[&str], what: &str) -> Result<(), CliError> {
    let name = path.display().to_string();
    match ends(&name, endings) {
        true => Err(CliError::usage(name, what, "the robot comes first, then its runs: ROBOT RUN…")),
        false => Ok(()),
    }
}

/// Reads a robot and makes sure that the catalogue has its effects and a plant can be made of it.
pub(crate) fn robot(path: &Path) -> Result<RobotFile, CliError> {
    refuse(path, RUNS, "is a run, and a robot is wanted here")?;
    let mut file = read_robot(path)?;
    let notes = check_effects(&file)?;
    file.notes.extend(notes);
    Ok(file)
}

/// Refuses effects that the catalogue does not have, cannot place or cannot give their values; tells of those that do nothing.
fn check_effects(file: &RobotFile) -> Result<Vec<Note>, CliError> {
    let once = |e: &'static Entry| e.card.parameters.iter().filter(|p| p.component.unwrap_or(0) == 0);
    let words_of = |e: &'static Entry| -> (&'static Entry, Vec<&str>, Vec<&str>) {
        let keys = once(e).map(|p| p.key).chain(e.words.iter().copied()).collect();
        let strengths = once(e).filter(|p| p.role == Role::Strength).map(|p| p.key).collect();
        (e, keys, strengths)
    };
    let words: Vec<_> = CATALOGUE.entries.iter().map(words_of).collect();
    let place = |kind| match kind {
        PlaceKind::Joint => sinew_urdf::PlaceKind::Joint,
        PlaceKind::Link => sinew_urdf::PlaceKind::Link,
        PlaceKind::Robot => sinew_urdf::PlaceKind::Robot,
    };
    let kinds: Vec<_> = words
        .iter()
        .map(|(entry, keys, strengths)| KindWords {
            kind: entry.card.name,
            keys,
            strengths,
            place: place(entry.place),
        })
        .collect();
    let notes = file.check_vocabulary(&Vocabulary { kinds: &kinds })?;
    plant(file)?;
    Ok(notes)
}

// The place in the sidecar, else the file.
fn place_of(error: &PlantError, file: &RobotFile) -> String {
    let at = match error {
        PlantError::BadParameter { kind, place, key, .. } => file.where_stated(kind, place, key),
        _ => None,
    };
    at.map_or_else(|| name(file), |at| at.to_string())
}

/// The plant of a robot.
pub(crate) fn plant(file: &RobotFile) -> Result<Plant, CliError> {
    let wrong = |source| CliError::Plant { file: place_of(&source, file), source: Box::new(source) };
    Plant::new(&file.robot, &CATALOGUE).map_err(wrong)
}
