//! The loads and derivatives of every field on every mass distribution, compared with automatic differentiation of the
//! potential.

use lgvi_dynamics::Load;
use nalgebra::{Matrix3, Vector3};
use num_dual::{Dual64, HyperDual, HyperHyperDual64};

use crate::potentials::{
    Cloud, KINDS, Kind, Model, Number, Source, Triple, add, constant, rotated, subtract, turned,
    vector,
};

/// A body in a field.
struct Sample {
    source: Source,
    cloud: Cloud,
    x: Vector3<f64>,
    r: Matrix3<f64>,
    weights: Load,
}

/// Several samples of every source with every kind of body.
fn samples() -> Vec<Sample> {
    let mut rng = fastrand::Rng::with_seed(8);
    let mut all = Vec::new();
    for _ in 0..5 {
        for kind in KINDS {
            let models = [
                ("central", Model::Central),
                ("central elsewhere", Model::Central),
                (
                    "oblate",
                    Model::Oblate {
                        j2: 0.1,
                        radius: 0.7,
                    },
                ),
                ("uniform", Model::Uniform(vector(&mut rng, 2.0))),
                (
                    "second order",
                    Model::Series(Cloud::random(Kind::Series(2), &mut rng, 0.4)),
                ),
                (
                    "fourth order",
                    Model::Series(Cloud::random(Kind::Series(4), &mut rng, 0.4)),
                ),
            ];
            for (name, model) in models {
                let position = vector(&mut rng, 0.5);
                let attitude = lgvi_lie::exp(&vector(&mut rng, 1.8));
                let (position, attitude) = if name == "central" {
                    (Vector3::zeros(), Matrix3::identity())
                } else {
                    (position, attitude)
                };
                all.push(Sample {
                    source: Source {
                        name,
                        model,
                        gm: 1.7,
                        position,
                        attitude,
                    },
                    cloud: Cloud::random(kind, &mut rng, 0.2),
                    x: position + vector(&mut rng, 1.0) + Vector3::new(1.8, 0.0, 0.0),
                    r: lgvi_lie::exp(&vector(&mut rng, 1.8)),
                    weights: Load {
                        force: vector(&mut rng, 2.0),
                        moment: vector(&mut rng, 3.0),
                    },
                });
            }
        }
    }
    all
}

impl Sample {
    /// The potential at `x + δ` and `R exp(S(ζ₁)) exp(S(ζ₂)) …` for the `frames` ζ₁, ζ₂, ….
    fn potential<T: Number>(&self, delta: Triple<T>, frames: &[Triple<T>]) -> T {
        let place = |rho| {
            let turned = frames.iter().rev().fold(rho, |v, &zeta| turned(zeta, v));
            rotated(&self.r, turned)
        };
        let x = add(constant(&self.x), delta);
        if let Kind::Series(_) = self.cloud.kind {
            let point = self.source.potential(x);
            if let Model::Uniform(_) = self.source.model {
                return point;
            }
            let e = subtract(constant(&self.source.position), x);
            return point - self.cloud.reach(e, 2, place) * self.source.gm;
        }
        let mut sum = T::from(0.0);
        for point in &self.cloud.points {
            let arm = place(constant(&point.position));
            sum += self.source.potential(add(x, arm)) * point.mass;
        }
        sum
    }

    fn assert_close(&self, found: f64, expected: f64, scale: f64, what: &str) {
        let error = (found - expected).abs();
        assert!(
            error <= 1e-12 * scale.max(1.0),
            "{what} of {} on {:?}: {found} for {expected}",
            self.source.name,
            self.cloud.kind
        );
    }
}

/// The triple whose component for `axis` is `value` if `axis` lies in `range`, else zero.
fn along<T: Number>(axis: usize, range: std::ops::Range<usize>, value: T) -> Triple<T> {
    let mut triple = [T::from(0.0); 3];
    if range.contains(&axis) {
        triple[axis - range.start] = value;
    }
    triple
}

