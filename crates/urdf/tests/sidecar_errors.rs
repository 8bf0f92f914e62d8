//! What is wrong with a sidecar is said with place, value, allowed values and a way out.

use std::fs;

use sinew_urdf::{KindWords, PlaceKind, Severity, Vocabulary, parse_robot, read_robot};

const URDF: &str = include_str!("arm/arm.urdf");
const SIDECAR: &str = include_str!("arm/arm.sinew.toml");

/// The message for a sidecar of `format = 1` and the given lines, which start in line 2.
fn message(lines: &str) -> String {
    parse_robot(URDF, &format!("format = 1\n{lines}"), "arm").unwrap_err().to_string()
}

#[test]
fn unknown_joints_and_links_are_answered_with_the_nearest() {
    assert_eq!(
        message("[joints.elbw]\nstiffness = 1\n"),
        "arm.sinew.toml:2:9: no joint \"elbw\" with one degree of freedom of its own in robot \"arm\" (joints: shoulder, elbow)\n  help: did you mean \"elbow\"?"
    );
    assert_eq!(
        message("tool = \"flnge\"\n"),
        "arm.sinew.toml:2:8: no link \"flnge\" in robot \"arm\" (links: base, upper, forearm, flange)\n  help: did you mean \"flange\"?"
    );
    assert!(message("[joints.flange_fixed]\nstiffness = 1\n").ends_with("help: use one of the names listed"));
    assert!(
        message("[links.foreram.bending]\naxes = [\"y\"]\nEI = 1\nlength = 1\n")
            .starts_with("arm.sinew.toml:2:8: no link \"foreram\"")
    );
    assert!(message("[joints.elbow]\ncarried_by = \"uper\"\n").ends_with("did you mean \"upper\"?"));
    assert!(
        message("[[effects]]\nkind = \"backlash\"\njoint = \"shulder\"\n")
            .starts_with("arm.sinew.toml:4:9: no joint \"shulder\"")
    );
    assert!(
        message("[[effects]]\nkind = \"contact\"\nlink = \"tip\"\n")
            .starts_with("arm.sinew.toml:4:8: no link \"tip\"")
    );
    assert!(
        message("[[couplings]]\njoints = [\"shoulder\", \"wrist\"]\nstiffness = [[1, 0], [0, 1]]\n")
            .starts_with("arm.sinew.toml:3:23: no joint \"wrist\"")
    );
}

#[test]
fn unknown_keys_are_answered_with_the_allowed_and_the_nearest() {
    assert_eq!(
        message("[joints.elbow]\nstifness = 1\n"),
        "arm.sinew.toml:3:1: unknown key \"stifness\" in [joints.elbow] (allowed: stiffness, damping, rotor_inertia, gear_ratio, torque_constant, rotor_axis, carried_by, stiffness_std, damping_std, rotor_inertia_std)\n  help: did you mean \"stiffness\"?"
    );
    assert_eq!(
        message("gravty = [0, 0, 0]\n"),
        "arm.sinew.toml:2:1: unknown key \"gravty\" (allowed: format, urdf, gravity, tool, known, joints, couplings, links, effects)\n  help: did you mean \"gravity\"?"
    );
    assert!(message("[[couplings]]\njoint = []\n").starts_with(
        "arm.sinew.toml:3:1: unknown key \"joint\" in [[couplings]] (allowed: joints, stiffness, damping)"
    ));
    assert!(message("[links.forearm.bending]\nei = 1\n").contains("unknown key \"ei\" in [links.forearm.bending] (allowed: springs, axes, length, EI, stiffness, mass_per_length, damping_ratio, GJ, polar_inertia_per_length, along, sections, stations, stiffnesses, quasi_static)"));
    assert!(
        message("[links.forearm]\nbend = 1\n")
            .contains("unknown key \"bend\" in [links.forearm] (allowed: bending)")
    );
}

