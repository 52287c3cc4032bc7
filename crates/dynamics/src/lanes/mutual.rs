use super::body::{Body, Effect, Mass, Motion, Point, State};
use super::pair::{Exchange, add_others};
use crate::lane::{Lane, Matrix, Vector, attraction};

/// Mutual attraction by pairs of bodies, and of points by pairs of couples of points, in the same order as
/// [`Mutual`](crate::gravity::Mutual).
pub(super) struct Mutual<T> {
    constant: T,
    /// Buffers for the couples of one body and of the other.
    couples: [Vec<Couple<T>>; 2],
}

/// Two points of a body, or one point and a massless copy of it.
#[derive(Clone, Copy)]
struct Couple<T> {
    masses: [T; 2],
    /// `R ρ` of each point.
    arms: [Vector<T>; 2],
}

impl<T: Lane> Mutual<T> {
    pub(super) fn new(token: T::Token, constant: f64, bodies: &[Body<T>]) -> Self {
        let points = bodies.iter().map(|body| match &body.mass {
            Mass::Points(points) => points.len(),
            Mass::Multipole(_) => 0,
        });
        let most = points.max().unwrap_or(0).div_ceil(2);
        Self {
            constant: T::splat(token, constant),
            couples: [Vec::with_capacity(most), Vec::with_capacity(most)],
        }
    }

    #[inline(always)]
    pub(super) fn add_to(
        &mut self,
        bodies: &[Body<T>],
        states: &[State<T>],
        effects: &mut [Effect<T>],
    ) {
        for i in 0..bodies.len() {
            for j in i + 1..bodies.len() {
                if bodies[i].motion == Motion::Held && bodies[j].motion == Motion::Held {
                    continue;
                }
                let pair = [&bodies[i], &bodies[j]];
                let at = [&states[i], &states[j]];
                if let [Mass::Points(first), Mass::Points(second)] = [&pair[0].mass, &pair[1].mass]
                {
                    let exchange = self.between_points([first, second], at);
                    exchange.add_to(effects, [i, j], self.constant);
                } else {
                    add_others(pair, at, effects, [i, j], self.constant);
                }
            }
        }
    }

    #[inline(always)]
    fn between_points(&mut self, bodies: [&[Point<T>]; 2], states: [&State<T>; 2]) -> Exchange<T> {
        if let ([p, q], [r, s]) = (bodies[0], bodies[1]) {
            let own = Couple::new(p, Some(q), &states[0].attitude);
            let theirs = Couple::new(r, Some(s), &states[1].attitude);
            return between([&[own], &[theirs]], states);
        }
        for ((couples, points), state) in self.couples.iter_mut().zip(bodies).zip(states) {
            couples.clear();
            for points in points.chunks(2) {
                couples.push(Couple::new(&points[0], points.get(1), &state.attitude));
            }
        }
        let [own, theirs] = &self.couples;
        between([own, theirs], states)
    }
}

impl<T: Lane> Couple<T> {
    #[inline(always)]
    fn new(first: &Point<T>, second: Option<&Point<T>>, attitude: &Matrix<T>) -> Self {
        let (mass, other) = match second {
            Some(second) => (second.mass, second),
            None => (first.mass.constant(0.0), first),
        };
        Self {
            masses: [first.mass, mass],
            arms: [*attitude * first.position, *attitude * other.position],
        }
    }
}

#[inline(always)]
fn between<T: Lane>(couples: [&[Couple<T>]; 2], states: [&State<T>; 2]) -> Exchange<T> {
    let [at, there] = states;
    let separation = there.position - at.position;
    let zero = separation.x.constant(0.0);
    let zero = Vector::new(zero, zero, zero);
    let mut pull = [zero; 2];
    let mut torque = [zero; 2];
    let mut other_torque = [zero; 2];
    for second in couples[1] {
        let places = [separation + second.arms[0], separation + second.arms[1]];
        let mut on_second = [zero; 2];
        for first in couples[0] {
            let ([p, q], [m, n]) = (first.arms, first.masses);
            let straight = [
                attraction(places[0] - p, m * second.masses[0]),
                attraction(places[1] - q, n * second.masses[1]),
            ];
            let across = [
                attraction(places[1] - p, m * second.masses[1]),
                attraction(places[0] - q, n * second.masses[0]),
            ];
            for own in 0..2 {
                let on_first = straight[own] + across[own];
                pull[own] = pull[own] + on_first;
                torque[own] = torque[own] + first.arms[own].cross(on_first);
                on_second[own] = on_second[own] + (straight[own] + across[1 - own]);
            }
        }
        for own in 0..2 {
            other_torque[own] = other_torque[own] + on_second[own].cross(second.arms[own]);
        }
    }
    Exchange {
        force: pull[0] + pull[1],
        moments: [
            at.attitude.tr_mul(torque[0] + torque[1]),
            there.attitude.tr_mul(other_torque[0] + other_torque[1]),
        ],
    }
}
