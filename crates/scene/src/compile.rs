//! From the file's form to a scene that can be flown.

use lgvi_control::Settings;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::rotation::Chart;
use lgvi_dynamics::{BodyState, Inertia, Method, PointMass, RigidBody};
use nalgebra::{Matrix3, Vector3};

use crate::file::{
    BodyFile, ChartFile, InertiaFile, IntegratorFile, ManeuverFile, RunFile, SceneFile, WeightFile,
};
use crate::scene::{Maneuver, NamedBody, Publishing, Scene};
use crate::{SceneError, Units, check};

/// J2000, 2000-01-01T12:00:00Z (ns since the UNIX epoch).
const J2000: i64 = 946_728_000_000_000_000;

/// Steps of the longest manoeuvre: what the planner keeps in memory, and a sequence in one message.
const MAX_MANEUVER_STEPS: u64 = 1_000_000;

/// Bodies of the largest scene: each has a topic of its own.
const MAX_BODIES: usize = 1024;

/// The last second that a ROS time can say.
const MAX_ROS_SECOND: i64 = i32::MAX as i64;

impl Scene {
    /// The scene called `name` with this text (TOML).
    pub fn parse(name: &str, text: &str) -> Result<Self, SceneError> {
        let file: SceneFile =
            toml::from_str(text).map_err(|error| SceneError::Syntax(error.to_string()))?;
        let units = Units::parse(&file.units.length, &file.units.mass, &file.units.time)?;
        check::name("frame", &file.frame)?;
        let central = file.gravity.central.as_ref();
        let central = central
            .map(|c| check::positive("gravity.central.gm", c.gm))
            .transpose()?;
        let mutual = file.gravity.mutual.as_ref();
        let mutual = mutual
            .map(|m| check::positive("gravity.mutual.constant", m.constant))
            .transpose()?;
        let bodies = bodies(&file.bodies)?;
        let mut scene = Self {
            name: name.into(),
            title: file.title,
            text: text.into(),
            frame: file.frame,
            units,
            epoch: epoch(&file.run)?,
            method: method(&file.run),
            duration: check::positive("run.duration", file.run.duration)?,
            steps: count("run.steps", file.run.steps)?,
            publishing: Publishing {
                state_every: count("publish.state_every", file.publish.state_every)?,
                ros_every: count("publish.ros_every", file.publish.ros_every)?,
            },
            bodies,
            central,
            mutual,
            maneuver: None,
        };
        if !scene.h().is_normal() {
            let expected = format!("a duration that {} steps can divide", scene.steps);
            return Err(SceneError::value("run.duration", scene.duration, expected));
        }
        check_si(&scene)?;
        let end = scene.epoch as f64 * 1e-9 + scene.seconds(scene.steps);
        if end > MAX_ROS_SECOND as f64 {
            let expected = "an end that a ROS time can say, before 2038-01-19T03:14:07Z";
            return Err(SceneError::value("run.duration", scene.duration, expected));
        }
        if let Some(file) = &file.maneuver {
            scene.maneuver = Some(maneuver(&scene, file)?);
            if let Some(Err(error)) = scene.transfer() {
                return Err(SceneError::value(
                    "maneuver",
                    error.to_string(),
                    "a manoeuvre",
                ));
            }
        }
        Ok(scene)
    }
}

/// Everything that leaves the nodes is finite in SI, at the start at least.
fn check_si(scene: &Scene) -> Result<(), SceneError> {
    let units = &scene.units;
    let derived = [
        units.momentum(),
        units.angular_momentum(),
        units.energy(),
        units.force(),
    ];
    if !derived.iter().all(|unit| unit.is_normal()) {
        let expected =
            "units whose derived units (momentum, energy, force) are in the range of numbers";
        return Err(SceneError::value(
            "units",
            [units.length, units.mass, units.time],
            expected,
        ));
    }
    for (index, body) in scene.bodies.iter().enumerate() {
        if !units.state_to_si(&body.state).is_finite() {
            let expected = "a state that is in the range of numbers in SI";
            return Err(SceneError::value(
                format!("bodies[{index}]"),
                &body.name,
                expected,
            ));
        }
        if body.name == scene.frame {
            let expected = "a name other than that of the inertial frame";
            return Err(SceneError::value(
                format!("bodies[{index}].name"),
                &body.name,
                expected,
            ));
        }
    }
    let simulation = scene
        .simulation()
        .map_err(|error| SceneError::value("run.integrator", "", error.to_string()))?;
    let invariants = simulation.invariants();
    let energy = invariants.energy * units.energy();
    let momentum = invariants.angular_momentum * units.angular_momentum();
    if !(energy.is_finite() && momentum.sum().is_finite()) {
        let expected = "states of finite energy and momentum: no two points of mass at one place";
        return Err(SceneError::value("bodies", energy, expected));
    }
    Ok(())
}

fn count(key: &str, value: u64) -> Result<u64, SceneError> {
    if value > 0 {
        Ok(value)
    } else {
        Err(SceneError::value(key, value, "a whole number > 0"))
    }
}

