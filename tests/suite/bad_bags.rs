//! Bags that cannot be read, verified or played.

use std::fs;
use std::path::Path;

use lgvi_tests::{Recording, World, scene};

/// `lgvi verify` and the player refuse a bag and say why.
#[track_caller]
fn refused(world: &World, bag: &Path, fragments: &[&str]) {
    verify_refuses(world, bag, fragments);
    let play = [
        "play".as_ref(),
        bag.as_os_str(),
        "--rate".as_ref(),
        "0".as_ref(),
    ];
    world.lgvi(play).finish().expect(2).says(fragments);
}

#[track_caller]
fn verify_refuses(world: &World, bag: &Path, fragments: &[&str]) {
    world
        .lgvi(["verify".as_ref(), bag.as_os_str()])
        .finish()
        .expect(2)
        .says(fragments);
}

#[test]
fn a_bag_that_is_cut_off_or_damaged_is_refused_by_its_name() {
    let world = World::new();
    let (_, bag) = world.fly(&scene("inclination_change"), "flight");
    let file = bag.join("flight_0.mcap");
    let whole = fs::read(&file).unwrap();
    for length in [
        0,
        7,
        100,
        whole.len() / 2,
        whole.len() - 1000,
        whole.len() - 1,
    ] {
        fs::write(&file, &whole[..length]).unwrap();
        refused(&world, &bag, &[file.to_str().unwrap()]);
    }
    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 1;
    fs::write(&file, &damaged).unwrap();
    refused(&world, &bag, &[file.to_str().unwrap(), "damaged"]);
}

#[test]
fn what_is_no_bag_is_refused_by_its_name() {
    let world = World::new();
    let missing = world.path("missing");
    refused(
        &world,
        &missing,
        &[missing.to_str().unwrap(), "No such file"],
    );
    let empty = world.path("empty");
    fs::create_dir(&empty).unwrap();
    refused(
        &world,
        &empty,
        &[empty.to_str().unwrap(), "expected metadata.yaml"],
    );
    let text = scene("free_body");
    refused(&world, &text, &[text.to_str().unwrap(), "not an MCAP file"]);
}

#[test]
fn a_bag_without_scene_or_states_cannot_be_verified() {
    let world = World::new();
    let (_, bag) = world.fly(&scene("inclination_change"), "flight");
    let flight = Recording::read(&bag);
    let topics = [
        ("/lgvi_propagator/scene", "lgvi_msgs/msg/Scene"),
        ("/lgvi_propagator/state", "/lgvi_propagator/state"),
    ];
    for (number, (topic, fragment)) in topics.into_iter().enumerate() {
        let bag = world.path(&format!("without_{number}"));
        flight.clone().without(topic).write(&bag);
        verify_refuses(&world, &bag, &[bag.to_str().unwrap(), fragment]);
    }
}

#[test]
fn a_bag_is_never_overwritten() {
    let world = World::new();
    let precious = world.path("flight").join("precious");
    fs::create_dir(world.path("flight")).unwrap();
    fs::write(&precious, "data").unwrap();
    let finished = world
        .start_flight(&scene("free_body"), "flight", &[])
        .finish()
        .expect(2);
    finished.says(&[world.path("flight").to_str().unwrap(), "exists"]);
    assert_eq!(fs::read_to_string(&precious).unwrap(), "data");
    assert_eq!(fs::read_dir(world.path("flight")).unwrap().count(), 1);
}
