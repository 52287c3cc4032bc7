//! Topics as names of files.

use std::collections::BTreeSet;

/// File systems take names of 255 bytes, of which some are for a number and extensions.
const MAX_LENGTH: usize = 255 - "~65535.parquet.part".len();

/// Names of files without extension, of which no two are the same on any file system.
///
/// `/lgvi_propagator/state` becomes `lgvi_propagator.state`. What may not be in a topic's name becomes `%` and two
/// hexadecimal digits; a name that is taken gets `~2`, `~3`, ….
#[derive(Default)]
pub(crate) struct FileNames {
    /// In lower case, since some file systems do not tell it from upper case.
    taken: BTreeSet<String>,
}

impl FileNames {
    pub fn of(&mut self, topic: &str) -> String {
        let name = encoded(topic);
        let mut candidate = name.clone();
        let mut count = 1;
        while !self.taken.insert(candidate.to_ascii_lowercase()) {
            count += 1;
            candidate = format!("{name}~{count}");
        }
        candidate
    }
}

/// Says why no file can be named after a topic.
pub(crate) fn check(topic: &str) -> Result<(), String> {
    let length = encoded(topic).len();
    if length <= MAX_LENGTH {
        return Ok(());
    }
    Err(format!(
        "its name is too long for a file's: {length} bytes, expected at most {MAX_LENGTH}"
    ))
}

fn encoded(topic: &str) -> String {
    let name = topic.strip_prefix('/').unwrap_or(topic);
    if name.is_empty() {
        return "%2F".to_owned();
    }
    let mut text = String::new();
    for byte in name.bytes() {
        match byte {
            b'/' => text.push('.'),
            byte if byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-' => {
                text.push(char::from(byte));
            }
            byte => text.push_str(&format!("%{byte:02X}")),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_topic_has_a_name_of_its_own() {
        let mut names = FileNames::default();
        let expected = [
            ("/lgvi_propagator/state", "lgvi_propagator.state"),
            ("/lgvi_propagator.state", "lgvi_propagator%2Estate"),
            ("lgvi_propagator/state", "lgvi_propagator.state~2"),
            ("/Lgvi_Propagator/state", "Lgvi_Propagator.state~3"),
            ("/lgvi_propagator.state~2", "lgvi_propagator%2Estate%7E2"),
            ("/", "%2F"),
            ("", "%2F~2"),
            ("/../etc", "%2E%2E.etc"),
            ("/é", "%C3%A9"),
        ];
        for (topic, name) in expected {
            assert_eq!(names.of(topic), name, "{topic}");
        }
    }
}
