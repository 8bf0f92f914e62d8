//! `sinew stiffness`: how far the tool gives way to a wrench, and where a load takes it.

use std::path::PathBuf;

use clap::Args;
use sinew_linear::{UnderLoad, Wrench, cartesian_stiffness, equilibrium_under_load, stiffness_along};
use sinew_model::{LinkId, Model, Vector3};
use sinew_report::{compliance_view, workspace_view};

use crate::console::Console;
use crate::error::{CliError, did_you_mean};
use crate::inputs;
use crate::plot_file::PlotFile;
use crate::position_argument::position;
use crate::stiffness_answer::{self, Answer, object, text};
use crate::stiffness_measured::Measured;
use crate::stiffness_scan::{self, Scan};
use crate::vector_argument::three_numbers;

/// Arguments of `sinew stiffness`.
#[derive(Debug, Args)]
pub(crate) struct Stiffness {
    /// Sidecar or URDF
    robot: PathBuf,
    /// Where the robot is before any load: "q1,…" in the order of `sinew info`, or "joint=value,…" (joints not named are 0)
    #[arg(long, value_name = "Q", allow_hyphen_values = true, required_unless_present_any = ["along", "measured"])]
    at: Option<String>,
    /// Force on the tool, N, constant in base axes: "x,y,z"
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    force: Option<String>,
    /// Moment on the tool, N·m, constant in base axes: "x,y,z"
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    moment: Option<String>,
    /// The link whose frame gives way; default: the robot's tool
    #[arg(long, value_name = "LINK")]
    link: Option<String>,
    /// Leave the robot's own weight out
    #[arg(long)]
    no_gravity: bool,
    #[command(flatten)]
    scan: Scan,
    #[command(flatten)]
    measured: Measured,
    #[command(flatten)]
    plot: PlotFile,
}

impl Stiffness {
    pub fn run(&self, console: &Console) -> Result<(), CliError> {
        self.plot.check()?;
        let mut file = inputs::robot(&self.robot)?;
        if self.no_gravity {
            file.robot.model.gravity = Vector3::ZERO;
        }
        let plant = inputs::plant(&file)?;
        let q = position(self.at.as_deref().unwrap_or(""), &file.robot.model)?;
        let link = match &self.link {
            Some(name) => link(name, plant.model())?,
            None => plant.tool(),
        };
        let part = |flag, text: &Option<String>| {
            text.as_ref().map_or(Ok([0.0; 3]), |text| three_numbers(flag, text))
        };
        let (moment, force) = (part("--moment", &self.moment)?, part("--force", &self.force)?);
        if let Some(told) = self.measured.fit(&file, &plant, &q, link)? {
            return console.answer(&told.object(), || told.text());
        }
        let p = plant.parameters();
        let linear = |source: sinew_linear::LinearError| CliError::linear(&file, source);
        let load = (self.force.is_some() || self.moment.is_some())
            .then(|| Wrench::from_column_slice(&[moment, force].concat()));
        let name = &plant.model().links[link.0].name;
        if let Some(configurations) = self.scan.configurations(&q, &file.robot.model)? {
            let points = stiffness_along(&plant, &p, link, &configurations, load.as_ref()).map_err(linear)?;
            self.plot.write(|| workspace_view(&points, name))?;
            let head = stiffness_answer::head(name);
            return console.answer(&stiffness_scan::object(head, &points, load.as_ref()), || {
                stiffness_scan::text(name, &points, load.as_ref())
            });
        }
        let unloaded = cartesian_stiffness(&plant, &p, &q, link).map_err(linear)?;
        let under = |load: &Wrench| equilibrium_under_load(&plant, &p, &unloaded, link, load).map_err(linear);
        let loaded = load.map(|load| Ok::<_, CliError>((load, under(&load)?))).transpose()?;
        self.plot.write(|| compliance_view(&unloaded, name))?;
        if let Some((_, UnderLoad::GivesWay(_))) = &loaded {
            console.say("the robot does not bear this load; what it bears is in the answer");
        }
        let answer = Answer { plant: &plant, link, weightless: self.no_gravity, unloaded: &unloaded, loaded };
        console.answer(&object(&answer), || text(&answer))
    }
}

/// The link called `name`, or the message that says which there are.
fn link(name: &str, model: &Model) -> Result<LinkId, CliError> {
    let known: Vec<String> = model.links.iter().map(|l| l.name.clone()).collect();
    model.link(name).ok_or_else(|| {
        let links = || format!("the links are {}", known.join(", "));
        let help = did_you_mean(name, &known).unwrap_or_else(links);
        CliError::usage("--link", format!("no link \"{name}\" in robot \"{}\"", model.name), help)
    })
}
