//! ROS messages of a state.

use lgvi_common::{body_sample, header, pose};
use lgvi_dynamics::{ActuatorStates, BodyState, RigidBody, System};
use lgvi_msgs::geometry_msgs::{
    Inertia, InertiaStamped, PoseWithCovariance, Twist, TwistWithCovariance, Vector3,
};
use lgvi_msgs::msg::{self, SystemState};
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_msgs::sensor_msgs::JointState;
use lgvi_msgs::shm::{ConversionError, Name, StateHeader};
use lgvi_msgs::stamp::StampError;
use lgvi_msgs::std_msgs::Header;
use lgvi_scene::Scene;

use crate::Flight;

/// A state of all bodies, in the scene's units.
#[derive(Clone)]
pub(crate) struct Snapshot {
    pub(crate) step: u64,
    pub(crate) states: Vec<BodyState>,
    pub(crate) actuators: ActuatorStates,
    /// Whether it has been published before: then only joint states and odometry are.
    pub(crate) again: bool,
}

impl Snapshot {
    /// One of the scene's first state.
    pub(crate) fn new(scene: &Scene) -> Self {
        Self {
            step: 0,
            states: scene.bodies.iter().map(|body| body.state).collect(),
            actuators: ActuatorStates::of(&scene.system()),
            again: false,
        }
    }

    /// Takes the present state of a flight.
    pub(crate) fn take(&mut self, flight: &Flight) {
        self.step = flight.step();
        self.states.copy_from_slice(flight.states());
        self.actuators.take(flight.system());
    }
}

/// The header of the `sequence`-th state sample, taken at `step`.
pub(crate) fn state_header(scene: &Scene, step: u64, sequence: u64) -> StateHeader {
    StateHeader {
        sequence,
        step,
        time: scene.seconds(step),
        stamp_nanoseconds: scene.stamp(step),
    }
}

pub(crate) fn system_state(
    scene: &Scene,
    names: &[Name],
    snapshot: &Snapshot,
    sequence: u64,
) -> Result<SystemState, ConversionError> {
    let samples: Vec<_> = names
        .iter()
        .zip(&snapshot.states)
        .map(|(&name, state)| body_sample(name, state, &scene.units))
        .collect();
    state_header(scene, snapshot.step, sequence).to_message(&samples, &scene.frame)
}

/// That the course of a flight has been changed at its present step, by setting the states of `bodies` as they were given.
pub(crate) fn intervention(
    scene: &Scene,
    flight: &Flight,
    kind: u8,
    controls: u64,
    bodies: Vec<msg::BodyState>,
) -> Result<msg::Intervention, StampError> {
    let step = flight.step();
    Ok(msg::Intervention {
        header: header(scene, step)?,
        kind,
        step,
        controls,
        bodies,
    })
}

/// Pose in the inertial frame, twist in the body's (REP 105). `rigid` is the body in its present state.
pub(crate) fn odometry(
    scene: &Scene,
    rigid: &RigidBody,
    body: usize,
    snapshot: &Snapshot,
) -> Result<Odometry, StampError> {
    let state = &snapshot.states[body];
    let named = &scene.bodies[body];
    let units = &scene.units;
    let velocity = state.attitude.tr_mul(&state.velocity(rigid)) * (units.length / units.time);
    let angular_velocity = state.angular_velocity(rigid) / units.time;
    Ok(Odometry {
        header: header(scene, snapshot.step)?,
        child_frame_id: named.frame.clone(),
        pose: PoseWithCovariance {
            pose: pose(state, units),
            covariance: [0.0; 36],
        },
        twist: TwistWithCovariance {
            twist: Twist {
                linear: vector(velocity.into()),
                angular: vector(angular_velocity.into()),
            },
            covariance: [0.0; 36],
        },
    })
}

/// A header in the frame of a body.
fn header_of_body(scene: &Scene, body: usize, snapshot: &Snapshot) -> Result<Header, StampError> {
    Ok(Header {
        frame_id: scene.bodies[body].frame.clone(),
        ..header(scene, snapshot.step)?
    })
}

/// The wheels of a body, which the system has in their present state: angles, speeds and torques.
pub(crate) fn joint_state(
    scene: &Scene,
    system: &System,
    body: usize,
    snapshot: &Snapshot,
) -> Result<JointState, StampError> {
    let mut message = JointState {
        header: header_of_body(scene, body, snapshot)?,
        name: scene.bodies[body].wheels.clone(),
        ..JointState::default()
    };
    let rigid = &system.bodies()[body];
    let rate = snapshot.states[body].angular_velocity(rigid);
    if let Some(wheels) = rigid.wheels() {
        for (index, wheel) in wheels.states().iter().enumerate() {
            message.position.push(wheel.angle);
            message
                .velocity
                .push(wheels.speed(index, &rate) / scene.units.time);
            message.effort.push(wheel.torque * scene.units.energy());
        }
    }
    Ok(message)
}

