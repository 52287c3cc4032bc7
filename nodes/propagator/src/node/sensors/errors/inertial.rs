use lgvi_msgs::sensor_msgs;
use lgvi_msgs::std_msgs::Header;
use lgvi_scene::{Imu, InertialErrors, Process, SensitivityErrors, Stream, Units};
use nalgebra::{Matrix3, Vector3};

use super::{components, diagonal};

/// Sequences of an instrument.
const SEQUENCES: u64 = 5;

/// The errors of an inertial measurement unit.
pub(crate) struct ImuErrors {
    gyroscope: Instrument,
    accelerometer: Instrument,
}

/// Three gyroscopes or accelerometers.
struct Instrument {
    /// `I + E`.
    sensitivity: Matrix3<f64>,
    bias: Vector3<f64>,
    instability: Option<Process>,
    walk: Option<Process>,
    noise: Stream,
    density: f64,
    range: f64,
}

impl ImuErrors {
    /// `period` is the time from one measurement to the next.
    pub(crate) fn new(imu: &Imu, seed: u64, period: f64) -> Self {
        Self {
            gyroscope: Instrument::new(&imu.gyroscope, seed, 0, period),
            accelerometer: Instrument::new(&imu.accelerometer, seed, 1, period),
        }
    }

    /// The message of measurement `k`, a mean over a time.
    pub(crate) fn message(
        &mut self,
        units: &Units,
        header: Header,
        k: u64,
        [rate, force]: [&Vector3<f64>; 2],
        time: f64,
    ) -> sensor_msgs::Imu {
        let of_rate = 1.0 / units.time;
        let of_force = units.length / (units.time * units.time);
        let variances = |instrument: &Instrument, unit: f64| {
            let deviation = instrument.deviation(time) * unit;
            diagonal::<3, 9>([deviation * deviation; 3])
        };
        sensor_msgs::Imu {
            header,
            orientation_covariance: diagonal([-1.0, 0.0, 0.0]),
            angular_velocity: components(self.gyroscope.measured(k, rate, time) * of_rate),
            angular_velocity_covariance: variances(&self.gyroscope, of_rate),
            linear_acceleration: components(self.accelerometer.measured(k, force, time) * of_force),
            linear_acceleration_covariance: variances(&self.accelerometer, of_force),
            ..Default::default()
        }
    }
}

impl Instrument {
    fn new(errors: &InertialErrors, seed: u64, number: u64, period: f64) -> Self {
        let stream = |sequence: u64| Stream::new(seed, number * SEQUENCES + sequence);
        let sensitivity = match errors.sensitivity {
            SensitivityErrors::Given(matrix) => matrix,
            SensitivityErrors::Drawn {
                scale_factor,
                misalignment,
            } => {
                let drawn = stream(1);
                let [lower, upper] = [drawn.at(1), drawn.at(2)].map(|each| misalignment * each);
                let mut matrix = Matrix3::from_diagonal(&(scale_factor * drawn.at(0)));
                for (index, element) in [(1, 0), (2, 0), (2, 1)].into_iter().enumerate() {
                    matrix[element] = lower[index];
                    matrix[(element.1, element.0)] = upper[index];
                }
                matrix
            }
        };
        let instability = errors.bias_instability;
        let walk = errors.random_walk;
        Self {
            sensitivity: Matrix3::identity() + sensitivity,
            bias: errors.bias * stream(2).at(0),
            instability: (instability > 0.0).then(|| {
                let correlation = errors.correlation_time / period;
                Process::gauss_markov(instability, correlation, stream(3))
            }),
            walk: (walk > 0.0).then(|| Process::random_walk(walk * period.sqrt(), stream(4))),
            noise: stream(0),
            density: errors.noise_density,
            range: errors.range,
        }
    }

    /// Standard deviation of the white noise of a mean over a time.
    fn deviation(&self, time: f64) -> f64 {
        self.density / time.sqrt()
    }

    fn measured(&mut self, k: u64, truth: &Vector3<f64>, time: f64) -> Vector3<f64> {
        let mut measured = self.sensitivity * truth + self.bias;
        for process in self.instability.iter_mut().chain(&mut self.walk) {
            measured += process.at(k);
        }
        measured += self.deviation(time) * self.noise.at(k);
        measured.map(|component| component.clamp(-self.range, self.range))
    }
}
