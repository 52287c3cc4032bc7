use lgvi_dynamics::BodyState;
use lgvi_dynamics::auto::ChoiceError;
use lgvi_propagator::{Controls, Flight};
use lgvi_scene::Scene;

use crate::{choose, decided};

/// Steps between two looks at whether the flight is to end.
const LOOK: u64 = 1024;

/// A flight of a sweep and what it led to.
#[derive(Clone, Debug, PartialEq)]
pub struct Flown {
    /// Steps made.
    pub steps: u64,
    /// Why it ended early, or did not begin.
    pub failure: Option<String>,
    /// The numbers at its end with the names of their columns, in SI, as in the table of an ensemble; none if it did not begin.
    pub ends: Vec<(String, f64)>,
}

/// Why a flight does not begin.
enum End {
    Stopped,
    Failed(String),
}

impl End {
    fn failed(error: impl ToString) -> Self {
        Self::Failed(error.to_string())
    }
}

impl Flown {
    /// Plans and flies a scene; returns `None` if `go_on`, which is asked on the way, is false. `see` sees the flight at its
    /// start and after each step.
    pub fn of(
        scene: Scene,
        go_on: &dyn Fn() -> bool,
        mut see: impl FnMut(&Scene, &Flight),
    ) -> Option<Self> {
        let mut flown = Self {
            steps: 0,
            failure: None,
            ends: Vec::new(),
        };
        let (scene, mut flight) = match begin(scene, go_on) {
            Ok(begun) => begun,
            Err(End::Stopped) => return None,
            Err(End::Failed(why)) => {
                flown.failure = Some(why);
                return Some(flown);
            }
        };
        let start: Vec<BodyState> = flight.states().to_vec();
        loop {
            see(&scene, &flight);
            if flight.step() == scene.steps {
                break;
            }
            if flight.step().is_multiple_of(LOOK) && !go_on() {
                return None;
            }
            if let Err(error) = flight.advance() {
                flown.failure = Some(scene.step_error(&error));
                break;
            }
        }
        flown.steps = flight.step();
        let begun = (&scene.system(), start.as_slice());
        flown.ends = lgvi_ensemble::ends(&scene, [begun, (flight.system(), flight.states())]);
        Some(flown)
    }
}

/// The scene with what flies it, which is chosen by pilot flights where it is `auto`, and its flight at its start, with its plan.
fn begin(scene: Scene, go_on: &dyn Fn() -> bool) -> Result<(Scene, Flight), End> {
    let choice = choose(&scene, &mut |_| go_on()).map_err(|error| match error {
        ChoiceError::Interrupted => End::Stopped,
        error => End::Failed(format!("scene {}: {error}", scene.name)),
    })?;
    let scene = decided(scene, choice.as_ref()).map_err(End::failed)?;
    let mut flight = Flight::new(&scene).map_err(End::failed)?;
    if scene.maneuver.is_some() {
        let plan = lgvi_planner::plan(&scene, &mut |_| go_on());
        let plan = plan.map_err(|error| match go_on() {
            true => End::Failed(format!("no plan: {error}")),
            false => End::Stopped,
        })?;
        let message = plan.message(&scene).map_err(End::failed)?;
        let controls = Controls::of_message(&scene, &message).map_err(End::failed)?;
        flight.accept(controls).map_err(End::failed)?;
    }
    Ok((scene, flight))
}
