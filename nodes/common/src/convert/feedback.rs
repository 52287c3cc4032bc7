use lgvi_dynamics::{BodyState, Load};
use lgvi_msgs::msg::{self, ControlLimits};
use lgvi_msgs::shm::Name;
use lgvi_scene::Units;
use nalgebra::{SMatrix, Vector3};

use super::body_sample;

/// The number of deviations of a state, which are the columns of a gain.
pub const DEVIATIONS: usize = 12;

/// Rows and columns of a gain.
const SIZE: (usize, usize) = (6, DEVIATIONS);

/// Elements of a gain.
pub const GAIN: usize = SIZE.0 * SIZE.1;

/// `K`: by rows force (inertial) and moment (body), by columns the deviation `δz = [x − x*, γ − γ*, log(R*ᵀR), Π − Π*]`.
pub type Gain = SMatrix<f64, { SIZE.0 }, { SIZE.1 }>;

/// What corrects the control of one interval, `u = u* − K δz`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction {
    /// The state that belongs to `u*` at the start of the interval.
    pub reference: BodyState,
    /// `K`.
    pub gain: Gain,
}

/// Bounds of a control in the scene's units: each component in magnitude, and the norms. Infinity is no bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Of the force's components, inertial frame.
    pub force: Vector3<f64>,
    /// Of the moment's components, body frame.
    pub moment: Vector3<f64>,
    /// Of the force's norm.
    pub force_norm: f64,
    /// Of the moment's norm.
    pub moment_norm: f64,
}

impl Limits {
    /// No bounds.
    pub const NONE: Self = Self {
        force: Vector3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        moment: Vector3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        force_norm: f64::INFINITY,
        moment_norm: f64::INFINITY,
    };

    /// The limits of a message.
    pub fn from_si(limits: &ControlLimits, units: &Units) -> Self {
        Self {
            force: Vector3::from(limits.force) / units.force(),
            moment: Vector3::from(limits.moment) / units.energy(),
            force_norm: limits.force_norm / units.force(),
            moment_norm: limits.moment_norm / units.energy(),
        }
    }

    /// Their message.
    pub fn to_si(&self, units: &Units) -> ControlLimits {
        ControlLimits {
            force: (self.force * units.force()).into(),
            moment: (self.moment * units.energy()).into(),
            force_norm: self.force_norm * units.force(),
            moment_norm: self.moment_norm * units.energy(),
        }
    }

    /// The load held within them: components cut, then force and moment scaled to their norms. What is within them stays
    /// the same to the last bit; what is no number stays none.
    pub fn hold(&self, load: &Load) -> Load {
        Load {
            force: hold(&load.force, &self.force, self.force_norm),
            moment: hold(&load.moment, &self.moment, self.moment_norm),
        }
    }
}

fn hold(vector: &Vector3<f64>, components: &Vector3<f64>, norm: f64) -> Vector3<f64> {
    let cut = vector.zip_map(components, |value, limit| {
        if value.abs() > limit {
            limit.copysign(value)
        } else {
            value
        }
    });
    if cut.norm() > norm {
        // By the largest component first, so that no square overflows.
        let direction = cut / cut.amax();
        direction * (norm / direction.norm())
    } else {
        cut
    }
}

/// The gain of an interval's part of a message, by rows.
pub fn gain_from_si(gain: &[f64; GAIN], units: &Units) -> Gain {
    Gain::from_row_slice(gain).component_div(&gain_units(units))
}

/// The message of the reference state of the body `name`.
pub(super) fn reference(name: &str, state: &BodyState, units: &Units) -> msg::BodyState {
    msg::BodyState {
        name: name.to_owned(),
        ..msg::BodyState::from(&body_sample(Name::default(), state, units))
    }
}

/// The numbers of a gain's message, by rows.
pub fn gain_si(gain: &Gain, units: &Units) -> [f64; GAIN] {
    let gain = gain.component_mul(&gain_units(units)).transpose();
    std::array::from_fn(|index| gain[index])
}

/// The SI size of a gain of 1 in the scene's units, element by element.
fn gain_units(units: &Units) -> Gain {
    let rows = [units.force(), units.energy()].map(|unit| row_units(unit, units));
    Gain::from_fn(|row, column| rows[row / 3][column])
}

/// The SI sizes of the elements of a row of gains that are 1 in the scene's units, where that of what the row commands is `effort`.
pub fn row_units(effort: f64, units: &Units) -> [f64; DEVIATIONS] {
    let columns = [
        units.length,
        units.momentum(),
        1.0,
        units.angular_momentum(),
    ];
    std::array::from_fn(|column| effort / columns[column / 3])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn held(force: [f64; 3], limits: Limits) -> Vector3<f64> {
        let force = force.into();
        let moment = Vector3::zeros();
        limits.hold(&Load { force, moment }).force
    }

    /// Lengths of 0.5 √2 of axes that are equal, whatever the size of what is cut.
    #[test]
    fn a_control_of_any_size_is_held_to_the_bound_of_its_norm() {
        let limits = Limits {
            force_norm: 0.5,
            ..Limits::NONE
        };
        for size in [1.0, 1e100, 1e200, 1e308] {
            let force = held([size, -size, 0.0], limits);
            let expected = 0.5 * Vector3::new(0.5_f64.sqrt(), -0.5_f64.sqrt(), 0.0);
            assert!((force - expected).norm() < 1e-15, "{size}: {force}");
        }
        let within = [0.1, 0.2, -0.4];
        assert_eq!(held(within, limits), Vector3::from(within));
        assert_eq!(held([1e308; 3], Limits::NONE), Vector3::from([1e308; 3]));
    }

    #[test]
    fn what_is_infinite_is_cut_by_components_and_is_no_number_by_norm() {
        let force = [f64::INFINITY, f64::NEG_INFINITY, 1.0];
        let components = Limits {
            force: Vector3::from_element(2.0),
            ..Limits::NONE
        };
        assert_eq!(held(force, components), Vector3::new(2.0, -2.0, 1.0));
        let norm = Limits {
            force_norm: 2.0,
            ..Limits::NONE
        };
        assert!(held(force, norm).x.is_nan());
        let unknown = [f64::NAN, 0.0, 0.0];
        assert!(held(unknown, components).x.is_nan());
        assert!(held(unknown, norm).x.is_nan());
    }
}
