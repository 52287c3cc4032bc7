//! What the pictures of the shipped scenes show.

use lgvi_dynamics::Load;
use nalgebra::Vector3;

use super::canvas::text_width;
use super::data::FlightData;
use super::series::{Panel, panels};
use super::subject::Subject;
use super::{kept, page, subject};

macro_rules! scene {
    ($name:literal) => {
        include_str!(concat!("../../../../scenes/", $name, ".toml"))
    };
}

/// The first steps of each scene; where something is controlled, it is pushed a little.
fn flights() -> [(&'static str, FlightData); 9] {
    let push = Load {
        force: Vector3::new(0.3, 0.2, 0.1),
        moment: Vector3::zeros(),
    };
    let turn = Load {
        force: Vector3::zeros(),
        moment: Vector3::new(0.02, -0.01, 0.4),
    };
    [
        (
            "asteroid_orbiter",
            FlightData::flown(scene!("asteroid_orbiter"), 60, None),
        ),
        (
            "binary_asteroid",
            FlightData::flown(scene!("binary_asteroid"), 60, None),
        ),
        (
            "docking_corridor",
            FlightData::flown(scene!("docking_corridor"), 60, Some((0, push))),
        ),
        (
            "free_body",
            FlightData::flown(scene!("free_body"), 60, None),
        ),
        (
            "inclination_change",
            FlightData::flown(scene!("inclination_change"), 60, Some((0, push))),
        ),
        (
            "oblate_orbit",
            FlightData::flown(scene!("oblate_orbit"), 60, None),
        ),
        ("pendulum", FlightData::flown(scene!("pendulum"), 60, None)),
        ("rocks", FlightData::flown(scene!("rocks"), 10, None)),
        (
            "slew_keep_out",
            FlightData::flown(scene!("slew_keep_out"), 60, Some((0, turn))),
        ),
    ]
}

fn flight(name: &str) -> FlightData {
    let found = flights().into_iter().find(|(known, _)| *known == name);
    found.unwrap().1
}

fn shown(flight: &FlightData) -> Vec<Panel> {
    panels(flight, Subject::of(flight))
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
    assert_eq!(labels, ["x", "y", "z", "norm"]);
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
