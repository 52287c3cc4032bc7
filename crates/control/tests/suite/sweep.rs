//! Plans under inequalities.

use lgvi_control::{Constraint, NewtonSettings, Start, solve, Plan, Transfer};
use lgvi_dynamics::gravity::Central;
use nalgebra::Vector3;

use crate::case::Case;

fn go(name: &str, free: &Transfer<Central>, c: Vec<Constraint>) {
    let bound = free.clone().with_constraints(c).unwrap();
    let mut n = 0;
    let mut all = Vec::new();
    let t = std::time::Instant::now();
    let limited = solve(&bound, Start::Cold, &NewtonSettings::default(), |p| { n = p.iteration; all.push(*p); true });
    let t = t.elapsed().as_secs_f64();
    match limited {
        Ok(limited) => println!("{name}: {} its {n} {t:.3}s", limited.cost),
        Err(e) => println!("{name}: {e} its {n} {t:.3}s"),
    }
}

#[test]
fn bounded_force() {
    let n: usize = std::env::var("NN").ok().and_then(|s| s.parse().ok()).unwrap_or(100);
    for set in ["C_i", "C_ii", "Q_i"] {
    let free = Case::load(set).transfer(n);
    let plan = solve(&free, Start::Cold, &NewtonSettings::default(), |_| true).expect("a plan");
    let most = plan.controls.iter().map(|u| u.force.norm()).fold(0.0, f64::max);
    let mc = plan.controls.iter().map(|u| u.force.amax()).fold(0.0, f64::max);
    let mm = plan.controls.iter().map(|u| u.moment.amax()).fold(0.0, f64::max);
    println!("{set} cost {} most {most} {mc} {mm}", plan.cost);
    for part in [0.95, 0.8, 0.7, 0.6, 0.4, 0.1] {
        go(&format!("norm {part}"), &free, vec![Constraint::ForceNorm { limit: part * most }]);
        go(&format!("comp {part}"), &free, vec![Constraint::ForceComponents { limit: Vector3::from_element(part * mc) }]);
        go(&format!("moments {part}"), &free, vec![Constraint::MomentComponents { limit: Vector3::from_element(part * mm) }]);
        go(&format!("both {part}"), &free, vec![Constraint::MomentComponents { limit: Vector3::from_element(part * mm) }, Constraint::ForceNorm { limit: part * most }]);
    }
    let mid = plan.states[n / 2].position;
    let vel = plan.states[n / 2].linear_momentum;
    let side = vel.cross(&mid).normalize();
    for off in [0.0, 0.02, 0.05, 0.1] {
        for r in [0.03, 0.1, 0.2] {
            go(&format!("sphere {off} {r}"), &free, vec![Constraint::KeepOutSphere { center: mid + off * side, radius: r }]);
        }
    }
    let axis = Vector3::x();
    let d = plan.states[n / 2].attitude * axis;
    for off in [0.0, 0.02, 0.1, 0.2] {
        for half in [0.05, 0.2, 0.4] {
            let dir = (d + off * (plan.states[n / 2].attitude * Vector3::new(0.0, 1.0, 0.3)).cross(&d)).normalize();
            go(&format!("cone {off} {half}"), &free, vec![Constraint::KeepOutCone { axis, direction: dir, half_angle: half }]);
        }
    }
    }
}
