use lgvi_lie::log;
use nalgebra::Vector3;

use crate::Plan;

/// The winding of the attitude of a plan, which distinguishes local minima.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Winding {
    /// `∫ Ω dt` (rad) in the body frame: the sum of the rotation vectors of the steps.
    pub rotation: Vector3<f64>,
    /// `∫ |Ω| dt` (rad)
    pub angle: f64,
}

impl Plan {
    /// The winding of the attitude.
    pub fn winding(&self) -> Winding {
        let mut winding = Winding::default();
        for pair in self.states.windows(2) {
            let turn = log(&pair[0].attitude.tr_mul(&pair[1].attitude));
            winding.rotation += turn;
            winding.angle += turn.norm();
        }
        winding
    }
}
