//! The effect of commands that actuators cannot follow, given to the other actuators.

use lgvi_dynamics::thrusters::Thrusters;
use lgvi_dynamics::wheels::Wheels;

use super::actuation::{Effects, Weight, pseudo_inverse};
use super::{Actuation, ActuationError, Command};

/// Thrusters or wheels with their limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Allocation {
    /// `B`
    matrix: Effects,
    /// The least and the largest command of each; both are 0 beyond the last.
    limits: [Command; 2],
}

impl Allocation {
    /// That of thrusters, which do not pull.
    ///
    /// # Errors
    /// Returns an error if their number is not 1 to [`MAX_COMMANDS`](crate::MAX_COMMANDS).
    pub fn of_thrusters(thrusters: &Thrusters) -> Result<Self, ActuationError> {
        let limits = thrusters.thrusters().iter().map(|one| [0.0, one.thrust]);
        let weights = vec![1.0; limits.len()];
        let actuation = Actuation::thrusters(thrusters, &weights)?;
        Ok(Self::new(&actuation, limits))
    }

    /// That of wheels.
    ///
    /// # Errors
    /// Returns an error if their number is not 1 to [`MAX_COMMANDS`](crate::MAX_COMMANDS).
    pub fn of_wheels(wheels: &Wheels) -> Result<Self, ActuationError> {
        let limits = wheels.wheels().iter();
        let limits = limits.map(|one| [-one.max_torque, one.max_torque]);
        let weights = vec![1.0; limits.len()];
        let actuation = Actuation::wheels(wheels, &weights)?;
        Ok(Self::new(&actuation, limits))
    }

    /// That of the commands of an actuation, each from a least to a largest.
    pub fn new(actuation: &Actuation, limits: impl Iterator<Item = [f64; 2]>) -> Self {
        let mut bounds = [Command::zeros(); 2];
        for (command, [least, most]) in limits.enumerate().take(actuation.commands()) {
            (bounds[0][command], bounds[1][command]) = (least, most);
        }
        Self {
            matrix: *actuation.matrix(),
            limits: bounds,
        }
    }

    /// Commands within the limits, whose force and moment are those of `wanted` if the actuators that do not reach their limits can
    /// exert what is left: the cascaded generalized inverse (K. A. Bordignon, *Constrained control allocation for systems with
    /// redundant control effectors*, Virginia Polytechnic Institute, 1996). Actuators that are `off` take nothing over.
    pub fn within_limits(&self, wanted: &Command, off: impl Fn(usize) -> bool) -> Command {
        let [least, most] = &self.limits;
        let hold = |command: f64, least: f64, most: f64| match command {
            command if command.is_nan() => 0.0,
            command => command.max(least).min(most),
        };
        let mut held = wanted.zip_zip_map(least, most, hold);
        let mut free = Command::from_fn(|command, _| {
            f64::from(u8::from(least[command] < most[command] && !off(command)))
        });
        // Each round has at least one free actuator fewer.
        for _ in 0..wanted.len() {
            let rest = self.matrix * (wanted - held);
            let is_exerted = rest.iter().all(|component| *component == 0.0);
            if is_exerted || free.amax() == 0.0 || !rest.iter().all(|c| c.is_finite()) {
                break;
            }
            let columns = self.matrix * Weight::from_diagonal(&free);
            let next = held + pseudo_inverse(&columns, &Weight::identity()) * rest;
            held = next.zip_zip_map(least, most, hold);
            let mut reached = false;
            for (command, free) in free.iter_mut().enumerate() {
                if held[command] != next[command] {
                    (*free, reached) = (0.0, true);
                }
            }
            if !reached {
                break;
            }
        }
        held
    }
}

#[cfg(test)]
mod tests {
    use lgvi_dynamics::thrusters::{Propellant, Thruster};
    use nalgebra::Vector3;

    use super::*;

    fn pairs() -> Allocation {
        let mut all = Vec::new();
        for axis in 0..3 {
            for side in [1.0, -1.0] {
                let arm = side * Vector3::ith((axis + 1) % 3, 0.8);
                for sign in [1.0, -1.0] {
                    all.push(Thruster::new(arm, sign * Vector3::ith(axis, 1.0), 2.0));
                }
            }
        }
        let none = Propellant {
            mass: 0.0,
            inertia: None,
        };
        Allocation::of_thrusters(&Thrusters::new(all, none).unwrap()).unwrap()
    }

    /// Of each pair one thruster takes over what its opposite cannot do; a pair exerts at most ± 2.
    #[test]
    fn opposite_thrusters_take_over_what_would_be_a_pull() {
        let allocation = pairs();
        let mut rng = fastrand::Rng::with_seed(5);
        for round in 0..200 {
            let size = if round % 2 == 0 { 0.9 } else { 3.0 };
            let mut wanted = Command::zeros();
            for command in 0..12 {
                wanted[command] = size * (2.0 * rng.f64() - 1.0);
            }
            let found = allocation.within_limits(&wanted, |_| false);
            assert!(found.min() >= 0.0 && found.max() <= 2.0, "{found}");
            let apart = allocation.matrix * (found - wanted);
            if size < 1.0 {
                assert!(apart.amax() < 1e-12, "{apart}");
            }
            let inside = found.map(|command| 0.5 * command);
            assert_eq!(allocation.within_limits(&inside, |_| false), inside);
        }
    }

    #[test]
    fn commands_of_any_size_are_held() {
        let allocation = pairs();
        for size in [1e308, -1e308, f64::INFINITY, f64::NAN] {
            let mut wanted = Command::zeros();
            wanted[0] = size;
            wanted[3] = -1.0;
            let found = allocation.within_limits(&wanted, |_| false);
            let held = found.iter().all(|command| (0.0..=2.0).contains(command));
            assert!(held, "{size}: {found}");
        }
    }

    #[test]
    fn what_is_off_takes_nothing_over() {
        let allocation = pairs();
        let mut wanted = Command::zeros();
        wanted[1] = -0.5;
        let found = allocation.within_limits(&wanted, |command| command == 0);
        assert_eq!(found[0], 0.0);
        let apart = allocation.matrix * (found - wanted);
        assert!(apart.norm() > 0.1, "{apart}");
    }
}
