use std::cell::Cell;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::lanes::{self, Flight, Instructions, Member, Outcome, Thrust, Unfit, Width};
use lgvi_dynamics::{BodyState, Load, RigidBody, Simulation, Skip, System};
use lgvi_scene::{ActuatorErrors, Commands as Maneuvered, Ensemble, Sample, Scene, Scheme};

use crate::row::Failure;
use crate::table::{Columns, Ends};
use crate::violations::{Violation, Watch};
use crate::{Command, EnsembleError, Guidance, Identity, Row};

/// Values that override those of the scene's ensemble.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Settings {
    /// Number of samples.
    pub samples: Option<u64>,
    /// Seed.
    pub seed: Option<u64>,
}

/// A scene's ensemble, ready to be flown.
pub struct Campaign<'a> {
    scene: &'a Scene,
    ensemble: Ensemble,
    scheme: Scheme,
    guidance: Guidance,
    steps: u64,
    flown_by: FlownBy,
    identity: Identity,
    watch: Option<Watch>,
    columns: Columns,
}

/// The implementation that flies the samples. Both give the same numbers if lanes support everything in the scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FlownBy {
    /// SIMD lanes, many samples side by side.
    Lanes,
    /// One simulation per sample, one at a time.
    Simulation {
        /// The reason that lanes cannot be used.
        reason: String,
    },
}

/// Largest number of samples of an ensemble: the names of parts have ten digits for it.
const MOST_SAMPLES: u64 = 9_999_999_999;

/// The flight of a sample.
struct Flown {
    outcome: Outcome,
    /// The bodies at the end, where actuators may have changed them.
    system: Option<System>,
    /// The violations, if they are watched.
    violations: Option<Vec<Violation>>,
}

/// Steps after which a simulation is told of.
const BLOCK: u64 = 256;

impl<'a> Campaign<'a> {
    /// Creates the campaign of a scene with an ensemble, whose maneuver is controlled by `guidance`.
    ///
    /// # Errors
    /// Returns an error if the scene has no `ensemble` table, if the number of samples is out of range, if a maneuver
    /// lacks commands or commands lack a maneuver, if they are not those of its actuators, if the scene has no integrator, or if the
    /// simulation cannot be created.
    pub fn new(
        scene: &'a Scene,
        settings: Settings,
        guidance: Guidance,
    ) -> Result<Self, EnsembleError> {
        let mut ensemble = scene.ensemble.clone().ok_or(EnsembleError::NoTable)?;
        ensemble.samples = settings.samples.unwrap_or(ensemble.samples);
        ensemble.seed = settings.seed.unwrap_or(ensemble.seed);
        if !(1..=MOST_SAMPLES).contains(&ensemble.samples) {
            return Err(EnsembleError::Samples(ensemble.samples));
        }
        if scene.maneuver.is_some() != guidance.steps().is_some() {
            return Err(EnsembleError::Commands);
        }
        if let Some(maneuver) = &scene.maneuver {
            let state = &scene.bodies[maneuver.body].state;
            let fits = match guidance.at(0, state) {
                Some(Command::Efforts(efforts)) => efforts.len() == maneuver.actuators(),
                Some(Command::Load(_)) | None => maneuver.actuators() == 0,
            };
            if !fits {
                return Err(EnsembleError::Actuators(maneuver.actuators()));
            }
        }
        let mut scheme = scene.scheme()?;
        scene.simulation(scheme)?;
        let fit = lanes::fit(&scene.system(), scheme.method);
        let fits = fit.is_ok();
        let flown_by = flown_by(scene, scheme, &guidance, fit.err());
        // Lanes skip nothing. A simulation in their place must therefore not skip either, to give the same numbers. With
        // the exact rotor that would cost it a rotation per drift where one per step suffices.
        let same = flown_by == FlownBy::Lanes || scheme.method.rotor() == Some(Rotor::Discrete);
        if fits && same && scheme.skip == Skip::Exact {
            scheme.skip = Skip::Nothing;
        }
        let arrives = scene
            .maneuver
            .as_ref()
            .is_some_and(|maneuver| maneuver.final_time.is_some());
        let steps = match guidance.steps() {
            Some(steps) if arrives => steps.min(scene.steps),
            _ => scene.steps,
        };
        let watch = Watch::of(scene, steps);
        Ok(Self {
            identity: Identity::of(scene, &ensemble, scheme, &guidance, steps),
            columns: Columns::of(scene, &ensemble, watch.as_ref()),
            watch,
            scene,
            ensemble,
            scheme,
            guidance,
            steps,
            flown_by,
        })
    }

