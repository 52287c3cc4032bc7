use lgvi_scene::{
    Exclusion, Gnss, Imu, InertialErrors, RelativePose, Scene, SensitivityErrors, Sensor,
    SensorKind, StarTracker, Toward,
};
use nalgebra::{Matrix3, Vector3};

use crate::{BODY, RUN, assert_refused, with};

const SENSORS: &str = r#"
[[bodies.sensors]]
name = "imu_a"
kind = "imu"
frame = "eye"
period = 0.2
delay = 0.3
seed = 7
[bodies.sensors.gyroscope]
noise_density = 1e-4
bias = 2e-4
bias_instability = 3e-5
correlation_time = 100.0
random_walk = 1e-6
scale_factor = 1e-3
misalignment = "90 deg"
range = 5.0
[bodies.sensors.accelerometer]
sensitivity = [[0.1, 0, 0], [0, 0, 0.2], [0, 0, 0]]

[[bodies.sensors]]
name = "stars"
kind = "star_tracker"
period = 0.1
cross_boresight = "180 deg"
about_boresight = 1e-3
exclusions = [
    { body = "station", half_angle = "90 deg" },
    { direction = [0.0, 3.0, 0.0], half_angle = 0.5 },
    { half_angle = 0.25 },
]
max_rate = 0.02

[[bodies.sensors]]
name = "gnss"
kind = "gnss"
period = 0.5
position = 2.0
velocity = 0.01

[[bodies.sensors]]
name = "camera"
kind = "relative_pose"
frame = "eye"
period = 0.1
target = "station"
field_of_view = "90 deg"
min_range = 0.5
max_range = 100.0
position = 0.01
position_per_range = 0.002
attitude = 0.03
"#;

const REST: &str = r#"
[[frames]]
name = "eye"
parent = "craft"
position = [0.0, 0.0, 2.0]

[[frames]]
name = "mark"
parent = "inertial"

[gravity.central]
gm = 1e-9
position = [0.0, 0.0, 1000.0]
"#;

/// A hundred steps of 0.01.
fn text(sensors: &str) -> String {
    let craft = format!("[[bodies]]\nname = \"craft\"{BODY}{sensors}");
    format!("{RUN}\n{craft}\n[[bodies]]\nname = \"station\"{BODY}{REST}")
}

fn compiled(text: &str) -> Vec<Sensor> {
    Scene::parse("test", text).unwrap().sensors
}

