//! What is wrong with a URDF is said with place, value, allowed values and a way out.

use std::path::Path;

use sinew_urdf::{Severity, parse_robot, parse_urdf, read_robot, read_urdf};

const URDF: &str = include_str!("arm/arm.urdf");

fn message(urdf: &str) -> String {
    parse_urdf(urdf, "arm.urdf").unwrap_err().to_string()
}

fn changed(from: &str, to: &str) -> String {
    assert!(URDF.contains(from), "{from}");
    message(&URDF.replacen(from, to, 1))
}

#[test]
fn a_missing_file_is_named() {
    for path in ["no/such.urdf", "no/such.sinew.toml"] {
        let message = read_robot(Path::new(path)).unwrap_err().to_string();
        assert!(message.starts_with(&format!("{path}: cannot be read (")), "{message}");
        assert!(message.ends_with("help: check the path and the permissions"));
    }
    assert!(read_urdf(Path::new("no/such.urdf")).is_err());
    let no_text = std::env::temp_dir().join(format!("sinew_no_text_{}.urdf", std::process::id()));
    std::fs::write(&no_text, [0xFF, 0xFE, 0x00]).unwrap();
    let message = read_robot(&no_text).unwrap_err().to_string();
    std::fs::remove_file(&no_text).unwrap();
    assert!(message.ends_with("a URDF (XML) or a sidecar (TOML), in UTF-8"), "{message}");
}

#[test]
fn text_that_is_no_xml_is_placed() {
    assert_eq!(
        changed("    <child link=\"upper\"/>", "    <child link=\"upper\">"),
        "arm.urdf:26:3: not well-formed XML: expected 'child' tag, not 'joint'\n  help: close every element and quote every attribute"
    );
    assert_eq!(
        message(""),
        "arm.urdf:1:1: not well-formed XML: the document does not have a root node\n  help: close every element and quote every attribute"
    );
    assert!(message("solid cube\n").starts_with("arm.urdf:1:1: not well-formed XML: "));
}

#[test]
fn xml_that_is_no_urdf_is_refused() {
    assert_eq!(
        message("<?xml version=\"1.0\"?>\n<sdf version=\"1.6\"/>"),
        "arm.urdf:2:1: not a URDF: the root element is <sdf> (allowed: <robot>)\n  help: name a URDF file; SDF, MJCF and COLLADA need a converter first"
    );
    let macros = "<robot xmlns:xacro=\"http://wiki.ros.org/xacro\">\n  <xacro:include filename=\"arm.xacro\"/>\n</robot>";
    assert_eq!(
        message(macros),
        "arm.urdf:2:3: not a URDF: it holds the unexpanded macro <xacro:include>\n  help: expand it first: xacro FILE.xacro > FILE.urdf"
    );
}

#[test]
fn a_urdf_without_any_inertia_is_refused() {
    assert_eq!(
        message("<robot name=\"bare\"><link name=\"base\"/></robot>"),
        "arm.urdf: no link of robot \"bare\" has an <inertial>: dynamics is impossible\n  help: add <inertial> with mass and inertia to the moving links, or use a description that has them"
    );
}

#[test]
fn a_massless_end_is_an_error_only_where_the_mass_matrix_is_singular() {
    let bare = URDF.replace("<child link=\"flange\"/>", "<child link=\"flange\"/><axis xyz=\"1 0 0\"/>");
    let bare = bare.replace("name=\"flange_fixed\" type=\"fixed\"", "name=\"roll\" type=\"continuous\"");
    let read = parse_urdf(&bare, "arm.urdf").unwrap();
    assert!(read.notes.iter().any(|n| {
        n.severity == Severity::Note
            && n.statement == "link \"flange\" moves but has neither mass nor inertia"
    }));
    assert_eq!(
        parse_robot(&bare, "format = 1", "arm").unwrap_err().to_string(),
        "arm.urdf:33:3: joint \"roll\" moves no inertia: the mass matrix is singular\n  help: give link \"flange\" or what it carries an <inertial>, or give the joint a rotor_inertia in the sidecar"
    );
    let rotor = "format = 1\n[joints.roll]\nrotor_inertia = 0.01\n";
    assert!(parse_robot(&bare, rotor, "arm").is_ok());
    // Behind a spring the rotor does not help the link.
    let sprung = format!("{rotor}stiffness = 100\n");
    let message = parse_robot(&bare, &sprung, "arm").unwrap_err().to_string();
    assert!(message.ends_with("or remove the stiffness and give the joint a rotor_inertia in the sidecar"));
}

#[test]
fn a_value_that_is_no_number_is_placed_at_its_attribute() {
    assert_eq!(
        changed("mass value=\"3\"", "mass value=\"3 kg\""),
        "arm.urdf:7:13: link \"upper\": value: text where a number is expected (got \"3 kg\", allowed: a number)\n  help: use decimal points, and spaces between numbers"
    );
    assert_eq!(
        changed("xyz=\"0.25 0 0\"", "xyz=\"0.25, 0, 0\""),
        "arm.urdf:6:15: link \"upper\": xyz: text where 3 numbers are expected (got \"0.25, 0, 0\", allowed: 3 numbers)\n  help: use decimal points, and spaces between numbers"
    );
    assert!(changed("xyz=\"0.25 0 0\"", "xyz=\"0.25 0\"").contains("got \"0.25 0\", allowed: 3 numbers"));
    assert_eq!(
        changed("ixx=\"0.01\"", "ixx=\"nan\""),
        "arm.urdf:8:16: link \"upper\": ixx is not finite (got NaN, allowed: a finite number)\n  help: state the value"
    );
    assert!(changed("ixx=\"0.01\"", "ixx=\"1e999\"").contains("ixx is not finite (got inf"));
}

