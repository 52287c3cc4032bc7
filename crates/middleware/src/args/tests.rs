use tracing_subscriber::filter::LevelFilter;

use super::*;
use crate::parameters::{Given, ParameterType};

fn parse(line: &str) -> Result<(NodeArgs, Vec<String>), ArgsError> {
    NodeArgs::parse("node", line.split_whitespace().map(Into::into))
}

#[test]
fn ros_arguments_are_told_from_the_others() {
    let (node, rest) = parse(
        "a --ros-args -r __node:=b --remap __ns:=/c -- d -- --ros-args --ros-args -p x:=1 --",
    )
    .unwrap();
    assert_eq!(node.fully_qualified_name(), "/c/b");
    assert_eq!(rest, ["a", "d", "--"]);
    assert_eq!(node.parameters().get("x"), Some(&1_i64.into()));
    assert!(node.notices().is_empty());
}

#[test]
fn rules_outside_of_ros_arguments_count_and_are_remarked_upon() {
    let (node, rest) = parse("__node:=a --ros-args -r __node:=b -- __ns:=c x:= tf:=/tf2").unwrap();
    assert_eq!(node.fully_qualified_name(), "/a");
    assert_eq!(node.resolve("tf").unwrap(), "/tf2");
    assert_eq!(rest, ["__ns:=c", "x:="]);
    let [name, topic] = node.notices() else {
        panic!("{:?}", node.notices());
    };
    assert!(name.contains("\"__node:=a\"") && topic.contains("-r tf:=/tf2"));
}

#[test]
fn names_are_expanded_and_remapped() {
    let (node, _) = parse("--ros-args -r ~/state:=/truth -r other:tf:=/no").unwrap();
    assert_eq!(node.resolve("~/state").unwrap(), "/truth");
    assert_eq!(node.resolve("tf").unwrap(), "/tf");
    assert_eq!(
        node.resolve("~/odometry/chaser").unwrap(),
        "/node/odometry/chaser"
    );
}

#[test]
fn topics_services_and_actions_are_remapped_each_by_their_rules() {
    let line = "--ros-args -r rostopic://~/x:=/topic -r rosservice://~/x:=/service -r ~/x:=/all \
                -r /all/_action/feedback:=/feedback";
    let (node, _) = parse(line).unwrap();
    assert_eq!(node.resolve("~/x").unwrap(), "/topic");
    assert_eq!(node.resolve_service("~/x").unwrap(), "/service");
    assert_eq!(node.resolve_action("~/x").unwrap(), "/all");
    assert_eq!(node.resolve("/all/_action/feedback").unwrap(), "/feedback");
    let error = node.resolve_service("a//b").unwrap_err().to_string();
    assert!(error.starts_with("service \"/a//b\""), "{error}");
}

#[test]
fn the_enclave_is_the_last_one_given() {
    let enclave = |line| parse(line).unwrap().0.enclave().to_owned();
    assert_eq!(enclave(""), "/");
    assert_eq!(enclave("--ros-args -e /a/b"), "/a/b");
    assert_eq!(enclave("--ros-args --enclave /a -e /"), "/");
}

#[test]
fn parameters_of_other_nodes_and_namespaces_are_not_ours() {
    let taken = |line| {
        let given = parse(line).unwrap().0.parameters();
        given.get("x").cloned().and_then(i64::from_value)
    };
    assert_eq!(taken("--ros-args -p node:x:=1"), Some(1));
    assert_eq!(taken("--ros-args -p other:x:=1"), None);
    assert_eq!(taken("--ros-args -r __node:=q -p node:x:=1"), None);
    assert_eq!(taken("--ros-args -r __node:=q -p q:x:=1"), Some(1));
    // A prefix is a name in the root namespace, as in rcl.
    assert_eq!(taken("--ros-args -r __ns:=/ns -p node:x:=1"), None);
}

#[test]
fn later_parameters_win_and_node_prefixes_select() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("p.yaml");
    std::fs::write(&file, "/**: {ros__parameters: {a: 2, b: 2, c: [p, q]}}").unwrap();
    let line = format!(
        "--ros-args -p a:=1 --params-file {} -p b:=3 -p node:d:=4 -p other:d:=5",
        file.display()
    );
    let expected = [
        ("a".to_owned(), 2_i64.into()),
        ("b".into(), 3_i64.into()),
        ("c".into(), vec!["p".to_owned(), "q".into()].into()),
        ("d".into(), 4_i64.into()),
    ];
    assert_eq!(
        parse(&line).unwrap().0.parameters(),
        Given::from_iter(expected)
    );
}

#[test]
fn logging_is_set_by_level_logger_and_switch() {
    let (node, _) = parse(
        "--ros-args --log-level WARN --log-level lgvi:=debug --disable-rosout-logs \
         --disable-stdout-logs --enable-stdout-logs --disable-external-lib-logs \
         --log-level gone:=info --log-level gone:=UNSET",
    )
    .unwrap();
    assert_eq!(
        node.log(),
        &LogSettings {
            level: Some(LevelFilter::WARN),
            loggers: vec![("lgvi".into(), LevelFilter::DEBUG)],
            console: true,
            rosout: false,
            external: false,
        }
    );
}

#[test]
fn what_asks_for_nothing_is_accepted() {
    let line = ["--ros-args", "--log-config-file", "", "--log-file-name", ""];
    assert!(NodeArgs::parse("node", line.map(Into::into)).is_ok());
}

#[test]
fn what_is_wrong_is_said() {
    for (line, expected) in [
        (
            "--ros-args --nonsense",
            "unknown ROS argument \"--nonsense\"",
        ),
        ("--ros-args stray", "unknown ROS argument \"stray\""),
        ("--ros-args --enable-magic", "unknown ROS argument"),
        ("--ros-args -r", "-r needs a value"),
        ("--ros-args --remap=a:=b", "unknown ROS argument"),
        ("--ros-args __node:=b", "unknown ROS argument \"__node:=b\""),
        (
            "--ros-args --param-file x",
            "unknown ROS argument \"--param-file\"",
        ),
        ("--ros-args -e", "-e needs a value"),
        ("--ros-args -e a", "enclave \"a\" must start with '/'"),
        ("--ros-args -e /a/", "enclave \"/a/\""),
        (
            "--ros-args --log-file-name x",
            "--log-file-name \"x\" is not supported",
        ),
        (
            "--ros-args --log-config-file x",
            "--log-config-file \"x\" is not supported",
        ),
        (
            "--ros-args -r a:b",
            "remapping rule \"a:b\": it is not of the form",
        ),
        (
            "--ros-args -r a:={node}",
            "remapping rule \"a:={node}\": \"{node}\" is not a name",
        ),
        (
            "--ros-args -r __ns:=b",
            "namespace \"b\" must start with '/'",
        ),
        ("--ros-args -p a=b", "not of the form"),
        (
            "--ros-args -p /**:a:=1",
            "\"/**\" is not the name of a node",
        ),
        (
            "--ros-args -p a:=[1,x]",
            "all of a list must be of one type",
        ),
        ("--ros-args -p a:=", "the value is missing"),
        ("--ros-args -p a:={x}", "scalar or a list"),
        ("--ros-args --log-level loud", "\"loud\""),
        ("--ros-args -r __node:=a/b", "must not contain '/'"),
        (
            "--ros-args --params-file /nowhere.yaml",
            "/nowhere.yaml: No such file",
        ),
        ("--ros-args --params-file /dev/zero", "longer than"),
    ] {
        let error = parse(line).unwrap_err().to_string();
        assert!(error.contains(expected), "{line}: {error}");
    }
}