/// The thrusters of a body, which the system has in their present state: their mean forces over the last step, and in the place
/// of positions their impulses since the start.
pub(crate) fn thruster_states(
    scene: &Scene,
    system: &System,
    body: usize,
    snapshot: &Snapshot,
) -> Result<JointState, StampError> {
    let named = &scene.bodies[body];
    let thrusters = system.bodies()[body].thrusters();
    let states = thrusters.map_or(&[][..], |thrusters| thrusters.states());
    let unit = scene.units.force();
    Ok(JointState {
        header: header_of_body(scene, body, snapshot)?,
        name: named.thrusters.clone(),
        position: (states.iter())
            .map(|state| state.impulse * unit * scene.units.time)
            .collect(),
        effort: states.iter().map(|state| state.thrust * unit).collect(),
        ..JointState::default()
    })
}

/// The present mass and inertia of a body, which the system has in their present state; of one with wheels, with these locked.
pub(crate) fn inertia(
    scene: &Scene,
    system: &System,
    body: usize,
    snapshot: &Snapshot,
) -> Result<InertiaStamped, StampError> {
    let (units, rigid) = (&scene.units, &system.bodies()[body]);
    let unit = units.mass * units.length * units.length;
    let locked = rigid.locked_inertia();
    let entry = |row, column| unit * locked.matrix()[(row, column)];
    Ok(InertiaStamped {
        header: header_of_body(scene, body, snapshot)?,
        inertia: Inertia {
            m: rigid.mass() * units.mass,
            com: Vector3::default(),
            ixx: entry(0, 0),
            ixy: entry(0, 1),
            ixz: entry(0, 2),
            iyy: entry(1, 1),
            iyz: entry(1, 2),
            izz: entry(2, 2),
        },
    })
}

pub(crate) fn invariants(
    scene: &Scene,
    system: &System,
    snapshot: &Snapshot,
) -> Result<msg::Invariants, StampError> {
    let invariants = lgvi_dynamics::Invariants::of(system, &snapshot.states);
    let units = &scene.units;
    Ok(msg::Invariants {
        header: header(scene, snapshot.step)?,
        step: snapshot.step,
        energy: invariants.energy * units.energy(),
        linear_momentum: (invariants.linear_momentum * units.momentum()).into(),
        angular_momentum: (invariants.angular_momentum * units.angular_momentum()).into(),
        orthogonality_error: invariants.orthogonality_error,
    })
}

pub(super) fn vector([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x, y, z }
}

#[cfg(test)]
mod tests {
    use lgvi_msgs::geometry_msgs::{Point, Pose};

    use super::super::transforms;
    use super::*;

    #[test]
    fn odometry_has_its_pose_in_the_inertial_and_its_twist_in_the_body_frame() {
        let text = r#"
            title = "A ball"
            [units]
            length = "2 m"
            time = "4 s"
            [run]
            duration = 1.0
            steps = 10
            integrator = "lgvi"
            [[bodies]]
            name = "ball"
            mass = 3.0
            inertia = [1, 1, 1]
            position = [1, 2, 3]
            velocity = [0, 1, 0]
            attitude = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
            angular_velocity = [0, 0, 8]
        "#;
        let scene = Scene::parse("test", text).unwrap();
        let mut snapshot = Snapshot::new(&scene);
        snapshot.step = 5;
        let odometry = odometry(&scene, &scene.bodies[0].body, 0, &snapshot).unwrap();
        assert_eq!(odometry.header.frame_id, "inertial");
        assert_eq!(odometry.child_frame_id, "ball");
        assert_eq!(odometry.header.stamp.sec, 946_728_002);
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let Pose {
            position,
            orientation,
        } = odometry.pose.pose;
        assert_eq!(
            position,
            Point {
                x: 2.0,
                y: 4.0,
                z: 6.0
            }
        );
        assert!((orientation.z - half).abs() < 1e-15 && (orientation.w - half).abs() < 1e-15);
        let Twist { linear, angular } = odometry.twist.twist;
        assert_eq!(
            linear,
            Vector3 {
                x: 0.5,
                y: 0.0,
                z: 0.0
            }
        );
        assert_eq!(
            angular,
            Vector3 {
                x: 0.0,
                y: 0.0,
                z: 2.0
            }
        );

        let transforms = transforms(&scene, &snapshot).unwrap().transforms;
        assert_eq!(transforms.len(), 1);
        assert_eq!(transforms[0].child_frame_id, "ball");
        assert_eq!(
            transforms[0].transform.translation,
            Vector3 {
                x: 2.0,
                y: 4.0,
                z: 6.0
            }
        );
    }
}
