//! How often the flights of an ensemble violate the constraints of their maneuver.

use std::ops::RangeInclusive;
use std::sync::Arc;

use lgvi_control::Constraint;
use lgvi_control::Place;
use lgvi_control::constraint::StateConstraint;
use lgvi_control::terminal::FinalPosition;
use lgvi_dynamics::BodyState;
use lgvi_scene::{Maneuver, Scene};

/// The constraints on states of a maneuver that hold with a probability.
pub(crate) struct Watch {
    /// Index of the maneuvered body.
    pub(crate) body: usize,
    /// Number of steps of a flight.
    steps: u64,
    constraints: Vec<Watched>,
}

/// The violation up to which a plan satisfies a constraint.
const ROUNDING: f64 = 1e-9;

struct Watched {
    name: String,
    constraint: Arc<dyn StateConstraint>,
    /// The constraint at the end of each step, if it changes with time.
    moving: Vec<Arc<dyn StateConstraint>>,
    /// The part of the flight in which it applies.
    applies: RangeInclusive<f64>,
    /// The ends of steps at which it holds.
    ends: RangeInclusive<u64>,
}

/// How a flight has violated a constraint at the ends of its steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Violation {
    /// The largest violation, negative if there is none: relative to a limit, to the radius of a sphere or the length of a
    /// corridor, or in radians.
    largest: f64,
    /// Number of steps at whose ends it is violated.
    steps: u64,
    /// The first and the last of these steps, counted from 1; 0 if there are none.
    span: [u64; 2],
}

impl Violation {
    const NONE: Self = Self {
        largest: f64::NAN,
        steps: 0,
        span: [0; 2],
    };
}

impl Watch {
    /// Returns `None` if no constraint of the scene holds with a probability.
    pub(crate) fn of(scene: &Scene, steps: u64) -> Option<Self> {
        let maneuver = scene.maneuver.as_ref()?;
        maneuver.chances?;
        let own = maneuver.constraints.iter().enumerate();
        let own = own.map(|(index, constraint)| (index.to_string(), constraint, 0..=steps));
        // Where the lengths of phases are found, their steps are not known here.
        let fixed = !maneuver.has_free_phases();
        let switches = maneuver.proportional_switches(steps);
        let phases = maneuver.schedule(&switches, steps).enumerate();
        let phases = phases
            .filter(|_| fixed)
            .flat_map(|(number, (phase, [begin, end]))| {
                let each = phase.constraints.iter().enumerate();
                each.map(move |(index, constraint)| {
                    (format!("phases.{number}.{index}"), constraint, begin..=end)
                })
            });
        let watched = own
            .chain(phases)
            .filter_map(|(place, constraint, ends)| match constraint {
                Constraint::State(constraint) => {
                    Some(Watched::new(scene, maneuver, place, constraint, ends))
                }
                _ => None,
            });
        Some(Self {
            body: maneuver.body,
            steps,
            constraints: watched.collect(),
        })
    }

    /// Nothing violated yet.
    pub(crate) fn begin(&self) -> Vec<Violation> {
        vec![Violation::NONE; self.constraints.len()]
    }

    /// Notes the state of the body at the end of step `step`, counted from 0, with the momenta of the nominal body.
    pub(crate) fn note(&self, step: u64, state: &BodyState, noted: &mut [Violation]) {
        for (watched, violation) in self.constraints.iter().zip(noted) {
            let end = step + 1;
            let part = end as f64 / self.steps as f64;
            if !(watched.ends.contains(&end) && watched.applies.contains(&part)) {
                continue;
            }
            let constraint = watched.moving.get(step as usize);
            let constraint = constraint.unwrap_or(&watched.constraint);
            let amount = constraint.excess(constraint.value(state));
            violation.largest = violation.largest.max(amount);
            if amount > ROUNDING {
                violation.steps += 1;
                let [first, _] = violation.span;
                violation.span = [if first == 0 { end } else { first }, end];
            }
        }
    }

    /// The numbers of a flight with the names of their columns.
    pub(crate) fn cells<'w>(
        &'w self,
        noted: &'w [Violation],
    ) -> impl Iterator<Item = (String, f64)> + 'w {
        let each = self.constraints.iter().zip(noted);
        each.flat_map(|(Watched { name, .. }, violation)| {
            let violated = f64::from(u8::from(violation.steps > 0));
            [
                (format!("violation.{name}"), violation.largest),
                (format!("violated.{name}"), violated),
                (format!("violated_steps.{name}"), violation.steps as f64),
                (format!("violated_first.{name}"), violation.span[0] as f64),
                (format!("violated_last.{name}"), violation.span[1] as f64),
            ]
        })
    }
}

impl Watched {
    fn new(
        scene: &Scene,
        maneuver: &Maneuver,
        place: String,
        constraint: &Arc<dyn StateConstraint>,
        ends: RangeInclusive<u64>,
    ) -> Self {
        let start = scene.bodies[maneuver.body].state.position;
        let end = maneuver.target.condition(Place::Position);
        let end = end.and_then(|end| end.downcast_ref::<FinalPosition>());
        let constraint = constraint
            .between(&start, end.map(FinalPosition::position).as_ref())
            .unwrap_or_else(|| constraint.clone());
        let each = 1..=*ends.end();
        let each = each.map_while(|end| constraint.at(scene.h() * end as f64));
        Self {
            name: format!("{place}.{}", constraint.name()),
            moving: each.collect(),
            applies: constraint.applies(),
            ends,
            constraint,
        }
    }
}
