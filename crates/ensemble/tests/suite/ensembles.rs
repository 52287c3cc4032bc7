//! Complete ensembles: the same bytes for all numbers of threads and lanes, shards and interruptions.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::cell::Cell;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicU64;

use lgvi_dynamics::lanes::Width;
use lgvi_dynamics::{BodyState, Load};
use lgvi_ensemble::{
    Campaign, Command, Commands, EnsembleError, FailureKind, FlownBy, Guidance, MergeOptions,
    Options, Report, Row, Settings, Store, Summary, draw, merge, run,
};
use lgvi_scene::Scene;
use nalgebra::Vector3;
use tempfile::TempDir;

const DUMBBELLS: &str = include_str!("../../../../scenes/two_dumbbells.toml");
const CAPTURE: &str = include_str!("../../../../scenes/orbital_capture.toml");

/// Number of samples in a part for flights this short.
const PART: u64 = 1024;

const SPREAD: &str = r#"
[ensemble]
samples = 2500
seed = 11

[[ensemble.bodies]]
body = "dumbbell1"
position = 0.01
attitude = 0.1
mass = 0.02
inertia = 0.05

[[ensemble.bodies]]
body = "dumbbell2"
velocity = 0.02
angular_velocity = 0.3
"#;

/// Returns a scene with two dumbbells, few steps and deviations.
fn dumbbells(more: &[(&str, &str)]) -> Scene {
    let mut text = format!("{DUMBBELLS}{SPREAD}");
    let short = [
        ("duration = 30.0", "duration = 0.06"),
        ("steps = 15000", "steps = 30"),
    ];
    for (line, instead) in short.iter().chain(more) {
        assert!(text.contains(line), "{line}");
        text = text.replace(line, instead);
    }
    Scene::parse("two_dumbbells", &text).unwrap()
}

fn campaign(scene: &Scene) -> Campaign<'_> {
    Campaign::new(scene, Settings::default(), Guidance::None).unwrap()
}

const OPTIONS: Options = Options {
    range: None,
    threads: 1,
    width: Width::Eight,
};

fn fly(campaign: &Campaign<'_>, directory: &Path, options: &Options) -> Report {
    let store = Store::create(directory, campaign.identity(), campaign.columns()).unwrap();
    run(campaign, &store, options, &|| false, &mut |_| ()).unwrap()
}

/// Returns the names and contents of all files in a directory.
fn contents(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(directory).unwrap().map(|entry| entry.unwrap());
    let read = |entry: fs::DirEntry| {
        let name = entry.file_name().into_string().unwrap();
        (name, fs::read(entry.path()).unwrap())
    };
    entries.map(read).collect()
}

/// Makes an uninterrupted run by one thread, one sample at a time.
fn whole(campaign: &Campaign<'_>, temporary: &TempDir) -> (PathBuf, BTreeMap<String, Vec<u8>>) {
    let directory = temporary.path().join("whole");
    let options = Options {
        width: Width::One,
        ..OPTIONS
    };
    let report = fly(campaign, &directory, &options);
    assert_eq!((report.flown, report.kept), (campaign.samples(), 0));
    let contents = contents(&directory);
    assert_eq!(contents.len() as u64, campaign.samples().div_ceil(PART));
    (directory, contents)
}

#[test]
fn results_do_not_depend_on_threads_and_lanes() {
    let temporary = TempDir::new().unwrap();
    let scene = dumbbells(&[]);
    let campaign = campaign(&scene);
    assert_eq!(campaign.flown_by(), &FlownBy::Lanes);
    let (_, expected) = whole(&campaign, &temporary);
    for threads in 1..=3 {
        for width in [Width::One, Width::Eight] {
            let directory = temporary
                .path()
                .join(format!("{threads}_{}", width.lanes()));
            fly(
                &campaign,
                &directory,
                &Options {
                    threads,
                    width,
                    range: None,
                },
            );
            assert!(
                contents(&directory) == expected,
                "{threads} threads, {width:?}"
            );
        }
    }
}

