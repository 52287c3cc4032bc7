use std::collections::BTreeSet;

use lgvi_control::{Certificate, Plan, Sweep};
use lgvi_msgs::geometry_msgs::Point;
use lgvi_msgs::visualization_msgs::Marker;
use nalgebra::{Matrix3, Vector3};

use super::*;

/// A plan of four steps in a scene's units of 10 m, from (1, 0, 0) to (1, 4, 0), turning by a right angle about z.
const SCENE: &str = r#"
    title = "Shown"
    [units]
    length = "10 m"
    [run]
    duration = 4.0
    steps = 4
    integrator = "lgvi"
    [publish]
    ros_every = 3
    [gravity.central]
    gm = 1.0
    position = [0, 0, 7]
    [[bodies]]
    name = "craft"
    mass = 2.0
    inertia = [0.01, 0.01, 0.01]
    position = [1, 0, 0]
    velocity = [0, 1, 0]
    attitude = { w = 1, x = 0, y = 0, z = 0 }
    angular_velocity = [0, 0, 0]
    [maneuver]
    body = "craft"
"#;

fn shown(keys: &str) -> Vec<Marker> {
    let scene = Scene::parse("test", &format!("{SCENE}{keys}")).unwrap();
    let quarter = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let state = |k: usize| BodyState {
        position: Vector3::new(1.0, k as f64, 0.0),
        attitude: if k < 4 { Matrix3::identity() } else { quarter },
        ..scene.bodies[0].state
    };
    let force = |x| Load {
        force: Vector3::new(x, 0.0, 0.0),
        moment: Vector3::zeros(),
    };
    let plan = Plan {
        h: 1.0,
        states: (0..=4).map(state).collect(),
        commands: Vec::new(),
        controls: [4.0, 1.0, 0.001, -2.0].map(force).into(),
        multipliers: Vec::new(),
        feedback: Vec::new(),
        actuator_feedback: Vec::new(),
        cost: 0.0,
        paid: 0.0,
        certificate: Certificate::default(),
        sweep: Sweep::default(),
    };
    let sequence = Sequence::new(scene.maneuver.as_ref().unwrap(), 0, plan);
    markers(&scene, &sequence).unwrap().markers
}

fn of<'a>(markers: &'a [Marker], ns: &str) -> Vec<&'a Marker> {
    markers.iter().filter(|marker| marker.ns == ns).collect()
}

fn points(marker: &Marker) -> Vec<Vector3<f64>> {
    let vector = |p: &Point| Vector3::new(p.x, p.y, p.z);
    marker.points.iter().map(vector).collect()
}

const STATE: &str = "[maneuver.target]\nposition = [1, 4, 0]\nvelocity = [0, 0, 0]\n\
    attitude = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]\nangular_velocity = [0, 0, 0]\n";

#[test]
fn a_newer_plan_takes_the_place_of_the_old_one() {
    let markers = shown(STATE);
    assert_eq!(markers[0].action, Marker::DELETEALL);
    assert_eq!(markers[0].ns, "");
    let mut names = BTreeSet::new();
    for marker in &markers[1..] {
        assert_eq!(marker.action, Marker::ADD);
        assert_eq!(marker.header.frame_id, "inertial");
        assert_eq!(marker.header.stamp.sec, 946_728_000);
        assert!(names.insert((marker.ns.clone(), marker.id)), "{marker:?}");
        assert!(marker.scale.x > 0.0 && marker.color.a > 0.0, "{marker:?}");
    }
}

