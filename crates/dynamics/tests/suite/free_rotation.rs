//! The closed form of free rotation against the reference trajectories of free bodies.

use lgvi_dynamics::Inertia;
use lgvi_dynamics::rotation::FreeRotation;
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

/// Errors of attitude (Frobenius norm) and of angular velocity at each time of a reference.
fn errors(name: &str) -> Vec<(f64, f64, f64)> {
    let path = format!(
        "{}/../../tests/truth/{name}.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(&path).expect(&path);
    let json: Value = serde_json::from_str(&text).expect(&path);
    let number = |value: &Value| value.as_f64().expect("a number");
    let body = &json["bodies"][0];
    let vector = |key: &str| Vector3::from_fn(|i, _| number(&body[key][i]));
    let inertia = Inertia::principal(vector("J").into()).expect("inertia");
    let attitude = Matrix3::from_fn(|i, j| number(&body["R"][i][j]));
    let momentum = inertia.matrix() * vector("Omega");
    let flow = FreeRotation::new(&inertia);
    let states = json["states"].as_array().expect("states");
    states
        .iter()
        .map(|state| {
            let t = number(&state["t"]);
            let y = |from: usize| move |i: usize| number(&state["y"][from + i]);
            let (relative, momentum) = flow.flow(&momentum, t);
            let expected = Matrix3::from_fn(|i, j| y(6)(3 * i + j));
            let velocity = inertia.inverse() * momentum;
            (
                t,
                (relative.compose(&attitude) - expected).norm(),
                (velocity - Vector3::from_fn(|i, _| y(15)(i))).norm(),
            )
        })
        .collect()
}

/// To the rounding of the phase, `2⁻⁵² |Ω| t` with |Ω| = 1.35 and 1, at every time. Measured, attitude and Ω:
///
/// | | t = 1 | 10 | 30 | 100 | 1000 |
/// | --- | --- | --- | --- | --- | --- |
/// | b1 | 4.1e-16, 4.2e-16 | 8.1e-16, 3.1e-16 | 3.3e-15, 8.9e-16 | 1.5e-14, 3.0e-15 | 9.2e-14, 2.0e-14 |
/// | b2 | 2.2e-16, 1.4e-19 | 2.3e-16, 1.5e-16 | 3.7e-15, 2.2e-16 | 1.2e-14, 7.0e-15 | 4.7e-14, 1.5e-15 |
#[test]
fn free_rotation_is_exact_at_every_time_of_the_references() {
    for name in ["b1_free_asymmetric", "b2_dzhanibekov"] {
        for (t, attitude, velocity) in errors(name) {
            let bound = 2e-15 + f64::EPSILON * 1.4 * t;
            assert!(attitude < bound, "{name} t = {t}: attitude {attitude:.1e}");
            assert!(velocity < bound, "{name} t = {t}: Ω {velocity:.1e}");
        }
    }
}
