//! A client and a server of another make: `tests/cpp/fastdds_peer.cpp`, which speaks as `rmw_fastrtps_cpp` does.
//!
//! Needs the compiled peer, which `LGVI_FASTDDS_PEER` names; hence ignored by default.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::{
    env,
    process::{Command, Output, Stdio},
    thread,
    time::Duration,
};

use common::{isolated, node, own_name};
use lgvi_middleware::{Environment, ros::Request};
use lgvi_msgs::action_msgs::{
    GoalInfo,
    srv::{CancelGoal, CancelGoalRequest, CancelGoalResponse},
};

const PATIENCE: Duration = Duration::from_secs(20);
const CALLS: usize = 20;

fn peer(environment: &Environment, side: &str) -> Command {
    let mut command = Command::new(env::var_os("LGVI_FASTDDS_PEER").unwrap());
    command
        .arg(environment.domain_id.to_string())
        .args([side, &own_name("/node/cancel"), &CALLS.to_string()])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

fn succeeded(output: &Output) {
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{complaint}");
}

#[test]
#[ignore = "needs LGVI_FASTDDS_PEER"]
fn a_stranger_gets_the_replies_to_its_requests() {
    let environment = isolated();
    let server = node("node", &environment)
        .service_server::<CancelGoal>(&own_name("~/cancel"))
        .unwrap();
    let peer = peer(&environment, "client").spawn().unwrap();
    for call in 0..CALLS {
        let Request { id, message } = server.recv_timeout(PATIENCE).unwrap().expect("a request");
        assert_eq!(message, CancelGoalRequest::default());
        let response = CancelGoalResponse {
            return_code: i8::try_from(call).unwrap(),
            ..CancelGoalResponse::default()
        };
        server.reply(id, &response).unwrap();
    }
    let output = peer.wait_with_output().unwrap();
    succeeded(&output);
    let expected: String = (0..CALLS)
        .map(|call| format!("00010000{call:02x}00000000000000\n"))
        .collect();
    assert_eq!(String::from_utf8(output.stdout).unwrap(), expected);
}

#[test]
#[ignore = "needs LGVI_FASTDDS_PEER"]
fn a_stranger_s_replies_find_the_calls() {
    let environment = isolated();
    let client = node("node", &environment)
        .service_client::<CancelGoal>(&own_name("~/cancel"))
        .unwrap();
    let peer = peer(&environment, "server").spawn().unwrap();
    thread::scope(|scope| {
        let peer = scope.spawn(|| succeeded(&peer.wait_with_output().unwrap()));
        for call in 0..CALLS {
            let mut goal_info = GoalInfo::default();
            goal_info.stamp.nanosec = u32::try_from(call).unwrap();
            let request = CancelGoalRequest { goal_info };
            let response = client.call(&request, PATIENCE).unwrap();
            assert_eq!(response.goals_canceling, [request.goal_info]);
        }
        peer.join().unwrap();
    });
}
