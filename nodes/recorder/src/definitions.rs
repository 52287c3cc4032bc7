//! What a message type is made of: our own by heart, others from the ROS 2 packages that are installed.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use lgvi_msgs::lookup;

use crate::fields::{needed, split};

/// The most bytes of a file that are read, and the most types that one is made of.
const LONGEST: u64 = 1 << 20;
const TYPES: usize = 1000;

/// A message type as a bag describes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Definition {
    /// `package/msg/Type`
    pub(crate) type_name: String,
    /// `RIHS01_…`; empty where the installed package does not tell.
    pub(crate) hash: String,
    /// Text of the `.msg` file followed by those of all messages it needs.
    pub(crate) text: String,
}

/// Where definitions are found.
pub(crate) struct Definitions {
    /// The prefixes of installed packages, the first one first.
    prefixes: Vec<PathBuf>,
}

impl Definitions {
    /// Those of `AMENT_PREFIX_PATH`.
    pub(crate) fn installed() -> Self {
        let prefixes = std::env::var_os("AMENT_PREFIX_PATH").unwrap_or_default();
        Self {
            prefixes: std::env::split_paths(&prefixes)
                .filter(|prefix| !prefix.as_os_str().is_empty())
                .collect(),
        }
    }

    /// The definition of `package/msg/Type`, or why there is none.
    pub(crate) fn find(&self, type_name: &str) -> Result<Definition, String> {
        if let Some(known) = lookup(type_name) {
            return Ok(Definition {
                type_name: known.name.to_owned(),
                hash: known.hash.to_owned(),
                text: known.definition.to_owned(),
            });
        }
        let (package, kind) = split(type_name)?;
        let mut seen = BTreeSet::from([(package.to_owned(), kind.to_owned())]);
        let mut text = String::new();
        self.append(package, kind, &mut text, &mut seen)?;
        Ok(Definition {
            type_name: type_name.to_owned(),
            hash: self.hash(package, kind, type_name).unwrap_or_default(),
            text,
        })
    }

    /// Appends the text of a type, then of each that it needs once, depth first, in alphabetical order, as rosbag2 does.
    fn append(
        &self,
        package: &str,
        kind: &str,
        text: &mut String,
        seen: &mut BTreeSet<(String, String)>,
    ) -> Result<(), String> {
        let source = self.read(package, &format!("{kind}.msg"))?;
        text.push_str(&source);
        for (package, kind) in needed(&source, package)? {
            if !seen.insert((package.clone(), kind.clone())) {
                continue;
            }
            if seen.len() > TYPES {
                return Err(format!("it is made of more than {TYPES} types"));
            }
            // Writing to a string cannot fail.
            let _ = write!(text, "\n{}\nMSG: {package}/{kind}\n", "=".repeat(80));
            self.append(&package, &kind, text, seen)?;
        }
        Ok(())
    }

    /// The type hash that the package's description of the type gives.
    fn hash(&self, package: &str, kind: &str, type_name: &str) -> Option<String> {
        let description = self.read(package, &format!("{kind}.json")).ok()?;
        let description: serde_json::Value = serde_json::from_str(&description).ok()?;
        let hashes = description.get("type_hashes")?.as_array()?;
        let found = hashes
            .iter()
            .find(|entry| entry.get("type_name").and_then(|name| name.as_str()) == Some(type_name));
        Some(found?.get("hash_string")?.as_str()?.to_owned())
    }

    /// A file of a package, from the first prefix that has it.
    fn read(&self, package: &str, file: &str) -> Result<String, String> {
        let relative = Path::new("share").join(package).join("msg").join(file);
        for prefix in &self.prefixes {
            let path = prefix.join(&relative);
            let Ok(opened) = File::open(&path) else {
                continue;
            };
            let mut text = String::new();
            let read = opened.take(LONGEST).read_to_string(&mut text);
            return read
                .map(|_| text)
                .map_err(|error| format!("{}: {error}", path.display()));
        }
        Err(format!(
            "no {} below any prefix of AMENT_PREFIX_PATH",
            relative.display()
        ))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use lgvi_msgs::message_types;

    use super::*;

    fn definitions(prefixes: &[&Path]) -> Definitions {
        Definitions {
            prefixes: prefixes.iter().map(|prefix| prefix.to_path_buf()).collect(),
        }
    }

    fn install(prefix: &Path, package: &str, file: &str, text: &str) {
        let folder = prefix.join("share").join(package).join("msg");
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join(file), text).unwrap();
    }

