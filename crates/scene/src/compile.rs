//! Compiles the parsed file to a scene that can be flown.

mod actuators;
mod body;
mod disturbance;
mod docking;
mod elements;
mod ensemble;
mod frame;
mod maneuver;
mod polyhedron;
mod run;
mod sensors;
mod state;

pub use actuators::{MAX_THRUSTERS, MAX_WHEELS};
pub use maneuver::Seen;
pub(crate) use maneuver::{ConstraintFile, Relative};

use std::sync::Arc;

use lgvi_dynamics::Invariants;

use crate::file::{BodyFile, ManeuverFile, SceneFile};
use crate::scene::{NamedBody, Publishing, Scene};
use crate::{Chosen, LONGEST, SceneError, SceneGravity, Units, check, numbers};
use state::Bodies;

/// Largest number of bodies in a scene, each of which has its own topic.
const MAX_BODIES: usize = 1024;

impl Scene {
    /// Parses the scene called `name` from its text (TOML).
    pub fn parse(name: &str, text: &str) -> Result<Self, SceneError> {
        if text.len() > LONGEST {
            return Err(SceneError::TooLong);
        }
        Self::compile(name, text).map_err(|error| error.located(text))
    }

    fn compile(name: &str, text: &str) -> Result<Self, SceneError> {
        let syntax = |error| SceneError::syntax(&error);
        let mut file: SceneFile = toml::from_str(text).map_err(syntax)?;
        file.maneuver.iter_mut().for_each(ManeuverFile::join);
        numbers::check(text)?;
        let units = Units::parse(&file.units.length, &file.units.mass, &file.units.time)?;
        check::name("frame", &file.frame)?;
        let gravity = SceneGravity::parse(&file.gravity, &units)?;
        let bodies = bodies(&file.bodies, &gravity)?;
        let integration = run::integration(&file.run, file.maneuver.as_ref())?;
        let mut scene = Self {
            name: name.into(),
            title: file.title,
            text: text.into(),
            frame: file.frame,
            units,
            epoch: run::epoch(&file.run)?,
            integration,
            accuracy: run::accuracy(&file.run, file.maneuver.as_ref()),
            chosen: None,
            skipping: run::skipping(&file.run, integration)?,
            substeps: run::substeps(&file.run)?,
            subdivide: run::subdivide(&file.run)?,
            duration: check::positive("run.duration", file.run.duration)?,
            steps: count("run.steps", file.run.steps)?,
            publishing: Publishing {
                state_every: count("publish.state_every", file.publish.state_every)?,
                ros_every: count("publish.ros_every", file.publish.ros_every)?,
            },
            bodies,
            frames: Vec::new(),
            gravity,
            docking: Vec::new(),
            sensors: Vec::new(),
            maneuver: None,
            disturbance: None,
            ensemble: None,
        };
        if let Some(file) = file.chosen {
            scene.chosen = Some(Chosen::compile(file, integration, &scene.system())?);
        }
        run::check_step(&scene)?;
        check_si(&scene)?;
        run::check_end(&scene)?;
        scene.frames = frame::frames(&scene, &file.frames)?;
        scene.sensors = sensors::sensors(&scene, &file.bodies, file.run.sensor_seed)?;
        scene.docking = docking::dockings(&scene, &file.docking)?;
        actuators::check_run(&scene)?;
        if let Some(file) = &file.maneuver {
            scene.maneuver = Some(maneuver::maneuver(&scene, file)?);
            match scene.transfer() {
                None => {}
                Some(Ok(transfer)) => maneuver::check_limits(&scene, &transfer)?,
                Some(Err(error)) => {
                    return Err(SceneError::value(
                        "maneuver",
                        error.to_string(),
                        "a maneuver",
                    ));
                }
            }
        }
        maneuver::check_formation(&scene)?;
        if let Some(file) = &file.disturbance {
            scene.disturbance = Some(disturbance::disturbance(&scene, file)?);
            disturbance::check_states(&scene)?;
        }
        if let Some(file) = &file.ensemble {
            scene.ensemble = Some(ensemble::ensemble(&scene, file)?);
        }
        if let Some(file) = &file.maneuver {
            let chances = maneuver::chances(&scene, file)?;
            if let Some(maneuver) = &mut scene.maneuver {
                maneuver.chances = chances;
            }
        }
        Ok(scene)
    }
}

/// Checks that all published quantities are finite in SI, at least at the start.
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
    let states: Vec<_> = scene.bodies.iter().map(|body| body.state).collect();
    let system = scene.system();
    run::check_method(scene, &system)?;
    let invariants = Invariants::of(&system, &states);
    let energy = invariants.energy * units.energy();
    let momentum = invariants.angular_momentum * units.angular_momentum();
    if !(energy.is_finite() && momentum.sum().is_finite()) {
        let expected = "states of finite energy and momentum: no two points of mass at one place";
        return Err(SceneError::value("bodies", energy, expected));
    }
    system.check_clearance(&states).map_err(|approach| {
        let name = |body: usize| &scene.bodies[body].name;
        let other = approach.other.map_or("the attractor", |other| name(other));
        let expected = format!(
            "a distance of at least {} from {other}, the sum of their radii",
            approach.limit
        );
        let key = format!("bodies[{}].position", approach.body);
        SceneError::value(key, approach.distance, expected)
    })
}

fn count(key: &str, value: u64) -> Result<u64, SceneError> {
    if value > 0 {
        Ok(value)
    } else {
        Err(SceneError::value(key, value, "a whole number > 0"))
    }
}

fn bodies(files: &[BodyFile], gravity: &SceneGravity) -> Result<Vec<NamedBody>, SceneError> {
    if !(1..=MAX_BODIES).contains(&files.len()) {
        let expected = format!("1 to {MAX_BODIES} bodies");
        return Err(SceneError::value("bodies", files.len(), expected));
    }
    let mut work = polyhedron::MOST_WORK;
    let (mut bodies, mut meshes) = (Vec::new(), Vec::new());
    for (index, file) in files.iter().enumerate() {
        let (body, mesh) = body::body(
            &format!("bodies[{index}]"),
            file,
            gravity.atmosphere(),
            &mut work,
        )?;
        if files[..index].iter().any(|other| other.name == file.name) {
            let key = format!("bodies[{index}].name");
            let expected = "a name that no other body has";
            return Err(SceneError::value(key, &file.name, expected));
        }
        bodies.push(body);
        meshes.push(mesh.map(Arc::new));
    }
    let states = Bodies {
        files,
        bodies: &bodies,
        gravity,
    }
    .states()?;
    for ((file, body), state) in files.iter().zip(&mut bodies).zip(&states) {
        let rate = state.angular_velocity(body);
        if let Some(wheels) = body.wheels_mut() {
            let speeds: Vec<_> = file.wheels.iter().map(|wheel| wheel.speed).collect();
            wheels.set_speeds(&speeds, &rate);
        }
    }
    let parts = files.iter().zip(bodies).zip(meshes).zip(states);
    let named = parts.map(|(((file, body), mesh), state)| NamedBody {
        name: file.name.clone(),
        frame: file.name.clone(),
        body,
        state,
        mesh,
        wheels: file.wheels.iter().map(|wheel| wheel.name.clone()).collect(),
        thrusters: (file.thrusters.iter())
            .map(|thruster| thruster.name.clone())
            .collect(),
        given: state::given(file),
    });
    Ok(named.collect())
}

#[cfg(test)]
mod tests;
