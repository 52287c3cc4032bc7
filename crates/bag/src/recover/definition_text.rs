//! Whether a text may be a message definition of `.msg` files.
//!
//! Source of the language: <https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html>.

use std::collections::BTreeSet;

const PRIMITIVE: [&str; 18] = [
    "bool", "byte", "char", "float32", "float64", "int8", "uint8", "int16", "uint16", "int32",
    "uint32", "int64", "uint64", "string", "wstring",
    // Of ROS 1, whose definitions are found in converted bags.
    "time", "duration", "Header",
];

/// Whether every line is a comment, a field, a constant or the heading of a message, and the text has the messages that
/// its fields name without their package.
pub(super) fn is_plausible(text: &str) -> bool {
    let headings = text.lines().filter_map(heading);
    let messages: BTreeSet<_> = headings
        .filter_map(|name| name.rsplit('/').next())
        .collect();
    let is_control = |letter: char| letter.is_control() && !['\n', '\r', '\t'].contains(&letter);
    !text.contains(is_control) && text.lines().all(|line| is_line(line, &messages))
}

fn heading(line: &str) -> Option<&str> {
    let name = line.strip_prefix("MSG:").or(line.strip_prefix("IDL:"))?;
    Some(name.trim())
}

fn is_line(line: &str, messages: &BTreeSet<&str>) -> bool {
    if let Some(name) = heading(line) {
        return is_path(name);
    }
    let line = line.trim();
    if line.is_empty() || line.starts_with(['#', '@']) || line.bytes().all(|byte| byte == b'=') {
        return true;
    }
    let Some((kind, rest)) = line.split_once(char::is_whitespace) else {
        return false;
    };
    let rest = rest.trim_start();
    let name = &rest[..rest.find(|letter| !is_name(letter)).unwrap_or(rest.len())];
    let after = &rest[name.len()..];
    let is_end = |after: &str| after.is_empty() || after.starts_with(['=', '#', ' ', '\t']);
    name.starts_with(|letter: char| letter.is_ascii_alphabetic())
        && is_end(after)
        && is_type(kind, messages)
}

fn is_type(kind: &str, messages: &BTreeSet<&str>) -> bool {
    let (base, length) = kind.split_once('[').unwrap_or((kind, "]"));
    let length = length.strip_suffix(']');
    let length = length.map(|length| length.strip_prefix("<=").unwrap_or(length));
    let is_number = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if !length.is_some_and(is_number) {
        return false;
    }
    match base.split_once("<=") {
        Some((base, bound)) => ["string", "wstring"].contains(&base) && is_number(bound),
        None if base.contains('/') => is_path(base),
        None => PRIMITIVE.contains(&base) || messages.contains(base),
    }
}

/// Names with `/` between them.
fn is_path(text: &str) -> bool {
    text.split('/')
        .all(|name| !name.is_empty() && name.chars().all(is_name))
}

fn is_name(letter: char) -> bool {
    letter.is_ascii_alphanumeric() || letter == '_'
}

#[cfg(test)]
mod tests {
    use super::is_plausible;

    #[test]
    fn all_known_definitions_are_plausible() {
        for known in lgvi_msgs::message_types() {
            assert!(is_plausible(known.definition), "{}", known.name);
        }
        assert!(is_plausible(
            "# a\nstring<=5[<=3] names \"x\"\nint8 A = 3 # three\r\nchar B='#'\n@key\nstd_msgs/Header[2] h\nPoint p\n\
             ================\nMSG: geometry_msgs/Point\nfloat64 x 1.5\n"
        ));
        assert!(is_plausible(""));
    }

    #[test]
    fn damaged_definitions_are_not() {
        for text in [
            "flgat64 x\n",
            "float64[ x\n",
            "float64 x\u{7f}\n",
            "float64 (\n",
            "float64\n",
            "float64 x!\n",
            "string<=x name\n",
            "Point p\n====\nMSG: geometry_msgs/Qoint\nfloat64 x\n",
            "Point p\n====\nOSG: geometry_msgs/Point\nfloat64 x\n",
        ] {
            assert!(!is_plausible(text), "{text}");
        }
    }
}
