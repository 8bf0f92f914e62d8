//! The springs of one link in their order, and the way the link runs.

use sinew_model::{Bending, LinkId, Model, Pose, Vector3};

use crate::placement::{SpringKind, lumped_springs};
use crate::{FlexLinkError, LumpedSpring};

/// The axes of a frame by their letters.
const AXES: [char; 3] = ['x', 'y', 'z'];

/// One spring about one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ChainSpring {
    pub station: f64,
    pub stiffness: f64,
    pub axis: char,
}

/// All springs of a link from its root to its tip.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Chain {
    /// The unit axis of the link frame along which it runs.
    pub along: Vector3<f64>,
    pub springs: Vec<ChainSpring>,
    /// True if one spring at the base carries the whole link, its own frame included.
    pub carries_all: bool,
}

// Stations that differ by less than this share of the length are one.
const SAME: f64 = 1e-9;
// A direction is plain if its second largest component is at most this share of the largest.
const PLAIN: f64 = 0.9;
// Nearer than this, m, is at the origin.
const NEAR: f64 = 1e-9;

impl Chain {
    pub fn new(model: &Model, bending: &Bending) -> Result<Self, FlexLinkError> {
        let name = || model.links[bending.link.0].name.clone();
        let sections = bending.beam_sections();
        let base = sections.is_empty() && bending.stations.is_empty();
        let has_mass = bending.rods().iter().any(|s| s.mass_per_length > 0.0);
        let along = match direction(model, bending) {
            Ok(along) => along,
            // A base spring asks for the way of the link only to place the beam's mass.
            Err(_) if base && !has_mass => Vector3::new(1.0, 0.0, 0.0),
            Err(got) => return Err(FlexLinkError::NoDirection { link: name(), got }),
        };
        let mut springs: Vec<ChainSpring> = Vec::new();
        for &axis in &bending.axes {
            let lumped = if !sections.is_empty() {
                let twists = unit(axis).dot(along).abs() > 0.5;
                if twists && sections.iter().any(|s| s.torsional_rigidity.is_none()) {
                    return Err(FlexLinkError::NoTorsion { link: name(), axis });
                }
                let kind = if twists { SpringKind::Torsion } else { SpringKind::Bending };
                lumped_springs(&sections, bending.springs, kind)
            } else if base {
                vec![LumpedSpring { station: 0.0, stiffness: bending.stiffness.unwrap_or(0.0) }]
            } else {
                let pairs = bending.stations.iter().zip(&bending.stiffnesses);
                pairs.map(|(&station, &stiffness)| LumpedSpring { station, stiffness }).collect()
            };
            springs.extend(lumped.into_iter().map(|s| ChainSpring {
                station: s.station,
                stiffness: s.stiffness,
                axis,
            }));
        }
        springs.sort_by(|a, b| a.station.total_cmp(&b.station));
        let length: f64 = springs.last().map_or(0.0, |s| s.station);
        for k in 1..springs.len() {
            if springs[k].station - springs[k - 1].station <= SAME * length {
                springs[k].station = springs[k - 1].station;
            }
        }
        let in_order = |axis: &char| bending.axes.iter().position(|a| a == axis);
        springs
            .sort_by(|a, b| a.station.total_cmp(&b.station).then(in_order(&a.axis).cmp(&in_order(&b.axis))));
        let bad =
            springs.iter().find(|s| !(s.stiffness > 0.0 && s.stiffness.is_finite() && s.station >= 0.0));
        if let Some(spring) = bad {
            return Err(FlexLinkError::Value {
                link: name(),
                what: "a spring that is none",
                got: format!("{} N·m/rad at {} m", spring.stiffness, spring.station),
                allowed: "stiffness > 0 at a place from the link's origin on",
                help: "state EI, stiffness, or stations with a stiffness each",
            });
        }
        Ok(Self { along, springs, carries_all: base })
    }

    /// The part on which something at `station` rides: 0 is the root, k what comes behind the k-th spring.
    pub fn part(&self, station: f64) -> usize {
        if self.carries_all {
            self.springs.len()
        } else {
            self.springs.partition_point(|s| s.station < station)
        }
    }

    /// Where part `k` begins, m from the link's origin; its frame stands there.
    pub fn start(&self, part: usize) -> f64 {
        if part == 0 { 0.0 } else { self.springs[part - 1].station }
    }
}

/// The unit vector of an axis.
pub(crate) fn unit(axis: char) -> Vector3<f64> {
    let on = |a: char| if a == axis { 1.0 } else { 0.0 };
    Vector3::new(on('x'), on('y'), on('z'))
}

/// Where the joint or the fixed frame of `child` stands in its parent link.
pub(crate) fn parent_from_child(model: &Model, child: LinkId) -> Pose<f64> {
    let link = &model.links[child.0];
    let Some(parent) = link.parent.map(|p| &model.links[p.0]) else { return Pose::identity() };
    let parent_from_body = parent.body_from_link.inverse();
    if parent.body == link.body {
        return parent_from_body * link.body_from_link;
    }
    let mut joint = &model.joints[link.body.expect("only the root's body is the world").0];
    while joint.parent != parent.body {
        joint = &model.joints[joint.parent.expect("a link's joints lead to its parent").0];
    }
    parent_from_body * joint.placement
}

// The axis along which the link runs: towards the farthest that it carries, or its centre of mass. The error says what
// was found.
fn direction(model: &Model, bending: &Bending) -> Result<Vector3<f64>, String> {
    if let Some(along) = bending.along {
        return Ok(along);
    }
    let children =
        (0..model.links.len()).map(LinkId).filter(|c| model.links[c.0].parent == Some(bending.link));
    let places = children.map(|c| parent_from_child(model, c).translation);
    let farthest = places.max_by(|a, b| a.norm().total_cmp(&b.norm()));
    let centre = model.links[bending.link.0].inertia.centre_of_mass();
    let (what, far) = match farthest.filter(|p| p.norm() > NEAR) {
        Some(place) => ("what it carries", place),
        None if centre.norm() > NEAR => ("its centre of mass", centre),
        None => return across(&bending.axes).ok_or_else(|| "nothing away from its origin".to_owned()),
    };
    let mut parts: Vec<(f64, usize)> = far.to_array().iter().map(|x| x.abs()).zip(0..3).collect();
    parts.sort_by(|a, b| b.0.total_cmp(&a.0));
    if parts[1].0 > PLAIN * parts[0].0 {
        return Err(format!("{what} at {}, {}, {}", far.x, far.y, far.z));
    }
    let k = parts[0].1;
    Ok(unit(AXES[k]) * far.to_array()[k].signum())
}

// The axis that two bending axes leave.
fn across(axes: &[char]) -> Option<Vector3<f64>> {
    let mut left = AXES.iter().filter(|a| !axes.contains(a));
    match (left.next(), left.next()) {
        (Some(&axis), None) => Some(unit(axis)),
        _ => None,
    }
}
