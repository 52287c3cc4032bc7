use std::path::PathBuf;
use std::time::Duration;

use lgvi_middleware::Parameters;
use lgvi_node::{NodeError, load_scene};
use lgvi_scene::Scene;

/// The node's parameters.
pub(crate) struct Config {
    /// `scene`: path of the scene file.
    pub(crate) scene: Scene,
    /// `real_time_factor`: simulated seconds a second; 0 means as fast as possible, without loss.
    pub(crate) real_time_factor: f64,
    /// `await_control`: whether to hold at step 0 until the manoeuvre's control sequence is there; by default where the
    /// scene has a manoeuvre.
    pub(crate) await_control: bool,
    /// `await_subscribers`: how many subscribers each state port must have before the flight begins.
    pub(crate) await_subscribers: usize,
    /// `stop_on_bad_control`: whether a malformed control sequence ends the flight, or is refused and the flight goes on.
    pub(crate) stop_on_bad_control: bool,
    /// `feedback`: whether feedback laws are flown, or their sequences in open loop.
    pub(crate) feedback: bool,
}

/// How long a subscriber that does not keep up is waited for when flying as fast as possible.
pub(crate) const PATIENCE: Duration = Duration::from_secs(5);

impl Config {
    pub(crate) fn take(mut parameters: Parameters) -> Result<Self, NodeError> {
        let scene: Option<PathBuf> = parameters.take("scene").map_err(NodeError::input)?;
        let real_time_factor = parameters
            .take("real_time_factor")
            .map_err(NodeError::input)?
            .unwrap_or(1.0);
        let await_control = parameters.take("await_control").map_err(NodeError::input)?;
        let await_subscribers = parameters
            .take("await_subscribers")
            .map_err(NodeError::input)?;
        let stop_on_bad_control = parameters
            .take("stop_on_bad_control")
            .map_err(NodeError::input)?
            .unwrap_or(true);
        let feedback = parameters
            .take("feedback")
            .map_err(NodeError::input)?
            .unwrap_or(true);
        parameters.finish().map_err(NodeError::input)?;
        let scene = scene.ok_or_else(|| {
            NodeError::Input("parameter \"scene\" is missing, expected a path".into())
        })?;
        if !(real_time_factor >= 0.0 && f64::is_finite(real_time_factor)) {
            return Err(NodeError::Input(format!(
                "parameter \"real_time_factor\" is {real_time_factor}, expected a finite number ≥ 0"
            )));
        }
        let scene = load_scene(&scene)?;
        let await_control = await_control.unwrap_or(scene.maneuver.is_some());
        if await_control && scene.maneuver.is_none() {
            return Err(NodeError::Input(
                "parameter \"await_control\" is true, expected false: the scene has no manoeuvre"
                    .into(),
            ));
        }
        Ok(Self {
            scene,
            real_time_factor,
            await_control,
            await_subscribers: await_subscribers.unwrap_or(0),
            stop_on_bad_control,
            feedback,
        })
    }

    /// Whether nothing may be lost because nothing has to be on time.
    pub(crate) fn lossless(&self) -> bool {
        self.real_time_factor == 0.0
    }
}
