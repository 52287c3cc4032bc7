//! What makes a first hour easier: templates, changes on the command line, completions, man pages, help of nodes.

use lgvi_tests::{Summary, World, binary, scene};
use serde_json::Value;

#[test]
fn a_template_is_written_once_and_explained_with_changes() {
    let world = World::new();
    let file = world.path("mine.toml");
    let file = file.to_str().unwrap();
    world
        .lgvi(["new", "pendulum", "--output", file])
        .finish()
        .expect(0);
    let again = world.lgvi(["new", "pendulum", "--output", file]).finish();
    again.expect(2).says(&["mine.toml", "exists"]);
    world
        .lgvi(["new", "pendulumm"])
        .finish()
        .expect(2)
        .says(&["pendulum"]);

    let changed = [
        "explain",
        file,
        "--set",
        "run.steps=77",
        "--set",
        "title=Swing",
    ];
    let explained = world.lgvi(changed).finish().expect(0);
    assert!(explained.stdout.contains("Swing") && explained.stdout.contains("77 steps"));
    for (wrong, said) in [
        ("run.stepz=1", "did you mean `steps`?"),
        ("rum.steps=1", "`rum`"),
        ("steps", "KEY=VALUE"),
    ] {
        let refused = world.lgvi(["explain", file, "--set", wrong]).finish();
        refused.expect(2).says(&[said]);
    }
}

/// The bag has the scene as it was flown, so that `verify` flies the same.
#[test]
fn a_changed_scene_is_flown_recorded_and_verified() {
    let world = World::new();
    let directory = world.path("scenes");
    std::fs::create_dir(&directory).unwrap();
    let mesh = "v 1 1 1\nv -1 -1 1\nv -1 1 -1\nv 1 -1 -1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    std::fs::write(directory.join("rock.obj"), mesh).unwrap();
    let text = std::fs::read_to_string(scene("free_body")).unwrap();
    let text: String = text
        .lines()
        .filter(|line| !line.starts_with("inertia"))
        .map(|line| match line {
            "[[bodies]]" => "[[bodies]]\npolyhedron = { obj_file = \"rock.obj\" }\n".to_owned(),
            line => format!("{line}\n"),
        })
        .collect();
    let file = directory.join("rock.toml");
    std::fs::write(&file, text).unwrap();
    let flight = world.start_flight(&file, "flight", &["--set", "run.steps=5000"]);
    let summary: Summary = flight.finish().expect(0).json();
    assert_eq!(summary.flight.expect("a flight").steps, 5000);
    std::fs::remove_dir_all(&directory).unwrap();
    let bag = world.path("flight");
    world
        .lgvi(["verify", bag.to_str().unwrap()])
        .finish()
        .expect(0);
}

#[test]
fn results_are_one_json_object() {
    let world = World::new();
    let file = |name: &str| world.path(name).to_str().unwrap().to_owned();
    let json = |line: &[&str]| -> Value { world.lgvi(line).finish().expect(0).json() };
    let scene = json(&["new", "free_body", "--output", &file("body.toml"), "--json"]);
    assert_eq!(scene["scene"], file("body.toml"));
    // The old name of the option.
    let few = ["--set", "run.steps=20", "--set", "run.duration=0.2"];
    let into = ["--bag", &file("flight"), "--json"];
    let flown = json(&[&["run", &file("body.toml")], &few[..], &into[..]].concat());
    assert_eq!(flown["bag"], file("flight"));
    let bag = file("flight");
    let plotted = json(&["plot", &bag, "--json"]);
    assert_eq!(plotted["picture"], file("flight/flight.svg"));
    let played = json(&["play", &bag, "--rate", "0", "--json"]);
    let messages = flown["recorded"].as_object().unwrap().values();
    let messages: u64 = messages.map(|count| count.as_u64().unwrap()).sum();
    assert_eq!(
        played,
        serde_json::json!({"bag": bag, "messages": messages, "complete": true})
    );
    let line = [
        "record",
        "--topics",
        "/a",
        "--json",
        "--output",
        &file("new"),
    ];
    let recorder = world.lgvi(line);
    recorder.await_stderr("writing");
    let recorded: Value = recorder.stop().expect(0).json();
    assert_eq!(
        (&recorded["bag"], &recorded["lost"]),
        (&file("new").into(), &0.into())
    );
}

#[test]
fn what_is_no_bag_is_told_in_words() {
    let world = World::new();
    let scene = scene("pendulum").to_str().unwrap().to_owned();
    let nothing = world.path("nothing").to_str().unwrap().to_owned();
    for command in ["info", "verify", "plot", "play"] {
        for (path, said) in [
            (&scene, "not an MCAP file, expected a bag"),
            (&nothing, "No such file"),
        ] {
            let refused = world.lgvi([command, path, "--json"]).finish().expect(2);
            assert_eq!(refused.stderr.lines().count(), 1, "{}", refused.stderr);
            refused.says(&[path, said]);
            assert!(!refused.stderr.contains("os error"), "{}", refused.stderr);
            let failure: Value = refused.json();
            assert_eq!(failure["failure"]["exit_code"], 2);
            assert!(
                failure["failure"]["message"]
                    .as_str()
                    .unwrap()
                    .contains(said)
            );
        }
    }
}

#[test]
fn shells_and_man_know_every_command() {
    let world = World::new();
    for shell in ["bash", "zsh", "fish"] {
        let script = world.lgvi(["completions", shell]).finish().expect(0).stdout;
        assert!(
            script.contains("ensemble") && script.contains("real-time-factor"),
            "{shell}"
        );
    }
    let pages = world.path("man");
    world
        .lgvi(["man", pages.to_str().unwrap()])
        .finish()
        .expect(0);
    for page in ["lgvi.1", "lgvi-run.1", "lgvi-ensemble-merge.1"] {
        let text = std::fs::read_to_string(pages.join(page)).unwrap();
        assert!(text.contains(".SH"), "{page}: {text}");
    }
}

#[test]
fn nodes_list_their_parameters() {
    let world = World::new();
    for (kind, parameter) in [
        ("propagator", "real_time_factor"),
        ("planner", "plan_at_start"),
        ("recorder", "max_cache_size"),
        ("player", "start_offset"),
    ] {
        let own = world
            .lgvi(["node", kind, "--help"])
            .finish()
            .expect(0)
            .stdout;
        let mut command = world.command(&binary(&format!("lgvi_{kind}")));
        command.arg("-h");
        let same = world.start(kind, command).finish().expect(0).stdout;
        assert_eq!(own, same);
        for name in [parameter, "use_sim_time", "autostart", "default:"] {
            assert!(own.contains(name), "{name}: {own}");
        }
    }
}
