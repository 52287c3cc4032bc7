//! The bags of the repository: what was flown then, this version repeats to the last bit.

use std::fs;
use std::path::{Path, PathBuf};

use lgvi_msgs::msg::{ControlSequence, Intervention, PlanProgress, Scene};
use lgvi_tests::{Recording, World, reference_bag, reference_bags};

const STATE: &str = "/lgvi_propagator/state";
const FLOWN: &str = "/lgvi_propagator/flown_control";
const PROGRESS: &str = "/lgvi_planner/progress";

/// No bag is larger (bytes).
const LIMIT: u64 = 450_000;

fn recording(name: &str) -> Recording {
    Recording::read(&reference_bag(name))
}

/// The scene that a bag was made of: one for the bag alone, or one of those shipped.
fn scene_of(bag: &Path) -> PathBuf {
    let name = bag.file_name().unwrap().to_str().unwrap();
    let own = bag.parent().unwrap().join("scenes").join(name);
    let own = own.with_extension("toml");
    if own.exists() {
        own
    } else {
        lgvi_tests::scene(name)
    }
}

#[test]
fn each_verifies_is_small_and_is_documented() {
    let world = World::new();
    let readme = fs::read_to_string(lgvi_tests::root().join("bags/README.md")).unwrap();
    for bag in reference_bags() {
        let name = bag.file_name().unwrap().to_str().unwrap();
        let states = Recording::read(&bag).on(STATE).count() as u64;
        assert!(states > 50, "{name} has {states} states");
        world.verify_agrees(&bag, states);
        let files = fs::read_dir(&bag).unwrap();
        let size: u64 = files
            .map(|file| file.unwrap().metadata().unwrap().len())
            .sum();
        assert!(size < LIMIT, "{name} has {size} bytes");
        assert!(readme.contains(&format!("| `{name}` |")), "{name}");
    }
}

#[test]
fn each_was_made_of_the_scene_that_is_in_the_repository() {
    for bag in reference_bags() {
        let name = bag.file_name().unwrap().to_str().unwrap();
        let recorded = Recording::read(&bag).messages::<Scene>("/lgvi_propagator/scene");
        let [recorded] = &recorded[..] else {
            panic!("{} scenes in {name}", recorded.len())
        };
        assert_eq!(recorded.name, name);
        let scene = scene_of(&bag);
        assert!(
            recorded.text == fs::read_to_string(&scene).unwrap(),
            "{} has changed since {name} was made; bags/regenerate {name} makes it anew",
            scene.display()
        );
    }
}

/// Planner and propagator give every message again, at its time.
#[test]
fn each_in_lockstep_is_flown_today_as_it_was_then() {
    let world = World::new();
    for bag in reference_bags() {
        let name = bag.file_name().unwrap().to_str().unwrap();
        if name == "interventions" {
            continue;
        }
        let (_, today) = world.fly_fast(&scene_of(&bag), name);
        let [then, today] = [&bag, &today].map(|bag| Recording::read(bag));
        let [then, today] = [then.contents(), today.contents()];
        assert_eq!(
            then.keys().collect::<Vec<_>>(),
            today.keys().collect::<Vec<_>>()
        );
        for (topic, messages) in &then {
            assert!(
                today[topic] == *messages,
                "{topic} of {name} is another today; bags/regenerate {name} makes it anew"
            );
        }
    }
}

#[test]
fn every_kind_of_flight_is_among_them() {
    let bodies = |name: &str| {
        let states = recording(name).messages::<lgvi_msgs::msg::SystemState>(STATE);
        states[0].bodies.len()
    };
    let counts = ["free_body", "pendulum", "two_dumbbells"].map(bodies);
    assert_eq!(counts, [1, 1, 2]);
    for name in ["inclination_change", "orbital_capture"] {
        assert_eq!(recording(name).on(FLOWN).count(), 1, "{name}");
    }

    let replanned = recording("inclination_replan");
    let sequences = replanned.messages::<ControlSequence>(FLOWN);
    let first_steps: Vec<_> = sequences.iter().map(|flown| flown.first_step).collect();
    assert_eq!(first_steps, [0, 17, 32]);
    assert!(sequences.iter().all(|flown| !flown.feedback.is_empty()));
    let progress = replanned.messages::<PlanProgress>(PROGRESS);
    assert!(progress.iter().all(|now| now.status != PlanProgress::KEPT));

    let interventions =
        recording("interventions").messages::<Intervention>("/lgvi_propagator/intervention");
    let kinds: Vec<_> = interventions
        .iter()
        .map(|intervention| intervention.kind)
        .collect();
    // By log times: a reset, though the later of the two, leads to step 0.
    assert_eq!(kinds, [Intervention::RESET, Intervention::SET_STATE]);
}
