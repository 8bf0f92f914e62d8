//! The nearest spelling of a misspelt word.

use strsim::osa_distance;

/// The word of `allowed` that `word` was probably meant to be: at most a third of its letters are wrong. Of words joined by
/// underscores the first one is enough.
///
/// # Example
/// ```
/// assert_eq!(sinew_data::nearest("elbw", &["shoulder", "elbow"]), Some("elbow"));
/// ```
pub fn nearest<'a>(word: &str, allowed: &[&'a str]) -> Option<&'a str> {
    let limit = word.chars().count().div_ceil(3);
    let by = |part: fn(&str) -> &str| {
        let closest = allowed.iter().map(|&candidate| (osa_distance(word, part(candidate)), candidate)).min();
        closest.filter(|closest| closest.0 <= limit).map(|closest| closest.1)
    };
    by(|whole| whole).or_else(|| by(|whole| whole.split('_').next().unwrap_or(whole)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_suggested_for_a_word_unlike_all() {
        assert_eq!(nearest("colum", &["column", "scale"]), Some("column"));
        assert_eq!(nearest("coging", &["coulomb_friction", "cogging_torque"]), Some("cogging_torque"));
        assert_eq!(nearest("zebra", &["column", "scale"]), None);
        assert_eq!(nearest("x", &[]), None);
    }
}
