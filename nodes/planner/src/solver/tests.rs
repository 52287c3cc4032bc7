use lgvi_dynamics::Load;

use super::*;

const SCENE: &str = include_str!("../../../../scenes/inclination_change.toml");

/// The change of inclination in few steps, with other keys and another integrator.
fn scene(keys: &str, integrator: &str) -> Scene {
    let keys = format!("body = \"spacecraft\"\n{keys}\n");
    let text = SCENE
        .replace("steps = 1000", "steps = 100")
        .replace("\"lie_euler\"", integrator)
        .replace("body = \"spacecraft\"\n", &keys);
    Scene::parse("test", &text).unwrap()
}

fn planned(scene: &Scene) -> Plan {
    solved(scene).plan
}

fn solved(scene: &Scene) -> Solved {
    let task = Task {
        first_step: 0,
        initial: Initial::State(scene.bodies[0].state),
        end: End::After(scene.steps as usize),
        guess: None,
        switches: None,
    };
    solve(scene, &task, &mut |_| true).unwrap_or_else(|unsolved| panic!("{}", unsolved.message))
}

/// By how much the plan misses the target when the scene's integrator flies it.
fn miss(scene: &Scene, plan: &Plan) -> f64 {
    let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
    for control in &plan.controls {
        simulation
            .advance(slice::from_ref::<Load>(control))
            .unwrap();
    }
    scene.miss(&simulation.states()[0]).unwrap().norm()
}

#[test]
fn both_methods_plan_the_same() {
    let [newton, shooting] = ["newton", "shooting"].map(|method| {
        let scene = scene(
            &format!("solver = {{ method = \"{method}\" }}"),
            "\"lie_euler\"",
        );
        let plan = planned(&scene);
        assert!(miss(&scene, &plan) < 1e-11);
        plan
    });
    assert!(
        (newton.cost / shooting.cost - 1.0).abs() < 1e-9,
        "{} and {}",
        newton.cost,
        shooting.cost
    );
    for plan in [&newton, &shooting] {
        assert_eq!(plan.feedback.len(), 100);
        let found = &plan.certificate;
        assert!(found.sufficient && found.stationarity < 1e-8, "{found:?}");
    }
    let apart = (newton.feedback[10] - shooting.feedback[10]).norm();
    assert!(apart < 0.01 * newton.feedback[10].norm());
}

/// Flown by the LGVI a processed plan misses by the square of the step, a plain one by the step.
#[test]
fn a_processed_plan_is_flown_by_a_method_of_second_order() {
    let [plain, processed, own] = [
        "dynamics = \"lie_euler\"",
        "processed = true",
        "dynamics = \"lgvi\"",
    ]
    .map(|keys| {
        let scene = scene(keys, "\"lgvi\"");
        miss(&scene, &planned(&scene))
    });
    assert!(processed < 0.1 * plain, "{processed} and {plain}");
    assert!(own < 1e-11, "{own}");
}

/// A search is no worse than the cold start that it includes, and says which minimum it returns.
#[test]
fn a_search_returns_the_cheapest_minimum() {
    let plain = solved(&scene("", "\"lie_euler\""));
    assert_eq!(plain.remark, "");
    let keys = "search = { starts = 12, seed = 1 }";
    let Solved { plan, remark, .. } = solved(&scene(keys, "\"lie_euler\""));
    let (searched, plain) = (plan.cost, plain.plan.cost);
    assert!(searched < plain * (1.0 - 1e-3), "{searched} and {plain}");
    assert!(
        remark.starts_with("minimum 1 of ") && remark.contains(&format!("cost {searched}")),
        "{remark}"
    );
}
