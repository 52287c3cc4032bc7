use lgvi_common::{Warning, WarningCode};
use lgvi_dynamics::Method;
use lgvi_dynamics::auto::Choice;
use lgvi_dynamics::integrator::Rotor;
use lgvi_scene::{Scene, Scheme};
use serde::Serialize;

use super::choice::Chosen;
use super::trial::Trial;
use crate::Unusable;

/// How a scene is flown.
#[derive(Debug, Serialize)]
pub(super) struct Integrator {
    pub(super) method: String,
    /// Order of convergence; none for exact motion.
    pub(super) order: Option<u32>,
    /// Steps of the method in a step of the run.
    pub(super) substeps: u32,
    /// Step of the method (s).
    pub(super) step_size: f64,
    /// Evaluations of gravity in a step of the method, on average over the trial.
    pub(super) evaluations: f64,
    /// How often a step may be halved.
    pub(super) subdivide: u32,
    /// Steps of the run that the trial has made.
    pub(super) trial_steps: u64,
    /// Greatest turn of a body in a step of the method, over the trial (rad).
    pub(super) largest_turn: f64,
    /// Turn up to which the method's equations are sure to have a solution (rad); none where they always have.
    pub(super) turn_limit: Option<f64>,
    /// Why it was chosen; none where the scene names it.
    pub(super) choice: Option<Chosen>,
}

impl Integrator {
    /// With the scheme, and what is to be warned of.
    pub(super) fn of(
        scene: &Scene,
        choice: Option<&Choice>,
    ) -> Result<(Self, Scheme, Vec<Warning>), Unusable> {
        let scheme = match choice {
            Some(choice) => scene.scheme_by(choice.method, choice.substeps),
            None => scene.scheme().map_err(Unusable::new)?,
        };
        let trial = Trial::fly(scene, scheme)?;
        let integrator = Self {
            method: scheme.method.to_string(),
            order: scheme.method.order(),
            substeps: scheme.substeps,
            step_size: scene.h() * scene.units.time / f64::from(scheme.substeps),
            evaluations: trial.evaluations,
            subdivide: scene.subdivide,
            trial_steps: trial.steps,
            largest_turn: trial.largest_turn,
            turn_limit: turn_limit(scheme.method),
            choice: choice.map(Chosen::of),
        };
        let failure = trial.failure;
        let otherwise = scene.flown_otherwise(scheme);
        let warned = |code, message: Option<String>| message.map(|text| Warning::new(code, text));
        let chosen = scene.chosen.clone().or(choice.map(Into::into));
        let accuracy = chosen.and_then(|chosen| chosen.warning);
        let warnings = [
            warned(WarningCode::Accuracy, accuracy),
            integrator
                .unsolvable_turn()
                .or_else(|| warned(WarningCode::LongTurn, scene.long_turn(scheme, trial.rates))),
            warned(WarningCode::LongStep, scene.long_orbit(scheme, trial.rates)),
            warned(WarningCode::TrialStep, failure),
            warned(
                WarningCode::ChangedEnergy,
                scene.changed_energy(trial.energies),
            ),
            warned(WarningCode::CoarseSteps, scene.coarse_steps(scheme, &[])),
            warned(WarningCode::FlownOtherwise, otherwise),
        ];
        let warnings = warnings.into_iter().flatten().collect();
        Ok((integrator, scheme, warnings))
    }

    fn unsolvable_turn(&self) -> Option<Warning> {
        let (turn, limit) = (self.largest_turn, self.turn_limit?);
        let message = format!(
            "a body turns by {turn:.2} rad in a step, past the {limit:.2} rad up to which every step can be made: \
             more `steps` or `substeps` would make it less"
        );
        (turn > limit).then(|| Warning::new(WarningCode::LongTurn, message))
    }
}

/// The implicit equation has a solution wherever `|J⁻¹ g| ≤ 1`.
fn turn_limit(method: Method) -> Option<f64> {
    match (method.rotor(), method) {
        (Some(Rotor::Discrete), _) => Some(1.0),
        (_, Method::Galerkin { .. } | Method::EulerPoincare { .. }) => Some(std::f64::consts::PI),
        _ => None,
    }
}
