//! Reference trajectories of `tests/truth` at the workspace's root.

use lgvi_dynamics::gravity::{Central, Gravity, Multipole, Mutual, Uniform};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, PointMass, RigidBody, Simulation, System};
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

pub struct Case {
    json: Value,
}

/// Largest deviations over the bodies.
#[derive(Debug)]
pub struct Errors {
    pub position: f64,
    pub velocity: f64,
    pub attitude: f64,
    pub angular_velocity: f64,
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_fn(|i, _| number(&value[i]))
}

impl Errors {
    pub fn greatest(&self) -> f64 {
        let errors = [
            self.position,
            self.velocity,
            self.attitude,
            self.angular_velocity,
        ];
        errors.into_iter().fold(0.0, f64::max)
    }
}

impl Case {
    pub fn load(name: &str) -> Self {
        let path = format!(
            "{}/../../tests/truth/{name}.json",
            env!("CARGO_MANIFEST_DIR")
        );
        let text = std::fs::read_to_string(&path).expect(&path);
        Self {
            json: serde_json::from_str(&text).expect(&path),
        }
    }

    pub fn system(&self) -> (System, Vec<BodyState>) {
        let mut bodies = Vec::new();
        let mut states = Vec::new();
        for json in self.json["bodies"].as_array().expect("bodies") {
            let points = json["points"]
                .as_array()
                .expect("points")
                .iter()
                .map(|p| PointMass {
                    mass: number(&p[0]),
                    position: Vector3::new(number(&p[1]), number(&p[2]), number(&p[3])),
                });
            let inertia = Inertia::principal(vector(&json["J"]).into()).expect("inertia");
            let mass = number(&json["mass"]);
            let body = if json["rho_c"].is_array() {
                let position = vector(&json["rho_c"]);
                RigidBody::pivoted(mass, inertia, vec![PointMass { mass, position }])
            } else if self.json["potential"] == "macc2" {
                let multipole = Multipole::of_inertia(mass, &inertia);
                RigidBody::with_multipole(inertia, multipole)
            } else {
                RigidBody::new(mass, inertia, points.collect())
            }
            .expect("body");
            let attitude = Matrix3::from_fn(|i, j| number(&json["R"][i][j]));
            let [x, v, omega] = ["x", "v", "Omega"].map(|key| vector(&json[key]));
            states.push(BodyState::from_velocities(&body, x, v, attitude, omega));
            bodies.push(body);
        }
        let parameter = |name: &str| number(&self.json["parameters"][name]);
        let gravity: Vec<Box<dyn Gravity>> = match self.json["potential"].as_str() {
            Some("none") => vec![],
            Some("points" | "macc2") => vec![Box::new(Mutual::new(parameter("G")))],
            Some("central") => vec![Box::new(Central {
                gm: parameter("GM"),
            })],
            Some("uniform") => vec![Box::new(Uniform {
                acceleration: Vector3::new(0.0, 0.0, parameter("g")),
            })],
            other => panic!("unknown potential {other:?}"),
        };
        (System::new(bodies, gravity), states)
    }

    pub fn simulation(&self, method: Method, h: f64) -> Simulation {
        let (_, states) = self.system();
        self.simulation_from(states, method, h)
    }

    /// The case's bodies from other states.
    pub fn simulation_from(&self, states: Vec<BodyState>, method: Method, h: f64) -> Simulation {
        let (system, _) = self.system();
        Simulation::new(system, states, method, h).expect("a method for the case")
    }

    /// Flies to the reference state at time `t` in `steps` steps.
    pub fn errors_at(&self, t: f64, steps: u32, method: Method) -> Errors {
        let mut simulation = self.simulation(method, t / f64::from(steps));
        let controls = vec![Load::default(); simulation.states().len()];
        for _ in 0..steps {
            simulation.advance(&controls).expect("a step");
        }
        self.compare(t, &simulation)
    }

    pub fn compare(&self, t: f64, simulation: &Simulation) -> Errors {
        self.compare_states(t, simulation.system().bodies(), simulation.states())
    }

    /// Compares `found` with the reference states at time `t`.
    pub fn compare_states(&self, t: f64, bodies: &[RigidBody], found: &[BodyState]) -> Errors {
        let states = self.json["states"].as_array().expect("states");
        let reference = states
            .iter()
            .find(|s| number(&s["t"]) == t)
            .expect("a state at t");
        let y: Vec<f64> = reference["y"]
            .as_array()
            .expect("y")
            .iter()
            .map(number)
            .collect();
        let mut errors = Errors {
            position: 0.0,
            velocity: 0.0,
            attitude: 0.0,
            angular_velocity: 0.0,
        };
        for ((body, state), y) in bodies.iter().zip(found).zip(y.chunks(18)) {
            let at = |from: usize| Vector3::from_column_slice(&y[from..from + 3]);
            let keep = |error: &mut f64, difference: f64| *error = error.max(difference);
            keep(&mut errors.position, (state.position - at(0)).norm());
            keep(&mut errors.velocity, (state.velocity(body) - at(3)).norm());
            let attitude = Matrix3::from_row_slice(&y[6..15]);
            keep(&mut errors.attitude, (state.attitude - attitude).norm());
            keep(
                &mut errors.angular_velocity,
                (state.angular_velocity(body) - at(15)).norm(),
            );
        }
        errors
    }
}
