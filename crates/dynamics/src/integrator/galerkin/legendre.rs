//! Numerical check of the discrete Legendre transforms: a solved step is compared with differences of the action. The
//! action is computed independently, with angular velocities from automatic differentiation of the exponential series.

use lgvi_lie::{exp, log, vee};
use nalgebra::{Matrix3, Vector3};
use num_dual::Dual64;

use super::{ChartOrigin, Galerkin, Quadrature};
use crate::gravity::Mutual;
use crate::{BodyState, Inertia, Integrator, Load, PointMass, RigidBody, System};

/// A trajectory within a step, body by body: ends and inner control points.
#[derive(Clone)]
struct Path {
    origin: ChartOrigin,
    /// `x^0 … x^s`.
    positions: Vec<Vec<Vector3<f64>>>,
    /// `R_0`, `R_1`.
    attitudes: Vec<[Matrix3<f64>; 2]>,
    /// `ξ^1 … ξ^{s−1}`.
    inner: Vec<Vec<Vector3<f64>>>,
}

fn interpolate(points: &[Vector3<f64>], tau: f64) -> [Dual64; 3] {
    let (controls, _) = Quadrature::Lobatto(points.len() as u32).rule();
    let tau = Dual64::new(tau, 1.0);
    let mut sum = [Dual64::from(0.0); 3];
    for (kappa, point) in points.iter().enumerate() {
        let mut polynomial = Dual64::from(1.0);
        for (other, control) in controls.iter().enumerate() {
            if other != kappa {
                polynomial = polynomial * (tau - *control) / (controls[kappa] - control);
            }
        }
        for (sum, component) in sum.iter_mut().zip(point) {
            *sum += polynomial * *component;
        }
    }
    sum
}

fn value(v: &[Dual64; 3]) -> Vector3<f64> {
    Vector3::from_fn(|i, _| v[i].re)
}

fn slope(v: &[Dual64; 3]) -> Vector3<f64> {
    Vector3::from_fn(|i, _| v[i].eps)
}

/// `exp S(ξ)` and its derivative, from the series.
fn exponential(xi: &[Dual64; 3]) -> (Matrix3<f64>, Matrix3<f64>) {
    let [x, y, z] = *xi;
    let zero = Dual64::from(0.0);
    let s = [[zero, -z, y], [z, zero, -x], [-y, x, zero]];
    let one = |i, j| Dual64::from(f64::from(u8::from(i == j)));
    let mut sum: [[Dual64; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| one(i, j)));
    let mut term = sum;
    for n in 1..30 {
        let product = |i: usize, j: usize| (0..3).fold(zero, |sum, k| sum + term[i][k] * s[k][j]);
        term = std::array::from_fn(|i| std::array::from_fn(|j| product(i, j) / f64::from(n)));
        for i in 0..3 {
            for j in 0..3 {
                sum[i][j] += term[i][j];
            }
        }
    }
    (
        Matrix3::from_fn(|i, j| sum[i][j].re),
        Matrix3::from_fn(|i, j| sum[i][j].eps),
    )
}

impl Path {
    fn action(&self, system: &System, quadrature: Quadrature, h: f64) -> f64 {
        let (nodes, weights) = quadrature.rule();
        let mut action = 0.0;
        for (node, weight) in nodes.iter().zip(&weights) {
            let mut poses = vec![];
            for (index, body) in system.bodies().iter().enumerate() {
                let [start, end] = self.attitudes[index];
                let turn = log(&(start.transpose() * end));
                let (center, first, last) = match self.origin {
                    ChartOrigin::Start => (start, Vector3::zeros(), turn),
                    ChartOrigin::Middle => (start * exp(&(0.5 * turn)), -0.5 * turn, 0.5 * turn),
                };
                let mut points = vec![first];
                points.extend(&self.inner[index]);
                points.push(last);
                let (relative, change) = exponential(&interpolate(&points, *node));
                let omega = vee(&(relative.transpose() * change)) / h;
                let x = interpolate(&self.positions[index], *node);
                let velocity = slope(&x) / h;
                action += weight * h * 0.5 * body.mass() * velocity.norm_squared();
                action += weight * h * 0.5 * omega.dot(&(body.inertia().matrix() * omega));
                let attitude = center * relative;
                let zero = Vector3::zeros();
                poses.push(BodyState::from_velocities(
                    body,
                    value(&x),
                    zero,
                    attitude,
                    zero,
                ));
            }
            action -= weight * h * system.potential(&poses);
        }
        action
    }
}

