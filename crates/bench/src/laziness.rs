//! What the propagator costs by who listens: time on the processor of its whole process, a second of flight.

use std::fmt::Display;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use clap::Args;
use lgvi_middleware::ros::{Qos, RawSubscription, RosNode};
use lgvi_middleware::shm::{ShmNode, ShmOptions};
use lgvi_middleware::{Environment, NodeArgs};
use lgvi_msgs::RosMessage;
use lgvi_msgs::lifecycle_msgs::Transition;
use lgvi_msgs::lifecycle_msgs::srv::{ChangeState, ChangeStateRequest};
use lgvi_msgs::msg::{Invariants, SystemState};
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_msgs::tf2_msgs::TFMessage;
use nix::sys::signal::{Signal, kill};
use nix::time::{clock_getcpuclockid, clock_gettime};
use nix::unistd::Pid;

use crate::error::BenchError;
use crate::tables::Table;

/// What is measured.
#[derive(Args)]
pub(crate) struct Options {
    /// Seconds of each flight that are measured.
    #[arg(long, default_value_t = 4.0)]
    seconds: f64,
    /// The DDS domain, which nobody else should use.
    #[arg(long, default_value_t = 100)]
    domain: u16,
}

impl Options {
    /// With flights of so many seconds.
    pub(crate) fn of(seconds: f64) -> Self {
        Self {
            seconds,
            domain: 100,
        }
    }
}

const BODIES: usize = 5;
const RATE: u64 = 1000;

/// Samples or messages that may wait for those who take them.
const DEPTH: usize = 1000;

/// How long anything else may take.
const PATIENCE: Duration = Duration::from_secs(20);

/// How often those who listen look.
const LOOK: Duration = Duration::from_millis(1);

/// Measures, keeps the table `laziness`.
pub(crate) fn run(options: &Options, output: &Path) -> Result<(), BenchError> {
    let directory = std::env::temp_dir().join(format!("lgvi_bench_{}", std::process::id()));
    let measured = prepare(&directory).and_then(|()| measure(options, &directory, output));
    let _ = std::fs::remove_dir_all(&directory);
    measured
}

fn measure(options: &Options, directory: &Path, output: &Path) -> Result<(), BenchError> {
    let bench = Bench {
        directory: directory.into(),
        environment: Environment::localhost(options.domain),
        seconds: options.seconds,
    };
    println!("{BODIES} bodies, {RATE} steps/s; time on the processor of the whole process");
    let mut table = Table::new([
        "node",
        "CPU (ms a second)",
        "to the first",
        "messages taken/s",
    ]);
    let mut first = None;
    for (name, listening) in [
        ("flight, nobody listens", Listening::default()),
        (
            "shared memory",
            Listening {
                shm: true,
                dds: false,
            },
        ),
        (
            "all topics over DDS",
            Listening {
                shm: false,
                dds: true,
            },
        ),
        (
            "shared memory and all topics",
            Listening {
                shm: true,
                dds: true,
            },
        ),
    ] {
        let cost = bench.flight(listening)?;
        let ratio = cost.cpu / *first.get_or_insert(cost.cpu);
        table.row([
            name.to_owned(),
            format!("{:.1}", 1e3 * cost.cpu),
            format!("{ratio:.2}"),
            format!("{:.0}", cost.taken),
        ]);
    }
    for (name, configure) in [("unconfigured", false), ("inactive", true)] {
        let cpu = format!("{:.1}", 1e3 * bench.idle(configure)?);
        table.row([name, &cpu, "", ""]);
    }
    table.keep(output, "laziness")
}

struct Bench {
    directory: PathBuf,
    environment: Environment,
    seconds: f64,
}

/// Who listens.
#[derive(Clone, Copy, Default)]
struct Listening {
    shm: bool,
    dds: bool,
}

struct Cost {
    /// Seconds on the processor a second of flight.
    cpu: f64,
    /// Messages and samples a second.
    taken: f64,
}

