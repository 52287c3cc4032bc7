use std::cell::Cell;
use std::io::{self, Write};
use std::ops::Range;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::{Args, ValueEnum};
use lgvi_dynamics::lanes::Width;
use lgvi_ensemble::{self as ensemble, Campaign, FlownBy, Guidance, Place, Settings, Store};
use lgvi_middleware::Shutdown;
use lgvi_middleware::node::NodeError;
use lgvi_review::check_threads;
use lgvi_scene::{Commands, NamedBody, Scene};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use super::failed;
use super::report::{report, say_place};
use crate::choosing::decided;
use crate::output::say;
use crate::scene_input::SceneInput;
use crate::{bars, values};

/// The command line of `lgvi ensemble run`.
#[derive(Args)]
pub(crate) struct Options {
    #[command(flatten)]
    input: SceneInput,
    /// Number of samples (default: the scene's).
    #[arg(long)]
    samples: Option<u64>,
    /// Seed (default: the scene's).
    #[arg(long)]
    seed: Option<u64>,
    /// Threads; 0 starts one per core.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Samples that share a core's SIMD lanes; the results do not depend on it.
    #[arg(long, value_enum, default_value_t = Lanes::Eight)]
    lanes: Lanes,
    /// Fly only the samples A up to, but not including, B: a shard for `lgvi ensemble merge`.
    #[arg(long, value_name = "A..B", value_parser = range)]
    range: Option<Range<u64>>,
    /// Directory of the results, or URL of a folder in an object store (s3://, gs://, az://) if the program was built with
    /// `--features object-store`; an interrupted run in it is continued (default: `flights/<scene>_ensemble`).
    #[arg(long, value_name = "DIRECTORY", value_parser = values::path())]
    output: Option<PathBuf>,
    /// Print the summary as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Lanes {
    #[value(name = "1")]
    One,
    #[value(name = "8")]
    Eight,
}

impl From<Lanes> for Width {
    fn from(lanes: Lanes) -> Self {
        match lanes {
            Lanes::One => Self::One,
            Lanes::Eight => Self::Eight,
        }
    }
}

/// Message at the first signal.
const ENDING: &str = "finishing the parts that were begun; another signal ends at once";

/// A second signal ends the process without waiting for the samples in flight.
fn end_at_the_second_signal() -> io::Result<()> {
    let asked = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        flag::register_conditional_shutdown(signal, 1, Arc::clone(&asked))?;
        flag::register(signal, Arc::clone(&asked))?;
    }
    Ok(())
}

/// `A..B`
fn range(text: &str) -> Result<Range<u64>, String> {
    let expected = || format!("expected two whole numbers as in 0..1000, found {text:?}");
    let (start, end) = text.split_once("..").ok_or_else(expected)?;
    let range = start.parse().map_err(|_| expected())?..end.parse().map_err(|_| expected())?;
    if range.is_empty() {
        return Err("expected a range that is not empty".into());
    }
    Ok(range)
}

