//! Extreme numbers at every key: a scene is either refused or can be started.

use std::path::Path;

use lgvi_dynamics::Load;
use lgvi_scene::{Integration, Scene, Skipping};
use toml::{Table, Value};

/// Scenes with keys that the shipped scenes do not have.
const OTHERS: [&str; 3] = [
    r#"
    title = "A craft with thrusters, its moon and its frames"
    units = { length = "1000 km", mass = "2 t", time = "1 h" }
    run = { duration = 1.0, steps = 20, integrator = "lgvi", subdivide = 3, substeps = 2, skip = { tolerance = 1e-6 } }
    publish = { state_every = 2, ros_every = 5 }
    gravity.uniform.acceleration = [0.0, 0.0, -0.1]
    frames = [{ name = "camera", parent = "craft", position = [0.1, 0.2, 0.3], attitude = { w = 0.6, x = 0.8, y = 0.0, z = 0.0 } }]
    [[bodies]]
    name = "craft"
    mass = 1.0
    inertia = [[1.0, 0.1, 0.0], [0.1, 1.5, 0.2], [0.0, 0.2, 1.2]]
    position = [1.0, 0.5, 0.2]
    velocity = [0.1, 0.2, 0.3]
    attitude = { w = 0.6, x = 0.0, y = 0.8, z = 0.0 }
    angular_velocity = [0.1, 0.2, 0.3]
    [[bodies]]
    name = "moon"
    mass = 3.0
    radius = 0.1
    multipole = { order = 4, ellipsoid = [0.5, 0.4, 0.3] }
    mobility = { circle = { center = [5.0, 1.0, 2.0], rate = [0.1, 0.2, 0.3], spin = [0.3, 0.2, 0.1] } }
    position = [8.0, 2.0, 3.0]
    attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
    [[bodies]]
    name = "probe"
    mass = 1.0
    inertia = [1.0, 1.0, 1.0]
    mobility = { uniform = { velocity = [0.1, 0.2, 0.3], spin = [0.3, 0.2, 0.1] } }
    position = [-8.0, 2.0, 3.0]
    attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
    [maneuver]
    body = "craft"
    actuators = [{ force = [1.0, 0.5, 0.1], moment = [0.1, 0.2, 0.3], weight = 2.0 }, { moment = [0.0, 1.0, 0.3] }]
    constraints = [
        { kind = "commands", limit = [1.0, 2.0] },
        { kind = "keep_out_cone", axis = [0.0, 0.0, 1.0], direction = [1.0, 0.0, 0.0], half_angle = 0.3 },
        { kind = "keep_out_sphere", center = [20.0, 0.0, 1.0], radius = 0.3 },
        { kind = "corridor", apex = [9.0, 9.0, 9.0], axis = [-1.0, -1.0, -1.0], half_angle = 1.3 },
    ]
    final_time = { min = 0.4, max = 0.9, weight = 0.1 }
    replan = { every = 3, deadline = 0.1 }
    solver = { tolerance = 1e-7, max_iterations = 30 }
    target = { position = [1.1, 0.5, 0.2], spin_axis = { axis = [0.0, 0.0, 1.0], direction = [0.1, 0.0, 1.0] }, angular_velocity = [0.1, 0.2, 0.3] }
    [disturbance]
    seed = 3
    force_error = 0.01
    moment_error = 0.02
    position = 0.001
    velocity = 0.001
    attitude = 0.001
    angular_velocity = 0.001
    [ensemble]
    samples = 10
    seed = 3
    force_error = 0.01
    moment_error = 0.01
    bodies = [{ body = "craft", position = 0.001, velocity = 0.001, attitude = 0.001, angular_velocity = 0.001, mass = 0.01, inertia = 0.01 }]
    "#,
    r#"
    title = "A craft that forces and moments turn into another orbit"
    run = { duration = 1.0, steps = 20, integrator = { name = "composition", order = 4, rotor = "exact" } }
    gravity.central = { gm = 4.0, j2 = 1e-3, reference_radius = 0.9, pole = [0.1, 0.2, 1.0], position = [0.1, 0.2, 0.3], radius = 0.5 }
    [[bodies]]
    name = "craft"
    mass = 1.0
    inertia = [1.0, 1.2, 1.4]
    multipole = { order = 2 }
    position = [3.0, 0.5, 0.2]
    velocity = [0.1, 1.0, 0.3]
    attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
    angular_velocity = [0.1, 0.2, 0.3]
    [maneuver]
    body = "craft"
    force_weight = [1.0, 2.0, 3.0]
    moment_weight = [[1.0, 0.1, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 1.0]]
    search = { starts = 2, seed = 4 }
    constraints = [
        { kind = "force_components", limit = [1.0, 2.0, 3.0] },
        { kind = "moment_components", limit = 2.0 },
        { kind = "force_norm", limit = 3.0 },
        { kind = "moment_norm", limit = 3.0 },
    ]
    target = { orbit = { position = [3.0, 0.0, 1.0], velocity = [0.1, 1.0, 0.1] } }
    "#,
    r#"
    title = "Two solids"
    run = { duration = 1.0, steps = 20, integrator = { name = "dormand_prince853", tolerance = 1e-8 }, skip = "nothing" }
    gravity.mutual.constant = 1.0
    [[bodies]]
    name = "tetrahedron"
    mass = 1.0
    polyhedron = { vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], degree = 2 }
    position = [3.0, 0.5, 0.2]
    velocity = [0.1, 1.0, 0.3]
    attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
    angular_velocity = [0.1, 0.2, 0.3]
    [[bodies]]
    name = "brick"
    mass = 1.0
    polyhedron = { cuboid = [1.0, 0.5, 0.3], degree = 2 }
    position = [-3.0, 0.5, 0.2]
    velocity = [-0.1, -1.0, 0.3]
    attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
    angular_velocity = [0.1, 0.2, 0.3]
    [[bodies]]
    name = "pebble"
    mass = 1.0
    polyhedron = { ellipsoid = [0.1, 0.1, 0.2], subdivisions = 0, degree = 2 }
    mobility = "fixed"
    position = [-30.0, 0.5, 0.2]
    attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
    "#,
];

