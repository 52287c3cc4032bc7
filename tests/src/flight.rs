//! `lgvi run` and `lgvi verify`, and what they say.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use lgvi_common::{FlightReport, PlanReport, ReplanReport};
use lgvi_middleware::ros::Qos;
use lgvi_msgs::nav_msgs::Odometry;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::{Finished, Process, World, eventually};

/// Step of `scenes/inclination_change.toml` (s).
pub const INCLINATION_CHANGE_STEP: f64 = 0.902_976 / 1000.0;

/// The epoch of scenes that name none [s since the UNIX epoch].
const J2000: i32 = 946_728_000;

/// What `lgvi run --json` says of a flight.
#[derive(Debug, Deserialize)]
pub struct Summary {
    /// The planner's last iteration.
    pub plan: Option<PlanReport>,
    /// Plans made in flight.
    pub replanned: Option<Replanned>,
    /// What the propagator has flown.
    pub flight: Option<FlightReport>,
    /// Messages that planner and propagator have published, by topic.
    pub published: BTreeMap<String, u64>,
    /// Messages recorded, by topic.
    pub recorded: BTreeMap<String, u64>,
    /// Messages that were published and are not in the bag; none where the two cannot be compared.
    pub lost: Option<u64>,
    /// Why they cannot.
    pub lost_unknown: Option<String>,
    /// The closed bag.
    pub bag: Option<PathBuf>,
    /// What went wrong.
    pub failure: Option<Failure>,
}

/// What has become of plans made in flight.
#[derive(Debug, Deserialize)]
pub struct Replanned {
    /// Plans published.
    pub published: u64,
    /// Times when the old plan was kept.
    pub kept: u64,
    /// Each of both, in their order.
    pub replans: Vec<ReplanReport>,
}

/// The first thing that went wrong in a flight.
#[derive(Debug, Deserialize)]
pub struct Failure {
    /// What it was, and which node it befell.
    pub message: String,
    /// The exit code that it called for.
    pub exit_code: u8,
}

/// What `lgvi verify --json` says of a bag.
#[derive(Debug, Deserialize)]
pub struct Verdict {
    /// Control sequences that were flown.
    pub sequences: usize,
    /// Resets, and states set.
    pub interventions: usize,
    /// States compared, the differing one included.
    pub states: u64,
    /// The first difference.
    pub difference: Option<Difference>,
}

/// Where a recorded flight and its repetition differ.
#[derive(Debug, Deserialize)]
pub struct Difference {
    /// Step of the state.
    pub step: u64,
    /// The body.
    pub body: String,
    /// The field, with its index.
    pub field: String,
}

impl World {
    /// Starts `lgvi run` into a bag of this world, with further arguments.
    pub fn start_flight(&self, scene: &Path, bag: &str, arguments: &[&str]) -> Process {
        let bag = self.path(bag);
        let mut line = vec![
            "run".as_ref(),
            scene.as_os_str(),
            "--output".as_ref(),
            bag.as_os_str(),
        ];
        line.push("--json".as_ref());
        line.extend(arguments.iter().map(AsRef::<std::ffi::OsStr>::as_ref));
        self.lgvi(line)
    }

    /// Flies a scene as fast as possible to its end without loss; returns its bag too.
    #[track_caller]
    pub fn fly_fast(&self, scene: &Path, bag: &str) -> (Summary, PathBuf) {
        let path = self.path(bag);
        let (run, to) = ("run".as_ref(), "--output".as_ref());
        let mut line = vec![run, scene.as_os_str(), to, path.as_os_str()];
        let arguments = ["--json", "--no-plot", "--real-time-factor", "0"];
        line.extend(arguments.map(AsRef::<std::ffi::OsStr>::as_ref));
        let summary: Summary = self.lgvi(line).finish().expect(0).json();
        assert_eq!(summary.lost, Some(0), "messages lost");
        (summary, path)
    }

    /// Flies a scene to its end without loss; returns its bag too.
    #[track_caller]
    pub fn fly(&self, scene: &Path, bag: &str) -> (Summary, PathBuf) {
        let summary: Summary = self.start_flight(scene, bag, &[]).finish().expect(0).json();
        assert_eq!(summary.lost, Some(0), "messages lost");
        assert_eq!(summary.bag, Some(self.path(bag)));
        (summary, self.path(bag))
    }

    /// Waits until a flight of `scenes/inclination_change.toml` under way has published the odometry of `step`.
    #[track_caller]
    pub fn await_step(&self, step: u64) {
        let observer = self.ros_node("observer");
        let topic = "/lgvi_propagator/odometry/spacecraft";
        let odometry = observer
            .subscription::<Odometry>(topic, &Qos::sensor(10))
            .expect("a subscription");
        let seconds = step as f64 * INCLINATION_CHANGE_STEP;
        eventually(&format!("step {step} of the flight"), || {
            let stamp = odometry.take().expect("odometry")?.message.header.stamp;
            let since_epoch = f64::from(stamp.sec - J2000) + f64::from(stamp.nanosec) * 1e-9;
            (since_epoch >= seconds).then_some(())
        });
    }

    /// Repeats a recorded flight, which must end with this exit code.
    #[track_caller]
    pub fn verify(&self, bag: &Path, code: i32) -> Verdict {
        let arguments = ["verify".as_ref(), bag.as_os_str(), "--json".as_ref()];
        self.lgvi(arguments).finish().expect(code).json()
    }

    /// Repeats a recorded flight, which must agree in this many states.
    #[track_caller]
    pub fn verify_agrees(&self, bag: &Path, states: u64) {
        let verdict = self.verify(bag, 0);
        assert!(verdict.difference.is_none(), "{verdict:?}");
        assert_eq!(verdict.states, states, "states compared");
    }
}

impl Finished {
    /// Its standard output, which must be one JSON object.
    #[track_caller]
    pub fn json<T: DeserializeOwned>(&self) -> T {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|error| panic!("{}: {error}:\n{}", self.name, self.stdout))
    }
}
