//! What the pictures of the shipped scenes show.

use lgvi_dynamics::Load;
use nalgebra::Vector3;

use super::canvas::{Stroke, text_width};
use super::data::FlightData;
use super::series::{Panel, panels, plain};
use super::subject::Subject;
use super::{kept, page, style, subject};

/// A scene: its name, its text, and the body that is pushed or turned a little, if one is controlled.
struct Shipped(&'static str, &'static str, Option<(usize, Load)>);

macro_rules! scene {
    ($name:literal, $load:expr) => {
        Shipped(
            $name,
            include_str!(concat!("../../../../scenes/", $name, ".toml")),
            $load,
        )
    };
}

const PUSH: Load = Load {
    force: Vector3::new(0.3, 0.2, 0.1),
    moment: Vector3::new(0.0, 0.0, 0.0),
};

const TURN: Load = Load {
    force: Vector3::new(0.0, 0.0, 0.0),
    moment: Vector3::new(0.02, -0.01, 0.4),
};

const SHIPPED: [Shipped; 31] = [
    scene!("asteroid_orbiter", None),
    scene!("binary_asteroid", None),
    scene!("dispersed_capture", Some((0, PUSH))),
    scene!("docking", None),
    scene!("docking_corridor", Some((0, PUSH))),
    scene!("earth_mars", None),
    scene!("formation_change", Some((1, PUSH))),
    scene!("free_body", None),
    scene!("goddard", None),
    scene!("inclination_change", Some((0, PUSH))),
    scene!("inclination_replan", Some((0, PUSH))),
    scene!("inspection", Some((1, PUSH))),
    scene!("low_orbit_approach", Some((1, PUSH))),
    scene!("minimum_fuel", None),
    scene!("minimum_time_slew", Some((0, TURN))),
    scene!("oblate_orbit", None),
    scene!("orbital_capture", Some((0, PUSH))),
    scene!("pendulum", None),
    scene!("phased_docking", Some((1, PUSH))),
    scene!("propellant_transfer", None),
    scene!("relative_orbit", None),
    scene!("rocks", None),
    scene!("slew_keep_out", Some((0, TURN))),
    scene!("thruster_approach", None),
    scene!("thruster_rendezvous", None),
    scene!("tumbling_replan", Some((1, PUSH))),
    scene!("tumbling_target", Some((1, PUSH))),
    scene!("two_dumbbells", None),
    scene!("uncertain_flyaround", Some((1, PUSH))),
    scene!("wheel_slew", None),
    scene!("wheel_slew_plan", None),
];

impl Shipped {
    fn named(name: &str) -> Self {
        let mut all = SHIPPED.into_iter();
        all.find(|shipped| shipped.0 == name).unwrap()
    }

    /// Its first steps.
    fn flown(&self) -> FlightData {
        let Self(name, text, load) = self;
        let steps = if *name == "rocks" { 10 } else { 60 };
        FlightData::flown(text, steps, *load)
    }
}

fn flights() -> impl Iterator<Item = (&'static str, FlightData)> {
    SHIPPED.iter().map(|shipped| (shipped.0, shipped.flown()))
}

fn flight(name: &str) -> FlightData {
    Shipped::named(name).flown()
}

fn shown(flight: &FlightData) -> Vec<Panel> {
    panels(flight, Subject::of(flight))
}

/// A corridor that turns with a satellite is where the satellite was, not where it was expected.
#[test]
fn constraints_are_where_other_bodies_were() {
    let text = include_str!("../../../../scenes/tumbling_replan.toml");
    let flight = FlightData::flown(text, 240, None);
    let expected = lgvi_scene::Scene::parse("test", text).unwrap();
    let [shown, expected] = [&flight.scene, &expected].map(|scene| {
        let corridor = &scene.maneuver.as_ref().unwrap().constraints[0];
        let moving: &lgvi_control::constraint::Moving = corridor.downcast_ref().unwrap();
        moving.pose(240.0).rotation
    });
    let satellite = flight.last().bodies[0].attitude;
    assert!((shown - satellite).norm() < 1e-12);
    assert!((shown - expected).norm() > 0.1);
}

