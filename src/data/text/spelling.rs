//! The nearest known word to a misspelt one.

use strum::VariantNames;

/// The word of `known` nearest to an unknown one, if it is near enough to be a typing error: a third of the letters, one to
/// three of them.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = (word.chars().count() / 3).clamp(1, 3);
    nearest_within(word, known, |_| limit)
}

/// The word of `known` nearest to another one, the first of several, if it is at most as many edits away as `limit` allows. Case
/// does not count; blanks and hyphens equal underscores.
pub fn nearest_within<'a>(
    word: &str,
    known: impl IntoIterator<Item = &'a str>,
    limit: impl Fn(&str) -> usize,
) -> Option<&'a str> {
    let wanted = plain(word);
    let near = |known: &'a str| {
        let (other, limit) = (plain(known), limit(known));
        // The distance takes quadratic time, and is at least the difference of the lengths.
        let lengths = wanted.chars().count().abs_diff(other.chars().count());
        let distance = (lengths <= limit).then(|| strsim::osa_distance(&wanted, &other))?;
        // A word of which no letter remains is not a typing error.
        (distance <= limit && distance < other.chars().count()).then_some((distance, known))
    };
    known.into_iter().filter_map(near).min_by_key(|(distance, _)| *distance).map(|(_, known)| known)
}

fn plain(word: &str) -> String {
    word.to_lowercase().replace([' ', '-'], "_")
}

/// `; did you mean ...?` for the end of a message, or nothing.
pub fn did_you_mean<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    suggestion(nearest(word, known))
}

/// The same for a word that has already been found.
pub fn suggestion(near: Option<&str>) -> String {
    near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"))
}

/// `a, b or c`.
pub fn any_of(words: &[&str]) -> String {
    match words {
        [several @ .., last] if !several.is_empty() => format!("{} or {last}", several.join(", ")),
        _ => words.concat(),
    }
}

/// A word outside an enum.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what} `{found}`: expected {}{}", any_of(.known), did_you_mean(.found, .known.iter().copied()))]
pub struct UnknownWord {
    what: &'static str,
    found: String,
    known: &'static [&'static str],
}

impl UnknownWord {
    /// `what` names the kind of the words of `T`.
    pub fn of<T: VariantNames>(what: &'static str, found: &str) -> UnknownWord {
        UnknownWord { what, found: found.to_owned(), known: T::VARIANTS }
    }
}

#[cfg(test)]
mod tests {
    use super::{nearest, nearest_within};

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

    #[test]
    fn hyphens_count_nothing_and_of_equally_near_words_the_first_is_taken() {
        assert_eq!(nearest("L cth", ["l-idm", "l-cth"]), Some("l-cth"));
        assert_eq!(nearest("k_x", ["k_s", "k_0"]), Some("k_s"));
    }

    #[test]
    fn a_limit_is_one_of_the_known_word() {
        let strict = |known: &str| (known.len() - 1) / 3;
        assert_eq!(nearest_within("Sped2", ["IVS2", "Speed2"], strict), Some("Speed2"));
        assert_eq!(nearest_within("IWS", ["IVS"], strict), None, "a third of it");
    }
}