/// Flies the samples and prints the summary.
pub(crate) fn run(options: &Options) -> Result<ExitCode, NodeError> {
    check_threads(options.threads).map_err(NodeError::input)?;
    let scene = options.input.load()?.scene;
    let place = match &options.output {
        Some(output) => Place::at(output).map_err(failed)?,
        None => Place::from(&format!("flights/{}_ensemble", scene.name)),
    };
    let shutdown = Shutdown::on_signals().map_err(NodeError::runtime)?;
    end_at_the_second_signal().map_err(NodeError::runtime)?;
    let scene = decided(scene, &shutdown).map_err(|error| match error {
        NodeError::Interrupted => NodeError::Runtime("ended before the first sample".into()),
        error => error,
    })?;
    let settings = Settings {
        samples: options.samples,
        seed: options.seed,
    };
    let guidance = guidance(&scene, &shutdown)?;
    let campaign = Campaign::new(&scene, settings, guidance).map_err(failed)?;
    let mut remarks = remarks(&campaign, &scene);
    if !options.json {
        remarks.iter().try_for_each(|remark| say(remark))?;
    }
    let store = Store::create(place, campaign.identity(), campaign.columns()).map_err(failed)?;
    let flight = ensemble::Options {
        range: options.range.clone(),
        threads: options.threads,
        width: options.lanes.into(),
    };
    let bar = bars::told("flying", 0);
    let told = Cell::new(false);
    let mut show = |now: ensemble::Progress| {
        bar.set_length(now.wanted_steps);
        bar.set_position(now.steps);
        bar.set_message(format!("{}/{} samples", now.done, now.wanted));
    };
    let stop = || {
        let stop = shutdown.requested();
        if stop && !told.replace(true) {
            // It ends all the same where nobody reads this.
            let _ = bar.suspend(|| writeln!(io::stderr(), "{ENDING}"));
        }
        stop
    };
    let flown = ensemble::run(&campaign, &store, &flight, &stop, &mut show);
    bar.finish_and_clear();
    let flown = flown.map_err(failed)?;
    if flown.kept > 0 {
        let kept = format!("{} samples were there already", flown.kept);
        if !options.json {
            say(&kept)?;
        }
        remarks.push(kept);
    }
    // Whoever flies the other ranges writes to the same folder.
    let shard = !store.place().is_directory() && flown.wanted < campaign.samples();
    if shard {
        say_place(&store, options.json, &remarks)?;
    } else {
        report(&store, options.json, &remarks)?;
    }
    if flown.is_complete() {
        return Ok(ExitCode::SUCCESS);
    }
    let there = flown.kept + flown.flown;
    Err(NodeError::Runtime(format!(
        "ended after {there} of {} samples; the same command goes on from there",
        flown.wanted
    )))
}

/// The controls of the scene's maneuver: its plan for the nominal scene, made once.
fn guidance(scene: &Scene, shutdown: &Shutdown) -> Result<Guidance, NodeError> {
    if scene.maneuver.is_none() {
        return Ok(Guidance::None);
    }
    let plan = lgvi_planner::plan(scene, &mut |_| !shutdown.requested());
    let plan = plan.map_err(|error| {
        let why = format!("no plan for the maneuver: {error}");
        if shutdown.requested() {
            NodeError::Runtime(why)
        } else {
            NodeError::Input(why)
        }
    })?;
    Ok(lgvi_review::guidance(plan))
}

/// Warnings about how the samples were flown.
fn remarks(campaign: &Campaign<'_>, scene: &Scene) -> Vec<String> {
    let mut remarks = Vec::new();
    if let FlownBy::Simulation { reason } = campaign.flown_by() {
        remarks.push(format!("flown one by one: {reason}"));
    }
    let replans = scene.maneuver.as_ref().and_then(|maneuver| maneuver.replan);
    if replans.is_some() {
        remarks.push("no new plans were made on the way: all samples fly the nominal one".into());
    }
    if !scene.sensors.is_empty() {
        remarks.push("sensors were not read: nobody listens, and no sample depends on them".into());
    }
    let commanded = |body: usize, commands: Commands| {
        let mut maneuver = scene.maneuver.iter();
        maneuver.any(|maneuver| maneuver.body == body && maneuver.commands() == commands)
    };
    let mut bodies = scene.bodies.iter().enumerate();
    let coast = |(index, body): (usize, &NamedBody)| {
        !body.wheels.is_empty() && !commanded(index, Commands::Wheels)
    };
    if bodies.clone().any(coast) {
        remarks.push("reaction wheels coasted: there is no controller".into());
    }
    let shut = |(index, body): (usize, &NamedBody)| {
        !body.thrusters.is_empty() && !commanded(index, Commands::Thrusters)
    };
    if bodies.any(shut) {
        remarks.push("thrusters were shut: there is no controller".into());
    }
    remarks
}
