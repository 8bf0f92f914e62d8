//! Splitting a link changes nothing but that it bends.

use sinew_flex_link::extend;
use sinew_kinematics::body_poses;
use sinew_model::samples::random_tree;
use sinew_model::{BeamSection, Bending, Following, JointKind, LinkId, Robot, Vector3};
use sinew_rigid::{gravity, mass_matrix};

const ALGEBRA: f64 = 1e-11;

const BEAM: BeamSection = BeamSection {
    length: 0.3,
    flexural_rigidity: 80.0,
    torsional_rigidity: Some(30.0),
    mass_per_length: 0.0,
    polar_inertia_per_length: 0.0,
};

// Fixed bases: positions are numbers.
fn trees() -> impl Iterator<Item = (u64, Robot)> {
    (0..40).filter_map(|seed| {
        let model = random_tree(6, seed);
        let fixed = model.joints.iter().all(|j| !matches!(j.kind, JointKind::Floating));
        fixed.then(|| (seed, Robot::rigid(model)))
    })
}

#[test]
fn straight_links_are_the_rigid_robot() {
    let mut bent = 0;
    for (seed, mut robot) in trees() {
        for link in (1..robot.model.links.len()).step_by(2).map(LinkId) {
            let along = Some(Vector3::new(1.0, 0.0, 0.0));
            let mass = robot.model.links[link.0].inertia.mass;
            let rod = BeamSection { mass_per_length: 0.01 * mass, ..BEAM };
            robot.bending.push(Bending { along, ..Bending::beam(link, &['x', 'y', 'z'], 2, &[rod]) });
        }
        let Ok(extended) = extend(&robot) else { continue };
        bent += 1;
        let q: Vec<f64> = (0..robot.model.nq).map(|k| 0.3 + 0.2 * k as f64).collect();
        let at = extended.position(&q);
        let (M, all) = (mass_matrix(&robot.model, &q), mass_matrix(&extended.model, &at));
        let (g, held) = (gravity(&robot.model, &q), gravity(&extended.model, &at));
        for (i, &row) in extended.joints.iter().enumerate() {
            assert_eq!(robot.model.dof_name(i), extended.model.dof_name(row), "seed {seed}");
            assert!((g[i] - held[row]).abs() < ALGEBRA * g.amax(), "seed {seed}");
            for (j, &column) in extended.joints.iter().enumerate() {
                assert!((M[(i, j)] - all[(row, column)]).abs() < ALGEBRA * M.amax(), "seed {seed}");
            }
        }
        let (before, after) = (body_poses(&robot.model, &q), body_poses(&extended.model, &at));
        for (old, new) in robot.model.links.iter().zip(&extended.model.links) {
            let place = |poses: &[sinew_model::Pose<f64>], link: &sinew_model::Link| {
                let body = link.body.map_or(sinew_model::Pose::identity(), |id| poses[id.0]);
                (body * link.body_from_link).translation
            };
            assert_eq!(old.name, new.name);
            assert!((place(&before, old) - place(&after, new)).norm() < ALGEBRA, "seed {seed}: {}", old.name);
        }
    }
    assert!(bent > 5, "{bent} trees");
}

#[test]
fn damping_gives_the_first_mode_of_each_axis_its_ratio() {
    let beam = BeamSection { mass_per_length: 2.1, polar_inertia_per_length: 0.004, length: 0.8, ..BEAM };
    let mut robot = Robot::rigid(sinew_model::samples::planar_arm(1, 1.68, 0.8));
    robot.model.links[1].inertia.second_moment.xx = 0.0032;
    robot.model.joints[0].inertia.second_moment.xx = 0.0032;
    robot
        .bending
        .push(Bending { damping_ratio: 0.02, ..Bending::beam(LinkId(1), &['x', 'y', 'z'], 4, &[beam]) });
    let extended = extend(&robot).unwrap();
    let M = mass_matrix(&extended.model, &extended.position(&[0.0]));
    for axis in ['x', 'y', 'z'] {
        let group: Vec<_> = extended.virtual_joints.iter().filter(|v| v.axis == axis).collect();
        assert_eq!(group.len(), 4);
        assert!(group.iter().all(|v| v.following == Following::Dynamic));
        let scaled = nalgebra::DMatrix::from_fn(4, 4, |i, j| {
            M[(group[i].dof, group[j].dof)] / (group[i].stiffness * group[j].stiffness).sqrt()
        });
        let omega = scaled.symmetric_eigenvalues().max().sqrt().recip();
        for v in group {
            // ζ = D ω/2K
            let ratio = v.damping * omega / (2.0 * v.stiffness);
            assert!((ratio - 0.02).abs() < 1e-12, "{axis}: {ratio}");
        }
    }
}

#[test]
fn what_has_no_inertia_follows_its_load() {
    // Twist of a thin rod; a beam without mass; a base spring in a row with an elastic joint about the same axis.
    let beam = BeamSection { mass_per_length: 2.1, length: 0.8, ..BEAM };
    let following = |bending: Bending, elastic: bool| {
        let mut robot = Robot::rigid(sinew_model::samples::planar_arm(1, 1.68, 0.8));
        robot.joints[0].rotor_inertia = 0.1;
        robot.joints[0].stiffness = elastic.then_some(900.0);
        robot.bending.push(bending);
        let list = extend(&robot).unwrap().virtual_joints;
        list.iter().map(|v| (v.axis, v.following)).collect::<Vec<_>>()
    };
    use Following::{Dynamic, QuasiStatic};
    let rod = Bending::beam(LinkId(1), &['y', 'x'], 2, &[beam]);
    assert_eq!(
        following(rod, false),
        [('y', Dynamic), ('x', QuasiStatic), ('y', Dynamic), ('x', QuasiStatic)]
    );
    let massless = Bending::beam(LinkId(1), &['y'], 2, &[BeamSection { mass_per_length: 0.0, ..beam }]);
    assert_eq!(following(massless, false), [('y', QuasiStatic); 2]);
    let base =
        Bending { mass_per_length: 2.1, length: 0.8, ..Bending::base_spring(LinkId(1), &['y'], 100.0) };
    assert_eq!(following(base.clone(), false), [('y', Dynamic)]);
    assert_eq!(following(base, true), [('y', QuasiStatic)]);
}

#[test]
fn a_beam_that_does_not_fit_its_link_is_refused_with_both_numbers() {
    let refusal = |beam: BeamSection, mass: f64| {
        let mut robot = Robot::rigid(sinew_model::samples::planar_arm(1, mass, 0.8));
        robot.bending.push(Bending::beam(LinkId(1), &['y'], 2, &[beam]));
        extend(&robot).unwrap_err().to_string()
    };
    let beam = BeamSection { mass_per_length: 2.1, length: 0.8, ..BEAM };
    let text = refusal(beam, 1.5);
    assert!(
        text.starts_with("link \"link_1\": the beam does not fit into the link: mass (got 1.68"),
        "{text}"
    );
    assert!(text.contains("allowed 1.5 kg)") && text.contains("help:"), "{text}");
    let text = refusal(BeamSection { mass_per_length: 3.36, length: 0.5, ..BEAM }, 1.68);
    assert!(text.contains("centre of mass"), "{text}");
    let twist = BeamSection { torsional_rigidity: None, ..beam };
    let mut robot = Robot::rigid(sinew_model::samples::planar_arm(1, 1.68, 0.8));
    robot.bending.push(Bending::beam(LinkId(1), &['x'], 2, &[twist]));
    assert!(extend(&robot).unwrap_err().to_string().contains("state GJ"));
}
