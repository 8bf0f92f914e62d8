//! The order of the states of a linear model, and their names.

use sinew_effect::Derivative;
use sinew_plant::{LinkState, Plant};

/// A position of a linear model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Coordinate {
    /// The link side of a degree of freedom, `q.J`.
    Link(usize),
    /// The motor of an elastic joint, `theta.J`.
    Motor(usize),
    /// A virtual joint of a link that bends, `v.LINK.K`.
    Bend(usize),
}

impl Coordinate {
    /// The degree of freedom of the plant's model that it belongs to.
    pub fn dof(self) -> usize {
        match self {
            Coordinate::Link(dof) | Coordinate::Motor(dof) | Coordinate::Bend(dof) => dof,
        }
    }

    /// Its name: `q.J`, `theta.J` or `v.LINK.K`.
    pub fn name(self, plant: &Plant) -> String {
        match self {
            Coordinate::Link(dof) => format!("q.{}", plant.model().dof_name(dof)),
            Coordinate::Motor(dof) => format!("theta.{}", plant.model().dof_name(dof)),
            Coordinate::Bend(dof) => {
                let joint = plant.virtual_joints().iter().find(|v| v.dof == dof);
                joint.map_or_else(|| format!("v.{dof}"), |v| plant.coordinate(v))
            }
        }
    }
}

/// In place of the place of a virtual joint that follows its load at once and so has no state.
pub(crate) const FOLLOWS: usize = usize::MAX;

/// Positions, their rates, then own states of effects: each `q`, then `theta`, then virtual joints.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    /// Degrees of freedom of the plant's model.
    pub nv: usize,
    /// The positions in order.
    pub coordinates: Vec<Coordinate>,
    /// Degrees of freedom that a motor drives: the inputs, in order.
    pub driven: Vec<usize>,
    /// The own states that are kept, as places in the plant's `z`.
    pub own: Vec<usize>,
    /// The place of each degree of freedom's link among the positions; [`FOLLOWS`] where it has none.
    pub link: Vec<usize>,
    /// The place of each degree of freedom's motor; that of its link where the joint is rigid.
    pub motor: Vec<usize>,
}

impl Layout {
    /// The order for `plant` in which the own states of the effects that `keeps` names are states too.
    pub fn new(plant: &Plant, keeps: impl Fn(usize) -> bool) -> Self {
        let nv = plant.model().nv;
        let joints = plant.joints();
        let links = joints.iter().map(|&dof| Coordinate::Link(dof));
        let motors = joints.iter().filter(|&&dof| plant.elastic()[dof]).map(|&dof| Coordinate::Motor(dof));
        let swings = plant.virtual_joints().iter().filter(|v| plant.moving().contains(&v.dof));
        let bends = swings.map(|v| Coordinate::Bend(v.dof));
        let coordinates: Vec<Coordinate> = links.chain(motors).chain(bends).collect();
        let place = |c: Coordinate| coordinates.iter().position(|&other| other == c);
        let either = |dof: usize| place(Coordinate::Link(dof)).or_else(|| place(Coordinate::Bend(dof)));
        let link: Vec<usize> = (0..nv).map(|dof| either(dof).unwrap_or(FOLLOWS)).collect();
        let motor = (0..nv).map(|dof| place(Coordinate::Motor(dof)).unwrap_or(link[dof])).collect();
        let kept = (0..plant.effects().len()).filter(|&k| keeps(k));
        let own = kept.flat_map(|k| plant.own_states(k)).collect();
        Self { nv, driven: joints.to_vec(), coordinates, own, link, motor }
    }

    /// Number of positions.
    pub fn positions(&self) -> usize {
        self.coordinates.len()
    }

    /// Number of states.
    pub fn len(&self) -> usize {
        2 * self.positions() + self.own.len()
    }

    /// True if some link follows its load at once: then a link's coordinate counts with what such links behind it bend.
    pub fn follows(&self) -> bool {
        self.link.contains(&FOLLOWS)
    }

    /// True if the joint of `dof` is elastic.
    pub fn is_elastic(&self, dof: usize) -> bool {
        self.motor[dof] != self.link[dof]
    }

    /// Names of the positions.
    pub fn position_names(&self, plant: &Plant) -> Vec<String> {
        self.coordinates.iter().map(|c| c.name(plant)).collect()
    }

    /// Names of all states: `q.J`, `theta.J`, `v.LINK.K`; `qd.J`, `thetad.J`, `vd.LINK.K`; `z.EFFECT@PLACE.K`.
    pub fn names(&self, plant: &Plant) -> Vec<String> {
        let positions = self.position_names(plant);
        let rates: Vec<String> = positions.iter().map(|name| name.replacen('.', "d.", 1)).collect();
        let own = self.own.iter().map(|&z| {
            let effects = 0..plant.effects().len();
            let owner = effects.clone().find(|&k| plant.own_states(k).contains(&z));
            let k = owner.expect("every own state belongs to an effect");
            format!("z.{}.{}", plant.effects()[k].label(), z - plant.own_states(k).start)
        });
        let own: Vec<String> = own.collect();
        [positions, rates, own].concat()
    }

    /// Makes state `k` the variable of `direction`, or a constant again.
    pub fn seed(&self, x: &mut LinkState<Derivative>, k: usize, direction: usize, slope: f64) {
        let np = self.positions();
        let mark = |number: &mut Derivative| number.derivative[direction] = slope;
        let (q, theta, place) = match k {
            k if k < np => (&mut x.q, &mut x.theta, k),
            k if k < 2 * np => (&mut x.qd, &mut x.thetad, k - np),
            k => return mark(&mut x.z[self.own[k - 2 * np]]),
        };
        match self.coordinates[place] {
            Coordinate::Motor(dof) => mark(&mut theta[dof]),
            Coordinate::Link(dof) | Coordinate::Bend(dof) => {
                mark(&mut q[dof]);
                // A rigid joint's motor moves with it.
                if !self.is_elastic(dof) {
                    mark(&mut theta[dof]);
                }
            }
        }
    }
}
