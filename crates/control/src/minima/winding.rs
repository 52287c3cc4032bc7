use lgvi_lie::log;
use nalgebra::Vector3;

use crate::Plan;

/// How a plan turns the body from one attitude to the other: what tells local minima apart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Winding {
    /// `∫ Ω dt` (rad), body frame: the rotation vectors of the steps, added.
    pub rotation: Vector3<f64>,
    /// `∫ |Ω| dt` (rad)
    pub angle: f64,
}

impl Plan {
    /// How it turns the body.
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
