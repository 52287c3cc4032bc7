//! Reaction wheels: rotors whose motors exchange angular momentum with the body that carries them.
//!
//! A wheel turns about an axis `a` fixed in the body, with inertia `I` about it and speed `ω` relative to the body. Its
//! axial angular momentum `h = I (a·Ω + ω)` changes by the torque `u` of its motor and bearing alone, `ḣ = u`, and the
//! body receives `−a u`. With the angular momentum `Π = J Ω` of the rest, where `J` is the inertia without `Σ I a aᵀ`, the
//! motion is `Π̇ = (Π + s) × Ω + M − Σ a u` with `s = Σ a h` (P. C. Hughes, *Spacecraft Attitude Dynamics*, 1986, ch. 6).
//! The total angular momentum `R (Π + s)` is conserved without external moments.
//!
//! The angles of the wheels are cyclic. In the discrete mechanics with wheels, `h` is therefore constant within a step,
//! and a torque that is held over the step acts as half an impulse at each end, on the wheel and on the body at once. The
//! rotation between them is that of a body with constant stored momentum, see [`crate::rotation`].

use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

/// A reaction wheel, balanced and symmetric about its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReactionWheel {
    /// Axis `a`, body frame; normalized by [`Wheels::new`].
    pub axis: Vector3<f64>,
    /// Inertia `I` about the axis, 1e-100 to 1e100.
    pub inertia: f64,
    /// Largest torque of the motor, > 0, or infinity.
    pub max_torque: f64,
    /// Speed above which the motor does not accelerate the wheel, > 0, or infinity.
    pub max_speed: f64,
    /// Viscous friction `d ≥ 0`: the bearing's torque is `−d ω`. Steps backwards in time do not retrace friction.
    pub viscous_friction: f64,
    /// Coulomb friction `c ≥ 0`: the bearing's torque is `−c sign ω`, and at rest whatever keeps the wheel at rest up to
    /// `c`.
    pub coulomb_friction: f64,
}

/// Reasons why numbers do not describe reaction wheels. Wheels are counted from 0.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum WheelError {
    /// A wheel has no axis.
    #[error(
        "the axis of wheel {wheel} is {axis:?}, expected three finite numbers that are not all 0"
    )]
    Axis {
        /// Index of the wheel.
        wheel: usize,
        /// Its axis.
        axis: [f64; 3],
    },
    /// A number is out of its range.
    #[error("{quantity} of wheel {wheel} is {value}, expected {expected}")]
    Quantity {
        /// Index of the wheel.
        wheel: usize,
        /// Name of the quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Description of valid values.
        expected: &'static str,
    },
}

/// The reaction wheels of a body, with their momenta.
#[derive(Clone, Debug, PartialEq)]
pub struct Wheels {
    wheels: Vec<ReactionWheel>,
    states: Vec<WheelState>,
    /// Torques of the motors that are asked for.
    commands: Vec<f64>,
    /// Factors between the torques that motors exert and those that they are asked for.
    factors: Vec<f64>,
}

/// The state of a wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WheelState {
    /// Axial angular momentum `h`.
    pub momentum: f64,
    /// Angle relative to the body, the integral of the speed since the start.
    pub angle: f64,
    /// Torque `u` on the wheel in the last step: that of the motor and of friction.
    pub torque: f64,
}

impl ReactionWheel {
    /// A wheel without limits and friction.
    pub fn new(axis: Vector3<f64>, inertia: f64) -> Self {
        Self {
            axis,
            inertia,
            max_torque: f64::INFINITY,
            max_speed: f64::INFINITY,
            viscous_friction: 0.0,
            coulomb_friction: 0.0,
        }
    }

