//! Laws of Cartesian stiffness: invariance, coupled transmissions, limits, loads that a robot does not bear.

use nalgebra::{Matrix3, Matrix6, SymmetricEigen, Vector6};
use sinew_kinematics::{Axes, jacobian};
use sinew_linear::{
    CartesianStiffness, Loaded, LossOfStability, UnderLoad, Wrench, cartesian_stiffness, directions,
    equilibrium_under_load, stiffness_of,
};
use sinew_model::samples::{Random, planar_arm, random_tree};
use sinew_model::{
    Bending, Coupling, EffectSpec, Inertia, JointShape, JointSpec, LinkId, ModelBuilder, Place, Pose, Robot,
    Vector3,
};

use crate::robots::{planar_2r, plant};

/// A few operations on numbers of size one.
const ALGEBRA: f64 = 1e-12;

// Six joints in general position, so that rank is 6, elastic and heavy.
pub fn six_joints(base: Pose<f64>, gravity: Vector3<f64>) -> Robot {
    let mut random = Random::new(7);
    let mut builder = ModelBuilder::new("six");
    builder.link("world", Inertia::default());
    builder.link("base", Inertia::default());
    builder.joint(JointSpec::new("stand", JointShape::Fixed, "world", "base").at(base));
    for k in 1..=6 {
        let parent = if k == 1 { "base".to_owned() } else { format!("link_{}", k - 1) };
        builder.link(&format!("link_{k}"), random.inertia());
        let spec = JointSpec::new(&format!("joint_{k}"), JointShape::Revolute, &parent, &format!("link_{k}"));
        builder.joint(spec.about(random.direction().to_array()).at(random.pose()));
    }
    let mut robot = Robot::rigid(builder.build().unwrap().with_gravity(gravity));
    for (k, joint) in robot.joints.iter_mut().enumerate() {
        joint.stiffness = Some(900.0 - 100.0 * k as f64);
    }
    robot
}

const Q: [f64; 6] = [0.3, -0.4, 0.9, 0.2, -1.1, 0.5];
pub const DOWN: Vector3<f64> = Vector3 { x: 0.0, y: 0.0, z: -9.81 };

fn told(robot: &Robot, q: &[f64]) -> CartesianStiffness {
    let plant = plant(robot);
    cartesian_stiffness(&plant, &plant.parameters(), q, robot.tool).unwrap()
}

fn under(robot: &Robot, q: &[f64], load: Wrench) -> UnderLoad {
    let plant = plant(robot);
    let p = plant.parameters();
    let unloaded = cartesian_stiffness(&plant, &p, q, robot.tool).unwrap();
    equilibrium_under_load(&plant, &p, &unloaded, robot.tool, &load).unwrap()
}

fn held(robot: &Robot, q: &[f64], load: Wrench) -> Loaded {
    match under(robot, q, load) {
        UnderLoad::Holds(told) => *told,
        UnderLoad::GivesWay(critical) => panic!("{critical:?}"),
    }
}

fn gives_way(robot: &Robot, q: &[f64], load: Wrench) -> sinew_linear::Critical {
    match under(robot, q, load) {
        UnderLoad::GivesWay(critical) => critical,
        UnderLoad::Holds(told) => panic!("{told:?}"),
    }
}

fn near(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b}");
}

