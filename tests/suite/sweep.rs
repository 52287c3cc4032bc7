//! `lgvi sweep`: every combination in one table, the same bytes every time, and a picture.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use lgvi_tests::{World, scene};
use serde_json::Value;

fn table(directory: &Path) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(directory.join("sweep.csv")).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column]
        .parse()
        .unwrap_or_else(|_| panic!("{column} of {row:?}"))
}

/// The error of LGVI decreases with the square of the step: the table is a work-precision study.
#[test]
fn a_sweep_over_steps_shows_the_order_of_the_method() {
    let world = World::new();
    let directory = world.path("sweep");
    let sweep = |output: &Path, threads: &str| {
        let pendulum = scene("two_dumbbells");
        let arguments = [
            "sweep",
            pendulum.to_str().unwrap(),
            "--set",
            "run.duration=3.0",
            "--vary",
            "run.integrator=[\"lgvi\", {name = \"nystrom\", order = 6}]",
            "--vary",
            "run.steps=[500, 8000, log:5]",
            "--threads",
            threads,
            "--output",
            output.to_str().unwrap(),
        ];
        world.lgvi(arguments).finish().expect(0);
    };
    sweep(&directory, "2");
    let rows = table(&directory);
    assert_eq!(rows.len(), 10);
    let steps: Vec<_> = rows[..5]
        .iter()
        .map(|row| row["run.steps"].as_str())
        .collect();
    assert_eq!(steps, ["500", "1000", "2000", "4000", "8000"]);
    assert_eq!(rows[0]["run.integrator"], "lgvi");
    assert!(rows.iter().all(|row| row["failure"].is_empty()));
    // The Nyström splitting with most steps is the reference.
    let place = |row: usize| {
        ["x", "y", "z"].map(|axis| number(&rows[row], &format!("dumbbell1.final.position.{axis}")))
    };
    let reference = place(9);
    let error = |row: usize| {
        let found = place(row);
        let squares = (0..3).map(|axis| (found[axis] - reference[axis]).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let order = (error(2) / error(3)).log2();
    assert!((order - 2.0).abs() < 0.1, "{order} from {:e}", error(2));
    assert!(error(7) < 1e-3 * error(2), "{:e} {:e}", error(7), error(2));
    let picture = fs::read_to_string(directory.join("sweep.svg")).unwrap();
    assert!(picture.contains("Relative change of energy"));

    let again = world.path("again");
    sweep(&again, "1");
    for file in ["sweep.csv", "sweep.svg"] {
        let [one, other] = [&directory, &again].map(|path| fs::read(path.join(file)).unwrap());
        assert!(one == other, "{file} differs");
    }
}

/// A maneuver is planned anew for each combination; a flight that fails is a row, too.
#[test]
fn maneuvers_are_planned_and_failures_are_rows() {
    let world = World::new();
    let directory = world.path("sweep");
    let maneuver = scene("orbital_capture");
    let arguments = [
        "sweep",
        maneuver.to_str().unwrap(),
        "--vary",
        "run.steps=[60, 90]",
        "--json",
        "--time",
        "--output",
        directory.to_str().unwrap(),
    ];
    let output = world.lgvi(arguments).finish();
    let json: Value = serde_json::from_str(&output.expect(0).stdout).unwrap();
    let flights = json["flights"].as_array().unwrap();
    assert_eq!(flights.len(), 2);
    for flight in flights {
        assert_eq!(flight["failure"], Value::Null, "{flight}");
        let miss = flight["miss.position"].as_f64().unwrap();
        assert!(miss < 1e-6, "{miss}");
        assert!(flight["wall_time"].as_f64().unwrap() > 0.0);
    }

    // A tolerance that is out of reach is found out when the flight begins.
    let directory = world.path("unfit");
    let two = scene("two_dumbbells");
    let arguments = [
        "sweep",
        two.to_str().unwrap(),
        "--set",
        "run.steps=2",
        "--vary",
        "run.integrator=[{name = \"taylor\", tolerance = 1e-12}, {name = \"auto\", tolerance = 1e-14}]",
        "--output",
        directory.to_str().unwrap(),
    ];
    world.lgvi(arguments).finish().expect(0);
    let rows = table(&directory);
    assert_eq!(rows[0]["failure"], "");
    assert!(rows[1]["failure"].contains("out of reach"), "{:?}", rows[1]);

    let directory = world.path("failed");
    let free = scene("free_body");
    let arguments = [
        "sweep",
        free.to_str().unwrap(),
        "--vary",
        "run.steps=[10, 10000]",
        "--output",
        directory.to_str().unwrap(),
    ];
    let printed = world.lgvi(arguments).finish().expect(0).stdout;
    assert!(printed.contains("2 flights, 1 failed"), "{printed}");
    let rows = table(&directory);
    assert!(rows[0]["failure"].starts_with("body: "), "{:?}", rows[0]);
    assert_eq!(rows[1]["failure"], "");
}

#[test]
fn what_cannot_be_swept_is_refused_before_the_first_flight() {
    let world = World::new();
    let free = scene("free_body");
    let refused = |vary: &[&str], says: &str| {
        let output = world.path("out");
        let mut arguments = vec!["sweep", free.to_str().unwrap(), "--output"];
        arguments.push(output.to_str().unwrap());
        for one in vary {
            arguments.extend(["--vary", one]);
        }
        world.lgvi(arguments).finish().expect(2).says(&[says]);
        assert!(!output.exists());
    };
    refused(&["run.steps=[100, 0]"], "with run.steps=0");
    refused(&["bodies.moon.mass=[1, 2]"], "the scene has no `moon`");
    refused(&["run.steps=100"], "is not in brackets");
    refused(
        &["run.steps=[100, 200]", "run.steps=[1, 2]"],
        "--vary: `run.steps` comes twice, expected each key once",
    );
    refused(
        &[
            "run.steps=[1, 50000, lin:50000]",
            "bodies.body.mass=[1.0, 2.0, lin:3]",
        ],
        "expected at most 100000",
    );
    let there = world.path("there");
    fs::create_dir(&there).unwrap();
    let arguments = [
        "sweep",
        free.to_str().unwrap(),
        "--vary",
        "run.steps=[100]",
        "--output",
    ];
    let arguments = arguments.into_iter().chain([there.to_str().unwrap()]);
    world
        .lgvi(arguments)
        .finish()
        .expect(2)
        .says(&["cannot make"]);
}
