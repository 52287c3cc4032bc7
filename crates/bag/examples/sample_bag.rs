//! Writes a bag with messages of every lgvi type and of the standard types that lgvi publishes, and prints each as a
//! JSON line, to be compared with what other readers find:
//!
//! ```text
//! cargo run -p lgvi_bag --example sample_bag -- /tmp/sample > written.jsonl
//! python tests/python/check_bag.py /tmp/sample --dump > read.jsonl
//! ```

#![allow(clippy::print_stdout, reason = "an example prints its result")]

use std::{collections::BTreeMap, env, error::Error, path::PathBuf};

use lgvi_bag::{BagOptions, BagWriter, Qos, Topic};
use lgvi_msgs::{
    RosMessage,
    builtin_interfaces::Time,
    cdr,
    diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue},
    geometry_msgs::{Point, PoseStamped, TransformStamped, Vector3},
    msg::{
        BodyState, ControlLimits, ControlSequence, Invariants, PlanProgress, Scene, SystemState,
    },
    nav_msgs::{Odometry, Path},
    rcl_interfaces::Log,
    rosgraph_msgs::Clock,
    std_msgs::{ColorRGBA, Header},
    tf2_msgs::TFMessage,
    visualization_msgs::{Marker, MarkerArray},
};

struct Sample {
    bag: BagWriter,
    messages: u32,
}

impl Sample {
    fn write<M: RosMessage>(
        &mut self,
        topic: &str,
        qos: Qos,
        message: &M,
    ) -> Result<(), Box<dyn Error>> {
        let topic = Topic {
            name: topic.to_owned(),
            type_name: M::TYPE_NAME.to_owned(),
            type_hash: M::TYPE_HASH.to_owned(),
            definition: M::DEFINITION.to_owned(),
            definition_encoding: lgvi_bag::ROS2MSG.to_owned(),
            qos,
        };
        let id = self.bag.add_topic(&topic)?;
        let time = 1_700_000_000_000_000_000 + u64::from(self.messages);
        self.bag
            .write(id, time, time, self.messages, &cdr::encode(message)?)?;
        self.messages += 1;
        println!(
            r#"{{"topic":"{}","time":{time},"message":{}}}"#,
            topic.name,
            serde_json::to_string(message)?
        );
        Ok(())
    }
}

fn header(k: u32, frame_id: &str) -> Header {
    Header {
        stamp: Time {
            sec: 1_700_000_000,
            nanosec: k,
        },
        frame_id: frame_id.to_owned(),
    }
}

/// Numbers that show every bit of an f64.
fn numbers<const N: usize>(seed: u32) -> [f64; N] {
    std::array::from_fn(|index| (f64::from(seed) + 1.0) / (index as f64 - 2.5) * 0.1)
}

fn vector(seed: u32) -> Vector3 {
    let [x, y, z] = numbers(seed);
    Vector3 { x, y, z }
}

fn body(name: &str, seed: u32) -> BodyState {
    BodyState {
        name: name.to_owned(),
        position: numbers(seed),
        linear_momentum: [-0.0, f64::MIN_POSITIVE / 3.0, f64::MAX],
        attitude: numbers(seed + 1),
        angular_momentum: numbers(seed + 2),
    }
}

