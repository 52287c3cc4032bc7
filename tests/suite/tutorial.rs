//! The commands of docs/tutorial.md run, in their order, in an empty directory.

use std::path::Path;

use lgvi_tests::{World, binary, root};

#[test]
fn every_command_of_the_tutorial_runs() {
    let world = World::new();
    let page = std::fs::read_to_string(root().join("docs/tutorial.md")).unwrap();
    let commands: Vec<&str> = page
        .split("```sh\n")
        .skip(1)
        .flat_map(|block| block.split("```").next().unwrap().lines())
        .collect();
    assert!(commands.len() > 10 && commands.iter().all(|line| line.starts_with("lgvi ")));
    let directory = world.path("first");
    std::fs::create_dir(&directory).unwrap();
    let programs = binary("lgvi").parent().unwrap().display().to_string();
    for line in commands {
        let mut shell = world.command(Path::new("sh"));
        shell.args(["-c", line]).current_dir(&directory);
        shell.env("PATH", format!("{programs}:/usr/bin:/bin"));
        world.start(line, shell).finish().expect(0);
    }
    for made in [
        "flights/first/flight.svg",
        "flights/first/report.html",
        "flights/first_csv",
        "capture/summary.txt",
    ] {
        assert!(directory.join(made).exists(), "{made}");
    }
}
