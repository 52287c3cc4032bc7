//! Force and moment on the bodies by the sequences that were flown; what feedback laws and a disturbance's errors made of
//! them is not in it.

use lgvi_dynamics::Load;
use lgvi_propagator::Controls;
use nalgebra::Matrix3;

/// What acted on one body: sequences one after the other, zero before, between and after them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Track {
    /// First step and loads of each, in the order of their steps, without overlap.
    sequences: Vec<(u64, Vec<Load>)>,
}

impl Track {
    /// Takes the next accepted sequence: it acts from its first step on, up to step `end` at most, in place of any before
    /// it. `attitude` is that of the body of an index at a step.
    pub(crate) fn accept(
        &mut self,
        controls: &Controls,
        end: u64,
        attitude: impl Fn(u64, usize) -> Matrix3<f64>,
    ) {
        let start = controls.first_step;
        let loads = (start..controls.end().min(end))
            .map_while(|step| Some((step, controls.during(step)?)))
            .map(|(step, load)| {
                let attitude = |body| attitude(step, body);
                controls.axes.load(controls.body, &load, attitude)
            });
        let before = self.sequences.partition_point(|(first, _)| *first < start);
        self.sequences.truncate(before);
        if let Some((first, loads)) = self.sequences.last_mut() {
            loads.truncate(usize::try_from(start - *first).unwrap_or(usize::MAX));
        }
        self.sequences.push((start, loads.collect()));
    }

    /// With forces in axes of these rotations to the inertial frame, by step.
    pub(crate) fn seen(&self, rotation: impl Fn(u64) -> Matrix3<f64>) -> Self {
        let mut track = self.clone();
        for (first, loads) in &mut track.sequences {
            for (step, load) in (*first..).zip(loads) {
                load.force = rotation(step).tr_mul(&load.force);
            }
        }
        track
    }

    /// Whether nothing acted before `end`.
    pub(crate) fn is_empty(&self, end: u64) -> bool {
        self.sequences.iter().all(|(first, _)| *first >= end)
    }

    /// What acts from `step` to the next.
    pub(crate) fn at(&self, step: u64) -> Load {
        let next = self.sequences.partition_point(|(first, _)| *first <= step);
        let acting = next.checked_sub(1).map(|index| &self.sequences[index]);
        acting
            .and_then(|(first, loads)| loads.get(usize::try_from(step - first).ok()?))
            .copied()
            .unwrap_or_default()
    }

    /// The loads that acted from step 0 to `end`, as corners of a staircase: `(step, load)`.
    pub(crate) fn stairs(&self, end: u64) -> Vec<(u64, Load)> {
        let mut stairs = Vec::new();
        let mut reached = 0;
        let sequences = self.sequences.iter().filter(|(first, _)| *first < end);
        for (first, loads) in sequences {
            if *first > reached {
                stairs.extend([(reached, Load::default()), (*first, Load::default())]);
            }
            for (step, load) in (*first..end).zip(loads) {
                stairs.extend([(step, *load), (step + 1, *load)]);
                reached = step + 1;
            }
        }
        if reached < end {
            stairs.extend([(reached, Load::default()), (end, Load::default())]);
        }
        stairs
    }
}

#[cfg(test)]
mod tests {
    use lgvi_propagator::Axes;
    use nalgebra::Vector3;

    use super::*;

    fn controls(first_step: u64, force: f64, count: usize) -> Controls {
        let load = Load {
            force: Vector3::new(force, 0.0, 0.0),
            moment: Vector3::zeros(),
        };
        Controls {
            body: 0,
            first_step,
            hold: 1,
            axes: Axes::Split,
            loads: vec![load; count],
            actuation: None,
            law: None,
        }
    }

    /// A quarter turn about z at every step.
    fn accept(track: &mut Track, controls: Controls) {
        let turned = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        track.accept(&controls, 100, |_, _| turned);
    }

    #[test]
    fn forces_held_in_the_axes_of_the_body_are_drawn_in_the_inertial_frame() {
        let mut track = Track::default();
        let held = Controls {
            hold: 2,
            axes: Axes::Body(0),
            ..controls(1, 1.0, 1)
        };
        accept(&mut track, held);
        let forces: Vec<_> = (0..4).map(|step| track.at(step).force.y).collect();
        assert_eq!(forces, [0.0, 1.0, 1.0, 0.0]);
    }

    #[test]
    fn a_later_sequence_takes_over_and_is_followed_by_nothing() {
        let mut track = Track::default();
        accept(&mut track, controls(1, 1.0, 9));
        accept(&mut track, controls(8, 8.0, 9));
        accept(&mut track, controls(3, 3.0, 2));
        let forces: Vec<_> = (0..8).map(|step| track.at(step).force.x).collect();
        assert_eq!(forces, [0.0, 1.0, 1.0, 3.0, 3.0, 0.0, 0.0, 0.0]);

        let stairs = track.stairs(7);
        let corners: Vec<_> = stairs
            .iter()
            .map(|(step, load)| (*step, load.force.x))
            .collect();
        let expected = [
            (0, 0.0),
            (1, 0.0),
            (1, 1.0),
            (2, 1.0),
            (2, 1.0),
            (3, 1.0),
            (3, 3.0),
            (4, 3.0),
            (4, 3.0),
            (5, 3.0),
            (5, 0.0),
            (7, 0.0),
        ];
        assert_eq!(corners, expected);
        assert_eq!(track.stairs(2).last().map(|(step, _)| *step), Some(2));
        assert!(track.is_empty(1) && !track.is_empty(2));
    }
}