    fn check(&self, wheel: usize) -> Result<(), WheelError> {
        let (positive, least) = ("a number > 0", "a finite number ≥ 0");
        for (quantity, value, valid, expected) in [
            (
                "the inertia",
                self.inertia,
                (1e-100..=1e100).contains(&self.inertia),
                "1e-100 to 1e100",
            ),
            (
                "the largest torque",
                self.max_torque,
                self.max_torque > 0.0,
                positive,
            ),
            (
                "the largest speed",
                self.max_speed,
                self.max_speed > 0.0,
                positive,
            ),
            (
                "the viscous friction",
                self.viscous_friction,
                self.viscous_friction.is_finite() && self.viscous_friction >= 0.0,
                least,
            ),
            (
                "the Coulomb friction",
                self.coulomb_friction,
                self.coulomb_friction.is_finite() && self.coulomb_friction >= 0.0,
                least,
            ),
        ] {
            if !valid {
                return Err(WheelError::Quantity {
                    wheel,
                    quantity,
                    value,
                    expected,
                });
            }
        }
        Ok(())
    }

    /// Returns the change of the wheel's relative speed by a unit of torque in a unit of time, `1/I + a·J⁻¹a`, on a body whose inertia
    /// has the given inverse, body frame.
    pub fn per_torque(&self, inverse: &Matrix3<f64>) -> f64 {
        self.inertia.recip() + self.axis.dot(&(inverse * self.axis))
    }

    /// The torque on a wheel of speed `ω` over a step of length `h`, for a torque that its motor exerts: the mean of the motor
    /// and the bearing. The torque changes the relative speed by `per_torque` in a unit of time. Viscous friction
    /// is that of the mean speed. Coulomb friction stops the wheel but does not reverse it.
    fn torque(&self, command: f64, speed: f64, per_torque: f64, h: f64) -> f64 {
        let per_inertia = h * per_torque;
        let viscous = 0.5 * per_inertia * self.viscous_friction;
        let mut next = ((1.0 - viscous) * speed + per_inertia * command) / (1.0 + viscous);
        let grip = per_inertia.abs() * self.coulomb_friction;
        next = if next.abs() <= grip {
            0.0
        } else {
            next - grip.copysign(next)
        };
        let bound = self.max_speed.max(speed.abs());
        let is_free = self.viscous_friction == 0.0 && self.coulomb_friction == 0.0;
        if is_free && next.abs() <= bound {
            return command;
        }
        (next.clamp(-bound, bound) - speed) / per_inertia
    }
}

impl Wheels {
    /// Creates the wheels of a body, without momentum.
    ///
    /// # Errors
    /// Returns an error if a number is out of the range that [`ReactionWheel`] states.
    pub fn new(mut wheels: Vec<ReactionWheel>) -> Result<Self, WheelError> {
        for (index, wheel) in wheels.iter_mut().enumerate() {
            wheel.check(index)?;
            let given = wheel.axis;
            let largest = given.amax();
            wheel.axis = (given / largest).normalize();
            if !(given.iter().all(|c| c.is_finite()) && largest > 0.0) {
                return Err(WheelError::Axis {
                    wheel: index,
                    axis: given.into(),
                });
            }
        }
        Ok(Self {
            states: vec![WheelState::default(); wheels.len()],
            commands: vec![0.0; wheels.len()],
            factors: vec![1.0; wheels.len()],
            wheels,
        })
    }

    /// The wheels.
    pub fn wheels(&self) -> &[ReactionWheel] {
        &self.wheels
    }

    /// The states of the wheels, one per wheel.
    pub fn states(&self) -> &[WheelState] {
        &self.states
    }

    /// Sets the states of the wheels, one per wheel.
    pub fn set_states(&mut self, states: &[WheelState]) {
        self.states.copy_from_slice(states);
    }

    /// Sets the momenta to those of the speeds `ω` (one per wheel) relative to a body with angular velocity `Ω`, body
    /// frame.
    pub fn set_speeds(&mut self, speeds: &[f64], angular_velocity: &Vector3<f64>) {
        for ((wheel, state), speed) in self.wheels.iter().zip(&mut self.states).zip(speeds) {
            state.momentum = wheel.inertia * (wheel.axis.dot(angular_velocity) + speed);
        }
    }

    /// Sets the torques that the motors are asked for from the next step on, one per wheel.
    pub fn set_commands(&mut self, torques: &[f64]) {
        self.commands.copy_from_slice(torques);
    }

    /// Sets the factors by which motors exert other torques than they are asked for, one per wheel.
    pub fn set_factors(&mut self, factors: &[f64]) {
        self.factors.copy_from_slice(factors);
    }

