//! One flight in many units.

use lgvi_dynamics::gravity::{Fixed, Gravity, Multipole, Mutual, Uniform};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, PointMass, RigidBody, Simulation, System};
use nalgebra::{Matrix3, Vector3};

use super::limits::{Numbers, Outcome, Tally};
use super::methods;
use crate::{Length, Report, TrialError};

/// Exponents of two of the units of mass, length and time.
#[derive(Clone, Copy, Debug)]
struct Units {
    mass: i32,
    length: i32,
    time: i32,
}

impl Units {
    /// A quantity of this dimension; none where it is no normal number in these units.
    fn of(self, value: f64, [mass, length, time]: [i32; 3]) -> Option<f64> {
        let exponent = mass * self.mass + length * self.length + time * self.time;
        let scaled = libm::scalbn(value, exponent);
        (value == 0.0 || scaled.is_normal()).then_some(scaled)
    }

    /// Whether the data of every kind are within the limits of numbers.
    fn are_within(self) -> bool {
        let size = |value, [mass, length, time]: [i32; 3]| {
            let exponent = mass * self.mass + length * self.length + time * self.time;
            libm::scalbn(value, exponent)
        };
        let farthest = size(Vector3::new(1.0, 0.25, 0.0).norm(), LENGTH);
        let numbers = Numbers {
            h: size(H, TIME),
            mass: size(1.0, MASS),
            trace: size(MOMENTS.iter().sum(), INERTIA),
            farthest,
        };
        numbers.are_within()
    }

    fn vector(self, value: Vector3<f64>, dimension: [i32; 3]) -> Option<Vector3<f64>> {
        let [x, y, z] = value.into();
        Some(Vector3::new(
            self.of(x, dimension)?,
            self.of(y, dimension)?,
            self.of(z, dimension)?,
        ))
    }
}

const MASS: [i32; 3] = [1, 0, 0];
const LENGTH: [i32; 3] = [0, 1, 0];
const TIME: [i32; 3] = [0, 0, 1];
const INERTIA: [i32; 3] = [1, 2, 0];
const MOMENTUM: [i32; 3] = [1, 1, -1];
const ANGULAR_MOMENTUM: [i32; 3] = [1, 2, -1];
const ACCELERATION: [i32; 3] = [0, 1, -2];
/// Of `GM`.
const PARAMETER: [i32; 3] = [0, 3, -2];
/// Of `G`.
const CONSTANT: [i32; 3] = [-1, 3, -2];

/// What is flown.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Free,
    Dumbbells,
    Multipoles,
    Oblate,
    Pendulum,
}

const KINDS: [Kind; 5] = [
    Kind::Free,
    Kind::Dumbbells,
    Kind::Multipoles,
    Kind::Oblate,
    Kind::Pendulum,
];

/// The exponents of the units.
const EXPONENTS: [i32; 13] = [
    -900, -500, -340, -190, -95, -45, 0, 45, 95, 190, 340, 500, 900,
];

const MOMENTS: [f64; 3] = [0.25, 0.375, 0.5];
const H: f64 = 0.0625;
const STEPS: u32 = 10;

/// Why there is no end of a flight.
enum Ending {
    /// The data cannot be written in these units.
    Unwritten,
    /// A typed error.
    Refused,
    /// An error that has changed the states.
    Changed,
}

impl Kind {
    fn body(self, units: Units) -> Result<RigidBody, Ending> {
        let given = |value, dimension| units.of(value, dimension).ok_or(Ending::Unwritten);
        let mut moments = [0.0; 3];
        for (scaled, moment) in moments.iter_mut().zip(MOMENTS) {
            *scaled = given(moment, INERTIA)?;
        }
        let refused = |_| Ending::Refused;
        let inertia = Inertia::principal(moments).map_err(|_| Ending::Refused)?;
        let (mass, half) = (given(1.0, MASS)?, given(0.5, MASS)?);
        let arm = Vector3::new(given(0.25, LENGTH)?, 0.0, 0.0);
        let end = |mass, position| PointMass { mass, position };
        match self {
            Self::Free => RigidBody::new(mass, inertia, vec![]).map_err(refused),
            Self::Dumbbells => {
                let ends = vec![end(half, arm), end(half, -arm)];
                RigidBody::new(mass, inertia, ends).map_err(refused)
            }
            Self::Multipoles | Self::Oblate => {
                let multipole = Multipole::of_inertia(mass, &inertia);
                RigidBody::with_multipole(inertia, multipole).map_err(refused)
            }
            Self::Pendulum => {
                RigidBody::pivoted(mass, inertia, vec![end(mass, arm)]).map_err(refused)
            }
        }
    }

    fn gravity(self, units: Units) -> Result<Option<Box<dyn Gravity>>, Ending> {
        let given = |value, dimension| units.of(value, dimension).ok_or(Ending::Unwritten);
        Ok(match self {
            Self::Free => None,
            Self::Dumbbells | Self::Multipoles => {
                Some(Box::new(Mutual::new(given(1.0, CONSTANT)?)))
            }
            Self::Oblate => {
                let planet = Multipole::oblate(given(2.0, PARAMETER)?, 0.125, given(0.5, LENGTH)?);
                Some(Box::new(Fixed::new(
                    planet,
                    Vector3::zeros(),
                    Matrix3::identity(),
                )))
            }
            Self::Pendulum => {
                let acceleration = Vector3::new(0.0, 0.0, given(-1.0, ACCELERATION)?);
                Some(Box::new(Uniform { acceleration }))
            }
        })
    }

