mod kinds;

use crate::file::{BodyFile, SensorFile};
use crate::{Scene, SceneError, Sensor, check, noise, suggestion};

/// Largest number of sensors in a scene, each of which has its own topic.
const MAX_SENSORS: usize = 256;

/// Largest number of measurements that wait for their messages.
const MAX_WAITING: u64 = 1000;

/// Relative deviation of a time from a whole number of steps that is taken for rounding.
const ROUNDING: f64 = 1e-9;

/// Compiles the sensors of a scene that has none yet. `seed` is that of all sensors that have none.
pub(super) fn sensors(
    scene: &Scene,
    bodies: &[BodyFile],
    seed: u64,
) -> Result<Vec<Sensor>, SceneError> {
    let count = bodies.iter().map(|body| body.sensors.len()).sum();
    if count > MAX_SENSORS {
        let expected = format!("{MAX_SENSORS} sensors at most, on all bodies together");
        return Err(SceneError::value("bodies.sensors", count, expected));
    }
    let mut sensors = Vec::with_capacity(count);
    for (body, file) in bodies.iter().enumerate() {
        for (index, sensor) in file.sensors.iter().enumerate() {
            let key = format!("bodies[{body}].sensors[{index}]");
            let name = sensor.keys().name;
            let mut earlier = file.sensors[..index].iter();
            if earlier.any(|other| other.keys().name == name) {
                let expected = "a name that no other sensor of the body has";
                return Err(SceneError::value(format!("{key}.name"), name, expected));
            }
            sensors.push(compiled(&key, scene, body, sensor, seed)?);
        }
    }
    Ok(sensors)
}

fn compiled(
    key: &str,
    scene: &Scene,
    body: usize,
    file: &SensorFile,
    seed: u64,
) -> Result<Sensor, SceneError> {
    let key = |name: &str| format!("{key}.{name}");
    let keys = file.keys();
    check::name(&key("name"), keys.name)?;
    let own = &scene.bodies[body];
    let frame = keys.frame.unwrap_or(&own.frame);
    let mount = scene.mount(body, frame).ok_or_else(|| {
        let known: Vec<_> = scene.fixed_frames(body).collect();
        let expected = suggestion::one_of(frame, &known);
        let expected = format!("a frame that is fixed in {}: {expected}", own.name);
        SceneError::value(key("frame"), frame, expected)
    })?;
    let every = steps(&key("period"), scene, keys.period)?;
    if !(1..=scene.steps).contains(&every) {
        let expected = format!("{} at least, and no longer than the run", scene.h());
        return Err(SceneError::value(key("period"), keys.period, expected));
    }
    let delay = steps(&key("delay"), scene, keys.delay)?;
    if delay / every > MAX_WAITING {
        let expected = format!("{MAX_WAITING} periods at most");
        return Err(SceneError::value(key("delay"), keys.delay, expected));
    }
    Ok(Sensor {
        name: keys.name.into(),
        body,
        frame: frame.into(),
        mount,
        every,
        delay,
        seed: keys
            .seed
            .unwrap_or_else(|| noise::seed(seed, fingerprint(&own.name, keys.name))),
        kind: kinds::kind(&key, scene, body, file)?,
    })
}

/// Returns a time as a number of steps.
fn steps(key: &str, scene: &Scene, time: f64) -> Result<u64, SceneError> {
    let h = scene.h();
    let steps = (time / h).round();
    // Beyond 2⁵³ not every number of steps is a number.
    if (0.0..=9e15).contains(&steps) && (time - steps * h).abs() <= ROUNDING * time {
        Ok(steps as u64)
    } else {
        let expected = format!("a whole number of the run's steps of {h}");
        Err(SceneError::value(key, time, expected))
    }
}

/// Returns a number that depends on both names: FNV-1a of the names with a separator.
fn fingerprint(body: &str, sensor: &str) -> u64 {
    let bytes = body.bytes().chain([0]).chain(sensor.bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}
