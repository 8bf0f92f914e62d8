//! Three numbers on the command line: a force, a moment.

use crate::error::CliError;

/// The vector that `text` names, "x,y,z".
pub(crate) fn three_numbers(flag: &str, text: &str) -> Result<[f64; 3], CliError> {
    let wrong = |what: String| {
        let help = format!("write three numbers in base axes, as in {flag} \"0,0,-100\"");
        CliError::usage(format!("{flag} \"{text}\""), what, help)
    };
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let mut numbers = [0.0; 3];
    if parts.len() != numbers.len() {
        return Err(wrong(format!("not a vector (got {} numbers, allowed 3)", parts.len())));
    }
    for (number, part) in numbers.iter_mut().zip(parts) {
        let read = part.parse().ok().filter(|x: &f64| x.is_finite());
        *number =
            read.ok_or_else(|| wrong(format!("not a vector (got \"{part}\", allowed finite numbers)")))?;
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_finite_numbers_and_nothing_else() {
        assert_eq!(three_numbers("--force", "1, -2.5,3e2").unwrap(), [1.0, -2.5, 300.0]);
        for text in ["", "1,2", "1,2,3,4", "1,x,3", "1,nan,3", "inf,0,0", "1,,3"] {
            let message = three_numbers("--force", text).unwrap_err().to_string();
            assert!(message.starts_with("--force") && message.contains("allowed"), "{message}");
            assert!(message.contains("help: write three numbers"), "{message}");
        }
    }
}
