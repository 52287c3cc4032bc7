use lgvi_lie::Quaternion;
use nalgebra::{Matrix3, Vector3};

use super::lane::Lane;
use super::linear::{Matrix, Vector};
use crate::RigidBody;
use crate::rotation::{
    Direct, General, MAX_PASSES, Principal, RelativeRotation, SOLVED, Unsolvable,
};

/// The implicit equation of one body.
#[derive(Clone, Copy)]
pub(super) enum Equation {
    Principal(Direct<Principal>),
    General(Direct<General>),
}

impl Equation {
    /// Those of bodies that fly together: principal axes are of use where all bodies have them.
    pub(super) fn of(bodies: &[RigidBody]) -> Vec<Self> {
        let inertias = || bodies.iter().map(RigidBody::inertia);
        let principal: Option<Vec<_>> = inertias().map(Direct::principal).collect();
        match principal {
            Some(equations) => equations.into_iter().map(Self::Principal).collect(),
            None => inertias()
                .map(|j| Self::General(Direct::general(j)))
                .collect(),
        }
    }

    fn principal(&self) -> &Principal {
        match self {
            Self::Principal(direct) => &direct.moments,
            Self::General(direct) => &direct.moments.principal,
        }
    }

    fn limit_and_scale(&self) -> (f64, f64) {
        match self {
            Self::Principal(direct) => (direct.limit, direct.scale),
            Self::General(direct) => (direct.limit, direct.scale),
        }
    }

    /// Principal axes, in columns, where they are not the body's.
    pub(super) fn axes(&self) -> Option<&Matrix3<f64>> {
        match self {
            Self::Principal(_) => None,
            Self::General(direct) => Some(&direct.moments.axes),
        }
    }

    /// The solution whatever it takes, and the correction of s.
    pub(super) fn solve(
        &self,
        body: &RigidBody,
        h: f64,
        p: &Vector3<f64>,
        guess: f64,
    ) -> Result<(Quaternion, f64), Unsolvable> {
        let inertia = body.inertia();
        let (RelativeRotation { cayley, .. }, correction) = match self {
            Self::Principal(direct) => direct.solve_on(inertia, h, p, guess)?,
            Self::General(direct) => direct.solve_on(inertia, h, p, guess)?,
        };
        Ok((Quaternion::from_cayley(&cayley), correction))
    }
}

/// The implicit equation of one body in every lane, solved as [`Direct`] does at once.
pub(super) struct Turn<T> {
    moments: Vector<T>,
    reciprocals: Vector<T>,
    differences: Vector<T>,
    axes: Option<Matrix<T>>,
    limit: T,
    scale: T,
}

/// What the equation is given: `h p` relative to `tr J`, its square, the same about principal axes, and what s is for small
/// ones.
struct Given<T> {
    g: Vector<T>,
    gamma: T,
    own: Vector<T>,
    leading: T,
}

/// The quaternion `(w, u)` of a turn, of any length.
#[derive(Clone, Copy)]
pub(super) struct Rotation<T> {
    w: T,
    u: Vector<T>,
}

/// A turn, the correction of s, and bit k: whether that is the solution in lane k.
pub(super) struct Solved<T> {
    pub(super) turn: Rotation<T>,
    pub(super) correction: T,
    pub(super) lanes: u32,
}

impl<T: Lane> Turn<T> {
    /// Of one equation a lane, all with principal axes or all without.
    pub(super) fn new(token: T::Token, equations: &[Equation]) -> Self {
        let zero = T::splat(token, 0.0);
        let none = Vector::splat(token, &Vector3::zeros());
        let mut turn = Self {
            moments: none,
            reciprocals: none,
            differences: none,
            axes: None,
            limit: zero,
            scale: zero,
        };
        for (k, equation) in equations.iter().enumerate() {
            let principal = equation.principal();
            turn.moments.set_lane(k, &principal.moments);
            turn.reciprocals.set_lane(k, &principal.reciprocals);
            turn.differences.set_lane(k, &principal.differences);
            let (limit, scale) = equation.limit_and_scale();
            turn.limit.set_lane(k, limit);
            turn.scale.set_lane(k, scale);
            if let Some(own) = equation.axes() {
                let axes = turn.axes.get_or_insert(Matrix([none; 3]));
                axes.set_lane(k, own);
            }
        }
        turn
    }