/// Merges shards with arbitrary boundaries in arbitrary order.
#[test]
fn merged_shards_are_the_run_that_was_not_cut() {
    let temporary = TempDir::new().unwrap();
    let scene = dumbbells(&[]);
    let campaign = campaign(&scene);
    let (_, expected) = whole(&campaign, &temporary);
    let mut shards = Vec::new();
    for range in [1000..1700, 0..1000, 2400..2500, 1700..2400] {
        let shard = temporary.path().join(format!("shard_{}", range.start));
        fly(
            &campaign,
            &shard,
            &Options {
                range: Some(range),
                ..OPTIONS
            },
        );
        shards.push(shard);
    }
    let merged = temporary.path().join("merged");
    let (_, report) = merge(&shards, &merged, MergeOptions::default()).unwrap();
    assert_eq!((report.samples, report.missing), (2500, 0));
    assert!(contents(&merged) == expected);

    let error = |shards: &[PathBuf], name: &str| {
        let output = temporary.path().join(name);
        let error = merge(shards, &output, MergeOptions::default())
            .err()
            .unwrap();
        assert!(!output.exists(), "{error}");
        error
    };
    let gap = error(&shards[..3], "gap");
    assert!(
        matches!(&gap, EnsembleError::Gap { range } if *range == (1700..2400)),
        "{gap}"
    );
    let gap = error(&[shards[0].clone(), shards[1].clone()], "end");
    assert!(
        matches!(&gap, EnsembleError::Gap { range } if *range == (1700..2500)),
        "{gap}"
    );
    let allowed = MergeOptions { allow_gaps: true };
    let output = temporary.path().join("gaps");
    let (store, report) = merge(&shards[..3], &output, allowed).unwrap();
    assert_eq!((report.samples, report.missing), (1800, 700));
    assert_eq!(Summary::of(&store).unwrap().present, 1800);

    let more = temporary.path().join("more");
    fly(
        &campaign,
        &more,
        &Options {
            range: Some(1699..1701),
            ..OPTIONS
        },
    );
    let twice = error(&[shards.clone(), vec![more]].concat(), "twice");
    assert!(matches!(twice, EnsembleError::Overlap { .. }), "{twice}");
    let other = dumbbells(&[("seed = 11", "seed = 12")]);
    let foreign = temporary.path().join("foreign");
    fly(
        &self::campaign(&other),
        &foreign,
        &Options {
            range: Some(1000..1700),
            ..OPTIONS
        },
    );
    let foreign = error(&[vec![foreign], shards[1..].to_vec()].concat(), "strange");
    let text = foreign.to_string();
    assert!(
        text.contains("seed is") && text.contains("11") && text.contains("12"),
        "{text}"
    );
    let nothing = error(&[temporary.path().join("nowhere")], "nothing");
    assert!(
        matches!(nothing, EnsembleError::Nothing { .. }),
        "{nothing}"
    );
    let again = merge(&shards, &merged, MergeOptions::default())
        .err()
        .unwrap();
    assert!(matches!(again, EnsembleError::Occupied { .. }), "{again}");
}

/// A run is stopped midway, leaves half a part behind, and continues to the same result.
#[test]
fn an_ended_run_goes_on_from_its_parts() {
    let temporary = TempDir::new().unwrap();
    let scene = dumbbells(&[]);
    let campaign = campaign(&scene);
    let (_, expected) = whole(&campaign, &temporary);
    let directory = temporary.path().join("ended");
    let store = Store::create(&directory, campaign.identity(), campaign.columns()).unwrap();
    let done = Cell::new(0);
    let stop = || done.get() > 0;
    let report = run(&campaign, &store, &OPTIONS, &stop, &mut |now| {
        done.set(now.done)
    })
    .unwrap();
    assert!(!report.is_complete() && report.flown >= PART, "{report:?}");
    fs::write(directory.join(".samples_half.tmp"), "PAR1").unwrap();
    let rest = run(&campaign, &store, &OPTIONS, &|| false, &mut |_| ()).unwrap();
    assert_eq!((rest.kept, rest.kept + rest.flown), (report.flown, 2500));
    assert!(contents(&directory) == expected);
    let nothing = run(&campaign, &store, &OPTIONS, &|| false, &mut |_| ()).unwrap();
    assert_eq!((nothing.kept, nothing.flown), (2500, 0));
}

