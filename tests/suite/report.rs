//! `lgvi report`: what its page holds, and what it refuses.

use std::fs;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use lgvi_msgs::msg::{Scene, SystemState};
use lgvi_tests::{Recording, World, reference_bag, root, scene};
use serde_json::Value;
use sha2::{Digest, Sha256};

const STATE: &str = "/lgvi_propagator/state";
const HOSTILE: &str = "</script><script>broken = true</script><!-- {{flight}} <b onclick='x'> & \\\" \u{2028} </title>";

/// Writes the page of a bag, and returns its path and its text.
#[track_caller]
fn report(world: &World, bag: &Path, name: &str) -> (PathBuf, String) {
    let page = world.path(name);
    let words = ["report".as_ref(), bag.as_os_str(), "--output".as_ref()];
    let line = words.into_iter().chain([page.as_os_str()]);
    let said = world.lgvi(line).finish().expect(0).stdout;
    assert_eq!(said.trim_end(), page.display().to_string());
    let text = fs::read_to_string(&page).unwrap();
    (page, text)
}

/// The data in a page.
#[track_caller]
fn data(page: &str) -> Value {
    let (_, rest) = page
        .split_once("<script type=\"application/json\" id=\"flight\">")
        .expect("the data");
    let (json, _) = rest.split_once("</script>").expect("the end of the data");
    serde_json::from_str(json).unwrap()
}

#[track_caller]
fn numbers(packed: &Value) -> Vec<f64> {
    let bytes = BASE64_STANDARD.decode(packed.as_str().unwrap()).unwrap();
    let numbers = bytes.chunks_exact(8);
    numbers
        .map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap()))
        .collect()
}

/// The matrix of a quaternion, row by row.
fn matrix(quaternion: &[f64]) -> [f64; 9] {
    let [w, x, y, z] = quaternion.try_into().unwrap();
    [
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    ]
}

#[test]
fn the_states_in_a_page_are_those_of_the_bag() {
    let world = World::new();
    for name in [
        "inclination_change",
        "two_dumbbells",
        "pendulum",
        "free_body",
    ] {
        let bag = reference_bag(name);
        let (_, page) = report(&world, &bag, &format!("{name}.html"));
        let flight = data(&page);
        let states: Vec<SystemState> = Recording::read(&bag).messages(STATE);
        assert!(states.len() > 100, "{name}: {} states", states.len());
        assert_eq!(flight["shown"], states.len(), "{name}");
        assert_eq!(flight["recorded"], states.len(), "{name}");
        let times: Vec<_> = states.iter().map(|state| state.time).collect();
        assert_eq!(numbers(&flight["time"]), times, "{name}");
        let bodies = flight["bodies"].as_array().unwrap();
        assert_eq!(bodies.len(), states[0].bodies.len(), "{name}");
        for (index, body) in bodies.iter().enumerate() {
            assert_eq!(
                flight["scenery"]["bodies"][index]["name"],
                states[0].bodies[index].name
            );
            let recorded = || states.iter().map(|state| &state.bodies[index]);
            let position: Vec<_> = recorded().flat_map(|body| body.position).collect();
            assert_eq!(numbers(&body["position"]), position, "{name}");
            let linear: Vec<_> = recorded().flat_map(|body| body.linear_momentum).collect();
            assert_eq!(numbers(&body["linear_momentum"]), linear, "{name}");
            let angular: Vec<_> = recorded().flat_map(|body| body.angular_momentum).collect();
            assert_eq!(numbers(&body["angular_momentum"]), angular, "{name}");
            let attitudes = numbers(&body["attitude"]);
            let mut before: Option<&[f64]> = None;
            for (quaternion, body) in attitudes.chunks_exact(4).zip(recorded()) {
                for (found, expected) in matrix(quaternion).iter().zip(&body.attitude) {
                    assert!(
                        (found - expected).abs() < 1e-14,
                        "{name}: {found} {expected}"
                    );
                }
                let along = before.map(|before| before.iter().zip(quaternion).map(|(a, b)| a * b));
                assert!(
                    along.is_none_or(|along| along.sum::<f64>() > 0.0),
                    "a sign jumps"
                );
                before = Some(quaternion);
            }
        }
    }
}

