//! `sinew info`: what a robot is, as its files say.

use core::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use serde_json::{Map, Value, json};
use sinew_linear::{LinearError, Mode, modes};
use sinew_model::{
    EffectSpec, Following, JointKind, Link, LinkId, Model, Robot, Setting, Trust, VirtualJoint,
};
use sinew_plant::Plant;
use sinew_report::{number, quantity};

use crate::console::Console;
use crate::error::CliError;
use crate::inputs;
use crate::position_argument::position;
use crate::table::table;

/// Arguments of `sinew info`.
#[derive(Debug, Args)]
pub(crate) struct Info {
    /// Sidecar or URDF
    robot: PathBuf,
    /// Where the modes are told: "q1,…" in the order printed, or "joint=value,…"; default 0
    #[arg(long, value_name = "Q", allow_hyphen_values = true, default_value = "")]
    at: String,
}

/// A robot with its modes, or why it has none.
struct Answer<'a> {
    robot: &'a Robot,
    plant: &'a Plant,
    q: Vec<f64>,
    modes: Result<Vec<Mode>, LinearError>,
}

impl Info {
    pub fn run(&self, console: &Console) -> Result<(), CliError> {
        let file = inputs::robot(&self.robot)?;
        for note in &file.notes {
            console.say(&note.to_string());
        }
        let plant: Plant = inputs::plant(&file)?;
        let q = position(&self.at, &file.robot.model)?;
        let modes = modes(&plant, &plant.parameters(), &q);
        let answer = Answer { robot: &file.robot, plant: &plant, q, modes };
        console.answer(&object(&answer), || text(&answer))
    }
}

/// The names of all degrees of freedom, in order.
fn joints(model: &Model) -> Vec<&str> {
    (0..model.nv).map(|dof| model.dof_name(dof)).collect()
}

fn is_elastic(robot: &Robot, dof: usize) -> bool {
    robot.joints[dof].stiffness.is_some() || robot.couplings.iter().any(|c| c.dofs.contains(&dof))
}

// K of one joint: its own, or its place on the diagonal of its coupling.
fn stiffness(robot: &Robot, dof: usize) -> Option<f64> {
    let coupled = robot.couplings.iter().find_map(|c| {
        let place = c.dofs.iter().position(|&d| d == dof)?;
        c.stiffness.get(place * (c.dofs.len() + 1)).copied()
    });
    coupled.or(robot.joints[dof].stiffness)
}

fn unit(model: &Model, dof: usize) -> &'static str {
    if model.joints[model.joint_of_dof(dof).0].kind.slides() { "m" } else { "rad" }
}

fn carried(model: &Model, link: &Link) -> Option<String> {
    link.body.map(|id| model.joints[id.0].name.clone())
}

