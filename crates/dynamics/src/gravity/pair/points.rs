use fearless_simd::{Level, Simd, f64x2};
use nalgebra::Vector3;

use super::couple::{Couple, swapped};
use super::{Exchange, PointMass};
use crate::BodyState;
use crate::lane::{Vector, attraction, vectorize};

/// The exchange of two bodies of points, summed over all pairs of points: `U = −Σ_{p,q} m_p m_q / |x_i + R_i ρ_p − x_j
/// − R_j ρ_q|` (§3.4).
#[inline]
pub(super) fn exchange(
    [points, others]: [&[PointMass]; 2],
    states: [&BodyState; 2],
    couples: &mut Vec<Couple>,
) -> Exchange {
    let [r, s] = states.map(|state| &state.attitude);
    if let ([p, own @ ..], [q, theirs @ ..]) = (points, others)
        && own.len() < 2
        && theirs.len() < 2
    {
        let own = Couple::new(p, own.first(), r);
        let theirs = Couple::new(q, theirs.first(), s);
        vectorize!(Level::baseline(), simd => between(simd, [&[own], &[theirs]], states))
    } else {
        couples.clear();
        couples.extend(Couple::of(points, r));
        couples.extend(Couple::of(others, s));
        let (own, theirs) = couples.split_at(points.len().div_ceil(2));
        vectorize!(Level::baseline(), simd => between(simd, [own, theirs], states))
    }
}

/// Processes two points of each body at a time: first the straight pairs, then the crossed ones.
#[inline(always)]
fn between<S: Simd>(simd: S, couples: [&[Couple]; 2], states: [&BodyState; 2]) -> Exchange {
    let [at, there] = states;
    let separation = Vector::splat(simd, &(there.position - at.position));
    let zero = Vector::splat(simd, &Vector3::zeros());
    let (mut pull, mut torque, mut other_torque) = (zero, zero, zero);
    for second in couples[1] {
        let second = second.load(simd);
        let crossed = second.swapped();
        let places = [second, crossed].map(|couple| separation + couple.arms);
        let mut on_second = zero;
        for first in couples[0] {
            let first = first.load(simd);
            let straight = attraction(places[0] - first.arms, first.masses * second.masses);
            let across = attraction(places[1] - first.arms, first.masses * crossed.masses);
            let on_first = straight + across;
            pull = pull + on_first;
            torque = torque + first.arms.cross(on_first);
            on_second = on_second + (straight + swapped(across));
        }
        other_torque = other_torque + on_second.cross(second.arms);
    }
    Exchange {
        force: sum(pull),
        moments: [
            at.attitude.tr_mul(&sum(torque)),
            there.attitude.tr_mul(&sum(other_torque)),
        ],
    }
}

#[inline(always)]
fn sum<S: Simd>(v: Vector<f64x2<S>>) -> Vector3<f64> {
    v.lane(0) + v.lane(1)
}

pub(super) fn potential(points: [&[PointMass]; 2], states: [&BodyState; 2]) -> f64 {
    let mut sum = 0.0;
    for p in points[0] {
        let from = states[0].position + states[0].attitude * p.position;
        for q in points[1] {
            let to = states[1].position + states[1].attitude * q.position;
            sum -= p.mass * q.mass / (from - to).norm();
        }
    }
    sum
}
