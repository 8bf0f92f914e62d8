//! A base on springs: one map for base and joints.

use nalgebra::{Matrix3, Matrix6, Vector6};
use sinew_linear::{
    CartesianStiffness, UnderLoad, Wrench, cartesian_stiffness, equilibrium_under_load, on_springs,
};
use sinew_model::{Pose, Robot, Vector3};

use crate::robots::plant;
use crate::stiffness::{DOWN, six_joints};

const Q: [f64; 6] = [0.3, -0.4, 0.9, 0.2, -1.1, 0.5];

fn told(robot: &Robot, q: &[f64]) -> CartesianStiffness {
    let plant = plant(robot);
    cartesian_stiffness(&plant, &plant.parameters(), q, robot.tool).unwrap()
}

fn floor() -> Matrix6<f64> {
    let A = Matrix6::from_fn(|i, j| ((3 * i + 5 * j) as f64).sin() * 30.0);
    Matrix6::from_diagonal(&Vector6::new(4000.0, 5000.0, 9000.0, 2e5, 3e5, 8e5)) + A * A.transpose()
}

#[test]
fn compliances_of_base_and_joints_add_where_the_tool_is() {
    let robot = six_joints(Pose::identity(), Vector3::ZERO);
    let alone = told(&robot, &Q);
    let moved = on_springs(&robot, &floor());
    let q: Vec<f64> = [vec![0.0; 6], Q.to_vec()].concat();
    let both = told(&moved, &q);
    // X = [1 0; −[p]× 1]: a turn of the base shifts the tool by ω × p.
    let p = alone.pose.translation;
    let mut X = Matrix6::identity();
    let cross = nalgebra::Vector3::new(p.x, p.y, p.z).cross_matrix();
    X.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-cross));
    let want = alone.compliance + X * floor().try_inverse().unwrap() * X.transpose();
    let error = (both.compliance - want).amax();
    assert!(error < 1e-12 * want.amax(), "{error}");
    assert_eq!(
        &both.coordinates[..6],
        ["q.base.x", "q.base.y", "q.base.z", "q.base.rx", "q.base.ry", "q.base.rz"]
    );
    assert_eq!(both.elastic.len(), 12);
    assert_eq!(
        Matrix3::from_fn(|i, j| both.pose.rotation.rows[i].to_array()[j]),
        Matrix3::from_fn(|i, j| { alone.pose.rotation.rows[i].to_array()[j] })
    );
}

#[test]
fn a_stiff_floor_gives_back_the_robot_on_rock() {
    let robot = six_joints(Pose::identity(), DOWN);
    let alone = told(&robot, &Q).compliance_with_gravity.unwrap();
    let q: Vec<f64> = [vec![0.0; 6], Q.to_vec()].concat();
    let error = |factor: f64| {
        let C = told(&on_springs(&robot, &(floor() * factor)), &q).compliance_with_gravity.unwrap();
        (C - alone).amax()
    };
    // First order in 1/K.
    let order = (error(1e3) / error(1e4)).log10();
    assert!((order - 1.0).abs() < 0.01, "{order}");
}

#[test]
fn the_base_carries_its_weight_and_stands_where_it_stood() {
    let robot = on_springs(&six_joints(Pose::identity(), DOWN), &floor());
    let q: Vec<f64> = [vec![0.0; 6], Q.to_vec()].concat();
    let plant = plant(&robot);
    let p = plant.parameters();
    let unloaded = cartesian_stiffness(&plant, &p, &q, robot.tool).unwrap();
    // The springs under it are pressed by all that moves.
    let mass = robot.model.moving_mass();
    let pressed: f64 = (0..6).map(|k| unloaded.joint_stiffness[(2, k)] * unloaded.theta[k]).sum();
    assert!((pressed - 9.81 * mass).abs() < 1e-9 * pressed, "{pressed} {mass}");
    let load = Wrench::new(1.0, 0.0, 2.0, 10.0, 20.0, -30.0);
    let outcome = equilibrium_under_load(&plant, &p, &unloaded, robot.tool, &load).unwrap();
    let UnderLoad::Holds(there) = outcome else { panic!("{outcome:?}") };
    let linear = unloaded.compliance_with_gravity.unwrap() * load;
    assert!((there.deflection - linear).norm() < 0.1 * linear.norm());
}
