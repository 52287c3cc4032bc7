//! Maneuvers that can be stated in any units.

use lgvi_control::constraint::{Corridor, KeepOutCone, KeepOutSphere, NormLimit, Place};
use lgvi_control::terminal::{FinalAttitude, FinalPosition, KeplerOrbit, SpinAxis};
use lgvi_control::{Actuation, Constraint, Dynamics, Motion, Plan, Terminal, Transfer};
use lgvi_dynamics::gravity::Multipole;
use lgvi_dynamics::{BodyState, Inertia, Load, PointMass, RigidBody};
use nalgebra::{Matrix3, Vector3};

/// Factors between two systems of units.
#[derive(Clone, Copy, Debug)]
pub struct Factors {
    pub length: f64,
    pub time: f64,
    pub mass: f64,
    pub cost: f64,
}

impl Factors {
    pub const NONE: Self = Self {
        length: 1.0,
        time: 1.0,
        mass: 1.0,
        cost: 1.0,
    };

    fn momentum(&self) -> f64 {
        self.mass * self.length / self.time
    }

    fn angular_momentum(&self) -> f64 {
        self.momentum() * self.length
    }

    fn force(&self) -> f64 {
        self.momentum() / self.time
    }

    fn moment(&self) -> f64 {
        self.force() * self.length
    }

    pub fn state(&self, state: &BodyState) -> BodyState {
        BodyState {
            position: self.length * state.position,
            linear_momentum: self.momentum() * state.linear_momentum,
            attitude: state.attitude,
            angular_momentum: self.angular_momentum() * state.angular_momentum,
        }
    }

    pub fn load(&self, load: &Load) -> Load {
        Load {
            force: self.force() * load.force,
            moment: self.moment() * load.moment,
        }
    }
}

/// The commands of a maneuver.
#[derive(Clone, Debug)]
pub enum Commands {
    /// Force and moment, with these weights.
    Loads(f64, f64),
    /// Actuators with their weights.
    Actuators(Vec<([f64; 6], f64)>),
}

/// A maneuver, stated in numbers.
#[derive(Clone, Debug)]
pub struct Stated {
    pub mass: f64,
    pub moments: [f64; 3],
    /// Half the length of the body's dumbbell; 0 for a sphere.
    pub arm: f64,
    pub gm: f64,
    pub j2: f64,
    pub radius: f64,
    pub duration: f64,
    pub intervals: usize,
    pub initial: BodyState,
    pub target: Terminal,
    pub commands: Commands,
    pub constraints: Vec<Constraint>,
    pub motion: Motion,
    pub dynamics: Dynamics,
}

impl Stated {
    pub fn transfer(&self) -> Transfer {
        let inertia = Inertia::principal(self.moments).expect("inertia");
        let points = if self.arm > 0.0 {
            let end = |x: f64| PointMass {
                mass: 0.5 * self.mass,
                position: Vector3::new(x, 0.0, 0.0),
            };
            vec![end(self.arm), end(-self.arm)]
        } else {
            Vec::new()
        };
        let actuation = match &self.commands {
            Commands::Loads(force, moment) => {
                let [force, moment] = [*force, *moment].map(Matrix3::from_diagonal_element);
                Actuation::full(&force, &moment).expect("weights")
            }
            Commands::Actuators(columns) => Actuation::actuators(columns).expect("actuators"),
        };
        Transfer::new(
            RigidBody::new(self.mass, inertia, points).expect("a body"),
            Multipole::oblate(self.gm, self.j2, self.radius),
            self.duration / self.intervals as f64,
            self.intervals,
            self.initial,
            self.target.clone(),
            actuation,
        )
        .expect("a transfer")
        .with_dynamics(self.dynamics)
        .with_motion(self.motion)
        .with_constraints(&self.constraints)
    }

    /// The maneuver stated in other units.
    pub fn times(&self, by: &Factors) -> Self {
        let speed = by.length / by.time;
        let weight = |load: f64| by.cost / (by.time * load * load);
        let mut other = self.clone();
        other.target = terminal(self, by);
        other.mass *= by.mass;
        other.moments = other.moments.map(|j| j * by.mass * by.length * by.length);
        other.arm *= by.length;
        other.gm *= speed * speed * by.length;
        other.radius *= by.length;
        other.duration *= by.time;
        other.initial = by.state(&other.initial);
        match &mut other.commands {
            Commands::Loads(force, moment) => {
                *force *= weight(by.force());
                *moment *= weight(by.moment());
            }
            // Commands of actuators keep their values.
            Commands::Actuators(columns) => {
                for (column, own) in columns {
                    for (row, component) in column.iter_mut().enumerate() {
                        *component *= if row < 3 { by.force() } else { by.moment() };
                    }
                    *own *= weight(1.0);
                }
            }
        }
        for constraint in &mut other.constraints {
            constrain(constraint, by);
        }
        other
    }
}

