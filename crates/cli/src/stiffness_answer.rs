//! What `sinew stiffness` answers: one JSON object, or tables and sentences.

use core::fmt::Write;

use nalgebra::{Matrix6, Vector3, Vector6};
use serde_json::{Value, json};
use sinew_linear::{
    CartesianStiffness, Critical, Directions, Loaded, LossOfStability, PrincipalAxis, UnderLoad, Wrench,
    directions, stiffness_of,
};
use sinew_model::LinkId;
use sinew_plant::Plant;
use sinew_report::{number, quantity};

use crate::matrix_json::rows;
use crate::table::{percent, table};

/// What was asked and found.
pub(crate) struct Answer<'a> {
    pub plant: &'a Plant,
    pub link: LinkId,
    pub weightless: bool,
    pub unloaded: &'a CartesianStiffness,
    pub loaded: Option<(Wrench, UnderLoad)>,
}

const FRAME: &str = "base axes at the tool point";
const ORDER: [&str; 6] = ["rx", "ry", "rz", "x", "y", "z"];

/// What the numbers mean.
pub(crate) fn head(link: &str) -> Value {
    json!({ "link": link, "frame": FRAME, "order": ORDER })
}

/// The object of the contract, and more.
pub(crate) fn object(answer: &Answer) -> Value {
    let told = answer.unloaded;
    let parts = directions(&told.compliance);
    let model = answer.plant.model();
    let matrix = |m: &Option<Matrix6<f64>>| m.as_ref().map(rows);
    json!({
        "link": model.links[answer.link.0].name,
        "frame": FRAME,
        "order": ORDER,
        "coordinates": told.coordinates,
        "gravity": model.gravity.to_array(),
        "at": { "q": told.q, "theta": told.theta, "tool": told.pose.translation.to_array() },
        "jacobian": rows(&told.jacobian),
        "joint_stiffness": rows(&told.joint_stiffness),
        "gravity_stiffness": rows(&told.gravity_stiffness),
        "compliance": rows(&told.compliance),
        "compliance_with_gravity": matrix(&told.compliance_with_gravity),
        "stiffness": matrix(&stiffness_of(&told.compliance)),
        "stiffness_with_gravity": matrix(&told.compliance_with_gravity.and_then(|C| stiffness_of(&C))),
        "rank": parts.rank,
        "condition": parts.condition,
        "stable": told.stable,
        "principal_axes": { "rotation": axes(&parts.rotation), "translation": axes(&parts.translation) },
        "stiff_directions": parts.stiff.iter().map(|w| w.as_slice().to_vec()).collect::<Vec<_>>(),
        "loaded": answer.loaded.as_ref().map(|(load, outcome)| loaded_object(told, load, outcome)),
    })
}

fn axes(axes: &[PrincipalAxis; 3]) -> Vec<Value> {
    let axis = |a: &PrincipalAxis| json!({ "direction": a.direction.as_slice(), "compliance": a.compliance });
    axes.iter().map(axis).collect()
}

fn loaded_object(told: &CartesianStiffness, load: &Wrench, outcome: &UnderLoad) -> Value {
    let linear = told.compliance * load;
    let with_gravity = told.compliance_with_gravity.map(|C| C * load);
    let mut value = json!({
        "load": load.as_slice(),
        "linear_deflection": linear.as_slice(),
        "linear_deflection_with_gravity": with_gravity.as_ref().map(|x| x.as_slice()),
    });
    let more = match outcome {
        UnderLoad::Holds(there) => json!({
            "compliance": rows(&there.compliance),
            "stiffness": stiffness_of(&there.compliance).as_ref().map(rows),
            "compliance_without_geometric_term": rows(&there.classical_compliance),
            "geometric_stiffness": rows(&there.geometric_stiffness),
            "deflection": there.deflection.as_slice(),
            "q": there.q,
            "gives_way": null,
        }),
        UnderLoad::GivesWay(critical) => json!({
            "compliance": null, "stiffness": null, "deflection": null,
            "gives_way": {
                "factor": critical.factor, "kind": kind(critical.kind), "joint": critical.joint, "q": critical.q,
                "statement": gives_way(critical),
            },
        }),
    };
    if let (Some(value), Value::Object(more)) = (value.as_object_mut(), more) {
        value.extend(more);
    }
    value
}

