//! The services through which a node's parameters are seen and set, and the topic that tells of their changes.

use super::Parameters;
use crate::ros::{Executor, RosError, RosNode};

impl Parameters {
    /// Offers the parameters to the ROS graph.
    pub fn serve(&self, _node: &RosNode, _executor: &mut Executor) -> Result<(), RosError> {
        Ok(())
    }
}
