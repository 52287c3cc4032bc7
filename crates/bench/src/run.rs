//! Runs that the automatic choice is measured on: the shipped scenes, and parts of the reference cases.

use std::path::Path;

use lgvi_dynamics::auto::{self, Choice};
use lgvi_dynamics::{Accuracy, BodyState, Load, Method, Simulation, System};
use lgvi_scene::Scene;
use lgvi_truth::{Case, RUNS};

use crate::clock::Moment;
use crate::error::BenchError;

pub(crate) const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes");

/// Steps of references: the fewest, and how often they may be doubled.
const FEWEST: u64 = 64;
const DOUBLINGS: u32 = 14;

/// Tolerance of a reference that chooses its steps.
const TIGHTEST: f64 = 1e-14;

/// Seconds that a flight of the reference may take.
const PATIENCE: f64 = 4.0;

/// What is flown.
pub(crate) struct Run {
    pub name: String,
    source: Source,
    pub wanted: auto::Run,
}

enum Source {
    Scene(Box<Scene>),
    Case(Box<Case>),
}

/// The shipped scene called `name`.
pub(crate) fn scene(name: &str) -> Result<Scene, BenchError> {
    let path = Path::new(SCENES).join(name).with_extension("toml");
    let text =
        std::fs::read_to_string(&path).map_err(|source| BenchError::Read { path, source })?;
    Scene::parse(name, &text).map_err(|source| BenchError::Scene {
        name: name.into(),
        source,
    })
}

/// Where a run ends.
pub(crate) enum Truth {
    /// As a case says.
    Known,
    /// As much finer flights say, which differ by this error.
    Flown(Vec<BodyState>, f64),
}

impl Run {
    /// All scenes without a maneuver and all cases.
    pub(crate) fn all() -> Result<Vec<Self>, BenchError> {
        let mut runs = Vec::new();
        for name in scenes()? {
            let scene = scene(&name)?;
            if scene.maneuver.is_none() {
                runs.push(Self::of_scene(scene));
            }
        }
        for (name, duration, steps) in RUNS {
            let source = Source::Case(Box::new(Case::load(name)?));
            runs.push(Self {
                name: name.into(),
                source,
                wanted: auto::Run { duration, steps },
            });
        }
        Ok(runs)
    }

    pub(crate) fn is_scene(&self) -> bool {
        matches!(self.source, Source::Scene(_))
    }

    fn of_scene(scene: Scene) -> Self {
        Self {
            name: scene.name.clone(),
            wanted: auto::Run {
                duration: scene.duration,
                steps: scene.steps,
            },
            source: Source::Scene(Box::new(scene)),
        }
    }

    pub(crate) fn system(&self) -> Result<(System, Vec<BodyState>), BenchError> {
        match &self.source {
            Source::Scene(scene) => {
                let states = scene.bodies.iter().map(|body| body.state).collect();
                Ok((scene.system(), states))
            }
            Source::Case(case) => Ok(case.system()?),
        }
    }

    pub(crate) fn choose(&self, tolerance: f64) -> Result<Choice, BenchError> {
        let (mut system, states) = self.system()?;
        let go_on = &mut |_| std::ops::ControlFlow::Continue(());
        Ok(auto::choose(
            &mut system,
            &states,
            self.wanted,
            tolerance,
            go_on,
        )?)
    }

    /// At step 0 of `steps`, each made as some substeps of the method.
    pub(crate) fn simulation(
        &self,
        method: Method,
        steps: u64,
        substeps: u32,
    ) -> Result<Simulation, BenchError> {
        let (system, states) = self.system()?;
        let h = self.wanted.duration / steps as f64;
        Ok(Simulation::new(system, states, method, h)?.with_substeps(substeps))
    }

    /// The states at the end and the time (s) that it took to get there; none where a step cannot be made.
    fn end(&self, method: Method, steps: u64) -> Result<Option<(Vec<BodyState>, f64)>, BenchError> {
        let mut simulation = self.simulation(method, steps, 1)?;
        let seconds = advance(&mut simulation, steps);
        Ok(seconds.map(|seconds| (simulation.states().to_vec(), seconds)))
    }

