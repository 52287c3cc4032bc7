//! The topics of the scene's sensors.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use lgvi_common::header;
use lgvi_middleware::node::NodeError;
use lgvi_middleware::ros::{Qos, RosNode};
use lgvi_msgs::RosMessage;
use lgvi_msgs::geometry_msgs::PoseWithCovarianceStamped;
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_msgs::sensor_msgs::Imu;
use lgvi_msgs::std_msgs::Header;
use lgvi_scene::{Scene, Sensor, SensorKind};
use rtrb::Consumer;

use super::counted::{Counted, Counts};
use super::settling::Outgoing;
use super::topics::STREAM_DEPTH;
use crate::node::sensors::errors::{GnssErrors, ImuErrors, RelativePoseErrors, StarTrackerErrors};
use crate::node::sensors::{Reading, Truth};

/// Publishes what sensors measure.
pub(super) struct SensorTopics {
    outlets: Vec<Outlet>,
    readings: Consumer<Reading>,
}

/// A sensor's topic and its errors.
enum Outlet {
    Imu(Counted<Imu>, Box<ImuErrors>),
    StarTracker(Counted<Imu>, StarTrackerErrors),
    Gnss(Counted<Odometry>, GnssErrors),
    RelativePose(Counted<PoseWithCovarianceStamped>, RelativePoseErrors),
}

/// A topic of any type.
trait Topic: Outgoing {
    fn wanted(&self) -> bool;
    fn counts(&self) -> Arc<Counts>;
}

impl<M: RosMessage + Send + Sync + 'static> Topic for Counted<M> {
    fn wanted(&self) -> bool {
        Counted::wanted(self)
    }

    fn counts(&self) -> Arc<Counts> {
        Counted::counts(self)
    }
}

impl SensorTopics {
    pub(super) fn new(
        ros: &RosNode,
        scene: &Scene,
        lossless: &Arc<AtomicBool>,
        readings: Consumer<Reading>,
    ) -> Result<Self, NodeError> {
        let sensors = scene.sensors.iter();
        let outlets = sensors.map(|sensor| Outlet::new(ros, scene, sensor, lossless));
        Ok(Self {
            outlets: outlets.collect::<Result<_, _>>()?,
            readings,
        })
    }

    /// Has the loop know to which sensors somebody listens; whether there is one.
    pub(super) fn wanted(&self, listened: &[AtomicBool]) -> bool {
        let mut any = false;
        for (outlet, listened) in self.outlets.iter().zip(listened) {
            let wanted = outlet.topic().wanted();
            listened.store(wanted, Ordering::Relaxed);
            any |= wanted;
        }
        any
    }

    /// Publishes what has been read, `most` measurements at most; whether there was anything.
    pub(super) fn publish(&mut self, scene: &Scene, most: usize) -> bool {
        let mut published = 0;
        while published < most
            && let Ok(reading) = self.readings.pop()
        {
            published += 1;
            self.outlets[reading.sensor].publish(scene, &reading);
        }
        published > 0
    }

    /// Those whose messages are waited for at the end.
    pub(super) fn outgoing(&self) -> impl Iterator<Item = &dyn Outgoing> {
        self.outlets
            .iter()
            .map(|outlet| outlet.topic() as &dyn Outgoing)
    }

    /// What becomes of the messages, by topic.
    pub(super) fn counts(&self) -> impl Iterator<Item = Arc<Counts>> {
        self.outlets.iter().map(|outlet| outlet.topic().counts())
    }
}

impl Outlet {
    fn new(
        ros: &RosNode,
        scene: &Scene,
        sensor: &Sensor,
        lossless: &Arc<AtomicBool>,
    ) -> Result<Self, NodeError> {
        let (kind, body) = (sensor.kind.name(), &scene.bodies[sensor.body].name);
        let topic = format!("~/{kind}/{body}/{}", sensor.name);
        let qos = Qos::reliable(STREAM_DEPTH);
        let seed = sensor.seed;
        Ok(match &sensor.kind {
            SensorKind::Imu(imu) => {
                let period = sensor.every as f64 * scene.h();
                let errors = Box::new(ImuErrors::new(imu, seed, period));
                Self::Imu(Counted::new(ros, &topic, &qos, lossless)?, errors)
            }
            SensorKind::StarTracker(tracker) => Self::StarTracker(
                Counted::new(ros, &topic, &qos, lossless)?,
                StarTrackerErrors::new(tracker, seed),
            ),
            SensorKind::Gnss(gnss) => Self::Gnss(
                Counted::new(ros, &topic, &qos, lossless)?,
                GnssErrors::new(gnss, seed),
            ),
            SensorKind::RelativePose(camera) => Self::RelativePose(
                Counted::new(ros, &topic, &qos, lossless)?,
                RelativePoseErrors::new(camera, seed),
            ),
        })
    }

    fn topic(&self) -> &dyn Topic {
        match self {
            Self::Imu(topic, _) | Self::StarTracker(topic, _) => topic,
            Self::Gnss(topic, _) => topic,
            Self::RelativePose(topic, _) => topic,
        }
    }

    fn publish(&mut self, scene: &Scene, reading: &Reading) {
        let sensor = &scene.sensors[reading.sensor];
        let (units, k) = (&scene.units, reading.step / sensor.every);
        // A scene's stamps all fit ROS time: it was checked when it was compiled.
        let Ok(inertial) = header(scene, reading.step) else {
            return;
        };
        let own = || Header {
            frame_id: sensor.frame.clone(),
            ..inertial.clone()
        };
        // A reading is of the kind of its sensor.
        match (self, &reading.truth) {
            (Self::Imu(topic, errors), Truth::Inertial { rate, force, time }) => {
                topic.send(&errors.message(units, own(), k, [rate, force], *time));
            }
            (Self::StarTracker(topic, errors), Truth::Attitude(attitude)) => {
                topic.send(&errors.message(own(), k, attitude));
            }
            (Self::Gnss(topic, errors), Truth::Motion { position, velocity }) => {
                topic.send(&errors.message(units, inertial, k, [position, velocity]));
            }
            (Self::RelativePose(topic, errors), Truth::Pose { position, attitude }) => {
                topic.send(&errors.message(units, own(), k, position, attitude));
            }
            _ => {}
        }
    }
}
