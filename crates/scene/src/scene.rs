use std::ops::ControlFlow;
use std::sync::Arc;

use lgvi_dynamics::gravity::Polyhedron;
use lgvi_dynamics::skip::{Allowance, Refusal, Summary};
use lgvi_dynamics::{BodyState, Method, RigidBody, Simulation, Skip, System};

use crate::{
    Chosen, Disturbance, Ensemble, Frame, Integration, Maneuver, SceneGravity, Scheme, SchemeError,
    Skipping, Units,
};

/// A validated scene. Quantities are in its own units, stamps in nanoseconds since the UNIX epoch.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Short name, that of the file.
    pub name: String,
    /// What the file says it is.
    pub title: String,
    /// The file's text.
    pub text: String,
    /// Name of the inertial frame.
    pub frame: String,
    /// What its numbers measure.
    pub units: Units,
    /// Simulation time of step 0 (ns since the UNIX epoch).
    pub epoch: i64,
    /// The integrator that is asked for.
    pub integration: Integration,
    /// What `auto` was asked for where a maneuver says what flies it.
    pub accuracy: Option<f64>,
    /// What an automatic integrator has chosen, once it has.
    pub chosen: Option<Chosen>,
    /// What may be left out of the computation.
    pub skipping: Skipping,
    /// Steps of the integrator in each step of the run, unless it chooses them.
    pub substeps: u32,
    /// How often a step that cannot be made as one may be halved; 0 for never.
    pub subdivide: u32,
    /// Duration of the run.
    pub duration: f64,
    /// Steps of the run.
    pub steps: u64,
    /// What is published how often.
    pub publishing: Publishing,
    /// The bodies and their states at the epoch.
    pub bodies: Vec<NamedBody>,
    /// Further frames, those that others hang on first.
    pub frames: Vec<Frame>,
    /// What acts on the bodies.
    pub gravity: SceneGravity,
    /// What is to be planned and flown.
    pub maneuver: Option<Maneuver>,
    /// What sets the flight of the maneuver apart from its plan.
    pub disturbance: Option<Disturbance>,
    /// What an ensemble of the scene's flights differs in.
    pub ensemble: Option<Ensemble>,
}

/// A body with its name and its state at the epoch.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedBody {
    /// Name, also of its topics.
    pub name: String,
    /// Name of its frame: its own, behind the prefix of the scene's frames.
    pub frame: String,
    /// The body.
    pub body: RigidBody,
    /// State at the epoch.
    pub state: BodyState,
    /// Its surface, where the scene tells it.
    pub mesh: Option<Arc<Polyhedron>>,
}

/// How often states are published, in steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Publishing {
    /// Steps from one full-rate state to the next.
    pub state_every: u64,
    /// Steps from one set of ROS messages to the next.
    pub ros_every: u64,
}

impl Scene {
    /// The step `h`, in the scene's time unit.
    pub fn h(&self) -> f64 {
        self.duration / self.steps as f64
    }

    /// Time at `step` since the epoch (s).
    pub fn seconds(&self, step: u64) -> f64 {
        step as f64 * self.h() * self.units.time
    }

    /// Simulation time at `step` (ns since the UNIX epoch), rounded.
    pub fn stamp(&self, step: u64) -> i64 {
        self.epoch
            .saturating_add((self.seconds(step) * 1e9).round() as i64)
    }

    /// The scene with `prefix` before the names of its frames, so that they differ from those of other flights. What its
    /// inertial frame hangs on is of others, and keeps its name.
    #[must_use]
    pub fn with_frame_prefix(mut self, prefix: &str) -> Self {
        for frame in &mut self.frames {
            if frame.name != self.frame {
                frame.parent.insert_str(0, prefix);
            }
            frame.name.insert_str(0, prefix);
        }
        for body in &mut self.bodies {
            body.frame.insert_str(0, prefix);
        }
        self.frame.insert_str(0, prefix);
        self
    }

    /// Index of the body called `name`.
    pub fn body_index(&self, name: &str) -> Option<usize> {
        self.bodies.iter().position(|body| body.name == name)
    }

    /// The bodies and their gravity.
    pub fn system(&self) -> System {
        let bodies = self.bodies.iter().map(|body| body.body.clone()).collect();
        System::new(bodies, self.gravity.of_system())
    }

    /// What flies the scene. An automatic integrator is chosen here, unless it has been, and what may be left out is found,
    /// both by flights that may take a while.
    pub fn scheme(&self) -> Result<Scheme, SchemeError> {
        let (method, substeps) = match self.integration {
            Integration::Method(method) => (method, self.substeps),
            Integration::Auto { tolerance } => match &self.chosen {
                Some(chosen) => (chosen.method, chosen.substeps),
                None => {
                    let choice = self.choice(tolerance, &mut |_| ControlFlow::Continue(()))?;
                    (choice.method, choice.substeps)
                }
            },
        };
        Ok(self.scheme_by(method, substeps))
    }

    /// A method as it flies the scene, leaving out what the scene allows.
    pub fn scheme_by(&self, method: Method, substeps: u32) -> Scheme {
        let skip = match self.skipping {
            Skipping::Nothing => Skip::Nothing,
            Skipping::Exact => Skip::Exact,
            Skipping::Within(tolerance) => {
                Skip::within(&mut self.system(), &self.states(), self.duration, tolerance)
            }
        };
        Scheme {
            method,
            substeps,
            skip,
        }
    }

    /// Why nothing is left out by the scene's tolerance; none where something is, or where there is no tolerance. Found by
    /// pilot flights, as in [`Scene::scheme`].
    pub fn skip_refusal(&self) -> Option<Refusal> {
        match self.skipping {
            Skipping::Nothing | Skipping::Exact => None,
            Skipping::Within(tolerance) => {
                let (mut system, states) = (self.system(), self.states());
                Allowance::new(&mut system, &states, self.duration, tolerance).err()
            }
        }
    }

    /// What of the scene a scheme computes, and what it leaves out.
    pub fn summary(&self, scheme: Scheme) -> Summary {
        Summary::new(
            &mut self.system(),
            &self.states(),
            scheme.method,
            scheme.skip,
        )
    }

    /// The bodies' states at the epoch, undisturbed.
    pub(crate) fn states(&self) -> Vec<BodyState> {
        self.bodies.iter().map(|body| body.state).collect()
    }

    /// The simulation by a scheme, at step 0 from [`Scene::initial_states`].
    pub fn simulation(&self, scheme: Scheme) -> Result<Simulation, SchemeError> {
        self.simulation_from(self.initial_states(), scheme)
    }

    /// The simulation by a scheme from other states, one a body.
    pub fn simulation_from(
        &self,
        states: Vec<BodyState>,
        scheme: Scheme,
    ) -> Result<Simulation, SchemeError> {
        let simulation = Simulation::new(self.system(), states, scheme.method, self.h())?
            .with_substeps(scheme.substeps);
        let simulation = if self.subdivides(scheme) {
            simulation.with_subdivision(self.subdivide)?
        } else {
            simulation
        };
        Ok(simulation.with_skips(scheme.skip))
    }

    /// Whether steps by this scheme are cut where they cannot be made as one.
    pub fn subdivides(&self, scheme: Scheme) -> bool {
        self.subdivide > 0 && !scheme.method.has_error_control()
    }
}
