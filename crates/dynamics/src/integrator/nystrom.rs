use super::coefficients::{Nystrom, RKN_A19, SRKN_6B, SRKN_14A};
use super::{MethodError, Rotor, Splitting};
use crate::RigidBody;

const NYSTROM: [&Nystrom; 3] = [&SRKN_6B, &SRKN_14A, &RKN_A19];

impl Splitting {
    /// A Runge–Kutta–Nyström splitting of `order` 4 or 6 (6 and 14 evaluations of gravity a step, Blanes and Moan 2002)
    /// or 8 (19 evaluations, Blanes, Casas and Escorihuela-Tomàs 2022): symplectic, time-reversible, momenta exact.
    ///
    /// # Assumptions and limitations
    /// They are of their order only over a drift that is the exact free motion, at least to that order: over the discrete
    /// rigid body they would fall to order 2, which is refused.
    pub fn nystrom(order: u32, rotor: Rotor, bodies: &[RigidBody]) -> Result<Self, MethodError> {
        let refuse = |parameter, value: u32, expected| MethodError::Parameter {
            method: "the Nyström splitting",
            parameter,
            value: value.into(),
            expected,
        };
        let known = NYSTROM.into_iter().find(|known| known.order == order);
        let nystrom = known.ok_or_else(|| refuse("order", order, "4, 6 or 8"))?;
        if rotor.order() < order {
            let expected = "a rotor of at least the splitting's order, such as the exact one";
            return Err(refuse("order of the rotor", rotor.order(), expected));
        }
        let scheme = nystrom.scheme();
        Ok(Self::new(&scheme.kicks, &scheme.drifts, rotor, bodies))
    }
}
