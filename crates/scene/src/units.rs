use lgvi_dynamics::{BodyState, Load};

use crate::{SceneError, suggestion};

/// The SI sizes of a scene's units, with conversions of its inputs and outputs. A factor of 1 is exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// Length unit (m).
    pub length: f64,
    /// Mass unit (kg).
    pub mass: f64,
    /// Time unit (s).
    pub time: f64,
}

/// A physical quantity, with the accepted symbols of units and their SI sizes.
struct Quantity {
    key: &'static str,
    symbols: &'static [(&'static str, f64)],
}

const LENGTH: Quantity = Quantity {
    key: "units.length",
    symbols: &[("m", 1.0), ("km", 1e3), ("au", 149_597_870_700.0)],
};
const MASS: Quantity = Quantity {
    key: "units.mass",
    symbols: &[("kg", 1.0), ("g", 1e-3), ("t", 1e3)],
};
const TIME: Quantity = Quantity {
    key: "units.time",
    symbols: &[("s", 1.0), ("min", 60.0), ("h", 3600.0), ("d", 86400.0)],
};

impl Quantity {
    /// Returns the SI size of a text such as `7000 km`.
    fn parse(&self, text: &str) -> Result<f64, SceneError> {
        let refuse = || {
            let symbols: Vec<_> = self.symbols.iter().map(|(symbol, _)| *symbol).collect();
            let symbol = text.trim().rsplit(char::is_whitespace).next();
            let expected = format!(
                "a number > 0 and a unit, such as \"7 {}\": {}",
                symbols[0],
                suggestion::one_of(symbol.unwrap_or_default(), &symbols)
            );
            SceneError::value(self.key, text, expected)
        };
        let (number, symbol) = text
            .trim()
            .split_once(char::is_whitespace)
            .ok_or_else(refuse)?;
        let number: f64 = number.parse().map_err(|_| refuse())?;
        let unit = self
            .symbols
            .iter()
            .find(|(known, _)| *known == symbol.trim());
        let (_, size) = unit.ok_or_else(refuse)?;
        let product = number * size;
        if product.is_normal() && product > 0.0 {
            Ok(product)
        } else {
            Err(refuse())
        }
    }
}

impl Units {
    pub(crate) fn parse(length: &str, mass: &str, time: &str) -> Result<Self, SceneError> {
        Ok(Self {
            length: LENGTH.parse(length)?,
            mass: MASS.parse(mass)?,
            time: TIME.parse(time)?,
        })
    }

    /// Returns the unit of momentum (kg m/s).
    pub fn momentum(&self) -> f64 {
        self.mass * self.length / self.time
    }

    /// Returns the unit of angular momentum (kg m²/s).
    pub fn angular_momentum(&self) -> f64 {
        self.momentum() * self.length
    }

    /// Returns the unit of energy (J), which is also that of moments (N m).
    pub fn energy(&self) -> f64 {
        self.momentum() * self.length / self.time
    }

    /// Returns the unit of force (N).
    pub fn force(&self) -> f64 {
        self.momentum() / self.time
    }

    /// Converts a state to SI.
    pub fn state_to_si(&self, state: &BodyState) -> BodyState {
        BodyState {
            position: state.position * self.length,
            linear_momentum: state.linear_momentum * self.momentum(),
            attitude: state.attitude,
            angular_momentum: state.angular_momentum * self.angular_momentum(),
        }
    }

    /// Converts a load to SI.
    pub fn load_to_si(&self, load: &Load) -> Load {
        Load {
            force: load.force * self.force(),
            moment: load.moment * self.energy(),
        }
    }

    /// Converts a load from SI.
    pub fn load_from_si(&self, load: &Load) -> Load {
        Load {
            force: load.force / self.force(),
            moment: load.moment / self.energy(),
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};

    use super::*;

    #[test]
    fn units_are_numbers_with_symbols() {
        let units = Units::parse("7000 km", "0.5 t", "2 min").unwrap();
        assert_eq!(
            units,
            Units {
                length: 7e6,
                mass: 500.0,
                time: 120.0
            }
        );
        for (wrong, key) in [
            (Units::parse("3 parsec", "1 kg", "1 s"), "units.length"),
            (Units::parse("1 m", "1 m", "1 s"), "units.mass"),
            (Units::parse("1 m", "1 kg", "-1 s"), "units.time"),
            (Units::parse("m", "1 kg", "1 s"), "units.length"),
            (Units::parse("nan m", "1 kg", "1 s"), "units.length"),
            (Units::parse("inf m", "1 kg", "1 s"), "units.length"),
        ] {
            match wrong {
                Err(SceneError::Value {
                    key: found,
                    expected,
                    ..
                }) => {
                    assert_eq!(found, key);
                    assert!(expected.contains("one of"), "{expected}");
                }
                other => panic!("{other:?}"),
            }
        }
    }

    /// Work is force times length and energy is momentum squared over mass, in any units.
    #[test]
    fn conversions_are_consistent_with_each_other() {
        let units = Units {
            length: 7e6,
            mass: 500.0,
            time: 120.0,
        };
        let state = BodyState {
            position: Vector3::new(1.0, 2.0, 3.0),
            linear_momentum: Vector3::new(0.3, -0.1, 0.2),
            attitude: Matrix3::identity(),
            angular_momentum: Vector3::new(3.0, 2.0, 1.0),
        };
        let si = units.state_to_si(&state);
        let kinetic = 0.5 * state.linear_momentum.norm_squared() / 2.0;
        let kinetic_si = 0.5 * si.linear_momentum.norm_squared() / (2.0 * units.mass);
        assert!((kinetic_si / (kinetic * units.energy()) - 1.0).abs() < 1e-15);
        let orbital_si = si.position.cross(&si.linear_momentum);
        let orbital = state.position.cross(&state.linear_momentum) * units.angular_momentum();
        assert!((orbital_si - orbital).norm() < 1e-14 * orbital.norm());

        let load = Load {
            force: Vector3::new(1.0, 0.0, 2.0),
            moment: Vector3::new(0.0, 3.0, 1.0),
        };
        let load_si = units.load_to_si(&load);
        let impulse = units.force() * units.time;
        assert!((impulse / units.momentum() - 1.0).abs() < 1e-15);
        let back = units.load_from_si(&load_si);
        assert!(
            (back.force - load.force).norm() < 1e-15 && (back.moment - load.moment).norm() < 1e-15
        );
    }
}
