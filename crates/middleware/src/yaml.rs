//! YAML as ROS 2 reads it: scalars by the rules of `rcl_yaml_param_parser`, which are those of YAML 1.1 where the
//! libraries for Rust have YAML 1.2 (`yes` is a bool, `017` is fifteen, `null` is a word). The word `null` alone is told
//! from the string: it is [`ParameterValue::NotSet`], which `ros2 param dump` writes so.

use saphyr_parser::{Event, Parser, ScalarStyle, Tag};

use crate::parameters::{ParameterType, ParameterValue as Value};

/// Nesting beyond this is refused: what reads the tree is recursive.
const MAX_DEPTH: usize = 64;

/// A node of a document, with the line on which it starts.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Node {
    pub(crate) line: usize,
    pub(crate) content: Content,
}

/// What a node is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Content {
    /// A plain scalar without text.
    Nothing,
    Scalar(Value),
    List(Vec<Node>),
    /// Keys as they are written, in order; one may come twice.
    Map(Vec<(String, Node)>),
}

/// The documents of a text.
///
/// # Errors
/// What is wrong, with its line: no YAML, an alias, a key that is no scalar, too deep a nesting.
pub(crate) fn documents(text: &str) -> Result<Vec<Node>, String> {
    let mut builder = Builder::default();
    for event in Parser::new_from_str(text) {
        let (event, span) = event.map_err(|error| {
            let (line, column) = (error.marker().line(), error.marker().col() + 1);
            format!("line {line}, column {column}: {}", error.info())
        })?;
        builder
            .take(event, span.start.line())
            .map_err(|reason| format!("line {}: {reason}", span.start.line()))?;
    }
    Ok(builder.documents)
}

/// The plain word `null`.
pub(crate) const NULL: &str = "null";

/// A parameter's value: a scalar, or a list of scalars of one type. The plain word `null` is [`Value::NotSet`], in a list a
/// string.
///
/// # Errors
/// What is wrong with it.
pub(crate) fn parameter(node: Node) -> Result<Value, String> {
    match node.content {
        Content::Nothing => Err("the value is missing".into()),
        Content::Scalar(value) => Ok(value),
        Content::Map(_) => Err("the value must be a scalar or a list, found a map".into()),
        Content::List(items) => list(items),
    }
}

fn list(items: Vec<Node>) -> Result<Value, String> {
    let mut values = Vec::with_capacity(items.len());
    for item in items {
        match item.content {
            Content::Scalar(Value::NotSet) => values.push(NULL.into()),
            Content::Scalar(value) => values.push(value),
            content => {
                let kind = content.kind();
                return Err(format!("a list must hold scalars only, found {kind}"));
            }
        }
    }
    let first = values.first().cloned().unwrap_or_default();
    if let Some(other) = values.iter().map(kind).find(|other| *other != kind(&first)) {
        let first = kind(&first);
        return Err(format!(
            "all of a list must be of one type, found {first} and {other}"
        ));
    }
    Ok(match first {
        Value::Bool(_) => of_type::<bool>(values).into(),
        Value::Integer(_) => of_type::<i64>(values).into(),
        Value::Double(_) => of_type::<f64>(values).into(),
        // An empty one is accepted as one of any type.
        _ => of_type::<String>(values).into(),
    })
}

fn of_type<T: ParameterType>(values: Vec<Value>) -> Vec<T> {
    values.into_iter().filter_map(T::from_value).collect()
}

impl Content {
    /// What it is, as it is said to the user.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Scalar(value) => kind(value),
            Self::List(_) => "a list",
            Self::Map(_) => "a map",
        }
    }
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Bool(_) => "a bool",
        Value::Integer(_) => "an integer",
        Value::Double(_) => "a float",
        _ => "a string",
    }
}

/// A collection that has begun.
enum Open {
    List(usize, Vec<Node>),
    Map(usize, Vec<(String, Node)>, Option<String>),
}

#[derive(Default)]
struct Builder {
    open: Vec<Open>,
    documents: Vec<Node>,
}

impl Builder {
    fn take(&mut self, event: Event<'_>, line: usize) -> Result<(), String> {
        match event {
            Event::Alias(_) => Err("aliases are not supported".into()),
            Event::Scalar(text, style, _, tag) => match self.open.last_mut() {
                Some(Open::Map(_, _, key @ None)) => {
                    *key = Some(text.into_owned());
                    Ok(())
                }
                _ => self.put(line, scalar(&text, style, tag.as_deref())),
            },
            Event::SequenceStart(..) => self.begin(Open::List(line, Vec::new())),
            Event::MappingStart(..) => self.begin(Open::Map(line, Vec::new(), None)),
            Event::SequenceEnd | Event::MappingEnd => match self.open.pop() {
                Some(Open::List(line, items)) => self.put(line, Content::List(items)),
                Some(Open::Map(line, entries, _)) => self.put(line, Content::Map(entries)),
                None => Ok(()),
            },
            _ => Ok(()),
        }
    }