#[test]
fn parts_of_others_and_damaged_ones_are_refused() {
    let temporary = TempDir::new().unwrap();
    let scene = dumbbells(&[]);
    let directory = temporary.path().join("run");
    let options = Options {
        range: Some(0..40),
        ..OPTIONS
    };
    fly(&campaign(&scene), &directory, &options);
    for (change, what) in [
        (("seed = 11", "seed = 12"), "seed is"),
        (("samples = 2500", "samples = 2501"), "samples is"),
        (("mass = 0.02", "mass = 0.03"), "scene or commands is"),
        (
            ("integrator = \"lgvi\"", "integrator = \"lie_euler\""),
            "integrator is",
        ),
    ] {
        let other = dumbbells(&[change]);
        let campaign = campaign(&other);
        let store = Store::create(&directory, campaign.identity(), campaign.columns()).unwrap();
        let error = run(&campaign, &store, &options, &|| false, &mut |_| ()).unwrap_err();
        assert!(matches!(error, EnsembleError::Foreign { .. }), "{error}");
        assert!(error.to_string().contains(what), "{error}");
    }
    let campaign = campaign(&scene);
    let store = Store::create(&directory, campaign.identity(), campaign.columns()).unwrap();
    let fly = |range| {
        let options = Options {
            range: Some(range),
            ..OPTIONS
        };
        run(&campaign, &store, &options, &|| false, &mut |_| ()).unwrap_err()
    };
    let cut = fly(20..60);
    assert!(
        matches!(&cut, EnsembleError::Cut { missing, .. } if *missing == (40..60)),
        "{cut}"
    );
    assert!(matches!(
        fly(2400..2501),
        EnsembleError::Range { samples: 2500, .. }
    ));
    assert!(matches!(fly(7..7), EnsembleError::Range { .. }));
    let part = directory.join("samples_0000000000_0000000040.parquet");
    let bytes = fs::read(&part).unwrap();
    for damage in [
        &bytes[..bytes.len() / 2],
        &bytes[..0],
        &bytes[bytes.len() / 2..],
    ] {
        fs::write(&part, damage).unwrap();
        let error = fly(0..40);
        assert!(
            matches!(&error, EnsembleError::Damaged { path, .. } if *path == part),
            "{error}"
        );
    }
    // A part with a wrong file name.
    fs::write(&part, &bytes).unwrap();
    fs::rename(
        &part,
        directory.join("samples_0000000040_0000000080.parquet"),
    )
    .unwrap();
    let error = Summary::of(&store).unwrap_err();
    assert!(matches!(error, EnsembleError::Damaged { .. }), "{error}");
}

/// Flights that lanes do not support are flown one by one, with the same numbers where both are possible.
#[test]
fn lanes_and_simulations_come_to_the_same_rows() {
    // Subdivision requires a simulation even if it is never needed.
    let subdivided = ("steps = 30\n", "steps = 30\nsubdivide = 1\n");
    for integrator in [
        "integrator = \"lgvi\"",
        "integrator = { name = \"lgvi\", rotor = \"exact\" }",
        "integrator = { name = \"nystrom\", order = 6 }",
    ] {
        let integrator = ("integrator = \"lgvi\"", integrator);
        let (lanes, simulated) = (
            dumbbells(&[integrator]),
            dumbbells(&[integrator, subdivided]),
        );
        let (one, other) = (campaign(&lanes), campaign(&simulated));
        assert_eq!(one.flown_by(), &FlownBy::Lanes);
        assert!(matches!(other.flown_by(), FlownBy::Simulation { .. }));
        assert_eq!(one.fly(3..70, Width::Eight), other.fly(3..70, Width::Eight));
    }
    let lanes = dumbbells(&[]);
    let one = campaign(&lanes);
    let taylor = "integrator = { name = \"taylor\", tolerance = 1e-12 }";
    let taylor = dumbbells(&[("integrator = \"lgvi\"", taylor)]);
    let taylor = campaign(&taylor);
    assert!(matches!(taylor.flown_by(), FlownBy::Simulation { .. }));
    let nearby = one.fly(3..5, Width::Eight);
    for (row, near) in taylor.fly(3..5, Width::Eight).iter().zip(&nearby) {
        for (a, b) in row.numbers.iter().zip(&near.numbers) {
            assert!((a - b).abs() < 1e-3 * b.abs().max(0.1), "{a} {b}");
        }
    }
}

