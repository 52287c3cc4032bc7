//! `lgvi run`: a flight from start to end, each node a process of its own.

mod domain;
mod fitted;
mod flight;
mod flown;
mod process;
mod progress;
mod recording;
mod summary;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{ArgGroup, Args};
use lgvi_middleware::Shutdown;
use lgvi_middleware::node::{NodeError, complain};
use lgvi_scene::Chosen;

use self::flown::Flown;
use crate::choosing::choose;
use crate::files::Files;
use crate::output::say;
use crate::plot::plot;
use crate::scene_input::{Loaded, SceneInput};
use crate::strictness::Strictness;
use crate::values;

/// The command line of `lgvi run`.
#[derive(Args)]
#[command(group = ArgGroup::new("awaited").multiple(true).args(["await_wrench", "await_wheels", "await_thrust"]))]
pub(crate) struct Options {
    #[command(flatten)]
    input: SceneInput,
    /// Directory of the new bag (default: `flights/<scene>_<time>`).
    #[arg(long, alias = "bag", value_name = "DIRECTORY", value_parser = values::path())]
    output: Option<PathBuf>,
    /// Simulated seconds per second; 0 flies as fast as possible, without loss (default: 0, or 1 if the scene is replanned
    /// in flight).
    #[arg(long, value_parser = values::rate, allow_negative_numbers = true)]
    real_time_factor: Option<f64>,
    #[command(flatten)]
    files: Files,
    /// Do not start the planner; a maneuver waits for a control sequence from another node.
    #[arg(long)]
    no_planner: bool,
    /// Adjust `run.duration` so that the steps fit the shortest time of the maneuver, which is planned once more to find it.
    #[arg(long, conflicts_with = "no_planner")]
    fit_duration: bool,
    /// Fly in lockstep with a controller: wait at the beginning of each control period for its wrench on this body; can be
    /// repeated.
    #[arg(long, value_name = "BODY")]
    await_wrench: Vec<String>,
    /// The same for torques of the wheels of this body.
    #[arg(long, value_name = "BODY")]
    await_wheels: Vec<String>,
    /// The same for forces of the thrusters of this body.
    #[arg(long, value_name = "BODY")]
    await_thrust: Vec<String>,
    /// Control period with --await-wrench, --await-wheels or --await-thrust, a whole number of steps.
    #[arg(long, value_name = "SECONDS", value_parser = values::rate, requires = "awaited", default_value_t = 0.02)]
    control_period: f64,
    /// Do not draw the flight.
    #[arg(long)]
    no_plot: bool,
    /// Print the summary as JSON.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    strictness: Strictness,
}

/// Flies the scene and prints the summary.
pub(crate) fn run(options: &Options) -> Result<ExitCode, NodeError> {
    let loaded = options.input.load()?;
    let bag = options.output.clone().unwrap_or_else(|| {
        let time = chrono::Local::now().format("%Y_%m_%d-%H_%M_%S");
        PathBuf::from(format!("flights/{}_{time}", loaded.scene.name))
    });
    let _alone = domain::lock(&options.input.scene, &bag)?;
    let shutdown = Shutdown::on_signals().map_err(NodeError::runtime)?;
    let (loaded, chosen) = match prepared(options, loaded, &shutdown) {
        Err(NodeError::Interrupted) => return Ok(ExitCode::from(flight::STOPPED)),
        prepared => prepared?,
    };
    let Loaded { scene, file, .. } = &loaded;
    let mut flown = flight::fly(options, scene, file, chosen.as_deref(), &bag, &shutdown)?;
    if !options.no_plot {
        flown.picture = picture(&flown);
    }
    if options.json {
        say(&serde_json::to_string(&flown).map_err(NodeError::runtime)?)?;
    } else {
        say(&summary::Summary(scene, &flown))?;
        if let Some(failure) = &flown.failure {
            complain(&format_args!("lgvi: {}", failure.message));
        }
    }
    Ok(flown.exit_code(&options.strictness))
}

/// The scene with its steps fitted if that is asked for, and the choice of an automatic integrator.
fn prepared(
    options: &Options,
    mut loaded: Loaded,
    shutdown: &Shutdown,
) -> Result<(Loaded, Option<String>), NodeError> {
    if options.fit_duration {
        loaded = fitted::fitted(&options.input, loaded, shutdown)?;
    }
    let choice = choose(&loaded.scene, Some(shutdown))?;
    let chosen = choice.map(|choice| Chosen::from(&choice).to_string());
    Ok((loaded, chosen))
}

/// Draws a finished flight. If that fails, it only warns: the bag is there.
fn picture(flown: &Flown) -> Option<PathBuf> {
    let bag = flown.bag.as_ref().filter(|_| flown.flight.is_some())?;
    let picture = plot(bag, None, None);
    if let Err(error) = &picture {
        complain(&format_args!("lgvi: warning: no picture: {error}"));
    }
    picture.ok()
}
