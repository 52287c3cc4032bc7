use std::path::PathBuf;

use lgvi_middleware::{ParameterSpec, Parameters};
use lgvi_msgs::{MessageType, lookup};
use lgvi_node::NodeError;

/// The node's parameters.
pub(crate) struct Config {
    /// `output`: the bag's directory, which must not exist; by default named after the time.
    pub(crate) output: PathBuf,
    /// `states`: topics of full-rate states to take from shared memory.
    pub(crate) states: Vec<String>,
    /// `topics`: topics to take from DDS, each as `name=package/msg/Type`; by default all topics of known types.
    pub(crate) topics: Option<Vec<Chosen>>,
    /// `frame`: the inertial frame of states from shared memory, which do not carry it.
    pub(crate) frame: String,
    /// `use_sim_time`: whether messages are logged at their stamps, or at the time of their reception.
    pub(crate) use_sim_time: bool,
}

/// A topic to be recorded.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Chosen {
    pub(crate) name: String,
    pub(crate) message_type: MessageType,
}

pub(crate) fn specifications() -> Vec<ParameterSpec> {
    vec![
        ParameterSpec::new(
            "output",
            String::new(),
            "directory of the bag, which must not exist; empty: named after the time",
        ),
        ParameterSpec::new(
            "states",
            vec!["/lgvi_propagator/state".to_owned()],
            "topics of full-rate states to take from shared memory",
        ),
        ParameterSpec::optional::<Vec<String>>(
            "topics",
            "topics to take from DDS, each as name=package/msg/Type; not set: all topics of known types",
        ),
        ParameterSpec::new(
            "frame",
            "inertial".to_owned(),
            "inertial frame of states from shared memory",
        ),
    ]
}

impl Config {
    pub(crate) fn read(parameters: &Parameters) -> Result<Self, NodeError> {
        let output: String = parameters.get("output").map_err(NodeError::input)?;
        let topics: Option<Vec<String>> = parameters
            .get_optional("topics")
            .map_err(NodeError::input)?;
        let topics = topics.map(|topics| topics.iter().map(|topic| choose(topic)).collect());
        Ok(Self {
            output: if output.is_empty() {
                chrono::Local::now()
                    .format("rosbag2_%Y_%m_%d-%H_%M_%S")
                    .to_string()
                    .into()
            } else {
                output.into()
            },
            states: parameters.get("states").map_err(NodeError::input)?,
            topics: topics.transpose()?,
            frame: parameters.get("frame").map_err(NodeError::input)?,
            use_sim_time: parameters.get("use_sim_time").map_err(NodeError::input)?,
        })
    }
}

fn choose(topic: &str) -> Result<Chosen, NodeError> {
    let refuse = |expected: &str| {
        NodeError::Input(format!(
            "parameter \"topics\" has {topic:?}, expected {expected}"
        ))
    };
    let (name, type_name) = topic
        .split_once('=')
        .ok_or_else(|| refuse("name=package/msg/Type"))?;
    let message_type = lookup(type_name).ok_or_else(|| refuse("a message type that lgvi knows"))?;
    Ok(Chosen {
        name: name.into(),
        message_type,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_are_names_with_known_types() {
        let chosen = choose("/tf=tf2_msgs/msg/TFMessage").unwrap();
        assert_eq!(
            (chosen.name.as_str(), chosen.message_type.name),
            ("/tf", "tf2_msgs/msg/TFMessage")
        );
        assert!(
            choose("/tf")
                .unwrap_err()
                .to_string()
                .contains("name=package/msg/Type")
        );
        assert!(
            choose("/tf=tf2_msgs/msg/Nothing")
                .unwrap_err()
                .to_string()
                .contains("knows")
        );
    }
}
