use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use lgvi_dynamics::BodyState;
use lgvi_middleware::ros::{Qos, RosNode, Subscription};
use lgvi_middleware::shm::{ShmNode, StateSubscriber};
use lgvi_msgs::msg::SystemState;
use lgvi_msgs::shm::{BodySample, StateHeader};
use lgvi_node::{NodeError, body_state};
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
    shm: StateSubscriber,
    ros: Option<Subscription<SystemState>>,
    latest: Option<Observed>,
    /// Steps and when they were heard, oldest first, over the last [`WINDOW`].
    marks: VecDeque<(u64, Instant)>,
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
            shm: shm
                .state_subscriber(topic, BUFFER)
                .map_err(NodeError::runtime)?,
            ros: ros.map(subscribe).transpose().map_err(NodeError::runtime)?,
            scene,
            latest: None,
            marks: VecDeque::new(),
        })
    }

    /// Takes in what has come since; whether that was so much that the next look should come soon.
    pub(crate) fn look(&mut self) -> bool {
        let now = Instant::now();
        let (mut taken, mut last) = (0, None);
        while taken < BUFFER {
            match self.shm.receive() {
                Ok(Some(sample)) => {
                    last = Some(sample);
                    taken += 1;
                }
                Ok(None) => break,
                Err(error) => {
                    warn!("{error}");
                    break;
                }
            }
        }
        if let Some(sample) = last {
            self.hear(sample.header(), sample.elements(), now);
        }
        while let Some(ros) = &self.ros {
            match ros.take() {
                Ok(Some(sample)) => match StateHeader::from_message(&sample.message) {
                    Ok((header, bodies)) => self.hear(&header, &bodies, now),
                    Err(error) => warn!("state ignored: {error}"),
                },
                Ok(None) => break,
                Err(error) => {
                    warn!("state ignored: {error}");
                    break;
                }
            }
        }
        taken > BUFFER / 8
    }

    /// Takes note of a state that is newer than those before.
    fn hear(&mut self, header: &StateHeader, bodies: &[BodySample], at: Instant) {
        let step = header.step;
        if self
            .latest
            .as_ref()
            .is_some_and(|latest| latest.step >= step)
        {
            return;
        }
        let Some(observed) = observed(&self.scene, header, bodies, at) else {
            return;
        };
        self.latest = Some(observed);
        self.marks.push_back((step, at));
        while self.marks.len() > 2 && at.duration_since(self.marks[1].1) > WINDOW {
            self.marks.pop_front();
        }
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
