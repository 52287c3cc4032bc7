//! A node of `hiroz`, another implementation of ROS 2 on Zenoh. Run by hand: see `docs/decisions/zenoh.md`.

use std::{env, process::Command, time::Duration};

use crate::common::{Router, node};
use lgvi_middleware::{
    ParameterSpec, Parameters,
    parameters::Given,
    ros::{Executor, Qos},
};
use lgvi_msgs::std_msgs;

const PATIENCE: Duration = Duration::from_secs(20);

#[test]
#[ignore = "needs the program that HIROZ_PEER names"]
fn hiroz_hears_speaks_and_calls() {
    let peer = env::var_os("HIROZ_PEER").expect("HIROZ_PEER names the program");
    let router = Router::start(&[]);
    let own = node("own", &router.environment(3));
    let mut executor = Executor::new();
    let spec = ParameterSpec::new("observer", "one".to_owned(), "a body");
    let parameters = Parameters::declare(Given::default(), vec![spec]).unwrap();
    parameters.serve(&own, &mut executor).unwrap();
    let _running = executor.start().unwrap();
    let publisher = own.publisher("/to_peer", &Qos::reliable(1)).unwrap();
    let heard = own
        .subscription::<std_msgs::String>("/from_peer", &Qos::reliable(100))
        .unwrap();
    let peer = Command::new(peer)
        .args([&router.endpoint, "3"])
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    assert!(publisher.wait_for_subscriptions(1, PATIENCE));
    let hello = std_msgs::String {
        data: "hello".into(),
    };
    publisher.publish(&hello).unwrap();
    let sample = heard.recv_timeout(PATIENCE).unwrap().unwrap();
    assert!(sample.message.data.starts_with("hello "));
    assert_eq!(own.other_nodes(), ["/hiroz_peer"]);
    let output = peer.wait_with_output().unwrap();
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(printed.contains("heard hello"), "{printed}");
    assert!(printed.contains("\"observer\""), "{printed}");
}
