//! Arguments, parameters and variables that a node does not understand.

use std::ffi::OsStr;
use std::fs::File;
use std::os::unix::ffi::OsStrExt;
use std::process::Stdio;

use lgvi_tests::{Finished, World, binary, scene};

const NODES: [&str; 4] = [
    "lgvi_propagator",
    "lgvi_planner",
    "lgvi_recorder",
    "lgvi_player",
];

fn run(world: &World, node: &str, arguments: &[&str]) -> Finished {
    let mut command = world.command(&binary(node));
    command.args(arguments);
    world.start(node, command).finish()
}

#[test]
fn every_node_refuses_what_it_does_not_know_by_its_name() {
    let world = World::new();
    for node in NODES {
        run(&world, node, &["--nonsense"])
            .expect(2)
            .says(&["\"--nonsense\""]);
        run(&world, node, &["--ros-args", "--nonsense"])
            .expect(2)
            .says(&["\"--nonsense\""]);
        let unknown = run(&world, node, &["--ros-args", "-p", "nonsense:=1"]).expect(2);
        unknown.says(&["unknown parameter \"nonsense\"", "this node has"]);
        run(&world, node, &["--ros-args", "-p", "nonsense"])
            .expect(2)
            .says(&["\"nonsense\""]);
    }
}

#[test]
fn a_parameter_with_a_wrong_value_is_refused_with_name_value_and_expectation() {
    let scene = format!("scene:={}", scene("free_body").display());
    let cases: [(&str, &[&str], &[&str]); 8] = [
        (
            "lgvi_propagator",
            &[],
            &["\"scene\" is missing", "expected a path"],
        ),
        (
            "lgvi_planner",
            &[],
            &["\"scene\" is missing", "expected a path"],
        ),
        (
            "lgvi_player",
            &[],
            &["\"bag\" is missing", "expected a path"],
        ),
        (
            "lgvi_propagator",
            &[&scene, "real_time_factor:=-1.0"],
            &[
                "\"real_time_factor\" is -1",
                "expected a number at least 0.0",
            ],
        ),
        (
            "lgvi_propagator",
            &[&scene, "real_time_factor:=fast"],
            &["\"real_time_factor\" is \"fast\"", "expected a number"],
        ),
        (
            "lgvi_propagator",
            &[&scene, "await_control:=true"],
            &["\"await_control\" is true", "expected false"],
        ),
        ("lgvi_planner", &[&scene], &["`maneuver` is missing"]),
        (
            "lgvi_recorder",
            &["topics:=['/tf=tf2_msgs/msg/Nothing']"],
            &[
                "\"topics\" has \"/tf=tf2_msgs/msg/Nothing\"",
                "expected a message type",
            ],
        ),
    ];
    let world = World::new();
    for (node, parameters, fragments) in cases {
        let mut arguments = vec!["--ros-args"];
        arguments.extend(parameters.iter().flat_map(|parameter| ["-p", parameter]));
        run(&world, node, &arguments).expect(2).says(fragments);
    }
}

#[test]
fn a_domain_that_is_none_is_refused() {
    let world = World::new();
    for node in NODES {
        let mut command = world.command(&binary(node));
        command.env("ROS_DOMAIN_ID", "233");
        let finished = world.start(node, command).finish().expect(2);
        finished.says(&[
            "ROS_DOMAIN_ID is \"233\"",
            "expected a number from 0 to 232",
        ]);
    }
}

#[test]
fn variables_of_discovery_that_cannot_be_honored_are_refused() {
    let world = World::new();
    for (variable, value, fragments) in [
        (
            "ROS_AUTOMATIC_DISCOVERY_RANGE",
            "OFF",
            ["ROS_AUTOMATIC_DISCOVERY_RANGE=OFF", "not supported"],
        ),
        (
            "ROS_AUTOMATIC_DISCOVERY_RANGE",
            "GALAXY",
            ["\"GALAXY\"", "expected LOCALHOST, SUBNET"],
        ),
        (
            "ROS_STATIC_PEERS",
            "10.0.0.1;10.0.0.2:7400",
            ["ROS_STATIC_PEERS has \"10.0.0.2:7400\"", "separated by ';'"],
        ),
        (
            "ROS_LOCALHOST_ONLY",
            "yes",
            ["ROS_LOCALHOST_ONLY is \"yes\"", "expected 0 or 1"],
        ),
    ] {
        let mut command = world.command(&binary("lgvi_player"));
        command.env(variable, value);
        let finished = world.start("lgvi_player", command).finish().expect(2);
        finished.says(&fragments);
    }
}