impl Bench {
    fn flight(&self, listening: Listening) -> Result<Cost, BenchError> {
        let node = self.propagator("autostart:=true")?;
        let (ros, shm) = (self.ros()?, self.shm()?);
        let listeners = Listeners::start(&ros, &shm, listening)?;
        await_that("a flight that all listen to", || {
            node.step.load(Ordering::Relaxed) > 0 && listeners.heard_all()
        })?;
        let (cpu, step, taken) = (node.cpu()?, node.steps(), listeners.taken());
        thread::sleep(Duration::from_secs_f64(self.seconds));
        let flown = (node.steps() - step) as f64 / RATE as f64;
        let cost = Cost {
            cpu: (node.cpu()? - cpu) / flown,
            taken: (listeners.taken() - taken) as f64 / flown,
        };
        if flown < 0.95 * self.seconds {
            println!(
                "The machine is too busy: {flown} s of {} s were flown",
                self.seconds
            );
        }
        listeners.end();
        Ok(cost)
    }

    /// Seconds on the processor a second.
    fn idle(&self, configure: bool) -> Result<f64, BenchError> {
        let node = self.propagator("autostart:=false")?;
        let ros = self.ros()?;
        let client = ros
            .service_client::<ChangeState>("/lgvi_propagator/change_state")
            .map_err(text)?;
        if !client.wait_for_server(PATIENCE) {
            return Err(text("no propagator was found"));
        }
        if configure {
            let transition = Transition {
                id: Transition::TRANSITION_CONFIGURE,
                ..Transition::default()
            };
            let answer = client.call(&ChangeStateRequest { transition }, PATIENCE);
            if !answer.map_err(text)?.success {
                return Err(text("the propagator cannot be configured"));
            }
        }
        drop((client, ros));
        thread::sleep(Duration::from_secs(1));
        let (begun, cpu) = (Instant::now(), node.cpu()?);
        thread::sleep(Duration::from_secs_f64(self.seconds));
        Ok((node.cpu()? - cpu) / begun.elapsed().as_secs_f64())
    }

    fn propagator(&self, parameter: &str) -> Result<Running, BenchError> {
        let this = std::env::current_exe().map_err(text)?;
        let program = this.with_file_name("lgvi_propagator");
        let scene = format!("scene:={}", self.directory.join(SCENE).display());
        let mut child = Command::new(&program)
            .args(["--supervised", "--ros-args", "-p", &scene, "-p", parameter])
            .env("ROS_DOMAIN_ID", self.environment.domain_id.to_string())
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            .env("LGVI_SHM_ROOT", self.directory.join("shm"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| {
                let program = program.display();
                text(format!(
                    "{program}, which `cargo build -p lgvi` makes: {error}"
                ))
            })?;
        let step = Arc::<AtomicU64>::default();
        if let Some(stdout) = child.stdout.take() {
            let step = Arc::clone(&step);
            thread::spawn(move || {
                for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                    let event: serde_json::Value = serde_json::from_str(&line).unwrap_or_default();
                    if let Some(flown) = event["step"].as_u64() {
                        step.store(flown, Ordering::Relaxed);
                    }
                }
            });
        }
        Ok(Running { child, step })
    }

    fn ros(&self) -> Result<RosNode, BenchError> {
        let (args, _) = NodeArgs::parse("lgvi_bench", []).map_err(text)?;
        RosNode::new(&args, &self.environment).map_err(text)
    }

    fn shm(&self) -> Result<ShmNode, BenchError> {
        let options = ShmOptions {
            domain_id: self.environment.domain_id,
            root: Some(self.directory.join("shm")),
        };
        ShmNode::new("/lgvi_bench", &options).map_err(text)
    }
}

/// A propagator's process, which ends when this is dropped.
struct Running {
    child: Child,
    /// The step that it has told last.
    step: Arc<AtomicU64>,
}

impl Running {
    fn pid(&self) -> Pid {
        Pid::from_raw(self.child.id().cast_signed())
    }

    /// Seconds that it has been on the processor, with all its threads.
    fn cpu(&self) -> Result<f64, BenchError> {
        let time = clock_getcpuclockid(self.pid()).and_then(clock_gettime);
        let time = time.map_err(text)?;
        Ok(time.tv_sec() as f64 + 1e-9 * time.tv_nsec() as f64)
    }

    fn steps(&self) -> u64 {
        self.step.load(Ordering::Relaxed)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // One that has ended is gone already.
        let _ = kill(self.pid(), Signal::SIGINT);
        let _ = self.child.wait();
    }
}

