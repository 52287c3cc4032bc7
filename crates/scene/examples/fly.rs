//! Plans and flies scene files without nodes, and prints a hash of every state:
//! `cargo run --release -p lgvi_scene --example fly -- scenes/*.toml`.

#![allow(clippy::print_stdout)]

use std::collections::hash_map::DefaultHasher;
use std::hash::Hasher;
use std::path::Path;
use std::{env, fs};

use lgvi_control::{NewtonSettings, Start, solve};
use lgvi_dynamics::{BodyState, Load};
use lgvi_scene::{Commands, Scene};

fn hash(hasher: &mut DefaultHasher, states: &[BodyState]) {
    for state in states {
        let vectors = [
            state.position,
            state.linear_momentum,
            state.angular_momentum,
        ];
        let entries = vectors.iter().flatten().chain(&state.attitude);
        entries.for_each(|entry| hasher.write_u64(entry.to_bits()));
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for path in env::args().skip(1) {
        let name = Path::new(&path).file_stem().unwrap_or_default();
        let name = name.to_string_lossy();
        let scene = Scene::parse(&name, &fs::read_to_string(&path)?)?;
        let mut hasher = DefaultHasher::new();

        let mut controls = Vec::new();
        let mut efforts = Vec::new();
        let mut body = 0;
        if let (Some(maneuver), Some(transfer)) = (&scene.maneuver, scene.transfer()) {
            let plan = solve(&transfer?, Start::Cold, &NewtonSettings::default(), |_| {
                true
            })?;
            hash(&mut hasher, &plan.states);
            body = maneuver.body;
            match maneuver.commands() {
                Commands::Loads => controls = plan.controls,
                Commands::Thrusters | Commands::Wheels => efforts = plan.commands,
            }
        }

        let mut simulation = scene.simulation(scene.scheme()?)?;
        let mut loads = vec![Load::default(); scene.bodies.len()];
        hash(&mut hasher, simulation.states());
        for step in 0..scene.steps {
            loads[body] = controls.get(step as usize).copied().unwrap_or_default();
            if let Some(efforts) = efforts.get(step as usize) {
                let [thrusters, wheels] =
                    [&scene.bodies[body].thrusters, &scene.bodies[body].wheels];
                simulation.set_thruster_commands(body, &efforts.as_slice()[..thrusters.len()]);
                simulation.set_wheel_commands(body, &efforts.as_slice()[..wheels.len()]);
            }
            simulation.advance(&loads)?;
            hash(&mut hasher, simulation.states());
        }
        println!("{name}: {} steps, {:016x}", scene.steps, hasher.finish());
    }
    Ok(())
}
