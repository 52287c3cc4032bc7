//! What there is to see of a scene: shapes, attractor, frames and the maneuver, in SI units.

use lgvi_control::Place;
use lgvi_control::terminal::{FinalAttitude, FinalPosition, SpinAxis};
use lgvi_dynamics::Mobility;
use lgvi_scene::{Maneuver, NamedBody, Scene, Shape, Units};
use nalgebra::Vector3;
use serde::Serialize;

use super::limits::{Kept, limits};
use super::packed::{Packed, quaternion};
use crate::plot::data::{FlightData, Sample};
use crate::plot::maneuver::Orbits;

#[derive(Serialize)]
pub(super) struct Scenery<'a> {
    /// Name of the inertial frame.
    frame: &'a str,
    bodies: Vec<Body<'a>>,
    frames: Vec<Frame<'a>>,
    attractor: Option<Attractor>,
    /// Uniform gravity (m/s²), inertial frame.
    gravity: Option<[f64; 3]>,
    maneuver: Option<Goal>,
}

/// A body in its own frame (m, kg).
#[derive(Serialize)]
struct Body<'a> {
    name: &'a str,
    frame: &'a str,
    mass: f64,
    /// `J⁻¹` (1/(kg m²)), row by row.
    inverse_inertia: Vec<f64>,
    /// Whether it turns about the origin of its frame, which stays where it is.
    is_pivoted: bool,
    /// Whether it moves by rule, whatever acts on it.
    is_driven: bool,
    extent: f64,
    shape: Solid,
}

#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Solid {
    Mesh {
        vertices: Packed,
        faces: Vec<[usize; 3]>,
    },
    Spheres {
        centers: Packed,
        radius: f64,
    },
    Ellipsoid {
        center: [f64; 3],
        axes: [f64; 4],
        semi_axes: [f64; 3],
    },
}

/// A frame fixed in its parent.
#[derive(Serialize)]
struct Frame<'a> {
    name: &'a str,
    parent: &'a str,
    position: [f64; 3],
    attitude: [f64; 4],
}

#[derive(Serialize)]
struct Attractor {
    position: [f64; 3],
    /// 0 for a point.
    radius: f64,
    pole: Option<[f64; 3]>,
}

/// Where a maneuver goes to, inertial frame, and what it keeps to.
#[derive(Serialize)]
struct Goal {
    body: usize,
    initial_orbit: Option<Packed>,
    target_orbit: Option<Packed>,
    position: Option<[f64; 3]>,
    attitude: Option<[f64; 4]>,
    spin_direction: Option<[f64; 3]>,
    limits: Vec<Kept>,
    /// Those of bodies that are planned together with it.
    companions: Vec<Goal>,
}

impl<'a> Scenery<'a> {
    /// `samples` are the states that are shown.
    pub(super) fn of(data: &'a FlightData, samples: &[&Sample]) -> Self {
        let scene = &data.scene;
        let units = &scene.units;
        let length = units.length;
        let attractor = scene.gravity.central.as_ref().map(|central| {
            let oblateness = central.oblateness.as_ref();
            let of_field = oblateness.map_or(0.0, |oblateness| oblateness.reference_radius);
            let is_solid = central.radius > 0.0;
            Attractor {
                position: (central.position * length).into(),
                radius: length * if is_solid { central.radius } else { of_field },
                pole: oblateness.map(|oblateness| oblateness.pole.into()),
            }
        });
        let acceleration = length / (units.time * units.time);
        Self {
            frame: &scene.frame,
            bodies: scene
                .bodies
                .iter()
                .map(|body| of_body(body, units))
                .collect(),
            frames: frames(scene),
            attractor,
            gravity: scene.gravity.uniform.map(|g| (g * acceleration).into()),
            maneuver: scene
                .maneuver
                .as_ref()
                .map(|maneuver| goal(data, samples, maneuver, Orbits::of(data))),
        }
    }
}

fn of_body<'a>(named: &'a NamedBody, units: &Units) -> Body<'a> {
    let length = units.length;
    let shape = named.shape();
    let inertia = units.mass * length * length;
    let inverse = named.body.inertia().inverse() / inertia;
    Body {
        name: &named.name,
        frame: &named.frame,
        mass: named.body.mass() * units.mass,
        inverse_inertia: inverse.transpose().as_slice().to_vec(),
        is_pivoted: matches!(named.body.mobility(), Mobility::Pivoted),
        is_driven: matches!(named.body.mobility(), Mobility::Fixed | Mobility::Driven(_)),
        extent: shape.extent() * length,
        shape: solid(&shape, length),
    }
}

fn solid(shape: &Shape<'_>, length: f64) -> Solid {
    let scaled = |points: &[Vector3<f64>]| {
        let points: Vec<_> = points.iter().map(|point| point * length).collect();
        Packed::of(&points)
    };
    match shape {
        Shape::Mesh(mesh) => Solid::Mesh {
            vertices: scaled(mesh.vertices()),
            faces: mesh.faces().to_vec(),
        },
        Shape::Spheres { centers, radius } => Solid::Spheres {
            centers: scaled(centers),
            radius: radius * length,
        },
        Shape::Ellipsoid {
            center,
            axes,
            semi_axes,
        } => Solid::Ellipsoid {
            center: (center * length).into(),
            axes: quaternion(axes),
            semi_axes: (semi_axes * length).into(),
        },
    }
}

/// The frames within the scene; what the inertial frame itself lies in is outside of it.
fn frames(scene: &Scene) -> Vec<Frame<'_>> {
    let inside = scene
        .frames
        .iter()
        .filter(|frame| frame.name != scene.frame);
    inside
        .map(|frame| Frame {
            name: &frame.name,
            parent: &frame.parent,
            position: (frame.position * scene.units.length).into(),
            attitude: quaternion(&frame.attitude),
        })
        .collect()
}

fn goal(
    data: &FlightData,
    samples: &[&Sample],
    maneuver: &Maneuver,
    orbits: Option<Orbits>,
) -> Goal {
    let units = &data.scene.units;
    let points = |orbits: &Orbits, orbit| Packed::of(&orbits.points(orbit));
    let position = maneuver.target.condition(Place::Position);
    let attitude = maneuver.target.condition(Place::Attitude);
    let final_position = position.and_then(|c| c.downcast_ref::<FinalPosition>());
    let final_attitude = attitude.and_then(|c| c.downcast_ref::<FinalAttitude>());
    let spin_axis = attitude.and_then(|c| c.downcast_ref::<SpinAxis>());
    Goal {
        body: maneuver.body,
        initial_orbit: orbits
            .as_ref()
            .map(|orbits| points(orbits, &orbits.initial)),
        target_orbit: orbits
            .as_ref()
            .and_then(|orbits| Some(points(orbits, orbits.target.as_ref()?))),
        position: final_position.map(|target| (target.position() * units.length).into()),
        attitude: final_attitude.map(|target| quaternion(&target.attitude())),
        spin_direction: spin_axis.map(|target| target.direction().into()),
        limits: limits(data, samples, maneuver),
        companions: (maneuver.companions.iter())
            .map(|other| goal(data, samples, other, None))
            .collect(),
    }
}
