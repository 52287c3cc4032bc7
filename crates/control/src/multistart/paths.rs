use std::f64::consts::TAU;

use lgvi_dynamics::{BodyState, Load};
use lgvi_lie::{exp, vee};
use nalgebra::{SVector, Vector3};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::discrete::balance;
use crate::newton::guess::hermite;
use crate::{Certificate, Plan, Sweep, Transfer};

/// A detour that is added to the path between both ends.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Detour {
    /// Additional turns along the geodesic of the attitude.
    along: f64,
    /// Whole turns along the way, times a unit vector in the body frame.
    loops: Vector3<f64>,
    /// Greatest shift of the position, in units of the distance between both ends.
    position: Vector3<f64>,
    /// Greatest rotation of the attitude off the path (rad).
    attitude: Vector3<f64>,
}

/// A sequence of detours: windings about the axis of the geodesic and the axes of the body, then random ones.
pub(super) struct Detours {
    rng: Pcg64Mcg,
    given: usize,
}

/// Numbers of turns along the geodesic that are tried first.
const ALONG: [f64; 4] = [-1.0, 1.0, -2.0, 2.0];

impl Detours {
    pub(super) fn new(seed: u64) -> Self {
        Self {
            rng: Pcg64Mcg::seed_from_u64(seed),
            given: 0,
        }
    }

    /// Uniform in `[−1, 1)³`.
    fn cube(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| (self.rng.next_u64() >> 11) as f64 * f64::EPSILON - 1.0)
    }

    fn random(&mut self) -> Detour {
        let axis = self.cube();
        let turns = self.cube();
        // Half of them wind once more, some twice.
        let turns = (2.4 * turns.x).trunc();
        let norm = axis.norm();
        Detour {
            along: 0.0,
            loops: if norm > 0.0 {
                axis * (turns / norm)
            } else {
                Vector3::zeros()
            },
            position: 0.5 * self.cube(),
            attitude: 2.0 * self.cube(),
        }
    }
}

impl Iterator for Detours {
    type Item = Detour;

    fn next(&mut self) -> Option<Detour> {
        let number = self.given;
        self.given += 1;
        let winding = Detour::default();
        Some(match number.checked_sub(ALONG.len()) {
            None => Detour {
                along: ALONG[number],
                ..winding
            },
            Some(about) if about < 6 => {
                let turns = if about % 2 == 0 { 1.0 } else { -1.0 };
                Detour {
                    loops: Vector3::ith(about / 2, turns),
                    ..winding
                }
            }
            Some(_) => self.random(),
        })
    }
}

/// A path with a detour between both ends, as an initial plan. The momenta are differences of the path; the commands
/// come nearest to the loads with which Lie–Euler steps follow it.
pub(super) fn plan(transfer: &Transfer, to: &BodyState, detour: &Detour) -> Plan {
    let Transfer {
        body,
        field,
        initial,
        actuation,
        inequalities,
        h,
        intervals,
        ..
    } = transfer;
    let duration = h * *intervals as f64;
    let mut path = hermite(body, duration, *intervals, initial, to, detour.along);
    let distance = (to.position - initial.position).norm();
    for (k, (position, attitude)) in path.iter_mut().enumerate() {
        let t = k as f64 / *intervals as f64;
        let turned = t * t * (3.0 - 2.0 * t);
        let aside = 16.0 * t * t * (1.0 - t) * (1.0 - t);
        *position += aside * distance * detour.position;
        *attitude *= exp(&(TAU * turned * detour.loops)) * exp(&(aside * detour.attitude));
    }
    let one_sided = inequalities.one_sided();
    let mut states = vec![*initial];
    let mut commands = Vec::with_capacity(*intervals);
    for k in 1..=*intervals {
        let (position, attitude) = path[k];
        let mut state = match path.get(k + 1) {
            Some((next_position, next_attitude)) => {
                let moved = attitude.tr_mul(next_attitude) * body.inertia().nonstandard();
                BodyState {
                    position,
                    linear_momentum: (body.mass() / h) * (next_position - position),
                    attitude,
                    angular_momentum: vee(&(moved - moved.transpose())) / *h,
                }
            }
            None => *to,
        };
        let before = states[k - 1];
        if transfer.orbit.is_some() {
            state.linear_momentum = balance(initial, &state);
            let force = (state.linear_momentum - before.linear_momentum) / *h;
            let exchanged = Load {
                force,
                moment: -force,
            };
            commands.push(actuation.allocated(&exchanged, &one_sided));
            states.push(state);
            continue;
        }
        let carried = attitude.tr_mul(&before.attitude) * before.angular_momentum;
        let gravity = field.load(body, &position, &attitude);
        let force = (state.linear_momentum - before.linear_momentum) / *h - gravity.force;
        let moment = (state.angular_momentum - carried) / *h - gravity.moment;
        let load = actuation.in_own_axes(&Load { force, moment }, &attitude);
        commands.push(actuation.allocated(&load, &one_sided));
        states.push(state);
    }
    Plan {
        h: *h,
        states,
        controls: commands
            .iter()
            .map(|command| actuation.load(command))
            .collect(),
        commands,
        multipliers: vec![SVector::zeros(); *intervals],
        feedback: Vec::new(),
        actuator_feedback: Vec::new(),
        cost: 0.0,
        paid: 0.0,
        certificate: Certificate::default(),
        sweep: Sweep::default(),
    }
}
