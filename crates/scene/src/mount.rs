use lgvi_dynamics::Load;
use nalgebra::{Matrix3, Vector3};

use crate::Scene;

/// The pose of a frame that is fixed in a body, in the body frame and the scene's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount {
    /// Origin of the frame.
    pub position: Vector3<f64>,
    /// Rotation matrix from the frame to the body frame.
    pub attitude: Matrix3<f64>,
}

impl Mount {
    /// Converts a load at the origin of the frame, in its axes, to one at the center of mass, in the body's axes.
    pub fn load(&self, load: &Load) -> Load {
        let force = self.attitude * load.force;
        Load {
            force,
            moment: self.attitude * load.moment + self.position.cross(&force),
        }
    }

    /// Turns force and moment from the axes of the frame to those of the body.
    pub fn turn(&self, load: &Load) -> Load {
        Load {
            force: self.attitude * load.force,
            moment: self.attitude * load.moment,
        }
    }
}

impl Scene {
    /// Returns the pose of `frame` in the body of an index, or `None` if the frame is not fixed in that body.
    pub fn mount(&self, body: usize, frame: &str) -> Option<Mount> {
        let (base, mount) = self.base(frame);
        (base == self.bodies[body].frame).then_some(mount)
    }

    /// Returns the frame of the body in which `frame` is fixed, or the inertial one, and its pose there. The base of a frame
    /// that the scene does not have is that frame.
    pub fn base<'a>(&'a self, frame: &'a str) -> (&'a str, Mount) {
        let mut mount = Mount {
            position: Vector3::zeros(),
            attitude: Matrix3::identity(),
        };
        let mut name = frame;
        // Parents come before their children.
        for frame in self.frames.iter().rev() {
            if frame.name == name && frame.name != self.frame {
                mount.position = frame.position + frame.attitude * mount.position;
                mount.attitude = frame.attitude * mount.attitude;
                name = &frame.parent;
            }
        }
        (name, mount)
    }

    /// Returns the names of the frames that are fixed in the body of an index, that of the body first.
    pub fn fixed_frames(&self, body: usize) -> impl Iterator<Item = &str> {
        let others = self.frames.iter().map(|frame| frame.name.as_str());
        let fixed = others.filter(move |name| self.mount(body, name).is_some());
        std::iter::once(self.bodies[body].frame.as_str()).chain(fixed)
    }
}
