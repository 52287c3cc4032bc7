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

    /// Takes in what has come since.
    pub(crate) fn look(&mut self) {
        let now = Instant::now();
        loop {
            match self.shm.receive() {
                Ok(Some(sample)) => {
                    let (header, bodies) = (*sample.header(), sample.elements());
                    if newer(&self.latest, header.step) {
                        self.latest =
                            observed(&self.scene, &header, bodies, now).or(self.latest.take());
                    }
                }
                Ok(None) => break,
                Err(error) => {
                    warn!("{error}");
                    break;
                }
            }
        }
        while let Some(ros) = &self.ros {
            match ros.take() {
                Ok(Some(sample)) if !newer(&self.latest, sample.message.step) => {}
                Ok(Some(sample)) => match StateHeader::from_message(&sample.message) {
                    Ok((header, bodies)) => {
                        let found = observed(&self.scene, &header, &bodies, now);
                        self.latest = found.or(self.latest.take());
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
        self.mark();
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

    fn mark(&mut self) {
        let Some(Observed { step, at, .. }) = self.latest else {
            return;
        };
        if self.marks.back().is_none_or(|(last, _)| *last < step) {
            self.marks.push_back((step, at));
        }
        while self.marks.len() > 2 && at.duration_since(self.marks[1].1) > WINDOW {
            self.marks.pop_front();
        }
    }
}

fn newer(latest: &Option<Observed>, step: u64) -> bool {
    latest.as_ref().is_none_or(|latest| latest.step < step)
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
