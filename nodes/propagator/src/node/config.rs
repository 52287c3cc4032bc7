use std::time::Duration;

use lgvi_common::{FramePrefix, load_scene, publishes_clock, required_path};
use lgvi_middleware::node::NodeError;
use lgvi_middleware::shm::Delivery;
use lgvi_middleware::{ParameterChange, ParameterSpec, Parameters};
use lgvi_scene::{Commands, Maneuver, Scene};

use crate::node::wrench::Terms;

/// The node's parameters, as they are when it is configured.
pub(crate) struct Config {
    pub(crate) scene: Scene,
    /// Whether to hold at step 0 until the maneuver's control sequence is there.
    pub(crate) await_control: bool,
    /// How many subscribers each state port must have before the flight begins.
    pub(crate) await_subscribers: usize,
    /// Whether a malformed control sequence ends the flight, or is refused and the flight goes on.
    pub(crate) stop_on_bad_control: bool,
    /// Whether feedback laws are flown, or their sequences in open loop.
    pub(crate) feedback: bool,
    /// Whether to hold wherever the scene is planned anew until the plan made there has been accepted.
    pub(crate) lockstep: bool,
    /// Whether `/clock` is published.
    pub(crate) clock: bool,
    /// The bodies on which wrenches are taken, and how these act.
    pub(crate) wrenches: Vec<usize>,
    pub(crate) terms: Option<Terms>,
}

/// Those of the node's parameters that may change in flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rates {
    /// Simulated seconds a second; 0 means as fast as possible, without loss.
    pub(crate) real_time_factor: f64,
    /// Steps between two states over shared memory; 0: as the scene says.
    pub(crate) state_every: u64,
    /// Steps between two states over DDS; 0: as the scene says.
    pub(crate) ros_every: u64,
}

/// Bodies beyond which no wrenches are taken: each has a subscription.
const MOST_WRENCHES: usize = 64;

/// How long a subscriber that does not keep up is waited for when flying as fast as possible.
pub(crate) const PATIENCE: Duration = Duration::from_secs(5);

pub(crate) fn specifications() -> Vec<ParameterSpec> {
    vec![
        ParameterSpec::new("scene", String::new(), "scene file (required)"),
        ParameterSpec::new(
            "real_time_factor",
            1.0,
            "simulated seconds per second; 0: as fast as possible, without loss; ignored with use_sim_time",
        )
        .range(0.0, f64::MAX)
        .change(ParameterChange::Anytime),
        ParameterSpec::new(
            "state_every",
            0_i64,
            "steps between two states over shared memory; 0: publish.state_every of the scene",
        )
        .integer_range(0, i64::MAX)
        .change(ParameterChange::Anytime),
        ParameterSpec::new(
            "ros_every",
            0_i64,
            "steps between two states over ROS 2; 0: publish.ros_every of the scene",
        )
        .integer_range(0, i64::MAX)
        .change(ParameterChange::Anytime),
        ParameterSpec::optional::<bool>(
            "await_control",
            "wait at step 0 for a control sequence of the maneuver's body; not set: if the scene has a maneuver",
        ),
        ParameterSpec::new(
            "await_subscribers",
            0_i64,
            "number of subscribers that states in shared memory, odometry, tf and invariants must each have before step 0",
        )
        .integer_range(0, 1000),
        ParameterSpec::new(
            "stop_on_bad_control",
            false,
            "end the flight at a malformed control sequence; false: refuse the sequence and fly on",
        ),
        ParameterSpec::new(
            "feedback",
            true,
            "apply feedback laws; false: fly their control sequences in open loop",
        ),
        ParameterSpec::new(
            "lockstep",
            false,
            "wait at every replanning until the new plan has been accepted",
        ),
        ParameterSpec::new(
            "chosen",
            String::new(),
            "choice of an automatic integrator, as in a scene's `chosen`; empty: chosen when the node is configured",
        ),
        ParameterSpec::new(
            "wrench_timeout",
            1.0,
            "time for which a wrench or a command for wheels or thrusters acts unless another comes (s); 0: take none",
        )
        .range(0.0, f64::MAX),
        ParameterSpec::new(
            "wrench_delay",
            0.0,
            "time from taking a wrench or a command for wheels or thrusters until it acts (s), rounded to steps",
        )
        .range(0.0, f64::MAX),
        ParameterSpec::new(
            "wrench_max_force",
            f64::INFINITY,
            "greatest force of a wrench (N); larger ones are scaled down",
        )
        .range(0.0, f64::INFINITY),
        ParameterSpec::new(
            "wrench_max_moment",
            f64::INFINITY,
            "greatest moment of a wrench about the center of mass (N m); larger ones are scaled down",
        )
        .range(0.0, f64::INFINITY),
        ParameterSpec::new(
            "await_wrench",
            Vec::<String>::new(),
            "bodies whose controllers the flight waits for: at the beginning of each control period until a wrench with the \
             stamp of the state has come",
        ),
        ParameterSpec::new(
            "await_wheels",
            Vec::<String>::new(),
            "the same for torques of the wheels of these bodies",
        ),
        ParameterSpec::new(
            "await_thrust",
            Vec::<String>::new(),
            "the same for forces of the thrusters of these bodies",
        ),
        ParameterSpec::new(
            "control_period",
            0.02,
            "control period with await_wrench, await_wheels or await_thrust (s), a whole number of steps",
        )
        .range(0.0, f64::MAX),
        ParameterSpec::new(
            "control_deadline",
            10.0,
            "how long each command but the first is waited for with await_wrench, await_wheels or await_thrust (s); then the \
             flight goes on",
        )
        .range(0.0, f64::MAX),
        ParameterSpec::new("clock", false, "publish the flight's time on /clock"),
        FramePrefix::specification(),
    ]
}

