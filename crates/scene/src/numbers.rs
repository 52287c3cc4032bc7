//! Limits that apply to every number of a scene, whatever it measures.

use toml::de::{DeTable, DeValue};

use crate::SceneError;

/// Bounds on the size of nonzero numbers, chosen so that their cubes are representable.
const LEAST: f64 = 1e-100;
const GREATEST: f64 = 1e100;

/// Refuses the first number of a text that is beyond the limits, naming its key. Numbers that are not finite are left
/// to the check of each key, which knows the expected values.
pub(crate) fn check(text: &str) -> Result<(), SceneError> {
    let table = DeTable::parse(text).map_err(|error| SceneError::syntax(&error))?;
    check_table(table.get_ref(), "")
}

fn check_table(table: &DeTable<'_>, prefix: &str) -> Result<(), SceneError> {
    table.iter().try_for_each(|(name, value)| {
        let key = format!("{prefix}{}", name.get_ref());
        check_value(value.get_ref(), &key)
    })
}

fn check_value(value: &DeValue<'_>, key: &str) -> Result<(), SceneError> {
    match value {
        DeValue::Float(text) => {
            let number = text.as_str().replace('_', "").parse();
            match number {
                Ok(number) if is_beyond(number) => {
                    let expected =
                        format!("0 or a number of a size from {LEAST:e} to {GREATEST:e}");
                    Err(SceneError::value(key, number, expected))
                }
                _ => Ok(()),
            }
        }
        DeValue::Array(values) => {
            let mut values = values.iter().enumerate();
            values.try_for_each(|(index, value)| {
                check_value(value.get_ref(), &format!("{key}[{index}]"))
            })
        }
        DeValue::Table(table) => check_table(table, &format!("{key}.")),
        _ => Ok(()),
    }
}

fn is_beyond(number: f64) -> bool {
    number.is_finite() && number != 0.0 && !(LEAST..=GREATEST).contains(&number.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_beyond_the_limits_is_refused_wherever_it_is() {
        let refused = |text: &str| check(text).map_err(|error| error.to_string());
        assert_eq!(
            refused(
                "a = 0.0\nb = [1e100, -1e-100]\nc = { d = -0.0, e = inf, f = 18446744073709551615 }"
            ),
            Ok(())
        );
        for (text, said) in [
            (
                "a = 1e160",
                "`a` is 1e160, expected 0 or a number of a size from 1e-100 to 1e100",
            ),
            ("a = -5e-324", "`a` is -5e-324"),
            ("a = 1_0.0e2_00", "`a` is 1e201"),
            (
                "[[a]]\nb = 1.0\n[[a]]\nb = { c = [1, [2e100]] }",
                "`a[1].b.c[1][0]` is 2e100",
            ),
        ] {
            let error = refused(text).unwrap_err();
            assert!(error.starts_with(said), "{error}");
        }
    }
}