/// The samples of bodies that dock, each with its own masses.
#[test]
fn samples_dock() {
    let docking = r#"
[[docking]]
ports = [
    { body = "dumbbell1", position = [0.0, 0.0, 0.0], axis = [1.0, 0.0, 0.0] },
    { body = "dumbbell2", position = [0.0, 0.0, 0.0], axis = [1.0, 0.0, 0.0] },
]
distance = 10.0
angle = "180 deg"

[ensemble]
"#;
    let scene = dumbbells(&[("[ensemble]\n", docking)]);
    let campaign = campaign(&scene);
    let reason = "bodies dock".into();
    assert_eq!(campaign.flown_by(), &FlownBy::Simulation { reason });
    for row in campaign.fly(0..5, Width::Eight) {
        let ensemble = scene.ensemble.as_ref().unwrap();
        let (system, states) = ensemble.sample(row.index).system(&scene).unwrap();
        let (bodies, scheme) = (system.bodies().to_vec(), scene.scheme().unwrap());
        let mut simulation = scene.simulation_of(bodies, states, scheme).unwrap();
        for _ in 0..30 {
            simulation.advance(&[Load::default(); 2]).unwrap();
        }
        assert_eq!(simulation.docked().len(), 1);
        for (name, state) in ["dumbbell1", "dumbbell2"].iter().zip(simulation.states()) {
            let name = format!("{name}.final.position.y");
            assert_eq!(value(&campaign, &row, &name), state.position.y);
        }
        assert!(value(&campaign, &row, "change.linear_momentum") < 1e-14);
        assert!(value(&campaign, &row, "change.angular_momentum") < 1e-14);
    }
}

/// Two specks so far apart that the inertia about the line between them is lost in rounding.
#[test]
fn samples_whose_bodies_cannot_be_joined_fail_by_docking() {
    let speck = |name: &str, x: f64| {
        format!(
            "[[bodies]]\nname = \"{name}\"\nmass = 1.0\ninertia = [1e-18, 1e-18, 1e-18]\nposition = [{x}, 0.0, 0.0]\n\
             velocity = [0.0, 0.0, 0.0]\nattitude = {{ w = 1.0, x = 0.0, y = 0.0, z = 0.0 }}\nangular_velocity = [0.0, 0.0, 0.0]\n"
        )
    };
    let port = |name: &str| {
        format!("{{ body = \"{name}\", position = [0.0, 0.0, 0.0], axis = [1.0, 0.0, 0.0] }}")
    };
    let text = format!(
        "title = \"Specks\"\n[run]\nduration = 1.0\nsteps = 10\nintegrator = \"lgvi\"\n{}{}\
         [[docking]]\nports = [{}, {}]\ndistance = 2.0\nangle = \"180 deg\"\n\
         [ensemble]\nsamples = 3\nseed = 1\n[[ensemble.bodies]]\nbody = \"left\"\nvelocity = 1e-3\n",
        speck("left", 0.0),
        speck("right", 1.0),
        port("left"),
        port("right"),
    );
    let scene = Scene::parse("specks", &text).unwrap();
    let campaign = campaign(&scene);
    let temporary = TempDir::new().unwrap();
    let directory = temporary.path().join("run");
    fly(&campaign, &directory, &OPTIONS);
    let store = Store::open(&directory).unwrap();
    let summary = Summary::of(&store).unwrap();
    assert_eq!(summary.failures, BTreeMap::from([("docking", 3)]));
    let text = summary.to_string();
    assert!(
        text.ends_with("3 of 3 samples, 0 flew to the end, 3 failed (docking)"),
        "{text}"
    );
    let mut read = Vec::new();
    store.for_each(|row| read.push(row)).unwrap();
    for row in &read {
        let failure = row.failure.as_ref().unwrap();
        assert_eq!(failure.kind, FailureKind::Docking);
        let expected = "left and right dock, but do not form a valid rigid body";
        assert_eq!(failure.message, expected);
    }
}

fn value(campaign: &Campaign<'_>, row: &Row, name: &str) -> f64 {
    let column = campaign.columns().iter().position(|column| column == name);
    row.numbers[column.unwrap_or_else(|| panic!("{name} in {:?}", campaign.columns()))]
}

#[test]
fn rows_say_where_a_sample_began_and_ended() {
    let still = [(
        "position = 0.01\nattitude = 0.1\nmass = 0.02\ninertia = 0.05",
        "position = 0.01",
    )];
    let scene = dumbbells(&still);
    let campaign = campaign(&scene);
    let rows = campaign.fly(0..3, Width::Eight);
    assert_eq!(
        rows.iter().map(|row| row.index).collect::<Vec<_>>(),
        [0, 1, 2]
    );
    for row in &rows {
        assert_eq!((row.steps, &row.failure), (30, &None));
        let deviation = value(&campaign, row, "dumbbell1.deviation.position.x");
        assert!(deviation != 0.0 && deviation.abs() < 0.06);
        let (system, mut states) = scene
            .ensemble
            .as_ref()
            .unwrap()
            .sample(row.index)
            .system(&scene)
            .unwrap();
        assert_eq!(
            states[0].position.x,
            scene.bodies[0].state.position.x + deviation
        );
        let mut simulation = scene
            .simulation_from(states.clone(), scene.scheme().unwrap())
            .unwrap();
        for _ in 0..30 {
            simulation.advance(&[Load::default(); 2]).unwrap();
        }
        states.copy_from_slice(simulation.states());
        for (name, body) in ["dumbbell1", "dumbbell2"].into_iter().zip(0..) {
            let expected = states[body].position.y;
            assert_eq!(
                value(&campaign, row, &format!("{name}.final.position.y")),
                expected
            );
            let expected = states[body].angular_velocity(&system.bodies()[body]).z;
            assert_eq!(
                value(&campaign, row, &format!("{name}.final.angular_velocity.z")),
                expected
            );
        }
        assert!(value(&campaign, row, "change.energy").abs() < 1e-4);
        assert!(value(&campaign, row, "change.linear_momentum") < 1e-14);
        assert!(value(&campaign, row, "change.angular_momentum") < 1e-14);
    }
}

