//! 3-vectors and 3×3 matrices of lanes. Each operation has the same order as in nalgebra, so that the rounding is the
//! same.

use std::ops::{Add, Div, Mul, Neg, Sub};

use nalgebra::{Matrix3, Vector3};

use super::Lane;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Vector<T> {
    pub(crate) x: T,
    pub(crate) y: T,
    pub(crate) z: T,
}

/// A matrix by columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Matrix<T>(pub(crate) [Vector<T>; 3]);

impl<T> Vector<T> {
    #[inline(always)]
    pub(crate) fn new(x: T, y: T, z: T) -> Self {
        Self { x, y, z }
    }
}

impl<T: Lane> Vector<T> {
    #[inline(always)]
    pub(crate) fn splat(token: T::Token, v: &Vector3<f64>) -> Self {
        Self::new(
            T::splat(token, v.x),
            T::splat(token, v.y),
            T::splat(token, v.z),
        )
    }

    /// Returns `v` in every lane.
    #[inline(always)]
    pub(crate) fn constant(self, v: &Vector3<f64>) -> Self {
        let x = self.x;
        Self::new(x.constant(v.x), x.constant(v.y), x.constant(v.z))
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> T {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub(crate) fn norm_squared(self) -> T {
        self.dot(self)
    }

    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    #[inline(always)]
    pub(crate) fn component_mul(self, other: Self) -> Self {
        Self::new(self.x * other.x, self.y * other.y, self.z * other.z)
    }

    /// The values of `self` in `lanes`, and those of `others` elsewhere.
    #[inline(always)]
    pub(crate) fn where_in(self, lanes: u32, others: Self) -> Self {
        Self::new(
            self.x.where_in(lanes, others.x),
            self.y.where_in(lanes, others.y),
            self.z.where_in(lanes, others.z),
        )
    }

    pub(crate) fn lane(&self, k: usize) -> Vector3<f64> {
        Vector3::new(self.x.lane(k), self.y.lane(k), self.z.lane(k))
    }

    pub(crate) fn set_lane(&mut self, k: usize, v: &Vector3<f64>) {
        self.x.set_lane(k, v.x);
        self.y.set_lane(k, v.y);
        self.z.set_lane(k, v.z);
    }
}

impl From<&Vector3<f64>> for Vector<f64> {
    #[inline(always)]
    fn from(v: &Vector3<f64>) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

impl From<Vector<f64>> for Vector3<f64> {
    #[inline(always)]
    fn from(v: Vector<f64>) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

impl<T: Lane> Add for Vector<T> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<T: Lane> Sub for Vector<T> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl<T: Lane> Neg for Vector<T> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

impl<T: Lane> Mul<T> for Vector<T> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: T) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

impl<T: Lane> Div<T> for Vector<T> {
    type Output = Self;

    #[inline(always)]
    fn div(self, divisor: T) -> Self {
        Self::new(self.x / divisor, self.y / divisor, self.z / divisor)
    }
}

impl<T: Lane> Matrix<T> {
    #[inline(always)]
    pub(crate) fn splat(token: T::Token, m: &Matrix3<f64>) -> Self {
        let [a, b, c] = [0, 1, 2].map(|j| m.column(j).into_owned());
        Self([
            Vector::splat(token, &a),
            Vector::splat(token, &b),
            Vector::splat(token, &c),
        ])
    }

    #[inline(always)]
    pub(crate) fn tr_mul(&self, v: Vector<T>) -> Vector<T> {
        let [a, b, c] = self.0;
        Vector::new(a.dot(v), b.dot(v), c.dot(v))
    }

    #[inline(always)]
    pub(crate) fn transpose(&self) -> Self {
        let [a, b, c] = self.0;
        Self([
            Vector::new(a.x, b.x, c.x),
            Vector::new(a.y, b.y, c.y),
            Vector::new(a.z, b.z, c.z),
        ])
    }

    pub(crate) fn lane(&self, k: usize) -> Matrix3<f64> {
        Matrix3::from_columns(&self.0.map(|column| column.lane(k)))
    }

    pub(crate) fn set_lane(&mut self, k: usize, m: &Matrix3<f64>) {
        for (j, column) in self.0.iter_mut().enumerate() {
            column.set_lane(k, &m.column(j).into_owned());
        }
    }
}

impl<T: Lane> Mul<Vector<T>> for Matrix<T> {
    type Output = Vector<T>;

    #[inline(always)]
    fn mul(self, v: Vector<T>) -> Vector<T> {
        let [a, b, c] = self.0;
        a * v.x + b * v.y + c * v.z
    }
}

impl<T: Lane> Mul for Matrix<T> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let [a, b, c] = other.0;
        Self([self * a, self * b, self * c])
    }
}

impl<T: Lane> Mul<T> for Matrix<T> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: T) -> Self {
        let [a, b, c] = self.0;
        Self([a * factor, b * factor, c * factor])
    }
}

impl<T: Lane> Add for Matrix<T> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let ([a, b, c], [d, e, f]) = (self.0, other.0);
        Self([a + d, b + e, c + f])
    }
}

/// `m d/r³`.
#[inline(always)]
pub(crate) fn attraction<T: Lane>(d: Vector<T>, mass: T) -> Vector<T> {
    let squared = d.norm_squared();
    let inverse = squared.constant(1.0) / squared;
    d * (mass * (inverse * inverse) * squared.sqrt())
}