/// Numbers beyond the limits, and values that are not finite.
const REFUSED: [f64; 8] = [
    1e160,
    1e-160,
    f64::MAX,
    5e-324,
    -1e200,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

/// Numbers just within the limits of scenes, or at the limits of single keys.
const ALLOWED: [f64; 8] = [1e100, 1e-100, -1e100, 1e50, 1e-50, 1e30, 1e-30, 0.0];

/// Returns all numbers of a table in order.
fn numbers(value: &mut Value) -> Vec<&mut Value> {
    match value {
        Value::Float(_) | Value::Integer(_) => vec![value],
        Value::Array(values) => values.iter_mut().flat_map(numbers).collect(),
        Value::Table(table) => table
            .iter_mut()
            .flat_map(|(_, value)| numbers(value))
            .collect(),
        _ => Vec::new(),
    }
}

fn with(scene: &Table, changes: &[(usize, Value)]) -> String {
    let mut scene = Value::Table(scene.clone());
    let mut numbers = numbers(&mut scene);
    for (index, value) in changes {
        *numbers[*index] = value.clone();
    }
    toml::to_string(&scene).unwrap()
}

/// Does what every program does with a scene before it flies, and takes a step unless pilot flights or error control
/// could make it long.
fn begin(text: &str) {
    let Ok(mut scene) = Scene::parse("extreme", text) else {
        return;
    };
    if let Integration::Method(method) = scene.integration
        && !matches!(scene.skipping, Skipping::Within(_))
        && !method.has_error_control()
    {
        scene.subdivide = scene.subdivide.min(3);
        let scheme = scene.scheme_by(method, scene.substeps.min(10));
        if let Ok(mut simulation) = scene.simulation(scheme) {
            let _ = simulation.advance(&vec![Load::default(); scene.bodies.len()]);
        }
    }
    let _ = scene.transfer();
    for body in &scene.bodies {
        body.shape();
    }
}

fn scenes() -> Vec<Table> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let paths = std::fs::read_dir(folder).unwrap();
    let mut paths: Vec<_> = paths.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    paths.sort();
    let shipped = paths
        .iter()
        .map(|path| std::fs::read_to_string(path).unwrap());
    let scenes: Vec<Table> = shipped
        .chain(OTHERS.map(String::from))
        .map(|text| {
            Scene::parse("test", &text).unwrap();
            toml::from_str(&text).unwrap()
        })
        .collect();
    scenes
}

fn count(scene: &Table) -> usize {
    numbers(&mut Value::Table(scene.clone())).len()
}

/// If a scene with one of these numbers were accepted, a solver, a decomposition or a flight might never end.
#[test]
fn no_number_of_any_key_is_beyond_the_limits() {
    for scene in scenes() {
        // Arrays repeat the same keys, so the first numbers suffice.
        for index in 0..count(&scene).min(120) {
            for number in REFUSED {
                let text = with(&scene, &[(index, Value::Float(number))]);
                if let Ok(scene) = Scene::parse("extreme", &text) {
                    panic!("{}: {number} is let pass as number {index}", scene.title);
                }
            }
        }
    }
}

#[test]
fn scenes_of_extreme_numbers_are_refused_or_begun() {
    let mut rng = fastrand::Rng::with_seed(6);
    for scene in scenes() {
        let count = count(&scene);
        let extreme = |rng: &mut fastrand::Rng| {
            let index = rng.usize(..count);
            let integer = [0, 1, -1, 1 << 31, 1 << 32, i64::MAX, i64::MIN];
            let value = if rng.bool() {
                Value::Integer(rng.choice(integer).unwrap())
            } else {
                Value::Float(rng.choice(ALLOWED).unwrap())
            };
            (index, value)
        };
        for _ in 0..150 {
            let changes: Vec<_> = (0..rng.usize(1..4)).map(|_| extreme(&mut rng)).collect();
            begin(&with(&scene, &changes));
        }
    }
}

/// A message does not quote a text of a megabyte in full.
#[test]
fn what_is_said_of_a_long_text_is_short() {
    let long = "a".repeat(1 << 20);
    let text = OTHERS[1];
    for (line, instead) in [
        ("name = \"craft\"", format!("name = \"{long}\"")),
        ("body = \"craft\"", format!("body = \"{long}\"")),
        ("title", format!("{long} = 1\ntitle")),
        ("gm = 4.0", format!("gm = \"{long}\"")),
        ("gm = 4.0", format!("{long} = 4.0")),
    ] {
        let error = Scene::parse("long", &text.replacen(line, &instead, 1)).unwrap_err();
        let said = error.to_string();
        assert!(said.len() < 3000, "{} letters are said", said.len());
    }
}
