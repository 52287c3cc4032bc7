//! Random maneuvers of all families.

use std::f64::consts::TAU;

use lgvi_control::constraint::{Corridor, KeepOutCone, KeepOutSphere, NormLimit, Place};
use lgvi_control::terminal::{FinalAttitude, FinalPosition, KeplerOrbit, SpinAxis};
use lgvi_control::{Constraint, Dynamics, Motion, Terminal};
use lgvi_dynamics::BodyState;
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3};

use super::stated::{Commands, Stated};

const EARTH: f64 = 3.986_004_418e14;
const RADIUS: f64 = 6.378_137e6;
const J2: f64 = 1.082_63e-3;

/// The name of a family and the generator of its maneuvers.
pub type Family = (&'static str, fn(&mut fastrand::Rng) -> Stated);

pub const FAMILIES: [Family; 10] = [
    ("transfer", transfer),
    ("terminal sets", terminal_sets),
    ("low orbit in meters", low_orbit),
    ("geostationary orbit in meters", geostationary),
    ("limits", limits),
    ("sphere", sphere),
    ("corridor", corridor),
    ("slew", slew),
    ("slew of a CubeSat by a cone", cone),
    ("actuators", actuators),
];

fn between(rng: &mut fastrand::Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.f64()
}

fn vector(rng: &mut fastrand::Rng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| between(rng, -size, size))
}

fn dynamics(rng: &mut fastrand::Rng) -> Dynamics {
    if rng.bool() {
        Dynamics::LieEuler
    } else {
        Dynamics::Lgvi
    }
}

/// Position and momentum on a circular orbit at `phase`, with its plane tilted by `tilt`.
fn circular(
    mass: f64,
    gm: f64,
    radius: f64,
    phase: f64,
    tilt: f64,
) -> (Vector3<f64>, Vector3<f64>) {
    let turn = exp(&Vector3::new(tilt, 0.0, 0.0)) * exp(&Vector3::new(0.0, 0.0, phase));
    let speed = (gm / radius).sqrt();
    (radius * turn.column(0), mass * speed * turn.column(1))
}

/// From one circular orbit to a nearby one, in part of a revolution, with a rotation.
fn orbits(rng: &mut fastrand::Rng, radius: f64, [mass, size]: [f64; 2], gm: f64) -> Stated {
    let arc = between(rng, 0.6, 2.0);
    let rate = (gm / radius).sqrt() / radius;
    let duration = arc / rate;
    let moments = [0.6, 0.8, 1.0].map(|part| part * mass * size * size);
    let (position, linear_momentum) = circular(mass, gm, radius, 0.0, 0.0);
    let initial = BodyState {
        position,
        linear_momentum,
        attitude: Matrix3::identity(),
        angular_momentum: Vector3::zeros(),
    };
    let raised = radius * between(rng, 1.0, 1.02);
    let (position, linear_momentum) = circular(mass, gm, raised, arc, between(rng, 0.0, 0.05));
    let target = BodyState {
        position,
        linear_momentum,
        attitude: exp(&vector(rng, 0.8)),
        angular_momentum: Vector3::zeros(),
    };
    Stated {
        mass,
        moments,
        arm: 0.0,
        gm,
        j2: 0.0,
        radius: 1.0,
        duration,
        intervals: 40,
        initial,
        target: target.try_into().expect("a state"),
        commands: Commands::Loads(1.0, 1.0),
        constraints: Vec::new(),
        motion: Motion::Full,
        dynamics: dynamics(rng),
    }
}

fn transfer(rng: &mut fastrand::Rng) -> Stated {
    let size = between(rng, 0.1, 0.5);
    Stated {
        arm: size,
        ..orbits(rng, 1.0, [1.0, size], 1.0)
    }
}

pub fn low_orbit(rng: &mut fastrand::Rng) -> Stated {
    let radius = RADIUS + between(rng, 4e5, 1.5e6);
    let mass = between(rng, 5.0, 2000.0);
    Stated {
        j2: J2,
        radius: RADIUS,
        ..orbits(rng, radius, [mass, 0.3], EARTH)
    }
}

fn geostationary(rng: &mut fastrand::Rng) -> Stated {
    Stated {
        arm: 5.0,
        ..orbits(rng, 4.2164e7, [3000.0, 2.0], EARTH)
    }
}

fn terminal_sets(rng: &mut fastrand::Rng) -> Stated {
    let mut stated = transfer(rng);
    let end = stated.target.state().expect("a state");
    let (position, velocity) = (end.position, end.linear_momentum / stated.mass);
    let translation = rng.u8(0..3);
    let target = match translation {
        0 => Terminal::FREE.with(FinalPosition::new(position, None).expect("a position")),
        1 => {
            let orbit =
                KeplerOrbit::new(stated.gm, Vector3::zeros(), stated.mass, position, velocity);
            Terminal::FREE.with(orbit.expect("an orbit"))
        }
        _ => Terminal::FREE,
    };
    let turned = exp(&vector(rng, 0.5));
    let free = translation == 2;
    stated.target = match rng.u8(0..if free { 2 } else { 3 }) {
        0 => target.with(FinalAttitude::new(turned, None).expect("an attitude")),
        1 => {
            let direction = turned.column(0).into_owned();
            let spin = SpinAxis::new(Vector3::x(), direction, Vector3::zeros());
            target.with(spin.expect("a spin axis"))
        }
        _ => target,
    };
    stated
}

