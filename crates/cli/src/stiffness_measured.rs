//! `sinew stiffness --measured`: joint stiffness from loads and the deflections that they made.

use core::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};
use sinew_linear::{Evidence, FittedStiffness, StiffnessFit, identify_stiffness};
use sinew_model::LinkId;
use sinew_plant::Plant;
use sinew_report::{number, with_std};
use sinew_urdf::RobotFile;

use crate::error::{CliError, did_you_mean};
use crate::inputs;
use crate::load_table;
use crate::table::table;

/// Load tests instead of a load.
#[derive(Debug, Args)]
pub(crate) struct Measured {
    /// Fit joint stiffnesses to load tests: a file (.csv or .csv.gz) with joint_position.J, tool_force.x|y|z,
    /// tool_moment.x|y|z, tool_shift.x|y|z, tool_turn.x|y|z
    #[arg(long, value_name = "FILE", conflicts_with_all = ["force", "moment", "scan", "along", "plot"])]
    pub measured: Option<PathBuf>,
    /// The joints that are fitted; the others count as rigid. Default: all
    #[arg(long, value_name = "J,…", requires = "measured")]
    joints: Option<String>,
    /// Standard deviation of a measured shift, m; default: from the scatter
    #[arg(long, value_name = "M", allow_negative_numbers = true, requires = "measured")]
    shift_std: Option<f64>,
    /// Standard deviation of a measured turn, rad; default: from the scatter
    #[arg(long, value_name = "RAD", allow_negative_numbers = true, requires = "measured")]
    turn_std: Option<f64>,
}

/// What the tests show.
pub(crate) struct Told {
    link: String,
    tests: usize,
    components: usize,
    /// No standard deviation was stated: those of the fit are from the scatter.
    scatter: bool,
    fit: StiffnessFit,
    /// Stiffness in the sidecar, joint by joint.
    stated: Vec<Option<f64>>,
    /// What makes the answer doubtful.
    notes: Vec<String>,
}

// In place of a deviation that nobody stated: far below any sensor, so that the scatter decides.
const UNKNOWN: f64 = 1e-12;
// Columns of length one farther from each other than this are told as poorly chosen tests.
const POOR: f64 = 100.0;

impl Measured {
    /// Fits the joints of `plant` to the tests in the file, joints without a column standing at `at`.
    pub fn fit(
        &self,
        file: &RobotFile,
        plant: &Plant,
        at: &[f64],
        link: LinkId,
    ) -> Result<Option<Told>, CliError> {
        let Some(path) = &self.measured else { return Ok(None) };
        let place = path.display().to_string();
        if let Some(bends) = plant.virtual_joints().first() {
            let name = &plant.model().links[bends.link.0].name;
            let what = format!("link \"{name}\" bends, and load tests are fitted by joints alone");
            let help =
                format!("take [links.{name}.bending] out; its compliance then shows in the joint before it");
            return Err(CliError::usage(inputs::name(file), what, help));
        }
        let rows = load_table::read(path, at, plant.model())?;
        let dofs = self.dofs(plant)?;
        let kinds = [0, 1].map(|k| rows.iter().any(|row| row.kinds()[k]));
        let std = [self.stated("--turn-std", self.turn_std)?, self.stated("--shift-std", self.shift_std)?];
        let scatter = (0..2).all(|k| !kinds[k] || std[k].is_none());
        let half = (0..2).any(|k| kinds[k] && std[k].is_none());
        if kinds == [true, true] && half {
            let what = "turns and shifts were measured, and how exactly each is not known";
            return Err(CliError::usage(place, what, "state --shift-std in m and --turn-std in rad"));
        }
        let std = std.map(|std| std.unwrap_or(UNKNOWN));
        let tests: Vec<_> = rows.iter().map(|row| row.test(std)).collect();
        let components = tests.iter().flat_map(|t| t.std.iter()).filter(|s| s.is_finite()).count();
        let fit = identify_stiffness(plant, &plant.parameters(), link, &dofs, &tests)
            .map_err(|source| CliError::linear(file, source))?;
        let stated = dofs.iter().map(|&dof| file.robot.joints[dof].stiffness).collect();
        let of_table = |what: String| format!("{place}: {what}");
        let large = load_table::too_large(&rows, plant.model(), link).map(of_table);
        let against = load_table::against_the_load(&rows).map(of_table);
        let notes = large.into_iter().chain(against.or_else(|| against_the_load(&fit))).collect();
        let link = plant.model().links[link.0].name.clone();
        Ok(Some(Told { link, tests: tests.len(), components, scatter, fit, stated, notes }))
    }

    fn stated(&self, flag: &str, std: Option<f64>) -> Result<Option<f64>, CliError> {
        match std {
            Some(std) if !(std > 0.0 && std.is_finite()) => {
                let what = format!("is no standard deviation (got {std}, allowed > 0)");
                Err(CliError::usage(flag, what, "leave it out to take it from the scatter"))
            }
            std => Ok(std),
        }
    }

