//! Plans under inequalities and into other terminal sets, against IPOPT on the same discrete problem
//! (`tests/truth/constrained_control.json`).

use lgvi_control::{
    Actuation, Constraint, Motion, NewtonSettings, Plan, RotationTarget, Start, Terminal, Transfer,
    TranslationTarget, solve,
};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

use crate::case::Case;

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_fn(|i, _| number(&value[i]))
}

pub fn references() -> Value {
    let path = format!(
        "{}/../../tests/truth/constrained_control.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(&path).expect(&path);
    serde_json::from_str(&text).expect(&path)
}

fn constraint(c: &Value) -> Constraint {
    let limit = || number(&c["limit"]);
    match c["kind"].as_str().expect("a kind") {
        "commands" => Constraint::Commands { limit: [limit(); 6] },
        "force_components" => Constraint::ForceComponents {
            limit: vector(&c["limit"]),
        },
        "moment_components" => Constraint::MomentComponents {
            limit: vector(&c["limit"]),
        },
        "force_norm" => Constraint::ForceNorm { limit: limit() },
        "keep_out_sphere" => Constraint::KeepOutSphere {
            center: vector(&c["center"]),
            radius: number(&c["radius"]),
        },
        "keep_out_cone" => Constraint::KeepOutCone {
            axis: vector(&c["axis"]),
            direction: vector(&c["direction"]),
            half_angle: number(&c["half_angle"]),
        },
        "corridor" => Constraint::Corridor {
            apex: vector(&c["apex"]),
            axis: vector(&c["axis"]),
            half_angle: number(&c["half_angle"]),
        },
        kind => panic!("{kind}"),
    }
}

/// The terminal set of a case, by its names.
fn terminal(kinds: &Value, state: &BodyState) -> Terminal {
    let mut terminal = Terminal::from(*state);
    match kinds["translation"].as_str() {
        Some("position") => {
            terminal.translation = TranslationTarget::Position {
                position: state.position,
            }
        }
        Some("orbit") => {
            terminal.translation = TranslationTarget::Orbit {
                gm: 1.0,
                center: Vector3::zeros(),
                position: state.position,
                linear_momentum: state.linear_momentum,
            }
        }
        _ => (),
    }
    match kinds["rotation"].as_str() {
        Some("spin_axis") => {
            let axis = vector(&kinds["axis"]);
            terminal.rotation = RotationTarget::SpinAxis {
                axis,
                direction: state.attitude * axis,
                angular_momentum: state.angular_momentum,
            }
        }
        Some("free") => terminal.rotation = RotationTarget::Free,
        _ => (),
    }
    terminal
}

pub fn transfer(file: &Value, case: &Value) -> Transfer<Central> {
    let n = number(&case["N"]) as usize;
    let set = case["set"].as_str().expect("a set");
    let given = &file["sets"][set];
    let free = if given.is_null() {
        let base = Case::load(set);
        let plain = base.transfer(n);
        let state = plain.target().state().expect("a state");
        let actuation = Actuation::full(&Matrix3::identity(), &Matrix3::identity());
        Transfer::new(
            base.body(),
            Central { gm: 1.0 },
            plain.h(),
            n,
            *plain.initial(),
            terminal(&case["terminal"], &state),
            actuation.expect("weights"),
        )
    } else {
        let column = |row: &Value| (std::array::from_fn(|i| number(&row[i])), 1.0);
        let rows = case["actuators"].as_array().expect("actuators");
        let actuation = Actuation::actuators(&rows.iter().map(column).collect::<Vec<_>>());
        let inertia = Inertia::principal(vector(&given["J"]).into()).expect("inertia");
        let still = |attitude: &Value| BodyState {
            position: Vector3::x(),
            linear_momentum: Vector3::zeros(),
            attitude: Matrix3::from_fn(|i, j| number(&attitude[i][j])),
            angular_momentum: Vector3::zeros(),
        };
        Transfer::new(
            RigidBody::new(1.0, inertia, Vec::new()).expect("a body"),
            Central { gm: 0.0 },
            number(&given["T"]) / n as f64,
            n,
            still(&given["bc"]["R0"]),
            still(&given["bc"]["RN"]),
            actuation.expect("actuators"),
        )
        .map(|transfer| transfer.with_motion(Motion::Rotation))
    };
    let constraints = case["constraints"].as_array().expect("constraints");
    free.expect("a transfer")
        .with_constraints(constraints.iter().map(constraint).collect())
        .expect("constraints")
}

#[test]
fn constrained_costs_are_those_of_ipopt() {
    let file = references();
    for case in file["cases"].as_array().expect("cases") {
        let name = case["name"].as_str().expect("a name");
        let mut iterations = 0;
        let plan: Plan = match solve(
            &transfer(&file, case),
            Start::Cold,
            &NewtonSettings::default(),
            |now| {
                iterations = now.iteration;
                true
            },
        ) { Ok(p) => p, Err(e) => { println!("{name}: {e} its {iterations} expected {}", case["cost"]); continue } };
        let expected = number(&case["cost"]);
        let error = plan.cost / expected - 1.0;
        println!("{name}: {} for {expected}, {error:.1e}, {iterations} iterations", plan.cost);
    }
}
