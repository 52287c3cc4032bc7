use lgvi_common::header;
use lgvi_dynamics::BodyState;
use lgvi_lie::to_quaternion;
use lgvi_msgs::geometry_msgs::{Quaternion, Transform, TransformStamped};
use lgvi_msgs::stamp::StampError;
use lgvi_msgs::std_msgs::Header;
use lgvi_msgs::tf2_msgs::TFMessage;
use lgvi_scene::{Frame, Scene};
use nalgebra::{Matrix3, Vector3};

use super::Snapshot;
use super::states::vector;

/// Where the bodies are.
pub(crate) fn transforms(scene: &Scene, snapshot: &Snapshot) -> Result<TFMessage, StampError> {
    let each = scene
        .bodies
        .iter()
        .zip(&snapshot.states)
        .map(|(named, state)| {
            let BodyState {
                position, attitude, ..
            } = state;
            Ok(TransformStamped {
                header: header(scene, snapshot.step)?,
                child_frame_id: named.frame.clone(),
                transform: transform(scene, position, attitude),
            })
        });
    Ok(TFMessage {
        transforms: each.collect::<Result<_, _>>()?,
    })
}

/// Where the scene's frames stay; `None` where it has none.
pub(crate) fn static_transforms(scene: &Scene) -> Result<Option<TFMessage>, StampError> {
    if scene.frames.is_empty() {
        return Ok(None);
    }
    let each = scene.frames.iter().map(|frame| {
        let Frame {
            name,
            parent,
            position,
            attitude,
        } = frame;
        Ok(TransformStamped {
            header: Header {
                frame_id: parent.clone(),
                ..header(scene, 0)?
            },
            child_frame_id: name.clone(),
            transform: transform(scene, position, attitude),
        })
    });
    Ok(Some(TFMessage {
        transforms: each.collect::<Result<_, _>>()?,
    }))
}

fn transform(scene: &Scene, position: &Vector3<f64>, attitude: &Matrix3<f64>) -> Transform {
    let (w, u) = to_quaternion(attitude);
    Transform {
        translation: vector((position * scene.units.length).into()),
        rotation: Quaternion {
            x: u.x,
            y: u.y,
            z: u.z,
            w,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = r#"
        title = "A ball with an eye"
        [units]
        length = "2 m"
        [run]
        epoch = 2026-01-01T00:00:00Z
        duration = 1.0
        steps = 10
        integrator = "lgvi"
        [[bodies]]
        name = "ball"
        mass = 3.0
        inertia = [1, 1, 1]
        position = [1, 2, 3]
        velocity = [0, 1, 0]
        attitude = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
        angular_velocity = [0, 0, 8]
    "#;
    const FRAMES: &str = r#"
        [[frames]]
        name = "eye"
        parent = "ball"
        position = [0.5, 0, 0.25]
        attitude = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]
        [[frames]]
        name = "inertial"
        parent = "map"
        position = [100, 0, 0]
    "#;

    #[test]
    fn frames_are_sent_once_in_si_with_their_parents() {
        let scene = Scene::parse("test", &format!("{SCENE}{FRAMES}")).unwrap();
        let message = static_transforms(&scene).unwrap().unwrap();
        let [eye, inertial] = &message.transforms[..] else {
            panic!("{message:?}")
        };
        assert_eq!(
            (eye.header.frame_id.as_str(), eye.header.stamp.sec),
            ("ball", 1_767_225_600)
        );
        assert_eq!(eye.child_frame_id, "eye");
        assert_eq!(eye.transform.translation, vector([1.0, 0.0, 0.5]));
        // Of an optical frame, z to the front and x to the right (REP 103): q and −q are the same.
        let Quaternion { x, y, z, w } = eye.transform.rotation;
        assert_eq!([x, y, z, w].map(|c| c / w), [-1.0, 1.0, -1.0, 1.0]);
        assert_eq!(w.abs(), 0.5);
        assert_eq!(inertial.header.frame_id, "map");
        assert_eq!(inertial.child_frame_id, "inertial");
        assert_eq!(inertial.transform.translation, vector([200.0, 0.0, 0.0]));
        assert_eq!(inertial.transform.rotation, Quaternion::default());

        let prefixed = static_transforms(&scene.with_frame_prefix("chaser/")).unwrap();
        let prefixed = prefixed.unwrap().transforms;
        let names = prefixed.iter().map(|placed| {
            let (parent, child) = (&placed.header.frame_id, &placed.child_frame_id);
            (parent.as_str(), child.as_str())
        });
        assert_eq!(
            names.collect::<Vec<_>>(),
            [("chaser/ball", "chaser/eye"), ("map", "chaser/inertial")]
        );
        let without = Scene::parse("test", SCENE).unwrap();
        assert_eq!(static_transforms(&without).unwrap(), None);
    }
}
