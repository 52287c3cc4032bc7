//! Lines of a scene's text, for messages.

use std::iter::once;

use toml::de::{DeTable, DeValue};

/// Returns the line, counted from 1, of a key such as `bodies[0].inertia`; that of the nearest key above it if it is
/// missing; `None` if nothing of it is there.
pub(crate) fn line(text: &str, key: &str) -> Option<usize> {
    let root = DeTable::parse(text).ok()?;
    let mut names = key.split('.').flat_map(|part| {
        let (name, indices) = part
            .split_once('[')
            .map_or((part, ""), |(name, rest)| (name, rest));
        once(name).chain(indices.split(['[', ']']).filter(|index| !index.is_empty()))
    });
    let first = names.next()?;
    let (name, value) = root.get_ref().get_key_value(first)?;
    let (mut start, mut value) = (name.span().start, value.get_ref());
    for name in names {
        match value {
            DeValue::Table(table) => {
                let Some((name, inner)) = table.get_key_value(name) else {
                    break;
                };
                (start, value) = (name.span().start, inner.get_ref());
            }
            DeValue::Array(values) => {
                let Some(inner) = name.parse().ok().and_then(|index: usize| values.get(index))
                else {
                    break;
                };
                (start, value) = (inner.span().start, inner.get_ref());
            }
            _ => break,
        }
    }
    let before = text.get(..start)?;
    Some(before.matches('\n').count() + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_found_in_tables_arrays_and_inline_tables() {
        let text = "title = \"t\"\n[run]\nsteps = 1\n[[bodies]]\nname = \"a\"\n[[bodies]]\npoints = [\n  { mass = 1 },\n  { mass = 2 },\n]\n[a.b]\nc = 1\n";
        for (key, expected) in [
            ("title", Some(1)),
            ("run.steps", Some(3)),
            ("run.duration", Some(2)),
            ("bodies[0].name", Some(5)),
            ("bodies[1].points[1].mass", Some(9)),
            ("bodies[1].mass", Some(6)),
            ("bodies[7].mass", Some(4)),
            ("a.b.c", Some(12)),
            ("nothing.at.all", None),
        ] {
            assert_eq!(line(text, key), expected, "{key}");
        }
    }
}