impl Config {
    pub(crate) fn read(parameters: &Parameters) -> Result<Self, NodeError> {
        let scene = required_path(parameters, "scene")?;
        let clock = publishes_clock(parameters)?;
        let mut scene = load_scene(&scene)?;
        let chosen: String = parameters.get("chosen")?;
        if !chosen.is_empty() {
            scene = scene.decided(&chosen).map_err(NodeError::input)?;
        }
        let maneuver = scene.maneuver.as_ref();
        let awaited = match maneuver {
            Some(maneuver) => match maneuver.commands() {
                Commands::Loads => "await_wrench",
                Commands::Thrusters => "await_thrust",
                Commands::Wheels => "await_wheels",
            },
            None => "await_wrench",
        };
        let awaited: Vec<String> = parameters.get(awaited)?;
        let steered = maneuver.map(|maneuver| &scene.bodies[maneuver.body].name);
        let await_control = parameters
            .get_optional("await_control")?
            .unwrap_or(steered.is_some_and(|body| !awaited.contains(body)));
        if await_control && scene.maneuver.is_none() {
            return Err(NodeError::Input(
                "parameter \"await_control\" is true, expected false: the scene has no maneuver"
                    .into(),
            ));
        }
        let lockstep: bool = parameters.get("lockstep")?;
        let replan = scene.maneuver.as_ref().and_then(|maneuver| maneuver.replan);
        if lockstep && replan.is_none() {
            return Err(NodeError::Input(
                "parameter \"lockstep\" is true, expected false: the scene does not replan".into(),
            ));
        }
        let await_subscribers: i64 = parameters.get("await_subscribers")?;
        let terms = Terms::read(parameters, &scene)?;
        let wrenches = match terms {
            Some(_) => movable(&scene, lockstep),
            None => Vec::new(),
        };
        Ok(Self {
            scene,
            await_control,
            await_subscribers: usize::try_from(await_subscribers).map_err(NodeError::input)?,
            stop_on_bad_control: parameters.get("stop_on_bad_control")?,
            feedback: parameters.get("feedback")?,
            lockstep,
            clock,
            wrenches,
            terms,
        })
    }
}

/// The bodies that loads can move, if they are not so many that nobody flies them one by one. In lockstep with their planner,
/// planned bodies follow plans alone.
fn movable(scene: &Scene, lockstep: bool) -> Vec<usize> {
    let maneuver = scene.maneuver.as_ref().filter(|_| lockstep);
    let is_planned = |index| {
        let mut planned = maneuver.into_iter().flat_map(Maneuver::planned);
        planned.any(|planned| planned.body == index)
    };
    let bodies = scene.bodies.iter().enumerate();
    let movable: Vec<_> = bodies
        .filter(|(index, body)| !is_planned(*index) && !body.body.mobility().is_given())
        .map(|(index, _)| index)
        .collect();
    if movable.len() > MOST_WRENCHES {
        Vec::new()
    } else {
        movable
    }
}

impl Rates {
    pub(crate) fn read(parameters: &Parameters, scene: &Scene) -> Result<Self, NodeError> {
        let every = |name: &str, scene: u64| {
            let every: i64 = parameters.get(name)?;
            Ok::<u64, NodeError>(match u64::try_from(every).map_err(NodeError::input)? {
                0 => scene,
                every => every,
            })
        };
        let publishing = scene.publishing;
        Ok(Self {
            real_time_factor: parameters.get("real_time_factor")?,
            state_every: every("state_every", publishing.state_every)?,
            ros_every: every("ros_every", publishing.ros_every)?,
        })
    }

    /// Whether nothing may be lost because nothing has to be on time.
    pub(crate) fn lossless(&self) -> bool {
        self.real_time_factor == 0.0
    }

    /// How states go over shared memory.
    pub(crate) fn delivery(&self) -> Delivery {
        if self.lossless() {
            Delivery::Lossless { patience: PATIENCE }
        } else {
            Delivery::DropNewest
        }
    }
}
