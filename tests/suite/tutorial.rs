//! The commands of the tutorial and of the how-to pages run, in their order, in an empty directory.

use std::path::PathBuf;

use lgvi_tests::{World, binary, python, root};

/// Runs the blocks of shell commands and of Python on a page; returns the directory in which they ran.
fn run(world: &World, page: &str) -> PathBuf {
    let text = std::fs::read_to_string(root().join("docs").join(page)).unwrap();
    let directory = world.path("first");
    std::fs::create_dir(&directory).unwrap();
    let programs = binary("lgvi").parent().unwrap().display().to_string();
    let blocks = text.split("\n```").skip(1).step_by(2);
    let mut commands = 0;
    for (language, code) in blocks.filter_map(|block| block.split_once('\n')) {
        let lines: Vec<&str> = match language {
            "sh" => code.lines().collect(),
            "python" => vec![code],
            _ => continue,
        };
        for line in lines {
            let interpreter = match language {
                "sh" => "sh".into(),
                _ => python(),
            };
            let mut command = world.command(&interpreter);
            command.args(["-c", line]).current_dir(&directory);
            command.env("PATH", format!("{programs}:/usr/bin:/bin"));
            world.start(language, command).finish().expect(0);
            commands += 1;
        }
    }
    assert!(commands > 2, "{commands} commands on {page}");
    directory
}

#[test]
fn every_command_of_the_tutorial_runs() {
    let world = World::new();
    let directory = run(&world, "tutorial.md");
    for made in [
        "flights/first/flight.svg",
        "flights/first/report.html",
        "flights/first_csv",
        "capture/summary.txt",
    ] {
        assert!(directory.join(made).exists(), "{made}");
    }
}

#[test]
fn every_command_of_the_page_on_bags_in_python_runs() {
    run(&World::new(), "howto/python_bags.md");
}

#[test]
fn every_command_of_the_page_on_minimum_time_runs() {
    let world = World::new();
    let directory = run(&world, "howto/minimum_time.md");
    assert!(directory.join("flights/slew/flight.svg").exists());
    assert!(directory.join("flights/wheels/flight.svg").exists());
}

#[test]
fn every_command_of_the_page_on_formations_runs() {
    let world = World::new();
    let directory = run(&world, "howto/formation.md");
    assert!(directory.join("flights/change/flight.svg").exists());
}

#[test]
fn every_command_of_the_page_on_moving_targets_runs() {
    let world = World::new();
    let directory = run(&world, "howto/moving_target.md");
    assert!(directory.join("flights/tumbling/flight.svg").exists());
}

#[test]
fn every_command_of_the_page_on_minimum_fuel_runs() {
    let world = World::new();
    let directory = run(&world, "howto/minimum_fuel.md");
    assert!(directory.join("flights/energy/flight.svg").exists());
}

#[test]
fn every_command_of_the_page_on_phases_runs() {
    let world = World::new();
    let directory = run(&world, "howto/phases.md");
    assert!(directory.join("flights/phases/flight.svg").exists());
}

#[test]
fn every_command_of_the_page_on_uncertainty_runs() {
    let world = World::new();
    let directory = run(&world, "howto/uncertainty.md");
    assert!(directory.join("flights/safe_ensemble/summary.txt").exists());
}

#[test]
fn every_command_of_the_page_on_constraints_runs() {
    let world = World::new();
    let directory = run(&world, "howto/constraints.md");
    for made in [
        "flights/inspection/report.html",
        "flights/dearer/flight.svg",
    ] {
        assert!(directory.join(made).exists(), "{made}");
    }
}

#[test]
fn every_command_of_the_page_on_two_satellites_runs() {
    let world = World::new();
    let directory = run(&world, "howto/two_satellites.md");
    for made in [
        "flights/formation/report.html",
        "flights/wider/flight.svg",
        "flights/approach/flight.svg",
        "flights/docking/flight.svg",
    ] {
        assert!(directory.join(made).exists(), "{made}");
    }
}
