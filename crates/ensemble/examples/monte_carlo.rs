//! A Monte Carlo run with dispersed initial states: `cargo run --release -p lgvi_ensemble --example monte_carlo`.

#![allow(clippy::print_stdout)]

use lgvi_dynamics::lanes::Width;
use lgvi_ensemble::{Campaign, Guidance, Options, Settings, Store, Summary, run};
use lgvi_scene::Scene;

const SCENE: &str = r#"
title = "A satellite on a circular orbit"
run = { duration = 6.283185307179586, steps = 400, integrator = "lgvi" }
gravity = { central = { gm = 1.0 } }

[[bodies]]
name = "satellite"
mass = 1.0
inertia = [0.01, 0.02, 0.025]
position = [1.0, 0.0, 0.0]
velocity = [0.0, 1.0, 0.0]
attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
angular_velocity = [0.0, 0.0, 1.0]

[ensemble]
samples = 1000
seed = 1
bodies = [{ body = "satellite", position = 1e-3, velocity = 1e-3 }]
"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = Scene::parse("satellite", SCENE)?;
    let campaign = Campaign::new(&scene, Settings::default(), Guidance::None)?;
    let directory = tempfile::tempdir()?;
    let store = Store::create(directory.path(), campaign.identity(), campaign.columns())?;
    let options = Options {
        range: None,
        threads: 0,
        width: Width::default(),
    };
    run(&campaign, &store, &options, &|| false, &mut |_| ())?;
    let summary = Summary::of(&store)?;
    for (name, column) in &summary.columns {
        if name.starts_with("satellite.final.position") {
            println!(
                "{name}: {:.4} ± {:.4}",
                column.mean, column.standard_deviation
            );
        }
    }
    Ok(())
}
