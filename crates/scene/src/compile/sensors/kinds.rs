use std::f64::consts::PI;

use crate::angle::{self, AngleFile};
use crate::file::{ExclusionFile, InertialErrorsFile, SensorFile};
use crate::sensor::{
    Exclusion, Gnss, Imu, InertialErrors, RelativePose, SensitivityErrors, SensorKind, StarTracker,
    Toward,
};
use crate::{Scene, SceneError, check};

/// Largest standard deviation in SI: its square and its multiples are numbers.
const LARGEST: f64 = 1e100;

/// Compiles what a sensor of a body measures. `key` completes the path of a key.
pub(super) fn kind(
    key: &dyn Fn(&str) -> String,
    scene: &Scene,
    body: usize,
    file: &SensorFile,
) -> Result<SensorKind, SceneError> {
    let length = scene.units.length;
    let (speed, rate) = (length / scene.units.time, 1.0 / scene.units.time);
    let deviation = |name: &str, value, unit| deviation(&key(name), value, unit);
    let angle = |name: &'static str, file: &Option<AngleFile>| small_angle(&key(name), name, file);
    Ok(match file {
        SensorFile::Imu {
            gyroscope,
            accelerometer,
            ..
        } => {
            let errors = |name: &str, file, unit| {
                let key = |part: &str| format!("{}.{part}", key(name));
                inertial_errors(&key, file, unit, scene.units.time)
            };
            SensorKind::Imu(Imu {
                gyroscope: errors("gyroscope", gyroscope, rate)?,
                accelerometer: errors("accelerometer", accelerometer, speed * rate)?,
            })
        }
        SensorFile::StarTracker {
            cross_boresight,
            about_boresight,
            exclusions,
            max_rate,
            ..
        } => {
            let exclusions = exclusions.iter().enumerate().map(|(index, file)| {
                let key = |part: &str| key(&format!("exclusions[{index}].{part}"));
                exclusion(&key, scene, body, file)
            });
            SensorKind::StarTracker(StarTracker {
                cross_boresight: angle("cross_boresight", cross_boresight)?,
                about_boresight: angle("about_boresight", about_boresight)?,
                exclusions: exclusions.collect::<Result<_, _>>()?,
                max_rate: limit(&key("max_rate"), *max_rate)?,
            })
        }
        SensorFile::Gnss {
            position, velocity, ..
        } => SensorKind::Gnss(Gnss {
            position: deviation("position", *position, length)?,
            velocity: deviation("velocity", *velocity, speed)?,
        }),
        SensorFile::RelativePose {
            target,
            field_of_view,
            min_range,
            max_range,
            position,
            position_per_range,
            attitude,
            ..
        } => {
            let max_range = limit(&key("max_range"), *max_range)?;
            if !(0.0..max_range).contains(min_range) {
                let expected = "a distance ≥ 0, below `max_range`";
                return Err(SceneError::value(key("min_range"), *min_range, expected));
            }
            SensorKind::RelativePose(RelativePose {
                target: other(&key("target"), scene, body, target)?,
                field_of_view: field_of_view.as_ref().map_or(Ok(PI), |file| {
                    cone(&key("field_of_view"), "field_of_view", file)
                })?,
                range: [*min_range, max_range],
                position: deviation("position", *position, length)?,
                position_per_range: deviation("position_per_range", *position_per_range, 1.0)?,
                attitude: angle("attitude", attitude)?,
            })
        }
    })
}

/// `unit` and `time` are the SI sizes of what is measured and of a unit of time.
fn inertial_errors(
    key: &dyn Fn(&str) -> String,
    file: &InertialErrorsFile,
    unit: f64,
    time: f64,
) -> Result<InertialErrors, SceneError> {
    let deviation = |name: &str, value, unit| deviation(&key(name), value, unit);
    let correlation_time = match file.correlation_time {
        Some(time) => check::positive(&key("correlation_time"), time)?,
        None if file.bias_instability == 0.0 => f64::INFINITY,
        None => {
            let expected = "a time > 0, as there is a `bias_instability`";
            return Err(SceneError::missing(key("correlation_time"), expected));
        }
    };
    let scale_factor = deviation("scale_factor", file.scale_factor, 1.0)?;
    let misalignment = small_angle(&key("misalignment"), "misalignment", &file.misalignment)?;
    let sensitivity = match file.sensitivity {
        None => SensitivityErrors::Drawn {
            scale_factor,
            misalignment,
        },
        Some(rows) if scale_factor != 0.0 || misalignment != 0.0 => {
            let expected = "none beside `scale_factor` or `misalignment`";
            return Err(SceneError::value(key("sensitivity"), rows, expected));
        }
        Some(rows) if rows.iter().flatten().all(|element| element.abs() < 1.0) => {
            SensitivityErrors::Given(check::matrix(rows))
        }
        Some(rows) => {
            let expected = "a 3×3 matrix of errors between −1 and 1, by rows";
            return Err(SceneError::value(key("sensitivity"), rows, expected));
        }
    };
    Ok(InertialErrors {
        noise_density: deviation("noise_density", file.noise_density, unit * time.sqrt())?,
        bias: deviation("bias", file.bias, unit)?,
        bias_instability: deviation("bias_instability", file.bias_instability, unit)?,
        correlation_time,
        random_walk: deviation("random_walk", file.random_walk, unit / time.sqrt())?,
        sensitivity,
        range: limit(&key("range"), file.range)?,
    })
}