fn kind(kind: LossOfStability) -> &'static str {
    match kind {
        LossOfStability::Unloaded => "unstable_without_load",
        LossOfStability::Buckling => "buckling",
        LossOfStability::LimitPoint => "limit_point",
    }
}

fn gives_way(critical: &Critical) -> String {
    let (joint, share) = (&critical.joint, percent(critical.factor));
    match critical.kind {
        LossOfStability::Unloaded => format!(
            "the robot does not stay here even without the load: gravity is stronger than its springs (joint \"{joint}\" gives way)"
        ),
        LossOfStability::Buckling => {
            format!("at {share} of the load it buckles: joint \"{joint}\" falls over to the side")
        }
        LossOfStability::LimitPoint => format!(
            "at {share} of the load it gives way: no equilibrium goes on from there (joint \"{joint}\")"
        ),
    }
}

/// Tables and sentences.
pub(crate) fn text(answer: &Answer) -> String {
    let told = answer.unloaded;
    let model = answer.plant.model();
    let parts = directions(&told.compliance);
    let name = &model.links[answer.link.0].name;
    let p = told.pose.translation;
    let mut out = format!(
        "{name} of {} at x {}, y {}, z {} m; {FRAME}\n",
        model.name,
        number(p.x),
        number(p.y),
        number(p.z)
    );
    if told.elastic.is_empty() {
        out += "\nno joint of this robot is elastic: nothing gives way. State `stiffness` in [joints.…] of its sidecar.\n";
        return out;
    }
    let _ = writeln!(out, "elastic: {}\n", told.coordinates.join(", "));
    out += &table(
        &["gives way to", "axis", ">compliance", ">stiffness", "direction in base axes"],
        axis_rows(&parts),
    );
    let _ = writeln!(out, "\n\n{}", rank_sentence(&parts));
    if !told.stable {
        out += "It does not stay here: gravity is stronger than the springs.\n";
    } else if let (false, Some(C)) = (answer.weightless, told.compliance_with_gravity) {
        let change = (C - told.compliance).fixed_view::<3, 3>(3, 3).norm();
        let whole = told.compliance.fixed_view::<3, 3>(3, 3).norm();
        if whole > 0.0 {
            let _ =
                writeln!(out, "Gravity changes the translational compliance by {}.", percent(change / whole));
        }
    }
    if let Some((load, outcome)) = &answer.loaded {
        out += &load_text(told, load, outcome);
    }
    out
}

fn axis_rows(parts: &Directions) -> Vec<Vec<String>> {
    let names = ["softest", "middle", "stiffest"];
    let row = |kind: &str, unit: &str, stiffness: &str, (k, axis): (usize, &PrincipalAxis), largest: f64| {
        let rigid = axis.compliance <= 1e-12 * largest;
        let (C, K) = if rigid {
            ("0".to_owned(), "rigid".to_owned())
        } else {
            let C = quantity(axis.compliance, unit);
            (
                format!("{C}/{}", if unit == "m" { "N" } else { "(N·m)" }),
                format!("{} {stiffness}", number(1.0 / axis.compliance)),
            )
        };
        vec![kind.to_owned(), names[k].to_owned(), C, K, direction(&axis.direction)]
    };
    let of = |kind: &'static str, unit: &'static str, stiffness: &'static str, axes: &[PrincipalAxis; 3]| {
        axes.iter().enumerate().map(|a| row(kind, unit, stiffness, a, axes[0].compliance)).collect::<Vec<_>>()
    };
    let mut rows = of("force", "m", "N/m", &parts.translation);
    rows.extend(of("moment", "rad", "N·m/rad", &parts.rotation));
    rows
}

