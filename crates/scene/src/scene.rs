use std::ops::ControlFlow;
use std::sync::Arc;

use lgvi_dynamics::docking::Docking;
use lgvi_dynamics::gravity::{Gravity, Polyhedron};
use lgvi_dynamics::skip::{Allowance, Refusal, Summary};
use lgvi_dynamics::{
    BodyState, Method, MethodError, RigidBody, Simulation, Skip, StepError, System,
};

use crate::{
    Chosen, Disturbance, Ensemble, Frame, Integration, Maneuver, SceneGravity, Scheme, SchemeError,
    Sensor, Skipping, Units,
};

/// A validated scene. Quantities are in its own units, stamps in nanoseconds since the UNIX epoch.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Short name, equal to that of the file.
    pub name: String,
    /// Title given in the file.
    pub title: String,
    /// Text of the file.
    pub text: String,
    /// Name of the inertial frame.
    pub frame: String,
    /// Units of its numbers.
    pub units: Units,
    /// Simulation time of step 0 (ns since the UNIX epoch).
    pub epoch: i64,
    /// The requested integrator.
    pub integration: Integration,
    /// Accuracy asked of `auto` if a maneuver determines the method instead.
    pub accuracy: Option<f64>,
    /// The choice of an automatic integrator, once made.
    pub chosen: Option<Chosen>,
    /// Computations that may be skipped.
    pub skipping: Skipping,
    /// Steps of the integrator per step of the run, unless the integrator is automatic.
    pub substeps: u32,
    /// How often a step that fails as a whole may be halved, or 0 for never.
    pub subdivide: u32,
    /// Duration of the run.
    pub duration: f64,
    /// Steps of the run.
    pub steps: u64,
    /// Rates of publication.
    pub publishing: Publishing,
    /// The bodies and their states at the epoch.
    pub bodies: Vec<NamedBody>,
    /// Additional frames, parents first.
    pub frames: Vec<Frame>,
    /// Gravity that acts on the bodies.
    pub gravity: SceneGravity,
    /// Sensors of the bodies, in the order of these.
    pub sensors: Vec<Sensor>,
    /// Ports of bodies that dock.
    pub docking: Vec<Docking>,
    /// The maneuver to be planned and flown.
    pub maneuver: Option<Maneuver>,
    /// Deviations of the maneuver's flight from its plan.
    pub disturbance: Option<Disturbance>,
    /// Distribution of an ensemble of the scene's flights.
    pub ensemble: Option<Ensemble>,
}

/// A body with its name and its state at the epoch.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedBody {
    /// Name of the body, also part of its topics.
    pub name: String,
    /// Name of its frame: the body's name after the prefix of the scene's frames.
    pub frame: String,
    /// The body.
    pub body: RigidBody,
    /// State at the epoch.
    pub state: BodyState,
    /// Its surface, if the scene gives one.
    pub mesh: Option<Arc<Polyhedron>>,
    /// Names of its reaction wheels, in their order.
    pub wheels: Vec<String>,
    /// Names of its thrusters, in their order.
    pub thrusters: Vec<String>,
    /// How the scene gives its state, unless by numbers in the inertial frame.
    pub given: Option<String>,
}

impl NamedBody {
    /// Returns true if it has an engine, which exerts commanded forces.
    pub fn has_engine(&self) -> bool {
        let thrusters = self.body.thrusters();
        thrusters.is_some_and(|thrusters| thrusters.engine().is_some())
    }

    /// Returns true if it loses mass.
    pub fn has_propellant(&self) -> bool {
        let thrusters = self.body.thrusters();
        thrusters.is_some_and(|thrusters| thrusters.propellant().mass > 0.0)
    }
}

/// Intervals of publication, in steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Publishing {
    /// Steps from one full-rate state to the next.
    pub state_every: u64,
    /// Steps from one set of ROS messages to the next.
    pub ros_every: u64,
}

impl Scene {
    /// Returns true if a body has wheels or thrusters.
    pub fn has_actuators(&self) -> bool {
        self.bodies.iter().any(|named| named.body.has_actuators())
    }

    /// Returns the step size `h`, in the scene's time unit.
    pub fn h(&self) -> f64 {
        self.duration / self.steps as f64
    }

    /// Returns the time at `step` since the epoch (s).
    pub fn seconds(&self, step: u64) -> f64 {
        step as f64 * self.h() * self.units.time
    }

    /// Returns the simulation time at `step` (ns since the UNIX epoch), rounded.
    pub fn stamp(&self, step: u64) -> i64 {
        self.epoch
            .saturating_add((self.seconds(step) * 1e9).round() as i64)
    }

