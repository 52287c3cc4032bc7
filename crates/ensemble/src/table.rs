//! The numbers stored for each sample, in SI.

use lgvi_dynamics::lanes::{Member, Outcome};
use lgvi_dynamics::{BodyState, Invariants, System};
use lgvi_lie::to_quaternion;
use lgvi_scene::{ActuatorErrors, Deviation, Ensemble, Sample, Scene, Spread, Units};
use nalgebra::{SVector, Vector3};

use crate::row::{Failure, Row};
use crate::violations::{Violation, Watch};

/// The columns of a scene's ensemble.
pub(crate) struct Columns {
    names: Vec<String>,
    spreads: Vec<Spread>,
    /// True if force, moment and actuators of the maneuver have errors, respectively.
    errors: [bool; 3],
    units: Units,
}

/// The sample of a flight and its outcome.
pub(crate) struct Ends<'a> {
    pub(crate) member: &'a Member,
    pub(crate) outcome: Outcome,
    /// The bodies at the end, where actuators have changed them.
    pub(crate) system: Option<System>,
    /// The constraints that are watched, and how they were violated.
    pub(crate) violations: Option<(&'a Watch, Vec<Violation>)>,
}

/// Numbers with the names of their columns.
#[derive(Default)]
struct Cells {
    names: Vec<String>,
    numbers: Vec<f64>,
}

impl Cells {
    fn push(&mut self, name: impl Into<String>, number: f64) {
        self.names.push(name.into());
        self.numbers.push(number);
    }

    fn extend(&mut self, cells: impl Iterator<Item = (String, f64)>) {
        cells.for_each(|(name, number)| self.push(name, number));
    }

    fn vector(&mut self, name: &str, v: &Vector3<f64>) {
        for (axis, number) in ["x", "y", "z"].into_iter().zip(v) {
            self.push(format!("{name}.{axis}"), *number);
        }
    }
}

impl Columns {
    pub(crate) fn of(scene: &Scene, ensemble: &Ensemble, watch: Option<&Watch>) -> Self {
        let mut columns = Self {
            names: Vec::new(),
            spreads: ensemble.spreads.clone(),
            errors: [
                ensemble.force_error > 0.0,
                ensemble.moment_error > 0.0,
                ensemble.actuator_error > 0.0,
            ],
            units: scene.units,
        };
        let nominal = Sample {
            deviations: vec![Deviation::default(); scene.bodies.len()],
            actuators: ActuatorErrors::none(ensemble.actuators),
        };
        let states: Vec<_> = scene.bodies.iter().map(|body| body.state).collect();
        let mut cells = Cells::default();
        columns.start(&mut cells, scene, &nominal);
        let system = scene.system();
        finish(&mut cells, scene, [(&system, states.as_slice()); 2]);
        if let Some(watch) = watch {
            cells.extend(watch.cells(&watch.begin()));
        }
        columns.names = cells.names;
        columns
    }

    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns the row of a sample, including the results of its flight if it could start.
    pub(crate) fn row(
        &self,
        scene: &Scene,
        index: u64,
        sample: &Sample,
        flight: Result<Ends<'_>, Failure>,
    ) -> Row {
        let mut cells = Cells::default();
        self.start(&mut cells, scene, sample);
        let (steps, failure) = match flight {
            Ok(Ends {
                member,
                outcome,
                system: last,
                violations,
            }) => {
                let Member { system, states, .. } = member;
                let last = last.as_ref().unwrap_or(system);
                let ends = [
                    (system, states.as_slice()),
                    (last, outcome.states.as_slice()),
                ];
                finish(&mut cells, scene, ends);
                if let Some((watch, noted)) = &violations {
                    cells.extend(watch.cells(noted));
                }
                let failure = outcome.failure;
                (
                    outcome.steps,
                    failure.map(|error| Failure::step(scene, &error)),
                )
            }
            Err(failure) => (0, Some(failure)),
        };
        cells.numbers.resize(self.names.len(), f64::NAN);
        Row {
            index,
            steps,
            failure,
            numbers: cells.numbers,
        }
    }

    /// Adds the deviations of a sample, where the standard deviation is not zero.
    fn start(&self, cells: &mut Cells, scene: &Scene, sample: &Sample) {
        let each = scene
            .bodies
            .iter()
            .zip(&self.spreads)
            .zip(&sample.deviations);
        for ((body, spread), deviation) in each {
            self.deviation(cells, &body.name, spread, deviation);
        }
        let errors = &sample.actuators;
        let named = [
            ("force_factor", errors.force),
            ("moment_factor", errors.moment),
        ];
        for ((name, factors), errs) in named.iter().zip(self.errors) {
            if errs {
                cells.vector(name, factors);
            }
        }
        if self.errors[2] {
            let factors = errors.actuators.iter().enumerate();
            cells.extend(
                factors.map(|(index, factor)| (format!("actuator_factor.{index}"), *factor)),
            );
        }
    }

