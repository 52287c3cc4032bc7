//! The parameter files that come along have every parameter of their node, with its default, and the node takes them.

use std::collections::BTreeMap;
use std::fs;
use std::thread;

use lgvi_tests::{Process, World, binary, root};

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

/// Starts a node that stays unconfigured, so that any values will do.
fn idle(world: &World, kind: &str, arguments: &[&str]) -> Process {
    let mut command = world.command(&binary(&format!("lgvi_{kind}")));
    command.args(["--supervised", "--ros-args", "--log-level", "warn"]);
    command.args(arguments);
    world.start(kind, command)
}

/// What `ros2 param dump` writes of a node; the node ends.
#[track_caller]
fn dumped(world: &World, kind: &str, node: Process) -> String {
    let name = format!("/lgvi_{kind}");
    let dump = world.ros_python("ros2_peer.py", &["dump", &name]);
    let text = dump.finish().expect(0).stdout;
    node.stop().expect(0);
    text
}

/// A value for a parameter whose line is in the node's parameter file, by what stands there.
fn random(name: &str, shown: &str, random: &mut fastrand::Rng) -> Option<String> {
    // What else these take is in their files' comments.
    let choices: &[&str] = match name {
        "compression" => &["none", "lz4", "zstd"],
        "log_time" => &["received", "stamp"],
        "log_level" => &["debug", "warn", "fatal"],
        "autostart" => &["false"],
        "frame_prefix" => &["''", "null/", "'1.5/'", "true_"],
        "use_sim_time" => &["true", "false"],
        _ => &[],
    };
    if !choices.is_empty() {
        return random.choice(choices).map(|choice| (*choice).to_owned());
    }
    if random.bool() && name != "scene" && name != "bag" {
        return None;
    }
    let words = [
        "'null'", "'true'", "'017'", "'1.5'", "'a: b'", "'~'", "\"a'b\"", "''", "plain",
    ];
    let word = |random: &mut fastrand::Rng| random.choice(words).map(ToString::to_string);
    Some(match shown {
        "true" | "false" => random.bool().to_string(),
        list if list.starts_with('[') => {
            let words: Vec<_> = (0..random.usize(0..4))
                .filter_map(|_| word(random))
                .collect();
            format!("[{}]", words.join(", "))
        }
        number if number.parse::<i64>().is_ok() => random.i64(1..1000).to_string(),
        // In YAML, infinity is `.inf`.
        number if number == ".inf" || number.parse::<f64>().is_ok() => {
            // As far as the narrowest range.
            format!("{:?}", 10_f64.powf(10.0 * random.f64() - 3.0).min(1e6))
        }
        _ => word(random)?,
    })
}

/// Dumps a node with random values or, but for `autostart`, its defaults; a node of that dump must give the same again.
fn dump_twice(kind: &str, defaults: bool) {
    let mut rng = fastrand::Rng::with_seed(1);
    let world = World::new();
    let text = file(kind);
    let values: Vec<_> = text
        .lines()
        .filter_map(setting)
        .filter(|(name, ..)| !defaults || *name == "autostart")
        .filter_map(|(name, shown, _)| Some((name, random(name, shown, &mut rng)?)))
        .map(|(name, value)| format!("{name}:={value}"))
        .collect();
    let arguments: Vec<_> = values.iter().flat_map(|value| ["-p", value]).collect();
    let first = dumped(&world, kind, idle(&world, kind, &arguments));
    let path = world.path("dump.yaml");
    fs::write(&path, &first).unwrap();
    let arguments = ["--params-file", path.to_str().unwrap()];
    let second = dumped(&world, kind, idle(&world, kind, &arguments));
    assert_eq!(second, first, "{kind}, {values:?}");
    if defaults {
        assert!(
            first.contains("frame_prefix: null") || kind == "player",
            "{first}"
        );
    }
}

#[test]
fn what_ros2_dumps_of_a_node_gives_the_same_node_again() {
    thread::scope(|scope| {
        for kind in ["propagator", "planner", "recorder", "player"] {
            scope.spawn(move || {
                for defaults in [true, false] {
                    dump_twice(kind, defaults);
                }
            });
        }
    });
}
