use std::iter::once;

use nalgebra::{Matrix3, Vector3};

use crate::file::FrameFile;
use crate::{Frame, Scene, SceneError, check, suggestion};

/// Largest number of frames in a scene: a single message holds all of them.
const MAX_FRAMES: usize = 1024;

/// Compiles the frames of a scene that has none yet. The parent of a frame must be defined before it, which excludes
/// cycles.
pub(super) fn frames(scene: &Scene, files: &[FrameFile]) -> Result<Vec<Frame>, SceneError> {
    if files.len() > MAX_FRAMES {
        let expected = format!("{MAX_FRAMES} frames at most");
        return Err(SceneError::value("frames", files.len(), expected));
    }
    let mut frames: Vec<Frame> = Vec::with_capacity(files.len());
    for (index, file) in files.iter().enumerate() {
        let key = |name: &str| format!("frames[{index}].{name}");
        check::name(&key("name"), &file.name)?;
        let body = scene.body_index(&file.name).is_some();
        if body || frames.iter().any(|other| other.name == file.name) {
            let expected = "a name that no body and no other frame has";
            return Err(SceneError::value(key("name"), &file.name, expected));
        }
        if file.name == scene.frame {
            check_outside(&key("parent"), scene, files, &file.parent)?;
        } else {
            check_inside(&key("parent"), scene, &frames, &file.parent)?;
        }
        frames.push(Frame {
            name: file.name.clone(),
            parent: file.parent.clone(),
            position: position(&key("position"), scene, file.position)?,
            attitude: match &file.attitude {
                Some(attitude) => check::rotation(&key("attitude"), attitude)?,
                None => Matrix3::identity(),
            },
        });
    }
    Ok(frames)
}

/// Checks that the parent of a frame belongs to the scene.
fn check_inside(
    key: &str,
    scene: &Scene,
    earlier: &[Frame],
    parent: &str,
) -> Result<(), SceneError> {
    let bodies = scene.bodies.iter().map(|body| body.name.as_str());
    // The inertial frame always exists, whether or not it has a parent.
    let earlier = earlier.iter().map(|frame| frame.name.as_str());
    let earlier = earlier.filter(|name| *name != scene.frame);
    let known: Vec<_> = once(scene.frame.as_str())
        .chain(bodies)
        .chain(earlier)
        .collect();
    if known.contains(&parent) {
        return Ok(());
    }
    let expected = suggestion::one_of(parent, &known);
    let expected = format!("the inertial frame, a body or an earlier frame: {expected}");
    Err(SceneError::value(key, parent, expected))
}

/// Checks that the parent of the inertial frame is outside the scene, in which all frames descend from the inertial
/// frame.
fn check_outside(
    key: &str,
    scene: &Scene,
    files: &[FrameFile],
    parent: &str,
) -> Result<(), SceneError> {
    check::name(key, parent)?;
    let body = scene.body_index(parent).is_some();
    if body || parent == scene.frame || files.iter().any(|file| file.name == parent) {
        let expected = format!(
            "a frame outside of the scene, as everything in it hangs on {}",
            scene.frame
        );
        return Err(SceneError::value(key, parent, expected));
    }
    Ok(())
}

fn position(key: &str, scene: &Scene, value: [f64; 3]) -> Result<Vector3<f64>, SceneError> {
    let position = check::vector(key, value)?;
    if (position * scene.units.length)
        .iter()
        .all(|c| c.is_finite())
    {
        Ok(position)
    } else {
        let expected = "a position that is in the range of numbers in SI";
        Err(SceneError::value(key, value, expected))
    }
}