fn direction(v: &Vector3<f64>) -> String {
    let near = |x: f64| if x.abs() < 5e-4 { 0.0 } else { x };
    format!("({:.3}, {:.3}, {:.3})", near(v.x), near(v.y), near(v.z))
}

fn rank_sentence(parts: &Directions) -> String {
    if parts.rank == 6 {
        return format!(
            "Rank 6: it gives way in every direction, so there is a stiffness matrix (condition {}).",
            number(parts.condition)
        );
    }
    let mut text = format!(
        "Rank {}: it does not give way to {} of 6 independent wrenches, so there is a compliance and no stiffness matrix.\nStiff directions (wrenches that move nothing):",
        parts.rank,
        6 - parts.rank
    );
    for w in &parts.stiff {
        let _ = write!(text, "\n  {}", wrench_in_words(w));
    }
    text
}

// "force x 1, moment y −0.2 N·m per N": components that count.
fn wrench_in_words(w: &Vector6<f64>) -> String {
    let names = ["moment x", "moment y", "moment z", "force x", "force y", "force z"];
    let units = ["N·m", "N·m", "N·m", "N", "N", "N"];
    let largest = w.amax();
    let part = |k: usize| format!("{} {} {}", names[k], number(w[k] / largest), units[k]);
    let parts: Vec<String> = (0..6).filter(|&k| w[k].abs() > 1e-6 * largest).map(part).collect();
    parts.join(", ")
}

fn load_text(told: &CartesianStiffness, load: &Wrench, outcome: &UnderLoad) -> String {
    let mut out = format!("\nUnder {}:\n", wrench_of_load(load));
    let there = match outcome {
        UnderLoad::GivesWay(critical) => return out + &gives_way(critical) + "\n",
        UnderLoad::Holds(there) => there,
    };
    let linear = told.compliance * load;
    let with_gravity = told.compliance_with_gravity.map(|C| C * load);
    let row = |k: usize| {
        let unit = if k < 3 { "rad" } else { "m" };
        let gravity = with_gravity.map_or("–".to_owned(), |x| quantity(x[k], unit));
        vec![ORDER[k].to_owned(), quantity(there.deflection[k], unit), quantity(linear[k], unit), gravity]
    };
    out += &table(&["deflection", ">true", ">linear map", ">linear with gravity"], (0..6).map(row));
    let _ = writeln!(out, "\n\n{}", error_sentence(there, &linear));
    out
}

fn wrench_of_load(load: &Wrench) -> String {
    let part = |name: &str, unit: &str, first: usize| {
        let v = load.fixed_rows::<3>(first);
        let text = format!("{name} ({}, {}, {}) {unit}", number(v[0]), number(v[1]), number(v[2]));
        (v.amax() > 0.0).then_some(text)
    };
    let parts: Vec<String> =
        [part("force", "N", 3), part("moment", "N·m", 0)].into_iter().flatten().collect();
    if parts.is_empty() { "no load".to_owned() } else { parts.join(" and ") }
}

fn error_sentence(there: &Loaded, linear: &Vector6<f64>) -> String {
    let apart = |first: usize| {
        let (x, y) = (there.deflection.fixed_rows::<3>(first), linear.fixed_rows::<3>(first));
        (x.norm() > 0.0).then(|| percent((y - x).norm() / x.norm()))
    };
    let shift = apart(3).map(|e| format!("shift by {e}"));
    let turn = apart(0).map(|e| format!("turn by {e}"));
    let parts: Vec<String> = [shift, turn].into_iter().flatten().collect();
    let map = if parts.is_empty() {
        "The link does not move.".to_owned()
    } else {
        format!("The linear map J K⁻¹ Jᵀ misses the {}.", parts.join(", the "))
    };
    let difference = (there.classical_compliance - there.compliance).fixed_view::<3, 3>(3, 3).norm();
    let whole = there.compliance.fixed_view::<3, 3>(3, 3).norm();
    if whole > 0.0 {
        let share = percent(difference / whole);
        return format!(
            "{map} At the loaded place, leaving out the geometric term and gravity changes the translational compliance by {share}."
        );
    }
    map
}