    fn begin(&mut self, collection: Open) -> Result<(), String> {
        if self.open.len() >= MAX_DEPTH {
            return Err(format!("nested more than {MAX_DEPTH} deep"));
        }
        if let Some(Open::Map(_, _, None)) = self.open.last() {
            return Err("a key must be a name, found a list or a map".into());
        }
        self.open.push(collection);
        Ok(())
    }

    fn put(&mut self, line: usize, content: Content) -> Result<(), String> {
        let node = Node { line, content };
        match self.open.last_mut() {
            None => self.documents.push(node),
            Some(Open::List(_, items)) => items.push(node),
            Some(Open::Map(_, entries, key)) => {
                let key = key.take().ok_or("a value without a key")?;
                entries.push((key, node));
            }
        }
        Ok(())
    }
}

fn scalar(text: &str, style: ScalarStyle, tag: Option<&Tag>) -> Content {
    let string = tag.is_some_and(|tag| tag.is_yaml_core_schema() && tag.suffix == "str");
    if style != ScalarStyle::Plain || string {
        return Content::Scalar(text.into());
    }
    if text.is_empty() {
        return Content::Nothing;
    }
    Content::Scalar(plain(text))
}

fn plain(text: &str) -> Value {
    if text == NULL {
        Value::NotSet
    } else if let Some(flag) = boolean(text) {
        Value::Bool(flag)
    } else if let Some(number) = integer(text) {
        Value::Integer(number)
    } else if let Some(number) = float(text) {
        Value::Double(number)
    } else {
        Value::String(text.into())
    }
}

fn boolean(text: &str) -> Option<bool> {
    match text {
        "y" | "Y" | "yes" | "Yes" | "YES" | "true" | "True" | "TRUE" | "on" | "On" | "ON" => {
            Some(true)
        }
        "n" | "N" | "no" | "No" | "NO" | "false" | "False" | "FALSE" | "off" | "Off" | "OFF" => {
            Some(false)
        }
        _ => None,
    }
}

/// As `strtoll` with base 0: decimal, hexadecimal after `0x`, octal after `0`.
fn integer(text: &str) -> Option<i64> {
    let unsigned = text.strip_prefix(['+', '-']).unwrap_or(text);
    let hexadecimal = unsigned
        .strip_prefix("0x")
        .or_else(|| unsigned.strip_prefix("0X"));
    let (digits, radix) = match (hexadecimal, unsigned.strip_prefix('0')) {
        (Some(digits), _) => (digits, 16),
        (None, Some(digits)) if !digits.is_empty() => (digits, 8),
        _ => (unsigned, 10),
    };
    if !digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return None;
    }
    let sign = if text.starts_with('-') { "-" } else { "" };
    i64::from_str_radix(&format!("{sign}{digits}"), radix).ok()
}

