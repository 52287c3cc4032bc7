//! The errors of inertial sensors over many measurements, against the figures that the scene gives.

use lgvi_msgs::std_msgs::Header;
use lgvi_scene::{Imu, Units};

use super::super::errors::ImuErrors;
use super::*;

pub(super) const SI: Units = Units {
    length: 1.0,
    mass: 1.0,
    time: 1.0,
};

/// Number of measurements.
pub(super) const COUNT: u64 = 20_000;

/// The period of the IMU (s).
const PERIOD: f64 = 0.01;

/// The IMU whose gyroscopes have these keys.
fn imu(keys: &str) -> Imu {
    let sensor = sensor(
        "imu",
        "imu",
        &format!("period = {PERIOD:?}\n[bodies.sensors.gyroscope]\n{keys}"),
    );
    let craft = body("craft", &place([0.0; 3], [0.0; 3], [0.0; 3]), &sensor);
    let scene = Scene::parse("test", &run(0.01, &craft)).unwrap();
    match &scene.sensors[0].kind {
        SensorKind::Imu(imu) => imu.clone(),
        other => panic!("{other:?}"),
    }
}

/// What gyroscopes measure at rest, or at a rate.
fn measured(imu: &Imu, seed: u64, count: u64, rate: Vector3<f64>) -> Vec<Vector3<f64>> {
    let mut errors = ImuErrors::new(imu, seed, PERIOD);
    let still = Vector3::zeros();
    let measured = (0..count).map(|k| {
        let message = errors.message(&SI, Header::default(), k, [&rate, &still], PERIOD);
        let rate = message.angular_velocity;
        Vector3::new(rate.x, rate.y, rate.z)
    });
    measured.collect()
}

/// Mean and standard deviation of each component, within 5 standard errors.
#[track_caller]
pub(super) fn assert_normal(all: &[Vector3<f64>], expected: [f64; 3]) {
    let count = all.len() as f64;
    for (axis, expected) in expected.into_iter().enumerate() {
        let mean = all.iter().map(|one| one[axis]).sum::<f64>() / count;
        let variance = all.iter().map(|one| one[axis].powi(2)).sum::<f64>() / count;
        let deviation = variance.sqrt();
        assert!(
            mean.abs() <= 5.0 * expected / count.sqrt(),
            "{axis}: mean {mean}"
        );
        let error = 5.0 * expected / (2.0 * count).sqrt();
        assert!(
            (deviation - expected).abs() <= error,
            "{axis}: {deviation} for {expected}"
        );
    }
}

/// Mean square of half the differences of successive means over `samples`, without overlap: the Allan variance.
fn allan(all: &[Vector3<f64>], samples: usize) -> f64 {
    let means: Vec<Vector3<f64>> = all
        .chunks_exact(samples)
        .map(|chunk| chunk.iter().sum::<Vector3<f64>>() / samples as f64)
        .collect();
    let sum: f64 = means
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).norm_squared())
        .sum();
    sum / (6 * (means.len() - 1)) as f64
}

/// The Allan deviation of white noise is `N/√τ` (IEEE Std 952, C.1.1), and the covariance says so.
#[test]
fn angle_random_walk_falls_with_the_averaging_time() {
    let imu = imu("noise_density = 2e-3");
    let all = measured(&imu, 5, COUNT, Vector3::zeros());
    assert_normal(&all, [0.02; 3]);
    for samples in [10, 100] {
        let expected = 2e-3 / (samples as f64 * PERIOD).sqrt();
        let found = allan(&all, samples).sqrt();
        // Differences of neighbors are correlated: of 3 N there are 3 N/1.5 independent ones.
        let error = expected * (1.5 / (6.0 * COUNT as f64 / samples as f64)).sqrt();
        assert!(
            (found - expected).abs() < 5.0 * error,
            "{samples}: {found} for {expected}"
        );
    }
    let mut errors = ImuErrors::new(&imu, 5, PERIOD);
    let zero = Vector3::zeros();
    let message = errors.message(&SI, Header::default(), 0, [&zero, &zero], PERIOD);
    for (index, variance) in message.angular_velocity_covariance.into_iter().enumerate() {
        let expected = if index % 4 == 0 { 4e-4 } else { 0.0 };
        assert!((variance - expected).abs() < 1e-18);
    }
    assert_eq!(message.linear_acceleration_covariance, [0.0; 9]);
    assert_eq!(message.orientation_covariance[0], -1.0);
}

/// The Allan deviation of rate random walk is `K √(τ/3)` (IEEE Std 952, C.1.4).
#[test]
fn rate_random_walk_grows_with_the_averaging_time() {
    let imu = imu("random_walk = 1e-3");
    for samples in [10, 100] {
        // Mean squares of many flights, as those of one flight are few.
        let mut sum = 0.0;
        let flights = 20;
        for seed in 0..flights {
            sum += allan(&measured(&imu, seed, COUNT / 10, Vector3::zeros()), samples);
        }
        let found = (sum / flights as f64).sqrt();
        let tau = samples as f64 * PERIOD;
        // Means of samples at the ends of periods, not of the walk between: 1 + 1/(2 n²) of it.
        let expected = 1e-3 * (tau / 3.0 * (1.0 + 0.5 / (samples * samples) as f64)).sqrt();
        let differences = (3 * flights * COUNT / 10) as f64 / samples as f64;
        let error = expected * (2.0 / (2.0 * differences)).sqrt();
        assert!(
            (found - expected).abs() < 5.0 * error,
            "{samples}: {found} for {expected}"
        );
    }
}

