//! How services and actions carry identities over DDS: beside the payload as with Fast DDS, or in it as with Cyclone DDS.

use std::{thread, time::Duration};

use crate::{
    actions::{self, a_plan_is_made, next, plan, send},
    common::{isolated, node},
    services::{PATIENCE, calls_are_answered, client, request, response, server},
};
use lgvi_middleware::{
    Environment, Rmw, ServiceMapping,
    parameters::{Given, ParameterSpec, Parameters},
    ros::{CallError, Decision, Executor, GoalState, PublishError, Request, TakeError},
};
use lgvi_msgs::{action::PlanManeuverResult, msg::ControlSequence};

fn environment(mapping: ServiceMapping) -> Environment {
    Environment {
        rmw: Rmw::Dds(mapping),
        ..isolated()
    }
}

#[test]
fn cyclone_s_mapping_answers_calls_and_plans() {
    let environment = environment(ServiceMapping::Cyclone);
    calls_are_answered(&environment);
    a_plan_is_made(&environment, 3000);
}

#[test]
fn replies_in_fragments_arrive_or_are_refused() {
    let call = |mapping, timeout| {
        let environment = environment(mapping);
        let server = server(&environment);
        let client = client("client", &environment);
        assert!(client.wait_for_server(PATIENCE));
        thread::scope(|scope| {
            let call = scope.spawn(|| client.call(&request(10_000), timeout));
            let Request { id, message } = server.recv_timeout(PATIENCE).unwrap().unwrap();
            let sent = server.reply(id, &response(&message));
            (sent, call.join().unwrap())
        })
    };
    let (sent, reply) = call(ServiceMapping::Cyclone, PATIENCE);
    sent.unwrap();
    assert_eq!(reply.unwrap(), response(&request(10_000)));
    let (sent, reply) = call(ServiceMapping::FastDds, Duration::from_secs(2));
    assert!(matches!(
        sent,
        Err(PublishError::TooLong {
            length: 120_012..,
            limit: 60_000,
            ..
        })
    ));
    assert!(matches!(reply, Err(CallError::NoReply { .. })));
}

/// Both are of the same make, which does not tell how they call services.
#[test]
fn who_calls_as_another_rmw_does_is_told_so() {
    for (ours, theirs, name) in [
        (
            ServiceMapping::FastDds,
            ServiceMapping::Cyclone,
            "rmw_fastrtps_cpp",
        ),
        (
            ServiceMapping::Cyclone,
            ServiceMapping::FastDds,
            "rmw_cyclonedds_cpp",
        ),
    ] {
        let environment = environment(ours);
        let server = server(&environment);
        let client = client(
            "client",
            &Environment {
                rmw: Rmw::Dds(theirs),
                ..environment
            },
        );
        let call = thread::spawn(move || client.call(&request(1), Duration::from_secs(3)));
        let error = server.recv_timeout(PATIENCE).unwrap_err();
        assert!(matches!(error, TakeError::Mapping { .. }), "{error}");
        let text = error.to_string();
        assert!(
            text.contains("RMW_IMPLEMENTATION") && text.contains(name),
            "{text}"
        );
        let error = call.join().unwrap().unwrap_err();
        assert!(matches!(error, CallError::NoReply { .. }), "{error}");
    }
}

/// Their descriptors take more than is sent in one piece, which a client would wait for in vain.
#[test]
fn parameters_that_are_too_many_to_be_described_have_no_description() {
    use lgvi_msgs::rcl_interfaces::srv::{DescribeParameters, DescribeParametersRequest};
    let environment = isolated();
    let server = node("server", &environment);
    let names: Vec<_> = (0..100).map(|index| format!("parameter_{index}")).collect();
    let long = "what it is for ".repeat(100);
    let specs = names
        .iter()
        .map(|name| ParameterSpec::new(name, true, &long));
    let parameters = Parameters::declare(Given::default(), specs.collect()).unwrap();
    let mut executor = Executor::new();
    parameters.serve(&server, &mut executor).unwrap();
    let _running = executor.start().unwrap();
    let client = node("client", &environment)
        .service_client::<DescribeParameters>("/server/describe_parameters")
        .unwrap();
    let described = |names: &[String]| {
        let names = names.to_vec();
        let reply = client.call(&DescribeParametersRequest { names }, PATIENCE);
        reply.unwrap().descriptors.len()
    };
    assert_eq!(described(&names[..10]), 10);
    assert_eq!(described(&names), 0);
}

#[test]
fn a_result_that_is_too_long_does_not_keep_its_client_waiting() {
    let environment = environment(ServiceMapping::FastDds);
    let server = actions::server(&environment, Decision::Accept);
    let client = actions::client(&environment);
    let id = send(&client, 0);
    next(&server).succeed(plan(3000));
    let outcome = client.result(id, PATIENCE).unwrap();
    assert_eq!(outcome.state, GoalState::Succeeded);
    assert_eq!(outcome.result, PlanManeuverResult::default());

    let _server = server.shortened_by(|result| PlanManeuverResult {
        controls: ControlSequence::default(),
        ..result
    });
    let outcome = client.result(id, PATIENCE).unwrap();
    assert_eq!(outcome.state, GoalState::Succeeded);
    assert_eq!(outcome.result, plan(0));
}
