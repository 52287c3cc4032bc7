//! Whatever a propagator waits for, it hears signals and controls meanwhile.

use std::time::{Duration, Instant};

use lgvi_middleware::ros::Qos;
use lgvi_tests::{World, coast, eventually, publish, scene};

#[test]
fn a_signal_ends_it_between_two_steps_however_far_apart() {
    let world = World::new();
    let scene = format!("scene:={}", scene("free_body").display());
    let observer = world.shm_node("observer");
    let mut states = observer
        .state_subscriber("/lgvi_propagator/state", 16)
        .unwrap();
    // A step takes a hundred seconds.
    let propagator = world.node("propagator", &[&scene, "real_time_factor:=0.0001"]);
    eventually("the first state", || states.receive().unwrap().map(|_| ()));
    let asked = Instant::now();
    propagator.stop().expect(0);
    assert!(
        asked.elapsed() < Duration::from_secs(5),
        "{:?}",
        asked.elapsed()
    );
}

#[test]
fn a_sequence_that_starts_later_releases_the_flight_too() {
    let world = World::new();
    let scene = format!("scene:={}", scene("inclination_change").display());
    let propagator = world.node("propagator", &[&scene, "real_time_factor:=0.0"]);
    let stranger = world.ros_node("stranger");
    let mut later = coast();
    later.first_step = 5;
    let _publisher = publish(&stranger, &later);
    let steps = propagator.await_flown().steps;
    assert_eq!(steps, 1000);
    propagator.stop().expect(0);
}

#[test]
fn bytes_that_are_no_sequence_end_the_flight() {
    let world = World::new();
    let scene = format!("scene:={}", scene("inclination_change").display());
    let arguments = [&scene, "real_time_factor:=0.0", "stop_on_bad_control:=true"];
    let propagator = world.node("propagator", &arguments);
    let stranger = world.ros_node("stranger");
    let topic = "/lgvi_propagator/control_sequence";
    let publisher = stranger
        .raw_publisher(topic, "lgvi_msgs/msg/ControlSequence", &Qos::latched(1))
        .unwrap();
    publisher.publish(vec![0, 1, 0, 0, 255, 255]).unwrap();
    propagator
        .finish()
        .expect(2)
        .says(&["control sequence", "control_sequence"]);
}
