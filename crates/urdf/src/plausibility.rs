//! What looks wrong with a model's inertias.

use sinew_model::{Inertia, JointId, Link, Model};

use crate::definite::is_positive;
use crate::{Note, Severity};

// Printed inertias carry few digits: a flat body may miss the triangle inequality by this share of its trace.
const PRINTED: f64 = 1e-3;
// Rounding of the shift from the frame's origin to the centre of mass.
const ROUNDING: f64 = 1e-12;
const HEAVY: f64 = 1e3;
const EQUAL: f64 = 1e-9;

/// Placeholders, absurd masses, impossible and absent inertias. `place_of` finds a link's place in the file.
pub(crate) fn plausibility_notes(model: &Model, file: &str, place_of: &dyn Fn(&str) -> String) -> Vec<Note> {
    let note = |severity, place: String, statement: String, help: &str| Note {
        severity,
        place,
        statement,
        help: help.to_owned(),
    };
    let mut notes = Vec::new();
    let mass: f64 = model.links.iter().map(|l| l.inertia.mass).sum();
    if mass > HEAVY {
        let statement = format!("robot \"{}\": the links weigh {mass:.1} kg together", model.name);
        let help =
            "check that masses are in kg; if they are guesses, write known = \"unknown\" in the sidecar";
        notes.push(note(Severity::Warning, file.to_owned(), statement, help));
    }
    if let Some((count, mass)) = placeholders(model) {
        let statement = format!(
            "all {count} moving links have the same mass {mass} kg and the same inertia: placeholders"
        );
        let help = "write known = \"unknown\" in the sidecar, or use identified inertias";
        notes.push(note(Severity::Warning, file.to_owned(), statement, help));
    }
    for (k, joint) in model.joints.iter().enumerate() {
        let Some(link) = model.links.iter().find(|l| l.body == Some(JointId(k))) else { continue };
        let name = &link.name;
        let i = &joint.inertia;
        let has_moment = i.second_moment_about_centre().to_matrix().rows.iter().any(|r| r.norm() > 0.0);
        if i.mass == 0.0 && !has_moment {
            let statement = format!("link \"{name}\" moves but has neither mass nor inertia");
            let help = "right for an intermediate frame; else add <inertial>";
            notes.push(note(Severity::Note, place_of(name), statement, help));
        } else if !is_possible(i) {
            let statement = format!(
                "the body of link \"{name}\" has an impossible inertia: no body's moments break the triangle inequality"
            );
            let help = "check its inertia: it must be about the centre of mass, in the axes of <origin>";
            notes.push(note(Severity::Warning, place_of(name), statement, help));
        } else if let Some(part) =
            model.links.iter().find(|l| l.body == Some(JointId(k)) && !is_possible(&l.inertia))
        {
            let statement = format!("link \"{}\" has an impossible inertia", part.name);
            let help = "harmless as long as the links fixed to each other make a possible body, as here";
            notes.push(note(Severity::Note, place_of(&part.name), statement, help));
        } else if i.mass > 0.0 && is_point(i) {
            let statement = format!("link \"{name}\" has mass but no inertia about its centre of mass");
            notes.push(note(
                Severity::Note,
                place_of(name),
                statement,
                "right for a point mass; else add <inertia>",
            ));
        }
    }
    notes
}

// ½ tr(I) 1 − I ⪰ 0: the second moments of the mass itself are not negative.
fn is_possible(i: &Inertia<f64>) -> bool {
    let c = i.second_moment_about_centre();
    let o = i.second_moment;
    let trace = c.xx + c.yy + c.zz;
    let h = 0.5 * trace;
    let moments = [h - c.xx, -c.xy, -c.xz, -c.xy, h - c.yy, -c.yz, -c.xz, -c.yz, h - c.zz];
    let slack = PRINTED * trace.abs() + ROUNDING * (o.xx + o.yy + o.zz).abs() + f64::MIN_POSITIVE;
    is_positive(&moments, 3, slack)
}

fn is_point(i: &Inertia<f64>) -> bool {
    let c = i.second_moment_about_centre();
    let o = i.second_moment;
    (c.xx + c.yy + c.zz).abs() <= ROUNDING * (o.xx + o.yy + o.zz) + f64::MIN_POSITIVE
}

// At least three moving links with mass, all alike.
fn placeholders(model: &Model) -> Option<(usize, f64)> {
    let numbers = |l: &Link| {
        let c = l.inertia.second_moment_about_centre();
        [l.inertia.mass, c.xx, c.yy, c.zz, c.xy, c.xz, c.yz]
    };
    let mut links = model.links.iter().filter(|l| l.body.is_some() && l.inertia.mass > 0.0).map(numbers);
    let first = links.next()?;
    let size = first.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let mut count = 1;
    for link in links {
        if link.iter().zip(&first).any(|(a, b)| (a - b).abs() > EQUAL * size) {
            return None;
        }
        count += 1;
    }
    (count >= 3).then_some((count, first[0]))
}
