//! Edge cases of ensembles: starts at rest, bodies of other mass, damaged and incomplete directories, expensive
//! samples.

#![allow(clippy::unwrap_used)]

use std::cell::RefCell;
use std::fs;

use lgvi_dynamics::Load;
use lgvi_dynamics::lanes::Width;
use lgvi_ensemble::{
    Campaign, EnsembleError, FlownBy, Guidance, MergeOptions, Options, Row, Settings, Statistics,
    Store, Summary, draw, merge, run,
};
use lgvi_scene::Scene;
use tempfile::TempDir;

const RUN: &str = r#"
title = "edges"
units = { length = "1 m", mass = "1 kg", time = "1 s" }
publish = { state_every = 1, ros_every = 1 }

[run]
duration = 0.5
steps = 50
integrator = "lie_euler"

[[bodies]]
name = "b"
mass = 1.0
inertia = [0.02, 0.03, 0.04]
attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
angular_velocity = [0.0, 0.0, 0.0]
"#;

const AT_REST: &str = r#"
position = [0.0, 0.0, 0.0]
velocity = [0.0, 0.0, 0.0]
points = [{ mass = 0.5, position = [0.15, 0, 0] }, { mass = 0.5, position = [-0.15, 0, 0] }]
"#;

const UNIFORM: &str = "
[gravity.uniform]
acceleration = [0.1, 0.2, -9.81]
";

const ENSEMBLE: &str = r#"
[ensemble]
samples = 40
seed = 1

[[ensemble.bodies]]
body = "b"
"#;

fn of(text: &[&str]) -> Scene {
    Scene::parse("edges", &text.concat()).unwrap()
}

pub(crate) fn campaign(scene: &Scene, guidance: Guidance) -> Campaign<'_> {
    Campaign::new(scene, Settings::default(), guidance).unwrap()
}

pub(crate) const OPTIONS: Options = Options {
    range: None,
    threads: 1,
    width: Width::Eight,
};

fn summary(campaign: &Campaign<'_>, temporary: &TempDir) -> Summary {
    let directory = temporary.path().join("run");
    let store = Store::create(&directory, campaign.identity(), campaign.columns()).unwrap();
    run(campaign, &store, &OPTIONS, &|| false, &mut |_| ()).unwrap();
    Summary::of(&store).unwrap()
}

fn numbers(statistics: &Statistics) -> impl Iterator<Item = f64> {
    let Statistics {
        mean,
        standard_deviation,
        least,
        quantiles,
        greatest,
    } = *statistics;
    [mean, standard_deviation, least, greatest]
        .into_iter()
        .chain(quantiles)
}

/// All energy and momentum at the end has been gained in the flight. The relative changes are still at most 2.
#[test]
fn a_start_at_rest_has_finite_changes_and_a_picture() {
    let scene = of(&[
        RUN,
        AT_REST,
        UNIFORM,
        ENSEMBLE,
        "attitude = 0.01\ninertia = 0.01",
    ]);
    let temporary = TempDir::new().unwrap();
    let summary = summary(&campaign(&scene, Guidance::None), &temporary);
    assert_eq!(summary.complete, 40);
    for (name, statistics) in &summary.columns {
        assert!(numbers(statistics).all(f64::is_finite), "{name}");
        if name.starts_with("change.") {
            assert!(
                statistics.greatest.abs().max(statistics.least.abs()) <= 2.0,
                "{name}"
            );
        }
    }
    let of = |column: &str| {
        summary
            .columns
            .iter()
            .find(|(name, _)| name == column)
            .unwrap()
            .1
    };
    assert_eq!(of("change.linear_momentum").mean, 1.0);
    let picture = draw(&summary).unwrap().unwrap();
    assert!(picture.contains("change.energy"));
}

