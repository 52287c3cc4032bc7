use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct BodyFile {
    pub name: String,
    pub mass: f64,
    pub inertia: Option<InertiaFile>,
    #[serde(default)]
    pub points: Vec<PointFile>,
    pub multipole: Option<MultipoleFile>,
    pub polyhedron: Option<PolyhedronFile>,
    #[serde(default)]
    pub radius: f64,
    #[serde(default)]
    pub mobility: MobilityFile,
    pub position: [f64; 3],
    pub velocity: Option<[f64; 3]>,
    pub attitude: AttitudeFile,
    pub angular_velocity: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected three principal moments or a 3×3 matrix"
)]
pub(crate) enum InertiaFile {
    Principal([f64; 3]),
    Matrix([[f64; 3]; 3]),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PointFile {
    pub mass: f64,
    pub position: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MultipoleFile {
    pub order: u32,
    pub ellipsoid: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PolyhedronFile {
    pub cuboid: Option<[f64; 3]>,
    pub ellipsoid: Option<[f64; 3]>,
    pub subdivisions: Option<u32>,
    pub vertices: Option<Vec<[f64; 3]>>,
    pub faces: Option<Vec<[usize; 3]>>,
    pub obj: Option<String>,
    pub degree: Option<usize>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub(crate) enum MobilityFile {
    #[default]
    Free,
    Pivoted,
    Fixed,
    Uniform {
        #[serde(default)]
        velocity: [f64; 3],
        #[serde(default)]
        spin: [f64; 3],
    },
    Circle {
        #[serde(default, alias = "centre")]
        center: [f64; 3],
        rate: [f64; 3],
        #[serde(default)]
        spin: [f64; 3],
    },
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected a 3×3 rotation matrix by rows, or a quaternion { w, x, y, z }"
)]
pub(crate) enum AttitudeFile {
    Matrix([[f64; 3]; 3]),
    Quaternion(QuaternionFile),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct QuaternionFile {
    pub w: f64,
    pub x: f64,
    pub y: f64,
    pub z: f64,
}