fn epoch(run: &RunFile) -> Result<i64, SceneError> {
    let Some(datetime) = run.epoch else {
        return Ok(J2000);
    };
    let text = datetime.to_string();
    let expected = "a date and time with offset, such as 2000-01-01T12:00:00Z, from 1970 to 2038";
    let refuse = || SceneError::value("run.epoch", &text, expected);
    let parsed = chrono::DateTime::parse_from_rfc3339(&text).map_err(|_| refuse())?;
    let nanoseconds = parsed.timestamp_nanos_opt().ok_or_else(refuse)?;
    if (0..MAX_ROS_SECOND).contains(&parsed.timestamp()) {
        Ok(nanoseconds)
    } else {
        Err(refuse())
    }
}

fn method(run: &RunFile) -> Method {
    let chart = match run.chart {
        ChartFile::Cayley => Chart::Cayley,
        ChartFile::Exponential => Chart::Exponential,
    };
    match run.integrator {
        IntegratorFile::Lgvi => Method::Lgvi(Rotor::Discrete(chart)),
        IntegratorFile::LieEuler => Method::LieEuler(Rotor::Discrete(chart)),
    }
}

fn bodies(files: &[BodyFile]) -> Result<Vec<NamedBody>, SceneError> {
    if !(1..=MAX_BODIES).contains(&files.len()) {
        let expected = format!("1 to {MAX_BODIES} bodies");
        return Err(SceneError::value("bodies", files.len(), expected));
    }
    let mut bodies: Vec<NamedBody> = Vec::with_capacity(files.len());
    for (index, file) in files.iter().enumerate() {
        let body = body(&format!("bodies[{index}]"), file)?;
        if bodies.iter().any(|other| other.name == body.name) {
            let key = format!("bodies[{index}].name");
            return Err(SceneError::value(
                key,
                &body.name,
                "a name that no other body has",
            ));
        }
        bodies.push(body);
    }
    Ok(bodies)
}

fn body(key: &str, file: &BodyFile) -> Result<NamedBody, SceneError> {
    check::name(&format!("{key}.name"), &file.name)?;
    let (inertia, written) = match file.inertia {
        InertiaFile::Principal(moments) => (
            Matrix3::from_diagonal(&Vector3::from(moments)),
            format!("{moments:?}"),
        ),
        InertiaFile::Matrix(rows) => (check::matrix(rows), format!("{rows:?}")),
    };
    let inertia = Inertia::new(inertia).map_err(|error| SceneError::Value {
        key: format!("{key}.inertia"),
        value: written,
        expected: format!("the inertia of a rigid body: {error}"),
    })?;
    let points = file.points.iter().map(|point| PointMass {
        mass: point.mass,
        position: Vector3::from(point.position),
    });
    let body = RigidBody::new(file.mass, inertia, points.collect()).map_err(|error| {
        SceneError::value(
            key,
            &file.name,
            format!("the masses of a rigid body: {error}"),
        )
    })?;
    let state = BodyState::from_velocities(
        &body,
        check::vector(&format!("{key}.position"), file.position)?,
        check::vector(&format!("{key}.velocity"), file.velocity)?,
        check::rotation(&format!("{key}.attitude"), &file.attitude)?,
        check::vector(&format!("{key}.angular_velocity"), file.angular_velocity)?,
    );
    Ok(NamedBody {
        name: file.name.clone(),
        body,
        state,
    })
}

fn maneuver(scene: &Scene, file: &ManeuverFile) -> Result<Maneuver, SceneError> {
    let body = scene.body_index(&file.body).ok_or_else(|| {
        let names: Vec<_> = scene.bodies.iter().map(|body| body.name.as_str()).collect();
        SceneError::value(
            "maneuver.body",
            &file.body,
            format!("one of {}", names.join(", ")),
        )
    })?;
    if scene.mutual.is_some() && scene.bodies.len() > 1 {
        let expected =
            "no mutual gravity beside a manoeuvre: the planner knows fixed attractors only";
        return Err(SceneError::value(
            "gravity.mutual.constant",
            scene.mutual,
            expected,
        ));
    }
    if !(2..=MAX_MANEUVER_STEPS).contains(&scene.steps) {
        let expected = format!("2 to {MAX_MANEUVER_STEPS} steps for a manoeuvre");
        return Err(SceneError::value("run.steps", scene.steps, expected));
    }
    let target = &file.target;
    let target = BodyState::from_velocities(
        &scene.bodies[body].body,
        check::vector("maneuver.target.position", target.position)?,
        check::vector("maneuver.target.velocity", target.velocity)?,
        check::rotation("maneuver.target.attitude", &target.attitude)?,
        check::vector("maneuver.target.angular_velocity", target.angular_velocity)?,
    );
    let defaults = Settings::default();
    let solver = &file.solver;
    Ok(Maneuver {
        body,
        target,
        force_weight: weight(&file.force_weight),
        moment_weight: weight(&file.moment_weight),
        settings: Settings {
            tolerance: match solver.tolerance {
                Some(tolerance) => check::positive("maneuver.solver.tolerance", tolerance)?,
                None => defaults.tolerance,
            },
            max_iterations: solver.max_iterations.unwrap_or(defaults.max_iterations),
            ..defaults
        },
    })
}

fn weight(file: &WeightFile) -> Matrix3<f64> {
    match *file {
        WeightFile::Scalar(weight) => Matrix3::from_diagonal_element(weight),
        WeightFile::Diagonal(weights) => Matrix3::from_diagonal(&Vector3::from(weights)),
        WeightFile::Matrix(rows) => check::matrix(rows),
    }
}

#[cfg(test)]
mod tests;