#[test]
fn sizes_that_cannot_be_are_refused() {
    assert_eq!(
        message("[joints.elbow]\nstiffness = -150.0\n"),
        "arm.sinew.toml:3:13: joints.elbow.stiffness: must be positive (got -150.0, allowed: > 0)\n  help: state its size, or leave the key out"
    );
    let joint = |line: &str| message(&format!("[joints.elbow]\n{line}\n"));
    assert!(joint("stiffness = 0").contains("stiffness: must be positive (got 0.0, allowed: > 0)"));
    assert!(
        joint("rotor_inertia = -1").contains("rotor_inertia: must not be negative (got -1.0, allowed: ≥ 0)")
    );
    assert!(joint("damping = -1").contains("damping: must not be negative"));
    assert!(joint("gear_ratio = 0").contains("gear_ratio: must be positive"));
    assert!(joint("stiffness = nan").contains("stiffness: not finite (got NaN, allowed: a finite number)"));
    assert!(joint("damping = inf").contains("damping: not finite (got inf"));
    assert!(joint("rotor_axis = [0, 0, 0]").contains("rotor_axis: no direction"));
    assert!(
        joint("rotor_axis = [0, 1]").contains("rotor_axis: not a vector (got 2 numbers, allowed: 3 numbers)")
    );
}

#[test]
fn values_of_the_wrong_kind_are_refused() {
    assert_eq!(
        message("[joints.elbow]\nstiffness = \"soft\"\n"),
        "arm.sinew.toml:3:13: joints.elbow.stiffness: text where a number is expected (got \"soft\", allowed: a number)\n  help: numbers stand without quotes, words within them"
    );
    assert_eq!(
        message("tool = 7\n"),
        "arm.sinew.toml:2:8: tool: wrong kind of value (got integer `7`, allowed: a string)\n  help: numbers stand without quotes, words within them"
    );
    assert!(
        message("gravity = -9.81\n")
            .contains("gravity: wrong kind of value (got floating point `-9.81`, allowed: a sequence)")
    );
    assert!(
        message("[effects]\nkind = \"payload\"\n")
            .ends_with("write [[effects]]: each is a table of its own, in any number")
    );
    assert!(message("[joints]\nelbow = 3\n").contains("joints.elbow: wrong kind of value (got integer `3`"));
    assert!(message("[[effects]]\nkind = \"payload\"\nmass = true\n").contains(
        "wrong kind of value (got boolean `true`, allowed: a number, a list of numbers or a word)"
    ));
    assert_eq!(
        message("[[effects]]\nkind = \"payload\"\nmass = \"0.8\"\n"),
        "arm.sinew.toml:4:8: effects.mass: text where a number is expected (got \"0.8\", allowed: a number)\n  help: numbers stand without quotes"
    );
    assert!(
        message("[[effects]]\nkind = 3\n")
            .starts_with("arm.sinew.toml:3:8: effects.kind: a number where a name is expected (got 3.0")
    );
}

#[test]
fn text_that_is_no_toml_is_placed() {
    let message = message("[joints.elbow\nstiffness = 1\n");
    assert!(message.starts_with("arm.sinew.toml:2:14: not well-formed TOML: "), "{message}");
    assert!(
        message
            .ends_with("help: strings stand in quotes, lists in brackets, and a table or key is stated once")
    );
}

#[test]
fn the_format_must_be_one() {
    let message = |text: &str| parse_robot(URDF, text, "arm").unwrap_err().to_string();
    assert_eq!(message(""), "arm.sinew.toml:1:1: format is missing\n  help: write format = 1 at the top");
    assert_eq!(
        message("format = 2\n"),
        "arm.sinew.toml:1:10: format: not known (got 2, allowed: 1)\n  help: write format = 1; a later format needs a later version of the program"
    );
}

#[test]
fn gravity_and_trust_are_checked() {
    assert_eq!(
        message("gravity = [0, -9.81]\n"),
        "arm.sinew.toml:2:11: gravity: not a vector (got 2 numbers, allowed: 3 numbers)\n  help: write [x, y, z]"
    );
    assert_eq!(
        message("known = \"exakt\"\n"),
        "arm.sinew.toml:2:9: no word \"exakt\" for known (words: exact, nominal, unknown)\n  help: did you mean \"exact\"?"
    );
}

