//! Resolution of the message types that fields name.

use std::{collections::BTreeMap, sync::Arc};

use super::{
    DefinitionError, Field, MAX_DEPTH, Message, Number, Type,
    lines::{Base, Source, base_name},
};

/// Messages whose texts some recorders omit. Both consist of seconds and nanoseconds.
const TIMES: [&str; 2] = ["builtin_interfaces/Time", "builtin_interfaces/Duration"];

/// Returns the message `type_name`, resolved from the texts.
pub(super) fn resolve(
    type_name: &str,
    sources: &[Source],
) -> Result<Arc<Message>, DefinitionError> {
    let mut by_name = BTreeMap::new();
    for source in sources {
        // The first entry may be an empty heading with the same name.
        let known = by_name.entry(&*source.name).or_insert(source);
        if known.fields.is_empty() {
            *known = source;
        }
    }
    let mut resolver = Resolver {
        sources: by_name,
        resolved: BTreeMap::new(),
        path: Vec::new(),
    };
    let name = base_name(type_name);
    Ok(resolver.message(&name, &name)?.0)
}

struct Resolver<'s> {
    sources: BTreeMap<&'s str, &'s Source>,
    /// Resolved messages with their nesting depth, including the message itself.
    resolved: BTreeMap<String, (Arc<Message>, usize)>,
    /// Messages that are being resolved, starting with the outermost.
    path: Vec<String>,
}

impl Resolver<'_> {
    fn message(
        &mut self,
        name: &str,
        user: &str,
    ) -> Result<(Arc<Message>, usize), DefinitionError> {
        if let Some(known) = self.resolved.get(name) {
            return Ok(known.clone());
        }
        if self.path.iter().any(|outer| outer == name) {
            let outer = self.path.iter().skip_while(|outer| *outer != name);
            let cycle: Vec<_> = outer.map(String::as_str).chain([name]).collect();
            return Err(DefinitionError::Recursive {
                cycle: cycle.join(" → "),
            });
        }
        let too_deep = || DefinitionError::TooDeep {
            message: name.to_owned(),
        };
        if self.path.len() >= MAX_DEPTH {
            return Err(too_deep());
        }
        self.path.push(name.to_owned());
        let (fields, depth) = self.fields(name, user)?;
        self.path.pop();
        if depth > MAX_DEPTH {
            return Err(too_deep());
        }
        let least = fields.iter().fold(0, |sum: usize, field| {
            sum.saturating_add(field.kind.least())
        });
        let message = Message {
            fields,
            // A message without fields is encoded as one meaningless octet.
            least: least.max(1),
        };
        let known = (Arc::new(message), depth);
        self.resolved.insert(name.to_owned(), known.clone());
        Ok(known)
    }

    /// Returns the fields of a message, and its nesting depth.
    fn fields(&mut self, name: &str, user: &str) -> Result<(Vec<Field>, usize), DefinitionError> {
        let Some(&source) = self.sources.get(name) else {
            let missing = || DefinitionError::Missing {
                message: user.to_owned(),
                missing: name.to_owned(),
            };
            return Ok((time(name).ok_or_else(missing)?, 1));
        };
        let mut deepest = 0;
        let mut fields = Vec::with_capacity(source.fields.len());
        for field in &source.fields {
            let base = match &field.base {
                Base::Number(number) => Type::Number(*number),
                Base::Text(text) => Type::Text(*text),
                Base::Message(needed) => {
                    let (message, depth) = self.message(needed, name)?;
                    deepest = deepest.max(depth);
                    Type::Message(message)
                }
            };
            fields.push(Field {
                name: field.name.clone(),
                kind: match field.length {
                    None => base,
                    Some(length) => Type::Array {
                        element: Box::new(base),
                        length,
                    },
                },
            });
        }
        Ok((fields, deepest + 1))
    }
}

fn time(name: &str) -> Option<Vec<Field>> {
    let field = |name: &str, number| Field {
        name: name.to_owned(),
        kind: Type::Number(number),
    };
    TIMES.contains(&name).then(|| {
        vec![
            field("sec", Number::Int32),
            field("nanosec", Number::Uint32),
        ]
    })
}
