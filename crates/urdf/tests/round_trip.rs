//! What is written reads back, and what the author wrote stays.

mod difference;

use std::fs;
use std::path::PathBuf;

use difference::difference;
use sinew_model::{
    EffectSpec, Inertia, JointShape, JointSpec, Limits, ModelBuilder, Place, Pose, Setting, Trust, Vector3,
};
use sinew_urdf::{Sidecar, parse_robot, parse_urdf, read_robot, write_urdf};

const URDF: &str = include_str!("arm/arm.urdf");
const SIDECAR: &str = include_str!("arm/arm.sinew.toml");

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("sinew-urdf-{name}-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn joint(name: &str) -> Place {
    Place::Joint(name.to_owned())
}

#[test]
fn everything_a_sidecar_says_arrives_in_the_robot() {
    let robot = parse_robot(URDF, SIDECAR, "arm").unwrap().robot;
    assert_eq!(robot.model.gravity, Vector3::new(0.0, 0.0, -9.80665));
    assert_eq!(robot.tool, robot.model.link("flange").unwrap());
    assert_eq!(robot.trust, Trust::Exact);
    let [shoulder, elbow] = &robot.joints[..] else { panic!("two joints") };
    assert_eq!((shoulder.stiffness, shoulder.damping, shoulder.rotor_inertia), (Some(150.0), 0.5, 0.05));
    assert_eq!((shoulder.gear_ratio, shoulder.rotor_axis), (Some(100.0), Some([0.0, 1.0, 0.0])));
    assert_eq!(shoulder.carried_by, robot.model.link("base"));
    assert_eq!((elbow.stiffness, elbow.rotor_inertia, elbow.torque_constant), (None, 0.01, Some(7.5)));
    let bending = &robot.bending[0];
    assert_eq!(
        (bending.link, bending.springs, &bending.axes[..]),
        (robot.model.link("forearm").unwrap(), 3, &['y', 'z'][..])
    );
    assert_eq!((bending.length, bending.flexural_rigidity, bending.stiffness), (0.4, Some(1200.0), None));
    let kinds: Vec<_> = robot.effects.iter().map(|e| (e.kind.as_str(), e.place.to_string())).collect();
    let expected = [
        ("viscous_friction", "shoulder"),
        ("coulomb_friction", "shoulder"),
        ("payload", "robot"),
        ("contact", "flange"),
    ];
    assert_eq!(kinds, expected.map(|(k, p)| (k, p.to_owned())));
    assert_eq!(robot.effects[3].get("side"), Some(&Setting::Word("above".to_owned())));
    assert_eq!(robot.effects[2].get("first_moment"), Some(&Setting::Numbers(vec![0.0, 0.0, 0.04])));
}

#[test]
fn the_sidecar_overrules_the_friction_of_the_urdf() {
    let alone = parse_robot(URDF, "format = 1", "arm").unwrap().robot;
    assert_eq!(alone.effects[1].number("coulomb"), Some(1.5));
    let together = parse_robot(URDF, SIDECAR, "arm").unwrap().robot;
    let coulomb: Vec<_> = together.effects.iter().filter(|e| e.kind == "coulomb_friction").collect();
    assert_eq!(coulomb.len(), 1);
    assert_eq!(coulomb[0].number("coulomb"), Some(2.1));
}