    /// The states at the end of the flight, in units of 1.
    fn fly(self, units: Units, method: Method) -> Result<Vec<BodyState>, Ending> {
        let body = self.body(units)?;
        let count = match self {
            Self::Dumbbells | Self::Multipoles => 2,
            _ => 1,
        };
        let given = |value, dimension| units.vector(value, dimension).ok_or(Ending::Unwritten);
        let mut states = Vec::new();
        for side in [1.0, -1.0].into_iter().take(count) {
            let (away, fast) = match self {
                Self::Pendulum => (0.0, 0.0),
                _ => (side, side * 0.75),
            };
            states.push(BodyState {
                position: given(Vector3::new(away, 0.25 * away, 0.0), LENGTH)?,
                linear_momentum: given(Vector3::new(0.0, fast, 0.25 * fast), MOMENTUM)?,
                attitude: lgvi_lie::exp(&Vector3::new(0.25, 0.5 * side, -0.25)),
                angular_momentum: given(Vector3::new(0.25, 0.125, -0.25), ANGULAR_MOMENTUM)?,
            });
        }
        let gravity = self.gravity(units)?.into_iter().collect();
        let system = System::new(vec![body; count], gravity);
        let h = units.of(H, TIME).ok_or(Ending::Unwritten)?;
        let simulation = Simulation::new(system, states, method, h);
        let mut simulation = simulation.map_err(|_| Ending::Refused)?;
        let controls = vec![Load::default(); count];
        for _ in 0..STEPS {
            let before = simulation.states().to_vec();
            if simulation.advance(&controls).is_err() {
                return Err(match simulation.states() == before {
                    true => Ending::Refused,
                    false => Ending::Changed,
                });
            }
        }
        let back = |value: &Vector3<f64>, [mass, length, time]: [i32; 3]| {
            let exponent = mass * units.mass + length * units.length + time * units.time;
            value.map(|value| libm::scalbn(value, -exponent))
        };
        let ends = simulation.states().iter().map(|state| BodyState {
            position: back(&state.position, LENGTH),
            linear_momentum: back(&state.linear_momentum, MOMENTUM),
            attitude: state.attitude,
            angular_momentum: back(&state.angular_momentum, ANGULAR_MOMENTUM),
        });
        Ok(ends.collect())
    }
}

fn apart(found: &[BodyState], expected: &[BodyState]) -> f64 {
    let pairs = found.iter().zip(expected);
    pairs.fold(0.0, |greatest: f64, (a, b)| {
        let differences = [
            (a.position - b.position).norm(),
            (a.linear_momentum - b.linear_momentum).norm(),
            (a.attitude - b.attitude).norm(),
            (a.angular_momentum - b.angular_momentum).norm(),
        ];
        // A difference that is no number is none that is small.
        differences.into_iter().fold(
            greatest,
            |greatest, next| {
                if next <= greatest { greatest } else { next }
            },
        )
    })
}

pub(super) fn run(length: Length) -> Result<Report, TrialError> {
    let mut report = Report::default();
    let stride = length.of(17, 1);
    let count = EXPONENTS.len();
    for kind in KINDS {
        let (mut tally, mut first, mut refused) = (Tally::default(), None, None);
        for method in methods() {
            let one = Units {
                mass: 0,
                length: 0,
                time: 0,
            };
            let Ok(expected) = kind.fly(one, method) else {
                tally.add(true, Outcome::Wrong);
                continue;
            };
            for index in (0..count.pow(3)).step_by(stride) {
                let units = Units {
                    mass: EXPONENTS[index % count],
                    length: EXPONENTS[index / count % count],
                    time: EXPONENTS[index / count / count],
                };
                let must = units.are_within();
                let outcome = match kind.fly(units, method) {
                    Ok(found) if apart(&found, &expected) <= 1e-9 => Outcome::Right,
                    Err(Ending::Unwritten) if !must => continue,
                    Err(Ending::Unwritten | Ending::Refused) => Outcome::Refused,
                    Ok(_) | Err(Ending::Changed) => Outcome::Wrong,
                };
                tally.add(must, outcome);
                match outcome {
                    Outcome::Wrong => first = first.or(Some((method, units))),
                    Outcome::Refused if must => refused = refused.or(Some((method, units))),
                    _ => {}
                }
            }
        }
        let told = |(method, units): (Method, Units)| format!("{method}, {units:?}");
        tally.tell(&mut report, &format!("{kind:?}: "), refused.map(told));
        let what = first.map_or_else(String::new, |first| format!(", first {}", told(first)));
        report.within(
            format!("other flights{what}"),
            f64::from(tally.wrong),
            [0.0; 2],
        );
    }
    Ok(report)
}
