//! What gas that flows out does to a body that turns, beside the force of the thrusters.

use lgvi_dynamics::{BodyState, Load};
use nalgebra::{Matrix3, Vector3};

use super::flows::Flows;
use super::masses::Masses;
use crate::{Command, Transfer};

/// The loads of the Coriolis force and of the jet damping in the scaled motion, at both ends of each step, if the body turns as
/// in `states` under `forces` of its thrusters. The propagator lets gas flow out in the same way.
pub(super) fn loads(
    transfer: &Transfer,
    full: f64,
    masses: &Masses,
    states: &[BodyState],
    forces: &[Command],
) -> Vec<[Load; 2]> {
    let inertia = transfer.body.inertia().matrix() / transfer.body.mass();
    let flows = Flows::of(transfer);
    let at = |k: usize, state: &BodyState, [before, after]: [f64; 2], begins: bool| {
        Outflow::of(
            transfer,
            &flows.gradient(&forces[k]).component_mul(&forces[k]),
        )
        .map_or_else(Load::default, |out| {
            // Momenta of the scaled motion are those of the full body.
            let rate = inertia
                .try_inverse()
                .map_or_else(Vector3::zeros, |inverse| {
                    inverse * state.angular_momentum / full
                });
            let dt = 0.5 * transfer.h;
            let rates = out.rates(
                &rate,
                [before, after].map(|mass| mass * inertia),
                dt,
                begins,
            );
            let coriolis = (rates[0] + rates[1]).cross(&out.lever) / (0.5 * (before + after));
            Load {
                force: -full * (state.attitude * coriolis),
                moment: full * (inertia * (rates[1] - rates[0])) / dt,
            }
        })
    };
    let steps = 0..forces.len();
    steps
        .map(|k| {
            let middle = masses.middles[k];
            [
                at(k, &states[k], [masses.ends[k], middle], true),
                at(k, &states[k + 1], [middle, masses.ends[k + 1]], false),
            ]
        })
        .collect()
}

/// The gas of all thrusters in a unit of time.
struct Outflow {
    /// `Σ ṁ r`
    lever: Vector3<f64>,
    /// `Σ ṁ (|r|² I − r rᵀ)`
    damping: Matrix3<f64>,
}

impl Outflow {
    /// That of these mass flows, or `None` if there is none.
    fn of(transfer: &Transfer, flows: &Command) -> Option<Self> {
        let thrusters = transfer.body.thrusters()?.thrusters();
        let mut sum = Self {
            lever: Vector3::zeros(),
            damping: Matrix3::zeros(),
        };
        for (flow, thruster) in flows.iter().zip(thrusters) {
            let r = &thruster.position;
            sum.lever += *flow * r;
            sum.damping +=
                *flow * (Matrix3::from_diagonal_element(r.norm_squared()) - r * r.transpose());
        }
        (flows.amax() > 0.0).then_some(sum)
    }

    /// The angular velocities before and after gas has flowed out for `dt`, of which `rate` is the first or the last:
    /// `(J₁ + D) Ω₁ = (J₀ − D) Ω₀` with `D` of half the time.
    fn rates(
        &self,
        rate: &Vector3<f64>,
        [before, after]: [Matrix3<f64>; 2],
        dt: f64,
        first: bool,
    ) -> [Vector3<f64>; 2] {
        let damping = 0.5 * dt * self.damping;
        let (before, after) = (before - damping, after + damping);
        let other = |of: Matrix3<f64>, from: Matrix3<f64>| of.lu().solve(&(from * rate));
        if first {
            [*rate, other(after, before).unwrap_or(*rate)]
        } else {
            [other(before, after).unwrap_or(*rate), *rate]
        }
    }
}