/// As `strtod`, and YAML's `.inf` and `.nan`; what is beyond the range of a double is none.
fn float(text: &str) -> Option<f64> {
    match text {
        ".nan" | ".NaN" | ".NAN" => return Some(f64::NAN),
        ".inf" | ".Inf" | ".INF" | "+.inf" | "+.Inf" | "+.INF" => return Some(f64::INFINITY),
        "-.inf" | "-.Inf" | "-.INF" => return Some(f64::NEG_INFINITY),
        _ => {}
    }
    let number: f64 = text.parse().ok()?;
    let mantissa = text.split(['e', 'E']).next().unwrap_or(text);
    let overflow = number.is_infinite() && text.bytes().any(|byte| byte.is_ascii_digit());
    let underflow = number == 0.0 && mantissa.bytes().any(|byte| matches!(byte, b'1'..=b'9'));
    (!overflow && !underflow).then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Result<Value, String> {
        let node = documents(text)?.pop().ok_or("nothing")?;
        parameter(node)
    }

    /// What `rcl` of ROS 2 Jazzy makes of each of these.
    #[test]
    fn scalars_have_the_types_that_rcl_gives_them() {
        for (texts, expected) in [
            ("true True TRUE yes Yes Y y on On ON", Value::from(true)),
            ("false False n no off OFF", Value::from(false)),
            ("15 0xF 0Xf 017 +15", Value::from(15_i64)),
            ("-15 -0xF -017", Value::from(-15_i64)),
            ("-0 0 00", Value::from(0_i64)),
            ("8. 8.0 08 8e0 +8.0", Value::from(8.0)),
            (".5 0.5 5e-1 5E-1", Value::from(0.5)),
            (
                ".inf .Inf .INF +.inf inf infinity",
                Value::from(f64::INFINITY),
            ),
            ("-.inf -inf", Value::from(f64::NEG_INFINITY)),
            ("9223372036854775807 0x7fffffffffffffff", i64::MAX.into()),
            ("-9223372036854775808", i64::MIN.into()),
            ("9223372036854775808", Value::from(9223372036854775808.0)),
        ] {
            for text in texts.split(' ') {
                assert_eq!(value(text).unwrap(), expected, "{text}");
            }
        }
        for text in [".nan", ".NaN", "nan", "NaN"] {
            let number = f64::from_value(value(text).unwrap());
            assert!(number.unwrap().is_nan(), "{text}");
        }
    }

    #[test]
    fn everything_else_is_a_string() {
        for text in [
            "tRue",
            "~",
            "0o17",
            "0b11",
            "0x",
            "1_000",
            "1e400",
            "1e-400",
            "12:30",
            "2001-01-01",
            "1.5.2",
            "1,2",
            "1 2",
            "0.1e",
            "1f",
            "hello world",
            "a:=b",
            "$(foo)",
        ] {
            assert_eq!(value(text).unwrap(), Value::from(text), "{text}");
        }
    }

    #[test]
    fn the_plain_word_null_is_told_from_the_string() {
        assert_eq!(value("null").unwrap(), Value::NotSet);
        for text in ["'null'", "\"null\"", "!!str null"] {
            assert_eq!(value(text).unwrap(), Value::from("null"), "{text}");
        }
    }

    #[test]
    fn quoted_and_tagged_strings_stay_strings() {
        for (text, expected) in [
            ("\"5\"", "5"),
            ("'true'", "true"),
            ("\"yes\"", "yes"),
            ("''", ""),
            ("!!str 5", "5"),
            ("!!int \"5\"", "5"),
            ("|-\n 5", "5"),
        ] {
            assert_eq!(value(text).unwrap(), Value::from(expected), "{text}");
        }
        assert_eq!(value("!own 5").unwrap(), Value::from(5_i64));
        assert_eq!(value(" 5 # five").unwrap(), Value::from(5_i64));
        assert_eq!(value("&five 5").unwrap(), Value::from(5_i64));
    }

    #[test]
    fn lists_are_of_one_type() {
        assert_eq!(value("[yes, no]").unwrap(), Value::from(vec![true, false]));
        for (text, expected) in [
            ("[0x10, 1,]", Value::from(vec![16, 1])),
            ("[.inf, 1.0]", vec![f64::INFINITY, 1.0].into()),
            ("- 1\n- 2", vec![1, 2].into()),
            ("[null]", vec!["null".to_owned()].into()),
            ("[]", Vec::<String>::new().into()),
        ] {
            assert_eq!(value(text).unwrap(), expected, "{text}");
        }
        for (text, expected) in [
            ("[1, 2.5]", "an integer and a float"),
            ("[1.5, 2]", "a float and an integer"),
            ("[1, true]", "an integer and a bool"),
            ("[a, 1]", "a string and an integer"),
            ("[1, \"2\"]", "an integer and a string"),
            ("[1, [2]]", "found a list"),
            ("[{a: 1}]", "found a map"),
            ("[1, ]\n", ""),
            ("-", "found nothing"),
        ] {
            match value(text) {
                Err(error) => assert!(error.contains(expected), "{text}: {error}"),
                Ok(_) => assert_eq!(expected, "", "{text} was accepted"),
            }
        }
    }

    #[test]
    fn what_is_no_value_is_refused_with_its_line() {
        for (text, expected) in [
            ("{x: 1}", "found a map"),
            ("a: b", "found a map"),
            ("# nothing", "nothing"),
            ("[a", "line 2, column 1"),
            ("\"a", "line 1"),
            ("*a", "line 1"),
            ("a: &x 1\nb: *x", "line 2: aliases are not supported"),
            ("[1]: 2", "line 1"),
            (&"[".repeat(65), "nested more than 64 deep"),
            (&"- ".repeat(65), "nested more than 64 deep"),
            (&"[".repeat(100_000), "limit exceeded"),
        ] {
            let error = value(text).unwrap_err();
            assert!(error.contains(expected), "{text:.20}: {error}");
        }
    }
}
