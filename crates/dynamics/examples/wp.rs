#![allow(
    clippy::all,
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::expect_used,
    missing_docs
)]
use lgvi_dynamics::{Load, Method, Simulation};
use std::time::Instant;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let case = lgvi_truth::Case::load(&args[1]).unwrap();
    let t: f64 = args[2].parse().unwrap();
    for which in ["dp", "taylor"] {
        for e in [4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16] {
            let tolerance = 10f64.powi(-e);
            let method = if which == "dp" {
                Method::DormandPrince853 { tolerance }
            } else {
                Method::Taylor { tolerance }
            };
            let mut best = f64::INFINITY;
            let mut states = vec![];
            let mut cuts = 0;
            let mut e0 = 0.0;
            let mut e1 = 0.0;
            for _ in 0..7 {
                let (system, start) = case.system().unwrap();
                let none = vec![Load::default(); start.len()];
                let mut sim = match Simulation::new(system, start, method, t) {
                    Ok(s) => s.with_skips(lgvi_dynamics::Skip::Exact),
                    Err(e) => {
                        println!("{e}");
                        return;
                    }
                };
                e0 = sim.invariants().energy;
                let begin = Instant::now();
                match sim.advance(&none) {
                    Ok(r) => cuts = r.cuts,
                    Err(e) => {
                        println!("{which} {tolerance:e} {e}");
                        break;
                    }
                }
                best = best.min(begin.elapsed().as_secs_f64());
                e1 = sim.invariants().energy;
                states = sim.states().to_vec();
            }
            if states.is_empty() {
                continue;
            }
            let (system, _) = case.system().unwrap();
            let errors = case.errors(t, system.bodies(), &states).unwrap();
            println!(
                "{which} {tolerance:e} steps {cuts} {:.4} ms  {:.2} us/step x {:.1e} R {:.1e} E {:.1e}",
                best * 1e3,
                best * 1e6 / cuts as f64,
                errors.position,
                errors.attitude,
                (e1 - e0) / e0
            );
        }
    }
}
