//! Nodes have the topics, services and actions of docs/interfaces.md, and no others, as real ROS 2 sees them.

use std::collections::BTreeMap;
use std::fs;

use lgvi_tests::{
    Process, Recording, Row, World, codes, documented, edited, eventually, root, scene,
};

use crate::real_ros::{Graph, Names};

const LOGGERS: &str = "enable_logger_service:=true";

/// Names, in which `<body>` and `<sensor>` stand for any one part, and their types, of which some have a package only.
type Documented = BTreeMap<String, String>;

/// What the page says that a node has.
struct Page {
    publishers: Documented,
    subscriptions: Documented,
    services: Documented,
}

impl Page {
    /// What is said of a node, `propagator` for example, and of all of them.
    fn of(node: &str) -> Self {
        let rows = |section| {
            let rows = documented(section).into_iter();
            rows.filter(|row| [node, "all"].contains(&&*row.node))
        };
        let full = |name: &str| name.replace("~/", &format!("/lgvi_{node}/"));
        let mut page = Self {
            publishers: Documented::new(),
            subscriptions: Documented::new(),
            services: Documented::new(),
        };
        for Row { cells, .. } in rows("Topics") {
            let types = codes(&cells[1]);
            let (Some(name), Some(kind)) = (
                codes(&cells[0]).into_iter().next(),
                types.into_iter().find(|kind| kind.contains("/msg/")),
            ) else {
                continue;
            };
            let topics = if cells[0].starts_with("subscribes") {
                &mut page.subscriptions
            } else {
                &mut page.publishers
            };
            topics.insert(full(&name), kind);
        }
        for Row { cells, .. } in rows("Services") {
            let kind = codes(&cells[1]).remove(0);
            let names = codes(&cells[0]).into_iter();
            page.services
                .extend(names.map(|name| (full(&name), kind.clone())));
        }
        for Row { cells, .. } in rows("Actions") {
            page.act(&full(&codes(&cells[0])[0]), &codes(&cells[1])[0]);
        }
        page
    }

    /// Adds what ROS makes an action of.
    fn act(&mut self, action: &str, kind: &str) {
        let part = |name: &str| format!("{action}/_action/{name}");
        let status = "action_msgs/msg/GoalStatusArray";
        self.publishers.extend([
            (part("feedback"), format!("{kind}_FeedbackMessage")),
            (part("status"), status.into()),
        ]);
        self.services.extend([
            (part("send_goal"), format!("{kind}_SendGoal")),
            (part("get_result"), format!("{kind}_GetResult")),
            (part("cancel_goal"), "action_msgs/srv/CancelGoal".into()),
        ]);
    }

    /// Without what a node has only if a parameter asks for it: the subscription to `/clock` and the services of loggers.
    fn by_default(mut self) -> Self {
        self.subscriptions.remove("/clock").unwrap();
        self.services
            .retain(|name, _| !name.contains("logger_levels"));
        self
    }

    /// The node runs, and has what is documented.
    #[track_caller]
    fn is_of(&self, world: &World, node: &Process, name: &str) {
        node.await_ready();
        let graph = Graph::of(world, name, &self.publishers.len().to_string());
        for (kind, found, documented) in [
            ("published", &graph.publishers, &self.publishers),
            ("subscribed to", &graph.subscriptions, &self.subscriptions),
            ("served", &graph.services, &self.services),
        ] {
            compare(kind, found, documented);
        }
        has_each_once(world, name, &graph);
    }
}

/// None of a node's own topics has two endpoints of it.
#[track_caller]
fn has_each_once(world: &World, node: &str, graph: &Graph) {
    let observer = world.ros_node("observer");
    let own = format!("{node}/");
    let topics = eventually(&format!("the topics of {node}"), || {
        let topics = observer.topics();
        let publishers = graph.publishers.keys().map(|name| (name, true));
        let subscriptions = graph.subscriptions.keys().map(|name| (name, false));
        let mut endpoints = publishers.chain(subscriptions);
        let all = endpoints.all(|(name, publishes)| {
            topics.iter().any(|topic| {
                let count = if publishes {
                    topic.publishers
                } else {
                    topic.subscriptions
                };
                topic.name == *name && count > 0
            })
        });
        all.then_some(topics)
    });
    for topic in topics.iter().filter(|topic| topic.name.starts_with(&own)) {
        assert!(
            topic.publishers + topic.subscriptions <= 1,
            "{node} has {topic:?}"
        );
    }
}

