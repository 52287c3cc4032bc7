mod errors;
mod inertial;
mod sight;
mod statistics;
mod timing;

use lgvi_msgs::geometry_msgs::Vector3 as Components;
use lgvi_msgs::msg::ControlSequence;

use super::*;
use crate::Controls;

/// A flight with its sensors.
struct Run {
    scene: Arc<Scene>,
    flight: Flight,
    sensors: Sensors,
    listened: Listened,
}

impl Run {
    /// To all of whose sensors somebody listens.
    fn new(text: &str) -> Self {
        let scene = Arc::new(Scene::parse("test", text).unwrap());
        let listened: Listened = scene.sensors.iter().map(|_| true.into()).collect();
        Self {
            flight: Flight::new(&scene).unwrap(),
            sensors: Sensors::new(&scene, Arc::clone(&listened)),
            scene,
            listened,
        }
    }

    fn listen(&self, sensor: usize, listens: bool) {
        self.listened[sensor].store(listens, Ordering::Relaxed);
    }

    /// What is published at the present step.
    fn publish(&mut self) -> Vec<Reading> {
        std::iter::from_fn(|| self.sensors.take()).collect()
    }

    /// What is published where the flight begins or its states have been set.
    fn begin(&mut self) -> Vec<Reading> {
        self.sensors.begin(&self.flight);
        self.sensors.read(&self.flight);
        self.publish()
    }

    /// Makes a step; what is published at its end.
    fn step(&mut self) -> Vec<Reading> {
        self.sensors.depart(&self.flight);
        self.flight.advance().unwrap();
        self.sensors.arrive(&self.flight);
        self.publish()
    }

    /// What is published in so many steps, and with which step it comes.
    fn steps(&mut self, steps: u64) -> Vec<(u64, Reading)> {
        (0..steps)
            .flat_map(|_| {
                let readings = self.step();
                let step = self.flight.step();
                readings.into_iter().map(move |reading| (step, reading))
            })
            .collect()
    }

    /// Has a load act on a body for the rest of the flight.
    fn command(&mut self, body: usize, force: [f64; 3], moment: [f64; 3], frame: &str) {
        let components = |[x, y, z]: [f64; 3]| Components { x, y, z };
        let mut message = ControlSequence {
            body: self.scene.bodies[body].name.clone(),
            first_step: self.flight.step(),
            step_size: self.scene.seconds(1),
            force: vec![components(force); 10_000],
            moment: vec![components(moment); 10_000],
            ..Default::default()
        };
        message.header.frame_id = frame.into();
        let controls = Controls::of_message(&self.scene, &message).unwrap();
        self.flight.accept(controls).unwrap();
    }
}

/// Rate and specific force of a reading.
fn inertial(reading: &Reading) -> [Vector3<f64>; 2] {
    match reading.truth {
        Truth::Inertial { rate, force, .. } => [rate, force],
        other => panic!("{other:?}"),
    }
}

/// A run of 10 000 steps of `h`, in which bodies turn exactly.
fn run(h: f64, rest: &str) -> String {
    let duration = 1e4 * h;
    format!(
        "title = \"t\"\n[run]\nduration = {duration:?}\nsteps = 10000\nintegrator = {{ name = \"lgvi\", rotor = \"exact\" }}\n{rest}"
    )
}

/// A body with these keys beside those of its place and its sensors, which follow it.
fn body(name: &str, place: &str, sensors: &str) -> String {
    format!(
        "[[bodies]]\nname = \"{name}\"\nmass = 2.0\ninertia = [1.0, 2.0, 2.5]\n{place}\n{sensors}"
    )
}

/// At rest, or as it is said.
fn place(position: [f64; 3], velocity: [f64; 3], rate: [f64; 3]) -> String {
    format!(
        "position = {position:?}\nvelocity = {velocity:?}\nangular_velocity = {rate:?}\nattitude = {{ w = 1, x = 0, y = 0, z = 0 }}"
    )
}

/// A sensor with these keys.
fn sensor(kind: &str, name: &str, keys: &str) -> String {
    format!("[[bodies.sensors]]\nname = \"{name}\"\nkind = \"{kind}\"\n{keys}\n")
}

/// A frame `arm` of the body `craft` that is turned by a quarter about x.
fn arm(position: [f64; 3]) -> String {
    format!(
        "[[frames]]\nname = \"arm\"\nparent = \"craft\"\nposition = {position:?}\nattitude = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]\n"
    )
}
