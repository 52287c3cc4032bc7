//! The course of a flight: which node starts when, what is waited for, and how it ends.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{ExitCode, ExitStatus};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use lgvi_middleware::Shutdown;
use lgvi_node::{Event, FlightReport, NodeError, PlanReport};
use lgvi_scene::Scene;
use serde::Serialize;

use super::process::{NodeProcess, Update};
use super::progress::Progress;
use super::{Options, ros_arguments, yaml};
use crate::NodeKind;

/// How often the shutdown is looked for.
const WAIT: Duration = Duration::from_millis(50);

/// How long the recorder may go without a message while some are missing.
const GRACE: Duration = Duration::from_secs(5);

/// How a flight went.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Flown {
    pub(crate) scene: String,
    pub(crate) plan: Option<PlanReport>,
    /// Wall-clock time of the plan (s).
    pub(crate) planning_seconds: Option<f64>,
    pub(crate) flight: Option<FlightReport>,
    /// Messages recorded, by topic.
    pub(crate) recorded: BTreeMap<String, u64>,
    /// Messages that were published and are not in the bag.
    pub(crate) lost: u64,
    /// The bag, once it is closed.
    pub(crate) bag: Option<PathBuf>,
    /// The picture of the flight, once it is drawn.
    pub(crate) picture: Option<PathBuf>,
    /// What went wrong, and the exit code that it calls for.
    pub(crate) failure: Option<Failure>,
}

/// The first thing that went wrong.
#[derive(Debug, Serialize)]
pub(crate) struct Failure {
    pub(crate) message: String,
    pub(crate) exit_code: u8,
}

impl Flown {
    pub(crate) fn exit_code(&self) -> ExitCode {
        let lost = u8::from(self.lost > 0);
        ExitCode::from(
            self.failure
                .as_ref()
                .map_or(lost, |failure| failure.exit_code),
        )
    }
}

/// A flight under way.
struct Course {
    flown: Flown,
    nodes: BTreeMap<NodeKind, NodeProcess>,
    ready: Vec<NodeKind>,
    published: BTreeMap<String, u64>,
    heard: Instant,
    sender: Sender<Update>,
    updates: Receiver<Update>,
    progress: Progress,
}

/// Flies `scene` into `bag`; a shutdown ends it early, with what was recorded until then.
pub(crate) fn fly(
    options: &Options,
    scene: &Scene,
    bag: &Path,
    shutdown: &Shutdown,
) -> Result<Flown, NodeError> {
    let (sender, updates) = channel();
    let mut course = Course {
        flown: Flown {
            scene: scene.name.clone(),
            ..Flown::default()
        },
        nodes: BTreeMap::new(),
        ready: Vec::new(),
        published: BTreeMap::new(),
        heard: Instant::now(),
        sender,
        updates,
        progress: Progress::new(scene),
    };
    let planned = scene.maneuver.is_some() && !options.no_planner;
    let topics = topics(scene, planned);
    let scene_file = format!("scene:={}", yaml(&options.scene));

    course.start(
        NodeKind::Recorder,
        ros_arguments(recorder(scene, bag, &topics)),
    )?;
    course.attend(shutdown, |course| {
        course.ready.contains(&NodeKind::Recorder)
    });
    if course.under_way(shutdown) {
        let mut propagator = ros_arguments([
            scene_file.clone(),
            format!("real_time_factor:={:?}", options.real_time_factor),
            "await_subscribers:=1".into(),
        ]);
        if planned {
            propagator.extend(
                ["-r", "~/control_sequence:=/lgvi_planner/control_sequence"].map(Into::into),
            );
            course.start(NodeKind::Planner, ros_arguments([scene_file]))?;
        }
        course.start(NodeKind::Propagator, propagator)?;
        course.attend(shutdown, |course| {
            course.flown.flight.is_some() && (course.flown.plan.is_some() || !planned)
        });
        course.heard = Instant::now();
        course.attend(shutdown, |course| {
            course.missing() == 0 || course.heard.elapsed() >= GRACE
        });
    }
    if shutdown.requested() && course.flown.failure.is_none() {
        course.flown.failure = Some(Failure {
            message: "stopped before the end of the flight".into(),
            exit_code: 130,
        });
    }
    Ok(course.end())
}