    /// From guesses of the correction; repeated, as [`Direct::solve_on`] does, until it is found in all of `lanes` or has
    /// been repeated often enough.
    #[inline(always)]
    pub(super) fn solve(&self, h: f64, p: Vector<T>, guess: T, lanes: u32) -> Solved<T> {
        let given = self.given(h, p);
        let mut found = self.pass(&given, guess);
        let mut turn = found.turn;
        for _ in 0..MAX_PASSES {
            let open = lanes & !found.lanes;
            if open == 0 {
                break;
            }
            let cayley = turn.u / turn.w;
            let pass = self.pass(&given, given.g.dot(cayley) - given.leading);
            let solved = open & pass.lanes;
            if solved != 0 {
                let cayley = Rotation {
                    w: turn.w.constant(1.0),
                    u: pass.turn.u / pass.turn.w,
                };
                found.turn = cayley.where_in(solved, &found.turn);
                found.correction = pass.correction.where_in(solved, found.correction);
                found.lanes |= solved;
            }
            turn = pass.turn;
        }
        found
    }

    #[inline(always)]
    fn given(&self, h: f64, p: Vector<T>) -> Given<T> {
        let g = p * (self.scale * h);
        let own = match &self.axes {
            Some(axes) => axes.tr_mul(g),
            None => g,
        };
        Given {
            g,
            gamma: g.norm_squared(),
            own,
            leading: self.reciprocals.dot(own.component_mul(own)),
        }
    }

    /// From guesses of the correction, once.
    #[inline(always)]
    fn pass(&self, given: &Given<T>, guess: T) -> Solved<T> {
        let Given {
            g,
            gamma,
            own,
            leading,
        } = *given;
        let guess = leading + guess;
        let mut turn = self.solution(own, gamma, guess);
        if let Some(axes) = &self.axes {
            turn.u = *axes * turn.u;
        }
        let reciprocal = gamma.constant(1.0) / turn.w;
        let s = reciprocal * g.dot(turn.u);
        let miss = (s - guess) * reciprocal;
        let residual = miss * miss * turn.u.norm_squared();
        Solved {
            turn,
            correction: s - leading,
            lanes: residual.at_most(gamma * SOLVED) & s.below(self.limit),
        }
    }

    /// About principal axes.
    #[inline(always)]
    fn solution(&self, g: Vector<T>, gamma: T, s: T) -> Rotation<T> {
        let (j, k) = (&self.moments, &self.differences);
        let (a, b, c) = (j.x - s, j.y - s, j.z - s);
        let (bc, ca, ab) = (b * c, c * a, a * b);
        let form = a * (g.x * g.x) + b * (g.y * g.y) + c * (g.z * g.z);
        let u = Vector::new(
            (bc + gamma) * g.x - k.x * (g.y * g.z),
            (ca + gamma) * g.y - k.y * (g.z * g.x),
            (ab + gamma) * g.z - k.z * (g.x * g.y),
        );
        let w = a * bc + form;
        Rotation { w, u }
    }
}

impl<T: Lane> Rotation<T> {
    /// This in `lanes`, the other elsewhere.
    #[inline(always)]
    fn where_in(&self, lanes: u32, other: &Self) -> Self {
        let (own, others) = (self.u, other.u);
        Self {
            w: self.w.where_in(lanes, other.w),
            u: Vector::new(
                own.x.where_in(lanes, others.x),
                own.y.where_in(lanes, others.y),
                own.z.where_in(lanes, others.z),
            ),
        }
    }

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

/// `R (I + s C)` for the columns of C, relieved of rounding.
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

// Functions, for what a closure calls need not become part of it.
#[inline(always)]
fn turned<T: Lane>(factor: T, [i, j, k]: [Vector<T>; 3], row: Vector<T>) -> Vector<T> {
    row + Vector::new(row.dot(i), row.dot(j), row.dot(k)) * factor
}

/// What brings a row of about unit length to that length.
#[inline(always)]
fn scale<T: Lane>(row: Vector<T>) -> T {
    let squared = row.norm_squared();
    squared.constant(1.5) - squared * 0.5
}
