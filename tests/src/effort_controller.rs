//! A controller of wheels or thrusters, and the flight that it commands.

use std::path::Path;

use lgvi_middleware::ros::{Publisher, Qos, Subscription};
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_msgs::sensor_msgs::JointState;

use crate::{PATIENCE, Process, World};

/// A controller that hears the odometry of the body "body" and publishes efforts.
pub struct EffortController {
    /// The flight.
    pub flight: Process,
    /// The efforts.
    pub efforts: Publisher<JointState>,
    odometry: Subscription<Odometry>,
}

impl EffortController {
    /// Starts it, with efforts on a topic of the propagator such as `wheel_torque`, and then the flight of a scene.
    pub fn start(world: &World, topic: &str, scene: &Path, bag: &str, arguments: &[&str]) -> Self {
        let ros = world.ros_node("controller");
        let odometry = ros
            .subscription("/lgvi_propagator/odometry/body", &Qos::reliable(1000))
            .expect("a subscription");
        let topic = format!("/lgvi_propagator/{topic}/body");
        let efforts = ros
            .publisher(&topic, &Qos::reliable(10))
            .expect("a publisher");
        Self {
            flight: world.start_flight(scene, bag, arguments),
            efforts,
            odometry,
        }
    }

    /// The next odometry.
    pub fn state(&self) -> Odometry {
        let message = self.odometry.recv_timeout(PATIENCE).expect("no fault");
        message.expect("odometry").message
    }

    /// Answers the states of the first `count` periods (s) with the efforts that `law` finds for the number of each. A state
    /// may come more than once: it is repeated until the first answer to it is heard.
    pub fn control<'a, const N: usize>(
        &self,
        count: u64,
        period: f64,
        mut law: impl FnMut(u64) -> [(&'a str, f64); N],
    ) {
        let time = |state: &Odometry| {
            let stamp = &state.header.stamp;
            f64::from(stamp.sec) + 1e-9 * f64::from(stamp.nanosec)
        };
        let mut state = self.state();
        let first = time(&state);
        loop {
            let number = ((time(&state) - first) / period).round() as u64;
            self.answer(&state, &law(number));
            if number + 1 >= count {
                break;
            }
            state = self.state();
        }
    }

    /// Publishes efforts that answer a state.
    pub fn answer(&self, state: &Odometry, named: &[(&str, f64)]) {
        self.efforts.publish(&efforts(state, named)).expect("sent");
    }
}

/// Efforts by the names of actuators, that answer a state.
pub fn efforts(state: &Odometry, named: &[(&str, f64)]) -> JointState {
    JointState {
        header: state.header.clone(),
        name: named.iter().map(|(name, _)| (*name).into()).collect(),
        effort: named.iter().map(|(_, effort)| *effort).collect(),
        ..JointState::default()
    }
}
