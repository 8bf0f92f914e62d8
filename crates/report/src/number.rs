//! Numbers as people read them: three significant digits, and milli or micro where the unit bears it.

/// A number with three significant digits.
///
/// # Example
/// ```
/// use sinew_report::number;
/// assert_eq!(number(4.0651), "4.07");
/// assert_eq!(number(0.05), "0.05");
/// assert_eq!(number(12345.6), "12 300");
/// assert_eq!(number(1.2e-7), "1.2e-7");
/// assert_eq!(number(f64::NAN), "–");
/// ```
pub fn number(value: f64) -> String {
    significant(value, 3)
}

/// A value with its unit, none if that is "–"; small angles and lengths in mrad, µrad, mm, µm.
///
/// # Example
/// ```
/// use sinew_report::quantity;
/// assert_eq!(quantity(0.00031, "rad"), "0.31 mrad");
/// assert_eq!(quantity(2.5e-6, "m"), "2.5 µm");
/// assert_eq!(quantity(4.1, "N·m"), "4.1 N·m");
/// assert_eq!(quantity(0.02, "–"), "0.02");
/// ```
pub fn quantity(value: f64, unit: &str) -> String {
    let (factor, prefix) = prefix(value, unit);
    with_unit(&number(value * factor), prefix, unit)
}

/// A value with its standard deviation, which gets two digits, and their unit.
///
/// # Example
/// ```
/// use sinew_report::with_std;
/// assert_eq!(with_std(5.3137, 0.12, "N·m"), "5.31 ± 0.12 N·m");
/// assert_eq!(with_std(0.000813, 0.000021, "rad"), "0.813 ± 0.021 mrad");
/// assert_eq!(with_std(2.0, f64::INFINITY, ""), "2 ± –");
/// ```
pub fn with_std(value: f64, std: f64, unit: &str) -> String {
    let (factor, prefix) = prefix(value, unit);
    let (value, std) = (value * factor, std * factor);
    let usable = std.is_finite() && std > 0.0 && std < 1e6 * value.abs().max(1e-300);
    let digits = if usable { 1 - std.log10().floor() as i32 } else { -99 };
    let text = if (0..=6).contains(&digits) {
        format!("{value:.*} ± {std:.*}", digits as usize, digits as usize)
    } else {
        format!("{} ± {}", number(value), significant(std, 2))
    };
    with_unit(&text, prefix, unit)
}

// Effects give shares the unit "–".
fn with_unit(value: &str, prefix: &str, unit: &str) -> String {
    if unit.is_empty() || unit == "–" { value.to_owned() } else { format!("{value} {prefix}{unit}") }
}

/// The factor and the letter with which values near `value` are written.
pub(crate) fn prefix(value: f64, unit: &str) -> (f64, &'static str) {
    let bears_it = ["rad", "m", "s"].contains(&unit);
    match value.abs() {
        x if !bears_it || x == 0.0 || x >= 0.1 => (1.0, ""),
        x if x >= 1e-4 => (1e3, "m"),
        _ => (1e6, "µ"),
    }
}

fn significant(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    // Rounded first, so that 9.996 becomes 10.0 and not 10.00.
    let rounded: f64 = format!("{value:.*e}", (digits - 1) as usize).parse().unwrap_or(value);
    if rounded == 0.0 {
        return "0".to_owned();
    }
    let exponent = rounded.abs().log10().floor() as i32;
    if !(-3..=6).contains(&exponent) {
        let text = format!("{rounded:.*e}", (digits - 1) as usize);
        let (mantissa, power) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}e{power}", trimmed(mantissa));
    }
    let text = format!("{rounded:.*}", (digits - 1 - exponent).max(0) as usize);
    if exponent >= 4 { grouped(&text) } else { trimmed(&text).to_owned() }
}

fn trimmed(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

// Thin groups of three digits, for integers.
fn grouped(text: &str) -> String {
    let mut out = String::new();
    for (k, c) in text.chars().enumerate() {
        let left = text.len() - k;
        if k > 0 && left.is_multiple_of(3) && !out.ends_with('-') {
            out.push(' ');
        }
        out.push(c);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_survive_at_every_size() {
        let cases = [(9.996, "10"), (-0.0012345, "-0.00123"), (999.6, "1000"), (1_234_567.0, "1 230 000")];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn a_meaningless_deviation_does_not_add_digits() {
        assert_eq!(with_std(150.0, 1e-12, "N·m/rad"), "150 ± 1e-12 N·m/rad");
        assert_eq!(with_std(150.0, 0.0, "N·m/rad"), "150 ± 0 N·m/rad");
    }
}