/// Two bodies close to each other, without special directions.
pub(super) fn bodies() -> (System, Vec<BodyState>) {
    let mut rng = fastrand::Rng::with_seed(13);
    let mut random = move |scale: f64| Vector3::from_fn(|_, _| scale * (2.0 * rng.f64() - 1.0));
    let mut bodies = vec![];
    let mut states = vec![];
    for index in 0..2 {
        let inertia = Inertia::principal([0.2, 0.3, 0.4]).unwrap();
        let arm = random(0.3);
        let points = [arm, -arm].map(|position| PointMass {
            mass: 0.5,
            position,
        });
        let body = RigidBody::new(1.0, inertia, points.to_vec()).unwrap();
        let position = Vector3::new(1.5 * f64::from(index), 0.0, 0.0) + random(0.3);
        let attitude = exp(&random(1.0));
        let (velocity, omega) = (random(0.5), random(1.5));
        states.push(BodyState::from_velocities(
            &body, position, velocity, attitude, omega,
        ));
        bodies.push(body);
    }
    (
        System::new(bodies, vec![Box::new(Mutual::new(1.0))]),
        states,
    )
}

/// The derivative of a function at 0, by differences of fourth order.
fn derivative(function: impl Fn(f64) -> f64) -> f64 {
    let e = 2e-3;
    let central = |e: f64| (function(e) - function(-e)) / (2.0 * e);
    (4.0 * central(e) - central(2.0 * e)) / 3.0
}

/// Checks that `−D_1 L_d` and `D_2 L_d` are the momenta at the two ends, and that the inner points are stationary.
#[test]
fn momenta_are_the_discrete_legendre_transforms() {
    let h = 0.8;
    for origin in [ChartOrigin::Start, ChartOrigin::Middle] {
        for (degree, quadrature) in [
            (1, Quadrature::Lobatto(2)),
            (2, Quadrature::Gauss(2)),
            (3, Quadrature::Gauss(5)),
            (4, Quadrature::Lobatto(4)),
        ] {
            let (mut system, begin) = bodies();
            let mut galerkin = Galerkin::new(&system, degree, quadrature, origin).unwrap();
            let mut end = begin.clone();
            galerkin.start(&mut system, &begin);
            galerkin
                .step(&mut system, &mut end, &[Load::default(); 2], h)
                .unwrap();

            let last = degree as usize - 1;
            let motion = &galerkin.motion;
            let positions = motion
                .translations
                .iter()
                .zip(&begin)
                .map(|(translation, state)| {
                    let points = &translation.as_ref().unwrap().curve.points;
                    let mut positions = vec![state.position];
                    positions.extend(points.iter().map(|point| state.position + point));
                    positions
                });
            let inner = motion.rotations.iter();
            let inner =
                inner.map(|rotation| rotation.as_ref().unwrap().curve.points[..last].to_vec());
            let path = Path {
                origin,
                positions: positions.collect(),
                attitudes: begin
                    .iter()
                    .zip(&end)
                    .map(|(a, b)| [a.attitude, b.attitude])
                    .collect(),
                inner: inner.collect(),
            };
            let by = |vary: &dyn Fn(&mut Path, f64)| {
                derivative(|e| {
                    let mut varied = path.clone();
                    vary(&mut varied, e);
                    varied.action(&system, quadrature, h)
                })
            };
            let assert_zero = |difference: f64, what: &str| {
                assert!(
                    difference.abs() < 2e-10,
                    "{origin:?} {quadrature:?} {what}: {difference:e}"
                );
            };
            for body in 0..2 {
                for axis in 0..3 {
                    let turn = |at: usize| {
                        by(&|path, e| path.attitudes[body][at] *= exp(&Vector3::ith(axis, e)))
                    };
                    let shift = |at: usize| by(&|path, e| path.positions[body][at][axis] += e);
                    assert_zero(turn(0) + begin[body].angular_momentum[axis], "Π_0");
                    assert_zero(turn(1) - end[body].angular_momentum[axis], "Π_1");
                    assert_zero(shift(0) + begin[body].linear_momentum[axis], "γ_0");
                    assert_zero(shift(last + 1) - end[body].linear_momentum[axis], "γ_1");
                    for kappa in 0..last {
                        assert_zero(shift(kappa + 1), "inner x");
                        assert_zero(by(&|path, e| path.inner[body][kappa][axis] += e), "inner ξ");
                    }
                }
            }
        }
    }
}