fn write_round(sample: &mut Sample, k: u32) -> Result<(), Box<dyn Error>> {
    let stream = Qos::default();
    let latched = Qos {
        durable: true,
        depth: 1,
        ..Qos::default()
    };
    // Names of odd lengths shift what follows: alignment shows.
    let name = "chaser"[..1 + k as usize % 6].to_owned();

    let state = SystemState {
        header: header(k, "inertial"),
        sequence: u64::MAX - u64::from(k),
        step: u64::from(k) << 40,
        time: f64::from(k) * 0.1,
        bodies: vec![body(&name, k), body("target", k + 7)],
    };
    sample.write("/lgvi_propagator/state", stream, &state)?;
    sample.write("/body", stream, &body(&name, k))?;
    let control = ControlSequence {
        header: header(k, "inertial"),
        body: name.clone(),
        first_step: 17,
        step_size: 0.1,
        force: (0..k).map(vector).collect(),
        moment: (0..k).map(|index| vector(index + 100)).collect(),
        reference: (0..k).map(|index| body(&name, index)).collect(),
        feedback: (0..k).flat_map(numbers::<72>).collect(),
        limits: ControlLimits {
            force: numbers(k),
            moment: [f64::INFINITY; 3],
            force_norm: f64::INFINITY,
            moment_norm: 0.1,
        },
        moment_in_frame: true,
        wheel_torque: vec![0.5],
        thrust: (0..k).map(f64::from).collect(),
    };
    sample.write("/lgvi_planner/control_sequence", latched, &control)?;
    let invariants = Invariants {
        header: header(k, "inertial"),
        step: 3,
        energy: -1.0 / 3.0,
        linear_momentum: numbers(k),
        angular_momentum: numbers(k + 1),
        orthogonality_error: 1e-16,
    };
    sample.write("/lgvi_propagator/invariants", stream, &invariants)?;
    let progress = PlanProgress {
        header: header(k, ""),
        body: name.clone(),
        status: PlanProgress::CONVERGED,
        iteration: k,
        trials: 2 * k,
        step_length: 0.5,
        violation: 1e-9,
        stationarity: 1e-11,
        cost: 12.5,
        condition: 1e4,
        sufficient: true,
        message: "ünïcode — λ".to_owned(),
    };
    sample.write("/lgvi_planner/progress", stream, &progress)?;
    let scene = Scene {
        header: header(0, "inertial"),
        name: "sample".to_owned(),
        text: "# a scene\n[run]\nsteps = 10\n".to_owned(),
        software: "lgvi 0.1.0".to_owned(),
    };
    sample.write("/lgvi_propagator/scene", latched, &scene)?;

    let mut odometry = Odometry {
        header: header(k, "inertial"),
        child_frame_id: name.clone(),
        ..Default::default()
    };
    odometry.pose.pose.position = Point {
        x: 0.1,
        y: 0.2,
        z: 0.3,
    };
    odometry.pose.covariance = numbers(k);
    odometry.twist.twist.angular = vector(k);
    sample.write("/lgvi_propagator/odometry/chaser", stream, &odometry)?;
    let mut transform = TransformStamped {
        header: header(k, "inertial"),
        child_frame_id: name,
        ..Default::default()
    };
    transform.transform.translation = vector(k);
    sample.write(
        "/tf",
        stream,
        &TFMessage {
            transforms: vec![transform; 2],
        },
    )?;
    let pose = PoseStamped {
        header: header(k, "inertial"),
        ..Default::default()
    };
    sample.write(
        "/path",
        stream,
        &Path {
            header: header(k, "inertial"),
            poses: vec![pose; 3],
        },
    )?;
    sample.write(
        "/clock",
        stream,
        &Clock {
            clock: Time {
                sec: i32::MAX,
                nanosec: 999_999_999,
            },
        },
    )?;
    let value = KeyValue {
        key: "rate".to_owned(),
        value: "1000 Hz".to_owned(),
    };
    let status = DiagnosticStatus {
        level: DiagnosticStatus::ERROR,
        name: "recorder".to_owned(),
        message: String::new(),
        hardware_id: "x".to_owned(),
        values: vec![value; 2],
    };
    sample.write(
        "/diagnostics",
        stream,
        &DiagnosticArray {
            header: header(k, ""),
            status: vec![status],
        },
    )?;
    let log = Log {
        level: Log::WARN,
        msg: "late".to_owned(),
        line: 7,
        ..Default::default()
    };
    sample.write("/rosout", latched, &log)?;
    let marker = Marker {
        header: header(k, "inertial"),
        r#type: Marker::LINE_STRIP,
        points: vec![
            Point {
                x: 0.1,
                y: -0.2,
                z: 1e300
            };
            3
        ],
        colors: vec![
            ColorRGBA {
                r: 0.1,
                g: 0.2,
                b: 0.3,
                a: 1.0
            };
            3
        ],
        frame_locked: true,
        ..Default::default()
    };
    sample.write(
        "/markers",
        stream,
        &MarkerArray {
            markers: vec![marker; 2],
        },
    )
}

fn main() -> Result<(), Box<dyn Error>> {
    let directory = env::args_os()
        .nth(1)
        .map(PathBuf::from)
        .ok_or("expected the directory of the bag")?;
    let bag = BagWriter::create(&directory, BagOptions::default())?;
    let mut sample = Sample { bag, messages: 0 };
    for round in 0..7 {
        write_round(&mut sample, round)?;
    }
    sample.bag.finish(BTreeMap::from([(
        "lgvi_scene".to_owned(),
        "sample".to_owned(),
    )]))?;
    Ok(())
}
