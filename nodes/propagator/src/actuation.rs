//! Commands of a body's actuators in a control sequence.

use lgvi_scene::Scene;
use thiserror::Error;

use crate::effort::Actuators;

/// The efforts of the wheels or thrusters of a body, in the scene's units.
#[derive(Clone, Debug, PartialEq)]
pub struct Actuation {
    pub(crate) actuators: Actuators,
    /// By rows an interval.
    efforts: Vec<f64>,
    /// Actuators in a row, ≥ 1.
    count: usize,
}

/// Why the numbers of a sequence without forces are no commands.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ActuationError {
    /// They do not fit the body's actuators.
    #[error(
        "`feedback` has {found} numbers without forces, expected in each interval one for each of the {wheels} wheels and \
         {thrusters} thrusters of {body:?}"
    )]
    Count {
        /// Numbers in the sequence.
        found: usize,
        /// Wheels of the body.
        wheels: usize,
        /// Thrusters of the body.
        thrusters: usize,
        /// The body.
        body: String,
    },
    /// A number that is infinite, or that commands both wheels and thrusters, or not all of them.
    #[error(
        "`feedback[{index}]` is {value} without forces, expected finite numbers for the wheels or for the thrusters, and NaN for \
         the others"
    )]
    Number {
        /// Index of the number.
        index: usize,
        /// What it says.
        value: f64,
    },
}

impl Actuation {
    /// Checks the numbers of a message for a body.
    pub(crate) fn check(scene: &Scene, body: usize, given: &[f64]) -> Result<Self, ActuationError> {
        let named = &scene.bodies[body];
        let [wheels, thrusters] = [named.wheels.len(), named.thrusters.len()];
        let (found, length) = (given.len(), wheels + thrusters);
        if length == 0 || found == 0 || !found.is_multiple_of(length) {
            return Err(ActuationError::Count {
                found,
                wheels,
                thrusters,
                body: named.name.clone(),
            });
        }
        let of_wheels = wheels > 0 && !given[0].is_nan();
        let (actuators, own) = match of_wheels {
            true => (Actuators::Wheels, 0..wheels),
            false => (Actuators::Thrusters, wheels..length),
        };
        let mut efforts = Vec::with_capacity(found / length * own.len());
        for (index, &value) in given.iter().enumerate() {
            let effort = value / actuators.unit(scene);
            let is_own = own.contains(&(index % length));
            if is_own && effort.is_finite() {
                efforts.push(effort);
            } else if is_own || !value.is_nan() {
                return Err(ActuationError::Number { index, value });
            }
        }
        Ok(Self {
            actuators,
            efforts,
            count: own.len().max(1),
        })
    }

    /// The memory that it takes (byte).
    pub(crate) fn size(&self) -> usize {
        size_of_val(self.efforts.as_slice())
    }

    /// Number of intervals.
    pub(crate) fn rows(&self) -> usize {
        self.efforts.len() / self.count
    }

    /// The efforts of an interval; empty after the last.
    pub(crate) fn row(&self, interval: usize) -> &[f64] {
        let first = interval.saturating_mul(self.count);
        let row = first..first.saturating_add(self.count);
        self.efforts.get(row).unwrap_or_default()
    }
}