fn exclusion(
    key: &dyn Fn(&str) -> String,
    scene: &Scene,
    body: usize,
    file: &ExclusionFile,
) -> Result<Exclusion, SceneError> {
    let toward = match (&file.body, file.direction) {
        (Some(name), Some(_)) => {
            let expected = "none beside `direction`";
            return Err(SceneError::value(key("body"), name, expected));
        }
        (Some(name), None) => Toward::Body(other(&key("body"), scene, body, name)?),
        (None, Some(direction)) => {
            let vector = check::vector(&key("direction"), direction)?;
            Toward::Direction(vector.try_normalize(0.0).ok_or_else(|| {
                let expected = "a direction, three numbers that are not all 0";
                SceneError::value(key("direction"), direction, expected)
            })?)
        }
        (None, None) if scene.gravity.central.is_some() => Toward::Attractor,
        (None, None) => {
            let expected = "a `body` or a `direction`: the scene has no central attractor";
            return Err(SceneError::missing(key("body"), expected));
        }
    };
    Ok(Exclusion {
        toward,
        half_angle: cone(&key("half_angle"), "half_angle", &file.half_angle)?,
    })
}

/// Returns the index of a body other than the sensor's own.
fn other(key: &str, scene: &Scene, body: usize, name: &str) -> Result<usize, SceneError> {
    match scene.body_index(name) {
        Some(index) if index != body => Ok(index),
        _ => {
            let others = scene.bodies.iter().map(|other| other.name.as_str());
            let own = &scene.bodies[body].name;
            let others: Vec<_> = others.filter(|other| other != own).collect();
            if others.is_empty() {
                let expected = "another body, of which the scene has none";
                return Err(SceneError::value(key, name, expected));
            }
            Err(SceneError::unknown(key, name, &others))
        }
    }
}

/// Checks a standard deviation in the scene's units, given the SI size of its unit.
fn deviation(key: &str, value: f64, unit: f64) -> Result<f64, SceneError> {
    if (0.0..=LARGEST).contains(&value) && value * unit <= LARGEST {
        Ok(value)
    } else {
        let expected = format!("a standard deviation, a number ≥ 0, at most {LARGEST:e} in SI");
        Err(SceneError::value(key, value, expected))
    }
}

/// Returns the standard deviation of an angle, or 0 if there is none.
fn small_angle(key: &str, name: &'static str, file: &Option<AngleFile>) -> Result<f64, SceneError> {
    let Some(file) = file else { return Ok(0.0) };
    let angle = angle::half_turn(name, file).map_err(|error| SceneError::parameter(key, error))?;
    if (0.0..=PI).contains(&angle) {
        Ok(angle)
    } else {
        let expected = "a standard deviation from 0 to half a turn";
        Err(SceneError::value(key, angle, expected))
    }
}

/// Returns the half-angle of a cone.
fn cone(key: &str, name: &'static str, file: &AngleFile) -> Result<f64, SceneError> {
    let angle = angle::half_turn(name, file).map_err(|error| SceneError::parameter(key, error))?;
    if angle > 0.0 && angle <= PI {
        Ok(angle)
    } else {
        let expected = "an angle above 0, of half a turn at most";
        Err(SceneError::value(key, angle, expected))
    }
}

/// Returns an upper limit, or infinity if there is none.
fn limit(key: &str, value: Option<f64>) -> Result<f64, SceneError> {
    value.map_or(Ok(f64::INFINITY), |value| check::positive(key, value))
}
