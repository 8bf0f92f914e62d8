//! The nearest spelling of a misspelt name.

use alloc::string::String;
use alloc::vec::Vec;

/// The known name that was probably meant: the one that needs the fewest edits, if it needs few.
///
/// # Example
/// ```
/// let known = ["shoulder".to_owned(), "elbow".to_owned()];
/// assert_eq!(sinew_model::nearest("elbw", &known), Some("elbow"));
/// assert_eq!(sinew_model::nearest("flange", &known), None);
/// ```
pub fn nearest<'a>(name: &str, known: &'a [String]) -> Option<&'a str> {
    let best = known.iter().min_by_key(|k| edit_distance(k, name))?;
    (edit_distance(best, name) <= 1 + name.chars().count() / 3).then_some(best.as_str())
}

// Levenshtein's recursion, one row at a time.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let change = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = change.min(row[j] + 1).min(row[j + 1] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_are_counted() {
        assert_eq!(edit_distance("elbow", "elbow"), 0);
        assert_eq!(edit_distance("elbw", "elbow"), 1);
        assert_eq!(edit_distance("", "abc"), 3);
    }
}