    /// Returns the scene with `prefix` before the names of its frames, which distinguishes them from those of other
    /// flights. The parent of the inertial frame is outside the scene and keeps its name.
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
        for sensor in &mut self.sensors {
            sensor.frame.insert_str(0, prefix);
        }
        self.frame.insert_str(0, prefix);
        self
    }

    /// Returns true if an atmosphere slows bodies down.
    pub fn has_drag(&self) -> bool {
        self.bodies.iter().any(|named| named.body.drag().is_some())
    }

    /// Returns the index of the body called `name`.
    pub fn body_index(&self, name: &str) -> Option<usize> {
        self.bodies.iter().position(|body| body.name == name)
    }

    /// Returns the bodies and their gravity.
    pub fn system(&self) -> System {
        System::new(self.rigid_bodies(), self.gravity.of_system())
    }

    fn rigid_bodies(&self) -> Vec<RigidBody> {
        self.bodies.iter().map(|body| body.body.clone()).collect()
    }

    /// Returns the scheme that flies the scene. Chooses an automatic integrator, unless that has been done, and
    /// determines the computations that may be skipped. Both use pilot flights, which may take a while.
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

    /// Returns the scheme of a given method, with the skips that the scene allows.
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

    /// Returns the reason that the scene's tolerance allows no skips, or `None` if it does or if there is no tolerance.
    /// Uses pilot flights, as [`Scene::scheme`] does.
    pub fn skip_refusal(&self) -> Option<Refusal> {
        match self.skipping {
            Skipping::Nothing | Skipping::Exact => None,
            Skipping::Within(tolerance) => {
                let (mut system, states) = (self.system(), self.states());
                Allowance::new(&mut system, &states, self.duration, tolerance).err()
            }
        }
    }

    /// Summarizes the computations that a scheme performs and those that it skips.
    pub fn summary(&self, scheme: Scheme) -> Summary {
        Summary::new(
            &mut self.system(),
            &self.states(),
            scheme.method,
            scheme.skip,
        )
    }

    /// Returns the bodies' states at the epoch, undisturbed.
    pub(crate) fn states(&self) -> Vec<BodyState> {
        self.bodies.iter().map(|body| body.state).collect()
    }

    /// Returns the message of an error of a step, with the names of bodies.
    pub fn step_error(&self, error: &StepError) -> String {
        error.in_words(|body| self.body_name(body))
    }

    /// Returns the name of the body of an index.
    pub fn body_name(&self, body: usize) -> String {
        let named = self.bodies.get(body);
        named.map_or_else(|| format!("body {body}"), |named| named.name.clone())
    }

    /// Returns the simulation by a scheme, at step 0 from [`Scene::initial_states`].
    pub fn simulation(&self, scheme: Scheme) -> Result<Simulation, SchemeError> {
        self.simulation_from(self.initial_states(), scheme)
    }

    /// Returns the simulation by a scheme from other states, one per body.
    pub fn simulation_from(
        &self,
        states: Vec<BodyState>,
        scheme: Scheme,
    ) -> Result<Simulation, SchemeError> {
        Ok(self.simulation_of(self.rigid_bodies(), states, scheme)?)
    }

    /// Returns the simulation by a scheme of other bodies in place of the scene's, such as those of a sample.
    pub fn simulation_of(
        &self,
        bodies: Vec<RigidBody>,
        states: Vec<BodyState>,
        scheme: Scheme,
    ) -> Result<Simulation, MethodError> {
        let gravity = self.gravity.clone();
        self.simulation_under(bodies, states, scheme, move || gravity.of_system())
    }

    /// Returns the simulation by a scheme under other gravity than the scene's, which `gravity` creates as often as a system
    /// needs it.
    pub fn simulation_under(
        &self,
        bodies: Vec<RigidBody>,
        states: Vec<BodyState>,
        scheme: Scheme,
        gravity: impl Fn() -> Vec<Box<dyn Gravity>> + Send + 'static,
    ) -> Result<Simulation, MethodError> {
        let (h, subdivides, subdivide) = (self.h(), self.subdivides(scheme), self.subdivide);
        let simulation = move |system, states| -> Result<Simulation, MethodError> {
            let simulation =
                Simulation::new(system, states, scheme.method, h)?.with_substeps(scheme.substeps);
            let simulation = if subdivides {
                simulation.with_subdivision(subdivide)?
            } else {
                simulation
            };
            Ok(simulation.with_skips(scheme.skip))
        };
        let whole = simulation(System::new(bodies, gravity()), states)?;
        if self.docking.is_empty() {
            return Ok(whole);
        }
        whole.with_dockings(self.docking.clone(), gravity, simulation)
    }

    /// Returns true if this scheme subdivides steps that fail as a whole.
    pub fn subdivides(&self, scheme: Scheme) -> bool {
        self.subdivide > 0 && !scheme.method.has_error_control()
    }
}
