//! Bodies that dock on the way.

use lgvi_common::Docked;
use lgvi_scene::Scene;
use tracing::info;

use crate::node::run::Propagator;

impl Propagator {
    /// Takes note of what has docked in the last step.
    pub(crate) fn note_docked(&mut self) {
        for docked in self.flight.docked().iter().skip(self.docked.len()) {
            self.resolution.lose(docked.energy_loss);
            let docked = report(&self.scene, docked);
            info!("docked: {docked}");
            self.docked.push(docked);
        }
    }
}

fn report(scene: &Scene, docked: &lgvi_dynamics::docking::Docked) -> Docked {
    let ports = scene.docking[docked.docking].ports;
    Docked {
        bodies: ports.map(|port| scene.bodies[port.body].name.clone()),
        step: docked.step,
        time: scene.seconds(docked.step),
        energy_loss: docked.energy_loss * scene.units.energy(),
    }
}

#[cfg(test)]
mod tests {
    use lgvi_msgs::msg;

    use crate::{Flight, SetStates};

    use super::*;

    fn scene() -> Scene {
        Scene::parse("docking", include_str!("../../../../scenes/docking.toml")).unwrap()
    }

    fn fly(flight: &mut Flight, step: u64) {
        while flight.step() < step {
            flight.advance().unwrap();
        }
    }

    #[test]
    fn what_docks_is_reported_in_si() {
        let text = include_str!("../../../../scenes/docking.toml");
        // Twice the mass is half the number of units, and so is the energy.
        let halved = text.replace("[run]", "[units]\nmass = \"2 kg\"\n[run]");
        let [one, other] = [text, &halved].map(|text| {
            let scene = Scene::parse("docking", text).unwrap();
            let mut flight = Flight::new(&scene).unwrap();
            fly(&mut flight, 400);
            report(&scene, &flight.docked()[0])
        });
        assert_eq!(one.bodies, ["station", "chaser"]);
        assert_eq!(one.time, one.step as f64 * 0.1);
        assert!((other.energy_loss / one.energy_loss - 2.0).abs() < 1e-9);
        assert_eq!((&other.bodies, other.step), (&one.bodies, one.step));
    }

    #[test]
    fn a_reset_separates_what_has_docked() {
        let scene = scene();
        let mut flight = Flight::new(&scene).unwrap();
        fly(&mut flight, 400);
        let first = (flight.docked().to_vec(), flight.states().to_vec());
        assert_eq!(first.0.len(), 1);
        flight.reset(&scene).unwrap();
        assert_eq!(flight.docked(), []);
        assert_eq!(flight.states(), scene.initial_states());
        fly(&mut flight, 400);
        assert_eq!((flight.docked(), flight.states()), (&*first.0, &*first.1));
    }

    /// Of the two, one is set where it is not docked; what is set where it is docked docks again.
    #[test]
    fn states_that_are_set_separate_what_has_docked() {
        let scene = scene();
        let mut flight = Flight::new(&scene).unwrap();
        fly(&mut flight, 400);
        let chaser = flight.states()[1];
        let mut message = msg::BodyState::from(&lgvi_common::body_sample(
            lgvi_msgs::shm::Name::try_from("chaser").unwrap(),
            &chaser,
            &scene.units,
        ));
        let mut set = |flight: &mut Flight| {
            let states = SetStates::of_message(&scene, std::slice::from_ref(&message)).unwrap();
            flight.try_states(&scene, &states).unwrap();
            flight.set_states(&states).unwrap();
            message.position[2] += 50.0;
        };
        set(&mut flight);
        fly(&mut flight, 401);
        assert_eq!(flight.docked().len(), 2);
        assert!(flight.docked()[1].energy_loss < 1e-12);
        let pair = |flight: &Flight| {
            let [station, chaser] = [0, 1].map(|body| flight.states()[body].position);
            (chaser - station).norm()
        };
        let together = pair(&flight);
        set(&mut flight);
        fly(&mut flight, 600);
        assert_eq!(flight.docked().len(), 2);
        assert!(pair(&flight) > together + 10.0, "{}", pair(&flight));
    }
}