#[track_caller]
fn compare(kind: &str, found: &Names, documented: &Documented) {
    let undocumented: Vec<_> = found
        .iter()
        .filter(|(name, [found])| {
            !documented
                .iter()
                .any(|(known, kind)| is_called(name, known) && is_typed(found, kind))
        })
        .collect();
    let missing: Vec<_> = documented
        .keys()
        .filter(|known| !found.keys().any(|name| is_called(name, known)))
        .collect();
    assert!(
        undocumented.is_empty() && missing.is_empty(),
        "{kind}, but not in docs/interfaces.md: {undocumented:?}; in it, but not {kind}: {missing:?}"
    );
}

fn is_called(name: &str, documented: &str) -> bool {
    let [parts, known] = [name, documented].map(|name| name.split('/').collect::<Vec<_>>());
    let fits =
        |(part, known): (&&str, &&str)| part == known || known.starts_with('<') && !part.is_empty();
    parts.len() == known.len() && parts.iter().zip(&known).all(fits)
}

fn is_typed(kind: &str, documented: &str) -> bool {
    match kind.strip_prefix(documented) {
        Some("") => true,
        Some(rest) => !documented.contains('/') && rest.starts_with("/srv/"),
        None => false,
    }
}

#[test]
fn the_propagator_has_what_is_documented() {
    let world = World::new();
    let scene = edited(&world, "tumbling_target", &[]);
    let of = |kind: &str, keys: &str| {
        format!(
            "[[bodies.sensors]]\nname = \"a_{kind}\"\nkind = \"{kind}\"\nperiod = 1.0\n{keys}\n"
        )
    };
    let sensors = of("imu", "") + &of("star_tracker", "") + &of("gnss", "");
    let sensors = sensors + &of("relative_pose", "target = \"satellite\"");
    // They belong to the last body, the chaser.
    let text = fs::read_to_string(&scene).unwrap() + &sensors;
    let wheel = "[[bodies.wheels]]\nname = \"wheel\"\naxis = [0, 0, 1]\ninertia = 1e-3\n";
    let thruster = "propellant = { mass = 0.1 }\n[[bodies.thrusters]]\nname = \"main\"\nposition = [0, 0, 0]\n\
        direction = [1, 0, 0]\nthrust = 1.0\n";
    let chaser = "[[bodies]]\nname = \"chaser\"";
    let text = text.replace(chaser, &format!("{thruster}{wheel}{chaser}"));
    fs::write(&scene, text).unwrap();
    let scene = format!("scene:={}", scene.display());
    let propagator = world.node("propagator", &[&scene, "clock:=true"]);
    let page = Page::of("propagator").by_default();
    page.is_of(&world, &propagator, "/lgvi_propagator");
    propagator.stop().expect(0);
}

#[test]
fn the_planner_has_what_is_documented() {
    let world = World::new();
    let scene = format!("scene:={}", scene("inclination_replan").display());
    let parameters = [
        &scene,
        "plan_at_start:=false",
        "use_sim_time:=true",
        LOGGERS,
    ];
    let planner = world.node("planner", &parameters);
    Page::of("planner").is_of(&world, &planner, "/lgvi_planner");
    planner.stop().expect(0);
}

#[test]
fn the_recorder_has_what_is_documented_and_the_topics_that_it_is_to_record() {
    let world = World::new();
    let topics = "topics:=[/tf=tf2_msgs/msg/TFMessage]";
    let output = format!("output:={}", world.path("bag").display());
    let recorder = world.node(
        "recorder",
        &[&output, topics, "use_sim_time:=true", LOGGERS],
    );
    let mut page = Page::of("recorder");
    let recorded = ("/tf".into(), "tf2_msgs/msg/TFMessage".into());
    page.subscriptions.extend([recorded]);
    page.is_of(&world, &recorder, "/lgvi_recorder");
    recorder.stop().expect(0);
}

#[test]
fn the_player_has_what_is_documented_and_the_topics_of_its_bag() {
    let world = World::new();
    let bag = root().join("bags/inclination_change");
    let given = format!("bag:={}", bag.display());
    let parameters = [&given, "clock:=true", "await_subscribers:=1"];
    let player = world.node("player", &parameters);
    let mut page = Page::of("player").by_default();
    let played = Recording::read(&bag).topics.into_iter();
    page.publishers
        .extend(played.map(|topic| (topic.name, topic.type_name)));
    page.is_of(&world, &player, "/lgvi_player");
    player.stop().expect(0);
}
