use lgvi_lie::vee;
use nalgebra::{Matrix3, Vector3};

use super::Exchange;
use crate::BodyState;
use crate::gravity::Multipole;

/// The exchange of two multipoles: the asphericity of each body interacts with the other's monopole. If one of them is
/// of fourth order, the quadrupole–quadrupole interaction is added.
///
/// To second order, `U = −m_i m_j/r − m_j (tr J_i − 3 e·J_i e/r²)/(2r³)`, plus the last term with i and j exchanged.
#[inline]
pub(super) fn exchange(multipoles: [&Multipole; 2], states: [&BodyState; 2]) -> Exchange {
    if multipoles.iter().all(|multipole| multipole.order() == 2) {
        second_order(multipoles, states)
    } else {
        fourth_order(multipoles, states)
    }
}

pub(super) fn potential(multipoles: [&Multipole; 2], states: [&BodyState; 2]) -> f64 {
    let d = states[0].position - states[1].position;
    let [first, second] = multipoles;
    let e = states.map(|state| state.attitude.tr_mul(&d));
    let mut sum = -first.strength() * second.strength() / d.norm()
        + second.strength() * first.asphericity().potential(&-e[0])
        + first.strength() * second.asphericity().potential(&e[1]);
    if multipoles.iter().any(|multipole| multipole.order() > 2) {
        sum += Quadrupoles::new(multipoles, states).potential();
    }
    sum
}

#[inline]
fn second_order(multipoles: [&Multipole; 2], states: [&BodyState; 2]) -> Exchange {
    let d = states[0].position - states[1].position;
    let squared = d.norm_squared();
    let by_r2 = 1.0 / squared;
    let by_r3 = by_r2 * by_r2 * squared.sqrt();
    let strengths = multipoles.map(Multipole::strength);
    // P = e·He, ∇P = 2He; f = m (∇P − 5 P e/r²)/r⁵ and M = m ∇P × e/r⁵
    let aspherical = |own: usize| {
        let attitude = &states[own].attitude;
        let e = attitude.tr_mul(&d);
        let strength = 2.0 * strengths[1 - own] * by_r3 * by_r2;
        let slope = strength * (multipoles[own].asphericity().second.0 * e);
        (
            attitude * slope,
            2.5 * by_r2 * e.dot(&slope),
            slope.cross(&e),
        )
    };
    let (across, along, moment) = aspherical(0);
    let (other_across, other_along, other_moment) = aspherical(1);
    let straight = strengths[0] * strengths[1] * by_r3 + along + other_along;
    Exchange {
        force: across + other_across - straight * d,
        moments: [moment, other_moment],
    }
}

fn fourth_order(multipoles: [&Multipole; 2], states: [&BodyState; 2]) -> Exchange {
    let d = states[0].position - states[1].position;
    let strengths = multipoles.map(Multipole::strength);
    let by_r2 = 1.0 / d.norm_squared();
    let mut force = (-strengths[0] * strengths[1] * by_r2 * by_r2.sqrt()) * d;
    let mut moments = [Vector3::zeros(); 2];
    for (own, to_other) in [(0, -d), (1, d)] {
        let e = states[own].attitude.tr_mul(&to_other);
        let a = strengths[1 - own] * multipoles[own].asphericity().acceleration(&e);
        let on_other = states[own].attitude * a;
        force += if own == 0 { -on_other } else { on_other };
        moments[own] = a.cross(&e);
    }
    let quadrupoles = Quadrupoles::new(multipoles, states).exchange();
    Exchange {
        force: force + quadrupoles.force,
        moments: [0, 1].map(|own| moments[own] + quadrupoles.moments[own]),
    }
}

/// The quadrupole–quadrupole interaction. With `Q = tr[J] I − 3J` in the inertial frame and s = d·Qd: `U = −35/12 s_i
/// s_j/r⁹ + 5/3 (Q_i d)·(Q_j d)/r⁷ − 1/6 tr[Q_i Q_j]/r⁵`.
struct Quadrupoles<'a> {
    attitudes: [&'a Matrix3<f64>; 2],
    d: Vector3<f64>,
    /// Q of each body, inertial frame.
    q: [Matrix3<f64>; 2],
    /// Q d.
    qd: [Vector3<f64>; 2],
    /// d·Q d.
    s: [f64; 2],
}

impl<'a> Quadrupoles<'a> {
    fn new(multipoles: [&Multipole; 2], states: [&'a BodyState; 2]) -> Self {
        let d = states[0].position - states[1].position;
        let attitudes = states.map(|state| &state.attitude);
        let q = [0, 1].map(|own| {
            let body = 2.0 * multipoles[own].asphericity().second.0;
            attitudes[own] * body * attitudes[own].transpose()
        });
        let qd = q.map(|q| q * d);
        Self {
            attitudes,
            d,
            q,
            qd,
            s: qd.map(|qd| d.dot(&qd)),
        }
    }

    /// `1/r⁵` and `1/r²`.
    fn powers(&self) -> (f64, f64) {
        let by_r2 = 1.0 / self.d.norm_squared();
        (by_r2 * by_r2 * by_r2.sqrt(), by_r2)
    }

    /// `tr[Q_i Q_j]`.
    fn trace(&self) -> f64 {
        self.q[0].dot(&self.q[1])
    }

    fn potential(&self) -> f64 {
        let (by_r5, by_r2) = self.powers();
        let [s_i, s_j] = self.s;
        let once = 5.0 / 3.0 * self.qd[0].dot(&self.qd[1]);
        by_r5 * (by_r2 * (once - 35.0 / 12.0 * by_r2 * s_i * s_j) - self.trace() / 6.0)
    }

    fn exchange(&self) -> Exchange {
        let (by_r5, by_r2) = self.powers();
        let [s_i, s_j] = self.s;
        let [q_i, q_j] = &self.q;
        let [qd_i, qd_j] = &self.qd;
        let (ij, ji) = (q_i * qd_j, q_j * qd_i);
        let (outer, middle) = (35.0 / 6.0 * by_r2 * by_r2, 5.0 / 3.0 * by_r2);
        let along = middle * (3.5 * qd_i.dot(qd_j) * by_r2 * 2.0)
            - 4.5 * outer * by_r2 * s_i * s_j
            - 5.0 / 6.0 * by_r2 * self.trace();
        let force = outer * (s_j * qd_i + s_i * qd_j) - middle * (ij + ji) + along * self.d;
        let twist = vee(&(q_i * q_j - q_j * q_i)) / 3.0;
        let torque_i = outer * s_j * qd_i.cross(&self.d)
            - middle * (ij.cross(&self.d) + qd_i.cross(qd_j))
            - twist;
        let torque_j = outer * s_i * qd_j.cross(&self.d)
            - middle * (ji.cross(&self.d) + qd_j.cross(qd_i))
            + twist;
        Exchange {
            force: by_r5 * force,
            moments: [
                by_r5 * self.attitudes[0].tr_mul(&torque_i),
                by_r5 * self.attitudes[1].tr_mul(&torque_j),
            ],
        }
    }
}
