//! Flies a scene of `argv[1]` as often as `argv[2]` says, in Rust alone, keeps all its published states, and prints the
//! shortest time (s): what `benchmarks/overhead.py` compares `Scene.fly` and `Simulation.step` with.

#![allow(clippy::print_stdout)]

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use lgvi_common::load_scene;
use lgvi_propagator::Flight;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("expected a scene file")?;
    let times: u32 = arguments.next().ok_or("expected a number")?.parse()?;
    let scene = load_scene(Path::new(&path))?;
    let scheme = scene.scheme()?;
    let (every, count) = (scene.publishing.state_every.max(1), scene.steps);
    let mut shortest = f64::INFINITY;
    for _ in 0..times {
        let begin = Instant::now();
        let mut flight = Flight::of(&scene, scheme, scene.simulation(scheme)?);
        let kept = (count / every + 1) as usize * scene.bodies.len();
        let (mut states, mut loads) = (Vec::with_capacity(kept), Vec::with_capacity(kept));
        for step in 0..=count {
            if step.is_multiple_of(every) {
                states.extend_from_slice(flight.states());
                loads.extend_from_slice(flight.loads());
            }
            if step < count {
                flight.advance()?;
            }
        }
        black_box((&states, &loads));
        shortest = shortest.min(begin.elapsed().as_secs_f64());
    }
    println!("{shortest:e}");
    Ok(())
}