#[test]
fn couplings_must_be_symmetric_and_positive_definite() {
    let coupling = |stiffness: &str, more: &str| {
        message(&format!(
            "[[couplings]]\njoints = [\"shoulder\", \"elbow\"]\nstiffness = {stiffness}\n{more}"
        ))
    };
    assert_eq!(
        coupling("[[900, 120], [130, 700]]", ""),
        "arm.sinew.toml:4:13: couplings.stiffness: not symmetric (got 130.0 and 120.0 in rows 2 and 1, allowed: equal entries)\n  help: write the same number on both sides of the diagonal"
    );
    assert_eq!(
        coupling("[[1, 2], [2, 1]]", ""),
        "arm.sinew.toml:4:13: couplings.stiffness: not positive definite (got [[1.0, 2.0], [2.0, 1.0]], allowed: positive eigenvalues)\n  help: no motion may release energy: enlarge the diagonal or reduce the coupling"
    );
    assert!(
        coupling("[[1, 2]]", "")
            .contains("couplings.stiffness: wrong size (got rows of 2, allowed: 2 rows of 2)")
    );
    assert!(coupling("[[1, nan], [0, 1]]", "").contains("couplings.stiffness: not finite"));
    let good = "[[900, 120], [120, 700]]";
    assert!(
        coupling(good, "damping = [[1, -2], [-2, 1]]\n")
            .contains("couplings.damping: not positive semidefinite")
    );
    assert_eq!(
        coupling(good, &format!("[[couplings]]\njoints = [\"elbow\", \"shoulder\"]\nstiffness = {good}\n")),
        "arm.sinew.toml:6:11: joint \"elbow\" is coupled twice (first in line 3)\n  help: put all joints that act on each other in one coupling"
    );
    assert!(coupling(good, "[joints.elbow]\nstiffness = 5\n").contains(
        "joint \"elbow\" is coupled and has a stiffness of its own (got 5.0, allowed: one of the two)"
    ));
    let semidefinite = format!(
        "format = 1\n[[couplings]]\njoints = [\"shoulder\", \"elbow\"]\nstiffness = {good}\ndamping = [[1, 1], [1, 1]]\n"
    );
    let robot = parse_robot(URDF, &semidefinite, "arm").unwrap().robot;
    assert_eq!((&robot.couplings[0].dofs[..], robot.couplings[0].stiffness[1]), (&[0, 1][..], 120.0));
}

#[test]
fn bending_needs_one_stiffness_axes_and_a_length() {
    let bending = |lines: &str| message(&format!("[links.forearm.bending]\n{lines}"));
    assert!(bending("EI = 1\nlength = 1\n").contains("axes in [links.forearm.bending] is missing"));
    assert!(
        bending("axes = [\"y\"]\n")
            .contains("links.forearm.bending: no stiffness (got neither EI nor stiffness")
    );
    assert!(bending("axes = [\"y\"]\nEI = 1\nstiffness = 1\n").contains("stiffness stated twice"));
    assert!(bending("axes = [\"y\"]\nEI = 1\n").contains("length in [links.forearm.bending] is missing"));
    assert!(
        bending("axes = [\"w\"]\nEI = 1\nlength = 1\n")
            .contains("axes: no such axis (got \"w\", allowed: \"x\", \"y\", \"z\")")
    );
    assert!(bending("axes = [\"y\", \"y\"]\nEI = 1\nlength = 1\n").contains("axes: an axis twice"));
    assert!(
        bending("axes = [\"y\"]\nEI = 1\nlength = 1\nsprings = 2.5\n")
            .contains("springs: must be a count (got 2.5, allowed: 1, 2, 3 …)")
    );
    assert!(
        bending("axes = [\"y\"]\nstiffness = 1\nsprings = 2\n")
            .contains("stiffness means a single base spring")
    );
}

#[test]
fn an_effect_is_stated_once_with_a_kind_and_one_place() {
    assert!(
        message("[[effects]]\nkind = \"x\"\nmass_std = -1\n")
            .contains("effects.mass_std: must not be negative")
    );
    assert_eq!(
        message(
            "[[effects]]\nkind = \"backlash\"\njoint = \"elbow\"\n\n[[effects]]\njoint = \"elbow\"\nkind = \"backlash\"\n"
        ),
        "arm.sinew.toml:7:1: effect \"backlash\" at elbow twice (first in line 3)\n  help: keep one table for each effect and place, or say in words in what they differ (signal, side, from)"
    );
    assert_eq!(
        message("[[effects]]\njoint = \"elbow\"\n"),
        "arm.sinew.toml:3:1: kind in [[effects]] is missing\n  help: add kind = \"…\", a name of the catalogue"
    );
    assert!(
        message("[[effects]]\nkind = \"x\"\njoint = \"elbow\"\nlink = \"base\"\n")
            .contains("effects: both joint and link")
    );
    assert!(message("[[effects]]\nkind = \"x\"\nlist = [1, nan]\n").contains("effects.list: not finite"));
}

