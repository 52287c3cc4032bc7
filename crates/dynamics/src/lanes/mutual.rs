use super::body::{Body, Effect, Mass, Motion, Point, State};
use super::multipole::{self, Multipole};
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

/// The force and moments between two bodies, without the gravitational constant.
pub(super) struct Exchange<T> {
    /// Force on the first body, inertial frame. The force on the second is its opposite.
    pub(super) force: Vector<T>,
    pub(super) moments: [Vector<T>; 2],
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
                let exchange = self.exchange([&bodies[i], &bodies[j]], [&states[i], &states[j]]);
                let force = exchange.force * self.constant;
                effects[i].force = effects[i].force + force;
                effects[j].force = effects[j].force - force;
                effects[i].moment = effects[i].moment + exchange.moments[0] * self.constant;
                effects[j].moment = effects[j].moment + exchange.moments[1] * self.constant;
            }
        }
    }

    #[inline(always)]
    fn exchange(&mut self, bodies: [&Body<T>; 2], states: [&State<T>; 2]) -> Exchange<T> {
        match [&bodies[0].mass, &bodies[1].mass] {
            [Mass::Points(first), Mass::Points(second)] => {
                self.between_points([first, second], states)
            }
            [Mass::Multipole(first), Mass::Multipole(second)] => {
                multipole::between([first, second], states)
            }
            [Mass::Multipole(field), Mass::Points(points)] => {
                attracted(field, states[0], points, states[1])
            }
            [Mass::Points(points), Mass::Multipole(field)] => {
                attracted(field, states[1], points, states[0]).swapped()
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

impl<T: Lane> Exchange<T> {
    /// The exchange with the bodies in reverse order.
    #[inline(always)]
    fn swapped(self) -> Self {
        let [first, second] = self.moments;
        Self {
            force: -self.force,
            moments: [second, first],
        }
    }
}

/// The exchange between a multipole and another body's points.
#[inline(always)]
fn attracted<T: Lane>(
    field: &Multipole<T>,
    at: &State<T>,
    points: &[Point<T>],
    there: &State<T>,
) -> Exchange<T> {
    let separation = at.attitude.tr_mul(there.position - at.position);
    let [a, b, c] = there.attitude.0;
    let turn = Matrix([
        at.attitude.tr_mul(a),
        at.attitude.tr_mul(b),
        at.attitude.tr_mul(c),
    ]);
    let zero = separation.x.constant(0.0);
    let zero = Vector::new(zero, zero, zero);
    let (mut recoil, mut torque, mut other_torque) = (zero, zero, zero);
    for Point { mass, position } in points {
        let arm = turn * *position;
        let d = separation + arm;
        let force = field.acceleration(d) * *mass;
        recoil = recoil - force;
        torque = torque + force.cross(d);
        other_torque = other_torque + arm.cross(force);
    }
    Exchange {
        force: at.attitude * recoil,
        moments: [torque, turn.tr_mul(other_torque)],
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