#[test]
fn panels_are_those_of_what_happens() {
    let titles = |name| -> Vec<_> {
        let panels = shown(&flight(name));
        panels.into_iter().map(|panel| panel.title).collect()
    };
    assert_eq!(
        titles("free_body"),
        [
            "Attitude quaternion",
            "Body rates, body axes",
            "Energy error (E − E₀)/|E₀|",
            "Angular momentum error |L − L₀|/|L₀|",
        ]
    );
    assert_eq!(
        titles("slew_keep_out"),
        [
            "Control moment, body axes",
            "Angle from the axis of the keep-out cone",
            "Attitude quaternion",
            "Body rates, body axes",
        ]
    );
    assert_eq!(
        titles("docking_corridor"),
        [
            "Control force, inertial axes",
            "Angle from the axis of the corridor",
            "Position in the frame of port",
            "Velocity in the frame of port",
        ]
    );
    assert_eq!(
        titles("asteroid_orbiter"),
        [
            "Distance from asteroid",
            "Energy, change from the start",
            "Energy change E − E₀",
            "Angular momentum change |L − L₀|",
        ]
    );
    assert_eq!(
        titles("inspection"),
        [
            "Control force, inertial axes",
            "Distance in radii of the keep-out ellipsoid",
            "Angle between the axis and the line of sight",
            "Angular rate",
            "Speed",
            "Plume: larger of relative angle and distance",
            "Angle from the axis of the keep-out cone, soft limit",
            "Distance from satellite",
        ]
    );
    let pendulum = titles("pendulum");
    assert_eq!(
        pendulum[3],
        "Angular momentum error about z, (L − L₀), relative"
    );
}

/// What is not kept has no error.
#[test]
fn an_error_is_of_what_the_flight_keeps() {
    for (name, flight) in flights() {
        let panels = shown(&flight);
        let says = |word: &str| {
            let mut titles = panels.iter().map(|panel| &panel.title);
            titles.any(|title| title.starts_with(word) && title.contains("error"))
        };
        assert_eq!(says("Energy"), kept::energy(&flight), "{name}");
        let kept = kept::momentum(&flight) != kept::Momentum::Nothing;
        assert_eq!(says("Angular momentum"), kept, "{name}");
    }
    let kept_by = |name| (kept::energy(&flight(name)), kept::momentum(&flight(name)));
    let z = kept::Momentum::Along(Vector3::z());
    assert_eq!(kept_by("binary_asteroid"), (true, kept::Momentum::All));
    assert_eq!(kept_by("oblate_orbit"), (true, z));
    assert_eq!(kept_by("pendulum"), (true, z));
    assert_eq!(
        kept_by("asteroid_orbiter"),
        (false, kept::Momentum::Nothing)
    );
    assert_eq!(
        kept_by("inclination_change"),
        (false, kept::Momentum::Nothing)
    );
}

#[test]
fn limits_are_shown_in_si() {
    let slew = shown(&flight("slew_keep_out"));
    assert_eq!(slew[0].limits, [0.5, -0.5]);
    assert!((slew[1].limits[0] - 25.0).abs() < 1e-9);
    let docking = shown(&flight("docking_corridor"));
    assert_eq!(docking[0].limits, [2.5]);
    let labels: Vec<_> = docking[0].curves.iter().map(|curve| &curve.label).collect();
    assert_eq!(labels, ["x", "y", "z", "magnitude"]);
    // At the start (−60, 12, −6) from the apex (0.5, 0, 0) along −x.
    let angle = libm::atan2(libm::hypot(12.0, 6.0), 60.5).to_degrees();
    assert!((docking[1].curves[0].points[0][1] - angle).abs() < 1e-9);
    // The port is at (1.2, 0, 0) and looks along −x.
    let first: Vec<_> = docking[2]
        .curves
        .iter()
        .map(|curve| curve.points[0][1])
        .collect();
    let expected = [61.2, -12.0, -6.0];
    assert!(
        first
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-9),
        "{first:?}"
    );
}

#[test]
fn soft_limits_are_told_in_the_title() {
    let Shipped(_, text, push) = Shipped::named("docking_corridor");
    let soft = text.replace("limit = 2.5", "limit = 2.5\nprice = 1.0");
    let titles = shown(&FlightData::flown(&soft, 3, push));
    assert_eq!(titles[0].title, "Control force, inertial axes, soft limit");
    assert_eq!(titles[1].title, "Angle from the axis of the corridor");
}

#[test]
fn regions_are_named_in_the_legend() {
    let picture = page::draw(&flight("inspection")).unwrap();
    assert!(picture.contains("keep-out ellipsoid at the end"));
    let Shipped(_, text, turn) = Shipped::named("slew_keep_out");
    let (head, rest) = text.split_once("[[maneuver.constraints]]").unwrap();
    let sight = "kind = \"line_of_sight\"\naxis = [1, 0, 0]\npoint = [9, 9, 9]\nhalf_angle = 3.0\nprice = 1.0\n";
    let text = format!("{head}[[maneuver.constraints]]\n{sight}[[maneuver.constraints]]{rest}");
    let picture = page::draw(&FlightData::flown(&text, 3, turn)).unwrap();
    assert!(picture.contains("line of sight, soft") && picture.contains("keep-out cone"));
}

