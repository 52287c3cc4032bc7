//! Parameters and log levels seen and set by a client of another make: `tests/python/cyclone_parameter_peer.py`, which
//! calls services as `rmw_cyclonedds_cpp` does.
//!
//! Needs a Python with PyPI `cyclonedds` 11.0.1: `target/python-env`, or what `LGVI_PYTHON` names.

use std::{
    io::{BufRead, BufReader, Lines, Write},
    process::{Child, ChildStdout, Stdio},
    sync::mpsc,
    time::Duration,
};

use crate::common::{isolated, own_name, python_peer};
use lgvi_middleware::{
    Environment, NodeArgs, Rmw, ServiceMapping, log,
    parameters::{Change, ParameterSpec, ParameterValue, Parameters},
    ros::{Executor, RosNode},
};
use serde_json::{Value, json};

const PATIENCE: Duration = Duration::from_secs(20);

/// A peer that is killed when the test ends.
struct Peer {
    child: Child,
    lines: Lines<BufReader<ChildStdout>>,
}

impl Peer {
    fn start(environment: &Environment, node: &str) -> Self {
        let mut child = python_peer("cyclone_parameter_peer.py", environment)
            .arg(node)
            .args(["--timeout", &PATIENCE.as_secs().to_string()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let mut peer = Self { child, lines };
        assert_eq!(peer.line(), json!({ "found": node }));
        peer
    }

    fn line(&mut self) -> Value {
        let line = self.lines.next().expect("the peer says why on stderr");
        serde_json::from_str(&line.unwrap()).unwrap()
    }

    /// What the peer has to show of its call.
    fn call(&mut self, call: &Value) -> Value {
        let stdin = self.child.stdin.as_mut().unwrap();
        writeln!(stdin, "{call}").unwrap();
        self.line()
    }

    /// The value of a parameter.
    fn get(&mut self, name: &str) -> Value {
        self.call(&json!(["get_parameters", [name]]))["values"][0].clone()
    }

    /// Why a parameter was not set; empty if it was.
    fn set(&mut self, name: &str, value: &Value) -> String {
        let reply = self.call(&json!(["set_parameters", [[name, value]]]));
        let result = &reply["results"][0];
        let reason = result["reason"].as_str().unwrap();
        assert_eq!(result["successful"], reason.is_empty());
        reason.into()
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

fn specs() -> Vec<ParameterSpec> {
    vec![
        ParameterSpec::new("rate", 2.0, "How often (Hz)")
            .range(0.0, 100.0)
            .change(Change::Anytime),
        ParameterSpec::new("loud", false, "").change(Change::Never),
        ParameterSpec::new("gains.p", 3_i64, "").integer_range(1, 10),
        ParameterSpec::optional::<Vec<f64>>("gains.list", "").change(Change::Anytime),
        ParameterSpec::optional::<String>("scene", "Path").constraints("must exist"),
    ]
}

/// One test, since logging is set up once a process.
#[test]
fn a_stranger_sees_and_sets_parameters_and_log_levels() {
    let environment = Environment {
        rmw: Rmw::Dds(ServiceMapping::Cyclone),
        ..isolated()
    };
    let name = own_name("parametrized");
    let line = "--ros-args -p rate:=5 -p scene:=a.toml".split_whitespace();
    let (args, _) = NodeArgs::parse(&name, line.map(Into::into)).unwrap();
    let logging = log::init(&args).unwrap();
    let levels = logging.levels();
    let mut specs = specs();
    specs.push(levels.specification());
    let parameters = Parameters::declare(args.parameters(), specs).unwrap();
    levels.follow(&parameters).unwrap();
    let (sender, changes) = mpsc::channel();
    parameters
        .on_change("rate", move |value| sender.send(value.clone()).unwrap())
        .unwrap();
    let node = RosNode::new(&args, &environment).unwrap();
    let mut executor = Executor::new();
    parameters.serve(&node, &mut executor).unwrap();
    levels.serve(&parameters, &node, &mut executor).unwrap();
    let running = executor.start().unwrap();
    let mut peer = Peer::start(&environment, &node.fully_qualified_name());

    are_listed_and_described(&mut peer);
    are_set_one_by_one(&mut peer, &parameters);
    assert_eq!(
        changes.try_iter().collect::<Vec<_>>(),
        [ParameterValue::Double(7.0)]
    );
    are_set_together(&mut peer);
    levels_are_set(&mut peer, &name);
    assert_eq!(levels.get(), "debug");

    // With the executor ends all that the parameters hold of the node.
    drop((running, node));
    parameters.set("rate", 1.0.into()).unwrap();
}

fn are_listed_and_described(peer: &mut Peer) {
    let all = peer.call(&json!(["list_parameters", [], 0]));
    assert_eq!(
        all["result"],
        json!({
            "names": ["gains.list", "gains.p", "log_level", "loud", "rate", "scene"],
            "prefixes": ["gains"],
        })
    );
    let some = peer.call(&json!(["list_parameters", ["gains"], 1]));
    assert_eq!(some["result"]["names"], json!(["gains.list", "gains.p"]));

    let names = ["rate", "scene", "gains.p", "gains.list"];
    let values = peer.call(&json!(["get_parameters", names]));
    assert_eq!(values["values"], json!([5.0, "a.toml", 3, null]));
    let types = peer.call(&json!(["get_parameter_types", names]));
    assert_eq!(types["types"], json!([3, 4, 2, 0]));
    for (service, reply) in [
        ("get_parameters", "values"),
        ("get_parameter_types", "types"),
        ("describe_parameters", "descriptors"),
    ] {
        let none = peer.call(&json!([service, ["rate", "unknown"]]));
        assert_eq!(none[reply], json!([]), "{service}, as rclcpp does it");
    }
    let reply = peer.call(&json!(["describe_parameters", ["rate", "loud", "scene"]]));
    let [rate, loud, scene] = [0, 1, 2].map(|index| &reply["descriptors"][index]);
    assert_eq!(
        *rate,
        json!({
            "name": "rate",
            "type": 3,
            "description": "How often (Hz)",
            "additional_constraints": "",
            "read_only": false,
            "dynamic_typing": false,
            "floating_point_range": [{ "from_value": 0.0, "to_value": 100.0, "step": 0.0 }],
            "integer_range": [],
        })
    );
    assert_eq!(loud["read_only"], true);
    assert_eq!(
        scene["additional_constraints"],
        "must exist; set it while the node is unconfigured"
    );
}

fn are_set_one_by_one(peer: &mut Peer, parameters: &Parameters) {
    assert_eq!(peer.set("rate", &json!(7)), "");
    assert_eq!(peer.get("rate"), json!(7.0), "an integer is a number");
    let event = peer.call(&json!(["event"]));
    assert_eq!(event["changed"], json!({ "rate": 7.0 }));
    assert_eq!((&event["new"], &event["deleted"]), (&json!({}), &json!(0)));
    assert!(event["sec"].as_i64().unwrap() > 1_700_000_000);

    assert_eq!(peer.set("gains.list", &json!([0.5, 2.0])), "");
    assert_eq!(peer.get("gains.list"), json!([0.5, 2.0]));
    assert_eq!(peer.set("gains.list", &Value::Null), "");
    assert_eq!(peer.get("gains.list"), Value::Null);
    assert_eq!(peer.set("gains.p", &json!(4)), "", "not yet configured");
    parameters.configured(true);
    for (name, value, expected) in [
        (
            "rate",
            json!(100.5),
            "is 100.5; expected a number from 0.0 to 100.0",
        ),
        (
            "rate",
            json!("fast"),
            r#""rate" is "fast"; expected a number"#,
        ),
        (
            "rate",
            Value::Null,
            r#""rate" is not set; expected a number"#,
        ),
        ("gains.p", json!(5), "cannot be set to 5 now"),
        (
            "loud",
            json!(true),
            "cannot be set to true; it is read-only",
        ),
        (
            "unknown",
            json!(1),
            r#""unknown" is not declared; this node has gains.list,"#,
        ),
    ] {
        let before = peer.get(name);
        let reason = peer.set(name, &value);
        assert!(reason.contains(expected), "{reason}");
        assert_eq!(peer.get(name), before);
    }
    for _ in 0..3 {
        let event = peer.call(&json!(["event"]));
        assert_eq!(event["new"], json!({}), "{event}");
    }
}

fn are_set_together(peer: &mut Peer) {
    let mut set = |list: &Value| {
        peer.call(&json!([
            "set_parameters_atomically",
            [["rate", 9.0], ["gains.list", list]]
        ]))
    };
    let refused = set(&json!(["x"]));
    let accepted = set(&json!([1.5]));
    assert_eq!(refused["result"]["successful"], false);
    let reason = refused["result"]["reason"].as_str().unwrap();
    assert!(reason.contains(r#""gains.list" is ["x"]"#), "{reason}");
    assert_eq!(accepted["result"]["successful"], true);
    let event = peer.call(&json!(["event"]));
    assert_eq!(
        event["changed"],
        json!({ "rate": 9.0, "gains.list": [1.5] }),
        "nothing of what was refused"
    );
    let each = peer.call(&json!([
        "set_parameters",
        [["rate", -1.0], ["gains.list", [2.5]]]
    ]));
    let successful = [0, 1].map(|index| &each["results"][index]["successful"]);
    assert_eq!(successful, [false, true], "each for itself");
    let event = peer.call(&json!(["event"]));
    assert_eq!(event["changed"], json!({ "gains.list": [2.5] }));
}

fn levels_are_set(peer: &mut Peer, name: &str) {
    let mut level = |logger: &str| {
        peer.call(&json!(["get_logger_levels", [logger]]))["levels"][0]["level"].clone()
    };
    assert_eq!([level(name), level(""), level("rustdds")], [20, 20, 0]);
    let set = peer.call(&json!([
        "set_logger_levels",
        [[name, 40], ["rustdds", 30], ["", 33]]
    ]));
    let successful = [0, 1, 2].map(|index| &set["results"][index]["successful"]);
    assert_eq!(successful, [true, true, false]);
    assert_eq!(peer.get("log_level"), "error");
    let levels = peer.call(&json!(["get_logger_levels", ["", "rustdds"]]));
    let levels = [0, 1].map(|index| &levels["levels"][index]["level"]);
    assert_eq!(levels, [40, 30]);
    assert_ne!(peer.set("log_level", &json!("loud")), "");
    assert_eq!(peer.set("log_level", &json!("debug")), "");
}
