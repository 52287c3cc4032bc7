//! The services through which a node's parameters are seen and set, and the topic that tells of their changes.

use std::{sync::Arc, time::Duration};

use lgvi_msgs::{
    rcl_interfaces::{
        ListParametersResult, Parameter, ParameterEvent, SetParametersResult,
        srv::{
            DescribeParameters, DescribeParametersResponse, GetParameterTypes,
            GetParameterTypesResponse, GetParameters, GetParametersResponse, ListParameters,
            ListParametersResponse, SetParameters, SetParametersAtomically,
            SetParametersAtomicallyResponse, SetParametersResponse,
        },
    },
    stamp,
};
use tracing::warn;

use super::{ParameterError, ParameterValue, Parameters};
use crate::{
    ros::{Executor, Publisher, Qos, RosError, RosNode},
    wall,
};

/// Between the parts of a parameter's name.
const SEPARATOR: char = '.';

/// As `rmw_qos_profile_parameter_events`. One who takes no events costs one wait.
const EVENTS: Qos = Qos::reliable(1000).max_wait(Duration::from_millis(20));

impl Parameters {
    /// Offers the six services of parameters, and tells of changes on `/parameter_events`, as long as the executor lives.
    ///
    /// A name that is not declared leaves the answers of `get_parameters`, `get_parameter_types` and
    /// `describe_parameters` empty, as in `rclcpp`; so does an answer that is too long to be sent. A parameter that is not set has a value of type 0; giving it such a
    /// value unsets it.
    ///
    /// # Errors
    /// An endpoint cannot be created.
    pub fn serve(&self, node: &RosNode, executor: &mut Executor) -> Result<(), RosError> {
        let own = self.clone();
        executor.answer::<ListParameters>(node, "~/list_parameters", move |request| {
            let result = own.list(&request.prefixes, request.depth);
            ListParametersResponse { result }
        })?;
        let own = self.clone();
        executor.answer::<GetParameters>(node, "~/get_parameters", move |request| {
            let values = of_each(&request.names, |name| Ok(own.value(name)?.to_message()));
            GetParametersResponse { values }
        })?;
        let own = self.clone();
        executor.answer::<GetParameterTypes>(node, "~/get_parameter_types", move |request| {
            let types = of_each(&request.names, |name| Ok(own.value(name)?.number()));
            GetParameterTypesResponse { types }
        })?;
        let own = self.clone();
        executor.answer::<DescribeParameters>(node, "~/describe_parameters", move |request| {
            let descriptors = of_each(&request.names, |name| Ok(own.spec(name)?.descriptor()));
            DescribeParametersResponse { descriptors }
        })?;
        let (own, events) = (self.clone(), self.tell(node)?);
        executor.answer::<SetParameters>(node, "~/set_parameters", move |request| {
            // Whose end is the executor's, so that a set of parameters keeps no node in the graph.
            let _ = &events;
            let set = |parameter| result(own.set_from(vec![parameter]));
            let results = request.parameters.into_iter().map(set).collect();
            SetParametersResponse { results }
        })?;
        let own = self.clone();
        executor.answer::<SetParametersAtomically>(
            node,
            "~/set_parameters_atomically",
            move |request| {
                let result = result(own.set_from(request.parameters));
                SetParametersAtomicallyResponse { result }
            },
        )
    }

    /// Tells of the parameters, and of what is set until the publisher that is returned is dropped.
    fn tell(&self, node: &RosNode) -> Result<Arc<Publisher<ParameterEvent>>, RosError> {
        let publisher = Arc::new(node.publisher::<ParameterEvent>("/parameter_events", &EVENTS)?);
        let name = node.fully_qualified_name();
        let event = move || ParameterEvent {
            stamp: stamp::to_message(wall::now()).unwrap_or_default(),
            node: name.clone(),
            ..ParameterEvent::default()
        };
        let publish = |publisher: &Publisher<ParameterEvent>, event| {
            if let Err(error) = publisher.publish(&event) {
                warn!("a parameter event was lost: {error}");
            }
        };
        let weak = Arc::downgrade(&publisher);
        let first = ParameterEvent {
            new_parameters: Vec::new(),
            ..event()
        };
        self.on_any_change(
            |values| {
                let new_parameters = values.iter().map(to_message).collect();
                let event = ParameterEvent {
                    new_parameters,
                    ..first
                };
                publish(&publisher, event);
            },
            move |set| {
                let Some(publisher) = weak.upgrade() else {
                    return false;
                };
                let event = ParameterEvent {
                    changed_parameters: set.iter().map(to_message).collect(),
                    ..event()
                };
                publish(&publisher, event);
                true
            },
        );
        Ok(publisher)
    }

