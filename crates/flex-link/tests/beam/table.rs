//! The tables of docs/links.md.

use std::f64::consts::PI;
use std::fmt::Write;

use crate::robots::{BEAM, Body, cantilever, tip_compliance};

const COUNTS: [usize; 8] = [1, 2, 3, 4, 6, 8, 16, 32];
const FREE: [f64; 3] = [1.8751040687119611, 4.694091132974175, 7.854757438237613];
const LOADED: [f64; 3] = [1.2479174096064694, 4.03113943671496, 7.134132240939746];
const TWIST: [f64; 3] = [0.5 * PI, 1.5 * PI, 2.5 * PI];

/// The error of each quantity against the continuous beam, by number of springs.
pub fn tables() -> String {
    let mut text = String::new();
    let mut bending = |title: &str, betas: [f64; 3], tip: Body| {
        let _ = writeln!(text, "{title}\n");
        let _ = writeln!(text, "| springs | deflection | slope | 1st frequency | 2nd | 3rd |");
        let _ = writeln!(text, "|---:|---:|---:|---:|---:|---:|");
        for n in COUNTS {
            let (L, EI) = (BEAM.length, BEAM.flexural_rigidity);
            let [w, slope, ..] = tip_compliance(&[BEAM], n);
            let frequencies = cantilever(n, &['y'], tip).frequencies();
            let exact = |beta: f64| (beta / L).powi(2) * (EI / BEAM.mass_per_length).sqrt();
            let errors = [w / (L.powi(3) / (3.0 * EI)) - 1.0, slope / (L * L / (2.0 * EI)) - 1.0];
            let errors = errors.map(Some).into_iter();
            let modes = (0..3).map(|k| frequencies.get(k).map(|f| f / exact(betas[k]) - 1.0));
            let cells: Vec<String> = errors.chain(modes).map(cell).collect();
            let _ = writeln!(text, "| {n} | {} |", cells.join(" | "));
        }
        let _ = writeln!(text);
    };
    bending("Clamped beam, free tip; deflection and slope under a force at the tip.", FREE, Body::default());
    bending(
        "The same with a mass at the tip as large as the beam's.",
        LOADED,
        Body { mass: 1.68, inertia: 0.0 },
    );
    let _ = writeln!(text, "Torsion of a clamped rod, free tip.\n");
    let _ = writeln!(text, "| springs | twist | 1st frequency | 2nd | 3rd |\n|---:|---:|---:|---:|---:|");
    for n in COUNTS {
        let springs = sinew_flex_link::lumped_springs(&[BEAM], n, sinew_flex_link::SpringKind::Torsion);
        let twist: f64 = springs.iter().map(|s| s.stiffness.recip()).sum();
        let frequencies = cantilever(n, &['x'], Body::default()).frequencies();
        let exact = |beta: f64| beta / BEAM.length * (350.0f64 / 0.004).sqrt();
        let modes = (0..3).map(|k| frequencies.get(k).map(|f| f / exact(TWIST[k]) - 1.0));
        let cells: Vec<String> =
            core::iter::once(Some(twist / (BEAM.length / 350.0) - 1.0)).chain(modes).map(cell).collect();
        let _ = writeln!(text, "| {n} | {} |", cells.join(" | "));
    }
    text
}

// Rounding is zero.
fn cell(error: Option<f64>) -> String {
    match error {
        None => "–".to_owned(),
        Some(e) if e.abs() < 1e-11 => "0".to_owned(),
        // Eigenvalues of stiff chains are not rounded alike everywhere.
        Some(e) if e.abs() < 5e-8 => "< 5e-8".to_owned(),
        Some(e) => format!("{e:+.1e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_has_the_tables_as_they_are() {
        let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/links.md");
        let page = std::fs::read_to_string(page).unwrap();
        assert!(
            page.contains(tables().trim()),
            "cargo run -p sinew-flex-link --example convergence prints:\n{}",
            tables()
        );
    }
}
