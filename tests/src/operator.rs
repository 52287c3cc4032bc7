//! Who manages a node: a client of its services.

use std::time::Duration;

use lgvi_middleware::ros::{RosNode, ServiceClient};
use lgvi_msgs::Service;
use lgvi_msgs::lifecycle_msgs::Transition;
use lgvi_msgs::lifecycle_msgs::srv::{ChangeState, ChangeStateRequest, GetState, GetStateRequest};
use lgvi_msgs::rcl_interfaces::srv::{SetParameters, SetParametersRequest};
use lgvi_msgs::rcl_interfaces::{Parameter, ParameterValue};

use crate::{PATIENCE, World, eventually};

/// How long a node has to answer.
const ANSWER: Duration = PATIENCE;

/// The type of a parameter that is a text.
const STRING: u8 = 4;

/// A client of the services of one node.
pub struct Operator {
    ros: RosNode,
    node: String,
    change: ServiceClient<ChangeState>,
    state: ServiceClient<GetState>,
}

impl World {
    /// A client of the services of a node.
    pub fn operator(&self, node: &str) -> Operator {
        let ros = self.ros_node("operator");
        let client = |service| format!("/{node}/{service}");
        Operator {
            change: ros
                .service_client(&client("change_state"))
                .expect("a client"),
            state: ros.service_client(&client("get_state")).expect("a client"),
            node: node.into(),
            ros,
        }
    }
}

impl Operator {
    /// Asks for a transition; whether it has been made.
    #[track_caller]
    pub fn change(&self, label: &str) -> bool {
        let transition = Transition {
            id: 0,
            label: label.into(),
        };
        let request = ChangeStateRequest { transition };
        let reply = self.change.call(&request, ANSWER);
        reply.unwrap_or_else(|error| panic!("{error}")).success
    }

    /// Asks for transitions, all of which must be made.
    #[track_caller]
    pub fn lead(&self, labels: &[&str]) {
        for label in labels {
            assert!(self.change(label), "{label} of {} is refused", self.node);
        }
    }

    /// The label of its state.
    #[track_caller]
    pub fn state(&self) -> String {
        let reply = self.state.call(&GetStateRequest::default(), ANSWER);
        let reply = reply.unwrap_or_else(|error| panic!("{error}"));
        reply.current_state.label
    }

    /// Waits until it is in a state.
    #[track_caller]
    pub fn await_state(&self, label: &str) {
        let awaited = format!("{} to be {label}", self.node);
        eventually(&awaited, || (self.state() == label).then_some(()));
    }

    /// A client of another of its services.
    pub fn client<S: Service>(&self, service: &str) -> ServiceClient<S> {
        let name = format!("/{}/{service}", self.node);
        self.ros.service_client(&name).expect("a client")
    }

    /// Calls another of its services.
    #[track_caller]
    pub fn call<S: Service>(&self, service: &str, request: &S::Request) -> S::Response {
        let reply = self.client::<S>(service).call(request, ANSWER);
        reply.unwrap_or_else(|error| panic!("{error}"))
    }

    /// Sets a parameter that is a text; why not, where it is refused.
    #[track_caller]
    pub fn set_text(&self, name: &str, value: &str) -> Result<(), String> {
        let value = ParameterValue {
            r#type: STRING,
            string_value: value.into(),
            ..ParameterValue::default()
        };
        let name = name.into();
        let parameters = vec![Parameter { name, value }];
        let request = SetParametersRequest { parameters };
        let reply = self.call::<SetParameters>("set_parameters", &request);
        let result = reply.results.first().expect("a result for the parameter");
        if result.successful {
            Ok(())
        } else {
            Err(result.reason.clone())
        }
    }

    /// The node that it is.
    pub fn ros(&self) -> &RosNode {
        &self.ros
    }
}
