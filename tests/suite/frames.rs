//! What stays as it is reaches those who come late: static transforms and markers.

use lgvi_middleware::ros::Qos;
use lgvi_msgs::RosMessage;
use lgvi_msgs::geometry_msgs::Transform;
use lgvi_msgs::tf2_msgs::TFMessage;
use lgvi_msgs::visualization_msgs::MarkerArray;
use lgvi_tests::{Process, Recording, World, eventually, scene};

/// Starts the propagator of a scene and waits until it has flown.
fn flown(world: &World, name: &str) -> Process {
    let scene = format!("scene:={}", scene(name).display());
    let parameters = [&scene, "real_time_factor:=0.0", "await_control:=false"];
    let propagator = world.node("propagator", &parameters);
    propagator.await_flown();
    propagator
}

/// The only message on a topic, as one who comes now is given it.
fn late<M: RosMessage + Send + Sync + 'static>(world: &World, topic: &str) -> M {
    let observer = world.ros_node("latecomer");
    let subscription = observer
        .subscription::<M>(topic, &Qos::latched(10))
        .unwrap();
    eventually(&format!("a message on {topic}"), || {
        Some(subscription.take().unwrap()?.message)
    })
}

/// Translation and quaternion `(w, x, y, z)`.
type Placed = ([f64; 3], [f64; 4]);

fn placed(transform: &Transform) -> Placed {
    let (p, q) = (&transform.translation, &transform.rotation);
    ([p.x, p.y, p.z], [q.w, q.x, q.y, q.z])
}

/// Hamilton's product.
fn product([a, b, c, d]: [f64; 4], [e, f, g, h]: [f64; 4]) -> [f64; 4] {
    [
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    ]
}

fn rotated(q: [f64; 4], [x, y, z]: [f64; 3]) -> [f64; 3] {
    let [w, i, j, k] = q;
    let [_, x, y, z] = product(product(q, [0.0, x, y, z]), [w, -i, -j, -k]);
    [x, y, z]
}

/// The second, which is given in the first.
fn composed(first: Placed, second: Placed) -> Placed {
    let arm = rotated(first.1, second.0);
    let position = std::array::from_fn(|axis| first.0[axis] + arm[axis]);
    (position, product(first.1, second.1))
}

#[track_caller]
fn assert_near<const N: usize>(found: [f64; N], expected: [f64; N], within: f64) {
    let near = found
        .iter()
        .zip(expected)
        .all(|(a, b)| (a - b).abs() <= within);
    assert!(near, "{found:?}, expected {expected:?}");
}

fn child<'a>(message: &'a TFMessage, name: &str) -> &'a Transform {
    let mut transforms = message.transforms.iter();
    let found = transforms.find(|transform| transform.child_frame_id == name);
    &found.unwrap().transform
}

/// When the chaser has docked, its probe is in the port and looks the other way, and its camera sees the port.
#[test]
fn the_transforms_of_a_flight_compose_to_its_geometry() {
    let world = World::new();
    let (summary, bag) = world.fly(&scene("docking_corridor"), "flight");
    let mut published = summary.published;
    published.retain(|_, count| *count > 0);
    assert_eq!(published, summary.recorded);
    let flight = Recording::read(&bag);
    let fixed = flight.messages::<TFMessage>("/tf_static");
    assert_eq!(fixed.len(), 1);
    let moving = flight.messages::<TFMessage>("/tf").pop().unwrap();
    let [port, probe, camera] =
        ["port", "probe", "camera"].map(|name| placed(child(&fixed[0], name)));
    let probe = composed(placed(child(&moving, "chaser")), probe);
    assert_near(probe.0, [1.2, 0.0, 0.0], 1e-9);
    assert_near(probe.0, port.0, 1e-9);
    assert_near(rotated(probe.1, [1.0, 0.0, 0.0]), [1.0, 0.0, 0.0], 1e-12);
    assert_near(rotated(port.1, [1.0, 0.0, 0.0]), [-1.0, 0.0, 0.0], 1e-12);
    let camera = composed(probe, camera);
    assert_near(camera.0, [0.9, 0.0, 0.4], 1e-9);
    // An image's right, down and depth (REP 103).
    for (axis, expected) in [
        ([1.0, 0.0, 0.0], [0.0, -1.0, 0.0]),
        ([0.0, 1.0, 0.0], [0.0, 0.0, -1.0]),
        ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]),
    ] {
        assert_near(rotated(camera.1, axis), expected, 1e-12);
    }
    let epoch = &fixed[0].transforms[0].header.stamp;
    assert_eq!((epoch.sec, epoch.nanosec), (946_728_000, 0));

    // The plan's markers end at the target, in the corridor.
    let plan = flight.messages::<MarkerArray>("/lgvi_planner/markers");
    assert_eq!(plan.len(), 1);
    let markers = &plan[0].markers;
    let path = markers.iter().find(|marker| marker.ns == "path").unwrap();
    let last = path.points.last().unwrap();
    assert_near([last.x, last.y, last.z], [0.0; 3], 1e-9);
    let corridor = markers
        .iter()
        .find(|marker| marker.ns == "corridor")
        .unwrap();
    let apex = &corridor.points[0];
    assert_near([apex.x, apex.y, apex.z], [0.5, 0.0, 0.0], 0.0);
    let arrows = markers.iter().filter(|marker| marker.ns == "thrust");
    assert!((10..=40).contains(&arrows.count()));
}

#[test]
fn latecomers_of_every_make_are_given_transforms_and_markers() {
    let world = World::new();
    let propagator = flown(&world, "asteroid_orbiter");
    let ours: TFMessage = late(&world, "/tf_static");
    let parents: Vec<_> = ours
        .transforms
        .iter()
        .map(|placed| {
            (
                placed.child_frame_id.as_str(),
                placed.header.frame_id.as_str(),
            )
        })
        .collect();
    assert_eq!(
        parents,
        [("landing_site", "asteroid"), ("camera", "spacecraft")]
    );
    let stranger = world.python(
        "cyclone_peer.py",
        &["--tf", "/tf_static", "--qos", "latched"],
    );
    let theirs = stranger.finish().expect(0).stdout;
    assert_eq!(serde_json::from_str::<TFMessage>(&theirs).unwrap(), ours);

    let markers = late::<MarkerArray>(&world, "/lgvi_propagator/markers").markers;
    let [asteroid, spacecraft] = &markers[..] else {
        panic!("{markers:?}")
    };
    assert_eq!(asteroid.header.frame_id, "asteroid");
    assert_eq!(asteroid.points.len(), 3 * 20 * 16);
    let longest = asteroid.points.iter().map(|p| p.x).fold(0.0, f64::max);
    assert!((longest - 267.5).abs() < 1e-6, "{longest}");
    assert_eq!(spacecraft.header.frame_id, "spacecraft");
    assert_eq!(spacecraft.points.len(), 2);
    propagator.stop().expect(0);
}

#[test]
fn a_scene_without_frames_has_no_static_transforms() {
    let world = World::new();
    let propagator = flown(&world, "free_body");
    let markers: MarkerArray = late(&world, "/lgvi_propagator/markers");
    assert_eq!(markers.markers.len(), 1);
    let topics = world.ros_node("observer").topics();
    assert!(topics.iter().all(|topic| topic.name != "/tf_static"));
    propagator.stop().expect(0);
}