/// The topics that are recorded from DDS, with their types. Full-rate states come from shared memory.
fn topics(scene: &Scene, planned: bool) -> Vec<(String, &'static str)> {
    let mut topics = vec![
        ("/lgvi_propagator/scene".into(), "lgvi_msgs/msg/Scene"),
        (
            "/lgvi_propagator/flown_control".into(),
            "lgvi_msgs/msg/ControlSequence",
        ),
        (
            "/lgvi_propagator/invariants".into(),
            "lgvi_msgs/msg/Invariants",
        ),
        ("/tf".into(), "tf2_msgs/msg/TFMessage"),
    ];
    for body in &scene.bodies {
        topics.push((
            format!("/lgvi_propagator/odometry/{}", body.name),
            "nav_msgs/msg/Odometry",
        ));
    }
    if planned {
        topics.extend([
            (
                "/lgvi_planner/control_sequence".into(),
                "lgvi_msgs/msg/ControlSequence",
            ),
            (
                "/lgvi_planner/progress".into(),
                "lgvi_msgs/msg/PlanProgress",
            ),
            ("/lgvi_planner/planned_path".into(), "nav_msgs/msg/Path"),
        ]);
    }
    topics
}

fn recorder(scene: &Scene, bag: &Path, topics: &[(String, &str)]) -> [String; 4] {
    let topics: Vec<_> = topics
        .iter()
        .map(|(name, kind)| format!("'{name}={kind}'"))
        .collect();
    [
        format!("output:={}", yaml(bag)),
        format!("topics:=[{}]", topics.join(", ")),
        format!("frame:={}", scene.frame),
        "use_sim_time:=true".into(),
    ]
}

impl Course {
    fn start(&mut self, kind: NodeKind, arguments: Vec<String>) -> Result<(), NodeError> {
        let node = NodeProcess::start(kind, arguments, self.sender.clone())?;
        self.nodes.insert(kind, node);
        Ok(())
    }

    fn under_way(&self, shutdown: &Shutdown) -> bool {
        self.flown.failure.is_none() && !shutdown.requested()
    }

    /// Hears the nodes until `reached`, a failure or the shutdown.
    fn attend(&mut self, shutdown: &Shutdown, reached: impl Fn(&Self) -> bool) {
        while self.under_way(shutdown) && !reached(self) {
            match self.updates.recv_timeout(WAIT) {
                Ok(update) => self.hear(update),
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
            }
        }
    }

    fn hear(&mut self, (kind, event): Update) {
        match event {
            Some(Event::Ready) => self.ready.push(kind),
            Some(Event::Planning(plan)) => self.progress.planning(&plan),
            Some(Event::Planned {
                plan,
                seconds,
                published,
            }) => {
                self.progress.planned(&plan);
                self.flown.plan = Some(plan);
                self.flown.planning_seconds = Some(seconds);
                self.published.extend(published);
            }
            Some(Event::Flying { step }) => self.progress.flying(step),
            Some(Event::Flown(flight)) => {
                self.progress.flown(flight.steps);
                self.published.extend(flight.published.clone());
                self.flown.flight = Some(flight);
            }
            Some(Event::Recording { messages, lost }) => {
                if messages != self.flown.recorded {
                    self.heard = Instant::now();
                }
                self.progress.recording(messages.values().sum());
                self.flown.recorded = messages;
                self.flown.lost = lost;
            }
            Some(Event::Recorded { bag, lost, .. }) => {
                self.flown.bag = Some(bag);
                self.flown.lost = lost;
            }
            Some(Event::Played { .. }) => {}
            Some(Event::Failed { message }) => self.fail(kind, message),
            None if self.nodes.contains_key(&kind) => {
                self.fail(kind, "ended before the flight was over".into());
            }
            None => {}
        }
    }

    /// Takes note of the first failure, with the exit code of the node that it befell.
    fn fail(&mut self, kind: NodeKind, message: String) {
        let status = self.nodes.remove(&kind).and_then(|mut node| node.stop());
        let code = status
            .as_ref()
            .and_then(ExitStatus::code)
            .and_then(|code| u8::try_from(code).ok());
        let exit_code = code.filter(|code| *code != 0).unwrap_or(1);
        let node = format!("{kind:?}").to_lowercase();
        self.flown.failure.get_or_insert(Failure {
            message: format!("{node}: {message}"),
            exit_code,
        });
    }

    /// Messages that were published on recorded topics and have not reached the bag.
    fn missing(&self) -> u64 {
        let recorded = &self.flown.recorded;
        let each = self.published.iter().map(|(topic, published)| {
            published.saturating_sub(recorded.get(topic).copied().unwrap_or(0))
        });
        each.sum()
    }

    /// Ends the nodes, the recorder last, and hears what they still have to say.
    fn end(mut self) -> Flown {
        for kind in [NodeKind::Planner, NodeKind::Propagator, NodeKind::Recorder] {
            if let Some(mut node) = self.nodes.remove(&kind) {
                node.stop();
            }
        }
        drop(std::mem::replace(&mut self.sender, channel().0));
        while let Ok(update) = self.updates.recv() {
            self.hear(update);
        }
        self.progress.clear();
        self.flown.lost = self.flown.lost.max(self.missing());
        self.flown
    }
}
