//! Services between nodes of this crate, over the loopback interface, by any wire.

use std::{
    thread,
    time::{Duration, Instant},
};

use crate::common::{isolated, node, own_name};
use lgvi_middleware::{
    Environment,
    ros::{CallError, Request, ServiceClient, ServiceServer},
};
use lgvi_msgs::{
    RosMessage, Service,
    action_msgs::{
        GoalInfo,
        srv::{CancelGoal, CancelGoalRequest, CancelGoalResponse},
    },
    builtin_interfaces::Time,
};

pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

pub(crate) fn server(environment: &Environment) -> ServiceServer<CancelGoal> {
    node("server", environment)
        .service_server(&own_name("~/double"))
        .unwrap()
}

pub(crate) fn client(name: &str, environment: &Environment) -> ServiceClient<CancelGoal> {
    node(name, environment)
        .service_client(&own_name("/server/double"))
        .unwrap()
}

pub(crate) fn request(sec: i32) -> CancelGoalRequest {
    let mut goal_info = GoalInfo::default();
    goal_info.stamp.sec = sec;
    CancelGoalRequest { goal_info }
}

/// Twice what is asked for, in every tenth reply as often as fills a datagram, from 10 000 on several ones.
pub(crate) fn response(request: &CancelGoalRequest) -> CancelGoalResponse {
    let sec = request.goal_info.stamp.sec;
    let entries = match sec {
        10_000.. => 5000,
        _ if sec % 10 == 0 => 2000,
        _ => 1,
    };
    let double = GoalInfo {
        stamp: Time {
            sec: 2 * sec,
            nanosec: 0,
        },
        ..GoalInfo::default()
    };
    CancelGoalResponse {
        return_code: 0,
        goals_canceling: vec![double; entries],
    }
}

fn serve(server: &ServiceServer<CancelGoal>, count: usize) {
    for _ in 0..count {
        let Request { id, message } = server.recv_timeout(PATIENCE).unwrap().unwrap();
        server.reply(id, &response(&message)).unwrap();
    }
}

#[test]
fn each_of_two_clients_gets_its_own_replies() {
    calls_are_answered(&isolated());
}

pub(crate) fn calls_are_answered(environment: &Environment) {
    const CALLS: usize = 50;
    let server = server(environment);
    let clients = [client("one", environment), client("other", environment)];
    thread::scope(|scope| {
        for (client, first) in clients.iter().zip([1, 1001]) {
            scope.spawn(move || {
                for sec in (first..).take(CALLS) {
                    let reply = client.call(&request(sec), PATIENCE).unwrap();
                    assert_eq!(reply, response(&request(sec)));
                }
            });
        }
        serve(&server, 2 * CALLS);
    });
    assert_eq!(server.recv_timeout(Duration::ZERO).unwrap(), None);
}

#[test]
fn replies_may_come_in_any_order_and_not_at_all() {
    let environment = isolated();
    let server = server(&environment);
    let clients = [
        client("first", &environment),
        client("ignored", &environment),
        client("last", &environment),
    ];
    for client in &clients {
        assert!(client.wait_for_server(PATIENCE));
    }
    thread::scope(|scope| {
        let calls = [
            (1, PATIENCE),
            (2, Duration::from_millis(500)),
            (3, PATIENCE),
        ];
        let calls: Vec<_> = clients
            .iter()
            .zip(calls)
            .map(|(client, (sec, timeout))| {
                scope.spawn(move || client.call(&request(sec), timeout))
            })
            .collect();
        let mut requests: Vec<_> = (0..3)
            .map(|_| server.recv_timeout(PATIENCE).unwrap().unwrap())
            .collect();
        requests.sort_by_key(|request| std::cmp::Reverse(request.message.goal_info.stamp.sec));
        for Request { id, message } in requests {
            if message.goal_info.stamp.sec != 2 {
                server.reply(id, &response(&message)).unwrap();
            }
        }
        let replies: Vec<_> = calls.into_iter().map(|call| call.join().unwrap()).collect();
        assert_eq!(*replies[0].as_ref().unwrap(), response(&request(1)));
        assert!(matches!(replies[1], Err(CallError::NoReply { .. })));
        assert_eq!(*replies[2].as_ref().unwrap(), response(&request(3)));
    });
}

/// Requests of a client that never takes a reply, more than anybody has room for.
#[test]
fn a_client_that_never_reads_does_not_stall_the_server() {
    const REQUESTS: i32 = 600;
    let environment = isolated();
    let server = server(&environment);
    let deaf = client("deaf", &environment);
    let other = client("other", &environment);
    assert!(deaf.wait_for_server(PATIENCE) && other.wait_for_server(PATIENCE));
    thread::scope(|scope| {
        let calls = scope.spawn(|| {
            for sec in 1..=REQUESTS {
                // Whether there is room for it: it is not waited for.
                let _ = deaf.call(&request(sec), Duration::ZERO);
            }
        });
        let mut longest = Duration::ZERO;
        while !calls.is_finished() {
            if let Some(Request { id, message }) = server.recv_timeout(Duration::ZERO).unwrap() {
                let start = Instant::now();
                server.reply(id, &response(&message)).unwrap();
                longest = longest.max(start.elapsed());
            }
        }
        // Far above what a loaded machine takes for 20 ms, and below the lease of 10 s.
        assert!(longest < Duration::from_secs(5), "{longest:?}");
        scope.spawn(|| {
            while let Some(Request { id, message }) =
                server.recv_timeout(Duration::from_secs(1)).unwrap()
            {
                server.reply(id, &response(&message)).unwrap();
            }
        });
        let reply = other.call(&request(7), PATIENCE).unwrap();
        assert_eq!(reply, response(&request(7)));
    });
}

