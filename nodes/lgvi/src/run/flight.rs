//! The course of a flight: which node starts when, what is waited for, and how it ends.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::ExitStatus;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use indicatif::HumanDuration;
use lgvi_common::Event;
use lgvi_middleware::Shutdown;
use lgvi_middleware::node::NodeError;
use lgvi_scene::{Commands, Scene};

use super::Options;
use super::flown::{Failure, Flown};
use super::process::{Heard, NodeProcess, Update, death};
use super::progress::Progress;
use super::recording::{recorder, topics};
use crate::NodeKind;
use crate::parameters::{list, path, ros_arguments, text};

/// How often the shutdown is looked for.
const WAIT: Duration = Duration::from_millis(50);

/// How long the recorder may go without a message while some are missing.
const GRACE: Duration = Duration::from_secs(5);

/// Exit code of a flight that was stopped before its end.
pub(crate) const STOPPED: u8 = 130;

/// A flight under way.
struct Course {
    flown: Flown,
    nodes: BTreeMap<NodeKind, NodeProcess>,
    started: BTreeSet<NodeKind>,
    ready: BTreeSet<NodeKind>,
    /// Nodes that have nothing more to say.
    ended: BTreeSet<NodeKind>,
    /// Nodes that have said what they published in all.
    accounted: BTreeSet<NodeKind>,
    /// Gaps that the recorder has seen.
    gaps: u64,
    /// When the bag has grown last.
    grown: Instant,
    sender: Sender<Update>,
    updates: Receiver<Update>,
    progress: Progress,
}

/// Flies the scene in `file` and records it into `bag`. `chosen` is the choice of an automatic integrator. A shutdown ends
/// the flight early; the bag then has its first part.
pub(crate) fn fly(
    options: &Options,
    scene: &Scene,
    file: &Path,
    chosen: Option<&str>,
    bag: &Path,
    shutdown: &Shutdown,
) -> Result<Flown, NodeError> {
    let mut course = Course::new(scene);
    let planned = scene.maneuver.is_some() && !options.no_planner;
    let topics = topics(scene, planned);
    let scene_file = format!("scene:={}", path(file));

    let recorder = recorder(scene, bag, &topics)
        .into_iter()
        .chain(options.files.parameters());
    course.start(NodeKind::Recorder, ros_arguments(recorder))?;
    course.attend(shutdown, |course| {
        course.ready.contains(&NodeKind::Recorder)
    });
    if course.under_way(shutdown) {
        let factor = options.real_time_factor.unwrap_or(default_factor(scene));
        if options.real_time_factor.is_none()
            && planned
            && let Some(note) = long(scene, factor)
        {
            course.progress.say(&note);
        }
        let mut propagator = ros_arguments([
            scene_file.clone(),
            format!("real_time_factor:={factor:?}"),
            "await_subscribers:=1".into(),
            // What is flown is what was asked for, or nothing.
            "stop_on_bad_control:=true".into(),
        ]);
        if let Some(chosen) = text("chosen", chosen) {
            propagator.extend(["-p".into(), chosen]);
        }
        let awaited = [
            list("await_wrench", &options.await_wrench),
            list("await_wheels", &options.await_wheels),
            list("await_thrust", &options.await_thrust),
        ];
        if awaited.iter().any(Option::is_some) {
            let period = format!("control_period:={:?}", options.control_period);
            propagator.extend(["-p".into(), period]);
        }
        for bodies in awaited.into_iter().flatten() {
            propagator.extend(["-p".into(), bodies]);
        }
        let lockstep = planned && factor == 0.0 && replans(scene);
        let lockstep = format!("lockstep:={lockstep}");
        if planned {
            propagator.extend(["-p".into(), lockstep.clone()]);
            propagator.extend(
                ["-r", "~/control_sequence:=/lgvi_planner/control_sequence"].map(Into::into),
            );
            let mut planner = ros_arguments([scene_file, lockstep]);
            planner.extend(["-r", "~/state:=/lgvi_propagator/state"].map(Into::into));
            course.start(NodeKind::Planner, planner)?;
        }
        course.start(NodeKind::Propagator, propagator)?;
        let maneuver = scene.maneuver.as_ref().filter(|_| !planned);
        let steered = maneuver.map(|maneuver| &scene.bodies[maneuver.body].name);
        let awaited = match maneuver {
            Some(maneuver) => match maneuver.commands() {
                Commands::Loads => &options.await_wrench,
                Commands::Thrusters => &options.await_thrust,
                Commands::Wheels => &options.await_wheels,
            },
            None => &options.await_wrench,
        };
        if steered.is_some_and(|body| !awaited.contains(body)) {
            let planned = maneuver.iter().flat_map(|maneuver| maneuver.planned());
            let names = planned.map(|planned| scene.bodies[planned.body].name.as_str());
            let names = names.collect::<Vec<_>>().join(", ");
            course.progress.say(&format!(
                "waiting at step 0 for a control sequence for {names} on /lgvi_propagator/control_sequence \
                 (lgvi_msgs/msg/ControlSequence); Ctrl-C ends the wait"
            ));
        }
        course.attend(shutdown, |course| {
            course.flown.flight.is_some() && (course.flown.plan.is_some() || !planned)
        });
        course.grown = Instant::now();
        course.attend(shutdown, Course::caught_up);
    }
    if shutdown.requested() && course.flown.failure.is_none() {
        course.flown.failure = Some(Failure {
            message: "stopped before the end of the flight".into(),
            exit_code: STOPPED,
        });
    }
    let mut flown = course.end();
    hint(&mut flown, bag);
    Ok(flown)
}

