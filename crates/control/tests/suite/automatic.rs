//! Automatic differentiation by `[δx, δγ, ζ, δΠ]`, to test functions of a state.

use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use num_dual::{DualNum, HyperDual64};

pub type Number = HyperDual64;
pub type Triple = [Number; 3];

/// A state in differentiating arithmetic, with the attitude by rows.
pub struct Moved {
    pub position: Triple,
    pub linear_momentum: Triple,
    pub attitude: [Triple; 3],
    pub angular_momentum: Triple,
}

pub fn dot(a: Triple, b: Triple) -> Number {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross(a: Triple, b: Triple) -> Triple {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}

pub fn constant(v: &Vector3<f64>) -> Triple {
    std::array::from_fn(|i| Number::from(v[i]))
}

pub fn minus(a: Triple, b: Triple) -> Triple {
    std::array::from_fn(|i| a[i] - b[i])
}

pub fn norm(a: Triple) -> Number {
    dot(a, a).sqrt()
}

/// `m a` for a matrix given by rows.
pub fn product(m: &[Triple; 3], a: Triple) -> Triple {
    m.map(|row| dot(row, a))
}

fn moved(state: &BodyState, z: &[Number; 12]) -> Moved {
    let shifted = |v: &Vector3<f64>, at: usize| std::array::from_fn(|i| z[at + i] + v[i]);
    let zeta = [z[6], z[7], z[8]];
    // The columns of Rᵀ turn by exp(−S(ζ)), expanded to second order, which second derivatives require.
    let turned = |i: usize| {
        let row = constant(&state.attitude.row(i).transpose());
        let first = cross(row, zeta);
        let second = cross(first, zeta);
        std::array::from_fn(|j| row[j] + first[j] + second[j] * 0.5)
    };
    Moved {
        position: shifted(&state.position, 0),
        linear_momentum: shifted(&state.linear_momentum, 3),
        attitude: std::array::from_fn(turned),
        angular_momentum: shifted(&state.angular_momentum, 9),
    }
}

/// Value, gradient and Hessian of `f` by `[δx, δγ, ζ, δΠ]`.
pub fn derivatives(
    state: &BodyState,
    f: impl Fn(&Moved) -> Number,
) -> (f64, SVector<f64, 12>, SMatrix<f64, 12, 12>) {
    let at = |i: usize, j: usize| {
        let mut z = [Number::from(0.0); 12];
        z[i] += HyperDual64::new(0.0, 1.0, 0.0, 0.0);
        z[j] += HyperDual64::new(0.0, 0.0, 1.0, 0.0);
        f(&moved(state, &z))
    };
    (
        at(0, 0).re,
        SVector::from_fn(|i, _| at(i, i).eps1),
        SMatrix::from_fn(|i, j| at(i, j).eps1eps2),
    )
}

/// A random state of order one.
pub fn random_state(rng: &mut fastrand::Rng) -> BodyState {
    let mut vector = |scale: f64| Vector3::from_fn(|_, _| scale * (2.0 * rng.f64() - 1.0));
    BodyState {
        position: vector(1.0),
        linear_momentum: vector(1.0),
        attitude: lgvi_lie::exp(&vector(1.7)),
        angular_momentum: vector(1.0),
    }
}

/// The rows of a matrix in differentiating arithmetic.
pub fn rows(m: &Matrix3<f64>) -> [Triple; 3] {
    std::array::from_fn(|i| constant(&m.row(i).transpose()))
}