fn object(answer: &Answer) -> Value {
    let robot = answer.robot;
    let model = &robot.model;
    let joint = |dof: usize| {
        let (settings, joint) = (&robot.joints[dof], &model.joints[model.joint_of_dof(dof).0]);
        let finite = |x: f64| x.is_finite().then_some(x);
        let kind = match joint.kind {
            JointKind::Prismatic { .. } => "sliding",
            _ => "turning",
        };
        json!({
            "joint": model.dof_name(dof), "kind": kind, "unit": unit(model, dof),
            "lower": finite(joint.limits.lower), "upper": finite(joint.limits.upper),
            "elastic": is_elastic(robot, dof), "stiffness": stiffness(robot, dof),
            "damping": settings.damping, "rotor_inertia": settings.rotor_inertia, "gear_ratio": settings.gear_ratio,
        })
    };
    let link = |link: &Link| {
        json!({
            "link": link.name, "mass": link.inertia.mass,
            "centre_of_mass": (link.inertia.mass > 0.0).then(|| link.inertia.centre_of_mass().to_array()),
            "carried_by": carried(model, link),
        })
    };
    let names = |dofs: &[usize]| dofs.iter().map(|&d| model.dof_name(d).to_owned()).collect::<Vec<_>>();
    let square = |n: usize, all: &[f64]| all.chunks(n.max(1)).map(<[f64]>::to_vec).collect::<Vec<_>>();
    let couplings = robot.couplings.iter().map(|c| {
        let n = c.dofs.len();
        json!({ "joints": names(&c.dofs), "stiffness": square(n, &c.stiffness), "damping": square(n, &c.damping) })
    });
    let bending = robot.bending.iter().map(|b| {
        json!({
            "link": model.links[b.link.0].name, "springs": b.springs, "axes": b.axes, "length": b.length,
            "EI": b.flexural_rigidity, "stiffness": b.stiffness, "mass_per_length": b.mass_per_length,
        })
    });
    let virtual_joint = |v: &VirtualJoint| {
        json!({
            "coordinate": answer.plant.coordinate(v), "link": model.links[v.link.0].name, "axis": v.axis,
            "station": v.station, "stiffness": v.stiffness, "damping": v.damping,
            "follows_its_load": v.following == Following::QuasiStatic,
        })
    };
    let effect = |e: &EffectSpec| {
        let values: Map<String, Value> =
            e.settings.iter().map(|(key, s)| (key.clone(), setting(s))).collect();
        json!({ "effect": e.kind, "place": e.place.to_string(), "values": values })
    };
    json!({
        "robot": model.name,
        "gravity": model.gravity.to_array(),
        "tool": model.links[robot.tool.0].name,
        "known": trust(robot.trust),
        "degrees_of_freedom": model.nv,
        "order": joints(model),
        "joints": (0..model.nv).map(joint).collect::<Vec<_>>(),
        "moving_mass": model.moving_mass(),
        "links": model.links.iter().map(link).collect::<Vec<_>>(),
        "couplings": couplings.collect::<Vec<_>>(),
        "bending": bending.collect::<Vec<_>>(),
        "virtual_joints": answer.plant.virtual_joints().iter().map(virtual_joint).collect::<Vec<_>>(),
        "effects": robot.effects.iter().map(effect).collect::<Vec<_>>(),
        "at": answer.q,
        "modes": answer.modes.as_ref().ok().map(|all| all.iter().map(mode).collect::<Vec<_>>()),
        "no_modes_because": answer.modes.as_ref().err().map(ToString::to_string),
    })
}

fn setting(setting: &Setting) -> Value {
    match setting {
        Setting::Number(x) => json!(x),
        Setting::Numbers(list) => json!(list),
        Setting::Word(word) => json!(word),
    }
}

fn mode(mode: &Mode) -> Value {
    json!({
        "omega": mode.omega, "frequency_hz": mode.frequency, "damping_ratio": mode.damping_ratio,
        "stable": mode.stable,
    })
}

fn trust(trust: Trust) -> &'static str {
    match trust {
        Trust::Exact => "exact",
        Trust::Nominal => "nominal",
        Trust::Unknown => "unknown",
    }
}

fn text(answer: &Answer) -> String {
    let robot = answer.robot;
    let model = &robot.model;
    let elastic = (0..model.nv).filter(|&dof| is_elastic(robot, dof)).count();
    let mut out = format!(
        "{}: {} degrees of freedom, {elastic} elastic; {} kg moving; tool {}; inertias {}\n\n",
        model.name,
        model.nv,
        number(model.moving_mass()),
        model.links[robot.tool.0].name,
        trust(robot.trust)
    );
    out += &joint_table(robot);
    let _ = writeln!(out, "\n\n--at \"{}\"\n", joints(model).join(","));
    out += &link_table(model, robot.tool);
    out += "\n\n";
    for c in &robot.couplings {
        let names: Vec<&str> = c.dofs.iter().map(|&dof| model.dof_name(dof)).collect();
        let _ = writeln!(out, "coupled transmission: {}", names.join(", "));
    }
    if !robot.bending.is_empty() {
        out += &(bending_table(answer.plant) + "\n\n");
    }
    match robot.effects.as_slice() {
        [] => out += "no further effects\n",
        effects => {
            let row = |e: &EffectSpec| vec![e.kind.clone(), e.place.to_string(), values(e)];
            out += &table(&["effect", "place", "values"], effects.iter().map(row));
            out.push('\n');
        }
    }
    out + "\n" + &mode_text(answer)
}