#[test]
fn samples_that_fail_are_counted_by_kind_and_leave_the_others_alone() {
    let fast = [
        ("angular_velocity = 0.3", "angular_velocity = 300.0"),
        ("integrator = \"lgvi\"", "integrator = \"lie_euler\""),
        ("name = \"dumbbell1\"", "name = \"dumbbell1\"\nradius = 0.4"),
        ("name = \"dumbbell2\"", "name = \"dumbbell2\"\nradius = 0.4"),
        ("position = 0.01", "position = 0.3"),
        ("duration = 0.06", "duration = 0.3"),
        ("steps = 30\n", "steps = 150\n"),
    ];
    let temporary = TempDir::new().unwrap();
    let scene = dumbbells(&fast);
    let campaign = campaign(&scene);
    let directory = temporary.path().join("run");
    fly(
        &campaign,
        &directory,
        &Options {
            range: Some(0..500),
            ..OPTIONS
        },
    );
    let store = Store::open(&directory).unwrap();
    let summary = Summary::of(&store).unwrap();
    let steps = AtomicU64::new(7);
    let rows = campaign.fly_counted(0..500, Width::One, &steps);
    assert_eq!(steps.into_inner(), 7 + 500 * 150);
    for kind in [
        FailureKind::Start,
        FailureKind::Turn,
        FailureKind::CloseApproach,
    ] {
        let failed = rows.iter().filter_map(|row| row.failure.as_ref());
        let count = failed.filter(|failure| failure.kind == kind).count() as u64;
        assert!(count > 0, "{kind}");
        assert_eq!(summary.failures.get(kind.name()), Some(&count));
    }
    assert!(summary.complete > 0);
    assert_eq!(
        summary.complete + summary.failures.values().sum::<u64>(),
        500
    );
    let mut read = Vec::new();
    store.for_each(|row| read.push(row)).unwrap();
    let bits = |rows: &[Row]| -> Vec<Vec<u64>> {
        let numbers = rows.iter().map(|row| row.numbers.iter());
        numbers
            .map(|numbers| numbers.map(|n| n.to_bits()).collect())
            .collect()
    };
    assert_eq!(bits(&read), bits(&rows));
    assert!(
        read.iter()
            .zip(&rows)
            .all(|(a, b)| (a.steps, &a.failure) == (b.steps, &b.failure))
    );
    let text = serde_json::to_string(&summary).unwrap();
    assert!(text.contains("\"turn\":"), "{text}");
    assert!(summary.to_string().contains("failed (turn)"));
    let drawn = draw(&summary).unwrap().unwrap();
    assert!(drawn.contains("dumbbell1.final.position.x") && drawn.matches("<rect").count() > 200);
}

/// A push along x that leaves the spacecraft coasting with the wrong momentum, with or without correction.
struct Push {
    corrected: bool,
}

/// A push that does not answer, asked for step by step, is that of an open loop, and lanes do not leave it out.
#[test]
fn commands_without_feedback_are_flown_step_by_step() {
    struct Constant(Load);
    impl Commands for Constant {
        fn steps(&self) -> u64 {
            1000
        }
        fn have_feedback(&self) -> bool {
            false
        }
        fn at(&self, _step: u64, _state: &BodyState) -> Command {
            Command::Load(self.0)
        }
    }
    let table = "\n[ensemble]\nsamples = 4\nseed = 3\nforce_error = 0.1\n";
    let scene = Scene::parse("capture", &format!("{CAPTURE}{table}")).unwrap();
    let push = Load {
        force: Vector3::new(0.2, -0.1, 0.3),
        moment: Vector3::zeros(),
    };
    let of = |guidance| Campaign::new(&scene, Settings::default(), guidance).unwrap();
    let asked = of(Guidance::StepByStep(Box::new(Constant(push))));
    assert!(matches!(asked.flown_by(), FlownBy::Simulation { .. }));
    let open = of(Guidance::OpenLoop(vec![push; 1000]));
    assert_eq!(asked.fly(0..4, Width::Eight), open.fly(0..4, Width::Eight));
}

