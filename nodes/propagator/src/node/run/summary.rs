//! What is said of a flight that is over.

use lgvi_common::{Arrival, FlightReport, Miss};
use lgvi_scene::Maneuver;
use nalgebra::SVector;

use super::Propagator;

impl Propagator {
    pub(crate) fn report(&self) -> FlightReport {
        let (start, end) = (&self.start, self.flight.invariants());
        let units = &self.scene.units;
        FlightReport {
            steps: self.flight.step(),
            step_size: self.scene.h() * units.time,
            seconds: self.began.elapsed().as_secs_f64(),
            miss: self.miss(),
            cost: self.costs.first().copied(),
            companions: self.companions(),
            energy_start: start.energy * units.energy(),
            energy_end: end.energy * units.energy(),
            linear_momentum_change: (end.linear_momentum - start.linear_momentum).norm()
                * units.momentum(),
            angular_momentum_change: (end.angular_momentum - start.angular_momentum).norm()
                * units.angular_momentum(),
            orthogonality_error: end.orthogonality_error,
            refused: self.states.lost(),
            overruns: self.pace.overruns,
            late_controls: self.late_controls,
            command_timeouts: self.commanding.timeouts.report(&self.scene),
            cut_steps: self.cuts.total(),
            detail_changes: self.flight.switches(),
            docked: self.docked.clone(),
        }
    }

    /// How far the flight has arrived from the maneuver's target.
    fn miss(&self) -> Option<Miss> {
        let body = self.scene.maneuver.as_ref()?.body;
        let states = self.flight.states();
        let end = self.arrival.unwrap_or(states[body]);
        let bodies = self.flight.system().bodies();
        Some(self.in_si(&self.scene.miss_among(bodies, states, &end)?))
    }

    /// What has become of the bodies that are planned together with the maneuver's.
    fn companions(&self) -> Vec<Arrival> {
        let planned = self.scene.maneuver.iter().flat_map(Maneuver::planned);
        let misses = self
            .scene
            .misses(self.flight.system().bodies(), self.flight.states());
        let arrivals = planned.zip(&self.costs).zip(misses).skip(1);
        let arrivals = arrivals.map(|((planned, cost), miss)| Arrival {
            body: self.scene.bodies[planned.body].name.clone(),
            cost: *cost,
            miss: miss.map(|miss| self.in_si(&miss)),
        });
        arrivals.collect()
    }

    fn in_si(&self, miss: &SVector<f64, 12>) -> Miss {
        let part = |which: usize| miss.fixed_rows::<3>(3 * which).norm();
        let units = &self.scene.units;
        Miss {
            position: part(0) * units.length,
            linear_momentum: part(1) * units.momentum(),
            attitude: part(2),
            angular_momentum: part(3) * units.angular_momentum(),
            norm: miss.norm(),
        }
    }
}
