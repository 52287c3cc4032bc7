//! Many nodes that start at once.

use std::{
    sync::{Arc, Barrier, mpsc},
    thread,
    time::Duration,
};

use crate::common::{isolated, node};
use lgvi_middleware::ros::Qos;
use lgvi_msgs::nav_msgs::Odometry;

const NODES: usize = 20;

/// Each node has a publisher and a subscription of each.
const TOPICS: usize = 12;

/// For all of them together, on a machine that has other things to do.
const PATIENCE: Duration = Duration::from_secs(120);

/// RustDDS comes to a standstill when an endpoint is made while it works on another one and hears of new participants.
#[test]
fn twenty_nodes_that_start_at_once_all_make_their_endpoints() {
    let environment = isolated();
    let (start, end) = (Barrier::new(NODES), Barrier::new(NODES));
    let barriers = Arc::new((start, end));
    let (made, all_made) = mpsc::channel();
    // Not in a scope, which would wait for a thread that hangs.
    for index in 0..NODES {
        let (environment, barriers) = (environment.clone(), Arc::clone(&barriers));
        let made = made.clone();
        thread::spawn(move || {
            let (start, end) = &*barriers;
            start.wait();
            let node = node(&format!("node_{index}"), &environment);
            let endpoints: Vec<_> = (0..TOPICS)
                .map(|topic| {
                    let topic = format!("/storm/topic_{topic}");
                    let publisher = node.publisher::<Odometry>(&topic, &Qos::reliable(1));
                    let subscription = node.subscription::<Odometry>(&topic, &Qos::reliable(1));
                    (publisher.unwrap(), subscription.unwrap())
                })
                .collect();
            made.send(endpoints.len()).unwrap();
            end.wait();
        });
    }
    for _ in 0..NODES {
        assert_eq!(all_made.recv_timeout(PATIENCE), Ok(TOPICS));
    }
}
