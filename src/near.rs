//! The known word that somebody may have meant.

/// The word of `known` nearest to one that is not known, if it is near enough to be a typing error: a third of the letters, one to
/// three of them.
#[must_use]
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = word.to_lowercase();
    let limit = (word.chars().count() / 3).clamp(1, 3);
    let distances = known.into_iter().map(|k| (strsim::damerau_levenshtein(&lower, &k.to_lowercase()), k));
    // A word of which nothing is left is no typing error.
    distances.filter(|(distance, k)| *distance <= limit && *distance < k.chars().count()).min().map(|(_, k)| k)
}

/// `; did you mean ...?` for the end of a message, or nothing.
#[must_use]
pub fn did_you_mean<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    nearest(word, known).map_or_else(String::new, |near| format!("; did you mean `{near}`?"))
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn typing_errors_are_found_and_other_words_are_not() {
        let known = ["v_0", "d_0", "tau_p", "a_max", "a_min", "a_hat_min"];
        for (word, expected) in [
            ("taup", Some("tau_p")),
            ("tau_P", Some("tau_p")),
            ("a_hatmin", Some("a_hat_min")),
            ("amax", Some("a_max")),
            ("v0", Some("v_0")),
            ("headway", None),
            ("tau", None),
            ("", None),
        ] {
            assert_eq!(nearest(word, known), expected, "{word}");
        }
    }
}