impl Commands for Push {
    fn steps(&self) -> u64 {
        1000
    }

    fn have_feedback(&self) -> bool {
        true
    }

    fn at(&self, _step: u64, state: &BodyState) -> Command {
        let gain = if self.corrected { 50.0 } else { 0.0 };
        let error = state.linear_momentum - Vector3::new(0.983, 0.0, 0.0);
        Command::Load(Load {
            force: -gain * error,
            moment: Vector3::zeros(),
        })
    }
}

/// An engine that errs uses propellant by the force that it exerts.
#[test]
fn a_maneuver_by_an_engine_uses_propellant() {
    let text = include_str!("../../../../scenes/earth_mars.toml");
    let table = "\n[ensemble]\nsamples = 20\nseed = 3\nforce_error = 0.05\n";
    let scene = Scene::parse("earth_mars", &format!("{text}{table}")).unwrap();
    let of = |force| {
        let moment = Vector3::zeros();
        let guidance = Guidance::OpenLoop(vec![Load { force, moment }; 400]);
        Campaign::new(&scene, Settings::default(), guidance).unwrap()
    };
    let body = &scene.bodies[0].body;
    let engine = body.thrusters().unwrap().engine().unwrap();
    let push = of(0.2 * engine.thrust * Vector3::x());
    assert!(matches!(push.flown_by(), FlownBy::Simulation { .. }));
    let all = body.thrusters().unwrap().propellant_left() * scene.units.mass;
    for row in push.fly(0..20, Width::One) {
        let factor = value(&push, &row, "force_factor.x");
        assert!(factor != 1.0 && (factor - 1.0).abs() < 0.3);
        let used = 0.2 * factor * engine.thrust * scene.duration / engine.exhaust_velocity;
        let expected = all - used * scene.units.mass;
        let left = value(&push, &row, "spacecraft.final.propellant");
        assert!((left - expected).abs() < 1e-9 * all, "{left} {expected}");
    }
}

/// Thrusters and wheels exert what they are asked for times the factor of each in its sample.
#[test]
fn maneuvers_by_thrusters_and_wheels_are_flown_with_an_error_of_each() {
    struct Constant(Vec<f64>);
    impl Commands for Constant {
        fn steps(&self) -> u64 {
            20
        }
        fn have_feedback(&self) -> bool {
            false
        }
        fn at(&self, _step: u64, _state: &BodyState) -> Command {
            Command::Efforts(self.0.clone())
        }
    }
    let thrusters = include_str!("../../../../scenes/thruster_rendezvous.toml");
    let wheels = include_str!("../../../../scenes/wheel_slew_plan.toml");
    for text in [thrusters, wheels] {
        let table = "\n[ensemble]\nsamples = 8\nseed = 3\nactuator_error = 0.1\n";
        let scene = Scene::parse("actuators", &format!("{text}{table}")).unwrap();
        let maneuver = scene.maneuver.as_ref().unwrap();
        let count = maneuver.actuators();
        let given: Vec<_> = (0..count)
            .map(|index| 1e-4 * (1.0 + index as f64))
            .collect();
        let guidance = Guidance::StepByStep(Box::new(Constant(given.clone())));
        let campaign = Campaign::new(&scene, Settings::default(), guidance).unwrap();
        let ensemble = scene.ensemble.as_ref().unwrap();
        for row in campaign.fly(0..8, Width::Eight) {
            let sample = ensemble.sample(row.index);
            let factors = &sample.actuators.actuators;
            assert_eq!(factors.len(), count);
            let exerted = given
                .iter()
                .zip(factors)
                .enumerate()
                .map(|(index, (given, factor))| {
                    let name = format!("actuator_factor.{index}");
                    assert_eq!(value(&campaign, &row, &name), *factor);
                    given * factor
                });
            let exerted: Vec<_> = exerted.collect();
            let (system, states) = sample.system(&scene).unwrap();
            let (bodies, scheme) = (system.bodies().to_vec(), scene.scheme().unwrap());
            let mut flight = scene.simulation_of(bodies, states, scheme).unwrap();
            let loads = vec![Load::default(); scene.bodies.len()];
            for _ in 0..scene.steps {
                match maneuver.commands() {
                    lgvi_scene::Commands::Wheels => {
                        flight.set_wheel_commands(maneuver.body, &exerted)
                    }
                    _ => flight.set_thruster_commands(maneuver.body, &exerted),
                }
                flight.advance(&loads).unwrap();
            }
            let (state, body) = (flight.states()[maneuver.body], maneuver.body);
            let expected = state.angular_velocity(&scene.bodies[body].body) / scene.units.time;
            let name = &scene.bodies[body].name;
            for (axis, expected) in ["x", "y", "z"].into_iter().zip(&expected) {
                let found = value(
                    &campaign,
                    &row,
                    &format!("{name}.final.angular_velocity.{axis}"),
                );
                assert!(
                    (found - expected).abs() < 1e-10 * expected.abs().max(1e-2),
                    "{found} {expected}"
                );
            }
        }
    }
}

