//! The layouts for RViz and Foxglove show topics that there are, as what they are.

use std::collections::BTreeSet;
use std::fs;

use lgvi_msgs::lookup;
use lgvi_tests::{Recording, Row, codes, documented, reference_bag, root};
use serde_json::Value;

/// A row of the table of topics in docs/interfaces.md.
struct Topic {
    /// Its full name, in which `<body>` stands for any one part.
    name: String,
    types: Vec<String>,
    latched: bool,
}

/// What nodes publish, as documented.
fn topics() -> Vec<Topic> {
    let mut topics = Vec::new();
    for Row { node, cells } in documented("Topics") {
        if cells[0].starts_with("subscribes") {
            continue;
        }
        if let Some(name) = codes(&cells[0]).into_iter().next() {
            let types = codes(&cells[1]).into_iter();
            topics.push(Topic {
                name: name.replace("~/", &format!("/lgvi_{node}/")),
                types: types.filter(|name| name.contains("/msg/")).collect(),
                latched: cells[2].starts_with("latched"),
            });
        }
    }
    topics
}

/// The documented topic of this name and type.
#[track_caller]
fn find<'a>(topics: &'a [Topic], name: &str, type_name: Option<&str>) -> &'a Topic {
    let matches = |pattern: &str| {
        let (pattern, name): (Vec<_>, Vec<_>) =
            (pattern.split('/').collect(), name.split('/').collect());
        pattern.len() == name.len()
            && pattern
                .iter()
                .zip(&name)
                .all(|(wanted, part)| *wanted == "<body>" || wanted == part)
    };
    let typed = |topic: &&Topic| {
        type_name.map_or(!topic.types.is_empty(), |name| {
            topic.types.iter().any(|known| known == name)
        })
    };
    topics
        .iter()
        .filter(|topic| matches(&topic.name))
        .find(typed)
        .unwrap_or_else(|| panic!("{name} of type {type_name:?} is not in docs/interfaces.md"))
}

/// Whether a message has what a path such as `energy` or `position[2]` leads to.
fn has_field(type_name: &str, path: &str) -> bool {
    let (field, index) = match path.split_once('[') {
        Some((field, index)) => (
            field,
            index.strip_suffix(']').and_then(|index| index.parse().ok()),
        ),
        None => (path, None::<usize>),
    };
    let definition = lookup(type_name).expect("a message of ours").definition;
    let kind = definition
        .lines()
        .take_while(|line| !line.starts_with("==="))
        .filter_map(|line| line.split_once(' '))
        .find(|(_, rest)| rest.split_whitespace().next() == Some(field))
        .map(|(kind, _)| kind);
    match (kind, index) {
        (Some(kind), Some(index)) => kind
            .split_once('[')
            .and_then(|(_, length)| length.strip_suffix(']')?.parse::<usize>().ok())
            .is_some_and(|length| index < length),
        (Some(kind), None) => !kind.contains('['),
        (None, _) => false,
    }
}

#[test]
fn rviz_shows_documented_topics_and_asks_for_what_was_published_before_it_joined() {
    let text = fs::read_to_string(root().join("launch_scripts/lgvi.rviz")).unwrap();
    let layout: serde_yaml_ng::Value = serde_yaml_ng::from_str(&text).unwrap();
    let manager = &layout["Visualization Manager"];
    assert_eq!(manager["Global Options"]["Fixed Frame"], "inertial");

    let topics = topics();
    let mut shown = BTreeSet::new();
    for display in manager["Displays"].as_sequence().unwrap() {
        let class = display["Class"].as_str().unwrap();
        let type_name = match class.strip_prefix("rviz_default_plugins/").unwrap() {
            "Grid" => continue,
            "TF" => {
                for name in ["/tf", "/tf_static"] {
                    find(&topics, name, Some("tf2_msgs/msg/TFMessage"));
                }
                continue;
            }
            "MarkerArray" => "visualization_msgs/msg/MarkerArray",
            "Path" => "nav_msgs/msg/Path",
            "Odometry" => "nav_msgs/msg/Odometry",
            other => panic!("what does {other} show?"),
        };
        let topic = &display["Topic"];
        let name = topic["Value"].as_str().unwrap();
        let documented = find(&topics, name, Some(type_name));
        if documented.latched {
            assert_eq!(topic["Durability Policy"], "Transient Local", "{name}");
        }
        shown.insert(name.to_owned());
    }
    for name in [
        "/lgvi_propagator/markers",
        "/lgvi_planner/markers",
        "/lgvi_planner/planned_path",
    ] {
        assert!(shown.contains(name), "{name} is not shown");
    }
}

#[test]
fn foxglove_shows_documented_topics_and_fields_that_they_have() {
    let text = fs::read_to_string(root().join("launch_scripts/lgvi.foxglove.json")).unwrap();
    let layout: Value = serde_json::from_str(&text).unwrap();
    let topics = topics();
    let panels = layout["configById"].as_object().unwrap();
    for (id, panel) in panels {
        match id.split('!').next().unwrap() {
            "3D" => {
                assert_eq!(panel["followTf"], "inertial");
                for name in panel["topics"].as_object().unwrap().keys() {
                    find(&topics, name, None);
                }
            }
            "Plot" => {
                for path in panel["paths"].as_array().unwrap() {
                    let (name, field) = path["value"].as_str().unwrap().split_once('.').unwrap();
                    let types = &find(&topics, name, None).types;
                    assert!(has_field(&types[0], field), "{name} has no {field}");
                }
            }
            "RawMessages" => {
                find(&topics, panel["topicPath"].as_str().unwrap(), None);
            }
            "DiagnosticSummary" => {
                let name = panel["topicToRender"].as_str().unwrap();
                find(&topics, name, Some("diagnostic_msgs/msg/DiagnosticArray"));
            }
            "RosOut" => {
                let name = panel["topicToRender"].as_str().unwrap();
                find(&topics, name, Some("rcl_interfaces/msg/Log"));
            }
            other => panic!("what does {other} show?"),
        }
    }

    let mut placed = BTreeSet::new();
    place(&layout["layout"], &mut placed);
    assert_eq!(
        placed,
        panels.keys().cloned().collect(),
        "panels in the layout"
    );
}

/// What layouts show of a flight is in its bag; diagnostics and the log are of running nodes.
#[test]
fn a_recorded_flight_has_what_the_layouts_show() {
    let recording = Recording::read(&reference_bag("inclination_change"));
    let recorded = recording.counts();
    for layout in ["lgvi.rviz", "lgvi.foxglove.json"] {
        let text = fs::read_to_string(root().join("launch_scripts").join(layout)).unwrap();
        let names = text.split(['"', ' ', '\n', ',']);
        let names = names.filter(|name| name.starts_with("/lgvi_") || *name == "/tf");
        let topics: BTreeSet<_> = names.map(|name| name.split('.').next().unwrap()).collect();
        assert!(topics.len() >= 4, "{layout}: {topics:?}");
        for topic in topics {
            assert!(
                recorded.contains_key(topic),
                "{layout}: {topic} is not in the bag"
            );
        }
    }
}

/// The panels in a part of the layout.
fn place(part: &Value, placed: &mut BTreeSet<String>) {
    match part.as_str() {
        Some(id) => {
            placed.insert(id.into());
        }
        None => ["first", "second"]
            .iter()
            .for_each(|half| place(&part[half], placed)),
    }
}
