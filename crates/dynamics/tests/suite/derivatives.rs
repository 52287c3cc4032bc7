//! Gravity's loads and their derivatives against automatic differentiation of the potential alone.

use lgvi_dynamics::gravity::{Central, Field};
use lgvi_dynamics::{Inertia, Load, PointMass, RigidBody};
use nalgebra::{Matrix3, Vector3};
use num_dual::{Dual64, DualNum, HyperDual, HyperHyperDual64};

/// Components of a vector in the arithmetic that differentiates.
type Triple<T> = [T; 3];

fn rotated<T: DualNum<f64> + Copy>(r: &Matrix3<f64>, v: Triple<T>) -> Triple<T> {
    std::array::from_fn(|i| v[0] * r[(i, 0)] + v[1] * r[(i, 1)] + v[2] * r[(i, 2)])
}

/// `exp(S(ζ)) v` to third order in ζ, all that up to third derivatives at ζ = 0 see.
fn turned<T: DualNum<f64> + Copy>(zeta: Triple<T>, v: Triple<T>) -> Triple<T> {
    let cross = |a: Triple<T>, b: Triple<T>| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let first = cross(zeta, v);
    let second = cross(zeta, first);
    let third = cross(zeta, second);
    std::array::from_fn(|i| v[i] + first[i] + second[i] * 0.5 + third[i] / 6.0)
}

/// The potential at `x + δ` and `R exp(S(ζ₁)) exp(S(ζ₂)) …` for the `frames` ζ₁, ζ₂, ….
fn potential<T: DualNum<f64> + Copy>(
    body: &RigidBody,
    (x, r): (&Vector3<f64>, &Matrix3<f64>),
    delta: Triple<T>,
    frames: &[Triple<T>],
) -> T {
    let mut sum = T::from(0.0);
    for point in body.points() {
        let rho = point.position.data.0[0].map(T::from);
        let arm = rotated(r, frames.iter().rev().fold(rho, |v, &zeta| turned(zeta, v)));
        let d: Triple<T> = std::array::from_fn(|i| delta[i] + arm[i] + x[i]);
        let distance = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        sum -= distance.recip() * (CENTRAL.gm * point.mass);
    }
    sum
}

/// The triple whose component `axis` is `value` where `axis` lies in `range`, else zero.
fn along<T: DualNum<f64> + Copy>(
    axis: usize,
    range: std::ops::Range<usize>,
    value: T,
) -> Triple<T> {
    let mut triple = [T::from(0.0); 3];
    if range.contains(&axis) {
        triple[axis - range.start] = value;
    }
    triple
}

struct Point {
    body: RigidBody,
    x: Vector3<f64>,
    r: Matrix3<f64>,
    weights: Load,
}

fn points() -> impl Iterator<Item = Point> {
    let mut rng = fastrand::Rng::with_seed(8);
    let mut vector = move |scale: f64| Vector3::from_fn(|_, _| scale * (2.0 * rng.f64() - 1.0));
    (0..20).map(move |_| {
        let (a, b) = (vector(0.2), vector(0.2));
        let points = [(0.2, a), (0.3, b), (0.5, -(0.2 * a + 0.3 * b) / 0.5)]
            .map(|(mass, position)| PointMass { mass, position });
        let inertia = Inertia::principal([1.0, 1.1, 1.2]).expect("inertia");
        Point {
            body: RigidBody::new(1.0, inertia, points.to_vec()).expect("body"),
            x: vector(1.0) + Vector3::new(1.5, 0.0, 0.0),
            r: lgvi_lie::exp(&vector(1.8)),
            weights: Load {
                force: vector(2.0),
                moment: vector(3.0),
            },
        }
    })
}

const CENTRAL: Central = Central { gm: 1.7 };

fn assert_close(found: f64, expected: f64, scale: f64, what: &str) {
    assert!(
        (found - expected).abs() <= 1e-12 * scale,
        "{what}: {found} for {expected}"
    );
}

#[test]
fn load_is_minus_the_derivative_of_the_potential() {
    for Point { body, x, r, .. } in points() {
        let load = CENTRAL.load(&body, &x, &r);
        let found: Vec<f64> = load.force.iter().chain(&load.moment).copied().collect();
        for (axis, component) in found.into_iter().enumerate() {
            let e = Dual64::new(0.0, 1.0);
            let (delta, zeta) = (along(axis, 0..3, e), along(axis, 3..6, e));
            let u = potential(&body, (&x, &r), delta, &[zeta]);
            assert_close(component, -u.eps, 1.0, "load");
            assert_close(
                Field::potential(&CENTRAL, &body, &x, &r),
                u.re,
                1.0,
                "potential",
            );
        }
    }
}

#[test]
fn gradient_is_the_derivative_of_the_load() {
    for Point { body, x, r, .. } in points() {
        let g = CENTRAL.gradient(&body, &x, &r);
        for row in 0..6 {
            for column in 0..6 {
                let first = HyperDual::new(0.0, 1.0, 0.0, 0.0);
                let second = HyperDual::new(0.0, 0.0, 1.0, 0.0);
                let (a, b) = (along(row, 0..3, first), along(column, 0..3, second));
                let delta = [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
                let inner = along(row, 3..6, first);
                let outer = along(column, 3..6, second);
                let u = potential(&body, (&x, &r), delta, &[outer, inner]);
                let block = match (row < 3, column < 3) {
                    (true, true) => g.force_by_position,
                    (true, false) => g.force_by_attitude,
                    (false, true) => g.moment_by_position,
                    (false, false) => g.moment_by_attitude,
                };
                let scale = g.force_by_position.amax();
                assert_close(block[(row % 3, column % 3)], -u.eps1eps2, scale, "gradient");
            }
        }
    }
}

/// `b·f + c·M` is the derivative of −U along δx = b, ζ = c in the innermost frame; p and q are its derivatives by x and
/// by a ζ outside that; the curvature is theirs, by a ζ outside both. Frames nest as `R exp(ζ₃) exp(ζ₂) exp(c ε₁)`.
#[test]
fn curvature_is_the_derivative_of_the_weighted_gradient() {
    let unit = |which: usize| {
        let mut parts = [0.0; 8];
        parts[which] = 1.0;
        let [re, e1, e2, e3, e12, e13, e23, e123] = parts;
        HyperHyperDual64::new(re, e1, e2, e3, e12, e13, e23, e123)
    };
    for Point {
        body,
        x,
        r,
        weights,
    } in points()
    {
        let k = CENTRAL.curvature(&body, &x, &r, &weights);
        let scale = k.position_position.amax().max(k.attitude_attitude.amax());
        for row in 0..6 {
            for column in 0..6 {
                let a = along(row, 0..3, unit(2));
                let b = along(column, 0..3, unit(3));
                let delta: Triple<_> =
                    std::array::from_fn(|i| unit(1) * weights.force[i] + a[i] + b[i]);
                let innermost: Triple<_> = std::array::from_fn(|i| unit(1) * weights.moment[i]);
                let middle = along(row, 3..6, unit(2));
                let outer = along(column, 3..6, unit(3));
                let u = potential(&body, (&x, &r), delta, &[outer, middle, innermost]);
                let block = match (row < 3, column < 3) {
                    (true, true) => k.position_position,
                    (true, false) => k.position_attitude,
                    (false, true) => k.position_attitude.transpose(),
                    (false, false) => k.attitude_attitude,
                };
                let found = block[(row % 3, column % 3)];
                assert_close(found, -u.eps1eps2eps3, scale, "curvature");
            }
        }
    }
}
