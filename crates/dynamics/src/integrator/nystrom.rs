use super::coefficients::{Nystrom, RKN_A19, SRKN_6B, SRKN_14A};
use super::{MethodError, Rotor, Splitting};
use crate::RigidBody;

const NYSTROM: [&Nystrom; 3] = [&SRKN_6B, &SRKN_14A, &RKN_A19];

impl Splitting {
    /// A Runge–Kutta–Nyström splitting of `order` 4 or 6 (6 and 14 gravity evaluations per step, Blanes and Moan 2002)
    /// or 8 (19 evaluations, Blanes, Casas and Escorihuela-Tomàs 2022). It is symplectic and time-reversible and
    /// conserves momenta exactly.
    ///
    /// These splittings have their order only if the drift is the exact free motion, so bodies rotate by the exact
    /// rotor.
    pub fn nystrom(order: u32, bodies: &[RigidBody]) -> Result<Self, MethodError> {
        let known = NYSTROM.into_iter().find(|known| known.order == order);
        let nystrom = known.ok_or(MethodError::Parameter {
            method: "the Nyström splitting",
            parameter: "order",
            value: order.into(),
            expected: "4, 6 or 8",
        })?;
        let scheme = nystrom.scheme();
        Ok(Self::new(
            &scheme.kicks,
            &scheme.drifts,
            Rotor::Exact,
            bodies,
        ))
    }
}
