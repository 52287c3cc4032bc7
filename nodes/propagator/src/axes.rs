//! The axes that controls are given in.

use lgvi_dynamics::Load;
use lgvi_scene::Scene;
use nalgebra::Matrix3;

/// Axes of forces and moments, from one step to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// Forces are in those of the scene's inertial frame, moments in those of the controlled body.
    Split,
    /// Both are in those of the inertial frame.
    Inertial,
    /// Both are in those of the body of an index, and turn with it.
    Body(usize),
}

impl Axes {
    /// Those that the name of the inertial frame or of a body's means for both forces and moments; `None` for other names.
    pub(crate) fn named(scene: &Scene, frame: &str) -> Option<Self> {
        if frame.is_empty() || frame == scene.frame {
            return Some(Self::Inertial);
        }
        let body = scene.bodies.iter().position(|body| body.frame == frame)?;
        Some(Self::Body(body))
    }

    /// Converts a load on `body` that is given in these axes: the force to the inertial frame, the moment to the frame of the
    /// body. `attitude` has the rotation matrix from the frame of the body of an index to the inertial one.
    pub fn load(self, body: usize, load: &Load, attitude: impl Fn(usize) -> Matrix3<f64>) -> Load {
        match self {
            Self::Split => *load,
            Self::Inertial => Load {
                moment: attitude(body).tr_mul(&load.moment),
                ..*load
            },
            Self::Body(index) if index == body => Load {
                force: attitude(body) * load.force,
                ..*load
            },
            Self::Body(index) => {
                let other = attitude(index);
                Load {
                    force: other * load.force,
                    moment: attitude(body).tr_mul(&(other * load.moment)),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use lgvi_lie::exp;
    use nalgebra::Vector3;

    use super::*;

    /// What acts in inertial axes does not depend on the axes that it is given in.
    #[test]
    fn the_same_load_is_converted_from_all_axes() {
        let attitudes = [[0.3, -0.2, 0.5], [-1.1, 0.4, 0.7]].map(|turn| exp(&Vector3::from(turn)));
        let attitude = |index: usize| attitudes[index];
        let (force, moment) = (Vector3::new(1.0, -2.0, 3.0), Vector3::new(0.5, 0.25, -4.0));
        let seen = |index: usize, vector: Vector3<f64>| attitudes[index].transpose() * vector;
        let expected = Load {
            force,
            moment: seen(0, moment),
        };
        for (axes, force, moment) in [
            (Axes::Split, force, seen(0, moment)),
            (Axes::Inertial, force, moment),
            (Axes::Body(0), seen(0, force), seen(0, moment)),
            (Axes::Body(1), seen(1, force), seen(1, moment)),
        ] {
            let load = axes.load(0, &Load { force, moment }, attitude);
            assert!(
                (load.force - expected.force).norm() < 1e-14,
                "{axes:?}: {load:?}"
            );
            assert!(
                (load.moment - expected.moment).norm() < 1e-14,
                "{axes:?}: {load:?}"
            );
        }
    }
}
