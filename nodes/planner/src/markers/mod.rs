//! Markers of a plan: where it goes, what pushes, where it is to end, and what it keeps clear of.

mod curves;
mod drawing;

use lgvi_common::header;
use lgvi_control::Place;
use lgvi_control::constraint::Region;
use lgvi_control::terminal::{FinalAttitude, FinalPosition, KeplerOrbit, SpinAxis};
use lgvi_dynamics::{BodyState, Load};
use lgvi_msgs::stamp::StampError;
use lgvi_msgs::visualization_msgs::MarkerArray;
use lgvi_scene::{Maneuver, Scene};
use nalgebra::{Matrix3, Vector3};

use crate::sequence::Sequence;
use drawing::{Drawing, color};

/// The most arrows of thrust.
const ARROWS: usize = 40;

/// Ids of the markers of one body in a namespace.
const IDS: usize = 1000;

/// Length of the longest, of the drawing's size.
const LONGEST: f64 = 0.15;

/// Forces below this, of the largest, have no arrow.
const LEAST: f64 = 0.01;

/// Width of lines, of the drawing's size.
const LINE: f64 = 0.003;

/// The plan and its maneuver, in the inertial frame. What was drawn before is deleted first.
pub(crate) fn markers(scene: &Scene, sequence: &Sequence) -> Result<MarkerArray, StampError> {
    let Some(maneuver) = sequence.seen.as_deref().or(scene.maneuver.as_ref()) else {
        return Ok(MarkerArray::default());
    };
    let pictures = maneuver.planned().zip(sequence.all());
    let pictures = pictures.map(|(maneuver, sequence)| {
        let body = scene.bodies[maneuver.body].shape().extent();
        Picture {
            scene,
            maneuver,
            sequence,
            body,
            size: span(&sequence.plan.states).max(4.0 * body),
        }
    });
    let pictures: Vec<_> = pictures.collect();
    let size = pictures.iter().map(|plan| plan.size).fold(0.0, f64::max);
    let header = header(scene, sequence.first_step)?;
    let mut drawing = Drawing::new(header, scene.units.length, LINE * size);
    for (plan, first_id) in pictures.iter().zip((0..).step_by(IDS)) {
        drawing.first_id = first_id;
        plan.path(&mut drawing);
        plan.thrust(&mut drawing);
        plan.target(&mut drawing);
        plan.constraints(&mut drawing);
    }
    Ok(drawing.finish())
}

/// Diagonal of the box round all positions.
fn span(states: &[BodyState]) -> f64 {
    let Some(first) = states.first() else {
        return 0.0;
    };
    let (low, high) = states
        .iter()
        .fold((first.position, first.position), |(low, high), state| {
            (low.inf(&state.position), high.sup(&state.position))
        });
    (high - low).norm()
}

/// A plan to be drawn, in the scene's units.
struct Picture<'a> {
    scene: &'a Scene,
    maneuver: &'a Maneuver,
    sequence: &'a Sequence,
    /// Extent of the body.
    body: f64,
    /// Extent of the whole.
    size: f64,
}