#[test]
fn the_path_is_in_si_with_the_arrival_and_arrows_push_along_the_force() {
    let markers = shown(STATE);
    // Steps 0 and 3, and the last.
    let path = of(&markers, "path");
    assert_eq!(path[0].r#type, Marker::LINE_STRIP);
    let y: Vec<_> = path[0].points.iter().map(|p| (p.x, p.y)).collect();
    assert_eq!(y, [(10.0, 0.0), (10.0, 30.0), (10.0, 40.0)]);

    // The longest is 0.15 of the path's 40 m; what is too weak to be seen has none.
    let arrows = of(&markers, "thrust");
    let expected = [(0, 0.0, 6.0), (1, 10.0, 1.5), (3, 30.0, -3.0)];
    assert_eq!(arrows.len(), expected.len());
    for (arrow, (id, from, along)) in arrows.into_iter().zip(expected) {
        assert_eq!((arrow.r#type, arrow.id), (Marker::ARROW, id));
        let ends = points(arrow);
        let push = ends[1] - ends[0];
        assert_eq!(ends[0], Vector3::new(10.0, from, 0.0));
        assert!(
            (push - Vector3::new(along, 0.0, 0.0)).norm() < 1e-12,
            "{push}"
        );
    }

    // Of the target's body x is the inertial y, y the inertial −x.
    let target = of(&markers, "target")[0];
    assert_eq!(target.r#type, Marker::LINE_LIST);
    let ends = points(target);
    let axes: Vec<_> = ends.chunks(2).map(|end| (end[1] - end[0]) / 4.0).collect();
    let expected = [Vector3::y(), -Vector3::x(), Vector3::z()];
    for ((axis, expected), end) in axes.iter().zip(expected).zip(ends.chunks(2)) {
        assert!((axis - expected).norm() < 1e-12, "{axes:?}");
        assert_eq!(end[0], Vector3::new(10.0, 40.0, 0.0));
    }
    let [x, y, z] = [0, 2, 4].map(|end| &target.colors[end]);
    assert_eq!((x.r, y.g, z.b), (1.0, 1.0, 1.0));
}

/// `r = 1`, `v = 1.2` across at the pericenter: `a = 1/(2 − v²)`, and from each point of an ellipse the ways to its two foci
/// add up to `2a`.
#[test]
fn a_goal_orbit_is_the_ellipse_about_the_attractor() {
    let markers =
        shown("[maneuver.target]\norbit = { position = [1, 0, 7], velocity = [0, 1.2, 0] }\n");
    let orbit = points(of(&markers, "goal_orbit")[0]);
    let a = 10.0 / (2.0 - 1.44);
    let focus = Vector3::new(0.0, 0.0, 70.0);
    let other = focus - Vector3::x() * 2.0 * (a - 10.0);
    for p in &orbit {
        let sum = (p - focus).norm() + (p - other).norm();
        assert!((sum - 2.0 * a).abs() < 1e-12 * a, "{p}: {sum}");
        assert_eq!(p.z, 70.0);
    }
    assert_eq!(orbit[0], Vector3::new(10.0, 0.0, 70.0));
    assert_eq!(orbit.first(), orbit.last());
    let far = orbit.iter().map(|p| p.x).fold(0.0, f64::min);
    assert!((far - (10.0 - 2.0 * a)).abs() < 1e-12 * a, "{far}");
}

#[test]
fn constraints_are_drawn_where_they_hold() {
    let constraints = "constraints = [\
        { kind = \"keep_out_sphere\", center = [1, 2, 3], radius = 0.5 }, \
        { kind = \"corridor\", apex = [1, 5, 0], axis = [0, -1, 0], half_angle = 0.5 }, \
        { kind = \"keep_out_cone\", axis = [1, 0, 0], direction = [0, 0, -2], half_angle = 2.0 }, \
        { kind = \"force_norm\", limit = 9.0 }]\n";
    let markers = shown(&format!("{constraints}{STATE}"));
    let keep_out = of(&markers, "keep_out");
    assert_eq!(keep_out.len(), 2);
    assert_eq!((keep_out[0].r#type, keep_out[0].id), (Marker::SPHERE, 0));
    let Point { x, y, z } = keep_out[0].pose.position;
    assert_eq!([x, y, z], [10.0, 20.0, 30.0]);
    assert_eq!(keep_out[0].scale.x, 10.0);
    assert_eq!(keep_out[0].pose.orientation.w, 1.0);

    // Corners: the apex, then two on the rim, at the half-angle and as far as the path is.
    let corridor = of(&markers, "corridor")[0];
    let cone = keep_out[1];
    for (cone, apex, axis, half_angle, side) in [
        (corridor, [10.0, 50.0, 0.0], [0.0, -1.0, 0.0], 0.5, 50.0),
        (cone, [10.0, 0.0, 0.0], [0.0, 0.0, -1.0], 2.0, 20.0),
    ] {
        assert_eq!(cone.r#type, Marker::TRIANGLE_LIST);
        assert_eq!(cone.scale.x, 1.0);
        let (apex, axis) = (Vector3::from(apex), Vector3::from(axis));
        let corners = points(cone);
        assert_eq!(corners.len() % 3, 0);
        for triangle in corners.chunks(3) {
            assert_eq!(triangle[0], apex);
            for rim in &triangle[1..] {
                let along = rim - apex;
                assert!((along.norm() - side).abs() < 1e-12 * side);
                assert!((along.angle(&axis) - half_angle).abs() < 1e-12);
            }
        }
        // It goes all the way round.
        let around: Vector3<f64> = corners.chunks(3).map(|corner| corner[1] - apex).sum();
        assert!(around.cross(&axis).norm() < 1e-9 * side);
    }
    // The kept axis ends a quarter of a turn from where it began.
    let axis = points(of(&markers, "kept_axis")[0]);
    assert_eq!(axis.first(), Some(&Vector3::new(30.0, 0.0, 0.0)));
    assert_eq!(axis.last(), Some(&Vector3::new(10.0, 20.0, 0.0)));
}

/// Cones of the body's axes as it arrives at (1, 4, 0), turned by a quarter about z.
#[test]
fn what_the_body_sees_and_blows_at_is_drawn_where_it_arrives() {
    let constraints = "constraints = [\
        { kind = \"keep_out_ellipsoid\", center = [1, 2, 3], semi_axes = [1, 2, 3], attitude = [[0, -1, 0], [1, 0, 0], [0, 0, 1]] }, \
        { kind = \"angular_rate\", limit = 9.0 }, \
        { kind = \"speed\", limit = 9.0, price = 1.0 }, \
        { kind = \"line_of_sight\", axis = [2, 0, 0], point = [1, 9, 0], half_angle = 0.5 }, \
        { kind = \"plume\", axis = [0, 0, 1], point = [9, 9, 9], half_angle = 0.25, distance = 2.0 }]\n";
    let markers = shown(&format!("{constraints}{STATE}"));
    let ellipsoid = of(&markers, "keep_out")[0];
    assert_eq!((ellipsoid.r#type, ellipsoid.id), (Marker::SPHERE, 0));
    let Point { x, y, z } = ellipsoid.pose.position;
    assert_eq!([x, y, z], [10.0, 20.0, 30.0]);
    let scale = &ellipsoid.scale;
    assert_eq!([scale.x, scale.y, scale.z], [20.0, 40.0, 60.0]);
    let turn = &ellipsoid.pose.orientation;
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for (found, expected) in [(turn.w, half), (turn.x, 0.0), (turn.y, 0.0), (turn.z, half)] {
        assert!((found - expected).abs() < 1e-15, "{turn:?}");
    }
    for (name, id, axis, half_angle, side) in [
        ("line_of_sight", 3, Vector3::y(), 0.5, 50.0),
        ("plume", 4, Vector3::z(), 0.25, 20.0),
    ] {
        let cone = of(&markers, name)[0];
        assert_eq!((cone.r#type, cone.id), (Marker::TRIANGLE_LIST, id));
        for triangle in points(cone).chunks(3) {
            assert_eq!(triangle[0], Vector3::new(10.0, 40.0, 0.0));
            for rim in &triangle[1..] {
                let along = rim - triangle[0];
                assert!((along.norm() - side).abs() < 1e-12 * side, "{name}");
                assert!((along.angle(&axis) - half_angle).abs() < 1e-12, "{name}");
            }
        }
    }
}

#[test]
fn a_plan_that_stays_in_place_has_no_path() {
    let text = include_str!("../../../../scenes/slew_keep_out.toml");
    let scene = Scene::parse("slew_keep_out", text).unwrap();
    let plan = Plan {
        h: scene.h(),
        states: vec![scene.bodies[0].state; 3],
        commands: Vec::new(),
        controls: vec![Load::default(); 2],
        multipliers: Vec::new(),
        feedback: Vec::new(),
        actuator_feedback: Vec::new(),
        cost: 0.0,
        paid: 0.0,
        certificate: Certificate::default(),
        sweep: Sweep::default(),
    };
    let sequence = Sequence::new(scene.maneuver.as_ref().unwrap(), 0, plan);
    let markers = markers(&scene, &sequence).unwrap().markers;
    let drawn: Vec<_> = markers[1..]
        .iter()
        .map(|marker| marker.ns.as_str())
        .collect();
    assert_eq!(drawn, ["target", "keep_out", "kept_axis"]);
    let finite = |p: &Vector3<f64>| p.iter().all(|c| c.is_finite());
    assert!(
        markers
            .iter()
            .all(|marker| points(marker).iter().all(finite))
    );
}

/// What moves with another body is drawn where it is at the end.
#[test]
fn constraints_relative_to_a_body_are_drawn_at_the_arrival() {
    let constraints = "constraints = [{ kind = \"keep_out_sphere\", relative_to = { body = \"post\", axes = \"inertial\" }, \
        center = [1, 2, 3], radius = 0.5 }]\n";
    let post = "[[bodies]]\nname = \"post\"\nmass = 1.0\ninertia = [1, 1, 1]\nposition = [0, 0, 0]\n\
        attitude = { w = 1, x = 0, y = 0, z = 0 }\nmobility = { uniform = { velocity = [0, 0, 1] } }\n";
    let markers = shown(&format!("{constraints}{STATE}{post}"));
    let Point { x, y, z } = of(&markers, "keep_out")[0].pose.position;
    assert!((Vector3::new(x, y, z) - Vector3::new(10.0, 20.0, 70.0)).norm() < 1e-12);
}