/// Those who listen, each on a thread that takes what comes; the messages that each has taken.
struct Listeners {
    stop: Arc<AtomicBool>,
    taken: Vec<Arc<AtomicU64>>,
    threads: Vec<JoinHandle<()>>,
}

impl Listeners {
    fn start(ros: &RosNode, shm: &ShmNode, listening: Listening) -> Result<Self, BenchError> {
        let mut this = Self {
            stop: Arc::default(),
            taken: Vec::new(),
            threads: Vec::new(),
        };
        if listening.shm {
            let topic = "/lgvi_propagator/state";
            let mut states = shm.state_subscriber(topic, DEPTH).map_err(text)?;
            this.listen(move || states.receive().is_ok_and(|sample| sample.is_some()));
        }
        if listening.dds {
            let mut topics = vec![
                ("/lgvi_propagator/state".to_owned(), SystemState::TYPE_NAME),
                ("/lgvi_propagator/invariants".into(), Invariants::TYPE_NAME),
                ("/tf".into(), TFMessage::TYPE_NAME),
            ];
            topics.extend((0..BODIES).map(|body| {
                (
                    format!("/lgvi_propagator/odometry/body{body}"),
                    Odometry::TYPE_NAME,
                )
            }));
            for (topic, type_name) in topics {
                let subscription: RawSubscription = ros
                    .raw_subscription(&topic, type_name, &Qos::reliable(DEPTH))
                    .map_err(text)?;
                this.listen(move || subscription.take().is_ok_and(|sample| sample.is_some()));
            }
        }
        Ok(this)
    }

    fn listen(&mut self, mut take: impl FnMut() -> bool + Send + 'static) {
        let (stop, taken) = (Arc::clone(&self.stop), Arc::<AtomicU64>::default());
        self.taken.push(Arc::clone(&taken));
        self.threads.push(thread::spawn(move || {
            while !stop.load(Ordering::Relaxed) {
                while take() {
                    taken.fetch_add(1, Ordering::Relaxed);
                }
                thread::sleep(LOOK);
            }
        }));
    }

    fn heard_all(&self) -> bool {
        self.taken
            .iter()
            .all(|taken| taken.load(Ordering::Relaxed) > 0)
    }

    fn taken(&self) -> u64 {
        self.taken
            .iter()
            .map(|taken| taken.load(Ordering::Relaxed))
            .sum()
    }

    fn end(self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads {
            // What it has taken is counted.
            let _ = thread.join();
        }
    }
}

const SCENE: &str = "bodies.toml";

/// Makes the directory and the scene: bodies that tumble freely, for an hour.
fn prepare(directory: &Path) -> Result<(), BenchError> {
    let path = directory.join(SCENE);
    let write = |source| BenchError::Write {
        path: path.clone(),
        source,
    };
    std::fs::create_dir_all(directory.join("shm")).map_err(write)?;
    let mut scene = format!(
        "title = \"Tumbling bodies\"\n[run]\nduration = 3600.0\nsteps = {}\nintegrator = \"lgvi\"\n\
         [publish]\nstate_every = 1\nros_every = 1\n",
        3600 * RATE
    );
    for body in 0..BODIES {
        scene += &format!(
            "[[bodies]]\nname = \"body{body}\"\nmass = 1.0\ninertia = [1.0, 2.0, 3.0]\n\
             position = [{body}.0, 0.0, 0.0]\nvelocity = [0.0, 0.0, 0.0]\n\
             attitude = {{ w = 1, x = 0, y = 0, z = 0 }}\nangular_velocity = [1.0, 0.5, -0.75]\n"
        );
    }
    std::fs::write(&path, scene).map_err(write)
}

fn await_that(awaited: &str, mut condition: impl FnMut() -> bool) -> Result<(), BenchError> {
    let begun = Instant::now();
    while !condition() {
        if begun.elapsed() > PATIENCE {
            return Err(text(format!("waited in vain for {awaited}")));
        }
        thread::sleep(LOOK);
    }
    Ok(())
}

fn text(error: impl Display) -> BenchError {
    BenchError::Nodes(error.to_string())
}
