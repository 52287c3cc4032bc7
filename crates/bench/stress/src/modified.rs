//! The energy that a variational integrator keeps.

use lgvi_dynamics::rotation::FreeRotation;
use lgvi_dynamics::{BodyState, Load, System};

/// The modified energy of `lgvi` by the discrete rotor, to second order in h:
/// `H + h² [V̈/12 − (|F|²/m + MᵀJ⁻¹M)/24 + (e₁T² − e₂TC + e₃C²)/6]`, where V̈ is the second derivative of the potential on the way
/// without loads, T the energy of the rotation, `C = ½|Π|²` and the `e` are the elementary symmetric functions of `1/J`: kicks and
/// drifts do not commute, and the discrete drift turns by a sine's arc where the free body turns by the sine.
pub(crate) struct ModifiedEnergy {
    system: System,
    loads: Vec<Load>,
    h: f64,
}

impl ModifiedEnergy {
    pub(crate) fn new(system: System, h: f64) -> Self {
        let loads = vec![Load::default(); system.bodies().len()];
        Self { system, loads, h }
    }

    /// What is to be added to the energy.
    pub(crate) fn excess(&mut self, states: &[BodyState]) -> f64 {
        // Of the derivative of V, whose error is then as small as that of its rounding.
        let dt = 1e-4;
        let ends = [dt, -dt].map(|dt| self.coasted(states, dt));
        let [late, early] = ends.map(|states| self.rate(&states));
        let mut excess = (late - early) / (24.0 * dt);
        self.system.loads(states, &mut self.loads);
        let bodies = self.system.bodies().iter();
        for ((body, state), load) in bodies.zip(states).zip(&self.loads) {
            let inverse = body.inertia().inverse();
            let kick =
                load.force.norm_squared() / body.mass() + load.moment.dot(&(inverse * load.moment));
            let e_1 = inverse.trace();
            let e_2 = 0.5 * (e_1 * e_1 - inverse.norm_squared());
            let t = 0.5 * state.angular_momentum.dot(&state.angular_velocity(body));
            let c = 0.5 * state.angular_momentum.norm_squared();
            excess += (e_1 * t * t - e_2 * t * c + inverse.determinant() * c * c) / 6.0;
            excess -= kick / 24.0;
        }
        self.h * self.h * excess
    }

    /// The derivative of the potential on the way.
    fn rate(&mut self, states: &[BodyState]) -> f64 {
        self.system.loads(states, &mut self.loads);
        let bodies = self.system.bodies().iter();
        let powers = bodies
            .zip(states)
            .zip(&self.loads)
            .map(|((body, state), load)| {
                load.force.dot(&state.velocity(body))
                    + load.moment.dot(&state.angular_velocity(body))
            });
        -powers.sum::<f64>()
    }

    fn coasted(&self, states: &[BodyState], t: f64) -> Vec<BodyState> {
        let bodies = self.system.bodies().iter();
        let coasted = bodies.zip(states).map(|(body, state)| {
            let flow = FreeRotation::new(body.inertia());
            let (turn, angular_momentum) = flow.flow(&state.angular_momentum, t);
            BodyState {
                position: state.position + t * state.velocity(body),
                attitude: state.attitude * turn.matrix(),
                angular_momentum,
                ..*state
            }
        });
        coasted.collect()
    }
}
