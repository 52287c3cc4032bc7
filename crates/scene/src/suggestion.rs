//! The name that was probably meant.

/// Least similarity of a name that is suggested.
const SIMILAR: f64 = 0.8;

/// Returns the candidate that is most similar to a name, if one is similar enough.
fn nearest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let scored = candidates.map(|candidate| (strsim::jaro_winkler(name, candidate), candidate));
    let best = scored.max_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|(score, _)| *score >= SIMILAR)
        .map(|(_, candidate)| candidate)
}

/// Returns the names that are known, and the one of them that a name is similar to.
pub(crate) fn one_of(name: &str, known: &[&str]) -> String {
    let nearest = nearest(name, known.iter().copied());
    let hint = nearest.map_or_else(String::new, |nearest| format!("; did you mean {nearest}?"));
    format!("one of {}{hint}", known.join(", "))
}

/// Returns the name that is suggested for the one that serde refuses in a message such as "unknown field `a`, expected
/// one of `b`, `c`".
pub(crate) fn of_message(message: &str) -> Option<&str> {
    let line = message.lines().find(|line| line.starts_with("unknown "))?;
    let mut names = line.split('`').skip(1).step_by(2);
    nearest(names.next()?, names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_recognized_and_another_word_is_not() {
        let message = |name: &str| {
            format!("at line 3\nunknown field `{name}`, expected one of `duration`, `steps`\n")
        };
        assert_eq!(of_message(&message("duraton")), Some("duration"));
        assert_eq!(of_message(&message("step")), Some("steps"));
        assert_eq!(of_message(&message("zebra")), None);
        assert_eq!(of_message("missing field `duration`"), None);
    }
}