/// The body coasts along the target's orbit, which does not depend on the mass, and in the target's attitude.
#[test]
fn a_heavier_body_on_the_targets_orbit_misses_as_little_as_the_nominal_one() {
    let orbit =
        "\nposition = [1.0, 0.0, 0.0]\nvelocity = [0.0, 1.0, 0.0]\n[gravity.central]\ngm = 1.0\n";
    let spread = "mass = 0.1\ninertia = 0.1";
    for (motion, target) in [
        (
            "translation",
            "orbit = { position = [1.0, 0.0, 0.0], velocity = [0.0, 1.0, 0.0] }",
        ),
        (
            "translation",
            "position = [0.8775825618903728, 0.479425538604203, 0.0]\nvelocity = [-0.479425538604203, 0.8775825618903728, 0.0]",
        ),
        (
            "rotation",
            "attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }\nangular_velocity = [0.0, 0.0, 0.5]",
        ),
    ] {
        let maneuver = format!(
            "\n[maneuver]\nbody = \"b\"\nmotion = \"{motion}\"\n[maneuver.target]\n{target}\n"
        );
        let text = [RUN, orbit, &maneuver, ENSEMBLE, spread].concat();
        let text = match motion {
            "rotation" => text.replace(
                "angular_velocity = [0.0, 0.0, 0.0]",
                "angular_velocity = [0.0, 0.0, 0.5]",
            ),
            _ => text,
        };
        let scene = Scene::parse("edges", &text).unwrap();
        let idle = Guidance::OpenLoop(vec![Load::default(); 50]);
        let campaign = campaign(&scene, idle);
        let rows = campaign.fly(0..40, Width::Eight);
        let column = |name: &str| {
            campaign
                .columns()
                .iter()
                .position(|column| column == name)
                .unwrap()
        };
        let flown =
            |name: &str| -> Vec<f64> { rows.iter().map(|row| row.numbers[column(name)]).collect() };
        // The error of the first-order method is about half a step on the unit orbit.
        let parts = match motion {
            "rotation" => &["miss.angular_momentum"][..],
            _ => &["miss.position", "miss.linear_momentum"],
        };
        for part in parts {
            let worst = flown(part).into_iter().fold(0.0, f64::max);
            assert!(worst < 0.01, "{motion}: {part} {worst}");
        }
    }
}

/// Returns a scene with ten steps of a body that falls and turns.
fn falling(more: &str) -> Scene {
    let text = of_text(more).replace("steps = 50", "steps = 10");
    Scene::parse("edges", &text).unwrap()
}

pub(crate) fn of_text(more: &str) -> String {
    let run = RUN.replace("[0.0, 0.0, 0.0]", "[0.1, 2.0, 0.3]");
    [&run, AT_REST, UNIFORM, ENSEMBLE, "attitude = 0.1", more].concat()
}

/// A simulation gives the same numbers as lanes for flights that lanes support, whatever the scene allows it to skip.
#[test]
fn numbers_do_not_depend_on_what_flies_the_samples() {
    let lanes = falling("");
    let text = of_text("").replace("steps = 50", "steps = 10\nsubdivide = 1");
    let simulated = Scene::parse("edges", &text).unwrap();
    let [lanes, simulated] = [&lanes, &simulated].map(|scene| campaign(scene, Guidance::None));
    assert_eq!(lanes.flown_by(), &FlownBy::Lanes);
    assert!(matches!(simulated.flown_by(), FlownBy::Simulation { .. }));
    let bits = |rows: Vec<Row>| -> Vec<Vec<u64>> {
        let numbers = rows.into_iter().map(|row| row.numbers);
        numbers
            .map(|numbers| numbers.into_iter().map(f64::to_bits).collect())
            .collect()
    };
    let ends = [lanes, simulated].map(|campaign| bits(campaign.fly(0..40, Width::Eight)));
    assert!(ends[0] == ends[1]);
}

/// After any single bit of a part is flipped, the part is refused or all its numbers are unchanged.
#[test]
fn a_flipped_bit_is_found_or_changes_nothing() {
    let scene = falling("");
    let campaign = campaign(&scene, Guidance::None);
    let temporary = TempDir::new().unwrap();
    let directory = temporary.path().join("run");
    let store = Store::create(&directory, campaign.identity(), campaign.columns()).unwrap();
    run(&campaign, &store, &OPTIONS, &|| false, &mut |_| ()).unwrap();
    let part = directory.join("samples_0000000000_0000000040.parquet");
    let bytes = fs::read(&part).unwrap();
    let expected = campaign.fly(0..40, Width::One);
    let (mut found, tried) = (0, 200);
    for flip in 0..tried {
        let mut bytes = bytes.clone();
        let place = flip * bytes.len() / tried;
        bytes[place] ^= 1 << (flip % 8);
        fs::write(&part, bytes).unwrap();
        let mut read = Vec::new();
        match store.for_each(|row| read.push(row)) {
            Ok(()) => assert_eq!(read, expected, "byte {place}"),
            Err(EnsembleError::Damaged { .. } | EnsembleError::Foreign { .. }) => found += 1,
            Err(error) => panic!("{error}"),
        }
    }
    assert!(found > tried / 2, "{found}");
    // A run that continues checks the existing parts before it flies anything.
    let mut bytes = bytes;
    bytes[100] ^= 1;
    fs::write(&part, bytes).unwrap();
    let error = run(&campaign, &store, &OPTIONS, &|| false, &mut |_| ()).unwrap_err();
    assert!(matches!(error, EnsembleError::Damaged { .. }), "{error}");
}