#[test]
fn maneuvers_are_flown_with_errors_of_their_actuators() {
    let table = "\n[ensemble]\nsamples = 40\nseed = 3\nforce_error = 0.1\n\n[[ensemble.bodies]]\nbody = \"spacecraft\"\nvelocity = 0.05\n";
    let scene = Scene::parse("capture", &format!("{CAPTURE}{table}")).unwrap();
    let of = |guidance| Campaign::new(&scene, Settings::default(), guidance);
    assert!(matches!(
        of(Guidance::None).err(),
        Some(EnsembleError::Commands)
    ));
    let push = Load {
        force: Vector3::new(0.2, -0.1, 0.3),
        moment: Vector3::zeros(),
    };
    let open = of(Guidance::OpenLoop(vec![push; 1000])).unwrap();
    assert_eq!(open.flown_by(), &FlownBy::Lanes);
    let idle = of(Guidance::OpenLoop(vec![Load::default(); 1000])).unwrap();
    assert_ne!(open.identity(), idle.identity());
    let (pushed, coasted) = (open.fly(0..40, Width::Eight), idle.fly(0..40, Width::Eight));
    for (row, coasting) in pushed.iter().zip(&coasted) {
        let factor = value(&open, row, "force_factor.x");
        assert!(factor != 1.0 && (factor - 1.0).abs() < 0.5);
        let gained = value(&open, row, "spacecraft.final.velocity.x")
            - value(&idle, coasting, "spacecraft.final.velocity.x");
        // The push changes gravity little over the flight, so that it accounts for the whole difference.
        assert!(
            (gained / (0.2 * factor * scene.duration) - 1.0).abs() < 0.2,
            "{gained}"
        );
        assert!(value(&open, row, "miss.position") > 0.1);
    }
    let corrected = of(Guidance::StepByStep(Box::new(Push { corrected: true }))).unwrap();
    assert!(matches!(corrected.flown_by(), FlownBy::Simulation { .. }));
    let free = of(Guidance::StepByStep(Box::new(Push { corrected: false }))).unwrap();
    let scatter = |campaign: &Campaign<'_>| {
        let rows = campaign.fly(0..40, Width::One);
        let all = rows
            .iter()
            .map(|row| value(campaign, row, "spacecraft.final.velocity.y"));
        let all: Vec<_> = all.collect();
        let mean = all.iter().sum::<f64>() / 40.0;
        all.iter().map(|v| (v - mean).powi(2)).sum::<f64>()
    };
    assert!(scatter(&corrected) < 0.1 * scatter(&free));
}

#[test]
fn what_is_no_ensemble_is_refused() {
    let scene = Scene::parse("two_dumbbells", DUMBBELLS).unwrap();
    let of = |scene, settings| {
        Campaign::new(scene, settings, Guidance::None)
            .err()
            .unwrap()
    };
    let none = of(&scene, Settings::default());
    assert!(matches!(none, EnsembleError::NoTable), "{none}");
    let scene = dumbbells(&[]);
    for samples in [0, u64::MAX] {
        let settings = Settings {
            samples: Some(samples),
            seed: None,
        };
        let error = of(&scene, settings);
        assert!(
            matches!(error, EnsembleError::Samples(found) if found == samples),
            "{error}"
        );
    }
    let commands = Guidance::OpenLoop(vec![Load::default()]);
    let error = Campaign::new(&scene, Settings::default(), commands)
        .err()
        .unwrap();
    assert!(matches!(error, EnsembleError::Commands), "{error}");

    // An error that a single flight would also return.
    let scene = dumbbells(&[("duration = 0.06", "duration = 1e-38")]);
    let error = of(&scene, Settings::default());
    assert!(matches!(error, EnsembleError::Scheme(_)), "{error}");
}