#[test]
fn turning_the_base_turns_the_map_and_changes_nothing_else() {
    let stand = Pose::from_xyz_rpy([0.7, -0.2, 1.3], [0.4, -0.8, 2.1]);
    let there = Matrix3::from_fn(|i, j| stand.rotation.rows[i].to_array()[j]);
    // Gravity turns with the base: the same robot seen from another place.
    let down = stand.rotation * DOWN;
    let (here, moved) = (six_joints(Pose::identity(), DOWN), six_joints(stand, down));
    let (a, b) = (told(&here, &Q), told(&moved, &Q));
    let mut R = Matrix6::zeros();
    R.fixed_view_mut::<3, 3>(0, 0).copy_from(&there);
    R.fixed_view_mut::<3, 3>(3, 3).copy_from(&there);
    let turned = |C: &Matrix6<f64>| R * C * R.transpose();
    let close = |x: Matrix6<f64>, y: Matrix6<f64>| assert!((x - y).amax() < ALGEBRA * y.amax(), "{x} {y}");
    close(b.compliance, turned(&a.compliance));
    close(b.compliance_with_gravity.unwrap(), turned(&a.compliance_with_gravity.unwrap()));
    let (pa, pb) = (directions(&a.compliance), directions(&b.compliance));
    assert_eq!(pa.rank, 6);
    for k in 0..3 {
        near(pa.translation[k].compliance, pb.translation[k].compliance, ALGEBRA);
        near(pa.rotation[k].compliance, pb.rotation[k].compliance, ALGEBRA);
    }
    // And under a load that turns with it.
    let load = Wrench::new(1.0, -2.0, 0.5, 30.0, -20.0, 10.0);
    let (x, y) = (held(&here, &Q, load), held(&moved, &Q, R * load));
    assert!((y.deflection - R * x.deflection).amax() < 1e-11 * x.deflection.amax());
    let error = (y.compliance - turned(&x.compliance)).amax();
    assert!(error < 1e-11 * x.compliance.amax(), "{error}");
}

#[test]
fn the_wrench_that_a_displacement_needs_is_the_stiffness_with_its_geometric_term() {
    // ∂w/∂x of the whole nonlinear equilibrium, by differences of a fourth order in w.
    let robot = six_joints(Pose::identity(), DOWN);
    let load = Wrench::new(0.0, 0.0, 0.0, 360.0, -240.0, -450.0);
    let there = held(&robot, &Q, load);
    let mut C = Matrix6::zeros();
    for k in 0..6 {
        let h = if k < 3 { 0.2 } else { 1.0 };
        let at = |steps: f64| {
            let mut w = load;
            w[k] += steps * h;
            let next = held(&robot, &Q, w);
            // A small turn from the loaded place, not from the unloaded one.
            let plant = plant(&robot);
            let pose = |q: &[f64]| sinew_kinematics::link_pose(plant.model(), q, robot.tool);
            let (a, b) = (pose(&there.q), pose(&next.q));
            let turn = b.rotation * a.rotation.transpose();
            let r = turn.rows;
            let half = [r[2].y - r[1].z, r[0].z - r[2].x, r[1].x - r[0].y].map(|x| 0.5 * x);
            // sin of the angle against the angle
            let sine = Vector3::from(half).norm();
            let factor = if sine > 0.0 { sine.asin() / sine } else { 1.0 };
            let shift = b.translation - a.translation;
            Vector6::new(half[0] * factor, half[1] * factor, half[2] * factor, shift.x, shift.y, shift.z)
        };
        let slope = ((at(1.0) - at(-1.0)) * 8.0 - (at(2.0) - at(-2.0))) / (12.0 * h);
        C.set_column(k, &slope);
    }
    let K = stiffness_of(&there.compliance).unwrap();
    let numerical = C.try_inverse().unwrap();
    let error = (K - numerical).amax() / K.amax();
    assert!(error < 1e-6, "{error}");
    let classical = stiffness_of(&there.classical_compliance).unwrap();
    let missed = (classical - numerical).amax() / K.amax();
    assert!(missed > 0.05, "the classical map should be wrong by more than {missed}");
}

#[test]
fn a_force_has_a_potential_and_a_moment_has_none() {
    let robot = six_joints(Pose::identity(), DOWN);
    let skew = |load| {
        let G = held(&robot, &Q, load).geometric_stiffness;
        (&G - G.transpose()).amax() / G.amax()
    };
    assert!(skew(Wrench::new(0.0, 0.0, 0.0, 50.0, -30.0, 20.0)) < ALGEBRA);
    assert!(skew(Wrench::new(20.0, -10.0, 15.0, 0.0, 0.0, 0.0)) > 0.1);
}