#[test]
fn of_many_bodies_a_few_are_named() {
    let rocks = flight("rocks");
    let named = subject::named(&rocks);
    assert_eq!((named.len(), named[0]), (3, 0));
    let picture = page::draw(&rocks).unwrap();
    assert!(picture.contains("61 other bodies"));
    let names = rocks.scene.bodies.iter().filter(|body| {
        let text = format!(">\n{}\n<", body.name);
        picture.contains(&text)
    });
    assert_eq!(names.count(), 3);
}

/// Within the picture, by a width that is that of wide fonts.
#[test]
fn no_text_is_clipped_and_every_axis_has_a_unit() {
    for (name, flight) in flights() {
        let picture = page::draw(&flight).unwrap();
        let width = attribute(&picture, "width");
        let mut count = 0;
        for text in picture.split("<text ").skip(1) {
            let (tag, rest) = text.split_once('>').unwrap();
            let words = rest.split_once("</text>").unwrap().0.trim();
            let (x, y) = (attribute(tag, "x") / 10.0, attribute(tag, "y") / 10.0);
            let room = text_width(words, attribute(tag, "font-size") / 10.0);
            let from = match tag.contains("text-anchor=\"middle\"") {
                true => x - 0.5 * room,
                false if tag.contains("text-anchor=\"end\"") => x - room,
                false => x,
            };
            // A tenth is left for what wide fonts take more than common ones.
            assert!(
                from > -0.1 * room && from + 0.9 * room < width,
                "{name}: {words}"
            );
            assert!(
                y > 0.0 && y + 10.0 < attribute(&picture, "height"),
                "{name}: {words}"
            );
            count += 1;
        }
        assert!(count > 20, "{name}: {count} texts");
        for panel in shown(&flight) {
            let title = format!("{} [", panel.title.replace('&', "&amp;"));
            assert!(picture.contains(&title), "{name}: {title}");
        }
    }
}

fn attribute(tag: &str, name: &str) -> f64 {
    let value = tag.split(&format!("{name}=\"")).nth(1).unwrap();
    value.split('"').next().unwrap().parse().unwrap()
}

/// No three things of a chart, and no two of its curves, have one color.
#[test]
fn curves_of_a_panel_differ_in_color() {
    for (name, flight) in flights() {
        for panel in shown(&flight) {
            for (number, curve) in panel.curves.iter().enumerate() {
                let mut others = panel.curves[..number].iter();
                assert!(
                    others.all(|other| other.color != curve.color),
                    "{name}: {}",
                    panel.title
                );
            }
        }
    }
}

/// Curves that only their changes tell apart from constants are shown by their changes.
#[test]
fn small_changes_of_large_values_are_seen() {
    let spread = |panel: &Panel| {
        let values = || panel.curves.iter().flat_map(|curve| &curve.points);
        let most = values().map(|point| point[1].abs()).fold(0.0, f64::max);
        let changes = panel.curves.iter().flat_map(|curve| {
            let start = curve.points[0][1];
            curve
                .points
                .iter()
                .map(move |point| (point[1] - start).abs())
        });
        changes.fold(0.0, f64::max) / most
    };
    let approach = shown(&flight("low_orbit_approach"));
    let changes = approach
        .iter()
        .filter(|panel| panel.title.contains("change"));
    let changes: Vec<_> = changes
        .map(|panel| (panel.title.as_str(), spread(panel)))
        .collect();
    assert_eq!(
        changes,
        [
            ("Energy, change from the start", 1.0),
            ("Angular momentum change, inertial axes", 1.0)
        ]
    );
    let doubled = plain(vec![[0.0, 1.0], [1.0, 2.0]]);
    let doubled = Panel::new("A", "J", vec![doubled]).or_changes("B");
    assert_eq!((doubled.title.as_str(), spread(&doubled)), ("A", 0.5));
}

/// What goes back and forth many times is a thin line, not an area.
#[test]
fn long_curves_are_thin() {
    let stroke = Stroke::new(style::INK, 1.8);
    let zigzag = |turns: u32| -> Vec<_> {
        let ends = (0..=turns).map(|k| [f64::from(k), if k % 2 == 0 { 0.0 } else { 100.0 }]);
        ends.collect()
    };
    let area = 400.0 * 100.0;
    assert_eq!(stroke.within(&[&zigzag(20)], area).width, 1.8);
    let width = stroke.within(&[&zigzag(200)], area).width;
    assert!((0.65..0.75).contains(&width), "{width}");
    assert_eq!(stroke.within(&[&zigzag(2000)], area).width, 0.5);
    assert_eq!(stroke.within(&[], area).width, 1.8);
}