#[test]
fn what_cannot_be_is_refused() {
    assert_eq!(
        changed("mass value=\"3\"", "mass value=\"-3\""),
        "arm.urdf:7:7: link \"upper\": negative mass (got -3, allowed: ≥ 0, kg)\n  help: a mass is never negative"
    );
    assert!(
        changed("damping=\"0.5\"", "damping=\"-0.5\"")
            .contains("joint \"shoulder\": negative damping (got -0.5, allowed: ≥ 0)")
    );
    assert_eq!(
        changed("type=\"revolute\"", "type=\"spherical\""),
        "arm.urdf:19:3: joint \"shoulder\": unknown type (got \"spherical\", allowed: revolute, continuous, prismatic, fixed, floating, planar)\n  help: write a ball joint as three revolute joints"
    );
    assert_eq!(
        changed("      <mass value=\"3\"/>\n", ""),
        "arm.urdf:5:5: link \"upper\": <mass> in <inertial> is missing\n  help: add <mass …/> inside <inertial>"
    );
    assert_eq!(
        changed("<link name=\"flange\"/>", "<link/>"),
        "arm.urdf:18:3: <link>: attribute \"name\" of <link> is missing\n  help: write <link name=\"…\">"
    );
}

#[test]
fn finite_numbers_beyond_all_sense_are_refused() {
    assert_eq!(
        changed("mass value=\"3\"", "mass value=\"1e308\""),
        "arm.urdf:19:3: joint \"shoulder\": its place or the inertia it moves is beyond all numbers (got inf, allowed: lengths in m, masses in kg)\n  help: check the units"
    );
}

#[test]
fn a_mechanism_that_is_no_tree_is_placed_at_its_joint() {
    assert!(
        changed("<child link=\"upper\"/>", "<child link=\"uper\"/>")
            .starts_with("arm.urdf:19:3: joint \"shoulder\": no link \"uper\"")
    );
    assert!(
        changed("<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 0 0\"/>")
            .starts_with("arm.urdf:19:3: joint \"shoulder\": the axis (0, 0, 0) has no direction")
    );
    let mimic = changed("<dynamics damping=\"0.5\" friction=\"1.5\"/>", "<mimic joint=\"elbo\"/>");
    assert!(mimic.starts_with("arm.urdf:19:3: joint \"shoulder\": cannot mimic \"elbo\""), "{mimic}");
    assert!(
        changed("link name=\"base\"", "link name=\"basis\"")
            .starts_with("arm.urdf:19:3: joint \"shoulder\": no link \"base\"")
    );
    assert!(
        changed("name=\"elbow\"", "name=\"shoulder\"")
            .starts_with("arm.urdf:19:3: robot \"arm\": two joints are called \"shoulder\"")
    );
}

#[test]
fn what_urdf_rs_would_stumble_over_is_read_and_noted() {
    let second =
        URDF.replacen("<origin xyz=\"0 0 0.3\"/>", "<origin xyz=\"0 0 0.3\"/><origin xyz=\"9 9 9\"/>", 1);
    let free = second.replace(
        "<limit lower=\"-2\" upper=\"2\" effort=\"100\" velocity=\"3\"/>",
        "<limit effort=\"100\"/>",
    );
    let odd = free.replace(
        "<link name=\"base\"/>",
        "<link name=\"base\"><visual/><visual/><collision/></link><gazebo/>",
    );
    let read = parse_urdf(&odd, "arm.urdf").unwrap();
    let shoulder = &read.model.joints[0];
    assert_eq!(shoulder.placement.translation.z, 0.3);
    assert_eq!((shoulder.limits.lower, shoulder.limits.upper), (f64::NEG_INFINITY, f64::INFINITY));
    assert_eq!((shoulder.limits.effort, shoulder.limits.velocity), (100.0, f64::INFINITY));
    let statements: Vec<_> = read.notes.iter().map(|n| n.to_string()).collect();
    assert_eq!(
        statements,
        [
            "arm.urdf:20:28: note: joint \"shoulder\": a second <origin> is ignored\n  help: keep the one that is meant",
            "arm.urdf:24:5: note: joint \"shoulder\": revolute without lower and upper limit: taken as unlimited\n  help: state <limit lower=… upper=…> or make it continuous",
        ]
    );
}

#[test]
fn an_impossible_inertia_is_warned_of() {
    let read = parse_urdf(&URDF.replacen("izz=\"0.06\"", "izz=\"0.6\"", 1), "arm.urdf").unwrap();
    let note = &read.notes[0];
    assert_eq!((note.severity, note.place.as_str()), (Severity::Warning, "arm.urdf:5:5"));
    assert!(note.statement.contains("the body of link \"upper\" has an impossible inertia"));
}