    /// Returns the identity of the ensemble.
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Returns the implementation that flies the samples.
    pub fn flown_by(&self) -> &FlownBy {
        &self.flown_by
    }

    /// Returns the total number of samples.
    pub fn samples(&self) -> u64 {
        self.ensemble.samples
    }

    /// Returns the number of steps of each flight.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Returns the names of the numbers of a sample.
    pub fn columns(&self) -> &[String] {
        self.columns.names()
    }

    /// Flies the samples with these indices. The width sets how many fly side by side and does not affect their
    /// results.
    pub fn fly(&self, indices: Range<u64>, width: Width) -> Vec<Row> {
        self.fly_watched(indices, width, &|_| ())
    }

    /// Flies like [`fly`](Self::fly), and adds the steps that have been made to `steps` every few hundred steps: in the end
    /// [`steps`](Self::steps) for each sample, also for those that fail.
    pub fn fly_counted(&self, indices: Range<u64>, width: Width, steps: &AtomicU64) -> Vec<Row> {
        let samples = indices.end.saturating_sub(indices.start);
        let left = Cell::new(samples.saturating_mul(self.steps));
        let count = |made: u64| {
            let made = made.min(left.get());
            left.set(left.get() - made);
            steps.fetch_add(made, Ordering::Relaxed);
        };
        let rows = self.fly_watched(indices, width, &count);
        count(left.get());
        rows
    }

    /// Flies like [`fly`](Self::fly), and passes the number of steps since the last call to `flown` every few hundred steps.
    fn fly_watched(&self, indices: Range<u64>, width: Width, flown: &dyn Fn(u64)) -> Vec<Row> {
        let mut rows = Vec::new();
        let (mut begun, mut members) = (Vec::new(), Vec::new());
        for index in indices {
            let sample = self.ensemble.sample(index);
            match self.member(&sample) {
                Ok(member) => {
                    begun.push((index, sample));
                    members.push(member);
                }
                Err(failure) => {
                    rows.push(self.columns.row(self.scene, index, &sample, Err(failure)))
                }
            }
        }
        let outcomes = self.outcomes(&begun, &members, width, flown);
        for (((index, sample), member), outcome) in begun.iter().zip(&members).zip(outcomes) {
            let ends = outcome.map(|flown| Ends {
                member,
                outcome: flown.outcome,
                system: flown.system,
                violations: self.watch.as_ref().zip(flown.violations),
            });
            rows.push(self.columns.row(self.scene, *index, sample, ends));
        }
        rows.sort_by_key(|row| row.index);
        rows
    }

    /// Returns the bodies of a sample at step 0.
    fn member(&self, sample: &Sample) -> Result<Member, Failure> {
        let (system, mut states) = sample.system(self.scene)?;
        system.constrain(&mut states);
        if !states.iter().all(BodyState::is_finite) {
            return Err(Failure::start("a state that is not finite"));
        }
        system.check_clearance(&states).map_err(|approach| {
            Failure::start(approach.in_words(|body| self.scene.body_name(body)))
        })?;
        Ok(Member {
            system,
            states,
            force: sample.actuators.force,
            moment: sample.actuators.moment,
        })
    }

