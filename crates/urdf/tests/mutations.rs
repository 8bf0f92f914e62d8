//! Whatever a file holds, reading it gives a robot or an error, never a panic.

use sinew_urdf::{parse_robot, parse_urdf};

const URDF: &str = include_str!("arm/arm.urdf");
const SIDECAR: &str = include_str!("arm/arm.sinew.toml");

const CASES: u64 = 2000;

/// SplitMix64: a small generator with a stated seed.
struct Chance(u64);

impl Chance {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % n as u64) as usize
    }
}

/// Deletes, repeats, replaces or exchanges up to four pieces.
fn mutated(text: &str, chance: &mut Chance) -> String {
    const SPLINTERS: [&str; 16] = [
        "-",
        "0",
        "1e999",
        "nan",
        "\"",
        "=",
        "[",
        "]",
        "<",
        "/>",
        "&#0;",
        "é",
        "\n",
        "''",
        "[[effects]]\n",
        "1e-320",
    ];
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..=chance.below(4) {
        let start = chance.below(bytes.len().max(1)).min(bytes.len());
        let end = (start + chance.below(24)).min(bytes.len());
        match chance.below(4) {
            0 => drop(bytes.drain(start..end)),
            1 => {
                let copy = bytes[start..end].to_vec();
                bytes.splice(start..start, copy);
            }
            2 => {
                let splinter = SPLINTERS[chance.below(SPLINTERS.len())];
                bytes.splice(start..end, splinter.bytes());
            }
            _ => {
                if let Some(byte) = bytes.get_mut(start) {
                    *byte = chance.below(256) as u8;
                }
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Numbers are the likeliest to be wrong: one of them becomes something else.
fn with_another_number(text: &str, chance: &mut Chance) -> String {
    const NUMBERS: [&str; 10] =
        ["-1", "0", "1e308", "-1e308", "1e-320", "nan", "inf", "", "1 2", "99999999999999999999"];
    let digits: Vec<usize> = text.match_indices(|c: char| c.is_ascii_digit()).map(|(k, _)| k).collect();
    let at = digits[chance.below(digits.len())];
    format!("{}{}{}", &text[..at], NUMBERS[chance.below(NUMBERS.len())], &text[at + 1..])
}

#[test]
fn a_mutated_urdf_or_sidecar_gives_a_robot_or_an_error() {
    let (mut accepted, mut refused) = (0, 0);
    for seed in 0..CASES {
        let mut chance = Chance(seed);
        let (mut urdf, mut sidecar) = (URDF.to_owned(), SIDECAR.to_owned());
        match seed % 4 {
            0 => urdf = mutated(&urdf, &mut chance),
            1 => sidecar = mutated(&sidecar, &mut chance),
            2 => urdf = with_another_number(&urdf, &mut chance),
            _ => sidecar = with_another_number(&sidecar, &mut chance),
        }
        match parse_robot(&urdf, &sidecar, "arm") {
            Ok(mut file) => {
                accepted += 1;
                // What was accepted can be changed and read again.
                file.sidecar.set_joint("elbow", "stiffness", 10.0);
                parse_robot(&urdf, &file.sidecar.text(), "arm")
                    .unwrap_or_else(|e| panic!("seed {seed}: {e}"));
            }
            Err(error) => {
                refused += 1;
                let message = error.to_string();
                assert!(message.contains("\n  help: "), "seed {seed}: {message}");
                assert!(message.starts_with("arm."), "seed {seed}: {message}");
            }
        }
    }
    assert!(accepted > 100 && refused > 500, "{accepted} accepted, {refused} refused");
}

#[test]
fn any_prefix_of_a_urdf_gives_a_robot_or_an_error() {
    for end in (0..URDF.len()).filter(|k| URDF.is_char_boundary(*k)) {
        assert_eq!(parse_urdf(&URDF[..end], "arm.urdf").is_ok(), URDF[end..].trim().is_empty());
    }
}
