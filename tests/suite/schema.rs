//! The JSON Schema of scenes, by an independent validator.

use std::fs;
use std::path::PathBuf;

use lgvi_scene::Scene;
use lgvi_tests::{World, root};

/// The scenes of a folder that can be read.
fn scenes(folder: &str) -> Vec<PathBuf> {
    let files = fs::read_dir(root().join(folder)).unwrap();
    let paths = files.map(|file| file.unwrap().path());
    let read = |path: &PathBuf| {
        let text = fs::read_to_string(path);
        // The schema does not know a spelling of earlier versions.
        text.is_ok_and(|text| !text.contains("centre") && Scene::parse("scene", &text).is_ok())
    };
    let mut scenes: Vec<_> = paths.filter(read).collect();
    scenes.sort();
    scenes
}

/// What the schema refuses beyond this would be a fault of the schema, and what it accepts would not help an editor.
#[test]
fn scenes_satisfy_the_schema_and_misspelled_ones_do_not() {
    let world = World::new();
    let schema = world.path("schema.json");
    let printed = world.lgvi(["schema"]).finish().expect(0).stdout;
    fs::write(&schema, printed).unwrap();
    let (shipped, recorded) = (scenes("scenes"), scenes("bags/scenes"));
    let fuzzed = scenes("tests/fuzz/corpus/scene");
    assert!(shipped.len() >= 13 && recorded.len() >= 5 && fuzzed.len() >= 10);
    let all = shipped.iter().chain(&recorded).chain(&fuzzed);
    let arguments: Vec<_> = std::iter::once(&schema).chain(all).collect();
    let arguments: Vec<_> = arguments
        .iter()
        .map(|path| path.to_str().unwrap())
        .collect();
    let checked = world
        .python("check_schema.py", &arguments)
        .finish()
        .expect(0);
    let misspelled: usize = checked.stdout.trim().parse().unwrap();
    assert!(misspelled > 1000, "{misspelled}");
}
