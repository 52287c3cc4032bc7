//! What the recorder costs, and from which rate on states are lost: its process beside a publisher of states.

mod recorder;

use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use clap::Args;
use lgvi_middleware::shm::{Delivery, ShmNode, ShmOptions, StatePublisher};
use lgvi_msgs::shm::{BodySample, Name, StateHeader};

use self::recorder::Recorder;
use crate::error::BenchError;
use crate::tables::Table;

/// What is measured.
#[derive(Args)]
pub(crate) struct Options {
    /// Seconds of each flight.
    #[arg(long, default_value_t = 30.0)]
    seconds: f64,
    /// Seconds of each burst; 0 for none.
    #[arg(long, default_value_t = 1.0)]
    burst: f64,
    /// The DDS domain, which nobody else should use.
    #[arg(long, default_value_t = 101)]
    domain: u16,
    /// Where the bags are made, and removed again (default: a directory for temporary files).
    #[arg(long)]
    bags: Option<PathBuf>,
}

impl Options {
    /// With flights of so many seconds.
    pub(crate) fn of(seconds: f64) -> Self {
        Self {
            seconds,
            burst: 1.0,
            domain: 101,
            bags: None,
        }
    }
}

const BODIES: usize = 5;
const RATE: f64 = 10_000.0;
const TOPIC: &str = "/lgvi_propagator/state";

/// States after which the numbers repeat: more than a compressor looks back.
const STATES: usize = 4096;

/// How long anything else may take.
const PATIENCE: Duration = Duration::from_secs(30);

/// How often the publisher looks at the time.
const TICK: Duration = Duration::from_micros(100);

/// How long the recorder has to take what waits, before the state that shows it the last gap.
const PAUSE: Duration = Duration::from_millis(300);

/// Measures, keeps the tables `recording` and `recording_bursts`.
pub(crate) fn run(options: &Options, output: &Path) -> Result<(), BenchError> {
    let parent = options.bags.clone().unwrap_or_else(std::env::temp_dir);
    let directory = parent.join(format!("lgvi_recording_{}", std::process::id()));
    std::fs::create_dir_all(directory.join("shm")).map_err(text)?;
    let measured = measure(options, &directory, output);
    let _ = std::fs::remove_dir_all(&directory);
    measured
}

fn measure(options: &Options, directory: &Path, output: &Path) -> Result<(), BenchError> {
    let bench = Bench::new(options, directory)?;
    println!("{BODIES} bodies, {RATE} states/s for {} s", options.seconds);
    let mut table = Table::new([
        "compression",
        "published",
        "recorded",
        "lost",
        "waits",
        "waited (s)",
        "CPU (ms a second)",
        "MB/s",
        "bytes a state",
    ]);
    for compression in ["none", "lz4", "zstd"] {
        let flown = bench.fly(compression, Some(RATE), options.seconds)?;
        table.row([
            compression.to_owned(),
            flown.published.to_string(),
            flown.recorded.to_string(),
            flown.lost.to_string(),
            flown.waits.to_string(),
            format!("{:.3}", flown.waited),
            format!("{:.1}", 1e3 * flown.cpu / flown.seconds),
            format!("{:.2}", 1e-6 * flown.bytes as f64 / flown.seconds),
            format!("{:.0}", flown.bytes as f64 / flown.recorded.max(1) as f64),
        ]);
    }
    table.keep(output, "recording")?;
    if options.burst > 0.0 {
        println!("Bursts of {} s, zstd", options.burst);
        bursts(&bench, options.burst)?.keep(output, "recording_bursts")?;
    }
    Ok(())
}

/// The publisher waits for nobody.
fn bursts(bench: &Bench, seconds: f64) -> Result<Table, BenchError> {
    let mut table = Table::new([
        "states/s",
        "published",
        "recorded",
        "lost",
        "refused by shared memory",
        "published = recorded + lost",
    ]);
    let rates = [20e3, 50e3, 100e3, 200e3, 400e3].map(Some);
    for rate in rates.into_iter().chain([None]) {
        let flown = bench.fly("zstd", rate, seconds)?;
        let exact = flown.published == flown.recorded + flown.lost;
        let all = if rate.is_none() { " (all it can)" } else { "" };
        table.row([
            format!("{:.0}{all}", flown.published as f64 / flown.seconds),
            flown.published.to_string(),
            flown.recorded.to_string(),
            flown.lost.to_string(),
            flown.refused.to_string(),
            if exact { "yes" } else { "NO" }.to_owned(),
        ]);
    }
    Ok(table)
}

struct Bench {
    directory: PathBuf,
    domain: u16,
    states: Vec<[BodySample; BODIES]>,
}

