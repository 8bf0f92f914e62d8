//! What a sidecar says of a link that bends or twists.

use alloc::vec;
use alloc::vec::Vec;

use crate::{LinkId, Vector3};

/// A link that bends or twists: `[links.L.bending]`.
///
/// Its stiffness is stated in one of three ways: a beam's (`flexural_rigidity`, or `sections`), a single base spring
/// (`stiffness`), or springs one by one (`stations` with `stiffnesses`).
#[derive(Debug, Clone, PartialEq)]
pub struct Bending {
    /// The link.
    pub link: LinkId,
    /// Number of lumped springs along it, for each axis.
    pub springs: usize,
    /// Axes in the link frame: "x", "y" or "z".
    pub axes: Vec<char>,
    /// The direction in which it runs, a unit axis of the link frame forwards or backwards; none to take it from what
    /// the link carries.
    pub along: Option<Vector3<f64>>,
    /// Length, m.
    pub length: f64,
    /// Flexural rigidity E I, N·m².
    pub flexural_rigidity: Option<f64>,
    /// Torsional rigidity G J, N·m².
    pub torsional_rigidity: Option<f64>,
    /// A single base spring, N·m/rad.
    pub stiffness: Option<f64>,
    /// Where springs that are stated one by one stand, m from the link's origin, ascending.
    pub stations: Vec<f64>,
    /// Their stiffness, N·m/rad.
    pub stiffnesses: Vec<f64>,
    /// Mass per length, kg/m; zero for quasi-static springs.
    pub mass_per_length: f64,
    /// Moment of inertia about the link's own line per length, kg·m.
    pub polar_inertia_per_length: f64,
    /// A beam of several sections, from the link's origin on; empty for one that is the same all along.
    pub sections: Vec<BeamSection>,
    /// Damping ratio of the first mode about each axis.
    pub damping_ratio: f64,
    /// True if its springs shall follow the load at once, whatever mass it has.
    pub quasi_static: bool,
}

/// A stretch of a beam along which nothing changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamSection {
    /// Length, m.
    pub length: f64,
    /// E I, N·m².
    pub flexural_rigidity: f64,
    /// G J, N·m².
    pub torsional_rigidity: Option<f64>,
    /// kg/m.
    pub mass_per_length: f64,
    /// Moment of inertia about the beam's own line per length, kg·m.
    pub polar_inertia_per_length: f64,
}

impl Bending {
    /// A base spring of `stiffness` N·m/rad about each of `axes`, quasi-static until it is given a mass per length.
    pub fn base_spring(link: LinkId, axes: &[char], stiffness: f64) -> Self {
        Self {
            link,
            springs: 1,
            axes: axes.to_vec(),
            along: None,
            length: 0.0,
            flexural_rigidity: None,
            torsional_rigidity: None,
            stiffness: Some(stiffness),
            stations: Vec::new(),
            stiffnesses: Vec::new(),
            mass_per_length: 0.0,
            polar_inertia_per_length: 0.0,
            sections: Vec::new(),
            damping_ratio: 0.0,
            quasi_static: false,
        }
    }

    /// A beam of these sections with `springs` springs for each axis.
    pub fn beam(link: LinkId, axes: &[char], springs: usize, sections: &[BeamSection]) -> Self {
        let uniform = sections.len() == 1;
        let first = sections.first();
        let only = |x: fn(&BeamSection) -> f64| first.filter(|_| uniform).map(x);
        Self {
            springs,
            length: sections.iter().map(|s| s.length).sum(),
            flexural_rigidity: only(|s| s.flexural_rigidity),
            torsional_rigidity: first.filter(|_| uniform).and_then(|s| s.torsional_rigidity),
            stiffness: None,
            mass_per_length: only(|s| s.mass_per_length).unwrap_or(0.0),
            polar_inertia_per_length: only(|s| s.polar_inertia_per_length).unwrap_or(0.0),
            sections: if uniform { Vec::new() } else { sections.to_vec() },
            ..Self::base_spring(link, axes, 0.0)
        }
    }

    /// The beam as a list of sections; empty if the link is no beam.
    pub fn beam_sections(&self) -> Vec<BeamSection> {
        match self.flexural_rigidity {
            _ if !self.sections.is_empty() => self.sections.clone(),
            Some(flexural_rigidity) => vec![BeamSection { flexural_rigidity, ..self.rod() }],
            None => Vec::new(),
        }
    }

    /// What has mass along the link, whatever gives it its stiffness.
    pub fn rods(&self) -> Vec<BeamSection> {
        if self.sections.is_empty() { vec![self.rod()] } else { self.sections.clone() }
    }

    fn rod(&self) -> BeamSection {
        BeamSection {
            length: self.length,
            flexural_rigidity: 0.0,
            torsional_rigidity: self.torsional_rigidity,
            mass_per_length: self.mass_per_length,
            polar_inertia_per_length: self.polar_inertia_per_length,
        }
    }
}