    fn dofs(&self, plant: &Plant) -> Result<Vec<usize>, CliError> {
        let Some(text) = &self.joints else { return Ok((0..plant.model().nv).collect()) };
        let names: Vec<String> =
            (0..plant.model().nv).map(|dof| plant.model().dof_name(dof).to_owned()).collect();
        let mut dofs = Vec::new();
        for name in text.split(',').map(str::trim) {
            let wrong = |what: String, meant: Option<String>| {
                let near = meant.map(|m| format!("{m} ")).unwrap_or_default();
                let help = format!("{near}the joints are {}", names.join(", "));
                CliError::usage(format!("--joints \"{text}\""), what, help)
            };
            let dof = names.iter().position(|n| n == name);
            let dof = dof.ok_or_else(|| wrong(format!("no joint \"{name}\""), did_you_mean(name, &names)))?;
            if dofs.contains(&dof) {
                return Err(wrong(format!("\"{name}\" stands there twice"), None));
            }
            dofs.push(dof);
        }
        Ok(dofs)
    }
}

impl Told {
    // Without a stated deviation and without a component to spare nothing tells the scatter.
    fn exactness_is_known(&self) -> bool {
        !self.scatter || self.fit.freedom > 0
    }

    fn finite(&self, std: f64) -> Option<f64> {
        Some(std).filter(|s| s.is_finite() && self.exactness_is_known())
    }

    /// The answer as an object.
    pub fn object(&self) -> Value {
        let joint = |(fitted, stated): (&FittedStiffness, &Option<f64>)| {
            json!({
                "joint": fitted.joint,
                "stiffness": fitted.stiffness,
                "stiffness_std": self.finite(fitted.stiffness_std),
                "compliance": fitted.compliance,
                "compliance_std": self.finite(fitted.compliance_std),
                "excited": fitted.excited,
                "evidence": word(fitted.evidence),
                "stiffness_at_least": fitted.at_least.filter(|_| self.exactness_is_known()),
                "stated_stiffness": stated,
            })
        };
        let finite = |x: f64| Some(x).filter(|x| x.is_finite());
        json!({
            "link": self.link,
            "tests": self.tests,
            "components": self.components,
            "freedom": self.fit.freedom,
            "condition": finite(self.fit.condition),
            // In standard deviations, and so only where they were stated.
            "residual": finite(self.fit.residual).filter(|_| !self.scatter),
            "joints": self.fit.joints.iter().zip(&self.stated).map(joint).collect::<Vec<_>>(),
            "notes": self.notes,
        })
    }

    /// The same for people.
    pub fn text(&self) -> String {
        let mut out = format!(
            "{} load tests of {}, {} measured components\n\n",
            self.tests, self.link, self.components
        );
        let rows = self.fit.joints.iter().zip(&self.stated).map(|(fitted, stated)| {
            let or_dash = |x: Option<f64>| x.map_or("–".to_owned(), number);
            let with = |x: Option<f64>, std: f64| match (x, self.finite(std)) {
                (Some(x), Some(std)) => with_std(x, std, ""),
                (x, _) => or_dash(x),
            };
            vec![
                fitted.joint.clone(),
                with(fitted.stiffness, fitted.stiffness_std),
                with(fitted.compliance.map(|c| 1e6 * c), 1e6 * fitted.compliance_std),
                or_dash(*stated),
                self.remark(fitted),
            ]
        });
        out += &table(&["joint", ">K, N·m/rad", ">1/K, µrad/(N·m)", ">stated K", ""], rows);
        out += "\n\n";
        if self.fit.condition.is_finite() {
            let poor =
                if self.fit.condition > POOR { ": the tests tell the joints apart poorly" } else { "" };
            let _ = writeln!(out, "Condition of the tests {}{poor}.", number(self.fit.condition));
        } else {
            out += "Not every joint is shown: load the tool in other directions or positions.\n";
        }
        if !self.exactness_is_known() {
            out += "As many joints as measured components: nothing tells how exact this is. Add tests, or state --shift-std or --turn-std.\n";
        } else if self.scatter {
            out += "± is from the scatter about the fit.\n";
        } else {
            let far = if self.fit.residual > 2.0 {
                ": more than the sensors explain, so something else gives way too; ± is widened by it"
            } else {
                ""
            };
            let _ = writeln!(out, "Residual {} standard deviations{far}.", number(self.fit.residual));
        }
        for note in &self.notes {
            let _ = writeln!(out, "\n{note}");
        }
        out
    }

    fn remark(&self, fitted: &FittedStiffness) -> String {
        let above = fitted.at_least.filter(|_| self.exactness_is_known());
        let above = above.map_or(String::new(), |least| format!(": K is above {}", number(least)));
        match fitted.evidence {
            Evidence::Spring => String::new(),
            Evidence::Rigid => format!("as good as rigid{above}"),
            Evidence::Undetermined => format!("undetermined by these loads{above}"),
            Evidence::Impossible => "impossible: it moves against its load".to_owned(),
            _ => "no test shows it".to_owned(),
        }
    }
}

// How scripts read it.
fn word(evidence: Evidence) -> &'static str {
    match evidence {
        Evidence::Spring => "spring",
        Evidence::Rigid => "rigid",
        Evidence::Undetermined => "undetermined",
        Evidence::Impossible => "impossible",
        _ => "hidden",
    }
}

// Joints that no spring explains.
fn against_the_load(fit: &StiffnessFit) -> Option<String> {
    let is_against = |j: &&FittedStiffness| j.evidence == Evidence::Impossible;
    let joints: Vec<&str> = fit.joints.iter().filter(is_against).map(|joint| joint.joint.as_str()).collect();
    (!joints.is_empty()).then(|| {
        format!(
            "{} would have to move against the load, which no spring does\n  help: look at signs and axes of loads and deflections, and at joints that count as rigid",
            joints.join(", ")
        )
    })
}
