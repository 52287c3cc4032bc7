use std::f64::consts::TAU;

use nalgebra::Vector3;

/// Corners of a circle.
const CORNERS: u32 = 96;

/// Angles of a whole turn, the first one again at the end.
fn turn() -> impl Iterator<Item = f64> {
    (0..=CORNERS).map(|corner| TAU * f64::from(corner % CORNERS) / f64::from(CORNERS))
}

/// The closed ellipse through `r` (from the attractor) with velocity `v`: `r(θ) = p/(1 + e·û(θ))`, `û` turning in the plane
/// of the orbit, with `p = |r × v|²/GM` and `e = v × (r × v)/GM − r/|r|`.
pub(super) fn orbit(
    gm: f64,
    r: &Vector3<f64>,
    v: &Vector3<f64>,
) -> impl Iterator<Item = Vector3<f64>> + use<> {
    let momentum = r.cross(v);
    let parameter = momentum.norm_squared() / gm;
    let radial = r.normalize();
    let across = momentum.normalize().cross(&radial);
    let eccentricity = v.cross(&momentum) / gm - radial;
    turn().map(move |angle| {
        let (sin, cos) = libm::sincos(angle);
        let u = radial * cos + across * sin;
        u * (parameter / (1.0 + eccentricity.dot(&u)))
    })
}

/// The mantle of a cone as triangles, whose sides have this length; `axis` is a unit vector.
pub(super) fn cone(
    apex: &Vector3<f64>,
    axis: &Vector3<f64>,
    half_angle: f64,
    side: f64,
) -> Vec<Vector3<f64>> {
    // Some vector across, with the coordinate axis that is farthest from the cone's.
    let across = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
    let third = axis.cross(&across);
    let (wide, high) = libm::sincos(half_angle);
    let rim = |angle| {
        let (sin, cos) = libm::sincos(angle);
        apex + (axis * high + (across * cos + third * sin) * wide) * side
    };
    let rim: Vec<_> = turn().map(rim).collect();
    rim.windows(2)
        .flat_map(|edge| [*apex, edge[0], edge[1]])
        .collect()
}
