//! Long samples and many of them.

#![allow(clippy::unwrap_used)]

use lgvi_ensemble::{FlownBy, Guidance, MergeOptions, Options, Store, Summary, draw, merge, run};
use lgvi_scene::Scene;
use tempfile::TempDir;

use crate::edges::{OPTIONS, campaign, of_text};

/// A single sample tells of its steps, in lanes and by a simulation, whether it fails or not.
#[test]
fn long_samples_tell_of_their_steps() {
    for (more, fails) in [("", false), ("subdivide = 1\n", false), ("", true)] {
        let mut text = of_text("").replace("steps = 50\n", &format!("steps = 2000000\n{more}"));
        text = text.replace("samples = 40", "samples = 1");
        if fails {
            text = text.replace(
                "angular_velocity = [0.1, 2.0, 0.3]",
                "angular_velocity = [1e7, 2e7, 0.3]",
            );
        }
        let scene = Scene::parse("edges", &text).unwrap();
        let campaign = campaign(&scene, Guidance::None);
        let lanes = campaign.flown_by() == &FlownBy::Lanes;
        assert_eq!(lanes, more.is_empty());
        let temporary = TempDir::new().unwrap();
        let store =
            Store::create(temporary.path(), campaign.identity(), campaign.columns()).unwrap();
        let mut told = Vec::new();
        run(&campaign, &store, &OPTIONS, &|| false, &mut |now| {
            assert_eq!((now.wanted, now.wanted_steps), (1, 2_000_000));
            told.push((now.done, now.steps));
        })
        .unwrap();
        let mut failed = false;
        store
            .for_each(|row| failed = row.failure.is_some())
            .unwrap();
        assert_eq!(failed, fails);
        assert!(told.is_sorted(), "{told:?}");
        assert_eq!(told.last(), Some(&(1, 2_000_000)));
        let between = |(done, steps): &(u64, u64)| *done == 0 && *steps > 0;
        assert!(fails || told.iter().any(between), "{told:?}");
    }
}

/// Names have ten digits, so that they are in the order of the samples up to the largest ensemble.
#[test]
fn the_last_of_ten_thousand_million_samples_are_flown() {
    let text = of_text("").replace("samples = 40", "samples = 9999999999");
    let scene = Scene::parse("edges", &text).unwrap();
    let campaign = campaign(&scene, Guidance::None);
    let temporary = TempDir::new().unwrap();
    let store = Store::create(temporary.path(), campaign.identity(), campaign.columns()).unwrap();
    let range = Some(9_999_999_990..9_999_999_999);
    let options = Options { range, ..OPTIONS };
    let report = run(&campaign, &store, &options, &|| false, &mut |_| ()).unwrap();
    assert_eq!(report.flown, 9);
    let name = "samples_9999999990_9999999999.parquet";
    assert!(temporary.path().join(name).exists());
    let summary = Summary::of(&store).unwrap();
    assert_eq!((summary.samples, summary.present), (9_999_999_999, 9));
    assert!(Scene::parse("edges", &text.replace("9999999999", "10000000000")).is_err());
}

/// Quantiles of so many samples are those of a sketch, which takes them in the order of the indices.
#[test]
fn the_summary_of_many_samples_does_not_depend_on_ranges_and_threads() {
    let text = of_text("").replace("samples = 40", "samples = 70000");
    let scene = Scene::parse("edges", &text.replace("steps = 50", "steps = 10")).unwrap();
    let campaign = campaign(&scene, Guidance::None);
    let temporary = TempDir::new().unwrap();
    let fly = |name: &str, range, threads| {
        let directory = temporary.path().join(name);
        let store = Store::create(&directory, campaign.identity(), campaign.columns()).unwrap();
        let options = Options {
            range,
            threads,
            ..OPTIONS
        };
        run(&campaign, &store, &options, &|| false, &mut |_| ()).unwrap();
        store
    };
    let told = |store: &Store| {
        let summary = Summary::of(store).unwrap();
        assert_eq!(summary.quantile_error, 1e-3);
        let json = serde_json::to_string(&summary).unwrap();
        (json, draw(&summary).unwrap())
    };
    let whole = told(&fly("whole", None, 1));
    fly("first", Some(0..41_000), 2);
    fly("second", Some(41_000..70_000), 2);
    let shards = ["second", "first"].map(|name| temporary.path().join(name));
    let merged = temporary.path().join("merged");
    let (store, _) = merge(&shards, &merged, MergeOptions::default()).unwrap();
    assert!(told(&store) == whole);
}
