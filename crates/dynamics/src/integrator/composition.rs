use super::coefficients::{
    Composition, SOFRONIOU_SPALETTA_6, SOFRONIOU_SPALETTA_8, SOFRONIOU_SPALETTA_10, SUZUKI_4,
};
use super::{MethodError, Rotor, Splitting};
use crate::RigidBody;

const COMPOSITIONS: [&Composition; 4] = [
    &SUZUKI_4,
    &SOFRONIOU_SPALETTA_6,
    &SOFRONIOU_SPALETTA_8,
    &SOFRONIOU_SPALETTA_10,
];

impl Splitting {
    /// A symmetric composition of LGVI steps of different lengths, of `order` 4 (5 steps, Suzuki 1990), 6, 8 or 10 (13,
    /// 21, 35 steps, Sofroniou and Spaletta 2005). Like the LGVI step itself, it is symplectic and time-reversible and
    /// conserves momenta exactly.
    ///
    /// Some of the steps go backwards in time. Any rotor can be used.
    pub fn composition(
        order: u32,
        rotor: Rotor,
        bodies: &[RigidBody],
    ) -> Result<Self, MethodError> {
        let known = COMPOSITIONS.into_iter().find(|known| known.order == order);
        let composition = known.ok_or(MethodError::Parameter {
            method: "the composition",
            parameter: "order",
            value: order.into(),
            expected: "4, 6, 8 or 10",
        })?;
        let scheme = composition.scheme();
        Ok(Self::new(&scheme.kicks, &scheme.drifts, rotor, bodies))
    }
}
