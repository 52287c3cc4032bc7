//! What a maneuver says relative to other bodies, predicted anew in flight.

use std::sync::Arc;

use lgvi_control::Terminal;
use lgvi_dynamics::{BodyState, RigidBody};

use super::prediction::{Predictions, Seen};
use super::{ConstraintFile, constraints, target};
use crate::file::{ManeuverFile, TargetFile};
use crate::{Maneuver, Scene, SceneError};

/// The target and the constraints as the file states them, of which some are relative to other bodies.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Relative {
    target: TargetFile,
    constraints: Vec<ConstraintFile>,
    /// Those of each phase.
    phases: Vec<Vec<ConstraintFile>>,
}

impl Relative {
    /// Returns `None` if nothing is relative to another body.
    pub(super) fn of(file: &ManeuverFile) -> Option<Arc<Self>> {
        let mut constraints = file.all_constraints();
        let relative = file.target.relative_to.is_some()
            || constraints.any(|(_, constraint)| constraint.relative_to().is_some());
        relative.then(|| {
            Arc::new(Self {
                target: file.target.clone(),
                constraints: file.constraints.clone(),
                phases: (file.phases.iter())
                    .map(|phase| phase.constraints.clone())
                    .collect(),
            })
        })
    }
}

impl Scene {
    /// Returns the maneuver with its target and constraints where the other bodies are and will be by what has been `seen` of a
    /// flight, in the order of the steps, or `None` if it is not relative to other bodies.
    ///
    /// # Errors
    /// Returns an error if the motion of a body cannot be predicted.
    pub fn maneuver_seen(&self, seen: &[Seen]) -> Result<Option<Maneuver>, SceneError> {
        let Some(maneuver) = &self.maneuver else {
            return Ok(None);
        };
        let relative = maneuver.planned().any(Maneuver::is_relative);
        if !relative {
            return Ok(None);
        }
        let each = |part: &Maneuver| self.part_seen(part, seen);
        let companions = maneuver.companions.iter().map(each);
        Ok(Some(Maneuver {
            companions: companions.collect::<Result<_, _>>()?,
            ..each(maneuver)?
        }))
    }

    /// Returns the part of one planned body.
    fn part_seen(&self, maneuver: &Maneuver, seen: &[Seen]) -> Result<Maneuver, SceneError> {
        let Some(relative) = &maneuver.relative else {
            return Ok(maneuver.clone());
        };
        let mut predictions = Predictions::in_flight(self, maneuver.body, seen);
        let target = relative.target(self, maneuver, &mut predictions)?;
        let mut constraints = |files, place: &str| {
            constraints::constraints(
                self,
                &self.bodies[maneuver.body].body,
                (files, place),
                maneuver.motion,
                &maneuver.actuation,
                &mut predictions,
            )
        };
        let mut seen = Maneuver {
            target,
            constraints: constraints(&relative.constraints[..], "maneuver.constraints")?,
            ..maneuver.clone()
        };
        let files = relative.phases.iter().enumerate();
        for (phase, (number, files)) in seen.phases.iter_mut().zip(files) {
            let place = format!("maneuver.phases[{number}].constraints");
            phase.constraints = constraints(&files[..], &place)?;
        }
        Ok(seen)
    }

    /// Returns the target of a planned body beside these bodies in their states at the end of a flight, or `None` if it is not relative
    /// to other bodies.
    pub(crate) fn target_among(
        &self,
        maneuver: &Maneuver,
        bodies: &[RigidBody],
        states: &[BodyState],
    ) -> Result<Option<Terminal>, SceneError> {
        let Some(relative) = &maneuver.relative else {
            return Ok(None);
        };
        let mut predictions = Predictions::at_end(self, maneuver.body, bodies, states);
        relative.target(self, maneuver, &mut predictions).map(Some)
    }
}

impl Relative {
    fn target<'s>(
        &'s self,
        scene: &'s Scene,
        maneuver: &Maneuver,
        predictions: &mut Predictions<'s>,
    ) -> Result<Terminal, SceneError> {
        target::target(
            scene,
            maneuver.body,
            &self.target,
            maneuver.motion,
            predictions,
        )
    }
}
