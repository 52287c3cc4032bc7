//! What `lgvi` says when it has no result, and what it never writes over.

use std::fs::{self, File};
use std::path::Path;

use lgvi_tests::{Recording, World, root, scene};
use serde_json::Value;

/// A command line of each tool on a path.
fn tools(path: &Path) -> [Vec<String>; 4] {
    let path = path.to_str().unwrap();
    [
        vec!["info", path],
        vec!["verify", path],
        vec!["convert", path, "--format", "csv"],
        vec!["recover", path],
    ]
    .map(|line| line.into_iter().map(str::to_owned).collect())
}

#[test]
fn a_result_that_cannot_be_told_is_no_finding() {
    let world = World::new();
    let bag = world.path("bag");
    Recording::read(&root().join("bags/orbital_capture")).write(&bag);
    for line in tools(&bag) {
        let mut command = world.command(&lgvi_tests::binary("lgvi"));
        command.args(&line);
        command.stdout(File::options().write(true).open("/dev/full").unwrap());
        let ended = command.output().unwrap();
        let said = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(ended.status.code(), Some(2), "{line:?}: {said}");
        assert!(said.contains("cannot write to standard output"), "{said}");
    }
}

#[test]
fn failures_are_json_where_that_is_asked_for_and_name_the_bag_once() {
    let world = World::new();
    let missing = world.path("missing");
    let [info, verify, convert, recover] = tools(&missing);
    let run = vec!["run".to_owned(), missing.to_str().unwrap().to_owned()];
    let explain = vec!["explain".to_owned(), run[1].clone()];
    for line in [info, verify, convert, recover, run, explain] {
        let ended = world.lgvi(line.iter().map(|word| &**word).chain(["--json"]));
        let ended = ended.finish().expect(2);
        let said: Value = ended.json();
        assert_eq!(said["failure"]["exit_code"], 2, "{line:?}");
        let message = said["failure"]["message"].as_str().unwrap();
        ended.says(&[message]);
        let named = message.matches(missing.to_str().unwrap()).count();
        assert_eq!(named, 1, "{line:?}: {message}");
        let plain = world
            .lgvi(line.iter().map(|word| &**word))
            .finish()
            .expect(2);
        assert_eq!(plain.stdout, "", "{line:?}");
    }
}

#[test]
fn a_flight_that_was_interrupted_agrees_and_is_not_complete() {
    let world = World::new();
    let mut flight = Recording::read(&root().join("bags/inclination_change"));
    let whole = world.path("whole");
    flight.write(&whole);
    let verdict = |bag: &Path| {
        let line = ["verify".as_ref(), bag.as_os_str(), "--json".as_ref()];
        world.lgvi(line).finish().expect(0).json::<Value>()
    };
    let text = |bag: &Path| {
        let line = ["verify".as_ref(), bag.as_os_str()];
        world.lgvi(line).finish().expect(0).stdout
    };
    let found = verdict(&whole);
    assert_eq!(found["complete"], true);
    assert_eq!(
        (&found["step"], &found["steps"]),
        (&1000.into(), &1000.into())
    );
    assert!(!text(&whole).contains("not complete"));

    let mut left = 499;
    flight.records.retain(|record| {
        let is_state = record.topic == "/lgvi_propagator/state";
        left -= usize::from(is_state && left > 0);
        !is_state || left > 0
    });
    let cut = world.path("cut");
    flight.write(&cut);
    let found = verdict(&cut);
    assert_eq!(found["complete"], false);
    assert_eq!(
        (&found["step"], &found["steps"]),
        (&497.into(), &1000.into())
    );
    let said = text(&cut);
    assert!(
        said.contains("not complete: its last state is of step 497 of 1000"),
        "{said}"
    );
}

#[test]
fn only_the_picture_in_the_bag_is_drawn_anew() {
    let world = World::new();
    let bag = world.path("bag");
    Recording::read(&root().join("bags/inclination_change")).write(&bag);
    let plot = |words: &[&Path], code| {
        let words = words.iter().map(|word| word.as_os_str());
        let line = ["plot".as_ref()].into_iter().chain(words);
        world.lgvi(line).finish().expect(code)
    };
    let option = Path::new("--output");
    let picture = bag.join("flight.svg");
    plot(&[&bag], 0);
    let drawn = fs::read_to_string(&picture).unwrap();
    fs::write(&picture, "old").unwrap();
    plot(&[&bag, option, &picture], 2).says(&["flight.svg", "File exists"]);
    assert_eq!(fs::read_to_string(&picture).unwrap(), "old");
    plot(&[&bag], 0);
    assert_eq!(fs::read_to_string(&picture).unwrap(), drawn);

    let toml = world.path("scene.toml");
    fs::copy(scene("free_body"), &toml).unwrap();
    plot(&[&bag, option, &toml], 2).says(&["scene.toml", "File exists"]);
    assert_eq!(
        fs::read(&toml).unwrap(),
        fs::read(scene("free_body")).unwrap()
    );
    let new = world.path("new.svg");
    plot(&[&bag, option, &new], 0);
    assert_eq!(fs::read_to_string(&new).unwrap(), drawn);

    let file = bag.join("bag_0.mcap");
    plot(&[&file], 0);
    plot(&[&file], 2).says(&["bag_0.svg", "File exists"]);
}
