//! Beams as robots, and what they do: tip deflection, slope, twist, frequencies.

use nalgebra::DMatrix;
use sinew_flex_link::{SpringKind, extend, lumped_springs};
use sinew_model::{
    BeamSection, Bending, Extended, Inertia, JointShape, JointSpec, LinkId, ModelBuilder, Pose, Robot,
    Vector3,
};
use sinew_rigid::mass_matrix;

/// The beam of the tables: E I = 1200 N·m², 0.8 m, 2.1 kg/m; G J = 350 N·m², 0.004 kg·m.
pub const BEAM: BeamSection = BeamSection {
    length: 0.8,
    flexural_rigidity: 1200.0,
    torsional_rigidity: Some(350.0),
    mass_per_length: 2.1,
    polar_inertia_per_length: 0.004,
};

/// What sits at an end.
#[derive(Debug, Clone, Copy, Default)]
pub struct Body {
    pub mass: f64,
    pub inertia: f64,
}

impl Body {
    pub fn as_inertia(self) -> Inertia<f64> {
        let i = self.inertia;
        Inertia::at_centre_of_mass(self.mass, Vector3::ZERO, [i, i, i, 0.0, 0.0, 0.0])
    }
}

/// How one link hangs on the one before.
#[derive(Debug, Clone, Copy)]
pub enum Hinge {
    /// Fixed at an angle about y, rad.
    Locked(f64),
    /// A joint about y at this angle, with a spring to rest, N·m/rad.
    Sprung(f64, f64),
}

/// A chain of beams along x, hinged about y; `bodies[k]` sits on the end of beam k, `hub` before the first.
pub fn chain(
    beams: &[(Hinge, Vec<BeamSection>)],
    hub: Body,
    bodies: &[Body],
    axes: &[char],
    springs: usize,
) -> Chain {
    let mut builder = ModelBuilder::new("beams");
    builder.link("base", Inertia::default());
    let (mut carrier, mut end, mut q, mut stiffness) = ("base".to_owned(), 0.0, Vec::new(), Vec::new());
    let mut names = Vec::new();
    for (k, (hinge, sections)) in beams.iter().enumerate() {
        let (name, root, tip) = (format!("beam_{k}"), format!("root_{k}"), format!("tip_{k}"));
        let at = |angle: f64| Pose::from_xyz_rpy([end, 0.0, 0.0], [0.0, angle, 0.0]);
        builder.link(&root, if k == 0 { hub.as_inertia() } else { Inertia::default() });
        builder.joint(match *hinge {
            Hinge::Locked(angle) => JointSpec::new(&root, JointShape::Fixed, &carrier, &root).at(at(angle)),
            Hinge::Sprung(angle, spring) => {
                q.push(angle);
                stiffness.push(spring);
                JointSpec::new(&root, JointShape::Revolute, &carrier, &root)
                    .at(at(0.0))
                    .about([0.0, 1.0, 0.0])
            }
        });
        builder.link(&name, rod(sections));
        builder.joint(JointSpec::new(&name, JointShape::Fixed, &root, &name));
        end = sections.iter().map(|s| s.length).sum();
        builder.link(&tip, bodies[k].as_inertia());
        let tip_pose = Pose::from_xyz_rpy([end, 0.0, 0.0], [0.0; 3]);
        builder.joint(JointSpec::new(&tip, JointShape::Fixed, &name, &tip).at(tip_pose));
        (carrier, end) = (tip, 0.0);
        names.push(name);
    }
    let model = builder.build().expect("a chain is a tree").with_gravity(Vector3::ZERO);
    let mut robot = Robot::rigid(model);
    for (name, (_, sections)) in names.iter().zip(beams) {
        let link = robot.model.link(name).expect("just built");
        robot.bending.push(Bending::beam(link, axes, springs, sections));
    }
    let tip = robot.model.link(&carrier).expect("just built");
    Chain { extended: extend(&robot).expect("the beam is the link"), q, stiffness, tip }
}

/// The inertia of a link that is a beam and nothing else.
pub fn rod(sections: &[BeamSection]) -> Inertia<f64> {
    let mut all = Inertia::default();
    let mut start = 0.0;
    for s in sections {
        let (m, l) = (s.mass_per_length * s.length, s.length);
        let across = m * l * l / 12.0;
        let moments = [s.polar_inertia_per_length * l, across, across, 0.0, 0.0, 0.0];
        all += Inertia::at_centre_of_mass(m, Vector3::new(start + l / 2.0, 0.0, 0.0), moments);
        start += l;
    }
    all
}

/// A chain of beams with its springs.
pub struct Chain {
    pub extended: Extended,
    pub q: Vec<f64>,
    pub stiffness: Vec<f64>,
    pub tip: LinkId,
}

impl Chain {
    /// The mass and the stiffness matrix where all springs are at rest.
    pub fn matrices(&self) -> (DMatrix<f64>, DMatrix<f64>) {
        let joints = DMatrix::from_diagonal(&nalgebra::DVector::from_row_slice(&self.stiffness));
        let K = sinew_flex_link::extended_stiffness(&self.extended, &joints);
        (mass_matrix(&self.extended.model, &self.extended.position(&self.q)), K)
    }

    /// Natural frequencies, rad/s, slowest first.
    pub fn frequencies(&self) -> Vec<f64> {
        let (M, K) = self.matrices();
        let L = M.cholesky().expect("every part has mass").l();
        let half = L.solve_lower_triangular(&K).expect("L has a diagonal");
        let W = L.solve_lower_triangular(&half.transpose()).expect("L has a diagonal");
        let mut squares: Vec<f64> =
            (0.5 * (&W + W.transpose())).symmetric_eigenvalues().iter().copied().collect();
        squares.sort_by(f64::total_cmp);
        squares.iter().map(|s| s.max(0.0).sqrt()).collect()
    }
}

/// A clamped beam with a body at its tip.
pub fn cantilever(springs: usize, axes: &[char], tip: Body) -> Chain {
    chain(&[(Hinge::Locked(0.0), vec![BEAM])], Body::default(), &[tip], axes, springs)
}

/// The deflection and the slope at the tip under a unit force and a unit moment there: [w_F, φ_F, w_T, φ_T].
pub fn tip_compliance(sections: &[BeamSection], springs: usize) -> [f64; 4] {
    let length: f64 = sections.iter().map(|s| s.length).sum();
    let springs = lumped_springs(sections, springs, SpringKind::Bending);
    let sum = |power| springs.iter().map(|s| (length - s.station).powi(power) / s.stiffness).sum::<f64>();
    [sum(2), sum(1), sum(1), sum(0)]
}
