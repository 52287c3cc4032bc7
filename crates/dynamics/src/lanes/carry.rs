//! Application of a rotation to a body in every lane.

use crate::lane::{Lane, Matrix, Vector};
use crate::rotation::LaneQuaternion;

impl<T: Lane> LaneQuaternion<T> {
    /// Both `R F` and `Fᵀ p`, as [`Quaternion::carry`].
    #[inline(always)]
    pub(super) fn carry(&self, r: &Matrix<T>, p: Vector<T>) -> (Matrix<T>, Vector<T>) {
        let (w, u) = (self.w, self.u);
        let factor = w.constant(2.0) / (w * w + u.norm_squared());
        let (wx, wy, wz) = (w * u.x, w * u.y, w * u.z);
        let (xx, yy, zz) = (u.x * u.x, u.y * u.y, u.z * u.z);
        let (xy, yz, zx) = (u.x * u.y, u.y * u.z, u.z * u.x);
        let first = Vector::new(-(yy + zz), xy + wz, zx - wy);
        let second = Vector::new(xy - wz, -(zz + xx), yz + wx);
        let third = Vector::new(zx + wy, yz - wx, -(xx + yy));
        let row = Vector::new(first.dot(p), second.dot(p), third.dot(p));
        let turned = p + row * factor;
        (compose(factor, [first, second, third], r), turned)
    }
}

/// `R (I + s C)` for the columns of C, with orthogonality errors removed to first order.
#[inline(always)]
fn compose<T: Lane>(factor: T, change: [Vector<T>; 3], r: &Matrix<T>) -> Matrix<T> {
    let [a, b, c] = r.0;
    let upper = Vector::new(a.x, b.x, c.x);
    let lower = Vector::new(a.y, b.y, c.y);
    let (upper, lower) = (turned(factor, change, upper), turned(factor, change, lower));
    let skew = upper.dot(lower) * 0.5;
    let (upper, lower) = (
        upper * scale(upper) - lower * skew,
        lower * scale(lower) - upper * skew,
    );
    let third = upper.cross(lower);
    Matrix([
        Vector::new(upper.x, lower.x, third.x),
        Vector::new(upper.y, lower.y, third.y),
        Vector::new(upper.z, lower.z, third.z),
    ])
}

// Functions, because calls inside a closure need not be inlined.
#[inline(always)]
fn turned<T: Lane>(factor: T, [i, j, k]: [Vector<T>; 3], row: Vector<T>) -> Vector<T> {
    row + Vector::new(row.dot(i), row.dot(j), row.dot(k)) * factor
}

/// The factor that normalizes a row of approximately unit length.
#[inline(always)]
fn scale<T: Lane>(row: Vector<T>) -> T {
    let squared = row.norm_squared();
    squared.constant(1.5) - squared * 0.5
}