    fn outcomes(
        &self,
        samples: &[(u64, Sample)],
        members: &[Member],
        width: Width,
        flown: &dyn Fn(u64),
    ) -> Vec<Result<Flown, Failure>> {
        if self.flown_by == FlownBy::Lanes {
            let loads = match &self.guidance {
                Guidance::OpenLoop(loads) => loads.as_slice(),
                Guidance::None | Guidance::StepByStep(_) => &[],
            };
            let maneuver = self.scene.maneuver.as_ref();
            let flight = Flight {
                method: self.scheme.method,
                h: self.scene.h(),
                substeps: self.scheme.substeps,
                steps: self.steps,
                thrust: maneuver.map(|maneuver| Thrust {
                    body: maneuver.body,
                    loads,
                }),
            };
            let newest = Instructions::Newest;
            if let Ok(outcomes) = lanes::fly_watched(&flight, members, width, newest, flown) {
                let each = outcomes.into_iter().map(|outcome| Flown {
                    outcome,
                    system: None,
                    violations: None,
                });
                return each.map(Ok).collect();
            }
        }
        // Lanes could not fly all members. Falling back to simulations does not change the numbers of the others.
        let each = samples.iter().zip(members);
        each.map(|((_, sample), member)| self.alone(&sample.actuators, member, flown))
            .collect()
    }

    /// The state of a body as it is measured: its velocities, with the momenta that the nominal body would have.
    fn seen(&self, simulation: &Simulation, body: usize) -> BodyState {
        let own = &simulation.system().bodies()[body];
        simulation.states()[body].of_other([own, &self.scene.bodies[body].body])
    }

    /// Flies one sample by itself. Returns its violations, too, if they are watched.
    fn alone(
        &self,
        errors: &ActuatorErrors,
        member: &Member,
        flown: &dyn Fn(u64),
    ) -> Result<Flown, Failure> {
        let (bodies, states) = (member.system.bodies().to_vec(), member.states.clone());
        let mut simulation = self.scene.simulation_of(bodies, states, self.scheme)?;
        if let Some(maneuver) = &self.scene.maneuver {
            errors.set(maneuver, &mut simulation);
        }
        let mut loads = vec![Load::default(); member.states.len()];
        let mut violations = self.watch.as_ref().map(Watch::begin);
        let (mut made, mut failure) = (self.steps, None);
        for step in 0..self.steps {
            if let Some(maneuver) = &self.scene.maneuver {
                let body = maneuver.body;
                match self.guidance.at(step, &self.seen(&simulation, body)) {
                    Some(Command::Load(load)) => {
                        loads[body] = simulation.command(body, errors.apply(&load));
                    }
                    Some(Command::Efforts(efforts)) => match maneuver.commands() {
                        Maneuvered::Loads => {}
                        Maneuvered::Thrusters => simulation.set_thruster_commands(body, &efforts),
                        Maneuvered::Wheels => simulation.set_wheel_commands(body, &efforts),
                    },
                    None => {}
                }
            }
            if let Err(error) = simulation.advance(&loads) {
                (made, failure) = (step, Some(error));
                break;
            }
            if let Some((watch, noted)) = self.watch.as_ref().zip(violations.as_mut()) {
                watch.note(step, &self.seen(&simulation, watch.body), noted);
            }
            if step % BLOCK == BLOCK - 1 {
                flown(BLOCK);
            }
        }
        let bodies = simulation.system().bodies();
        let changed = bodies.iter().any(RigidBody::has_actuators);
        let system = || System::new(bodies.to_vec(), self.scene.gravity.of_system());
        Ok(Flown {
            outcome: Outcome {
                states: simulation.states().to_vec(),
                steps: made,
                failure,
            },
            system: changed.then(system),
            violations,
        })
    }
}

/// Returns the implementation for the samples: lanes, or simulations with the reason.
fn flown_by(scene: &Scene, scheme: Scheme, guidance: &Guidance, unfit: Option<Unfit>) -> FlownBy {
    let reason = if let Guidance::StepByStep(commands) = guidance {
        Some(match commands.have_feedback() {
            true => "feedback answers to each sample by itself".into(),
            false => "commands are asked for step by step".into(),
        })
    } else if (scene.maneuver.as_ref()).is_some_and(|maneuver| maneuver.chances.is_some()) {
        Some("violations of constraints are counted on the way".into())
    } else if !scene.docking.is_empty() {
        Some("bodies dock".into())
    } else if scene.subdivides(scheme) {
        Some("steps are cut where a sample needs it".into())
    } else if matches!(scheme.skip, Skip::Within(_)) {
        Some("what is left out depends on each sample's distances".into())
    } else {
        unfit.map(|unfit| unfit.to_string())
    };
    match reason {
        Some(reason) => FlownBy::Simulation { reason },
        None => FlownBy::Lanes,
    }
}
