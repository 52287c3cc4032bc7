//! Whether the flight's steps were short enough for what they followed.

use lgvi_common::{Warning, WarningCode};
use lgvi_scene::{Energies, Rates, Scene};

use crate::Flight;

/// How often in a flight it is looked how fast bodies move, which takes as long as their gravity.
const LOOKS: u64 = 4000;

/// What the flight has shown of its steps so far.
pub(crate) struct Resolution {
    every: u64,
    rates: Rates,
    start: Energies,
}

impl Resolution {
    pub(crate) fn new(scene: &Scene, flight: &Flight) -> Self {
        Self {
            every: scene.steps.div_ceil(LOOKS),
            rates: scene.rates(flight.system(), flight.states()),
            start: flight.energies(),
        }
    }

    /// Energy is measured from here.
    pub(crate) fn begin(&mut self, flight: &Flight) {
        self.start = flight.energies();
    }

    /// Takes note of a loss of energy that is not an error, in the scene's units.
    pub(crate) fn lose(&mut self, energy: f64) {
        self.start.kinetic -= energy;
    }

    /// Takes note of the present states, if it is their turn.
    pub(crate) fn note(&mut self, scene: &Scene, flight: &Flight) {
        if flight.step().is_multiple_of(self.every) {
            self.rates = self
                .rates
                .max(scene.rates(flight.system(), flight.states()));
        }
    }

    /// What is to be said at the end; of the energy only where no controls have changed it.
    pub(crate) fn warnings(
        &self,
        scene: &Scene,
        flight: &Flight,
        controlled: bool,
    ) -> Vec<Warning> {
        let scheme = flight.scheme();
        let energies = [self.start, flight.energies()];
        let warnings = [
            (WarningCode::LongTurn, scene.long_turn(scheme, self.rates)),
            (WarningCode::LongStep, scene.long_orbit(scheme, self.rates)),
            (
                WarningCode::ChangedEnergy,
                scene.changed_energy(energies).filter(|_| !controlled),
            ),
        ];
        let warnings = warnings.into_iter();
        warnings
            .filter_map(|(code, message)| Some(Warning::new(code, message?)))
            .collect()
    }
}
