//! Independent implementations of the potentials, point by point and generic over the number type, from which gravity
//! is obtained by differentiation.

use lgvi_dynamics::gravity::{Central, Field, Fixed, Moments, Multipole, Uniform};
use lgvi_dynamics::{Inertia, PointMass, RigidBody};
use nalgebra::{Matrix3, Vector3};
use num_dual::DualNum;

/// Components of a vector in the number type used for differentiation.
pub type Triple<T> = [T; 3];

pub trait Number: DualNum<f64> + Copy {}

impl<T: DualNum<f64> + Copy> Number for T {}

pub fn constant<T: Number>(v: &Vector3<f64>) -> Triple<T> {
    v.data.0[0].map(T::from)
}

pub fn add<T: Number>(a: Triple<T>, b: Triple<T>) -> Triple<T> {
    std::array::from_fn(|i| a[i] + b[i])
}

pub fn subtract<T: Number>(a: Triple<T>, b: Triple<T>) -> Triple<T> {
    std::array::from_fn(|i| a[i] - b[i])
}

pub fn dot<T: Number>(a: Triple<T>, b: Triple<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn rotated<T: Number>(r: &Matrix3<f64>, v: Triple<T>) -> Triple<T> {
    std::array::from_fn(|i| v[0] * r[(i, 0)] + v[1] * r[(i, 1)] + v[2] * r[(i, 2)])
}

/// `exp(S(ζ)) v` to third order in ζ, which is sufficient for derivatives at ζ = 0 up to the third.
pub fn turned<T: Number>(zeta: Triple<T>, v: Triple<T>) -> Triple<T> {
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

/// The part of `1/|e − ρ|` of degree `n` in ρ: `ρⁿ P_n(cos)/rⁿ⁺¹` with the Legendre polynomial.
pub fn legendre<T: Number>(n: usize, e: Triple<T>, rho: Triple<T>) -> T {
    let (squared, cosine, size) = (dot(e, e), dot(e, rho), dot(rho, rho) * dot(e, e));
    let numerator = match n {
        0 => T::from(1.0),
        1 => cosine,
        2 => (cosine.powi(2) * 3.0 - size) / 2.0,
        3 => (cosine.powi(3) * 5.0 - cosine * size * 3.0) / 2.0,
        4 => (cosine.powi(4) * 35.0 - cosine.powi(2) * size * 30.0 + size.powi(2) * 3.0) / 8.0,
        _ => panic!("degree {n}"),
    };
    numerator / (squared.sqrt() * squared.powi(n as i32))
}

/// The part of `1/|e − ρ + σ|` of second degree in ρ and in σ.
pub fn quadrupole_pair<T: Number>(e: Triple<T>, rho: Triple<T>, sigma: Triple<T>) -> T {
    let fourth = |u| legendre(4, e, u);
    (fourth(add(rho, sigma)) + fourth(subtract(rho, sigma))) / 2.0 - fourth(rho) - fourth(sigma)
}

/// The representation of a random set of points: a sphere, all points exactly, or a multipole of an order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Sphere,
    Points,
    Series(usize),
}

pub const KINDS: [Kind; 4] = [Kind::Sphere, Kind::Points, Kind::Series(2), Kind::Series(4)];

#[derive(Clone, Debug)]
pub struct Cloud {
    pub kind: Kind,
    pub points: Vec<PointMass>,
}

pub fn vector(rng: &mut fastrand::Rng, scale: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| scale * (2.0 * rng.f64() - 1.0))
}

impl Cloud {
    /// Four points within `size` of the origin before their center of mass is moved there, of total mass 1. A sphere is
    /// one point.
    pub fn random(kind: Kind, rng: &mut fastrand::Rng, size: f64) -> Self {
        let mut points: Vec<_> = [0.2, 0.3, 0.1, 0.4]
            .map(|mass| PointMass {
                mass,
                position: vector(rng, size),
            })
            .to_vec();
        let center: Vector3<f64> = points.iter().map(|p| p.mass * p.position).sum();
        points.iter_mut().for_each(|p| p.position -= center);
        if kind == Kind::Sphere {
            points = vec![PointMass {
                mass: 1.0,
                position: Vector3::zeros(),
            }];
        }
        Self { kind, points }
    }

