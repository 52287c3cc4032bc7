//! A parameter on the command line: `[node:]name:=value`.

use crate::{ParameterValue, names, remap, yaml};

/// What `-p` sets, and for which node.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Assignment {
    node: Option<String>,
    pub(crate) name: String,
    pub(crate) value: ParameterValue,
}

impl Assignment {
    /// Reads an assignment by the grammar of `rcl`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(crate) fn parse(argument: &str) -> Result<Self, String> {
        let (left, text) = argument
            .split_once(":=")
            .ok_or("':=' is missing".to_owned())?;
        let (node, name) = remap::split_node(left)?;
        if !is_parameter_name(name) {
            return Err(format!(
                "{name:?} is not a name: parts of letters, digits and single underscores, separated by '.' or '/'"
            ));
        }
        let mut documents = yaml::documents(text)?;
        let value = match (documents.pop(), documents.is_empty()) {
            (Some(document), true) => yaml::parameter(document)?,
            (None, _) => return Err("the value is missing".into()),
            (Some(_), false) => return Err("the value is more than one document".into()),
        };
        Ok(Self {
            node: node.map(Into::into),
            name: name.into(),
            value,
        })
    }

    /// Whether it is meant for the node. A prefix is a name in the root namespace, as in `rcl`.
    pub(crate) fn is_for(&self, qualified: &str) -> bool {
        let meant = |node: &String| names::join("/", node) == qualified;
        self.node.as_ref().is_none_or(meant)
    }
}

/// `rate`, `gains.p`, `qos_overrides./tf.publisher.depth`.
fn is_parameter_name(name: &str) -> bool {
    name.strip_prefix('/')
        .unwrap_or(name)
        .split('.')
        .enumerate()
        .all(|(index, part)| {
            let part = match index {
                0 => part,
                _ => part.strip_prefix('/').unwrap_or(part),
            };
            part.split('/').all(names::is_rule_token)
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_parameters_have_the_form_that_rcl_asks_for() {
        for good in ["x", "x.y", "x/y", "/x", "qos_overrides./x.y", "_x", "x_1"] {
            assert!(is_parameter_name(good), "{good:?}");
        }
        for bad in [
            "", "1x", "a-b", "x y", "x.", ".x", "x..y", "~x", "x*", "*", "**", "__x", "x//y",
        ] {
            assert!(!is_parameter_name(bad), "{bad:?}");
        }
    }
}