#[cfg(unix)]
#[test]
fn parts_have_the_permissions_that_the_umask_leaves() {
    use std::os::unix::fs::PermissionsExt;
    let scene = falling("");
    let campaign = campaign(&scene, Guidance::None);
    let temporary = TempDir::new().unwrap();
    summary(&campaign, &temporary);
    let plain = temporary.path().join("plain");
    fs::write(&plain, "").unwrap();
    let part = temporary
        .path()
        .join("run/samples_0000000000_0000000040.parquet");
    let mode = |path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&part), mode(&plain));
    let merged = temporary.path().join("merged");
    let run = temporary.path().join("run");
    merge(std::slice::from_ref(&run), &merged, MergeOptions::default()).unwrap();
    assert_eq!(mode(&merged), mode(&run));
}

#[test]
fn ranges_that_make_up_a_part_are_that_part() {
    let scene = falling("");
    let campaign = campaign(&scene, Guidance::None);
    let temporary = TempDir::new().unwrap();
    let directory = temporary.path().join("run");
    let store = Store::create(&directory, campaign.identity(), campaign.columns()).unwrap();
    let fly = |range| {
        let options = Options { range, ..OPTIONS };
        run(&campaign, &store, &options, &|| false, &mut |_| ())
    };
    assert!(matches!(fly(Some(0..41)), Err(EnsembleError::Range { .. })));
    assert!(!directory.exists());
    fly(Some(0..20)).unwrap();
    let refused = fly(None).unwrap_err();
    assert!(
        matches!(&refused, EnsembleError::Cut { missing, .. } if *missing == (20..40)),
        "{refused}"
    );
    assert!(refused.to_string().contains("20..40"), "{refused}");
    fly(Some(20..40)).unwrap();
    let whole = fly(None).unwrap();
    assert_eq!((whole.kept, whole.flown), (40, 0));
}

#[test]
fn a_merge_makes_a_directory_of_its_own() {
    let scene = falling("");
    let campaign = campaign(&scene, Guidance::None);
    let temporary = TempDir::new().unwrap();
    summary(&campaign, &temporary);
    let run = [temporary.path().join("run")];
    let merge = |output: &str| {
        merge(
            &run,
            &temporary.path().join(output),
            MergeOptions::default(),
        )
        .map(|_| ())
    };
    fs::create_dir(temporary.path().join("empty")).unwrap();
    merge("empty").unwrap();
    merge("deep/new").unwrap();
    assert!(matches!(
        merge("empty"),
        Err(EnsembleError::Occupied { .. })
    ));
    fs::write(temporary.path().join("file"), "").unwrap();
    assert!(matches!(
        merge("file"),
        Err(EnsembleError::NotDirectory { .. })
    ));
    let names = fs::read_dir(temporary.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name());
    let names: Vec<_> = names.collect();
    assert_eq!(names.len(), 4, "nothing is left beside them: {names:?}");
    let file = temporary.path().join("file");
    let refused = Store::create(&file, campaign.identity(), campaign.columns()).err();
    assert!(matches!(refused, Some(EnsembleError::NotDirectory { .. })));
    assert!(!refused.unwrap().is_io());
}

/// Parts of expensive samples are small for any implementation, and progress is reported between them.
#[test]
fn dear_samples_are_kept_in_small_parts() {
    let cheap = falling("");
    assert_eq!(campaign(&cheap, Guidance::None).identity().part, 1024);
    let text = of_text("").replace("steps = 50", "steps = 3000000");
    let dear = Scene::parse("edges", &text).unwrap();
    assert_eq!(campaign(&dear, Guidance::None).identity().part, 32);
    let campaign = campaign(&cheap, Guidance::None);
    let temporary = TempDir::new().unwrap();
    let store = Store::create(temporary.path(), campaign.identity(), campaign.columns()).unwrap();
    let told = RefCell::new(Vec::new());
    run(&campaign, &store, &OPTIONS, &|| false, &mut |now| {
        told.borrow_mut().push((now.done, now.steps))
    })
    .unwrap();
    let told = told.into_inner();
    assert_eq!(told.last(), Some(&(40, 40 * campaign.steps())));
    let mut done: Vec<_> = told.iter().map(|(done, _)| *done).collect();
    done.dedup();
    assert_eq!(done, [0, 32, 40]);
}