#[test]
fn sensors_are_compiled_with_their_errors() {
    let scene = Scene::parse("test", &text(SENSORS)).unwrap();
    let [imu, stars, gnss, camera] = &scene.sensors[..] else {
        panic!("{:?}", scene.sensors)
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    assert_eq!([imu.every, imu.delay, imu.seed], [20, 30, 7]);
    assert_eq!(imu.mount.position, Vector3::new(0.0, 0.0, 2.0));
    assert_eq!([&*imu.frame, &*stars.frame], ["eye", "craft"]);
    let none = SensitivityErrors::Given(Matrix3::new(0.1, 0.0, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0));
    let expected = Imu {
        gyroscope: InertialErrors {
            noise_density: 1e-4,
            bias: 2e-4,
            bias_instability: 3e-5,
            correlation_time: 100.0,
            random_walk: 1e-6,
            sensitivity: SensitivityErrors::Drawn {
                scale_factor: 1e-3,
                misalignment: quarter,
            },
            range: 5.0,
        },
        accelerometer: InertialErrors {
            noise_density: 0.0,
            bias: 0.0,
            bias_instability: 0.0,
            correlation_time: f64::INFINITY,
            random_walk: 0.0,
            sensitivity: none,
            range: f64::INFINITY,
        },
    };
    assert_eq!(imu.kind, SensorKind::Imu(expected));
    let exclusion = |toward, half_angle| Exclusion { toward, half_angle };
    let expected = StarTracker {
        cross_boresight: 2.0 * quarter,
        about_boresight: 1e-3,
        exclusions: vec![
            exclusion(Toward::Body(1), quarter),
            exclusion(Toward::Direction(Vector3::y()), 0.5),
            exclusion(Toward::Attractor, 0.25),
        ],
        max_rate: 0.02,
    };
    assert_eq!(stars.kind, SensorKind::StarTracker(expected));
    let expected = Gnss {
        position: 2.0,
        velocity: 0.01,
    };
    assert_eq!(gnss.kind, SensorKind::Gnss(expected));
    let expected = RelativePose {
        target: 1,
        field_of_view: quarter,
        range: [0.5, 100.0],
        position: 0.01,
        position_per_range: 0.002,
        attitude: 0.03,
    };
    assert_eq!(camera.kind, SensorKind::RelativePose(expected));
    let prefixed = scene.with_frame_prefix("a/");
    assert_eq!(prefixed.sensors[0].frame, "a/eye");
}

/// Each sensor has its own errors, which the names and the scene's seed determine.
#[test]
fn seeds_are_made_of_names_and_the_seed_of_the_scene() {
    let seeds = |text: &str| -> Vec<_> {
        let sensors = compiled(text);
        sensors.iter().map(|sensor| sensor.seed).collect()
    };
    let own = seeds(&text(SENSORS));
    let mut distinct = own.clone();
    distinct.sort_unstable();
    distinct.dedup();
    assert_eq!(distinct.len(), own.len());
    let of_scene = with(
        &text(SENSORS),
        "steps = 100\n",
        "steps = 100\nsensor_seed = 1\n",
    );
    let others = seeds(&of_scene);
    assert_eq!(own[0], others[0]);
    assert!(
        own[1..]
            .iter()
            .zip(&others[1..])
            .all(|(one, other)| one != other)
    );
    let renamed = seeds(&with(&text(SENSORS), "\"craft\"", "\"crane\""));
    assert!(
        own[1..]
            .iter()
            .zip(&renamed[1..])
            .all(|(one, other)| one != other)
    );
    // The same on every machine and in every version; an independent implementation in Python gives the same.
    assert_eq!(own[1], 0x18b72cb8edc4d92b);
}

#[test]
fn mistakes_in_sensors_are_named() {
    for (line, instead, parts) in [
        (
            "frame = \"eye\"\nperiod = 0.2",
            "frame = \"mark\"\nperiod = 0.2",
            &[
                "line 21",
                "`bodies[0].sensors[0].frame` is \"mark\"",
                "a frame that is fixed in craft: one of craft, eye",
            ][..],
        ),
        (
            "frame = \"eye\"\nperiod = 0.2",
            "frame = \"\"\nperiod = 0.2",
            &["`bodies[0].sensors[0].frame` is \"\"", "craft, eye"],
        ),
        (
            "period = 0.2",
            "period = 0.205",
            &[
                "`bodies[0].sensors[0].period` is 0.205",
                "whole number",
                "steps of 0.01",
            ],
        ),
        (
            "period = 0.2",
            "period = 0.0",
            &["`bodies[0].sensors[0].period` is 0.0", "0.01 at least"],
        ),
        (
            "period = 0.2",
            "period = 2.0",
            &[
                "`bodies[0].sensors[0].period` is 2.0",
                "no longer than the run",
            ],
        ),
        (
            "period = 0.2",
            "period = nan",
            &["`bodies[0].sensors[0].period` is NaN", "whole number"],
        ),
        (
            "delay = 0.3",
            "delay = -0.3",
            &["`bodies[0].sensors[0].delay` is -0.3", "whole number"],
        ),
        (
            "delay = 0.3",
            "delay = 1000.0",
            &[
                "`bodies[0].sensors[0].delay` is 1000.0",
                "1000 periods at most",
            ],
        ),
        ("seed = 7", "seed = -7", &["expected u64"]),
        (
            "seed = 7",
            "sead = 7",
            &["unknown field `sead`", "did you mean `seed`?"],
        ),
        (
            "kind = \"imu\"",
            "kind = \"imo\"",
            &["unknown variant `imo`", "did you mean `imu`?"],
        ),
        ("kind = \"imu\"\n", "", &["missing field `kind`"]),
        (
            "name = \"imu_a\"",
            "name = \"a__b\"",
            &[
                "`bodies[0].sensors[0].name` is \"a__b\"",
                "single underscores",
            ],
        ),
        (
            "name = \"stars\"",
            "name = \"imu_a\"",
            &["`bodies[0].sensors[1].name`", "no other sensor of the body"],
        ),
        (
            "bias = 2e-4",
            "bias = -2e-4",
            &[
                "line 27",
                "`bodies[0].sensors[0].gyroscope.bias` is -0.0002",
                "≥ 0",
            ],
        ),
        (
            "noise_density = 1e-4",
            "noise_density = inf",
            &["sensors[0].gyroscope.noise_density` is inf", "≥ 0"],
        ),
        (
            "correlation_time = 100.0\n",
            "",
            &[
                "sensors[0].gyroscope.correlation_time` is missing",
                "`bias_instability`",
            ],
        ),
        (
            "range = 5.0",
            "range = 0.0",
            &["sensors[0].gyroscope.range` is 0.0", "> 0"],
        ),
        (
            "range = 5.0",
            "sensitivity = [[0, 0, 0], [0, 0, 0], [0, 0, 0]]",
            &["gyroscope.sensitivity", "none beside `scale_factor`"],
        ),
        (
            "0.2], [0, 0, 0]]",
            "2.0], [0, 0, 0]]",
            &["accelerometer.sensitivity", "between −1 and 1"],
        ),
        (
            "misalignment = \"90 deg\"",
            "misalignment = 90",
            &["gyroscope.misalignment` is 90", "\"90 deg\""],
        ),
        (
            "about_boresight = 1e-3",
            "about_boresight = \"-1 deg\"",
            &["sensors[1].about_boresight", "0 to half a turn"],
        ),
        (
            "body = \"station\", half",
            "body = \"craft\", half",
            &[
                "`bodies[0].sensors[1].exclusions[0].body` is \"craft\"",
                "one of station",
            ],
        ),
        (
            "body = \"station\", half",
            "body = \"station\", direction = [1, 0, 0], half",
            &["sensors[1].exclusions[0].body", "none beside `direction`"],
        ),
        (
            "direction = [0.0, 3.0, 0.0]",
            "direction = [0.0, 0.0, 0.0]",
            &["line 45", "sensors[1].exclusions[1].direction", "not all 0"],
        ),
        (
            "{ half_angle = 0.25 }",
            "{ half_angle = 0.0 }",
            &["sensors[1].exclusions[2].half_angle", "above 0"],
        ),
        (
            "[gravity.central]\ngm = 1e-9\nposition = [0.0, 0.0, 1000.0]\n",
            "",
            &[
                "sensors[1].exclusions[2].body` is missing",
                "no central attractor",
            ],
        ),
        (
            "max_rate = 0.02",
            "max_rate = -1.0",
            &["sensors[1].max_rate` is -1.0", "> 0"],
        ),
        (
            "velocity = 0.01\n",
            "velocity = -0.01\n",
            &["sensors[2].velocity` is -0.01", "≥ 0"],
        ),
        (
            "target = \"station\"",
            "target = \"craft\"",
            &["sensors[3].target` is \"craft\"", "one of station"],
        ),
        (
            "min_range = 0.5",
            "min_range = 100.0",
            &["sensors[3].min_range` is 100.0", "below `max_range`"],
        ),
        (
            "field_of_view = \"90 deg\"",
            "field_of_view = \"200 deg\"",
            &["sensors[3].field_of_view", "half a turn"],
        ),
        (
            "steps = 100\n",
            "steps = 100\nsensor_seed = -1\n",
            &["expected u64"],
        ),
    ] {
        assert_refused(&with(&text(SENSORS), line, instead), parts);
    }
    let lone = "[[bodies.sensors]]\nname = \"c\"\nkind = \"relative_pose\"\nperiod = 0.1\ntarget = \"x\"\n";
    let alone = format!("{RUN}\n[[bodies]]\nname = \"craft\"{BODY}{lone}");
    assert_refused(
        &alone,
        &["sensors[0].target` is \"x\"", "the scene has none"],
    );
    let one = |name: usize| {
        format!("[[bodies.sensors]]\nname = \"s{name}\"\nkind = \"imu\"\nperiod = 0.1\n")
    };
    let many: String = (0..257).map(one).collect();
    assert_refused(&text(&many), &["is 257", "256 sensors at most"]);
    assert_eq!(
        compiled(&text(&(0..256).map(one).collect::<String>())).len(),
        256
    );
}
