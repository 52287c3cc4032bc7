//! What the flight's recorder is told to record.

use std::path::Path;

use lgvi_scene::Scene;

use crate::parameters::{list, path, text};

/// The topics that are recorded from DDS, with their types. Full-rate states come from shared memory.
pub(super) fn topics(scene: &Scene, planned: bool) -> Vec<(String, &'static str)> {
    // Before those that the flight waits for.
    let actuators = scene.bodies.iter().flat_map(|body| {
        let (joints, inertia) = (
            "sensor_msgs/msg/JointState",
            "geometry_msgs/msg/InertiaStamped",
        );
        [
            ("joint_states", joints, !body.wheels.is_empty()),
            ("thruster_states", joints, !body.thrusters.is_empty()),
            ("inertia", inertia, body.has_propellant()),
        ]
        .into_iter()
        .filter(|(.., has)| *has)
        .map(|(name, kind, _)| (format!("/lgvi_propagator/{name}/{}", body.name), kind))
    });
    let sensors = scene.sensors.iter().map(|sensor| {
        let (kind, body) = (sensor.kind.name(), &scene.bodies[sensor.body].name);
        let topic = format!("/lgvi_propagator/{kind}/{body}/{}", sensor.name);
        (topic, sensor.kind.message_type())
    });
    let mut topics: Vec<_> = actuators.chain(sensors).collect();
    topics.extend([
        ("/lgvi_propagator/scene".into(), "lgvi_msgs/msg/Scene"),
        (
            "/lgvi_propagator/flown_control".into(),
            "lgvi_msgs/msg/ControlSequence",
        ),
        (
            "/lgvi_propagator/intervention".into(),
            "lgvi_msgs/msg/Intervention",
        ),
        (
            "/lgvi_propagator/invariants".into(),
            "lgvi_msgs/msg/Invariants",
        ),
        ("/tf".into(), "tf2_msgs/msg/TFMessage"),
        (
            "/lgvi_propagator/markers".into(),
            "visualization_msgs/msg/MarkerArray",
        ),
    ]);
    if !scene.frames.is_empty() {
        topics.push(("/tf_static".into(), "tf2_msgs/msg/TFMessage"));
    }
    for body in &scene.bodies {
        topics.push((
            format!("/lgvi_propagator/odometry/{}", body.name),
            "nav_msgs/msg/Odometry",
        ));
    }
    if planned {
        topics.extend([
            (
                "/lgvi_planner/control_sequence".into(),
                "lgvi_msgs/msg/ControlSequence",
            ),
            (
                "/lgvi_planner/progress".into(),
                "lgvi_msgs/msg/PlanProgress",
            ),
            ("/lgvi_planner/planned_path".into(), "nav_msgs/msg/Path"),
            (
                "/lgvi_planner/markers".into(),
                "visualization_msgs/msg/MarkerArray",
            ),
        ]);
    }
    topics
}

/// The recorder's parameters.
pub(super) fn recorder(scene: &Scene, bag: &Path, topics: &[(String, &str)]) -> Vec<String> {
    let topics: Vec<String> = topics
        .iter()
        .map(|(name, kind)| format!("{name}={kind}"))
        .collect();
    let parameters = [
        list("topics", &topics),
        text("frame", Some(&scene.frame)),
        text("log_time", Some("stamp")),
    ];
    // Plans may take long before the first state, and two flights are to give the same bag.
    let always = ["await_stamp:=true".to_owned()];
    std::iter::once(format!("output:={}", path(bag)))
        .chain(always)
        .chain(parameters.into_iter().flatten())
        .collect()
}
