//! The house rules that a machine can check: layers, sizes, and what must not stand in a file.

use std::fs;
use std::path::{Path, PathBuf};

/// The rows of the layer picture. A crate depends on lower rows only, never on its own.
const ROWS: [&[&str]; 8] = [
    &["model"],
    &["urdf", "kinematics", "effect", "data"],
    &["rigid"],
    &["flex-joint", "flex-link"],
    &["plant", "effects"],
    &["linear", "simulate", "identify"],
    &["report"],
    &["cli"],
];
/// Crates that hold particular effects.
const EFFECTS: [&str; 3] = ["flex-joint", "flex-link", "effects"];
/// Crates that must know no particular effect.
const IGNORANT: [&str; 4] = ["plant", "linear", "simulate", "identify"];
/// Crates that build in seconds and open no file, and all that they may depend on besides lower rows.
const LIGHT: [&str; 5] = ["model", "kinematics", "rigid", "flex-joint", "flex-link"];
const LIGHT_LIBRARIES: [&str; 3] = ["nalgebra", "thiserror", "libm"];
/// Crates that read and write files.
const ON_DISK: [&str; 3] = ["urdf", "data", "cli"];
/// Lines of a file.
const LONGEST_FILE: usize = 600;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

fn crates() -> Vec<String> {
    let folders = fs::read_dir(root().join("crates")).unwrap().map(|entry| entry.unwrap());
    let mut names: Vec<String> = folders.map(|f| f.file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Every text file below `folder`, with its path from the root, in order.
fn texts(folder: &Path) -> Vec<(String, String)> {
    const SKIPPED: [&str; 3] = ["target", ".git", "sinew-demo"];
    let mut entries: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    entries.sort();
    let mut found = Vec::new();
    for path in entries {
        if SKIPPED.iter().any(|name| path.ends_with(name)) {
            continue;
        }
        if path.is_dir() {
            found.extend(texts(&path));
        } else if let Ok(text) = fs::read_to_string(&path) {
            found.push((path.strip_prefix(root()).unwrap().display().to_string(), text));
        }
    }
    found
}

fn rust_files(folder: &Path) -> Vec<(String, String)> {
    texts(folder).into_iter().filter(|(path, _)| path.ends_with(".rs")).collect()
}

/// What a crate needs to be built: `[dependencies]` and `[build-dependencies]`, those of single targets included.
fn dependencies(name: &str) -> Vec<String> {
    let path = root().join("crates").join(name).join("Cargo.toml");
    let manifest: toml::Table = fs::read_to_string(path).unwrap().parse().unwrap();
    let targets = manifest.get("target").and_then(toml::Value::as_table);
    let tables = std::iter::once(&manifest)
        .chain(targets.into_iter().flat_map(|t| t.values()).filter_map(toml::Value::as_table));
    let lists = tables.flat_map(|t| ["dependencies", "build-dependencies"].map(|key| t.get(key)));
    lists.flatten().filter_map(toml::Value::as_table).flat_map(|t| t.keys().cloned()).collect()
}

/// The folder of a crate of this workspace; none for a library from elsewhere.
fn folder(package: &str) -> Option<&str> {
    if package == "sinew" { Some("cli") } else { package.strip_prefix("sinew-") }
}

fn row(name: &str) -> Option<usize> {
    ROWS.iter().position(|row| row.contains(&name))
}

fn assert_none(wrong: Vec<String>) {
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn arrows_point_to_lower_rows_only() {
    let mut wrong = Vec::new();
    for name in crates() {
        let Some(own) = row(&name) else {
            wrong.push(format!("crates/{name}: stands in no row; give it one here and in ARCHITECTURE.md"));
            continue;
        };
        for package in dependencies(&name) {
            if folder(&package).is_some_and(|other| row(other).is_none_or(|row| row >= own)) {
                wrong.push(format!("crates/{name}: depends on {package}, which is not below it"));
            }
        }
    }
    assert_none(wrong);
}

#[test]
fn plant_and_analyses_know_no_particular_effect() {
    let arrows = IGNORANT.iter().flat_map(|name| dependencies(name).into_iter().map(move |d| (name, d)));
    let particular = |package: &str| folder(package).is_some_and(|other| EFFECTS.contains(&other));
    let wrong =
        arrows.filter(|(_, d)| particular(d)).map(|(name, d)| format!("crates/{name}: depends on {d}"));
    assert_none(wrong.collect());
}

#[test]
fn the_numeric_crates_depend_on_no_file_format_and_no_heavy_library() {
    let arrows = LIGHT.iter().flat_map(|name| dependencies(name).into_iter().map(move |d| (name, d)));
    let heavy = |d: &str| folder(d).is_none() && !LIGHT_LIBRARIES.contains(&d);
    let wrong = arrows.filter(|(_, d)| heavy(d)).map(|(name, d)| format!("crates/{name}: depends on {d}"));
    assert_none(wrong.collect());
}

#[test]
fn only_readers_writers_and_the_command_touch_the_disk() {
    let mut wrong = Vec::new();
    for name in crates().iter().filter(|name| !ON_DISK.contains(&name.as_str())) {
        let sources = rust_files(&root().join("crates").join(name).join("src"));
        wrong.extend(
            sources.iter().filter(|(_, text)| text.contains("std::fs")).map(|(path, _)| path.clone()),
        );
    }
    assert_none(wrong);
}

#[test]
fn files_are_short() {
    let long = |(path, text): (String, String)| {
        let lines = text.lines().count();
        (lines > LONGEST_FILE).then(|| format!("{path}: {lines} lines (allowed {LONGEST_FILE})"))
    };
    assert_none(rust_files(&root()).into_iter().filter_map(long).collect());
}

#[test]
fn nothing_is_left_undone_or_switched_off() {
    // In parts, so that this file may stand among those it reads.
    let forbidden = [
        concat!("to", "do!("),
        concat!("unimple", "mented!("),
        concat!("#[ig", "nore"),
        concat!("allow(dead", "_code"),
    ];
    let mut wrong = Vec::new();
    for (path, text) in rust_files(&root()) {
        for (k, line) in text.lines().enumerate() {
            let found = forbidden.iter().filter(|word| line.contains(*word));
            wrong.extend(found.map(|word| format!("{path}:{}: {word}", k + 1)));
        }
    }
    assert_none(wrong);
}

#[test]
fn no_path_leads_out_of_one_machine() {
    let folders = ["tmp", "work", "root", "home"].map(|name| format!("/{name}"));
    let mut wrong = Vec::new();
    for (path, text) in texts(&root()) {
        for (k, line) in text.lines().enumerate() {
            if folders.iter().any(|folder| has_path(line, folder)) {
                wrong.push(format!("{path}:{}: {}", k + 1, line.trim()));
            }
        }
    }
    assert_none(wrong);
}

// True if `folder` begins a path in `line`: no part of a longer path, address or word.
fn has_path(line: &str, folder: &str) -> bool {
    let part = |c: char| c.is_alphanumeric() || "._-/~*}>)".contains(c);
    line.match_indices(folder).any(|(at, _)| {
        let before = line[..at].chars().next_back();
        let after = line[at + folder.len()..].chars().next();
        !before.is_some_and(part) && !after.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == '-')
    })
}

#[test]
fn lib_rs_holds_docs_modules_and_uses_only() {
    let mut wrong = Vec::new();
    for name in crates() {
        let path = format!("crates/{name}/src/lib.rs");
        let Ok(text) = fs::read_to_string(root().join(&path)) else { continue };
        let mut in_use = false;
        for (k, line) in text.lines().map(str::trim).enumerate() {
            let begins_use =
                ["use ", "pub use ", "pub(crate) use "].iter().any(|word| line.starts_with(word));
            let allowed = ["//!", "#![", "#[", "mod ", "pub mod ", "extern crate "]
                .iter()
                .any(|word| line.starts_with(word));
            if !(in_use || begins_use || allowed || line.is_empty()) {
                wrong.push(format!("{path}:{}: {line}", k + 1));
            }
            in_use = (in_use || begins_use) && !line.ends_with(';');
        }
    }
    assert_none(wrong);
}
