//! Bodies that stay near each other on a long way together: their motion as it is seen from the most massive one.

use lgvi_control::constraint::FramePose;
use nalgebra::{Matrix3, Vector3};

use super::canvas::Canvas;
use super::chart::Rectangle;
use super::data::{FlightData, Sample};
use super::subject::heaviest;
use super::{space, thin};

/// Bodies are near each other within this part of the way that they go together.
const NEAR: f64 = 0.01;

/// Samples by which it is judged whether bodies are near each other.
const JUDGED: usize = 500;

/// The frame from which the motion is seen: with axes of the orbit of a body about the attractor, or inertial axes.
pub(super) struct Proximity {
    /// The body in the origin.
    pub(super) body: usize,
    /// The pose of the frame at each sample (m).
    frames: Vec<FramePose>,
}

impl Proximity {
    /// Returns `None` unless several bodies stay near each other.
    pub(super) fn of(flight: &FlightData) -> Option<Self> {
        if flight.scene.bodies.len() < 2 {
            return None;
        }
        let body = heaviest(flight);
        let judged = even(flight, JUDGED);
        let first = flight.first().bodies[body].position;
        let (mut apart, mut way) = (0.0, 0.0);
        for sample in judged {
            let center = sample.bodies[body].position;
            way = f64::max(way, (center - first).norm());
            for other in &sample.bodies {
                apart = f64::max(apart, (other.position - center).norm());
            }
        }
        let frames = || {
            flight
                .samples
                .iter()
                .map(|sample| frame(flight, sample, body))
        };
        (apart < NEAR * way).then(|| Self {
            body,
            frames: frames().collect(),
        })
    }

    /// What is seen.
    pub(super) fn title(&self, flight: &FlightData) -> String {
        let scene = &flight.scene;
        let axes = if scene.gravity.central.is_some() {
            "x radial, y transverse, z normal to the orbit"
        } else {
            "inertial axes"
        };
        format!(
            "Motion relative to {}: {axes}",
            scene.bodies[self.body].name
        )
    }

    /// A position of a sample (m), in the frame.
    pub(super) fn position(&self, k: usize, position: &Vector3<f64>) -> Vector3<f64> {
        self.frames[k].seen(position)
    }

    /// The flight as it is seen from the frame, with nothing that is far away.
    fn seen(&self, flight: &FlightData) -> FlightData {
        let mut scene = flight.scene.clone();
        scene.gravity.central = None;
        scene.frames.retain(|frame| frame.parent != scene.frame);
        let samples = flight.samples.iter().zip(&self.frames);
        let samples = samples.map(|(sample, frame)| {
            let mut sample = sample.clone();
            for pose in &mut sample.bodies {
                pose.position = frame.seen(&pose.position);
                pose.attitude = frame.rotation.tr_mul(&pose.attitude);
            }
            sample
        });
        let rotation = |step: u64| {
            let after = flight.samples.partition_point(|sample| sample.step <= step);
            self.frames[after.saturating_sub(1)].rotation
        };
        let tracks = flight.tracks.iter();
        FlightData {
            scene,
            recorded: flight.recorded,
            samples: samples.collect(),
            tracks: tracks.map(|track| track.seen(rotation)).collect(),
            intervened: flight.intervened,
        }
    }
}

/// Draws into `whole`.
pub(super) fn draw(canvas: &mut Canvas<'_>, whole: Rectangle, flight: &FlightData) {
    match Proximity::of(flight) {
        Some(near) => {
            let end = near.frames[near.frames.len() - 1];
            space::draw_from(canvas, whole, &near.seen(flight), end);
        }
        None => space::draw(canvas, whole, flight),
    }
}

/// Some samples, evenly chosen.
fn even(flight: &FlightData, most: usize) -> impl Iterator<Item = &Sample> {
    let chosen = thin::even(flight.samples.len(), most);
    chosen.into_iter().map(|k| &flight.samples[k])
}

/// The frame of a body at a sample (m). Its axes are inertial where there is no orbit.
fn frame(flight: &FlightData, sample: &Sample, body: usize) -> FramePose {
    let scene = &flight.scene;
    let pose = &sample.bodies[body];
    let orbit = scene.gravity.central.as_ref().and_then(|central| {
        let arm = pose.position - central.position * scene.units.length;
        let outwards = arm.try_normalize(0.0)?;
        let least = 1e-9 * pose.velocity.norm();
        let normal = outwards.cross(&pose.velocity).try_normalize(least)?;
        Some(Matrix3::from_columns(&[
            outwards,
            normal.cross(&outwards),
            normal,
        ]))
    });
    FramePose {
        origin: pose.position,
        rotation: orbit.unwrap_or_else(Matrix3::identity),
    }
}
