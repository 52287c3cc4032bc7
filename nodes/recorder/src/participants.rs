//! The nodes that subscribe.

use lgvi_middleware::node::NodeError;
use lgvi_middleware::ros::{RosNode, TopicInfo};
use lgvi_middleware::{Environment, NodeArgs};

/// RustDDS 0.15 keeps one cache for each topic of a participant: what one reader of it is told that it will not get,
/// such as history from before a volatile match, another one is not given any more when it arrives. Hence no two
/// subscriptions to a topic share a participant: each topic's first is the node's, its second the next one's.
pub(crate) struct Participants(Vec<RosNode>);

impl Participants {
    pub(crate) fn new(node: RosNode) -> Self {
        Self(vec![node])
    }

    /// The topics of others, as the node itself sees them.
    pub(crate) fn topics(&self) -> Vec<TopicInfo> {
        self.0.first().map(RosNode::topics).unwrap_or_default()
    }

    /// The participant of a topic's subscription with this index.
    pub(crate) fn get(&mut self, index: usize) -> Result<&RosNode, NodeError> {
        while self.0.len() <= index {
            let next = self.another()?;
            self.0.push(next);
        }
        Ok(&self.0[index])
    }

    /// Named after the node, without its remappings: the topics that are subscribed to here are resolved already.
    fn another(&self) -> Result<RosNode, NodeError> {
        let node = self.0[0].fully_qualified_name();
        let (namespace, name) = node.rsplit_once('/').unwrap_or_default();
        let name = format!("{name}_{}", self.0.len() + 1);
        let mut line = Vec::new();
        if !namespace.is_empty() {
            line = vec![
                "--ros-args".to_owned(),
                "-r".into(),
                format!("__ns:={namespace}"),
            ];
        }
        let (args, _) = NodeArgs::parse(&name, line).map_err(NodeError::runtime)?;
        let environment = Environment::from_env().map_err(NodeError::runtime)?;
        Ok(RosNode::new(&args, &environment)?)
    }
}
