//! The prefix of a flight's frames: all flights of a graph share `/tf`.

use lgvi_middleware::{ParameterSpec, ParameterValue, Parameters};

use lgvi_middleware::node::NodeError;

const NAME: &str = "frame_prefix";

/// The parameter `frame_prefix`, where it is set.
pub struct FramePrefix(Option<String>);

impl FramePrefix {
    /// The parameter's declaration.
    pub fn specification() -> ParameterSpec {
        ParameterSpec::optional::<String>(
            NAME,
            "prefix of the flight's frames; not set: the namespace and a slash, or nothing in the root namespace",
        )
        .constraints("letters, digits and any of _-./, without a slash at the start")
        .check(|value| match value {
            ParameterValue::String(prefix) if !is_prefix(prefix) => Err(
                "expected letters, digits and any of _-./, at most 255, without a slash at the start".into(),
            ),
            _ => Ok(()),
        })
    }

    /// Reads the parameter.
    ///
    /// # Errors
    /// It is not declared.
    pub fn read(parameters: &Parameters) -> Result<Self, NodeError> {
        Ok(Self(parameters.get_optional(NAME)?))
    }

    /// The prefix of the frames of a flight in `namespace`: unless it is set, the namespace and a slash. tf2 allows no slash
    /// at the start.
    pub fn of(&self, namespace: &str) -> String {
        match (&self.0, namespace.trim_matches('/')) {
            (Some(prefix), _) => prefix.clone(),
            (None, "") => String::new(),
            (None, name) => format!("{name}/"),
        }
    }
}

fn is_prefix(text: &str) -> bool {
    let known = |byte: u8| byte.is_ascii_alphanumeric() || b"_-./".contains(&byte);
    text.len() <= 255 && !text.starts_with('/') && text.bytes().all(known)
}

#[cfg(test)]
mod tests {
    use lgvi_middleware::NodeArgs;

    use super::*;

    fn prefix(arguments: &[&str], namespace: &str) -> Result<String, String> {
        let line = ["--ros-args"].iter().chain(arguments);
        let (args, _) = NodeArgs::parse("node", line.map(ToString::to_string)).unwrap();
        let specs = vec![FramePrefix::specification()];
        let parameters = Parameters::declare(args.parameters(), specs);
        let parameters = parameters.map_err(|error| error.to_string())?;
        Ok(FramePrefix::read(&parameters).unwrap().of(namespace))
    }

    #[test]
    fn it_is_the_namespace_unless_it_is_given() {
        for (namespace, expected) in [("/", ""), ("/chaser", "chaser/"), ("/a/b", "a/b/")] {
            assert_eq!(prefix(&[], namespace).unwrap(), expected);
            assert_eq!(
                prefix(&["-p", "frame_prefix:=null"], namespace).unwrap(),
                expected
            );
            assert_eq!(prefix(&["-p", "frame_prefix:=''"], namespace).unwrap(), "");
            assert_eq!(
                prefix(&["-p", "frame_prefix:=x_"], namespace).unwrap(),
                "x_"
            );
        }
    }

    #[test]
    fn what_is_no_part_of_a_frames_name_is_refused() {
        for bad in ["/chaser", "a b", "a\u{e9}"] {
            let error = prefix(&["-p", &format!("frame_prefix:='{bad}'")], "/").unwrap_err();
            assert!(error.contains("frame_prefix"), "{bad}: {error}");
        }
    }
}