/// What has come of a flight.
#[derive(Default)]
struct Flown {
    published: u64,
    /// States that shared memory had no room for.
    refused: u64,
    recorded: u64,
    lost: u64,
    waits: u64,
    waited: f64,
    /// Of the publisher's loop.
    seconds: f64,
    /// Time of the recorder on the processor meanwhile (s).
    cpu: f64,
    /// Size of the bag.
    bytes: u64,
}

impl Bench {
    fn new(options: &Options, directory: &Path) -> Result<Self, BenchError> {
        let names = (0..BODIES).map(|body| Name::try_from(&*format!("body{body}")));
        let names = names.collect::<Result<Vec<_>, _>>().map_err(text)?;
        let number = |state: usize, body: usize, index: usize| {
            (0.37 * state as f64 + 1.1 * body as f64 + 0.7 * index as f64).sin()
        };
        let body = |state, body: usize| BodySample {
            name: names[body],
            position: std::array::from_fn(|index| number(state, body, index)),
            linear_momentum: std::array::from_fn(|index| number(state, body, 3 + index)),
            attitude: std::array::from_fn(|index| number(state, body, 6 + index)),
            angular_momentum: std::array::from_fn(|index| number(state, body, 15 + index)),
        };
        Ok(Self {
            directory: directory.into(),
            domain: options.domain,
            states: (0..STATES)
                .map(|state| std::array::from_fn(|index| body(state, index)))
                .collect(),
        })
    }

    /// Publishes at `rate`, or as fast as it goes, into a recorder.
    fn fly(&self, compression: &str, rate: Option<f64>, seconds: f64) -> Result<Flown, BenchError> {
        let bag = self.directory.join("bag");
        let options = ShmOptions {
            domain_id: self.domain,
            root: Some(self.directory.join("shm")),
        };
        let shm = ShmNode::new("/lgvi_bench", &options).map_err(text)?;
        let delivery = Delivery::DropNewest;
        let mut publisher = shm.state_publisher(TOPIC, BODIES, delivery).map_err(text)?;
        let parameters = [
            format!("output:={}", bag.display()),
            format!("compression:={compression}"),
            "topics:=[]".into(),
            "log_time:=stamp".into(),
        ];
        let memory = self.directory.join("shm");
        let recorder = Recorder::start(&parameters, self.domain, &memory)?;
        recorder.await_event("ready")?;
        if !publisher.wait_for_subscribers(1, PATIENCE).map_err(text)? {
            return Err(text("the recorder does not subscribe"));
        }
        let mut flown = Flown::default();
        let (begun, cpu) = (Instant::now(), recorder.cpu()?);
        loop {
            let elapsed = begun.elapsed().as_secs_f64();
            if elapsed >= seconds {
                break;
            }
            let due = rate.map_or(flown.published + 100, |rate| (rate * elapsed) as u64);
            while flown.published < due {
                self.publish(&mut publisher, &mut flown)?;
            }
            if rate.is_some() {
                thread::sleep(TICK);
            }
        }
        flown.seconds = begun.elapsed().as_secs_f64();
        thread::sleep(PAUSE);
        flown.cpu = recorder.cpu()? - cpu;
        self.publish(&mut publisher, &mut flown)?;
        let event = recorder.finish()?;
        let count = |key: &str| event[key].as_u64().unwrap_or_default();
        flown.recorded = event["messages"][TOPIC].as_u64().unwrap_or_default();
        (flown.lost, flown.waits) = (count("lost"), count("waits"));
        flown.waited = event["waited"].as_f64().unwrap_or_default();
        flown.bytes = size(&bag)?;
        std::fs::remove_dir_all(&bag).map_err(text)?;
        Ok(flown)
    }

    fn publish(&self, publisher: &mut StatePublisher, flown: &mut Flown) -> Result<(), BenchError> {
        let step = flown.published;
        let header = StateHeader {
            sequence: step,
            step,
            time: step as f64 / RATE,
            stamp_nanoseconds: step.cast_signed() * 100_000,
        };
        let bodies = &self.states[step as usize % STATES];
        let sent = publisher.send(header, bodies);
        flown.refused += sent.map_err(text)?.refused as u64;
        flown.published += 1;
        Ok(())
    }
}

/// Bytes of the files in a directory.
fn size(directory: &Path) -> Result<u64, BenchError> {
    let mut size = 0;
    for entry in std::fs::read_dir(directory).map_err(text)? {
        let metadata = entry.and_then(|entry| entry.metadata());
        size += metadata.map_err(text)?.len();
    }
    Ok(size)
}

fn text(error: impl std::fmt::Display) -> BenchError {
    BenchError::Nodes(error.to_string())
}