    pub(crate) fn accuracy(&self) -> Result<Accuracy, BenchError> {
        let (system, mut states) = self.system()?;
        system.constrain(&mut states);
        Ok(Accuracy::new(system.bodies(), &states))
    }

    /// Where the run ends. Without a case: by Nyström's method of order 8 with twice as many steps again and again, until
    /// rounding keeps two from coming nearer; what is left is the difference to a flight by Dormand and Prince's.
    pub(crate) fn truth(&self) -> Result<Truth, BenchError> {
        if matches!(self.source, Source::Case(_)) {
            return Ok(Truth::Known);
        }
        let accuracy = self.accuracy()?;
        let nystrom = Method::Nystrom { order: 8 };
        let mut best: Option<(Vec<BodyState>, f64)> = None;
        let mut last: Option<Vec<BodyState>> = None;
        for doubling in 0..DOUBLINGS {
            let Some((states, seconds)) = self.end(nystrom, FEWEST << doubling)? else {
                continue;
            };
            let change = last.as_ref().map(|last| accuracy.error(last, &states));
            let least = best.as_ref().map_or(f64::INFINITY, |best| best.1);
            match change {
                Some(change) if change < least => best = Some((states.clone(), change)),
                Some(_) if least < 1e-9 => break,
                _ => {}
            }
            if seconds > PATIENCE {
                break;
            }
            last = Some(states);
        }
        let tolerance = TIGHTEST;
        let other = self.end(Method::DormandPrince853 { tolerance }, FEWEST)?;
        match (best, other) {
            (Some((states, _)), Some((other, _))) => {
                let difference = accuracy.error(&other, &states);
                Ok(Truth::Flown(states, difference))
            }
            _ => Err(BenchError::Body(format!("{} has no reference", self.name))),
        }
    }

    /// The error at the end, infinite where a step cannot be made, and the time (s) that the flight took.
    pub(crate) fn fly(
        &self,
        method: Method,
        substeps: u32,
        truth: &Truth,
    ) -> Result<(f64, f64), BenchError> {
        let steps = self.wanted.steps;
        let mut simulation = self.simulation(method, steps, substeps)?;
        let accuracy = self.accuracy()?;
        let Some(seconds) = advance(&mut simulation, steps) else {
            return Ok((f64::INFINITY, f64::INFINITY));
        };
        let error = match (truth, &self.source) {
            (Truth::Flown(states, _), _) => accuracy.error(simulation.states(), states),
            (Truth::Known, Source::Case(case)) => {
                let bodies = simulation.system().bodies();
                let errors = case.errors(self.wanted.duration, bodies, simulation.states())?;
                let attitude = errors.attitude * std::f64::consts::FRAC_1_SQRT_2;
                attitude.max(errors.position / accuracy.length)
            }
            (Truth::Known, Source::Scene(_)) => f64::NAN,
        };
        Ok((error, seconds))
    }
}

/// Makes so many steps; the time (s) that they took, none where one cannot be made.
fn advance(simulation: &mut Simulation, steps: u64) -> Option<f64> {
    let controls = vec![Load::default(); simulation.states().len()];
    let begun = Moment::now();
    for _ in 0..steps {
        simulation.advance(&controls).ok()?;
    }
    Some(begun.elapsed())
}

/// Names of the shipped scenes, in their order.
pub(crate) fn scenes() -> Result<Vec<String>, BenchError> {
    let unread = |source| BenchError::Read {
        path: Path::new(SCENES).into(),
        source,
    };
    let mut names = Vec::new();
    for entry in std::fs::read_dir(SCENES).map_err(unread)? {
        let path = entry.map_err(unread)?.path();
        if let (Some(name), Some("toml")) = (
            path.file_stem(),
            path.extension().and_then(|extension| extension.to_str()),
        ) {
            names.push(name.to_string_lossy().into_owned());
        }
    }
    names.sort();
    Ok(names)
}
