use serde::Deserialize;

use crate::angle::AngleFile;
use crate::axes::AxesFile;
use crate::file::SensorFile;
use crate::gravity::DragFile;

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct BodyFile {
    /// Name of the body, also of its frame, and part of its topics: a letter, then letters, digits and single underscores.
    pub name: String,
    /// Mass.
    pub mass: f64,
    /// Principal moments of inertia, or the 3×3 matrix, body frame. Optional for an ellipsoid or a polyhedron.
    pub inertia: Option<InertiaFile>,
    /// Point masses on which gravity acts. They sum to `mass`, and their center is the origin of the body frame.
    #[serde(default)]
    pub points: Vec<PointFile>,
    /// The body's potential as a multipole expansion.
    pub multipole: Option<MultipoleFile>,
    /// The body as a homogeneous polyhedron.
    pub polyhedron: Option<PolyhedronFile>,
    /// Reaction wheels, 16 at most, whose masses are part of `mass` and, with locked wheels, of `inertia`; only of a free or
    /// pivoted body.
    #[serde(default)]
    pub wheels: Vec<WheelFile>,
    /// Thrusters, 64 at most; only of a free or pivoted body.
    #[serde(default)]
    pub thrusters: Vec<ThrusterFile>,
    /// Engine at the center of mass that exerts the forces that are commanded; only of a free body without `thrusters`.
    pub engine: Option<EngineFile>,
    /// The propellant of the thrusters or of the engine, which is part of `mass` and `inertia`, about the center of mass.
    pub propellant: Option<PropellantFile>,
    /// Drag in the atmosphere of the central attractor; only of a free body.
    pub drag: Option<DragFile>,
    /// Two bodies may not come closer than the sum of their radii.
    #[serde(default)]
    pub radius: f64,
    /// How the body moves: "free" by default.
    #[serde(default)]
    pub mobility: MobilityFile,
    /// Axes that position, velocity, attitude and angular velocity are relative to; the inertial frame by default.
    pub relative_to: Option<RelativeFile>,
    /// Initial position.
    pub position: Option<[f64; 3]>,
    /// Initial velocity, as seen in the axes of the position; only of a free body.
    pub velocity: Option<[f64; 3]>,
    /// Initial position and velocity by orbital elements, in the place of `position` and `velocity`.
    pub orbit: Option<ElementsFile>,
    /// Initial attitude, from the body frame to the inertial frame or to the axes of `relative_to`.
    pub attitude: AttitudeFile,
    /// Initial angular velocity relative to these axes, body frame (rad per unit of time); only of a free or pivoted body.
    pub angular_velocity: Option<[f64; 3]>,
    /// Sensors fixed in the body.
    #[serde(default)]
    pub sensors: Vec<SensorFile>,
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct WheelFile {
    /// Name of the wheel, which commands and joint states use.
    pub name: String,
    /// Axis, body frame, of any length.
    pub axis: [f64; 3],
    /// Inertia about the axis.
    pub inertia: f64,
    /// Initial speed relative to the body (rad per unit of time); 0 by default.
    #[serde(default)]
    pub speed: f64,
    /// Largest torque of the motor, in the scene's unit of energy; unlimited by default.
    pub max_torque: Option<f64>,
    /// Speed above which the motor does not accelerate the wheel (rad per unit of time); unlimited by default.
    pub max_speed: Option<f64>,
    /// Viscous friction, torque per speed; 0 by default.
    #[serde(default)]
    pub viscous_friction: f64,
    /// Coulomb friction, a torque; 0 by default.
    #[serde(default)]
    pub coulomb_friction: f64,
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct ThrusterFile {
    /// Name of the thruster, which commands and states use.
    pub name: String,
    /// Position of the nozzle, body frame.
    pub position: [f64; 3],
    /// Direction of the force on the body, body frame, of any length.
    pub direction: [f64; 3],
    /// Force while the valve is open.
    pub thrust: f64,
    /// Effective exhaust velocity: specific impulse times 9.80665 m/s². By default the thruster uses no propellant.
    pub exhaust_velocity: Option<f64>,
    /// Time from one opening of the valve to the next, a whole number of steps. By default 0: a pulse in each step, which is
    /// a force of any size.
    #[serde(default)]
    pub pulse_period: f64,
    /// Least impulse of a pulse, for less than which the valve remains shut; 0 by default.
    #[serde(default)]
    pub minimum_impulse: f64,
    /// Time from a command until the valve moves; 0 by default.
    #[serde(default)]
    pub delay: f64,
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct EngineFile {
    /// Effective exhaust velocity: specific impulse times 9.80665 m/s².
    pub exhaust_velocity: f64,
    /// Largest force; unlimited by default.
    pub thrust: Option<f64>,
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct PropellantFile {
    /// Mass at the start.
    pub mass: f64,
    /// Principal moments of inertia of the propellant, or the 3×3 matrix, about the body's center of mass, body frame; by
    /// default that of the body times the propellant's share of its mass.
    pub inertia: Option<InertiaFile>,
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "expected three principal moments or a 3×3 matrix"
)]
pub(crate) enum InertiaFile {
    Principal([f64; 3]),
    Matrix([[f64; 3]; 3]),
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct PointFile {
    /// Mass of the point.
    pub mass: f64,
    /// Position in the body frame.
    pub position: [f64; 3],
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct MultipoleFile {
    /// Order of the expansion: 2 (of `inertia`) or 4 (of `ellipsoid` or the body's `points`).
    pub order: u32,
    /// Semi-axes of a homogeneous ellipsoid.
    pub ellipsoid: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct PolyhedronFile {
    /// Half edges of a cuboid.
    pub cuboid: Option<[f64; 3]>,
    /// Semi-axes of an ellipsoid in which a mesh is inscribed.
    pub ellipsoid: Option<[f64; 3]>,
    /// Subdivisions n of the ellipsoid's mesh, which has 20 × 4ⁿ faces: 3 by default, 6 at most.
    pub subdivisions: Option<u32>,
    /// Vertices of a closed triangle mesh.
    pub vertices: Option<Vec<[f64; 3]>>,
    /// Faces of the mesh as numbers of vertices from 0, counterclockwise from outside.
    pub faces: Option<Vec<[usize; 3]>>,
    /// Text of a Wavefront OBJ file.
    pub obj: Option<String>,
    /// Path of a Wavefront OBJ file, relative to the scene file.
    pub obj_file: Option<String>,
    /// Degree of the moments that the point cloud for other fields keeps: 4 by default, 2 to 10.
    pub degree: Option<usize>,
}

#[derive(Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub(crate) enum MobilityFile {
    /// Moves and rotates under forces and moments.
    #[default]
    Free,
    /// Rotates about the origin of its frame, which is held in place.
    Pivoted,
    /// Does not move.
    Fixed,
    /// Moves and spins uniformly.
    Uniform {
        /// Velocity, inertial frame.
        #[serde(default)]
        velocity: [f64; 3],
        /// Angular velocity, body frame (rad per unit of time).
        #[serde(default)]
        spin: [f64; 3],
    },
    /// Circles a center, turns with the circle, and spins in addition.
    Circle {
        /// Center of the circle, inertial frame.
        #[serde(default, alias = "centre")]
        center: [f64; 3],
        /// Angular velocity of the circle, inertial frame (rad per unit of time).
        rate: [f64; 3],
        /// Additional angular velocity, body frame (rad per unit of time).
        #[serde(default)]
        spin: [f64; 3],
    },
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "expected a 3×3 rotation matrix by rows, or a quaternion { w, x, y, z }"
)]
pub(crate) enum AttitudeFile {
    Matrix([[f64; 3]; 3]),
    Quaternion(QuaternionFile),
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct QuaternionFile {
    /// Scalar part.
    pub w: f64,
    /// First component of the vector part.
    pub x: f64,
    /// Second component of the vector part.
    pub y: f64,
    /// Third component of the vector part.
    pub z: f64,
}

#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct RelativeFile {
    /// Name of the body at which the axes are. With the body's own name, only attitude and angular velocity are relative.
    pub body: String,
    /// The axes.
    pub axes: AxesFile,
    /// Name of the body in the center of the orbit, for rtn and lvlh axes; the central attractor by default.
    pub about: Option<String>,
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct ElementsFile {
    /// Name of the body in the center; the central attractor by default.
    pub about: Option<String>,
    /// Semi-major axis, < 0 for a hyperbola.
    pub semi_major_axis: Option<f64>,
    /// Distance of the periapsis from the center, in the place of `semi_major_axis`.
    pub periapsis: Option<f64>,
    /// Eccentricity.
    #[serde(default)]
    pub eccentricity: f64,
    /// Inclination to the xy plane of the inertial frame; 0 by default (rad, or a text such as "25 deg").
    pub inclination: Option<AngleFile>,
    /// Right ascension of the ascending node, from the x axis; 0 by default (rad, or a text such as "25 deg").
    pub raan: Option<AngleFile>,
    /// Argument of the periapsis, from the ascending node; 0 by default (rad, or a text such as "25 deg").
    pub argument_of_periapsis: Option<AngleFile>,
    /// True anomaly at the epoch; 0 by default (rad, or a text such as "25 deg").
    pub true_anomaly: Option<AngleFile>,
    /// Mean anomaly at the epoch, in the place of `true_anomaly` (rad, or a text such as "25 deg").
    pub mean_anomaly: Option<AngleFile>,
}