#[test]
fn biases_differ_from_flight_to_flight_and_stay_in_each() {
    let imu = imu("bias = 0.3");
    let flights: Vec<_> = (0..2000)
        .map(|seed| {
            let two = measured(&imu, seed, 2, Vector3::zeros());
            assert_eq!(two[0], two[1]);
            two[0]
        })
        .collect();
    assert_normal(&flights, [0.3; 3]);
}

#[test]
fn bias_instability_has_its_deviation_and_correlation_time() {
    let imu = imu("bias_instability = 0.2\ncorrelation_time = 0.05");
    let all = measured(&imu, 8, COUNT, Vector3::zeros());
    // 5 periods: one in (1 + ρ)/(1 − ρ) is independent.
    let rho = (-0.2_f64).exp();
    let independent = 3.0 * COUNT as f64 * (1.0 - rho) / (1.0 + rho);
    for lag in [0, 1, 5] {
        let pairs = all.iter().zip(&all[lag..]);
        let found =
            pairs.map(|(one, other)| one.dot(other)).sum::<f64>() / (3 * (all.len() - lag)) as f64;
        let expected = 0.04 * rho.powi(lag as i32);
        let error = 0.04 * (2.0 / independent).sqrt();
        assert!(
            (found - expected).abs() < 5.0 * error,
            "{lag}: {found} for {expected}"
        );
    }
}

#[test]
fn scale_and_misalignment_act_on_what_is_true_and_the_range_on_the_sum() {
    let given = imu("sensitivity = [[0.1, 0, 0], [0, 0, 0.2], [0, 0, 0]]\nrange = 2.5");
    let rate = Vector3::new(1.0, 2.0, 4.0);
    let expected = Vector3::new(1.1, 2.5, 2.5);
    assert!((measured(&given, 1, 1, rate)[0] - expected).norm() < 1e-15);
    assert!((measured(&given, 1, 1, -rate)[0] + expected).norm() < 1e-15);
    let drawn = imu("scale_factor = 0.01\nmisalignment = 0.02");
    let columns = |axis: Vector3<f64>| -> Vec<_> {
        let flights = (0..2000).map(|seed| measured(&drawn, seed, 1, axis)[0] - axis);
        flights.collect()
    };
    assert_normal(&columns(Vector3::x()), [0.01, 0.02, 0.02]);
    assert_normal(&columns(Vector3::y()), [0.02, 0.01, 0.02]);
    assert_normal(&columns(Vector3::z()), [0.02, 0.02, 0.01]);
}

/// Of the same kind on one body, and of gyroscopes and accelerometers of one sensor.
#[test]
fn sensors_have_errors_of_their_own() {
    let one = sensor(
        "imu",
        "one",
        "period = 0.01\n[bodies.sensors.gyroscope]\nnoise_density = 0.1\n[bodies.sensors.accelerometer]\nnoise_density = 0.1",
    );
    let craft = body(
        "craft",
        &place([0.0; 3], [0.0; 3], [0.0; 3]),
        &(one.clone() + &one.replace("\"one\"", "\"two\"")),
    );
    let scene = Scene::parse("test", &run(0.01, &craft)).unwrap();
    let still = Vector3::zeros();
    let mut sequences = Vec::new();
    for sensor in &scene.sensors {
        let SensorKind::Imu(imu) = &sensor.kind else {
            panic!("{sensor:?}")
        };
        let mut errors = ImuErrors::new(imu, sensor.seed, PERIOD);
        let messages =
            (0..COUNT).map(|k| errors.message(&SI, Header::default(), k, [&still, &still], PERIOD));
        let messages: Vec<_> = messages.collect();
        let of = |components: &lgvi_msgs::geometry_msgs::Vector3| {
            Vector3::new(components.x, components.y, components.z)
        };
        sequences.push(
            messages
                .iter()
                .map(|one| of(&one.angular_velocity))
                .collect::<Vec<_>>(),
        );
        sequences.push(
            messages
                .iter()
                .map(|one| of(&one.linear_acceleration))
                .collect(),
        );
    }
    for (index, one) in sequences.iter().enumerate() {
        for other in &sequences[..index] {
            let products = one.iter().zip(other).map(|(one, other)| one.dot(other));
            // Each has the deviation 1.
            let correlation = products.sum::<f64>() / (3 * COUNT) as f64;
            assert!(
                correlation.abs() < 5.0 / ((3 * COUNT) as f64).sqrt(),
                "{correlation}"
            );
        }
    }
}