    fn inertia(&self) -> Inertia {
        let second = Moments::of_points(&self.points).second;
        let second = if self.kind == Kind::Sphere {
            Matrix3::identity()
        } else {
            second
        };
        Inertia::new(Matrix3::from_diagonal_element(second.trace()) - second).expect("inertia")
    }

    pub fn multipole(&self) -> Multipole {
        match self.kind {
            Kind::Series(2) => Multipole::of_inertia(1.0, &self.inertia()),
            Kind::Series(4) => Multipole::of_moments(1.0, &Moments::of_points(&self.points)),
            other => panic!("{other:?} is no series"),
        }
    }

    pub fn body(&self) -> RigidBody {
        match self.kind {
            Kind::Sphere => RigidBody::new(1.0, self.inertia(), vec![]),
            Kind::Points => RigidBody::new(1.0, self.inertia(), self.points.clone()),
            Kind::Series(_) => RigidBody::with_multipole(self.inertia(), self.multipole()),
        }
        .expect("body")
    }

    /// `1/|e − ρ|` summed over the points up to the order of this kind, with ρ transformed by `place`, starting at
    /// degree `from`.
    pub fn reach<T: Number>(
        &self,
        e: Triple<T>,
        from: usize,
        place: impl Fn(Triple<T>) -> Triple<T>,
    ) -> T {
        let mut sum = T::from(0.0);
        for PointMass { mass, position } in &self.points {
            let rho = place(constant(position));
            match self.kind {
                Kind::Series(order) => {
                    for n in from..=order {
                        sum += legendre(n, e, rho) * *mass;
                    }
                }
                Kind::Sphere | Kind::Points => {
                    let d = subtract(e, rho);
                    sum += dot(d, d).sqrt().recip() * *mass;
                }
            }
        }
        sum
    }
}

/// The potential of a source.
pub enum Model {
    Central,
    Oblate { j2: f64, radius: f64 },
    Uniform(Vector3<f64>),
    Series(Cloud),
}

pub struct Source {
    pub name: &'static str,
    pub model: Model,
    pub gm: f64,
    pub position: Vector3<f64>,
    pub attitude: Matrix3<f64>,
}

impl Source {
    /// φ at the position `x` in the inertial frame.
    pub fn potential<T: Number>(&self, x: Triple<T>) -> T {
        let d = rotated(
            &self.attitude.transpose(),
            subtract(x, constant(&self.position)),
        );
        let distance = dot(d, d).sqrt();
        match &self.model {
            Model::Central => -distance.recip() * self.gm,
            Model::Oblate { j2, radius } => {
                let sine = d[2] / distance;
                let factor = (distance.recip() * *radius).powi(2) * *j2;
                let legendre = (sine * sine * 3.0 - 1.0) / 2.0;
                -(T::from(1.0) - factor * legendre) / distance * self.gm
            }
            Model::Uniform(g) => -dot(d, constant(g)),
            Model::Series(cloud) => -cloud.reach(d, 0, |rho| rho) * self.gm,
        }
    }

    /// The library's implementation of the source.
    pub fn field(&self) -> Box<dyn Field> {
        let (position, attitude) = (self.position, self.attitude);
        match &self.model {
            Model::Central if position == Vector3::zeros() => Box::new(Central { gm: self.gm }),
            Model::Central => Box::new(Fixed::new(Central { gm: self.gm }, position, attitude)),
            Model::Oblate { j2, radius } => {
                let oblate = Multipole::oblate(self.gm, *j2, *radius);
                Box::new(Fixed::new(oblate, position, attitude))
            }
            Model::Uniform(g) => {
                let uniform = Uniform { acceleration: *g };
                Box::new(Fixed::new(uniform, position, attitude))
            }
            Model::Series(cloud) => {
                let multipole = cloud.multipole().scaled(self.gm);
                Box::new(Fixed::new(multipole, position, attitude))
            }
        }
    }
}