    fn deviation(&self, cells: &mut Cells, body: &str, spread: &Spread, deviation: &Deviation) {
        let Units { length, time, .. } = self.units;
        for (name, sigma, v, unit) in [
            ("position", spread.position, deviation.position, length),
            (
                "velocity",
                spread.velocity,
                deviation.velocity,
                length / time,
            ),
            ("attitude", spread.attitude, deviation.attitude, 1.0),
            (
                "angular_velocity",
                spread.angular_velocity,
                deviation.angular_velocity,
                1.0 / time,
            ),
            ("inertia", spread.inertia, deviation.inertia, 1.0),
        ] {
            if sigma > 0.0 {
                cells.vector(&format!("{body}.deviation.{name}"), &(v * unit));
            }
        }
        if spread.mass > 0.0 {
            cells.push(format!("{body}.deviation.mass"), deviation.mass);
        }
    }
}

/// The results of a flight from the first to the second system and states, with the names of their columns: the final state of
/// each body, the relative changes of energy and momenta, and by how much a maneuver misses its target; all in SI.
pub fn ends(scene: &Scene, ends: [(&System, &[BodyState]); 2]) -> Vec<(String, f64)> {
    let mut cells = Cells::default();
    finish(&mut cells, scene, ends);
    cells.names.into_iter().zip(cells.numbers).collect()
}

/// Adds the results of a flight from the first to the second states.
fn finish(cells: &mut Cells, scene: &Scene, ends: [(&System, &[BodyState]); 2]) {
    let Units { length, time, .. } = scene.units;
    let (system, last) = ends[1];
    for ((named, body), state) in scene.bodies.iter().zip(system.bodies()).zip(last) {
        let name = |what: &str| format!("{}.final.{what}", named.name);
        cells.vector(&name("position"), &(state.position * length));
        cells.vector(&name("velocity"), &(state.velocity(body) * (length / time)));
        let (w, u) = to_quaternion(&state.attitude);
        cells.push(name("attitude.w"), w);
        cells.vector(&name("attitude"), &u);
        cells.vector(
            &name("angular_velocity"),
            &(state.angular_velocity(body) / time),
        );
    }
    for (named, body) in scene.bodies.iter().zip(system.bodies()) {
        if let Some(thrusters) = body.thrusters()
            && thrusters.propellant().mass > 0.0
        {
            let name = format!("{}.final.propellant", named.name);
            cells.push(name, thrusters.propellant_left() * scene.units.mass);
        }
    }
    changes(cells, ends);
    if let Some(maneuver) = &scene.maneuver {
        let miss = scene.miss_among(system.bodies(), last, &last[maneuver.body]);
        let miss = miss.unwrap_or(SVector::repeat(f64::NAN));
        let units = &scene.units;
        for (row, (name, unit)) in [
            ("position", length),
            ("linear_momentum", units.momentum()),
            ("attitude", 1.0),
            ("angular_momentum", units.angular_momentum()),
        ]
        .into_iter()
        .enumerate()
        {
            let part = miss.fixed_rows::<3>(3 * row).norm();
            cells.push(format!("miss.{name}"), part * unit);
        }
    }
}

/// Adds the relative changes of energy and momenta. The reference is the sum of the magnitudes of their terms, at the
/// start or the end, whichever is greater. It stays meaningful if terms cancel or are zero at the start.
fn changes(cells: &mut Cells, ends: [(&System, &[BodyState]); 2]) {
    let [from, to] = ends.map(|(system, states)| Invariants::of(system, states));
    let sizes = [(ends[0], from.energy), (ends[1], to.energy)]
        .map(|((system, states), energy)| terms(system, states, energy));
    let [energy, linear, angular] = [0, 1, 2].map(|which| sizes[0][which].max(sizes[1][which]));
    // A change is at most twice the reference, so that a reference of zero implies a change of zero.
    let relative = |change: f64, size: f64| if change == 0.0 { 0.0 } else { change / size };
    let linear_change = (to.linear_momentum - from.linear_momentum).norm();
    let angular_change = (to.angular_momentum - from.angular_momentum).norm();
    cells.push("change.energy", relative(to.energy - from.energy, energy));
    cells.push("change.linear_momentum", relative(linear_change, linear));
    cells.push("change.angular_momentum", relative(angular_change, angular));
}

/// Returns the sums of the magnitudes of the terms of energy, linear momentum and angular momentum.
fn terms(system: &System, states: &[BodyState], energy: f64) -> [f64; 3] {
    let potential = system.potential(states);
    let (mut linear, mut angular) = (0.0, 0.0);
    for state in states {
        linear += state.linear_momentum.norm();
        let orbital = state.position.cross(&state.linear_momentum);
        angular += orbital.norm() + state.angular_momentum.norm();
    }
    [
        (energy - potential).abs() + potential.abs(),
        linear,
        angular,
    ]
}
