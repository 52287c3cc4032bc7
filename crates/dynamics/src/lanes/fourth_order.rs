use super::body::State;
use super::multipole::Multipole;
use super::pair::Exchange;
use crate::gravity::HigherTensors;
use crate::lane::{Lane, Matrix, Vector};

/// The terms of degree 3 and 4 in every lane.
pub(super) struct Higher<T> {
    third: [Matrix<T>; 3],
    fourth: [Matrix<T>; 6],
}

impl<T: Lane> Higher<T> {
    pub(super) fn none(zero: Matrix<T>) -> Self {
        Self {
            third: [zero; 3],
            fourth: [zero; 6],
        }
    }

    pub(super) fn set_lane(&mut self, k: usize, (third, fourth): HigherTensors) {
        for (own, from) in self.third.iter_mut().zip(third) {
            own.set_lane(k, from);
        }
        for (own, from) in self.fourth.iter_mut().zip(fourth) {
            own.set_lane(k, from);
        }
    }

    /// The acceleration, given `1/r²` and r, as in `Harmonic::acceleration`.
    #[inline(always)]
    pub(super) fn acceleration(&self, e: Vector<T>, by_r2: T, root: T) -> Vector<T> {
        let by_r7 = by_r2 * root * by_r2 * by_r2 * by_r2;
        let [x, y, z] = self.third;
        let u = (x * e.x + y * e.y + z * e.z) * e;
        let along = e * (e.dot(u) * 7.0 * by_r2);
        let third = (u * u.x.constant(3.0) - along) * by_r7;

        let u = self.fourth_contraction(e) * e;
        let along = e * (e.dot(u) * 9.0 * by_r2);
        let fourth = (u * u.x.constant(4.0) - along) * (by_r7 * by_r2);
        third + fourth
    }

    /// `H[e, e, ·, ·]`.
    #[inline(always)]
    fn fourth_contraction(&self, e: Vector<T>) -> Matrix<T> {
        let zero = e.x.constant(0.0);
        let [xx, yy, zz, xy, xz, yz] = self.fourth;
        let zero = Vector::new(zero, zero, zero);
        Matrix([zero; 3])
            + xx * (e.x * e.x)
            + yy * (e.y * e.y)
            + zz * (e.z * e.z)
            + xy * (e.x * e.y + e.y * e.x)
            + xz * (e.x * e.z + e.z * e.x)
            + yz * (e.y * e.z + e.z * e.y)
    }
}

/// The exchange of two multipoles, at least one of which is of fourth order.
#[inline(always)]
pub(super) fn fourth_order<T: Lane>(
    [first, second]: [&Multipole<T>; 2],
    states: [&State<T>; 2],
) -> Exchange<T> {
    let d = states[0].position - states[1].position;
    let by_r2 = d.x.constant(1.0) / d.norm_squared();
    let straight = -first.strength * second.strength * by_r2 * by_r2.sqrt();
    let (pull, moment) = asphericity(first, states[0], second.strength, -d);
    let (other_pull, other_moment) = asphericity(second, states[1], first.strength, d);
    let quadrupoles = between_quadrupoles([first, second], states);
    let [twist, other_twist] = quadrupoles.moments;
    Exchange {
        force: d * straight + -pull + other_pull + quadrupoles.force,
        moments: [moment + twist, other_moment + other_twist],
    }
}

/// The force of a body's asphericity on a monopole there, and the moment of the reaction.
#[inline(always)]
fn asphericity<T: Lane>(
    body: &Multipole<T>,
    state: &State<T>,
    monopole: T,
    there: Vector<T>,
) -> (Vector<T>, Vector<T>) {
    let e = state.attitude.tr_mul(there);
    let a = body.aspherical(e) * monopole;
    (state.attitude * a, a.cross(e))
}

/// The quadrupole–quadrupole interaction, as [`Quadrupoles`](crate::gravity::Mutual) of a pair.
#[inline(always)]
fn between_quadrupoles<T: Lane>(
    [first, second]: [&Multipole<T>; 2],
    states: [&State<T>; 2],
) -> Exchange<T> {
    let d = states[0].position - states[1].position;
    let (r_i, r_j) = (&states[0].attitude, &states[1].attitude);
    let (q_i, q_j) = (inertial(r_i, &first.second), inertial(r_j, &second.second));
    let (qd_i, qd_j) = (q_i * d, q_j * d);
    let (s_i, s_j) = (d.dot(qd_i), d.dot(qd_j));

    let by_r2 = d.x.constant(1.0) / d.norm_squared();
    let by_r5 = by_r2 * by_r2 * by_r2.sqrt();
    let (ij, ji) = (q_i * qd_j, q_j * qd_i);
    let (outer, middle) = (by_r2 * (35.0 / 6.0) * by_r2, by_r2 * (5.0 / 3.0));
    let along = middle * (qd_i.dot(qd_j) * 3.5 * by_r2 * 2.0)
        - outer * 4.5 * by_r2 * s_i * s_j
        - by_r2 * (5.0 / 6.0) * trace(&q_i, &q_j);
    let force = (qd_i * s_j + qd_j * s_i) * outer - (ij + ji) * middle + d * along;
    let twist = commutator(q_i, q_j) / d.x.constant(3.0);
    let torque_i =
        qd_i.cross(d) * (outer * s_j) - (ij.cross(d) + qd_i.cross(qd_j)) * middle - twist;
    let torque_j =
        qd_j.cross(d) * (outer * s_i) - (ji.cross(d) + qd_j.cross(qd_i)) * middle + twist;
    Exchange {
        force: force * by_r5,
        moments: [r_i.tr_mul(torque_i) * by_r5, r_j.tr_mul(torque_j) * by_r5],
    }
}

/// Q in the inertial frame.
#[inline(always)]
fn inertial<T: Lane>(attitude: &Matrix<T>, second: &Matrix<T>) -> Matrix<T> {
    let two = second.0[0].x.constant(2.0);
    *attitude * (*second * two) * attitude.transpose()
}

/// `tr[Q_i Q_j]`.
#[inline(always)]
fn trace<T: Lane>(q_i: &Matrix<T>, q_j: &Matrix<T>) -> T {
    let ([a, b, c], [d, e, f]) = (q_i.0, q_j.0);
    let sum = a.x * d.x + a.y * d.y + a.z * d.z;
    let sum = sum + b.x * e.x + b.y * e.y + b.z * e.z;
    sum + c.x * f.x + c.y * f.y + c.z * f.z
}

/// `vee(Q_i Q_j − Q_j Q_i)`.
#[inline(always)]
fn commutator<T: Lane>(q_i: Matrix<T>, q_j: Matrix<T>) -> Vector<T> {
    let ([a, b, c], [d, e, f]) = ((q_i * q_j).0, (q_j * q_i).0);
    let twice = Vector::new(
        (b.z - e.z) - (c.y - f.y),
        (c.x - f.x) - (a.z - d.z),
        (a.y - d.y) - (b.x - e.x),
    );
    twice * a.x.constant(0.5)
}