    #[test]
    fn a_type_is_put_together_from_installed_packages() {
        let (first, second) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let outer = "# what it is\nuint8 SMALL=1 # a constant\nother_msgs/Inner[<=3] inner\n\
                     Leaf[] leaves\nstring<=10 name \"a#b\"\nother_msgs/msg/Inner again\n";
        install(first.path(), "my_msgs", "Outer.msg", outer);
        let json = r#"{"type_description_msg": {}, "type_hashes": [
            {"type_name": "other_msgs/msg/Inner", "hash_string": "RIHS01_0"},
            {"type_name": "my_msgs/msg/Outer", "hash_string": "RIHS01_1"}]}"#;
        install(first.path(), "my_msgs", "Outer.json", json);
        install(first.path(), "my_msgs", "Leaf.msg", "float64 x\n");
        install(
            second.path(),
            "other_msgs",
            "Inner.msg",
            "my_msgs/Leaf leaf\n",
        );
        install(second.path(), "my_msgs", "Leaf.msg", "int8 hidden\n");

        let found = definitions(&[first.path(), second.path()]).find("my_msgs/msg/Outer");
        let line = "=".repeat(80);
        let expected = Definition {
            type_name: "my_msgs/msg/Outer".into(),
            hash: "RIHS01_1".into(),
            text: format!(
                "{outer}\n{line}\nMSG: my_msgs/Leaf\nfloat64 x\n\n{line}\nMSG: other_msgs/Inner\nmy_msgs/Leaf leaf\n"
            ),
        };
        assert_eq!(found, Ok(expected));
        // Without its description a type has no hash.
        let found = definitions(&[second.path()])
            .find("my_msgs/msg/Leaf")
            .unwrap();
        assert_eq!(found.hash, "");
    }

    #[test]
    fn our_own_types_come_out_the_same_where_they_are_installed() {
        let prefix = tempfile::tempdir().unwrap();
        for known in message_types() {
            let (package, rest) = known.name.split_once('/').unwrap();
            let own = known.definition.split(&"=".repeat(80)).next().unwrap();
            let own = own
                .strip_suffix('\n')
                .filter(|_| own.len() < known.definition.len());
            if let Some(kind) = rest.strip_prefix("msg/") {
                let text = own.unwrap_or(known.definition);
                install(prefix.path(), package, &format!("{kind}.msg"), text);
            }
        }
        let definitions = definitions(&[prefix.path()]);
        for name in [
            "nav_msgs/msg/Odometry",
            "visualization_msgs/msg/MarkerArray",
        ] {
            let (package, kind) = split(name).unwrap();
            let mut text = String::new();
            let mut seen = BTreeSet::from([(package.to_owned(), kind.to_owned())]);
            definitions
                .append(package, kind, &mut text, &mut seen)
                .unwrap();
            assert_eq!(text, lookup(name).unwrap().definition);
        }
    }

    #[test]
    fn what_is_missing_is_named() {
        let prefix = tempfile::tempdir().unwrap();
        install(
            prefix.path(),
            "my_msgs",
            "Outer.msg",
            "far_msgs/Away away\n",
        );
        let definitions = definitions(&[prefix.path()]);
        let refused = |name: &str| definitions.find(name).unwrap_err();
        assert!(refused("my_msgs/msg/Outer").contains("share/far_msgs/msg/Away.msg"));
        assert!(refused("my_msgs/msg/Other").contains("share/my_msgs/msg/Other.msg"));
        for name in [
            "../msg/Outer",
            "my_msgs/msg/..",
            "my_msgs/srv/Outer",
            "Outer",
            "",
        ] {
            assert!(refused(name).contains("package/msg/Type"), "{name}");
        }
    }
}
