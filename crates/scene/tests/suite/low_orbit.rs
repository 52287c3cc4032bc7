//! Approaches over meters on low orbits, where positions are millions of meters.

use std::f64::consts::TAU;

use lgvi_control::{NewtonSettings, Start, solve};
use lgvi_dynamics::{BodyState, Load};
use lgvi_scene::Scene;
use nalgebra::Vector3;

/// A chaser, at rest in the inertial frame or in that of the orbit, and the satellite whose corridor it flies through.
struct Approach {
    altitude: f64,
    duration: f64,
    steps: u32,
    half_angle: f64,
    /// Angular velocity of the satellite, body frame (rad/s).
    spin: Vector3<f64>,
    attitude: [f64; 4],
    /// Of the chaser, in the satellite's axes (m).
    start: Vector3<f64>,
}

const APEX: Vector3<f64> = Vector3::new(0.5, 0.0, 0.0);

impl Approach {
    fn random(random: &mut fastrand::Rng) -> Self {
        let mut between = |low: f64, high: f64| low + (high - low) * random.f64();
        let half_angle = between(8.0, 25.0_f64).to_radians();
        let distance = between(15.0, 150.0);
        let (off, around) = (0.8 * half_angle * between(0.0, 1.0), between(0.0, TAU));
        let arm = Vector3::new(
            off.cos(),
            off.sin() * around.cos(),
            off.sin() * around.sin(),
        );
        let mut direction = |_| between(-1.0, 1.0);
        let axis = Vector3::from_fn(|i, _| direction(i)).normalize();
        let attitude = std::array::from_fn(&mut direction);
        Self {
            altitude: between(350e3, 1500e3),
            duration: between(100.0, 900.0),
            steps: 150,
            spin: between(0.0, 0.3_f64).to_radians() * axis,
            attitude,
            start: APEX + distance * arm,
            half_angle,
        }
    }

    fn scene(&self, orbits: bool) -> Scene {
        let [w, x, y, z] = {
            let norm = self.attitude.iter().map(|q| q * q).sum::<f64>().sqrt();
            self.attitude.map(|q| q / norm)
        };
        let array = |v: &Vector3<f64>| format!("[{}, {}, {}]", v.x, v.y, v.z);
        let (gravity, place) = if orbits {
            let radius = 6.378e6 + self.altitude;
            (
                "[gravity.central]\nbody = \"earth\"\n",
                format!(
                    "orbit = {{ semi_major_axis = {radius}, eccentricity = 0.0, inclination = \"51 deg\", raan = \"20 deg\", true_anomaly = \"70 deg\" }}"
                ),
            )
        } else {
            let still = "position = [0, 0, 0]\nvelocity = [0, 0, 0]";
            ("", still.to_owned())
        };
        let text = format!(
            "title = \"Approach\"\n[run]\nduration = {}\nsteps = {}\nintegrator = \"lgvi\"\n{gravity}\
             [[bodies]]\nname = \"satellite\"\nmass = 1900\ninertia = [1600, 2500, 2900]\n{place}\n\
             attitude = {{ w = {w}, x = {x}, y = {y}, z = {z} }}\nangular_velocity = {}\n\
             [[bodies]]\nname = \"chaser\"\nmass = 800\ninertia = [600, 700, 750]\n\
             relative_to = {{ body = \"satellite\", axes = \"body\" }}\nposition = {}\nvelocity = {}\n\
             attitude = {{ w = 0, x = 0, y = 0, z = 1 }}\nangular_velocity = [0, 0, 0]\n\
             [maneuver]\nbody = \"chaser\"\nmotion = \"translation\"\n\
             [[maneuver.constraints]]\nkind = \"corridor\"\nrelative_to = {{ body = \"satellite\", axes = \"body\" }}\n\
             apex = {}\naxis = [1, 0, 0]\nhalf_angle = {}\n\
             [[maneuver.constraints]]\nkind = \"force_norm\"\nlimit = {}\n\
             [maneuver.target]\nrelative_to = {{ body = \"satellite\", axes = \"body\" }}\nposition = [3, 0, 0]\nvelocity = [0, 0, 0]\n",
            self.duration,
            self.steps,
            array(&self.spin),
            array(&self.start),
            array(&-self.spin.cross(&self.start)),
            array(&APEX),
            self.half_angle,
            // Ten times what it takes at rest to go straight.
            10.0 * 800.0 * 4.0 * self.start.norm() / (self.duration * self.duration),
        );
        Scene::parse("approach", &text).unwrap_or_else(|error| panic!("{text}: {error}"))
    }
}

/// The satellite's states in a flight without control.
fn satellite(scene: &Scene) -> Vec<BodyState> {
    let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
    let mut all = vec![simulation.states()[0]];
    for _ in 0..scene.steps {
        simulation.advance(&[Load::default(); 2]).unwrap();
        all.push(simulation.states()[0]);
    }
    all
}

/// The orbit changes nothing about whether a plan is found, and little about its cost.
#[test]
fn an_approach_in_a_low_orbit_is_planned_like_one_in_free_space() {
    let mut random = fastrand::Rng::with_seed(2026);
    for number in 0..12 {
        let mut approach = Approach::random(&mut random);
        if number % 4 == 0 {
            approach.steps = 600;
        }
        let [free, low] = [false, true].map(|orbits| {
            let scene = approach.scene(orbits);
            let transfer = scene.transfer().unwrap().unwrap();
            let mut iterations = 0;
            let plan = solve(&transfer, Start::Cold, &NewtonSettings::default(), |_| {
                iterations += 1;
                iterations < 300
            })
            .unwrap_or_else(|error| panic!("approach {number}, in orbit {orbits}: {error}"));
            let axis = Vector3::x();
            for (k, (state, other)) in plan.states.iter().zip(satellite(&scene)).enumerate() {
                let seen = other.attitude.tr_mul(&(state.position - other.position)) - APEX;
                let angle = seen.cross(&axis).norm().atan2(seen.x);
                assert!(
                    angle <= approach.half_angle + 1e-6,
                    "approach {number}, in orbit {orbits}: {angle} rad at step {k}"
                );
            }
            plan.cost
        });
        assert!(
            (low / free - 1.0).abs() < 0.2,
            "approach {number}: costs {low} and {free}"
        );
    }
}
