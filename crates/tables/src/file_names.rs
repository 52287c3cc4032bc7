//! File names for topics.

use std::collections::BTreeSet;

/// Maximum length of a name. File systems allow 255 bytes, some of which are reserved for a number and extensions.
const MAX_LENGTH: usize = 255 - "~65535.parquet.part".len();

/// Generates file names without extension that are unique on any file system.
///
/// `/lgvi_propagator/state` becomes `lgvi_propagator.state`. Characters that are not allowed in the name of a topic
/// become `%` and two hexadecimal digits per byte. A name that is taken gets a suffix `~2`, `~3`, ….
#[derive(Default)]
pub(crate) struct FileNames {
    /// Names in lower case, because some file systems do not distinguish case.
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

/// Returns an error if the name of a topic is too long for a file name.
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