    /// The speed `ω` of a wheel relative to a body with angular velocity `Ω`, body frame.
    pub fn speed(&self, wheel: usize, angular_velocity: &Vector3<f64>) -> f64 {
        let ReactionWheel { axis, inertia, .. } = &self.wheels[wheel];
        self.states[wheel].momentum / inertia - axis.dot(angular_velocity)
    }

    /// `s = Σ a h`, the angular momentum that the wheels store, body frame.
    pub fn momentum(&self) -> Vector3<f64> {
        let each = self.wheels.iter().zip(&self.states);
        each.map(|(wheel, state)| state.momentum * wheel.axis).sum()
    }

    /// Returns the first wheel that the torques asked for would take past the limit of its speed over a step of length `h`
    /// that begins with this angular velocity, and the speed there. The inertia of the body has the given inverse. All in
    /// the body frame.
    pub fn overspeed(
        &self,
        angular_velocity: &Vector3<f64>,
        inverse: &Matrix3<f64>,
        h: f64,
    ) -> Option<(usize, f64)> {
        let reached = |index: usize| {
            let wheel = &self.wheels[index];
            let speed = self.speed(index, angular_velocity);
            let next = speed + h * wheel.per_torque(inverse) * self.commands[index];
            (next.abs() > wheel.max_speed.max(speed.abs())).then_some((index, next))
        };
        (0..self.wheels.len()).find_map(reached)
    }

    /// `Σ h²/(2I)`, the kinetic energy of the wheels' axial rotation.
    pub fn energy(&self) -> f64 {
        let each = self.wheels.iter().zip(&self.states);
        each.map(|(wheel, state)| 0.5 * state.momentum * (state.momentum / wheel.inertia))
            .sum()
    }

    /// Returns true if a bearing has friction.
    pub fn have_friction(&self) -> bool {
        let mut wheels = self.wheels.iter();
        wheels.any(|wheel| wheel.viscous_friction > 0.0 || wheel.coulomb_friction > 0.0)
    }

    /// `Σ I a aᵀ`, which the inertia of a body with its wheels locked has more than the rest of it.
    pub(crate) fn axial_inertia(&self) -> Matrix3<f64> {
        let each = self.wheels.iter();
        each.map(|wheel| wheel.inertia * wheel.axis * wheel.axis.transpose())
            .sum()
    }

    /// Finds the torques over a step of length `h` that begins with this angular velocity, and makes their first half of the
    /// change of the momenta. Returns the impulse that the body receives at once, whose inertia has the given inverse. All
    /// in the body frame.
    ///
    /// # Assumptions and limitations
    /// Friction and the limit of speed take the body's reaction to the wheel's own torque into account, but neither the
    /// torques of other wheels nor the other changes of the body's rate within the step.
    pub(crate) fn begin_step(
        &mut self,
        angular_velocity: &Vector3<f64>,
        inverse: &Matrix3<f64>,
        h: f64,
    ) -> Vector3<f64> {
        for index in 0..self.wheels.len() {
            let speed = self.speed(index, angular_velocity);
            let wheel = &self.wheels[index];
            let per_torque = wheel.per_torque(inverse);
            let command = self.commands[index].clamp(-wheel.max_torque, wheel.max_torque);
            let torque = wheel.torque(self.factors[index] * command, speed, per_torque, h);
            let state = &mut self.states[index];
            state.torque = torque;
            state.angle += 0.5 * h * speed;
        }
        self.half_impulse(h)
    }

    /// The second half, at the end of the step.
    pub(crate) fn end_step(&mut self, h: f64) -> Vector3<f64> {
        self.half_impulse(h)
    }

    /// Completes the angles of a step that has ended with this angular velocity.
    pub(crate) fn turn(&mut self, angular_velocity: &Vector3<f64>, h: f64) {
        for index in 0..self.wheels.len() {
            self.states[index].angle += 0.5 * h * self.speed(index, angular_velocity);
        }
    }

    fn half_impulse(&mut self, h: f64) -> Vector3<f64> {
        let mut impulse = Vector3::zeros();
        for (wheel, state) in self.wheels.iter().zip(&mut self.states) {
            let change = 0.5 * h * state.torque;
            state.momentum += change;
            impulse -= change * wheel.axis;
        }
        impulse
    }
}