    /// The names under these prefixes, or all of them, with fewer than `depth` separators after the prefix (0: any
    /// number), and what stands before their last separator; as `rclcpp` does it.
    fn list(&self, prefixes: &[String], depth: u64) -> ListParametersResult {
        let is_shallow =
            |rest: &str| depth == 0 || (rest.matches(SEPARATOR).count() as u64) < depth;
        let is_under = |name: &str, prefix: &String| {
            name.strip_prefix(prefix.as_str()).is_some_and(|rest| {
                rest.is_empty() || rest.strip_prefix(SEPARATOR).is_some_and(is_shallow)
            })
        };
        let mut result = ListParametersResult::default();
        for name in self.names() {
            let listed = if prefixes.is_empty() {
                is_shallow(name)
            } else {
                prefixes.iter().any(|prefix| is_under(name, prefix))
            };
            if !listed {
                continue;
            }
            result.names.push(name.into());
            if let Some((prefix, _)) = name.rsplit_once(SEPARATOR)
                && !result.prefixes.iter().any(|other| other == prefix)
            {
                result.prefixes.push(prefix.into());
            }
        }
        result
    }

    fn set_from(&self, parameters: Vec<Parameter>) -> Result<(), ParameterError> {
        let values = parameters.into_iter().map(|parameter| {
            let name = parameter.name;
            match ParameterValue::from_message(parameter.value) {
                Ok(value) => Ok((name, value)),
                Err(number) => {
                    let (kind, value) = (
                        self.spec(&name)?.kind,
                        format!("of the unknown type {number}"),
                    );
                    Err(ParameterError::not_of(kind, &name, value))
                }
            }
        });
        self.set_all(values.collect::<Result<_, _>>()?)
    }
}

/// What there is for each name, or nothing if there is not for one of them.
fn of_each<T>(names: &[String], of: impl Fn(&str) -> Result<T, ParameterError>) -> Vec<T> {
    let all: Result<_, _> = names.iter().map(|name| of(name)).collect();
    all.unwrap_or_default()
}

fn result(set: Result<(), ParameterError>) -> SetParametersResult {
    SetParametersResult {
        successful: set.is_ok(),
        reason: set.err().map(|error| error.to_string()).unwrap_or_default(),
    }
}

fn to_message((name, value): &(String, ParameterValue)) -> Parameter {
    Parameter {
        name: name.clone(),
        value: value.to_message(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Given, ParameterSpec};

    fn listed(prefixes: &[&str], depth: u64) -> (Vec<String>, Vec<String>) {
        let names = ["a", "b.c", "b.d.e", "b.d.f", "bc.g", "h.i.j.k"];
        let specs = names.map(|name| ParameterSpec::new(name, true, "")).into();
        let parameters = Parameters::declare(Given::default(), specs).unwrap();
        let prefixes: Vec<_> = prefixes.iter().map(|prefix| (*prefix).into()).collect();
        let result = parameters.list(&prefixes, depth);
        (result.names, result.prefixes)
    }

    #[test]
    fn names_are_listed_by_prefix_and_depth() {
        let (names, prefixes) = listed(&[], 0);
        assert_eq!(names, ["a", "b.c", "b.d.e", "b.d.f", "bc.g", "h.i.j.k"]);
        assert_eq!(prefixes, ["b", "b.d", "bc", "h.i.j"]);
        assert_eq!(listed(&[], 1).0, ["a"]);
        assert_eq!(listed(&[], 2).0, ["a", "b.c", "bc.g"]);
        assert_eq!(listed(&["b"], 0).0, ["b.c", "b.d.e", "b.d.f"]);
        assert_eq!(listed(&["b"], 1).0, ["b.c"]);
        assert_eq!(listed(&["b.d", "a"], 1).0, ["a", "b.d.e", "b.d.f"]);
        assert_eq!(
            listed(&["b.d.e"], 1).0,
            ["b.d.e"],
            "a name is its own prefix"
        );
        assert_eq!(listed(&["nothing"], 0), (vec![], vec![]));
    }
}
