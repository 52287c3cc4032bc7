//! What nobody has subscribed to is neither converted nor sent.

use lgvi_middleware::ros::Qos;
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_tests::{PATIENCE, World, edited, eventually};

use crate::diagnostics::{Listener, Part};

const TOPICS: &str = "lgvi_propagator: topics";
const FLIGHT: &str = "lgvi_propagator: flight";
const ODOMETRY: &str = "/lgvi_propagator/odometry/body";

/// The topics made of states.
const STREAMS: [&str; 4] = [
    ODOMETRY,
    "/lgvi_propagator/state",
    "/lgvi_propagator/invariants",
    "/tf",
];

/// Converted and sent messages of the topics that stream.
fn counts(part: &Part) -> [(f64, f64); 4] {
    STREAMS.map(|topic| {
        let count = |what| part.number(&format!("{topic} {what}"));
        (count("converted"), count("sent"))
    })
}

/// Steps made and counts, of each message so far.
fn history(listener: &Listener) -> Vec<(f64, [(f64, f64); 4])> {
    let parts = listener.heard().into_iter().map(|heard| {
        let [flight, topics] = [FLIGHT, TOPICS].map(|part| heard.part(part).unwrap());
        (flight.number("step"), counts(&topics))
    });
    parts.collect()
}

#[test]
fn a_topic_costs_something_only_while_it_is_subscribed_to() {
    let world = World::new();
    let scene = edited(&world, "free_body", &[("ros_every = 100", "ros_every = 1")]);
    let scene = format!("scene:={}", scene.display());
    let propagator = world.node("propagator", &[&scene]);
    propagator.await_ready();
    let listener = Listener::new(&world);
    let alone = eventually("three messages", || {
        Some(history(&listener)).filter(|history| history.len() >= 3)
    });
    assert!(alone[2].0 > alone[0].0 + 100.0, "the flight goes on");
    assert!(
        alone.iter().all(|(_, counts)| *counts == [(0.0, 0.0); 4]),
        "{alone:?}"
    );

    let observer = world.ros_node("observer");
    let odometry = observer
        .subscription::<Odometry>(ODOMETRY, &Qos::reliable(10_000))
        .unwrap();
    assert!(odometry.wait_for_publishers(1, PATIENCE));
    let watched = eventually("odometry", || {
        history(&listener)
            .pop()
            .filter(|(_, counts)| counts[0].0 > 100.0)
    });
    let (converted, sent) = watched.1[0];
    assert_eq!(converted, sent);
    assert_eq!(watched.1[1..], [(0.0, 0.0); 3]);
    drop((odometry, observer));

    let gone = format!("{ODOMETRY} subscribers");
    listener.await_part(TOPICS, |part| {
        part.number(&gone) == 0.0 && counts(part)[0].0 > 0.0
    });
    let until = history(&listener).len();
    let after = eventually("three messages more", || {
        Some(history(&listener)).filter(|history| history.len() >= until + 3)
    });
    let [before, now] = [after[until], after[until + 2]];
    assert!(now.0 > before.0 + 100.0, "the flight goes on");
    assert_eq!(now.1, before.1, "nothing is converted any more");
    propagator.stop().expect(0);
}
