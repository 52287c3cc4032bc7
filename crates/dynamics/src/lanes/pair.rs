use super::body::{Body, Effect, Mass, Point, State};
use super::multipole::{self, Multipole};
use crate::lane::{Lane, Matrix, Vector};

/// The force and moments between two bodies, without the gravitational constant.
pub(super) struct Exchange<T> {
    /// Force on the first body, inertial frame. The force on the second is its opposite.
    pub(super) force: Vector<T>,
    pub(super) moments: [Vector<T>; 2],
}

impl<T: Lane> Exchange<T> {
    /// Adds `constant` times this exchange to the effects on the two bodies.
    #[inline(always)]
    pub(super) fn add_to(&self, effects: &mut [Effect<T>], [i, j]: [usize; 2], constant: T) {
        let force = self.force * constant;
        effects[i].force = effects[i].force + force;
        effects[j].force = effects[j].force - force;
        effects[i].moment = effects[i].moment + self.moments[0] * constant;
        effects[j].moment = effects[j].moment + self.moments[1] * constant;
    }

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

/// Adds the exchange of two bodies, at least one of which is a multipole.
#[inline(never)]
pub(super) fn add_others<T: Lane>(
    bodies: [&Body<T>; 2],
    states: [&State<T>; 2],
    effects: &mut [Effect<T>],
    pair: [usize; 2],
    constant: T,
) {
    constant.vectorize(
        #[inline(always)]
        || {
            let exchange = match [&bodies[0].mass, &bodies[1].mass] {
                [Mass::Multipole(first), Mass::Multipole(second)] => {
                    multipole::between([first, second], states)
                }
                [Mass::Multipole(field), Mass::Points(points)] => {
                    attracted(field, states[0], points, states[1])
                }
                [Mass::Points(points), Mass::Multipole(field)] => {
                    attracted(field, states[1], points, states[0]).swapped()
                }
                [Mass::Points(_), Mass::Points(_)] => return,
            };
            exchange.add_to(effects, pair, constant);
        },
    );
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