#[test]
fn load_is_minus_the_derivative_of_the_potential() {
    for sample in samples() {
        let (field, body) = (sample.source.field(), sample.cloud.body());
        let load = field.load(&body, &sample.x, &sample.r);
        let energy = field.potential(&body, &sample.x, &sample.r);
        let found: Vec<f64> = load.force.iter().chain(&load.moment).copied().collect();
        for (axis, component) in found.into_iter().enumerate() {
            let e = Dual64::new(0.0, 1.0);
            let (delta, zeta) = (along(axis, 0..3, e), along(axis, 3..6, e));
            let u = sample.potential(delta, &[zeta]);
            sample.assert_close(component, -u.eps, 1.0, "load");
            sample.assert_close(energy, u.re, 1.0, "potential");
        }
    }
}

#[test]
fn gradient_is_the_derivative_of_the_load() {
    for sample in samples() {
        let (field, body) = (sample.source.field(), sample.cloud.body());
        let g = field.gradient(&body, &sample.x, &sample.r);
        for row in 0..6 {
            for column in 0..6 {
                let first = HyperDual::new(0.0, 1.0, 0.0, 0.0);
                let second = HyperDual::new(0.0, 0.0, 1.0, 0.0);
                let (a, b) = (along(row, 0..3, first), along(column, 0..3, second));
                let inner = along(row, 3..6, first);
                let outer = along(column, 3..6, second);
                let u = sample.potential(add(a, b), &[outer, inner]);
                let block = match (row < 3, column < 3) {
                    (true, true) => g.force_by_position,
                    (true, false) => g.force_by_attitude,
                    (false, true) => g.moment_by_position,
                    (false, false) => g.moment_by_attitude,
                };
                let scale = g.force_by_position.amax();
                let found = block[(row % 3, column % 3)];
                sample.assert_close(found, -u.eps1eps2, scale, "gradient");
            }
        }
    }
}

/// `b·f + c·M` is the derivative of −U along δx = b and ζ = c in the innermost frame. Its derivatives with respect to x
/// and to a ζ in the next outer frame are p and q. The curvature consists of their derivatives, with a ζ in the
/// outermost frame. Frames nest as `R exp(ζ₃) exp(ζ₂) exp(c ε₁)`.
#[test]
fn curvature_is_the_derivative_of_the_weighted_gradient() {
    let unit = |which: usize| {
        let mut parts = [0.0; 8];
        parts[which] = 1.0;
        let [re, e1, e2, e3, e12, e13, e23, e123] = parts;
        HyperHyperDual64::new(re, e1, e2, e3, e12, e13, e23, e123)
    };
    for sample in samples() {
        let (field, body) = (sample.source.field(), sample.cloud.body());
        let k = field.curvature(&body, &sample.x, &sample.r, &sample.weights);
        let scale = k.position_position.amax().max(k.attitude_attitude.amax());
        for row in 0..6 {
            for column in 0..6 {
                let a = along(row, 0..3, unit(2));
                let b = along(column, 0..3, unit(3));
                let Load { force, moment } = sample.weights;
                let delta = std::array::from_fn(|i| unit(1) * force[i] + a[i] + b[i]);
                let innermost = std::array::from_fn(|i| unit(1) * moment[i]);
                let middle = along(row, 3..6, unit(2));
                let outer = along(column, 3..6, unit(3));
                let u = sample.potential(delta, &[outer, middle, innermost]);
                let block = match (row < 3, column < 3) {
                    (true, true) => k.position_position,
                    (true, false) => k.position_attitude,
                    (false, true) => k.position_attitude.transpose(),
                    (false, false) => k.attitude_attitude,
                };
                let found = block[(row % 3, column % 3)];
                sample.assert_close(found, -u.eps1eps2eps3, scale, "curvature");
            }
        }
    }
}
