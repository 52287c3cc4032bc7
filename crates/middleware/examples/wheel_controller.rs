//! A controller in Rust: turns a satellite by 90° with its reaction wheels, in lockstep with the flight.
//!
//! ```text
//! cargo run --release -p lgvi_middleware --example wheel_controller
//! cargo run --release -- run scenes/wheel_slew.toml --await-wheels satellite    # in another terminal
//! ```
//!
//! It answers each odometry with torques for the wheels; the flight waits for them every 0.02 s. With the arguments
//! `-- --ros-args -p shared_memory:=true` it reads the states in shared memory and answers there, which is faster.

use std::f64::consts::FRAC_1_SQRT_2;
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use lgvi_middleware::ParameterSpec;
use lgvi_middleware::node::{Managed, Node, NodeError, Stopped, with_arguments};
use lgvi_middleware::ros::{Publisher, Qos, Subscription};
use lgvi_middleware::shm::{ControlPublisher, StateSubscriber};
use lgvi_msgs::geometry_msgs::Quaternion;
use lgvi_msgs::msg::ControlSequence;
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_msgs::sensor_msgs::JointState;
use lgvi_msgs::shm::{BodySample, ControlHeader, Name, StateHeader};
use lgvi_msgs::{cdr, stamp};

/// kg m².
const INERTIA: [f64; 3] = [0.35, 0.3, 0.2];

/// Of each wheel about its axis (kg m²).
const WHEEL_INERTIA: f64 = 1.5e-4;

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

/// How long torques act: a control period (s).
const PERIOD: f64 = 0.02;

/// How long the next state is looked for without a pause.
const PROMPT: Duration = Duration::from_micros(200);

/// How long it pauses after that.
const PAUSE: Duration = Duration::from_micros(20);

const PROPAGATOR: &str = "/lgvi_propagator";

enum WheelController {
    Ros {
        states: Subscription<Odometry>,
        torques: Publisher<JointState>,
    },
    SharedMemory {
        states: Box<StateSubscriber>,
        answers: Box<ControlPublisher>,
    },
}

impl Managed for WheelController {
    const NAME: &'static str = "wheel_controller";

    fn parameters() -> Vec<ParameterSpec> {
        let description = "read states and answer in shared memory";
        vec![ParameterSpec::new("shared_memory", false, description)]
    }

    fn configure(node: &Node) -> Result<Self, NodeError> {
        if node.parameters.get("shared_memory")? {
            let shm = node.shm()?;
            return Ok(Self::SharedMemory {
                states: Box::new(shm.state_subscriber(&format!("{PROPAGATOR}/state"), 16)?),
                answers: Box::new(shm.control_publisher(&format!("{PROPAGATOR}/answer"))?),
            });
        }
        let odometry = format!("{PROPAGATOR}/odometry/satellite");
        let torque = format!("{PROPAGATOR}/wheel_torque/satellite");
        Ok(Self::Ros {
            states: node.ros.subscription(&odometry, &Qos::reliable(1000))?,
            torques: node.ros.publisher(&torque, &Qos::reliable(10))?,
        })
    }

    fn run(&mut self, node: &Node) -> Result<Stopped, NodeError> {
        let mut last = Instant::now();
        while !node.interrupted() {
            match self {
                Self::Ros { states, torques } => {
                    if let Some(sample) = states.recv_timeout(Duration::from_millis(20))? {
                        torques.publish(&answer(sample.message))?;
                    }
                }
                Self::SharedMemory { states, answers } => {
                    if let Some(sample) = states.receive()? {
                        let satellite = Name::try_from("satellite").map_err(NodeError::runtime)?;
                        let mut bodies = sample.elements().iter();
                        if let Some(body) = bodies.find(|body| body.name == satellite) {
                            let sequence = sequence(sample.header(), body)?;
                            let bytes = cdr::encode(&sequence).map_err(NodeError::runtime)?;
                            answers.send(ControlHeader::default(), &bytes)?;
                        }
                        last = Instant::now();
                    } else if last.elapsed() < PROMPT {
                        thread::yield_now();
                    } else {
                        thread::sleep(PAUSE);
                    }
                }
            }
        }
        Ok(Stopped::Interrupted)
    }
}

fn main() -> ExitCode {
    with_arguments(lgvi_middleware::node::main::<WheelController>)
}

/// The stamp says which state it answers.
fn answer(state: Odometry) -> JointState {
    let Quaternion { w, x, y, z } = state.pose.pose.orientation;
    let rate = state.twist.twist.angular;
    let torques = torques(error([w, x, y, z]), [rate.x, rate.y, rate.z]);
    JointState {
        header: state.header,
        name: WHEELS.map(|(name, _)| name.to_owned()).to_vec(),
        effort: torques.to_vec(),
        ..JointState::default()
    }
}

/// The first step says which state it answers.
fn sequence(header: &StateHeader, body: &BodySample) -> Result<ControlSequence, NodeError> {
    // The inertia without that of the wheels about their axes, of which A Aᵀ = diag(1, 1, 2).
    let shares = [1.0, 1.0, 2.0];
    let rate =
        [0, 1, 2].map(|i| body.angular_momentum[i] / (INERTIA[i] - shares[i] * WHEEL_INERTIA));
    let mut sequence = ControlSequence {
        body: "satellite".to_owned(),
        first_step: header.step,
        step_size: PERIOD,
        wheel_torque: torques(error(quaternion(&body.attitude)), rate).to_vec(),
        ..ControlSequence::default()
    };
    let stamp = stamp::to_message(header.stamp_nanoseconds);
    sequence.header.stamp = stamp.map_err(NodeError::runtime)?;
    Ok(sequence)
}

/// The least torques of the wheels whose reaction turns the satellite to a quarter turn about its y axis.
fn torques(error: [f64; 3], rate: [f64; 3]) -> [f64; 4] {
    let wanted = [0, 1, 2].map(|i| -INERTIA[i] * (STIFFNESS * error[i] + DAMPING * rate[i]));
    // With the axes as columns of A, A Aᵀ = diag(1, 1, 2).
    let shares = [wanted[0], wanted[1], 0.5 * wanted[2]];
    WHEELS.map(|(_, axis)| {
        let along: f64 = axis.iter().zip(shares).map(|(a, share)| a * share).sum();
        -FRAC_1_SQRT_2 * along
    })
}

/// Twice the vector part of the rotation from the target to an attitude, the shorter way.
fn error([w, x, y, z]: [f64; 4]) -> [f64; 3] {
    let (scalar, vector) = (w + y, [x - z, y - w, z + x]);
    let sign = if scalar < 0.0 { -1.0 } else { 1.0 };
    vector.map(|part| 2.0 * FRAC_1_SQRT_2 * sign * part)
}

/// The quaternion w, x, y, z of a rotation matrix by rows, from its largest component.
fn quaternion(r: &[f64; 9]) -> [f64; 4] {
    let [xx, xy, xz, yx, yy, yz, zx, zy, zz] = *r;
    // Four times the products of the components with each of them.
    let rows = [
        [1.0 + xx + yy + zz, zy - yz, xz - zx, yx - xy],
        [zy - yz, 1.0 + xx - yy - zz, xy + yx, xz + zx],
        [xz - zx, xy + yx, 1.0 - xx + yy - zz, yz + zy],
        [yx - xy, xz + zx, yz + zy, 1.0 - xx - yy + zz],
    ];
    let largest = (1..4).fold(0, |best, i| {
        if rows[i][i] > rows[best][best] {
            i
        } else {
            best
        }
    });
    let norm = 2.0 * rows[largest][largest].sqrt();
    rows[largest].map(|product| product / norm)
}