/// A free body's energy and angular momentum follow from its inertia and attitude alone.
#[test]
fn energy_and_momentum_of_a_free_body() {
    let world = World::new();
    let bag = reference_bag("free_body");
    let (_, page) = report(&world, &bag, "page.html");
    let flight = data(&page);
    let states: Vec<SystemState> = Recording::read(&bag).messages(STATE);
    let totals = numbers(&flight["energy"]["total"]);
    let momenta = numbers(&flight["angular_momentum"]);
    // scenes/free_body.toml
    let inertia = [1.0, 2.0, 3.0];
    for ((state, total), momentum) in states.iter().zip(totals).zip(momenta.chunks_exact(3)) {
        let body = &state.bodies[0];
        let spin = body.angular_momentum;
        let energy: f64 = (0..3).map(|i| 0.5 * spin[i] * spin[i] / inertia[i]).sum();
        assert!((total - energy).abs() < 1e-14, "{total} {energy}");
        for (row, found) in momentum.iter().enumerate() {
            let turned: f64 = (0..3).map(|i| body.attitude[3 * row + i] * spin[i]).sum();
            assert!((found - turned).abs() < 1e-14, "{found} {turned}");
        }
    }
}

/// The commands are those of the sequence that was flown, and what is drawn is the scene's.
#[test]
fn controls_and_maneuver_of_a_planned_flight() {
    let world = World::new();
    let bag = reference_bag("inclination_change");
    let (_, page) = report(&world, &bag, "page.html");
    let flight = data(&page);
    let recording = Recording::read(&bag);
    let flown: Vec<lgvi_msgs::msg::ControlSequence> =
        recording.messages("/lgvi_propagator/flown_control");
    let controls = &flight["controls"][0];
    let force: Vec<f64> = flown[0]
        .force
        .iter()
        .flat_map(|force| [force.x, force.y, force.z])
        .collect();
    assert_eq!(numbers(&controls["force"]), force);
    assert_eq!(numbers(&controls["time"]).len(), force.len() / 3 + 1);
    let maneuver = &flight["scenery"]["maneuver"];
    let target = [
        -0.353_553_390_593_273_8,
        0.353_553_390_593_273_8,
        0.866_025_403_784_438_6,
    ];
    assert_eq!(maneuver["position"], serde_json::json!(target));
    assert_eq!(flight["scenery"]["bodies"][0]["shape"]["kind"], "spheres");
}

#[test]
fn a_long_flight_is_thinned_out_and_says_so() {
    let world = World::new();
    let (_, bag) = world.fly(&scene("rocks"), "rocks");
    let states: Vec<SystemState> = Recording::read(&bag).messages(STATE);
    let (_, page) = report(&world, &bag, "page.html");
    let flight = data(&page);
    let times = numbers(&flight["time"]);
    // 289 states of 64 bodies are within the bound; see `STATES`.
    assert_eq!(times.len(), states.len());
    assert!(page.len() < 4_000_000, "{} bytes", page.len());

    let scene = lgvi_tests::edited(&world, "free_body", &[("steps = 10000", "steps = 30000")]);
    let (_, bag) = world.fly(&scene, "long");
    let (_, page) = report(&world, &bag, "long.html");
    let flight = data(&page);
    assert_eq!(flight["recorded"], 30_001);
    let times = numbers(&flight["time"]);
    assert_eq!(flight["shown"], times.len());
    assert_eq!(times.len(), 20_000);
    assert_eq!((times[0], times[times.len() - 1]), (0.0, 100.0));
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
}

#[test]
fn a_hostile_title_stays_a_text_and_nothing_is_loaded() {
    let world = World::new();
    let mut recording = Recording::read(&reference_bag("free_body"));
    let harmless = world.path("harmless");
    recording.write(&harmless);
    recording.edit("/lgvi_propagator/scene", 0, |scene: &mut Scene| {
        let title = serde_json::to_string(HOSTILE).unwrap();
        let line = scene
            .text
            .lines()
            .find(|line| line.starts_with("title"))
            .unwrap();
        scene.text = scene.text.replace(line, &format!("title = {title}"));
    });
    let hostile = world.path("hostile");
    recording.write(&hostile);
    let (_, harmless) = report(&world, &harmless, "harmless.html");
    let (_, hostile) = report(&world, &hostile, "hostile.html");
    assert_eq!(data(&hostile)["title"], HOSTILE);
    for tag in ["<script", "</script", "<!--", "<b ", "</title>", "<title"] {
        let count = |page: &str| page.matches(tag).count();
        assert_eq!(count(&hostile), count(&harmless), "{tag}");
    }
    assert!(hostile.contains("<h1>&lt;/script>&lt;script>broken = true"));
    // The name of a vocabulary, which nothing loads.
    let page = harmless.replace("http://www.w3.org/1999/xhtml", "");
    for fragment in ["http:", "https:", " src=", "url(", "<link", "@import"] {
        assert!(!page.contains(fragment), "{fragment} is in the page");
    }
}

