//! Plans and flies scene files without nodes, and prints a hash of every state:
//! `cargo run --release -p lgvi_scene --example fly -- scenes/*.toml`.

#![allow(clippy::print_stdout)]

use std::collections::hash_map::DefaultHasher;
use std::hash::Hasher;
use std::path::Path;
use std::{env, fs};

use lgvi_control::{NewtonSettings, Start, Transfer, solve, solve_together};
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

/// The transfer of the longest duration.
fn longest(scene: &Scene) -> Result<Transfer, Box<dyn std::error::Error>> {
    let transfer = scene.transfer().ok_or("no maneuver")?;
    Ok(transfer?)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for path in env::args().skip(1) {
        let name = Path::new(&path).file_stem().unwrap_or_default();
        let name = name.to_string_lossy();
        let scene = Scene::parse(&name, &fs::read_to_string(&path)?)?;
        let mut hasher = DefaultHasher::new();

        let mut acting = Vec::new();
        if let (Some(maneuver), Some(transfers)) = (&scene.maneuver, scene.transfers()) {
            let (transfers, settings) = (transfers?, NewtonSettings::default());
            let plans = match maneuver.separation {
                Some(separation) => {
                    solve_together(&transfers, separation, &[], &settings, |_| true)?.plans
                }
                None => vec![solve(&longest(&scene)?, Start::Cold, &settings, |_| true)?],
            };
            for (planned, plan) in maneuver.planned().zip(plans) {
                hash(&mut hasher, &plan.states);
                acting.push((planned, plan));
            }
        }

        let mut simulation = scene.simulation(scene.scheme()?)?;
        let mut loads = vec![Load::default(); scene.bodies.len()];
        hash(&mut hasher, simulation.states());
        for step in 0..scene.steps as usize {
            for (planned, plan) in &acting {
                let body = planned.body;
                if planned.commands() == Commands::Loads {
                    loads[body] = plan.controls.get(step).copied().unwrap_or_default();
                } else if let Some(efforts) = plan.commands.get(step) {
                    let [thrusters, wheels] =
                        [&scene.bodies[body].thrusters, &scene.bodies[body].wheels];
                    simulation.set_thruster_commands(body, &efforts.as_slice()[..thrusters.len()]);
                    simulation.set_wheel_commands(body, &efforts.as_slice()[..wheels.len()]);
                }
            }
            simulation.advance(&loads)?;
            hash(&mut hasher, simulation.states());
        }
        println!("{name}: {} steps, {:016x}", scene.steps, hasher.finish());
    }
    Ok(())
}
