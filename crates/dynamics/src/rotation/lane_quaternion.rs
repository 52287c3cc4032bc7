use crate::lane::{Lane, Matrix, Vector};

/// The quaternion `(w, u)` of a rotation in every lane, of any length, with the operations of [`lgvi_lie::Quaternion`].
#[derive(Clone, Copy)]
pub(crate) struct LaneQuaternion<T> {
    pub(crate) w: T,
    pub(crate) u: Vector<T>,
}

impl<T: Lane> LaneQuaternion<T> {
    /// `2/(w² + |u|²)`.
    #[inline(always)]
    pub(crate) fn factor(&self) -> T {
        self.w.constant(2.0) / (self.w * self.w + self.u.norm_squared())
    }

    /// The quaternion of the matrix product: `other` is applied first, then `self`.
    #[inline(always)]
    pub(crate) fn product(&self, other: &Self) -> Self {
        Self {
            w: self.w * other.w - self.u.dot(other.u),
            u: other.u * self.w + self.u * other.w + self.u.cross(other.u),
        }
    }

    /// `Fᵀ p`.
    #[inline(always)]
    pub(crate) fn rotate_back(&self, p: Vector<T>) -> Vector<T> {
        let pu = p.cross(self.u);
        p + (pu * self.w + pu.cross(self.u)) * self.factor()
    }

    /// `R F`, given `2/(w² + |u|²)`.
    #[inline(always)]
    pub(crate) fn compose(&self, factor: T, r: &Matrix<T>) -> Matrix<T> {
        compose(factor, self.change(), r)
    }

    /// Both `R F` and `Fᵀ p`.
    #[inline(always)]
    pub(crate) fn carry(&self, r: &Matrix<T>, p: Vector<T>) -> (Matrix<T>, Vector<T>) {
        let factor = self.factor();
        let change = self.change();
        let [first, second, third] = change;
        let row = Vector::new(first.dot(p), second.dot(p), third.dot(p));
        let turned = p + row * factor;
        (compose(factor, change, r), turned)
    }

    /// The columns of `(F − I)/s = w S(u) + S(u)²`.
    #[inline(always)]
    fn change(&self) -> [Vector<T>; 3] {
        let (w, u) = (self.w, self.u);
        let (wx, wy, wz) = (w * u.x, w * u.y, w * u.z);
        let (xx, yy, zz) = (u.x * u.x, u.y * u.y, u.z * u.z);
        let (xy, yz, zx) = (u.x * u.y, u.y * u.z, u.z * u.x);
        [
            Vector::new(-(yy + zz), xy + wz, zx - wy),
            Vector::new(xy - wz, -(zz + xx), yz + wx),
            Vector::new(zx + wy, yz - wx, -(xx + yy)),
        ]
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
