//! A client and a server of another make: `cpp/fastdds_peer.cpp`, which speaks as `rmw_fastrtps_cpp` does.

use lgvi_middleware::ros::Request;
use lgvi_msgs::action_msgs::GoalInfo;
use lgvi_msgs::action_msgs::srv::{CancelGoal, CancelGoalRequest, CancelGoalResponse};
use lgvi_tests::{PATIENCE, Process, World, fast_dds};

const CALLS: usize = 20;

fn peer(world: &World, side: &str) -> Process {
    let mut command = world.command(&fast_dds("tests/cpp/fastdds_peer.cpp"));
    command
        .arg(world.environment().domain_id.to_string())
        .args([side, "/node/cancel", &CALLS.to_string()]);
    world.start("fastdds_peer", command)
}

#[test]
fn a_stranger_gets_the_replies_to_its_requests() {
    let world = World::new();
    let server = world
        .ros_node("node")
        .service_server::<CancelGoal>("~/cancel")
        .unwrap();
    let peer = peer(&world, "client");
    for call in 0..CALLS {
        let Request { id, message } = server.recv_timeout(PATIENCE).unwrap().expect("a request");
        assert_eq!(message, CancelGoalRequest::default());
        let response = CancelGoalResponse {
            return_code: i8::try_from(call).unwrap(),
            ..CancelGoalResponse::default()
        };
        server.reply(id, &response).unwrap();
    }
    let expected: String = (0..CALLS)
        .map(|call| format!("00010000{call:02x}00000000000000\n"))
        .collect();
    assert_eq!(peer.finish().expect(0).stdout, expected);
}

#[test]
fn a_stranger_s_replies_find_the_calls() {
    let world = World::new();
    let client = world
        .ros_node("node")
        .service_client::<CancelGoal>("~/cancel")
        .unwrap();
    let peer = peer(&world, "server");
    for call in 0..CALLS {
        let mut goal_info = GoalInfo::default();
        goal_info.stamp.nanosec = u32::try_from(call).unwrap();
        let request = CancelGoalRequest { goal_info };
        let response = client.call(&request, PATIENCE).unwrap();
        assert_eq!(response.goals_canceling, [request.goal_info]);
    }
    peer.finish().expect(0);
}