fn terminal(stated: &Stated, by: &Factors) -> Terminal {
    let mut target = Terminal::FREE;
    let position = stated.target.condition(Place::Position);
    if let Some(place) = position.and_then(|c| c.downcast_ref::<FinalPosition>()) {
        let momentum = place.linear_momentum().map(|gamma| by.momentum() * gamma);
        let place = FinalPosition::new(by.length * place.position(), momentum);
        target = target.with(place.expect("a position"));
    } else if let Some(orbit) = position.and_then(|c| c.downcast_ref::<KeplerOrbit>()) {
        let speed = by.length / by.time;
        let orbit = KeplerOrbit::new(
            speed * speed * by.length * orbit.gm(),
            by.length * orbit.center(),
            by.mass * stated.mass,
            by.length * orbit.position(),
            speed * orbit.velocity(),
        );
        target = target.with(orbit.expect("an orbit"));
    }
    let attitude = stated.target.condition(Place::Attitude);
    if let Some(turn) = attitude.and_then(|c| c.downcast_ref::<FinalAttitude>()) {
        let momentum = turn.angular_momentum().map(|pi| by.angular_momentum() * pi);
        let turn = FinalAttitude::new(turn.attitude(), momentum);
        target = target.with(turn.expect("an attitude"));
    } else if let Some(spin) = attitude.and_then(|c| c.downcast_ref::<SpinAxis>()) {
        let momentum = by.angular_momentum() * spin.angular_momentum();
        let spin = SpinAxis::new(spin.axis(), spin.direction(), momentum);
        target = target.with(spin.expect("a spin axis"));
    }
    target
}

fn constrain(constraint: &mut Constraint, by: &Factors) {
    let load = match constraint.place() {
        Some(Place::Position) => by.force(),
        _ => by.moment(),
    };
    let scaled = if let Some(norm) = constraint.downcast_ref::<NormLimit>() {
        let place = constraint.place().expect("a place");
        Constraint::commands(NormLimit::new(place, load * norm.limit()).expect("a limit"))
    } else if let Some(sphere) = constraint.downcast_ref::<KeepOutSphere>() {
        let (center, radius) = (by.length * sphere.center(), by.length * sphere.radius());
        Constraint::state(KeepOutSphere::new(center, radius).expect("a sphere"))
    } else if let Some(corridor) = constraint.downcast_ref::<Corridor>() {
        let (apex, axis) = (by.length * corridor.apex(), corridor.axis());
        Constraint::state(Corridor::new(apex, axis, corridor.half_angle()).expect("a corridor"))
    } else {
        assert!(constraint.downcast_ref::<KeepOutCone>().is_some());
        return;
    };
    *constraint = scaled;
}

/// Asserts that `other` is `plan` in other units: exactly if `tolerance` is 0, otherwise to `tolerance` of the greatest
/// control and 1e-8 of the cost.
pub fn assert_same(plan: &Plan, other: &Plan, by: &Factors, tolerance: f64, name: &str) {
    let expected: Vec<_> = plan.controls.iter().map(|load| by.load(load)).collect();
    if tolerance == 0.0 {
        let states: Vec<_> = plan.states.iter().map(|state| by.state(state)).collect();
        assert_eq!(other.controls, expected, "{name}");
        assert_eq!(other.states, states, "{name}");
        assert_eq!(other.cost, by.cost * plan.cost, "{name}");
        assert_eq!(other.certificate, plan.certificate, "{name}");
        return;
    }
    let cost = other.cost / (by.cost * plan.cost) - 1.0;
    assert!(cost.abs() <= 1e-8, "{name}: the cost differs by {cost:e}");
    let largest = |part: fn(&Load) -> Vector3<f64>| {
        expected
            .iter()
            .map(|load| part(load).norm())
            .fold(0.0, f64::max)
    };
    for part in [|load: &Load| load.force, |load: &Load| load.moment] {
        let bound = tolerance * largest(part);
        for (found, expected) in other.controls.iter().zip(&expected) {
            let apart = (part(found) - part(expected)).norm();
            assert!(
                apart <= bound,
                "{name}: controls differ by {apart:e}, {bound:e} allowed"
            );
        }
    }
    assert_eq!(
        other.certificate.sufficient, plan.certificate.sufficient,
        "{name}"
    );
}
