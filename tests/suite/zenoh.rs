//! Flights of which the nodes talk over Zenoh, as beside `rmw_zenoh_cpp`.

use ::zenoh::{Config, Session, Wait};
use lgvi_middleware::{
    Environment, NodeArgs, Rmw, ZenohSettings,
    ros::{Qos, RosNode},
};
use lgvi_msgs::{
    lifecycle_msgs::srv::{GetState, GetStateRequest},
    msg::SystemState,
    std_srvs::srv::{SetBool, SetBoolRequest},
};
use lgvi_tests::{PATIENCE, Recording, World, reference_bag, scene};

/// A router on the loopback interface.
struct Router {
    _session: Session,
    overrides: String,
}

impl Router {
    fn start() -> Self {
        let mut config = Config::default();
        for (key, value) in [
            ("mode", "\"router\""),
            ("listen/endpoints", "[\"tcp/127.0.0.1:0\"]"),
            ("scouting/multicast/enabled", "false"),
        ] {
            config.insert_json5(key, value).unwrap();
        }
        let session = ::zenoh::open(config).wait().unwrap();
        let locators = session.info().locators().wait();
        let endpoint = locators.first().expect("a place to listen at");
        let overrides =
            format!("connect/endpoints=[\"{endpoint}\"];listen/endpoints=[\"tcp/127.0.0.1:0\"]");
        Self {
            _session: session,
            overrides,
        }
    }

    #[track_caller]
    fn world(&self) -> World {
        World::new()
            .with("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")
            .with("ZENOH_CONFIG_OVERRIDE", &self.overrides)
    }

    fn node(&self, world: &World, name: &str) -> RosNode {
        let (args, _) = NodeArgs::parse(name, []).unwrap();
        let environment = Environment {
            rmw: Rmw::Zenoh,
            zenoh: ZenohSettings {
                file: None,
                overrides: Some(self.overrides.clone()),
            },
            ..world.environment()
        };
        RosNode::new(&args, &environment).unwrap()
    }
}

#[test]
fn a_flight_with_a_plan_is_recorded_without_loss_and_verifies() {
    let router = Router::start();
    let world = router.world();
    let (summary, bag) = world.fly_fast(&scene("inclination_change"), "flight");
    assert_eq!(summary.lost, Some(0));
    let states = Recording::read(&bag).on("/lgvi_propagator/state").count();
    assert_eq!(states, 1001);
    world.verify_agrees(&bag, 1001);
}

#[test]
fn a_flight_is_heard_and_paused_from_outside() {
    let router = Router::start();
    let world = router.world();
    let node = router.node(&world, "operator");
    let flight = scene("free_body");
    let file = format!("scene:={}", flight.display());
    let _propagator = world.node("propagator", &[&file, "real_time_factor:=1.0"]);
    let state = node
        .service_client::<GetState>("/lgvi_propagator/get_state")
        .unwrap();
    let reply = state.call(&GetStateRequest::default(), PATIENCE).unwrap();
    assert!(!reply.current_state.label.is_empty());
    let states = node
        .subscription::<SystemState>("/lgvi_propagator/state", &Qos::reliable(1000))
        .unwrap();
    let first = states.recv_timeout(PATIENCE).unwrap().expect("a state");
    assert_eq!(first.message.bodies.len(), 1);
    let pause = node
        .service_client::<SetBool>("/lgvi_propagator/pause")
        .unwrap();
    let reply = pause
        .call(&SetBoolRequest { data: true }, PATIENCE)
        .unwrap();
    assert!(reply.success, "{}", reply.message);
}

#[test]
fn a_bag_is_played_over_zenoh() {
    let router = Router::start();
    let world = router.world();
    let node = router.node(&world, "listener");
    let states = node
        .subscription::<SystemState>("/lgvi_propagator/state", &Qos::reliable(2000))
        .unwrap();
    let bag = reference_bag("free_body");
    let play = world.lgvi(["play", bag.to_str().unwrap(), "--rate", "100"]);
    let recorded = Recording::read(&bag).on("/lgvi_propagator/state").count() as u64;
    for sequence in 1..=recorded {
        let sample = states.recv_timeout(PATIENCE).unwrap().expect("a state");
        assert_eq!(sample.info.sequence, sequence);
    }
    play.finish().expect(0);
    assert_eq!((states.received(), states.lost()), (recorded, 0));
}