#[test]
fn small_loads_follow_the_linear_map_and_the_error_falls_with_the_load() {
    let robot = six_joints(Pose::identity(), DOWN);
    let map = told(&robot, &Q).compliance_with_gravity.unwrap();
    let error = |size: f64| {
        let load = Wrench::new(0.1, 0.2, -0.1, 1.0, -1.0, 0.5) * size;
        let x = held(&robot, &Q, load).deflection;
        (map * load - x).norm() / x.norm()
    };
    // First order in the load.
    let order = (error(1.0) / error(0.1)).log10();
    near(order, 1.0, 0.05);
}

#[test]
fn coupled_transmissions_enter_with_their_whole_matrix() {
    let mut robot = planar_2r();
    let K = [150.0, 40.0, 40.0, 100.0];
    robot.couplings.push(Coupling { dofs: vec![0, 1], stiffness: K.to_vec(), damping: vec![0.0; 4] });
    robot.model = robot.model.with_gravity(Vector3::ZERO);
    let q = [0.4, 0.9];
    let told = told(&robot, &q);
    assert_eq!(told.joint_stiffness.as_slice(), K);
    let J = jacobian(&robot.model, &q, robot.tool, Axes::WorldAligned);
    let det = K[0] * K[3] - K[1] * K[1];
    let inverse = nalgebra::Matrix2::new(K[3] / det, -K[1] / det, -K[1] / det, K[0] / det);
    let want = &J * inverse * J.transpose();
    assert!((told.compliance - want).amax() < ALGEBRA * want.amax());
}

#[test]
fn a_bending_link_is_a_spring_in_series_with_its_joint() {
    // One spring at the foot of the link, about the joint's own axis: 1/K + 1/k_φ, and k_tip = k_φ/L² alone.
    let (K, k, length) = (900.0, 400.0, 0.7);
    let robot = |joint: Option<f64>, bends: bool| {
        let mut robot = Robot::rigid(planar_arm(2, 1.0, length));
        robot.joints[0].stiffness = joint;
        if bends {
            let mut spring = Bending::base_spring(LinkId(1), &['y'], k);
            (spring.length, spring.mass_per_length) = (length, 0.5);
            robot.bending.push(spring);
        }
        robot
    };
    let q = [0.0, 0.3];
    let alone = told(&robot(None, true), &q);
    assert_eq!(alone.coordinates, ["v.link_1.1"]);
    let both = robot(Some(K), true);
    let told_both = told(&both, &q);
    assert_eq!(told_both.coordinates, ["q.joint_1", "v.link_1.1"]);
    // Weightless, so that the link is level.
    let weightless = |mut robot: Robot| {
        robot.model.gravity = Vector3::ZERO;
        robot
    };
    let rise = |robot: Robot| told(&weightless(robot), &q).compliance[(5, 5)];
    near(rise(robot(None, true)), length * length / k, ALGEBRA);
    near(rise(both.clone()), length * length * (1.0 / K + 1.0 / k), ALGEBRA);
    // Under a large load it goes where one joint with both springs in series goes.
    let series = robot(Some(K * k / (K + k)), false);
    let load = Wrench::new(0.0, 5.0, 0.0, 40.0, 0.0, -150.0);
    let (a, b) = (held(&weightless(both), &q, load), held(&weightless(series), &q, load));
    assert!((a.deflection - b.deflection).amax() < ALGEBRA, "{} {}", a.deflection, b.deflection);
    assert!((a.compliance - b.compliance).amax() < ALGEBRA * b.compliance.amax());
    assert!(b.deflection[5] < -0.1);
}

#[test]
fn a_quasi_static_link_gives_way_as_one_with_mass() {
    let robot = |mass_per_length: f64| {
        let mut robot = Robot::rigid(planar_arm(2, 1.0, 0.7));
        robot.joints[0].stiffness = Some(900.0);
        let mut spring = Bending::base_spring(LinkId(1), &['y'], 400.0);
        (spring.length, spring.mass_per_length) = (0.7, mass_per_length);
        robot.bending.push(spring);
        robot.model.gravity = Vector3::ZERO;
        robot
    };
    let load = Wrench::new(0.0, 5.0, 0.0, 40.0, 0.0, -150.0);
    let (a, b) = (held(&robot(0.0), &[0.1, 0.3], load), held(&robot(0.5), &[0.1, 0.3], load));
    assert!((a.deflection - b.deflection).amax() < ALGEBRA);
}

