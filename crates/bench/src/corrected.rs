//! Flights of a plan with disturbances, corrected or not.

use lgvi_control::{NewtonSettings, Plan, Start, Transfer, miss, solve};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{BodyState, Load, Method, RigidBody, Simulation};
use lgvi_lie::exp;
use lgvi_scene::Scene;
use lgvi_truth::random::Random;
use nalgebra::{SVector, Vector3};

use crate::clock::Moment;
use crate::error::BenchError;

/// How a flight is corrected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Correction {
    /// By the plan's feedback at every step.
    pub feedback: bool,
    /// By a new plan so many times in the flight.
    pub plans: Option<usize>,
}

/// Standard deviations of what is other than planned.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    /// Of the factor of each component of force and moment, constant over a flight.
    pub thrust: f64,
    /// Of each component of position and of velocity.
    pub translation: f64,
    /// Of each component of the attitude's rotation vector and of the angular velocity.
    pub rotation: f64,
}

/// What is flown: a scene's maneuver in as many steps as asked for, and its plan.
pub(crate) struct Task {
    scene: Scene,
    body: RigidBody,
    index: usize,
    target: BodyState,
    pub transfer: Transfer,
    pub plan: Plan,
    /// Time (ms) that the plan took, for an interval.
    pub cold: f64,
}

/// What one flight has come to.
pub(crate) struct Arrival {
    /// `[x − x_d, γ − γ_d, log(R_dᵀ R), Π − Π_d]`
    pub miss: SVector<f64, 12>,
    /// Cost of the controls that were commanded.
    pub cost: f64,
    /// Newton steps of each new plan, and the time (ms) that it took for an interval.
    pub replans: Vec<[f64; 2]>,
}

/// What differs from the plan in one flight.
struct Disturbance {
    force: Vector3<f64>,
    moment: Vector3<f64>,
    initial: BodyState,
}

impl Task {
    /// The maneuver of the scene called `name`.
    pub(crate) fn load(name: &str, intervals: usize) -> Result<Self, BenchError> {
        let mut scene = crate::run::scene(name)?;
        scene.steps = intervals as u64;
        let refuse = || BenchError::Plan(format!("scene {name} has no maneuver to a state"));
        let transfer = scene.transfer().ok_or_else(refuse)?.map_err(plan_error)?;
        let index = scene.maneuver.as_ref().ok_or_else(refuse)?.body;
        let (plan, [_, milliseconds]) = timed(&transfer, Start::Cold)?;
        Ok(Self {
            cold: milliseconds / intervals as f64,
            body: scene.bodies[index].body.clone(),
            target: transfer.target().state().ok_or_else(refuse)?,
            index,
            transfer,
            plan,
            scene,
        })
    }

    /// Flight `number`, by the same Lie–Euler steps as planned.
    pub(crate) fn fly(
        &self,
        number: u64,
        noise: &Noise,
        correction: Correction,
    ) -> Result<Arrival, BenchError> {
        let disturbance = self.disturbance(number, noise);
        let intervals = self.plan.commands.len();
        let every = correction.plans.map(|plans| (intervals / plans).max(1));
        let mut states: Vec<_> = self.scene.bodies.iter().map(|body| body.state).collect();
        states[self.index] = disturbance.initial;
        let method = Method::LieEuler(Rotor::default());
        let mut flight = Simulation::new(self.scene.system(), states, method, self.plan.h)?;
        let mut loads = vec![Load::default(); flight.states().len()];
        let mut plan = self.plan.clone();
        let mut begun = 0;
        let mut arrival = Arrival {
            miss: SVector::zeros(),
            cost: 0.0,
            replans: Vec::new(),
        };
        for step in 0..intervals {
            let state = flight.states()[self.index];
            if every.is_some_and(|every| step % every == 0)
                && let Some((new, effort)) = self.plan_again(&plan, step - begun, step, state)?
            {
                arrival.replans.push(effort);
                plan = new;
                begun = step;
            }
            let at = step - begun;
            let mut control = plan.controls[at];
            if correction.feedback {
                let correction = -(plan.feedback[at] * miss(&plan.states[at], &state));
                control += self.limited(&correction);
            }
            arrival.cost +=
                0.5 * self.plan.h * (control.force.norm_squared() + control.moment.norm_squared());
            loads[self.index] = Load {
                force: control.force.component_mul(&disturbance.force),
                moment: control.moment.component_mul(&disturbance.moment),
            };
            flight.advance(&loads)?;
        }
        arrival.miss = miss(&self.target, &flight.states()[self.index]);
        Ok(arrival)
    }

    /// The plan from `state` on, which is reached after `flown` steps of `plan` and `step` of all; none where too little
    /// remains.
    fn plan_again(
        &self,
        plan: &Plan,
        flown: usize,
        step: usize,
        state: BodyState,
    ) -> Result<Option<(Plan, [f64; 2])>, BenchError> {
        let rest = self.transfer.remaining(step, state);
        let shifted = plan.remaining(&self.transfer, flown);
        let (Ok(rest), Ok(shifted)) = (rest, shifted) else {
            return Ok(None);
        };
        let (plan, [iterations, milliseconds]) = timed(&rest, Start::Warm(&shifted))?;
        let effort = [iterations, milliseconds / rest.intervals() as f64];
        Ok(Some((plan, effort)))
    }

    /// A correction of force and moment, shortened to the largest of the plan: near the end gains grow without bound.
    fn limited(&self, correction: &SVector<f64, 6>) -> Load {
        let largest = |of: fn(&Load) -> f64| self.plan.controls.iter().map(of).fold(0.0, f64::max);
        let shorten = |v: Vector3<f64>, limit: f64| v * (limit / v.norm().max(limit)).min(1.0);
        Load {
            force: shorten(
                correction.fixed_rows::<3>(0).into_owned(),
                largest(|load| load.force.norm()),
            ),
            moment: shorten(
                correction.fixed_rows::<3>(3).into_owned(),
                largest(|load| load.moment.norm()),
            ),
        }
    }

    fn disturbance(&self, number: u64, noise: &Noise) -> Disturbance {
        let mut random = Random::new(1, number);
        let mut factors = || random.normals().map(|n| 1.0 + noise.thrust * n);
        let (force, moment) = (factors(), factors());
        let nominal = self.transfer.initial();
        let initial = BodyState::from_velocities(
            &self.body,
            nominal.position + noise.translation * random.normals(),
            nominal.velocity(&self.body) + noise.translation * random.normals(),
            nominal.attitude * exp(&(noise.rotation * random.normals())),
            nominal.angular_velocity(&self.body) + noise.rotation * random.normals(),
        );
        Disturbance {
            force,
            moment,
            initial,
        }
    }
}

/// A plan with its Newton steps and the time (ms) that it took.
fn timed(transfer: &Transfer, start: Start<'_>) -> Result<(Plan, [f64; 2]), BenchError> {
    let settings = NewtonSettings::default();
    let mut iterations = 0;
    let begun = Moment::now();
    let plan = solve(transfer, start, &settings, |now| {
        iterations = now.iteration;
        true
    });
    let milliseconds = 1e3 * begun.elapsed();
    Ok((
        plan.map_err(plan_error)?,
        [f64::from(iterations), milliseconds],
    ))
}

fn plan_error(error: impl ToString) -> BenchError {
    BenchError::Plan(error.to_string())
}