/// A flight that takes longer in real time is told of where nobody asked for real time.
const LONG: Duration = Duration::from_secs(600);

/// How long a flight in real time takes, if that is long.
fn long(scene: &Scene, factor: f64) -> Option<String> {
    let takes = Duration::try_from_secs_f64(scene.seconds(scene.steps) / factor).ok()?;
    (takes > LONG).then(|| {
        let takes = HumanDuration(takes);
        format!(
            "the scene replans and is flown in real time, which takes {takes}; with --real-time-factor 0 the flight waits for \
             its plans instead"
        )
    })
}

/// Says how to get back what was recorded, where the recorder has not closed the bag.
fn hint(flown: &mut Flown, bag: &Path) {
    let unclosed = flown.bag.is_none() && bag.is_dir() && !bag.join("metadata.yaml").exists();
    if let Some(failure) = flown.failure.as_mut().filter(|_| unclosed) {
        let hint = format!("lgvi recover {}", bag.display());
        if !failure.message.contains(&hint) {
            failure.message += &format!("; what was recorded can be got back with {hint}");
        }
    }
}

/// As fast as possible, or in real time where it is planned anew on the way, within a deadline.
fn default_factor(scene: &Scene) -> f64 {
    f64::from(u8::from(replans(scene)))
}

/// Whether the scene is planned anew in flight.
fn replans(scene: &Scene) -> bool {
    let maneuver = scene.maneuver.as_ref();
    maneuver.is_some_and(|maneuver| maneuver.replan.is_some())
}

impl Course {
    fn new(scene: &Scene) -> Self {
        let (sender, updates) = channel();
        Self {
            flown: Flown {
                scene: scene.name.clone(),
                ..Flown::default()
            },
            nodes: BTreeMap::new(),
            started: BTreeSet::new(),
            ready: BTreeSet::new(),
            ended: BTreeSet::new(),
            accounted: BTreeSet::new(),
            gaps: 0,
            grown: Instant::now(),
            sender,
            updates,
            progress: Progress::new(scene),
        }
    }

    fn start(&mut self, kind: NodeKind, arguments: Vec<String>) -> Result<(), NodeError> {
        let node = NodeProcess::start(kind, arguments, self.sender.clone())?;
        self.nodes.insert(kind, node);
        self.started.insert(kind);
        Ok(())
    }

    fn under_way(&self, shutdown: &Shutdown) -> bool {
        self.flown.failure.is_none() && !shutdown.requested()
    }

    /// Hears the nodes until `reached`, a failure or the shutdown.
    fn attend(&mut self, shutdown: &Shutdown, reached: impl Fn(&Self) -> bool) {
        while self.under_way(shutdown) && !reached(self) {
            self.hear_next();
        }
    }

    /// Hears the nodes until `reached`, whatever happens.
    fn attend_to_the_end(&mut self, reached: impl Fn(&Self) -> bool) {
        while !reached(self) {
            self.hear_next();
        }
    }

    fn hear_next(&mut self) {
        match self.updates.recv_timeout(WAIT) {
            Ok(update) => self.hear(update),
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
        }
    }

