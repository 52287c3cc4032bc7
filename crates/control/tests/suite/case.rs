//! Reference solutions from `tests/truth/optimal_control.json` at the root of the workspace.

use lgvi_control::{Actuation, Transfer};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Inertia, PointMass, RigidBody};
use nalgebra::{Matrix3, SVector, Vector3};
use serde_json::Value;

/// One parameter set of the file, with its runs at several N.
pub struct Case {
    json: Value,
}

/// The reference solution at one N.
pub struct Reference {
    pub n: usize,
    pub cost: f64,
    pub lambda0: SVector<f64, 12>,
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_fn(|i, _| number(&value[i]))
}

impl Case {
    pub fn load(name: &str) -> Self {
        let path = format!(
            "{}/../../tests/truth/optimal_control.json",
            env!("CARGO_MANIFEST_DIR")
        );
        let text = std::fs::read_to_string(&path).expect(&path);
        let mut all: Value = serde_json::from_str(&text).expect(&path);
        Self {
            json: all[name].take(),
        }
    }

    pub fn references(&self) -> Vec<Reference> {
        let runs = self.json["runs"].as_array().expect("runs");
        let reference = |run: &Value| Reference {
            n: number(&run["N"]) as usize,
            cost: number(&run["cost"]),
            lambda0: SVector::from_fn(|i, _| number(&run["lambda0"][i])),
        };
        runs.iter().map(reference).collect()
    }

    pub fn body(&self) -> RigidBody {
        self.body_with(None)
    }

    fn body_with(&self, axial: Option<f64>) -> RigidBody {
        let arm = Vector3::new(0.5 * number(&self.json["l"]), 0.0, 0.0);
        let mass = number(&self.json["m"]);
        let points = [arm, -arm].map(|position| PointMass {
            mass: 0.5 * mass,
            position,
        });
        let mut moments = vector(&self.json["J"]);
        if let Some(axial) = axial {
            moments.x = axial;
        }
        let inertia = Inertia::principal(moments.into()).expect("inertia");
        RigidBody::new(mass, inertia, points.to_vec()).expect("body")
    }

    pub fn transfer(&self, n: usize) -> Transfer {
        self.with_axial(n, None)
    }

    /// The transfer with another moment of inertia about the dumbbell's axis.
    pub fn with_axial(&self, n: usize, axial: Option<f64>) -> Transfer {
        let boundary = |which: &str| {
            let part = |name: &str| &self.json["bc"][format!("{name}{which}")];
            BodyState {
                position: vector(part("x")),
                linear_momentum: vector(part("gamma")),
                attitude: Matrix3::from_fn(|i, j| number(&part("R")[i][j])),
                angular_momentum: vector(part("Pi")),
            }
        };
        let field = Central {
            gm: number(&self.json["GM"]),
        };
        let h = number(&self.json["T"]) / n as f64;
        let identity = Matrix3::identity();
        let (initial, target) = (boundary("0"), boundary("N"));
        let actuation = Actuation::full(&identity, &identity).expect("weights");
        Transfer::new(
            self.body_with(axial),
            field,
            h,
            n,
            initial,
            target,
            actuation,
        )
        .expect("a transfer")
    }

    /// Reference solutions with a free final time: N, T, J.
    pub fn free_final_times() -> Vec<(usize, f64, f64)> {
        let all = Self::load("free_T_i").json;
        let entry = |(n, found): (&String, &Value)| {
            let n = n.parse().expect("a number of intervals");
            (n, number(&found["T"]), number(&found["J"]))
        };
        let entries = all.as_object().expect("entries");
        entries.iter().map(entry).collect()
    }

    /// The terminal error before each Newton iteration of an independent prototype of the shooting method, from zero
    /// multipliers at N = 200.
    #[allow(dead_code, reason = "the crate's own tests read it")]
    pub fn prototype_history(&self) -> Vec<f64> {
        let history = &self.json["paper_newton_armijo_from_zero_N200"]["hist"];
        history
            .as_array()
            .expect("a history")
            .iter()
            .map(number)
            .collect()
    }
}