#[test]
fn a_sidecar_without_its_urdf_says_so() {
    let folder = std::env::temp_dir().join(format!("sinew-urdf-without-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join("arm.sinew.toml");
    fs::write(&path, "format = 1\nurdf = \"amr.urdf\"\n").unwrap();
    let message = read_robot(&path).unwrap_err().to_string();
    assert!(message.contains("arm.sinew.toml:2:8: urdf: the file "), "{message}");
    assert!(message.ends_with("help: the path is relative to the sidecar's folder"));
    fs::write(&path, "format = 1\n").unwrap();
    let message = read_robot(&path).unwrap_err().to_string();
    assert!(message.ends_with("arm.sinew.toml:1:1: urdf is missing\n  help: write urdf = \"FILE.urdf\", relative to the sidecar's folder"));
    // A sidecar beside a URDF that it does not name is used with a warning.
    fs::write(folder.join("arm.urdf"), URDF).unwrap();
    fs::write(folder.join("old.urdf"), URDF).unwrap();
    fs::write(&path, "format = 1\nurdf = \"old.urdf\"\n").unwrap();
    let notes = read_robot(&folder.join("arm.urdf")).unwrap().notes;
    assert!(
        notes.iter().any(|n| n.severity == Severity::Warning && n.statement.contains("the sidecar is for"))
    );
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn damping_across_no_spring_is_warned_of() {
    let notes = parse_robot(URDF, "format = 1\n[joints.elbow]\ndamping = 1\n", "arm").unwrap().notes;
    assert_eq!(notes[0].severity, Severity::Warning);
    assert_eq!(notes[0].statement, "joint \"elbow\" has damping across a spring but no stiffness");
}

#[test]
fn effects_are_checked_against_a_catalogue_with_places() {
    let kinds = [
        KindWords {
            kind: "coulomb_friction",
            keys: &["coulomb", "smoothing_velocity"],
            strengths: &["coulomb"],
            place: PlaceKind::Joint,
        },
        KindWords {
            kind: "payload",
            keys: &["mass", "first_moment"],
            strengths: &["mass"],
            place: PlaceKind::Robot,
        },
        KindWords {
            kind: "contact",
            keys: &["stiffness", "side"],
            strengths: &["stiffness"],
            place: PlaceKind::Link,
        },
    ];
    let vocabulary = Vocabulary { kinds: &kinds };
    let check = |text: &str| parse_robot(URDF, text, "arm").unwrap().check_vocabulary(&vocabulary);
    assert_eq!(check(SIDECAR).unwrap(), []);
    let file = parse_robot(URDF, SIDECAR, "arm").unwrap();
    let stated =
        |kind: &str, place: &str, key: &str| file.where_stated(kind, place, key).map(|at| at.to_string());
    assert_eq!(stated("coulomb_friction", "shoulder", "coulomb_std").unwrap(), "arm.sinew.toml:33:15");
    assert_eq!(stated("coulomb_friction", "shoulder", "viscous"), None);
    let idle = check(&SIDECAR.replace("coulomb = ", "smoothing_velocity = ")).unwrap();
    assert_eq!(idle[0].statement, "effect \"coulomb_friction\" has no strength and does nothing");
    assert_eq!(idle[0].help, "state its coulomb, or let sinew fit find it");
    let fails = |from: &str, to: &str| check(&SIDECAR.replace(from, to)).unwrap_err().to_string();
    assert_eq!(
        fails("kind = \"coulomb_friction\"", "kind = \"colomb_friction\""),
        "arm.sinew.toml:30:8: no effect \"colomb_friction\" in the catalogue (effects: coulomb_friction, payload, contact)\n  help: did you mean \"coulomb_friction\"?"
    );
    assert_eq!(
        fails("coulomb_std = 0.03", "colomb_std = 0.03"),
        "arm.sinew.toml:33:1: unknown key \"colomb_std\" in effect \"coulomb_friction\" (allowed: coulomb_std, smoothing_velocity_std)\n  help: did you mean \"coulomb_std\"?"
    );
    assert_eq!(
        fails("kind = \"payload\"", "kind = \"payload\"\njoint = \"elbow\""),
        "arm.sinew.toml:36:1: effect \"payload\" stands at the wrong place (got a joint, allowed: neither joint nor link)\n  help: state the place it acts at"
    );
}
