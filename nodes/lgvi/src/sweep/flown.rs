//! One flight of a sweep.

use std::time::Instant;

use lgvi_dynamics::BodyState;
use lgvi_lie::log;
use lgvi_middleware::Shutdown;
use lgvi_middleware::node::NodeError;
use lgvi_propagator::{Controls, Flight};
use lgvi_scene::Scene;

use crate::choosing::decided;

/// Most points of a curve.
const POINTS: u64 = 400;

/// A flight and what it led to.
pub(super) struct Flown {
    /// Names of bodies.
    pub(super) bodies: Vec<String>,
    pub(super) steps: u64,
    /// Why it ended early, or did not begin.
    pub(super) failure: Option<String>,
    /// The numbers at its end with the names of their columns, in SI; none if it did not begin.
    pub(super) ends: Vec<(String, f64)>,
    /// Where it is to be drawn: its course.
    pub(super) course: Vec<Point>,
    /// The time that planning and flying took (s).
    pub(super) wall_time: f64,
}

/// A state on the way.
pub(super) struct Point {
    /// (s).
    pub(super) time: f64,
    /// (J).
    pub(super) energy: f64,
    /// How far each body is from its start (m).
    pub(super) moved: Vec<f64>,
    /// The angle by which it has turned since the start (rad), at most half a turn.
    pub(super) turned: Vec<f64>,
}

impl Flown {
    /// Plans and flies a scene; a shutdown ends it.
    pub(super) fn of(scene: Scene, drawn: bool, shutdown: &Shutdown) -> Result<Self, NodeError> {
        let begun = Instant::now();
        let mut flown = Self {
            bodies: scene.bodies.iter().map(|body| body.name.clone()).collect(),
            steps: 0,
            failure: None,
            ends: Vec::new(),
            course: Vec::new(),
            wall_time: 0.0,
        };
        match begin(scene, shutdown) {
            Ok((scene, mut flight)) => flown.fly(&scene, &mut flight, drawn, shutdown)?,
            Err(NodeError::Interrupted) => return Err(NodeError::Interrupted),
            Err(error) => flown.failure = Some(error.to_string()),
        }
        flown.wall_time = begun.elapsed().as_secs_f64();
        Ok(flown)
    }

    fn fly(
        &mut self,
        scene: &Scene,
        flight: &mut Flight,
        drawn: bool,
        shutdown: &Shutdown,
    ) -> Result<(), NodeError> {
        let start: Vec<BodyState> = flight.states().to_vec();
        let every = scene.steps.div_ceil(POINTS);
        loop {
            let step = flight.step();
            if drawn && (step.is_multiple_of(every) || step == scene.steps) {
                self.course.push(point(scene, &start, flight));
            }
            if step == scene.steps {
                break;
            }
            if step.is_multiple_of(1024) && shutdown.requested() {
                return Err(NodeError::Interrupted);
            }
            if let Err(error) = flight.advance() {
                self.failure = Some(scene.step_error(&error));
                break;
            }
        }
        self.steps = flight.step();
        let begun = (&scene.system(), start.as_slice());
        self.ends = lgvi_ensemble::ends(scene, [begun, (flight.system(), flight.states())]);
        Ok(())
    }
}

/// The scene with what flies it, and its flight at its start, with its plan.
fn begin(scene: Scene, shutdown: &Shutdown) -> Result<(Scene, Flight), NodeError> {
    let scene = decided(scene, shutdown)?;
    let mut flight = Flight::new(&scene).map_err(NodeError::input)?;
    if scene.maneuver.is_some() {
        let plan = lgvi_planner::plan(&scene, &mut |_| !shutdown.requested());
        let plan = plan.map_err(|error| match shutdown.requested() {
            true => NodeError::Interrupted,
            false => NodeError::Input(format!("no plan: {error}")),
        })?;
        let message = plan.message(&scene).map_err(NodeError::runtime)?;
        let controls = Controls::of_message(&scene, &message).map_err(NodeError::runtime)?;
        flight.accept(controls).map_err(NodeError::runtime)?;
    }
    Ok((scene, flight))
}

fn point(scene: &Scene, start: &[BodyState], flight: &Flight) -> Point {
    let pairs = || start.iter().zip(flight.states());
    Point {
        time: scene.seconds(flight.step()),
        energy: flight.invariants().energy * scene.units.energy(),
        moved: pairs()
            .map(|(from, to)| (to.position - from.position).norm() * scene.units.length)
            .collect(),
        turned: pairs()
            .map(|(from, to)| log(&from.attitude.tr_mul(&to.attitude)).norm())
            .collect(),
    }
}
