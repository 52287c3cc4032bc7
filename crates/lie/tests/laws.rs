//! The laws of both groups, at random elements with rotation angles of all sizes.

use std::f64::consts::PI;

use lgvi_lie::{
    Pose, Tangent, exp, left_jacobian, left_jacobian_inverse, log, log_curvature, right_jacobian,
    right_jacobian_inverse,
};
use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector3, Vector6};

/// Angles on both sides of each switch from a series to a closed form.
const ANGLES: [f64; 13] = [
    0.0,
    1e-300,
    1e-9,
    1e-3,
    0.1999,
    0.2001,
    0.5,
    0.999_999,
    1.000_001,
    2.0,
    3.0,
    3.1,
    PI - 1e-6,
];

const STEP: f64 = 1e-5;

struct Random(fastrand::Rng);

impl Random {
    fn unit(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| 2.0 * self.0.f64() - 1.0).normalize()
    }
}

/// Random rotation vectors, each with two random unit vectors.
fn vectors() -> impl Iterator<Item = [Vector3<f64>; 3]> {
    let mut random = Random(fastrand::Rng::with_seed(12));
    let all = (0..20).flat_map(|_| ANGLES);
    all.map(move |angle| [angle * random.unit(), random.unit(), random.unit()])
}

fn twists() -> impl Iterator<Item = Vector6<f64>> {
    vectors().map(|[v, w, _]| Vector6::new(w.x, w.y, w.z, v.x, v.y, v.z))
}

/// The derivative matrix by central differences, one column per axis.
fn difference<const N: usize>(f: impl Fn(f64, usize) -> SVector<f64, N>) -> SMatrix<f64, N, N> {
    let mut matrix = SMatrix::<f64, N, N>::zeros();
    for axis in 0..N {
        let column: SVector<f64, N> = (f(STEP, axis) - f(-STEP, axis)) / (2.0 * STEP);
        matrix.set_column(axis, &column);
    }
    matrix
}

#[test]
fn jacobians_of_rotations_are_derivatives_and_each_other_s() {
    for [v, ..] in vectors() {
        let (left, right) = (left_jacobian(&v), right_jacobian(&v));
        let r = exp(&v);
        let by_right =
            difference(|e, axis| log(&(r.transpose() * exp(&(v + Vector3::ith(axis, e))))));
        assert!((by_right - right).norm() < 1e-9);
        assert!((left - r * right).norm() < 4e-15);
        assert!((left - right_jacobian(&-v)).norm() < 1e-15);
        assert!((left * left_jacobian_inverse(&v) - Matrix3::identity()).norm() < 8e-15);
        assert!((right * right_jacobian_inverse(&v) - Matrix3::identity()).norm() < 8e-15);
    }
}

#[test]
fn tangents_are_derivatives_of_the_right_jacobian() {
    for [xi, y, p] in vectors() {
        let tangent = Tangent::at(xi);
        let derivative = tangent.derivative(&y);
        let expected = difference(|e, axis| right_jacobian(&(xi + Vector3::ith(axis, e))) * y);
        assert!((derivative - expected).norm() < 1e-9);
        let transposed = tangent.derivative_transposed(&y, &p);
        assert!((derivative.tr_mul(&p) - transposed).norm() < 4e-15);
        let expected = difference(|e, axis| {
            Tangent::at(xi + Vector3::ith(axis, e)).derivative_transposed(&y, &p)
        });
        let neglected = 0.1 * xi.norm_squared();
        assert!((tangent.second_derivative(&y, &p) - expected).norm() < 1e-8 + 2.0 * neglected);
    }
}

#[test]
fn the_curvature_of_the_logarithm_is_its_second_derivative() {
    for [e, nu, _] in vectors().filter(|[e, ..]| e.norm() < 3.05) {
        let r = exp(&e);
        // The derivative of ν·log(R exp ζ) at ζ is J_r(ζ)ᵀ J_r⁻¹(log(R exp ζ))ᵀ ν.
        let slope = |zeta: Vector3<f64>| {
            let moved = log(&(r * exp(&zeta)));
            right_jacobian(&zeta).tr_mul(&right_jacobian_inverse(&moved).tr_mul(&nu))
        };
        let expected = difference(|h, axis| slope(Vector3::ith(axis, h)));
        assert!((log_curvature(&e, &nu) - expected).norm() < 1e-7, "{e}");
    }
}

#[test]
fn poses_are_a_group_with_its_adjoint() {
    let mut before = Pose::identity();
    for twist in twists() {
        let pose = Pose::exp(&twist);
        let back = pose.log() - twist;
        assert!(back.norm() < 1e-9, "{twist}: {back}");
        let one = pose.compose(&pose.inverse());
        assert!((one.rotation - Matrix3::identity()).norm() + one.translation.norm() < 4e-15);
        let point = Vector3::new(1.0, -2.0, 0.5);
        let twice = pose.compose(&before).act(&point) - pose.act(&before.act(&point));
        assert!(twice.norm() < 1e-14);
        let small = 1e-3 * twist;
        let conjugate = before
            .compose(&Pose::exp(&small))
            .compose(&before.inverse());
        let adjoint = Pose::exp(&(before.adjoint() * small));
        assert!((conjugate.rotation - adjoint.rotation).norm() < 4e-15);
        assert!((conjugate.translation - adjoint.translation).norm() < 1e-14);
        before = pose;
    }
}

#[test]
fn jacobians_of_poses_are_derivatives_and_each_other_s() {
    for twist in twists() {
        let pose = Pose::exp(&twist);
        let moved = |e, axis| Pose::exp(&(twist + Vector6::ith(axis, e)));
        let right = difference(|e, axis| pose.inverse().compose(&moved(e, axis)).log());
        let left = difference(|e, axis| moved(e, axis).compose(&pose.inverse()).log());
        assert!((Pose::right_jacobian(&twist) - right).norm() < 1e-8);
        assert!((Pose::left_jacobian(&twist) - left).norm() < 1e-8);
        let ad = pose.adjoint() * Pose::right_jacobian(&twist);
        assert!((Pose::left_jacobian(&twist) - ad).norm() < 1e-13);
        for (jacobian, inverse) in [
            (
                Pose::left_jacobian(&twist),
                Pose::left_jacobian_inverse(&twist),
            ),
            (
                Pose::right_jacobian(&twist),
                Pose::right_jacobian_inverse(&twist),
            ),
        ] {
            assert!((jacobian * inverse - Matrix6::identity()).norm() < 1e-13);
        }
    }
}