#[test]
fn calls_end_in_time_without_a_server_and_with_one_that_leaves() {
    let environment = isolated();
    let client = client("client", &environment);
    let limit = Duration::from_millis(300);
    let start = Instant::now();
    let error = client.call(&request(1), limit).unwrap_err();
    assert!(matches!(error, CallError::NoServer { .. }), "{error}");
    assert!(start.elapsed() >= limit && start.elapsed() < limit + PATIENCE);

    let leaving = server(&environment);
    thread::scope(|scope| {
        let call = scope.spawn(|| client.call(&request(4), PATIENCE));
        assert!(leaving.recv_timeout(PATIENCE).unwrap().is_some());
        drop(leaving);
        serve(&server(&environment), 1);
        assert_eq!(call.join().unwrap().unwrap(), response(&request(4)));
    });
}

/// So old is a request that no server takes which comes only now.
const TOO_OLD: Duration = Duration::from_millis(1500);

/// The next server is there before the one that was asked leaves, but too late to have got the request.
#[test]
fn a_call_outlives_its_server_where_another_is_there_already() {
    let environment = isolated();
    let client = client("client", &environment);
    let leaving = server(&environment);
    assert!(client.wait_for_server(Duration::MAX));
    thread::scope(|scope| {
        let call = scope.spawn(|| client.call(&request(4), 2 * PATIENCE));
        assert!(leaving.recv_timeout(PATIENCE).unwrap().is_some());
        thread::sleep(TOO_OLD);
        let next = server(&environment);
        assert_eq!(next.recv_timeout(Duration::from_secs(2)).unwrap(), None);
        drop(leaving);
        serve(&next, 1);
        assert_eq!(call.join().unwrap().unwrap(), response(&request(4)));
    });
}

/// RustDDS gives to every server that comes what a client has sent last.
#[test]
fn a_server_does_not_answer_what_an_earlier_one_was_asked() {
    let environment = isolated();
    let client = client("client", &environment);
    let earlier = server(&environment);
    thread::scope(|scope| {
        let call = scope.spawn(|| client.call(&request(1), PATIENCE));
        serve(&earlier, 1);
        call.join().unwrap().unwrap();
    });
    drop(earlier);
    thread::sleep(TOO_OLD);
    let later = server(&environment);
    assert!(client.wait_for_server(PATIENCE));
    thread::scope(|scope| {
        let call = scope.spawn(|| client.call(&request(2), PATIENCE));
        // The first that it gets is this one.
        serve(&later, 1);
        assert_eq!(call.join().unwrap().unwrap(), response(&request(2)));
    });
}

#[test]
fn what_is_no_request_is_reported_and_passed_over() {
    let environment = isolated();
    let node = node("server", &environment);
    let server = node.service_server::<CancelGoal>(&own_name("/x")).unwrap();
    let other = crate::common::node("client", &environment);
    let client = other.service_client::<ShortCall>(&own_name("/x")).unwrap();
    let good = other.service_client::<CancelGoal>(&own_name("/x")).unwrap();
    assert!(client.wait_for_server(PATIENCE) && good.wait_for_server(PATIENCE));
    thread::scope(|scope| {
        let call = scope.spawn(|| client.call(&Short(3), Duration::from_secs(2)));
        let error = server.recv_timeout(PATIENCE).unwrap_err();
        assert!(error.to_string().contains(": sample 1 of"), "{error}");
        let call_after = scope.spawn(|| good.call(&request(1), PATIENCE));
        serve(&server, 1);
        assert!(call.join().unwrap().is_err());
        assert_eq!(call_after.join().unwrap().unwrap(), response(&request(1)));
    });
}

/// A client that floods a server which takes nothing pushes out its own requests, not those of others.
#[test]
fn a_flood_of_one_client_leaves_the_requests_of_others() {
    let environment = isolated();
    let server = server(&environment);
    let (quiet, loud) = (client("quiet", &environment), client("loud", &environment));
    assert!(quiet.wait_for_server(PATIENCE) && loud.wait_for_server(PATIENCE));
    thread::scope(|scope| {
        let call = scope.spawn(|| quiet.call(&request(1), PATIENCE));
        thread::sleep(Duration::from_millis(500));
        for sec in 2..302 {
            let error = loud.call(&request(sec), Duration::from_millis(1));
            assert!(error.is_err());
        }
        thread::sleep(Duration::from_millis(500));
        let mut taken = Vec::new();
        while let Some(Request { id, message }) =
            server.recv_timeout(Duration::from_secs(2)).unwrap()
        {
            taken.push(message.goal_info.stamp.sec);
            server.reply(id, &response(&message)).unwrap();
        }
        assert_eq!(taken.len(), 17, "{taken:?}");
        assert_eq!((taken[0], taken[16]), (1, 301));
        assert_eq!(call.join().unwrap().unwrap(), response(&request(1)));
    });
}

/// A request that is too short for its type.
#[derive(serde::Serialize, serde::Deserialize)]
struct Short(u8);

impl RosMessage for Short {
    const TYPE_NAME: &'static str = CancelGoalRequest::TYPE_NAME;
    const TYPE_HASH: &'static str = CancelGoalRequest::TYPE_HASH;
    const DEFINITION: &'static str = "";
}

struct ShortCall;

impl Service for ShortCall {
    const TYPE_NAME: &'static str = "action_msgs/srv/CancelGoal";
    const TYPE_HASH: &'static str = CancelGoal::TYPE_HASH;
    type Request = Short;
    type Response = CancelGoalResponse;
}