const FLYAROUND: &str = include_str!("../../../../scenes/uncertain_flyaround.toml");

/// A plan with its feedback, without limits.
struct Law(lgvi_control::Plan);

impl Commands for Law {
    fn steps(&self) -> u64 {
        self.0.controls.len() as u64
    }

    fn have_feedback(&self) -> bool {
        true
    }

    fn at(&self, step: u64, state: &BodyState) -> Command {
        let k = step as usize;
        let off = lgvi_control::miss(&self.0.states[k], state);
        let change = self.0.feedback[k] * off;
        let control = self.0.controls[k];
        Command::Load(Load {
            force: control.force - change.fixed_rows::<3>(0),
            moment: control.moment - change.fixed_rows::<3>(3),
        })
    }
}

/// Ten thousand flights violate the constraint as rarely, at each step, as its confidence promises. The columns are those of
/// flights of the samples one by one, by the distance from the station.
#[test]
fn violations_of_constraints_with_a_probability_are_counted() {
    let scene = Scene::parse("flyaround", FLYAROUND).unwrap();
    let transfer = scene.transfer().unwrap().unwrap();
    let settings = lgvi_control::NewtonSettings::default();
    let start = lgvi_control::Start::Cold;
    let plan = lgvi_control::solve(&transfer, start, &settings, |_| true).unwrap();
    let law = || Box::new(Law(plan.clone()));
    let campaign = Campaign::new(&scene, Settings::default(), Guidance::StepByStep(law())).unwrap();
    assert!(matches!(campaign.flown_by(), FlownBy::Simulation { .. }));
    let columns = [
        "violation",
        "violated",
        "violated_steps",
        "violated_first",
        "violated_last",
    ];
    let columns = columns.map(|what| {
        let name = format!("{what}.0.keep_out_sphere");
        let mut names = campaign.columns().iter();
        names.position(|one| *one == name).unwrap()
    });
    let rows = campaign.fly(0..10_000, Width::One);
    let mut violations = vec![0_u32; 201];
    for row in &rows {
        let [largest, violated, steps, first, last] = columns.map(|column| row.numbers[column]);
        assert_eq!(violated == 1.0, largest > 1e-9);
        // The way past a sphere is inside of it once, if at all.
        let inside = if violated == 1.0 {
            first as usize..last as usize + 1
        } else {
            0..0
        };
        assert_eq!(steps, inside.len() as f64, "{first} to {last}");
        violations[inside].iter_mut().for_each(|count| *count += 1);
    }
    let largest = f64::from(*violations.iter().max().unwrap()) / 1e4;
    let error = 3.0 * (0.01_f64 * 0.99 / 1e4).sqrt();
    assert!((0.005..=0.01 + error).contains(&largest), "{largest}");

    let ensemble = scene.ensemble.as_ref().unwrap();
    let law = law();
    for row in &rows[..60] {
        let sample = ensemble.sample(row.index);
        let (system, states) = sample.system(&scene).unwrap();
        let (bodies, scheme) = (system.bodies().to_vec(), scene.scheme().unwrap());
        let mut flight = scene.simulation_of(bodies, states, scheme).unwrap();
        let mut least = f64::INFINITY;
        for step in 0..scene.steps {
            let Command::Load(load) = law.at(step, &flight.states()[1]) else {
                panic!("no force");
            };
            let loads = [Load::default(), sample.actuators.apply(&load)];
            flight.advance(&loads).unwrap();
            least = least.min(flight.states()[1].position.norm());
        }
        let (violation, expected) = (row.numbers[columns[0]], 1.0 - least / 30.0);
        assert!(
            (violation - expected).abs() < 1e-12,
            "{violation} {expected}"
        );
    }
    let plain = FLYAROUND.replace("confidence = 0.99\n", "");
    let plain = Scene::parse("flyaround", &plain).unwrap();
    let guidance = Guidance::OpenLoop(plan.controls.clone());
    let campaign = Campaign::new(&plain, Settings::default(), guidance).unwrap();
    assert_eq!(campaign.flown_by(), &FlownBy::Lanes);
    assert!(
        campaign
            .columns()
            .iter()
            .all(|name| !name.starts_with("violat"))
    );
}