#[test]
fn the_page_is_as_json_says_and_only_the_bag_s_own_is_replaced() {
    let world = World::new();
    let bag = world.path("bag");
    Recording::read(&reference_bag("pendulum")).write(&bag);
    let run = |words: &[&std::ffi::OsStr], code| {
        let line = ["report".as_ref(), bag.as_os_str()];
        let line = line.into_iter().chain(words.iter().copied());
        world.lgvi(line).finish().expect(code)
    };
    let said: Value = serde_json::from_str(&run(&["--json".as_ref()], 0).stdout).unwrap();
    let page = bag.join("report.html");
    let text = fs::read(&page).unwrap();
    assert_eq!(said["output"], page.display().to_string());
    assert_eq!(said["bytes"], text.len());
    assert_eq!(said["bodies"], 1);
    fs::write(&page, "old").unwrap();
    run(&["--output".as_ref(), page.as_ref()], 2).says(&["report.html", "File exists"]);
    run(&[], 0);
    assert!(fs::read(&page).unwrap() == text, "pages of one bag differ");
    world.verify(&bag, 0);
}

#[test]
fn what_is_no_flight_is_refused_in_words() {
    let world = World::new();
    let refused = |bag: &Path, fragments: &[&str]| {
        let line = ["report".as_ref(), bag.as_os_str(), "--json".as_ref()];
        let finished = world.lgvi(line).finish().expect(2);
        let failure: Value = serde_json::from_str(&finished.stdout).unwrap();
        assert_eq!(failure["failure"]["exit_code"], 2);
        finished.says(fragments);
    };
    let text = scene("free_body");
    refused(&text, &[text.to_str().unwrap(), "not an MCAP file"]);
    refused(&world.path("missing"), &["missing", "No such file"]);
    let stateless = world.path("stateless");
    Recording::read(&reference_bag("free_body"))
        .without(STATE)
        .write(&stateless);
    refused(&stateless, &["stateless", "no states"]);
}

/// `just report-bundle` remakes the bundle; its first line tells of which sources it is.
#[test]
fn the_bundle_of_libraries_is_that_of_its_sources() {
    let report = root().join("nodes/lgvi/src/report");
    let bundle = fs::read_to_string(report.join("assets/libraries.min.js")).unwrap();
    let mut sources = Sha256::new();
    for name in ["package-lock.json", "libraries.js"] {
        sources.update(fs::read(report.join("bundle").join(name)).unwrap());
    }
    let digest: String = sources
        .finalize()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    assert_eq!(
        bundle.lines().next().unwrap(),
        format!("/* sources {digest}"),
        "the bundle is of other sources; `just report-bundle` remakes it"
    );
    let lock: Value =
        serde_json::from_str(&fs::read_to_string(report.join("bundle/package-lock.json")).unwrap())
            .unwrap();
    for package in ["three", "uplot"] {
        let version = lock["packages"][format!("node_modules/{package}")]["version"]
            .as_str()
            .unwrap();
        assert!(
            bundle.contains(&format!("\n{package} {version}, MIT\n")),
            "{package} {version}"
        );
    }
    assert_eq!(
        bundle.matches("Permission is hereby granted").count(),
        2,
        "licenses"
    );
    assert!(bundle.len() < 800_000, "{} bytes", bundle.len());
}

/// What a maneuver keeps to is in the page, with what it bounds as it was flown: within hard limits, beyond a soft one.
#[test]
fn the_limits_of_a_maneuver_are_in_the_page() {
    let world = World::new();
    let (summary, bag) = world.fly_fast(&scene("inspection"), "inspection");
    let soft = summary
        .plan
        .unwrap()
        .soft
        .expect("a violation with a price");
    assert!(
        (0.05..0.1).contains(&soft.violation) && soft.paid > 0.0,
        "{soft:?}"
    );
    let (_, page) = report(&world, &bag, "page.html");
    let flight = data(&page);
    let limits = flight["scenery"]["maneuver"]["limits"].as_array().unwrap();
    let kinds: Vec<_> = limits.iter().map(|limit| limit["kind"].as_str()).collect();
    let expected = [
        Some("keep_out_ellipsoid"),
        Some("line_of_sight"),
        None,
        None,
        Some("plume"),
        Some("keep_out_cone"),
    ];
    assert_eq!(kinds, expected);
    assert_eq!(limits[0]["semi_axes"], serde_json::json!([8.0, 14.0, 8.0]));
    for limit in limits {
        let plot = &limit["plot"];
        let values = numbers(&plot["values"]);
        assert_eq!(values.len(), 401);
        let bound = plot["bound"].as_f64().unwrap();
        let room = values.iter().map(|value| match plot["least"] == true {
            true => value / bound - 1.0,
            false => 1.0 - value / bound,
        });
        let least = room.fold(f64::INFINITY, f64::min);
        // Each hard limit is touched.
        let expected = match limit["soft"] == true {
            true => -0.15..-0.05,
            false => -1e-6..0.01,
        };
        assert!(expected.contains(&least), "{}: {least}", plot["title"]);
    }
}
