use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use lgvi_common::body_state;
use lgvi_dynamics::BodyState;
use lgvi_middleware::node::NodeError;
use lgvi_middleware::ros::{Qos, RosNode, Subscription};
use lgvi_middleware::shm::{ShmNode, StateSubscriber};
use lgvi_msgs::msg::SystemState;
use lgvi_msgs::shm::{BodySample, StateHeader};
use lgvi_scene::Scene;
use tracing::warn;

/// States that may wait.
const BUFFER: usize = 1024;

/// How far back the pace is measured.
const WINDOW: Duration = Duration::from_secs(1);

/// The least time over which it is.
const SPAN: Duration = Duration::from_millis(20);

/// What the flight was last heard of.
#[derive(Clone, Debug)]
pub(crate) struct Observed {
    /// Steps made.
    pub(crate) step: u64,
    /// The bodies' states then.
    pub(crate) states: Vec<BodyState>,
    /// When it was heard.
    pub(crate) at: Instant,
}

/// Follows a flight by its states, over shared memory and, where asked for, over DDS.
pub(crate) struct Follower {
    scene: Arc<Scene>,
    topic: String,
    node: ShmNode,
    /// While it follows: one that takes nothing would have a flight wait that is to lose nothing.
    shm: Option<StateSubscriber>,
    ros: Option<Subscription<SystemState>>,
    /// What has come over shared memory, and over DDS.
    shm_lane: Lane,
    ros_lane: Lane,
    /// How many times the flight has restarted.
    course: u64,
    latest: Option<Observed>,
    /// Steps and when they were heard, oldest first, over the last [`WINDOW`].
    marks: VecDeque<(u64, Instant)>,
}

/// A way by which states come, one after the other. Those of two ways may be far apart.
#[derive(Clone, Copy, Debug, Default)]
struct Lane {
    /// The last state's step.
    last: Option<u64>,
    /// How many times the step has become lower: the flight has restarted.
    course: u64,
}

impl Lane {
    /// Takes note of the next state; whether it is one of the step before, which has been changed.
    fn pass(&mut self, step: u64) -> bool {
        let last = self.last.replace(step);
        self.course += u64::from(last.is_some_and(|last| step < last));
        last == Some(step)
    }
}

impl Follower {
    pub(crate) fn open(
        scene: Arc<Scene>,
        topic: &str,
        shm: &ShmNode,
        ros: Option<&RosNode>,
    ) -> Result<Self, NodeError> {
        let subscribe = |ros: &RosNode| ros.subscription(topic, &Qos::sensor(8));
        Ok(Self {
            topic: topic.to_owned(),
            node: shm.clone(),
            shm: None,
            ros: ros.map(subscribe).transpose()?,
            scene,
            shm_lane: Lane::default(),
            ros_lane: Lane::default(),
            course: 0,
            latest: None,
            marks: VecDeque::new(),
        })
    }

    /// Begins to follow, or goes on.
    pub(crate) fn begin(&mut self) -> Result<(), NodeError> {
        self.shm = Some(self.node.state_subscriber(&self.topic, BUFFER)?);
        Ok(())
    }

    /// Follows no more for now.
    pub(crate) fn end(&mut self) {
        self.shm = None;
    }

    /// Takes in what has come since, over shared memory up to a state of a step that `stops`; whether that was so much that
    /// the next look should come soon.
    pub(crate) fn look(&mut self, stops: impl Fn(u64) -> bool) -> bool {
        let now = Instant::now();
        let (mut taken, mut last, mut stopped) = (0, None, false);
        while let Some(shm) = self.shm.as_mut().filter(|_| taken < BUFFER && !stopped) {
            match shm.receive() {
                Ok(Some(sample)) => {
                    let step = sample.header().step;
                    let changed = self.shm_lane.pass(step);
                    last = Some((sample, changed));
                    taken += 1;
                    stopped = stops(step);
                }
                Ok(None) => break,
                Err(error) => {
                    warn!("{error}");
                    break;
                }
            }
        }
        if let Some((sample, changed)) = last {
            let arrival = (self.shm_lane.course, changed, now);
            self.hear(sample.header(), sample.elements(), arrival);
        }
        while let Some(ros) = &self.ros {
            match ros.take() {
                Ok(Some(sample)) => match StateHeader::from_message(&sample.message) {
                    Ok((header, bodies)) => {
                        let changed = self.ros_lane.pass(header.step);
                        let arrival = (self.ros_lane.course, changed, now);
                        self.hear(&header, &bodies, arrival);
                    }
                    Err(error) => warn!("state ignored: {error}"),
                },
                Ok(None) => break,
                Err(error) => {
                    warn!("state ignored: {error}");
                    break;
                }
            }
        }
        stopped || taken > BUFFER / 8
    }

    /// Takes note of a state, with the course of the way by which it has come, whether it is a change of the one before,
    /// and when it was heard, if it is newer than those before.
    fn hear(
        &mut self,
        header: &StateHeader,
        bodies: &[BodySample],
        (course, changed, at): (u64, bool, Instant),
    ) {
        let step = header.step;
        let known = self.latest.as_ref().filter(|_| course == self.course);
        let old =
            known.is_some_and(|latest| latest.step > step || (latest.step == step && !changed));
        if old || course < self.course {
            return;
        }
        let Some(observed) = observed(&self.scene, header, bodies, at) else {
            return;
        };
        if course > self.course {
            self.course = course;
            self.marks.clear();
        }
        self.latest = Some(observed);
        self.marks.push_back((step, at));
        while self.marks.len() > 2 && at.duration_since(self.marks[1].1) > WINDOW {
            self.marks.pop_front();
        }
    }

    /// How many times the flight has restarted at step 0.
    pub(crate) fn course(&self) -> u64 {
        self.course
    }

    /// The last state heard.
    pub(crate) fn latest(&self) -> Option<&Observed> {
        self.latest.as_ref()
    }

    /// Steps a second of wall-clock time; `None` before there are enough states to tell.
    pub(crate) fn pace(&self) -> Option<f64> {
        let (&(from, start), &(to, end)) = (self.marks.front()?, self.marks.back()?);
        let span = end.duration_since(start);
        (span >= SPAN && to > from).then(|| (to - from) as f64 / span.as_secs_f64())
    }
}

/// A state of this scene; `None`, with a warning, of another.
fn observed(
    scene: &Scene,
    header: &StateHeader,
    bodies: &[BodySample],
    at: Instant,
) -> Option<Observed> {
    let names = bodies.iter().map(|body| body.name.as_str());
    let expected = scene.bodies.iter().map(|body| body.name.as_str());
    if !names.eq(expected) {
        warn!(
            "state of step {} ignored: its bodies are not the scene's",
            header.step
        );
        return None;
    }
    if header.step > scene.steps || !bodies.iter().all(BodySample::is_finite) {
        warn!(
            "state of step {} ignored: not one of this flight",
            header.step
        );
        return None;
    }
    Some(Observed {
        step: header.step,
        states: bodies
            .iter()
            .map(|body| body_state(body, &scene.units))
            .collect(),
        at,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lower_step_begins_a_course_and_the_same_is_a_changed_state() {
        let mut lane = Lane::default();
        let passed = [0, 5, 5, 9, 0, 0, 3, 2].map(|step| (lane.pass(step), lane.course));
        let expected = [
            (false, 0),
            (false, 0),
            (true, 0),
            (false, 0),
            (false, 1),
            (true, 1),
            (false, 1),
            (false, 2),
        ];
        assert_eq!(passed, expected);
    }
}
