//! The values of a key, as the command line has them.

use lgvi_review::sweep::Variation;
use toml_edit::Value;

/// Most values of a key.
const MOST: usize = 100_000;

/// Reads `KEY=[VALUES]`.
pub(super) fn parse(text: &str) -> Result<Variation, String> {
    let (key, list) = text.split_once('=').ok_or("expected KEY=[VALUES]")?;
    let key = key.trim().to_owned();
    let list = list.trim();
    let inside = list
        .strip_prefix('[')
        .and_then(|rest| rest.strip_suffix(']'));
    let inside = inside.ok_or_else(|| {
        format!("{list:?} is not in brackets, expected values as in [100, 200, 500]")
    })?;
    let values = match inside.rsplit_once(',') {
        Some((ends, rule)) if is_rule(rule.trim()) => spaced(ends, rule.trim())?,
        _ => listed(list)?,
    };
    Ok(Variation { key, values })
}

fn is_rule(text: &str) -> bool {
    text.starts_with("log:") || text.starts_with("lin:")
}

/// The values of a TOML array.
fn listed(list: &str) -> Result<Vec<String>, String> {
    let array: Value = list
        .parse()
        .map_err(|error| format!("{list} is not a TOML array: {error}"))?;
    let elements = array.as_array().into_iter().flatten();
    let values: Vec<_> = elements
        .map(|value| value.clone().decorated("", "").to_string())
        .collect();
    if (1..=MOST).contains(&values.len()) {
        Ok(values)
    } else {
        let count = values.len();
        Err(format!("{count} values, expected 1 to {MOST}"))
    }
}

/// So many values from the first to the last, at equal ratios or distances. Between whole numbers they are rounded to whole
/// numbers, each of which comes once.
fn spaced(ends: &str, rule: &str) -> Result<Vec<String>, String> {
    let (kind, count) = rule.split_at(4);
    let expected = "expected [FIRST, LAST, log:COUNT] or [FIRST, LAST, lin:COUNT]";
    let count: usize = count
        .parse()
        .map_err(|_| format!("{rule:?} has no count, {expected}"))?;
    if !(2..=MOST).contains(&count) {
        return Err(format!("{count} values, expected 2 to {MOST}"));
    }
    let (first, last) = ends
        .split_once(',')
        .ok_or_else(|| format!("{ends:?} is not two numbers, {expected}"))?;
    let number = |text: &str| {
        let number: Option<f64> = text.trim().parse().ok().filter(|x: &f64| x.is_finite());
        number.ok_or_else(|| format!("{:?} is no number, {expected}", text.trim()))
    };
    let (from, to) = (number(first)?, number(last)?);
    let is_log = kind == "log:";
    if is_log && !(from > 0.0 && to > 0.0) {
        return Err(format!("{from} and {to}, expected numbers > 0 for log"));
    }
    let is_whole = |text: &str| text.trim().parse::<i64>().is_ok();
    let whole = is_whole(first) && is_whole(last);
    let mut values = Vec::new();
    for index in 0..count {
        let part = index as f64 / (count - 1) as f64;
        let value = match (index, is_log) {
            (0, _) => from,
            (_, _) if index == count - 1 => to,
            (_, true) => from * libm::pow(to / from, part),
            (_, false) => from + part * (to - from),
        };
        let text = match whole {
            true => format!("{}", value.round() as i64),
            false => format!("{value:?}"),
        };
        if values.last() != Some(&text) {
            values.push(text);
        }
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Vec<String> {
        parse(text).unwrap().values
    }

    #[test]
    fn values_are_those_of_an_array() {
        let found = parse("run.integrator = [\"lgvi\", 'rk4', {name = \"nystrom\", order = 4}]");
        let found = found.unwrap();
        assert_eq!(found.key, "run.integrator");
        assert_eq!(
            found.values,
            ["\"lgvi\"", "'rk4'", "{name = \"nystrom\", order = 4}"]
        );
        assert_eq!(values("run.steps=[100, 200]"), ["100", "200"]);
    }

    #[test]
    fn spaced_values_include_both_ends() {
        assert_eq!(values("k=[100, 800, log:4]"), ["100", "200", "400", "800"]);
        assert_eq!(values("k=[1.0, 100.0, log:3]"), ["1.0", "10.0", "100.0"]);
        assert_eq!(values("k=[1, 3, lin:9]"), ["1", "2", "3"]);
        assert_eq!(values("k=[-0.5, 0.5, lin:3]"), ["-0.5", "0.0", "0.5"]);
        assert_eq!(values("k=[1e-3, 0.1, log:2]"), ["0.001", "0.1"]);
    }

    #[test]
    fn what_is_no_list_of_values_is_refused_with_what_is_expected() {
        let refused = |text: &str| parse(text).unwrap_err();
        assert_eq!(refused("run.steps"), "expected KEY=[VALUES]");
        assert_eq!(
            refused("run.steps=5"),
            "\"5\" is not in brackets, expected values as in [100, 200, 500]"
        );
        assert_eq!(refused("k=[]"), "0 values, expected 1 to 100000");
        assert_eq!(refused("k=[1, 2, log:1]"), "1 values, expected 2 to 100000");
        assert_eq!(
            refused("k=[-1, 2, log:3]"),
            "-1 and 2, expected numbers > 0 for log"
        );
        assert_eq!(
            refused("k=[a, 2, lin:3]"),
            "\"a\" is no number, expected [FIRST, LAST, log:COUNT] or [FIRST, LAST, lin:COUNT]"
        );
        assert!(refused("k=[1 2]").starts_with("[1 2] is not a TOML array: "));
    }
}
