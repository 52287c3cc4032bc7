//! One flight of a sweep, and its course.

use std::time::Instant;

use lgvi_dynamics::BodyState;
use lgvi_lie::log;
use lgvi_propagator::Flight;
use lgvi_review::sweep::Flown;
use lgvi_scene::Scene;

/// Most points of a curve.
const POINTS: u64 = 400;

/// A flight, and what was seen of it on its way.
pub(super) struct Watched {
    pub(super) flight: Flown,
    /// Names of bodies.
    pub(super) bodies: Vec<String>,
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

impl Watched {
    /// Plans and flies a scene; returns `None` if `go_on` is false.
    pub(super) fn of(scene: Scene, drawn: bool, go_on: &dyn Fn() -> bool) -> Option<Self> {
        let begun = Instant::now();
        let bodies = scene.bodies.iter().map(|body| body.name.clone()).collect();
        let mut course = Vec::new();
        let mut start = Vec::new();
        let flight = Flown::of(scene, go_on, |scene, flight| {
            let step = flight.step();
            if step == 0 {
                start = flight.states().to_vec();
            }
            let every = scene.steps.div_ceil(POINTS);
            if drawn && (step.is_multiple_of(every) || step == scene.steps) {
                course.push(point(scene, &start, flight));
            }
        })?;
        Some(Self {
            flight,
            bodies,
            course,
            wall_time: begun.elapsed().as_secs_f64(),
        })
    }
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
