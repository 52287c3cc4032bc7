//! What the command line takes as values.

use std::path::PathBuf;

use clap::builder::{OsStringValueParser, TypedValueParser};
use clap::value_parser;

/// A path. It goes to nodes as a parameter and into summaries, which are text.
pub(crate) fn path() -> impl TypedValueParser<Value = PathBuf> {
    OsStringValueParser::new().try_map(|path| match path.into_string() {
        Ok(path) if path.is_empty() => Err("expected a path".to_owned()),
        Ok(path) => Ok(PathBuf::from(path)),
        Err(path) => Err(format!("{path:?} is not valid Unicode")),
    })
}

/// A number of bytes, of which nodes take no more than a signed integer can tell.
pub(crate) fn bytes(least: i64) -> impl TypedValueParser<Value = i64> {
    value_parser!(i64).range(least..)
}

/// Seconds a second.
pub(crate) fn rate(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|rate: &f64| rate.is_finite() && *rate >= 0.0)
        .ok_or_else(|| "expected a finite number ≥ 0".into())
}

/// A length of time (s).
pub(crate) fn seconds(text: &str) -> Result<f64, String> {
    rate(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_finite_and_not_negative() {
        assert_eq!(rate("0"), Ok(0.0));
        assert_eq!(rate("2.5"), Ok(2.5));
        for bad in ["nan", "-1", "inf", "1e400", "fast", ""] {
            assert!(rate(bad).is_err(), "{bad:?}");
        }
    }
}