    fn hear(&mut self, (kind, heard): Update) {
        let event = match heard {
            Heard::Event(event) => *event,
            Heard::Nonsense(error) => return self.fail(kind, error),
            Heard::End => {
                self.ended.insert(kind);
                if self.nodes.contains_key(&kind) {
                    self.fail(kind, "ended before the flight was over".into());
                }
                return;
            }
        };
        match event {
            Event::Ready => {
                self.ready.insert(kind);
            }
            Event::Planning(plan) => self.progress.planning(&plan),
            Event::Planned { plan, seconds } => {
                self.progress.planned(&plan);
                self.flown.plan = Some(plan);
                self.flown.planning_seconds = Some(seconds);
            }
            Event::Replanned {
                published,
                kept,
                last,
            } => {
                let replanned = self.flown.replanned.get_or_insert_default();
                replanned.published = published;
                replanned.kept = kept;
                replanned.replans.push(last);
            }
            Event::Flying { step } => self.progress.flying(step),
            Event::Flown(flight) => {
                self.progress.flown(flight.steps);
                self.flown.flight = Some(flight);
            }
            Event::Published { messages } => {
                self.flown.published.extend(messages);
                self.accounted.insert(kind);
            }
            Event::Recording { messages, lost, .. } => {
                if messages != self.flown.recorded {
                    self.grown = Instant::now();
                }
                self.progress.recording(messages.values().sum());
                self.flown.recorded = messages;
                self.gaps = lost;
            }
            Event::Recorded {
                bag,
                messages,
                lost,
                ..
            } => {
                self.flown.bag = Some(bag);
                self.flown.recorded = messages;
                self.gaps = lost;
            }
            Event::Playing { .. } | Event::Played { .. } => {}
            Event::Warned(warning) => self.flown.warn(warning),
            Event::Failed { message } => self.fail(kind, message),
        }
    }

    /// Takes note of the first failure, with the exit code of the node that it befell.
    fn fail(&mut self, kind: NodeKind, mut message: String) {
        let status = self.nodes.remove(&kind).and_then(|mut node| node.stop());
        if let Some(death) = status.and_then(death) {
            message = format!("{message}: {death}");
        }
        let code = status
            .as_ref()
            .and_then(ExitStatus::code)
            .and_then(|code| u8::try_from(code).ok());
        let exit_code = code.filter(|code| *code != 0).unwrap_or(1);
        self.flown.failure.get_or_insert(Failure {
            message: format!("{}: {message}", kind.name()),
            exit_code,
        });
    }

    /// Messages that were published, as far as is known, and have not reached the bag.
    fn missing(&self) -> u64 {
        let recorded = &self.flown.recorded;
        let published = self.flown.published.iter();
        published
            .map(|(topic, published)| {
                published.saturating_sub(recorded.get(topic).copied().unwrap_or(0))
            })
            .sum()
    }

    /// Whether the recorder has all that was published, or has had the time for it.
    fn caught_up(&self) -> bool {
        self.missing() == 0 || self.grown.elapsed() >= GRACE
    }

    /// Messages that are not in the bag: a comparison of what was published with what was recorded, or why there is none.
    fn lost(&self) -> Result<u64, String> {
        if !self.started.contains(&NodeKind::Propagator) {
            return Err("the propagator was not started".into());
        }
        if self.flown.bag.is_none() {
            return Err("the recorder has not closed the bag".into());
        }
        let publishers = [NodeKind::Planner, NodeKind::Propagator];
        let silent = publishers
            .into_iter()
            .find(|kind| self.started.contains(kind) && !self.accounted.contains(kind));
        if let Some(silent) = silent {
            let silent = silent.name();
            return Err(format!("the {silent} has not said what it published"));
        }
        Ok(self.gaps.max(self.missing()))
    }

    /// Ends the nodes, the recorder last and when it has had time to catch up, and hears what they still have to say.
    fn end(mut self) -> Flown {
        for kind in [NodeKind::Planner, NodeKind::Propagator] {
            if let Some(mut node) = self.nodes.remove(&kind) {
                node.stop();
            }
        }
        let mut publishers = self.started.clone();
        publishers.remove(&NodeKind::Recorder);
        self.attend_to_the_end(|course| publishers.is_subset(&course.ended));
        self.grown = Instant::now();
        self.attend_to_the_end(|course| {
            !course.nodes.contains_key(&NodeKind::Recorder) || course.caught_up()
        });
        if let Some(mut node) = self.nodes.remove(&NodeKind::Recorder) {
            node.stop();
        }
        drop(std::mem::replace(&mut self.sender, channel().0));
        while let Ok(update) = self.updates.recv() {
            self.hear(update);
        }
        self.progress.clear();
        match self.lost() {
            Ok(lost) => self.flown.lost = Some(lost),
            Err(why) => {
                self.flown.failure.get_or_insert_with(|| Failure {
                    message: why.clone(),
                    exit_code: 1,
                });
                self.flown.lost_unknown = Some(why);
            }
        }
        self.flown
    }
}

#[cfg(test)]
mod tests {
    use lgvi_common::{Warning, WarningCode, load_scene};