impl Picture<'_> {
    /// States as often as ROS messages are published, with the last one.
    fn shown(&self) -> impl Iterator<Item = &BodyState> {
        let (every, arrival) = (self.scene.publishing.ros_every, self.sequence.arrival());
        (self.sequence.first_step..)
            .zip(&self.sequence.plan.states)
            .filter(move |(step, _)| *step == arrival || step.is_multiple_of(every))
            .map(|(_, state)| state)
    }

    fn path(&self, drawing: &mut Drawing) {
        if span(&self.sequence.plan.states) > 0.0 {
            let positions = self.shown().map(|state| state.position);
            drawing.strip("path", 0, positions, color::PATH);
        }
    }

    /// The force at the start of every n-th interval, from where the body is then.
    fn thrust(&self, drawing: &mut Drawing) {
        let controls = &self.sequence.plan.controls;
        let norm = |control: &Load| control.force.norm();
        let largest = controls.iter().map(norm).fold(0.0, f64::max);
        if largest == 0.0 {
            return;
        }
        let stride = controls.len().div_ceil(ARROWS);
        let chosen = self.sequence.plan.states.iter().zip(controls);
        for (id, (state, control)) in (0..).zip(chosen.step_by(stride)) {
            if norm(control) >= LEAST * largest {
                let actuation = &self.maneuver.actuation;
                let control = actuation.in_inertial_axes(control, &state.attitude);
                let arrow = control.force * (LONGEST * self.size / largest);
                let tip = state.position + arrow;
                drawing.arrow("thrust", id, [state.position, tip], color::THRUST);
            }
        }
    }

    fn target(&self, drawing: &mut Drawing) {
        let target = &self.maneuver.target;
        let position = target.condition(Place::Position);
        let attitude = target.condition(Place::Attitude);
        if let Some(orbit) = position.and_then(|c| c.downcast_ref::<KeplerOrbit>()) {
            let arm = orbit.position() - orbit.center();
            let ellipse = curves::orbit(orbit.gm(), &arm, &orbit.velocity());
            let ellipse = ellipse.map(|r| orbit.center() + r);
            drawing.strip("goal_orbit", 0, ellipse, color::TARGET);
        }
        let origin = match position.and_then(|c| c.downcast_ref::<FinalPosition>()) {
            Some(target) => Some(target.position()),
            None => self.sequence.plan.states.last().map(|last| last.position),
        };
        let Some(origin) = origin else { return };
        let length = (0.1 * self.size).max(1.5 * self.body);
        if let Some(target) = attitude.and_then(|c| c.downcast_ref::<FinalAttitude>()) {
            drawing.axes("target", 0, origin, target.attitude() * length);
        } else if let Some(spin) = attitude.and_then(|c| c.downcast_ref::<SpinAxis>()) {
            let tip = origin + spin.direction() * length;
            drawing.arrow("target", 0, [origin, tip], color::TARGET);
        }
    }

    /// What moves is where it is at the end.
    fn constraints(&self, drawing: &mut Drawing) {
        let states = &self.sequence.plan.states;
        let (Some(first), Some(last)) = (states.first(), states.last()) else {
            return;
        };
        for (id, constraint) in (0..).zip(self.maneuver.all_constraints()) {
            match constraint.region_at(f64::INFINITY) {
                Some(Region::OutsideEllipsoid {
                    center,
                    semi_axes,
                    axes,
                }) => drawing.ellipsoid("keep_out", id, center, semi_axes, &axes, color::FORBIDDEN),
                Some(Region::InsideSphere { center, radius }) => {
                    let (semi_axes, axes) = (Vector3::repeat(radius), Matrix3::identity());
                    drawing.ellipsoid("keep_in", id, center, semi_axes, &axes, color::ALLOWED);
                }
                Some(Region::OutsideCone {
                    axis,
                    direction,
                    half_angle,
                }) => {
                    let (apex, reach) = (first.position, 0.5 * self.size);
                    let sides = curves::cone(&apex, &direction, half_angle, reach);
                    drawing.triangles("keep_out", id, sides, color::FORBIDDEN);
                    let trace = self.shown();
                    let trace = trace.map(|state| apex + state.attitude * axis * reach);
                    drawing.strip("kept_axis", id, trace, color::PATH);
                }
                Some(Region::Corridor {
                    apex,
                    axis,
                    half_angle,
                }) => {
                    let distance = |state: &BodyState| (state.position - apex).norm();
                    let reach = states.iter().map(distance).fold(0.0, f64::max);
                    let sides = curves::cone(&apex, &axis, half_angle, reach);
                    drawing.triangles("corridor", id, sides, color::ALLOWED);
                }
                Some(Region::InSight {
                    axis,
                    point,
                    half_angle,
                }) => {
                    let reach = (point - last.position).norm();
                    let sides = of_body(last, &axis, half_angle, reach);
                    drawing.triangles("line_of_sight", id, sides, color::ALLOWED);
                }
                Some(Region::OutsidePlume {
                    axis,
                    half_angle,
                    distance,
                    ..
                }) => {
                    let sides = of_body(last, &axis, half_angle, distance);
                    drawing.triangles("plume", id, sides, color::FORBIDDEN);
                }
                Some(Region::AngularRate { .. } | Region::Speed { .. }) | None => {}
            }
        }
    }
}

/// The mantle of a cone about an axis of a body.
fn of_body(
    state: &BodyState,
    axis: &Vector3<f64>,
    half_angle: f64,
    side: f64,
) -> Vec<Vector3<f64>> {
    curves::cone(&state.position, &(state.attitude * axis), half_angle, side)
}

#[cfg(test)]
mod tests;
