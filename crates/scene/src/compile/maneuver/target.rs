use lgvi_control::{Motion, RotationTarget, Terminal, TranslationTarget};
use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use super::moves;
use crate::file::TargetFile;
use crate::{Scene, SceneError, check};

/// Where the manoeuvre may end: what the file leaves out is free.
pub(super) fn target(
    scene: &Scene,
    body: usize,
    file: &TargetFile,
    motion: Motion,
) -> Result<Terminal, SceneError> {
    check_motion(file, motion)?;
    let target = Terminal {
        translation: translation(scene, body, file)?,
        rotation: rotation(scene, body, file)?,
    };
    let free = Terminal {
        translation: TranslationTarget::Free,
        rotation: RotationTarget::Free,
    };
    if target == free {
        let expected = "one of position, orbit, attitude and spin_axis at least";
        return Err(SceneError::missing("maneuver.target", expected));
    }
    Ok(target)
}

/// What does not move has no target.
fn check_motion(file: &TargetFile, motion: Motion) -> Result<(), SceneError> {
    let (translates, rotates) = moves(motion);
    let given = [
        ("position", file.position.is_some(), translates),
        ("velocity", file.velocity.is_some(), translates),
        ("orbit", file.orbit.is_some(), translates),
        ("attitude", file.attitude.is_some(), rotates),
        ("spin_axis", file.spin_axis.is_some(), rotates),
        ("angular_velocity", file.angular_velocity.is_some(), rotates),
    ];
    match given.iter().find(|(_, given, planned)| *given && !planned) {
        Some((name, ..)) => {
            let expected = "none: that motion is not planned";
            Err(SceneError::value(key(name), "given", expected))
        }
        None => Ok(()),
    }
}

fn translation(
    scene: &Scene,
    body: usize,
    file: &TargetFile,
) -> Result<TranslationTarget, SceneError> {
    let momentum =
        |key: &str, velocity| Ok(check::vector(key, velocity)? * scene.bodies[body].body.mass());
    match (&file.orbit, file.position, file.velocity) {
        (Some(_), None, None) | (None, _, _) => {}
        (Some(_), ..) => {
            let expected = "none beside `position` or `velocity`";
            return Err(SceneError::value(key("orbit"), "given", expected));
        }
    }
    if let Some(orbit) = &file.orbit {
        let Some(central) = &scene.gravity.central else {
            let expected = "none without `gravity.central`";
            return Err(SceneError::value(key("orbit"), "given", expected));
        };
        return kepler(
            central.gm,
            central.position,
            check::vector(&key("orbit.position"), orbit.position)?,
            check::vector(&key("orbit.velocity"), orbit.velocity)?,
            scene.bodies[body].body.mass(),
        );
    }
    Ok(match (file.position, file.velocity) {
        (Some(position), Some(velocity)) => TranslationTarget::State {
            position: check::vector(&key("position"), position)?,
            linear_momentum: momentum(&key("velocity"), velocity)?,
        },
        (Some(position), None) => TranslationTarget::Position {
            position: check::vector(&key("position"), position)?,
        },
        (None, Some(velocity)) => {
            let expected = "none without `position`";
            return Err(SceneError::value(key("velocity"), velocity, expected));
        }
        (None, None) => TranslationTarget::Free,
    })
}

/// The orbit of a state, which must be an ellipse.
fn kepler(
    gm: f64,
    center: Vector3<f64>,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    mass: f64,
) -> Result<TranslationTarget, SceneError> {
    let from_center = position - center;
    let distance = from_center.norm();
    if distance == 0.0 || from_center.cross(&velocity).norm() == 0.0 {
        let expected = "a state that does not move through the attractor";
        let value = [position.as_slice(), velocity.as_slice()];
        return Err(SceneError::value(key("orbit"), value, expected));
    }
    let energy = 0.5 * velocity.norm_squared() - gm / distance;
    if energy.is_nan() || energy >= 0.0 {
        let escape = (2.0 * gm / distance).sqrt();
        let expected = format!("a speed below {escape}, that of escape");
        let value = velocity.as_slice();
        return Err(SceneError::value(key("orbit.velocity"), value, expected));
    }
    Ok(TranslationTarget::Orbit {
        gm,
        center,
        position,
        linear_momentum: velocity * mass,
    })
}

fn rotation(scene: &Scene, body: usize, file: &TargetFile) -> Result<RotationTarget, SceneError> {
    let momentum = |attitude: Matrix3<f64>, angular_velocity| {
        let angular_velocity = check::vector(&key("angular_velocity"), angular_velocity)?;
        let zero = Vector3::zeros();
        let body = &scene.bodies[body].body;
        let state = BodyState::from_velocities(body, zero, zero, attitude, angular_velocity);
        Ok(state.angular_momentum)
    };
    Ok(
        match (&file.attitude, &file.spin_axis, file.angular_velocity) {
            (Some(_), Some(_), _) => {
                let expected = "none beside `attitude`";
                return Err(SceneError::value(key("spin_axis"), "given", expected));
            }
            (Some(attitude), None, Some(angular_velocity)) => {
                let attitude = check::rotation(&key("attitude"), attitude)?;
                RotationTarget::State {
                    attitude,
                    angular_momentum: momentum(attitude, angular_velocity)?,
                }
            }
            (Some(attitude), None, None) => RotationTarget::Attitude {
                attitude: check::rotation(&key("attitude"), attitude)?,
            },
            (None, Some(spin), Some(angular_velocity)) => RotationTarget::SpinAxis {
                axis: check::direction(&key("spin_axis.axis"), spin.axis)?,
                direction: check::direction(&key("spin_axis.direction"), spin.direction)?,
                angular_momentum: momentum(Matrix3::identity(), angular_velocity)?,
            },
            (None, Some(_), None) => {
                let expected = "three numbers beside `spin_axis`";
                return Err(SceneError::missing(key("angular_velocity"), expected));
            }
            (None, None, Some(angular_velocity)) => {
                let expected = "none without `attitude` or `spin_axis`";
                return Err(SceneError::value(
                    key("angular_velocity"),
                    angular_velocity,
                    expected,
                ));
            }
            (None, None, None) => RotationTarget::Free,
        },
    )
}

fn key(name: &str) -> String {
    format!("maneuver.target.{name}")
}