#[test]
fn a_sidecar_is_written_back_byte_for_byte() {
    let folder = folder("bytes");
    for text in [SIDECAR.to_owned(), SIDECAR.replace('\n', "\r\n"), SIDECAR.trim_end().to_owned()] {
        let path = folder.join("arm.sinew.toml");
        parse_robot(URDF, &text, "arm").unwrap().sidecar.write(&path).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
        fs::write(folder.join("arm.urdf"), URDF).unwrap();
        read_robot(&path).unwrap().sidecar.write(&path).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
    }
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_change_touches_its_own_lines_only() {
    let mut sidecar = parse_robot(URDF, SIDECAR, "arm").unwrap().sidecar;
    sidecar.set_joint("shoulder", "stiffness", 150.0);
    assert_eq!(sidecar.text(), SIDECAR, "an equal value stays as it is written");
    sidecar.set_joint("shoulder", "stiffness", 0.1 + 0.2);
    sidecar.set_joint("elbow", "stiffness", 1e-7);
    let friction = EffectSpec::new("coulomb_friction", joint("shoulder")).with("coulomb", 2.5);
    sidecar.set_effect(&friction);
    let expected = SIDECAR
        .replace("stiffness = 150  ", "stiffness = 0.30000000000000004  ")
        .replace("torque_constant = 7.5\n", "torque_constant = 7.5\nstiffness = 1e-7\n")
        .replace("coulomb = 2.1  ", "coulomb = 2.5  ")
        .replace("coulomb_std = 0.03\n", "");
    assert_eq!(sidecar.text(), expected);
}

#[test]
fn a_new_effect_is_appended_and_a_removed_one_leaves_the_rest() {
    let mut sidecar = parse_robot(URDF, SIDECAR, "arm").unwrap().sidecar;
    let backlash = EffectSpec::new("backlash", joint("elbow")).with("half_width", 0.001);
    sidecar.set_effect(&backlash);
    let appended = "\n[[effects]]\nkind = \"backlash\"\njoint = \"elbow\"\nhalf_width = 0.001\n";
    assert_eq!(sidecar.text(), format!("{SIDECAR}{appended}"));
    assert!(sidecar.remove_effect("backlash", &joint("elbow")));
    assert!(!sidecar.remove_effect("backlash", &joint("elbow")));
    assert!(!sidecar.remove_effect("coulomb_friction", &joint("elbow")));
    assert_eq!(sidecar.text(), SIDECAR);
    assert!(sidecar.remove_effect("contact", &Place::Link("flange".to_owned())));
    assert!(sidecar.text().contains("what the gripper weighs"));
}

#[test]
fn inline_tables_and_dotted_keys_are_changed_where_they_stand() {
    let inline = "format = 1\njoints = { shoulder = { stiffness = 10 } } # short\neffects = [{ kind = \"backlash\", joint = \"elbow\", half_width = 0.1 }]\n";
    let dotted = "format = 1\njoints.shoulder.stiffness = 10\n";
    for text in [inline, dotted] {
        let mut sidecar = parse_robot(URDF, text, "arm").unwrap().sidecar;
        sidecar.set_joint("shoulder", "stiffness", 20.0);
        sidecar.set_joint("elbow", "stiffness", 30.0);
        sidecar.set_effect(&EffectSpec::new("backlash", joint("elbow")).with("half_width", 0.2));
        sidecar.set_effect(&EffectSpec::new("backlash", joint("shoulder")).with("half_width", 0.3));
        let robot = parse_robot(URDF, &sidecar.text(), "arm").unwrap_or_else(|e| panic!("{e}")).robot;
        let stiffness: Vec<_> = robot.joints.iter().map(|j| j.stiffness).collect();
        assert_eq!(stiffness, [Some(20.0), Some(30.0)]);
        let widths: Vec<_> = robot.effects.iter().filter_map(|e| e.number("half_width")).collect();
        assert_eq!(widths, [0.2, 0.3]);
    }
}

#[test]
fn a_sidecar_written_by_us_reads_back_to_an_equal_robot() {
    let folder = folder("equal");
    fs::write(folder.join("arm.urdf"), URDF).unwrap();
    let mut file = read_robot(&folder.join("arm.urdf")).unwrap();
    assert!(file.sidecar.file().ends_with("arm.sinew.toml"));
    let mut robot = file.robot.clone();
    let values = [1.0 / 3.0, 1e300, 5e-324, 1e16, 0.05];
    for value in values {
        robot.joints[0].stiffness = Some(value);
        file.sidecar.set_joint("shoulder", "stiffness", value);
        let mut effect = EffectSpec::new("torque_ripple", joint("elbow"));
        effect.settings.push(("sine".to_owned(), Setting::Number(value)));
        effect.settings.push(("list".to_owned(), Setting::Numbers(vec![value, -value])));
        effect.settings.push(("word".to_owned(), Setting::Word("a \"quoted\" word".to_owned())));
        robot.effects.retain(|e| e.kind != "torque_ripple");
        robot.effects.push(effect.clone());
        file.sidecar.set_effect(&effect);
        file.sidecar.write(&folder.join("arm.sinew.toml")).unwrap();
        assert_eq!(read_robot(&folder.join("arm.urdf")).unwrap().robot, robot);
        assert_eq!(read_robot(&folder.join("arm.sinew.toml")).unwrap().robot, robot);
    }
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn effects_that_differ_in_words_stand_beside_each_other() {
    let folder = folder("words");
    fs::write(folder.join("arm.urdf"), URDF).unwrap();
    let mut sidecar = read_robot(&folder.join("arm.urdf")).unwrap().sidecar;
    let offset = |value| EffectSpec::new("torque_sensor_offset", joint("elbow")).with("offset", value);
    let behind = |value| offset(value).said("signal", "joint_torque");
    for effect in [offset(0.4), behind(-0.1), offset(0.5), behind(-0.2)] {
        sidecar.set_effect(&effect);
    }
    sidecar.write(&folder.join("arm.sinew.toml")).unwrap();
    let mut read = read_robot(&folder.join("arm.sinew.toml")).unwrap().robot.effects;
    read.retain(|e| e.kind == "torque_sensor_offset");
    assert_eq!(read, [offset(0.5), behind(-0.2)]);
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_sidecar_written_to_another_folder_still_finds_its_urdf() {
    let folder = folder("moved");
    fs::create_dir_all(folder.join("fits/today")).unwrap();
    fs::write(folder.join("arm.urdf"), URDF).unwrap();
    fs::write(folder.join("arm.sinew.toml"), SIDECAR).unwrap();
    let file = read_robot(&folder.join("arm.sinew.toml")).unwrap();
    let path = folder.join("fits/today/better.sinew.toml");
    file.sidecar.write(&path).unwrap();
    assert!(fs::read_to_string(&path).unwrap().contains("urdf = \"../../arm.urdf\"\n"));
    assert_eq!(read_robot(&path).unwrap().robot, file.robot);
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_value_that_is_not_finite_is_never_written() {
    let folder = folder("nan");
    let path = folder.join("arm.sinew.toml");
    let mut sidecar = Sidecar::new_for("arm.urdf");
    sidecar.set_joint("elbow", "stiffness", f64::NAN);
    let message = sidecar.write(&path).unwrap_err().to_string();
    assert!(message.contains(":5:13: a value is not finite (got NaN, allowed: finite numbers)"), "{message}");
    assert!(!path.exists());
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_model_of_every_joint_kind_reads_back_to_itself() {
    let mut builder = ModelBuilder::new("zoo & \"friends\"");
    let body = |m: f64| {
        Inertia::at_centre_of_mass(m, Vector3::new(0.1, -0.2, 0.3), [0.03, 0.02, 0.04, 0.001, 0.002, -0.003])
    };
    for (k, name) in ["root", "truck", "mast", "tool", "finger", "thumb", "camera", "bird"].iter().enumerate()
    {
        builder.link(name, if k == 3 { Inertia::default() } else { body(k as f64 + 0.5) });
    }
    let pose = Pose::from_xyz_rpy([0.1, 0.2, -0.3], [0.4, std::f64::consts::FRAC_PI_2, -0.7]);
    let new = |name, shape, parent, child| JointSpec::new(name, shape, parent, child).at(pose);
    builder.joint(new("drive", JointShape::Planar, "root", "truck").about([0.1, 0.2, 1.0]));
    builder.joint(new("lift", JointShape::Prismatic, "truck", "mast").about([0.0, 0.6, 0.8]));
    builder.joint(new("mount", JointShape::Fixed, "mast", "tool"));
    let mut finger = new("finger", JointShape::Revolute, "tool", "finger").about([1.0, 1.0, 0.0]);
    finger.limits = Limits { lower: -1.0, upper: 1.0 / 3.0, velocity: 2.0, effort: 1e3 };
    let mut thumb = new("thumb", JointShape::Revolute, "tool", "thumb");
    thumb.mimic = Some(("finger".to_owned(), -0.5, 0.1));
    builder.joint(thumb).joint(finger);
    builder.joint(new("eye", JointShape::Fixed, "tool", "camera"));
    builder.joint(new("flight", JointShape::Floating, "root", "bird"));
    let model = builder.build().unwrap();
    let back = parse_urdf(&write_urdf(&model), "zoo.urdf").unwrap_or_else(|e| panic!("{e}")).model;
    assert!(difference(&model, &back) < 1e-12);
}