    use super::super::process::listen;
    use super::super::summary::Summary;
    use super::*;

    fn scene(name: &str) -> Scene {
        let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        load_scene(&scenes.join(name)).unwrap()
    }

    fn course() -> Course {
        let mut course = Course::new(&scene("free_body.toml"));
        course
            .started
            .extend([NodeKind::Recorder, NodeKind::Propagator]);
        course
    }

    fn says(course: &mut Course, kind: NodeKind, lines: &str) {
        listen(kind, lines.as_bytes(), &course.sender);
        while let Ok(update) = course.updates.try_recv() {
            course.hear(update);
        }
    }

    const PUBLISHED: &str = r#"{"event":"published","messages":{"/a":3,"/b":2}}"#;

    fn recorded(a: u64, lost: u64) -> String {
        format!(
            r#"{{"event":"recorded","bag":"bag","messages":{{"/a":{a},"/b":2}},"lost":{lost}}}"#
        )
    }

    #[test]
    fn a_report_that_cannot_be_read_is_its_nodes_failure() {
        let mut course = course();
        // What serde_json makes of an infinite number.
        let line = r#"{"event":"planning","iterations":1,"trials":1,"violation":null,"cost":0.0}"#;
        says(&mut course, NodeKind::Planner, line);
        let failure = course.flown.failure.as_ref().unwrap();
        assert_eq!(failure.exit_code, 1);
        assert!(
            failure.message.starts_with("planner: not a report: ")
                && failure.message.contains("null"),
            "{}",
            failure.message
        );
    }

    #[test]
    fn warnings_of_nodes_are_told_once_each() {
        let mut course = course();
        let line = r#"{"event":"warned","code":"long_turn","message":"a body turns"}"#;
        says(&mut course, NodeKind::Propagator, line);
        says(&mut course, NodeKind::Planner, line);
        let flown = &course.flown;
        assert_eq!(
            flown.warnings,
            [Warning::new(WarningCode::LongTurn, "a body turns")]
        );
        assert!(flown.failure.is_none());
        let summary = Summary(&scene("free_body.toml"), flown).to_string();
        assert!(summary.ends_with("\n  warning   a body turns"), "{summary}");
    }

    #[test]
    fn violations_with_a_price_are_told() {
        let mut course = course();
        let line = r#"{"event":"planned","plan":{"iterations":1,"trials":2,"violation":1e-9,"cost":3.0,"soft":SOFT},"seconds":0.1}"#;
        let soft = r#"{"violation":0.25,"paid":0.5}"#;
        for (soft, expected) in [(soft, true), ("null", false)] {
            says(&mut course, NodeKind::Planner, &line.replace("SOFT", soft));
            let summary = Summary(&scene("free_body.toml"), &course.flown).to_string();
            let told = summary.contains("violated by up to 2.50e-1, which costs 0.500000000");
            assert_eq!(told, expected, "{summary}");
        }
    }

    #[test]
    fn lost_is_what_was_published_and_is_not_in_the_bag() {
        for (a, gaps, lost) in [(3, 0, 0), (1, 0, 2), (3, 4, 4), (9, 0, 0)] {
            let mut course = course();
            says(&mut course, NodeKind::Propagator, PUBLISHED);
            says(&mut course, NodeKind::Recorder, &recorded(a, gaps));
            assert_eq!(course.lost(), Ok(lost));
        }
    }

    #[test]
    fn lost_is_unknown_unless_both_sides_are_known() {
        let mut unheard = course();
        says(&mut unheard, NodeKind::Recorder, &recorded(3, 0));
        let why = "the propagator has not said what it published";
        assert_eq!(unheard.lost(), Err(why.into()));

        let mut planned = course();
        planned.started.insert(NodeKind::Planner);
        says(&mut planned, NodeKind::Propagator, PUBLISHED);
        says(&mut planned, NodeKind::Recorder, &recorded(3, 0));
        let why = "the planner has not said what it published";
        assert_eq!(planned.lost(), Err(why.into()));

        let mut open = course();
        says(&mut open, NodeKind::Propagator, PUBLISHED);
        let why = "the recorder has not closed the bag";
        assert_eq!(open.lost(), Err(why.into()));
    }

    #[test]
    fn a_long_flight_in_real_time_is_told_of() {
        let mars = scene("earth_mars.toml");
        let note = long(&mars, 1.0).unwrap();
        assert!(note.contains("which takes 50 weeks;"), "{note}");
        assert_eq!(long(&mars, 0.0), None);
        assert_eq!(long(&scene("tumbling_replan.toml"), 1.0), None);
    }
}