#[test]
fn rigid_joints_stand_still() {
    let mut robot = six_joints(Pose::identity(), DOWN);
    (robot.joints[1].stiffness, robot.joints[4].stiffness) = (None, None);
    let told = told(&robot, &Q);
    assert_eq!(told.elastic, [0, 2, 3, 5]);
    assert_eq!(directions(&told.compliance).rank, 4);
    assert_eq!(stiffness_of(&told.compliance), None);
    let there = held(&robot, &Q, Wrench::new(0.0, 0.0, 0.0, 10.0, 20.0, 30.0));
    assert_eq!((there.q[1], there.q[4]), (Q[1], Q[4]));
    assert_ne!(there.q[0], Q[0]);
    let rigid = Robot::rigid(planar_arm(2, 1.0, 0.5));
    assert_eq!(self::told(&rigid, &[0.1, 0.2]).compliance, Matrix6::zeros());
    assert_eq!(held(&rigid, &[0.1, 0.2], Wrench::repeat(5.0)).deflection, Vector6::zeros());
}

#[test]
fn trees_with_branches_give_way_where_the_link_is_carried() {
    for seed in 0..6 {
        let mut robot = Robot::rigid(random_tree(9, seed));
        if robot.model.nq != robot.model.nv {
            continue;
        }
        robot.joints.iter_mut().for_each(|j| j.stiffness = Some(700.0));
        let q = Random::new(seed).position(&robot.model);
        let told = told(&robot, &q);
        // Other branches have no column, and no say.
        let J = jacobian(&robot.model, &q, robot.tool, Axes::WorldAligned);
        assert_eq!(told.jacobian.as_slice(), J.as_slice());
        let want = &J * J.transpose() / 700.0;
        assert!((told.compliance - want).amax() < ALGEBRA * want.amax());
    }
}

#[test]
fn gravity_stiffens_what_hangs_and_softens_what_stands() {
    let robot = |stiffness| {
        let mut robot = Robot::rigid(sinew_model::samples::hanging_link(0.5, 2.0, 0.4));
        robot.joints[0].stiffness = Some(stiffness);
        robot
    };
    let (mgl, pi) = (2.0 * 9.81 * 0.4, core::f64::consts::PI);
    let C = |q| told(&robot(150.0), &[q]).compliance_with_gravity.unwrap()[(1, 1)];
    near(C(0.0), 1.0 / (150.0 + mgl), 1e-15);
    near(C(pi), 1.0 / (150.0 - mgl), 1e-15);
    // Springs weaker than gravity: upright it does not stay.
    let soft = told(&robot(5.0), &[pi]);
    assert!(!soft.stable && told(&robot(5.0), &[0.0]).stable);
    let critical = gives_way(&robot(5.0), &[pi], Wrench::new(0.0, 0.0, 0.0, 1.0, 0.0, 0.0));
    assert_eq!((critical.kind, critical.factor), (LossOfStability::Unloaded, 0.0));
}

#[test]
fn a_column_on_springs_buckles_where_its_stiffness_is_used_up() {
    // det(K − F [[L1 + L2, L2], [L2, L2]]) = 0
    let mut robot = planar_2r();
    robot.model = robot.model.with_gravity(Vector3::ZERO);
    // The frame of the lower rod is its start: the tip needs a link of its own.
    let (l1, l2) = (0.5, 0.4);
    robot = with_tip(&robot, l2);
    let S = nalgebra::Matrix2::new(l1 + l2, l2, l2, l2);
    let half = nalgebra::Matrix2::new(1.0 / 150.0_f64.sqrt(), 0.0, 0.0, 1.0 / 100.0_f64.sqrt());
    let exact = 1.0 / SymmetricEigen::new(half * S * half).eigenvalues.max();
    let critical = gives_way(&robot, &[0.0, 0.0], Wrench::new(0.0, 0.0, 0.0, -1000.0, 0.0, 0.0));
    assert_eq!(critical.kind, LossOfStability::Buckling);
    near(1000.0 * critical.factor, exact, 1e-5 * exact);
    // Bent a little it yields earlier and more and more, but does not fall.
    let bent = held(&robot, &[0.02, 0.01], Wrench::new(0.0, 0.0, 0.0, -exact, 0.0, 0.0));
    assert!(bent.deflection[5].abs() > 0.3);
}