#[test]
fn ros_arguments_that_cannot_be_honored_are_refused() {
    let world = World::new();
    let file = world.path("parameters.yaml");
    let text = "/**:\n  ros__parameters:\n    frame: inertial\n    topics: [a, 1]\n";
    std::fs::write(&file, text).expect("a parameter file");
    let file = file.display().to_string();
    for (arguments, fragments) in [
        (
            ["--params-file", file.as_str()],
            ["parameters.yaml: line 4: parameter \"topics\"", "one type"],
        ),
        (["-p", "topics:=[a, 1]"], ["topics:=[a, 1]", "one type"]),
        (
            ["-r", "a:={node}"],
            ["\"a:={node}\"", "\"{node}\" is not a name"],
        ),
        (
            ["-r", "__ns:=y"],
            ["namespace \"y\"", "must start with '/'"],
        ),
        (["-e", "y"], ["enclave \"y\"", "must start with '/'"]),
        (["--log-level", "trace"], ["\"trace\"", "debug, info"]),
        (
            ["--log-file-name", "x"],
            ["--log-file-name \"x\"", "not supported"],
        ),
        (
            ["--log-config-file", "x"],
            ["--log-config-file \"x\"", "not supported"],
        ),
    ] {
        let line = [&["--ros-args"], arguments.as_slice()].concat();
        run(&world, "lgvi_recorder", &line)
            .expect(2)
            .says(&fragments);
    }
}

#[test]
fn a_command_line_that_is_no_unicode_is_refused() {
    let world = World::new();
    let alien = OsStr::from_bytes(b"b\xffd");
    for node in NODES {
        let mut command = world.command(&binary(node));
        command.arg(alien);
        let finished = world.start(node, command).finish().expect(2);
        finished.says(&["argument \"b\\xFFd\"", "expected valid Unicode"]);
    }
    let free_body = scene("free_body");
    let lines: [&[&OsStr]; 7] = [
        &["run".as_ref(), alien],
        &[
            "run".as_ref(),
            free_body.as_ref(),
            "--output".as_ref(),
            alien,
        ],
        &["verify".as_ref(), alien],
        &["plot".as_ref(), alien],
        &["report".as_ref(), alien],
        &["play".as_ref(), alien],
        &["node".as_ref(), "planner".as_ref(), alien],
    ];
    for line in lines {
        let finished = world.lgvi(line).finish().expect(2);
        assert!(
            finished.stderr.contains("Unicode") || finished.stderr.contains("UTF-8"),
            "{line:?}: {}",
            finished.stderr
        );
    }
    assert!(!world.path("flights").exists());
}

#[test]
fn a_pace_that_is_none_is_refused_before_there_is_a_bag() {
    let world = World::new();
    let free_body = scene("free_body");
    for value in ["nan", "-1", "inf", "fast"] {
        let finished = world
            .start_flight(&free_body, "flight", &["--real-time-factor", value])
            .finish()
            .expect(2);
        finished.says(&[value, "--real-time-factor", "expected a finite number"]);
        let finished = world.lgvi(["play", "bag", "--rate", value]).finish();
        finished
            .expect(2)
            .says(&[value, "--rate", "expected a finite number"]);
    }
    assert!(!world.path("flight").exists());
}

#[test]
fn output_that_nobody_takes_is_no_panic() {
    let world = World::new();
    let (_, bag) = world.fly(&scene("free_body"), "flight");
    let verify = |output: Stdio| {
        let mut command = world.command(&binary("lgvi"));
        command.arg("verify").arg(&bag);
        let output = command.stdout(output).stderr(Stdio::piped()).output();
        let output = output.expect("lgvi starts");
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), stderr)
    };
    let full = File::create("/dev/full").expect("/dev/full");
    let (code, stderr) = verify(full.into());
    assert_eq!(code, Some(2), "{stderr}");
    assert!(
        stderr.starts_with("lgvi: cannot write to standard output: "),
        "{stderr}"
    );
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    assert_eq!(verify(writer.into()), (Some(0), String::new()));
}

#[cfg(not(feature = "security"))]
#[test]
fn a_program_without_security_refuses_to_pretend() {
    let world = World::new();
    let output = format!("output:={}", world.path("bag").display());
    // A permissive node without the files joins without security. With them it was meant to be secure.
    let enclave = world.path("keys").join("enclaves/a");
    std::fs::create_dir_all(&enclave).expect("a directory");
    for file in [
        "identity_ca.cert.pem",
        "cert.pem",
        "key.pem",
        "permissions_ca.cert.pem",
        "governance.p7s",
        "permissions.p7s",
    ] {
        std::fs::write(enclave.join(file), "").expect("a file");
    }
    for strategy in ["Enforce", "Permissive"] {
        let mut command = world.command(&binary("lgvi_recorder"));
        command
            .env("ROS_SECURITY_ENABLE", "true")
            .env("ROS_SECURITY_STRATEGY", strategy)
            .env("ROS_SECURITY_KEYSTORE", world.path("keys"))
            .args(["--ros-args", "-e", "/a", "-p", &output]);
        let finished = world.start("recorder", command).finish().expect(2);
        finished.says(&["built without DDS security", "--features security"]);
    }
}
