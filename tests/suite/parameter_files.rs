//! The parameter files that come along have every parameter of their node, with its default, and the node takes them.

use std::collections::BTreeMap;
use std::fs;

use lgvi_tests::{World, binary, root};

/// What stands for a path of the user's own.
const ELSEWHERE: &str = "/path/to/";

/// A node's parameter file.
fn file(kind: &str) -> String {
    fs::read_to_string(root().join(format!("launch_scripts/params/{kind}.yaml"))).unwrap()
}

/// A line of a parameter file that sets a parameter, or would if it were no comment: name, value, whether it does.
fn setting(line: &str) -> Option<(&str, &str, bool)> {
    let line = line.strip_prefix("    ")?;
    let set = line.strip_prefix("# ").unwrap_or(line);
    let (name, value) = set.split_once(": ")?;
    let named = name
        .chars()
        .all(|letter| letter.is_ascii_lowercase() || letter == '_');
    (named && !name.is_empty()).then_some((name, value, set == line))
}

/// The parameters that a node says it has.
fn own_list(world: &World, kind: &str) -> Vec<String> {
    let mut command = world.command(&binary(&format!("lgvi_{kind}")));
    command.args(["--ros-args", "-p", "no_such_parameter:=1"]);
    let refused = world.start(kind, command).finish().expect(2);
    let (_, known) = refused
        .stderr
        .split_once("this node has ")
        .expect("the parameters that the node knows");
    let known = known.lines().next().unwrap();
    let mut known: Vec<String> = known.split(", ").map(Into::into).collect();
    known.sort();
    known
}

/// The documented defaults of a node's parameters.
fn documented(kind: &str) -> BTreeMap<String, String> {
    let page = fs::read_to_string(root().join("docs/interfaces.md")).unwrap();
    let (_, page) = page.split_once("## Parameters").unwrap();
    let (table, _) = page.split_once("\n## ").unwrap();
    let mut node = "";
    let mut defaults = BTreeMap::new();
    for row in table.lines().filter(|line| line.starts_with("| ")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        if !cells[1].is_empty() {
            node = cells[1];
        }
        if let (true, Some((_, default))) =
            ([kind, "all"].contains(&node), cells[3].split_once(", "))
        {
            defaults.insert(
                cells[2].trim_matches('`').into(),
                default.trim_matches('`').into(),
            );
        }
    }
    defaults
}

#[test]
fn they_have_every_parameter_with_its_documented_default() {
    let world = World::new();
    for kind in ["propagator", "planner", "recorder", "player"] {
        let text = file(kind);
        let mut names: Vec<&str> = text.lines().filter_map(setting).map(|set| set.0).collect();
        names.sort_unstable();
        assert_eq!(
            names,
            own_list(&world, kind),
            "of {kind}.yaml, and its node"
        );

        let defaults = documented(kind);
        for (name, value, active) in text.lines().filter_map(setting) {
            let default = defaults.get(name).map(String::as_str);
            if active {
                assert_eq!(
                    Some(value),
                    default,
                    "{name} in {kind}.yaml, and documented"
                );
            }
        }
    }
}

#[test]
fn nodes_take_every_value_in_them() {
    let world = World::new();
    for (kind, unreadable) in [
        ("propagator", Some("scene.toml")),
        ("planner", Some("scene.toml")),
        ("player", Some("bag")),
        ("recorder", None),
    ] {
        let nowhere = format!("{}/", world.path("nowhere").display());
        let path = world.path(&format!("{kind}.yaml"));
        let text: String = file(kind)
            .lines()
            .map(|line| match setting(line) {
                Some((name, value, _)) => format!("    {name}: {value}\n"),
                None => format!("{line}\n"),
            })
            .collect();
        fs::write(&path, text.replace(ELSEWHERE, &nowhere)).unwrap();

        let mut command = world.command(&binary(&format!("lgvi_{kind}")));
        command.args(["--supervised", "--ros-args", "--params-file"]);
        let node = world.start(kind, {
            command.arg(&path);
            command
        });
        match unreadable {
            // It has read its parameters when it says that it cannot read what they name.
            Some(name) => node.finish().expect(2).says(&[&format!("{nowhere}{name}")]),
            None => {
                node.await_ready();
                node.stop().expect(0);
            }
        }
    }
}