fn joint_table(robot: &Robot) -> String {
    let model = &robot.model;
    let row = |dof: usize| {
        let (settings, unit) = (&robot.joints[dof], unit(model, dof));
        let torque = if unit == "m" { "N/m" } else { "N·m/rad" };
        let K = stiffness(robot, dof).map_or("rigid".to_owned(), |k| format!("{} {torque}", number(k)));
        let limits = model.joints[model.joint_of_dof(dof).0].limits;
        let range = if limits.lower.is_finite() || limits.upper.is_finite() {
            format!("{} … {} {unit}", number(limits.lower), number(limits.upper))
        } else {
            format!("any {unit}")
        };
        let rotor =
            format!("{} {}", number(settings.rotor_inertia), if unit == "m" { "kg" } else { "kg·m²" });
        let ratio = settings.gear_ratio.map_or("–".to_owned(), number);
        vec![(dof + 1).to_string(), model.dof_name(dof).to_owned(), range, K, rotor, ratio]
    };
    table(&[">", "joint", "range", ">stiffness", ">rotor", ">gear"], (0..model.nv).map(row))
}

fn link_table(model: &Model, tool: LinkId) -> String {
    let row = |(k, link): (usize, &Link)| {
        let name = if k == tool.0 { format!("{} (tool)", link.name) } else { link.name.clone() };
        let carried = carried(model, link).unwrap_or_else(|| "fixed".to_owned());
        vec![name, format!("{} kg", number(link.inertia.mass)), carried]
    };
    table(&["link", ">mass", "moved by"], model.links.iter().enumerate().map(row))
}

fn bending_table(plant: &Plant) -> String {
    let row = |v: &VirtualJoint| {
        let follows = match v.following {
            Following::QuasiStatic => "follows its load, no mode of its own",
            _ => "",
        };
        vec![
            plant.coordinate(v),
            format!("{}, about {}", plant.model().links[v.link.0].name, v.axis),
            quantity(v.station, "m"),
            format!("{} N·m/rad", number(v.stiffness)),
            follows.to_owned(),
        ]
    };
    table(&["bends", "link", ">station", ">stiffness", ""], plant.virtual_joints().iter().map(row))
}

fn values(effect: &EffectSpec) -> String {
    let word = |(key, setting): &(String, Setting)| match setting {
        Setting::Number(x) => format!("{key} {}", number(*x)),
        Setting::Numbers(list) => {
            format!("{key} ({})", list.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", "))
        }
        Setting::Word(text) => format!("{key} {text}"),
    };
    effect.settings.iter().map(word).collect::<Vec<_>>().join(", ")
}

fn mode_text(answer: &Answer) -> String {
    let modes = match &answer.modes {
        Ok(modes) => modes,
        Err(error) => return format!("no modes: {error}\n"),
    };
    let row = |m: &Mode| {
        let damping = m.damping_ratio.map_or("–".to_owned(), number);
        let words = match (m.stable, m.omega_squared) {
            (false, _) => "falls over",
            (true, 0.0) => "moves freely",
            _ => "",
        };
        vec![quantity(m.frequency, "Hz"), number(m.omega), damping, words.to_owned()]
    };
    let at: Vec<String> = answer.q.iter().map(|x| number(*x)).collect();
    let head = format!("modes at rest at ({})\n\n", at.join(", "));
    head + &table(&[">frequency", ">rad/s", ">damping ratio", ""], modes.iter().map(row)) + "\n"
}