fn with_tip(robot: &Robot, length: f64) -> Robot {
    let mut builder = ModelBuilder::new("column");
    builder.link("base", Inertia::default());
    let joint = |name, parent, child, x| {
        let spec = JointSpec::new(name, JointShape::Revolute, parent, child).about([0.0, -1.0, 0.0]);
        spec.at(Pose::from_xyz_rpy([x, 0.0, 0.0], [0.0; 3]))
    };
    builder
        .link("upper", Inertia::default())
        .link("lower", Inertia::default())
        .link("tip", Inertia::default());
    builder.joint(joint("shoulder", "base", "upper", 0.0)).joint(joint("elbow", "upper", "lower", 0.5));
    let end = JointSpec::new("end", JointShape::Fixed, "lower", "tip");
    builder.joint(end.at(Pose::from_xyz_rpy([length, 0.0, 0.0], [0.0; 3])));
    let mut column = Robot::rigid(builder.build().unwrap().with_gravity(robot.model.gravity));
    column.joints.clone_from(&robot.joints);
    column
}

#[test]
fn a_hanging_link_on_a_weak_spring_is_turned_over_at_its_limit_moment() {
    // k α + m g l sin α = M is largest where cos α = −k/(m g l).
    let (k, mgl) = (5.0, 2.0 * 9.81 * 0.4);
    let mut robot = Robot::rigid(sinew_model::samples::hanging_link(0.5, 2.0, 0.4));
    robot.joints[0].stiffness = Some(k);
    let angle = (-k / mgl).acos();
    let limit = k * angle + mgl * angle.sin();
    // The joint turns about −y.
    let moment = |M: f64| Wrench::new(0.0, -M, 0.0, 0.0, 0.0, 0.0);
    let critical = gives_way(&robot, &[0.0], moment(40.0));
    assert_eq!((critical.kind, critical.joint.as_str()), (LossOfStability::LimitPoint, "joint"));
    near(40.0 * critical.factor, limit, 1e-4 * limit);
    // A little less it bears, close to where it would give way.
    let there = held(&robot, &[0.0], moment(0.999 * limit));
    near(k * there.q[0] + mgl * there.q[0].sin(), 0.999 * limit, 1e-9);
    assert!(there.q[0] > 2.0 && there.q[0] < angle);
}

#[test]
fn a_gear_inside_its_gap_has_no_stiffness_and_is_named() {
    let mut robot = planar_2r();
    robot.model = robot.model.with_gravity(Vector3::ZERO);
    let gap = EffectSpec::new("backlash", Place::Joint("elbow".into())).with("half_width", 1e-3);
    robot.effects.push(gap);
    let plant = plant(&robot);
    let error = cartesian_stiffness(&plant, &plant.parameters(), &[0.1, 0.2], robot.tool).unwrap_err();
    let message = error.to_string();
    assert!(message.starts_with("joint \"elbow\": its spring has no stiffness"), "{message}");
}

#[test]
fn a_spring_that_hardens_counts_with_its_slope_under_its_own_weight() {
    let (stiffness, cubic, q) = (150.0, 1e6, 0.4_f64);
    let mut robot = Robot::rigid(sinew_model::samples::hanging_link(0.5, 2.0, 0.4));
    robot.joints[0].stiffness = Some(stiffness);
    let hardening = EffectSpec::new("stiffness_hardening", Place::Joint("joint".into()));
    robot.effects.push(hardening.with("cubic", cubic));
    let told = told(&robot, &[q]);
    let delta = told.theta[0] - q;
    near(stiffness * delta + cubic * delta.powi(3), 2.0 * 9.81 * 0.4 * q.sin(), 1e-10);
    near(told.joint_stiffness[(0, 0)], stiffness + 3.0 * cubic * delta * delta, 1e-9);
}