/// A place away from the origin, where a field of zero strength is not defined either.
const PLACE: Vector3<f64> = Vector3::new(4.0, 3.0, 1.0);

/// A rest-to-rest motion by about a meter without gravity.
fn hop(rng: &mut fastrand::Rng) -> Stated {
    let duration = between(rng, 5.0, 50.0);
    let mass = between(rng, 1.0, 10.0);
    let rest = |position: Vector3<f64>| BodyState {
        position,
        linear_momentum: Vector3::zeros(),
        attitude: Matrix3::identity(),
        angular_momentum: Vector3::zeros(),
    };
    let aside = vector(rng, 0.2) + Vector3::x();
    Stated {
        mass,
        moments: [0.01 * mass; 3],
        arm: 0.0,
        gm: 0.0,
        j2: 0.0,
        radius: 1.0,
        duration,
        intervals: 40,
        initial: rest(PLACE + aside),
        target: Terminal::try_from(rest(PLACE - aside)).expect("a state"),
        commands: Commands::Loads(1.0, 1.0),
        constraints: Vec::new(),
        motion: Motion::Translation,
        dynamics: dynamics(rng),
    }
}

fn limits(rng: &mut fastrand::Rng) -> Stated {
    let mut stated = hop(rng);
    // The least peak force that covers d from rest to rest is 4 m d/T²; the peak of the cheapest force is 6 m d/T².
    let distance = 2.0 * (stated.initial.position - PLACE).norm();
    let least = 4.0 * stated.mass * distance / (stated.duration * stated.duration);
    let limit = least * between(rng, 1.1, 1.4);
    let limit = NormLimit::new(Place::Position, limit).expect("a limit");
    stated.constraints = vec![Constraint::commands(limit)];
    stated
}

fn sphere(rng: &mut fastrand::Rng) -> Stated {
    let mut stated = hop(rng);
    let center = PLACE + vector(rng, 0.1);
    let radius = between(rng, 0.2, 0.5);
    let sphere = KeepOutSphere::new(center, radius).expect("a sphere");
    stated.constraints = vec![Constraint::state(sphere)];
    stated
}

fn corridor(rng: &mut fastrand::Rng) -> Stated {
    let mut stated = hop(rng);
    let end = PLACE + Vector3::new(0.02, 0.0, 0.0);
    let end = FinalPosition::new(end, Some(Vector3::zeros())).expect("a position");
    stated.target = stated.target.with(end);
    let corridor = Corridor::new(PLACE, Vector3::x(), between(rng, 0.3, 0.5));
    stated.constraints = vec![Constraint::state(corridor.expect("a corridor"))];
    stated
}

/// A rest-to-rest rotation of a body of the size of a CubeSat or a station.
fn slew(rng: &mut fastrand::Rng) -> Stated {
    let size = if rng.bool() { 0.1 } else { 20.0 };
    let mass = 1000.0 * size * size * size;
    let turned = exp(&vector(rng, 1.2));
    Stated {
        moments: [0.5, 0.9, 1.0].map(|part| part * mass * size * size),
        mass,
        duration: between(rng, 50.0, 500.0),
        target: at_rest(turned),
        motion: Motion::Rotation,
        ..hop(rng)
    }
}

fn at_rest(attitude: Matrix3<f64>) -> Terminal {
    let attitude = FinalAttitude::new(attitude, Some(Vector3::zeros()));
    Terminal::FREE.with(attitude.expect("an attitude"))
}

fn cone(rng: &mut fastrand::Rng) -> Stated {
    let angle = between(rng, 1.0, 2.0);
    let half_angle = between(rng, 0.1, 0.4);
    // Near the middle of the way from x to the target direction.
    let middle = 0.5 * angle;
    let aside = between(rng, 0.02, 0.5) * half_angle;
    let direction =
        exp(&Vector3::new(0.0, 0.0, middle)) * Vector3::new(aside.cos(), 0.0, aside.sin());
    let turned = exp(&Vector3::new(0.0, 0.0, angle));
    let cone = KeepOutCone::new(Vector3::x(), direction, half_angle).expect("a cone");
    Stated {
        mass: 4.0,
        moments: [0.007, 0.03, 0.033],
        target: at_rest(turned),
        constraints: vec![Constraint::state(cone)],
        ..slew(rng)
    }
}

/// Wheels and thrusters of different weights, or two wheels alone.
fn actuators(rng: &mut fastrand::Rng) -> Stated {
    let unit = |axis: usize, size: f64| std::array::from_fn(|i| if i == axis { size } else { 0.0 });
    if rng.bool() {
        let commands = Commands::Actuators(vec![(unit(3, 1.0), 1.0), (unit(4, 1.0), 2.0)]);
        return Stated {
            commands,
            ..slew(rng)
        };
    }
    let columns = (0..6).map(|axis| {
        let size = between(rng, 0.1, 3.0);
        (unit(axis, size), between(rng, 0.5, 2.0))
    });
    let commands = Commands::Actuators(columns.collect());
    Stated {
        commands,
        ..orbits(rng, TAU, [3.0, 0.4], 1.0)
    }
}
