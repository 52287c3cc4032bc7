//! A controller in Rust: turns a satellite by 90° with its reaction wheels, in lockstep with the flight.
//!
//! ```text
//! cargo run --release -p lgvi_middleware --example wheel_controller
//! cargo run --release -- run scenes/wheel_slew.toml --await-wheels satellite    # in another terminal
//! ```
//!
//! It answers each odometry with torques for the wheels; the flight waits for them every 0.02 s.

use std::f64::consts::FRAC_1_SQRT_2;
use std::process::ExitCode;
use std::time::Duration;

use lgvi_middleware::ParameterSpec;
use lgvi_middleware::node::{Managed, Node, NodeError, Stopped, with_arguments};
use lgvi_middleware::ros::{Publisher, Qos, Subscription};
use lgvi_msgs::geometry_msgs::Quaternion;
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_msgs::sensor_msgs::JointState;

/// kg m².
const INERTIA: [f64; 3] = [0.35, 0.3, 0.2];

/// Axes of the wheels, times √2.
const WHEELS: [(&str, [f64; 3]); 4] = [
    ("wheel_1", [1.0, 0.0, 1.0]),
    ("wheel_2", [0.0, 1.0, 1.0]),
    ("wheel_3", [-1.0, 0.0, 1.0]),
    ("wheel_4", [0.0, -1.0, 1.0]),
];

/// Of the closed loop (1/s², 1/s).
const STIFFNESS: f64 = 0.1;
const DAMPING: f64 = 0.5;

struct WheelController {
    states: Subscription<Odometry>,
    torques: Publisher<JointState>,
}

impl Managed for WheelController {
    const NAME: &'static str = "wheel_controller";

    fn parameters() -> Vec<ParameterSpec> {
        Vec::new()
    }

    fn configure(node: &Node) -> Result<Self, NodeError> {
        let propagator = "/lgvi_propagator";
        let odometry = format!("{propagator}/odometry/satellite");
        let torque = format!("{propagator}/wheel_torque/satellite");
        Ok(Self {
            states: node.ros.subscription(&odometry, &Qos::reliable(1000))?,
            torques: node.ros.publisher(&torque, &Qos::reliable(10))?,
        })
    }

    fn run(&mut self, node: &Node) -> Result<Stopped, NodeError> {
        while !node.interrupted() {
            let received = self.states.recv_timeout(Duration::from_millis(20))?;
            if let Some(sample) = received {
                self.torques.publish(&answer(sample.message))?;
            }
        }
        Ok(Stopped::Interrupted)
    }
}

fn main() -> ExitCode {
    with_arguments(lgvi_middleware::node::main::<WheelController>)
}

/// The least torques of the wheels whose reaction turns the satellite to a quarter turn about its y axis. The stamp says
/// which state they answer.
fn answer(state: Odometry) -> JointState {
    let error = error(&state.pose.pose.orientation);
    let rate = state.twist.twist.angular;
    let rate = [rate.x, rate.y, rate.z];
    let wanted = [0, 1, 2].map(|i| -INERTIA[i] * (STIFFNESS * error[i] + DAMPING * rate[i]));
    // With the axes as columns of A, A Aᵀ = diag(1, 1, 2).
    let shares = [wanted[0], wanted[1], 0.5 * wanted[2]];
    let torque = |axis: [f64; 3]| {
        let along: f64 = axis.iter().zip(shares).map(|(a, share)| a * share).sum();
        -FRAC_1_SQRT_2 * along
    };
    JointState {
        header: state.header,
        name: WHEELS.map(|(name, _)| name.to_owned()).to_vec(),
        effort: WHEELS.map(|(_, axis)| torque(axis)).to_vec(),
        ..JointState::default()
    }
}

/// Twice the vector part of the rotation from the target to an attitude, the shorter way.
fn error(attitude: &Quaternion) -> [f64; 3] {
    let Quaternion { w, x, y, z } = *attitude;
    let (scalar, vector) = (w + y, [x - z, y - w, z + x]);
    let sign = if scalar < 0.0 { -1.0 } else { 1.0 };
    vector.map(|part| 2.0 * FRAC_1_SQRT_2 * sign * part)
}
