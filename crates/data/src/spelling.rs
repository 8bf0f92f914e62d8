//! The nearest spelling of a misspelt word.

/// The word of `allowed` that `word` was probably meant to be: at most a third of its letters are wrong.
pub(crate) fn nearest<'a>(word: &str, allowed: &[&'a str]) -> Option<&'a str> {
    let limit = word.chars().count().div_ceil(3);
    let closest = allowed.iter().map(|&candidate| (distance(word, candidate), candidate)).min()?;
    (closest.0 <= limit).then_some(closest.1)
}

/// The number of letters to insert, delete, replace or swap with their neighbour to turn `a` into `b`.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut d = vec![vec![0; b.len() + 1]; a.len() + 1];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            d[i][j] = if i == 0 || j == 0 {
                i + j
            } else {
                let replace = d[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
                let swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
                let swap = if swapped { d[i - 2][j - 2] + 1 } else { usize::MAX };
                replace.min(swap).min(d[i - 1][j] + 1).min(d[i][j - 1] + 1)
            };
        }
    }
    d[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_counts_single_letter_mistakes() {
        assert_eq!(distance("elbow", "elbow"), 0);
        assert_eq!(distance("elbw", "elbow"), 1);
        assert_eq!(distance("eblow", "elbow"), 1);
        assert_eq!(distance("", "abc"), 3);
    }

    #[test]
    fn nothing_is_suggested_for_a_word_unlike_all() {
        assert_eq!(nearest("colum", &["column", "scale"]), Some("column"));
        assert_eq!(nearest("zebra", &["column", "scale"]), None);
        assert_eq!(nearest("x", &[]), None);
    }
}
