//! The commands of the how-to page on two hosts run on two hosts.

use std::thread;
use std::time::Duration;

use lgvi_tests::{Host, Hosts, Process, Recording, between_hosts, binary, eventually, root};

/// Addresses on the page, and those of the hosts of the test.
const ADDRESSES: [[&str; 2]; 2] = [["192.0.2.1", "10.77.0.1"], ["192.0.2.2", "10.77.0.2"]];

/// How long a person takes from one terminal to the next.
const TURN: Duration = Duration::from_secs(3);

/// A block of commands.
struct Block {
    /// What its first line says: the host, and what it is for.
    title: String,
    lines: Vec<String>,
}

/// The blocks of shell commands on the page.
fn blocks() -> Vec<Block> {
    let page = root().join("docs/howto/two_hosts.md");
    let mut text = std::fs::read_to_string(page).unwrap();
    for [shown, real] in ADDRESSES {
        text = text.replace(shown, real);
    }
    let blocks = text.split("```sh\n").skip(1).map(|rest| {
        let (code, _) = rest.split_once("\n```").unwrap();
        let (title, commands) = code.split_once('\n').unwrap();
        Block {
            title: title.trim_start_matches("# ").to_owned(),
            lines: commands.lines().map(str::to_owned).collect(),
        }
    });
    blocks.collect()
}

/// Runs the lines of a block on a host, in its directory `run`, after what was exported; all but nodes end by themselves.
fn enter(host: &Host, run: &str, exports: &[String], lines: &[String]) -> Vec<Process> {
    let directory = host.path(run);
    std::fs::create_dir_all(&directory).unwrap();
    let programs = binary("lgvi").parent().unwrap().display().to_string();
    let mut exports = exports.to_vec();
    let mut nodes = Vec::new();
    for line in lines {
        if line.starts_with("export ") {
            exports.push(line.clone());
            continue;
        }
        let mut command = host.command("/bin/sh".as_ref());
        let script = format!("{}\nexec {line}", exports.join("\n"));
        command.args(["-c", &script]).current_dir(&directory);
        command.env("PATH", format!("{programs}:/usr/bin:/bin"));
        let name = line.split(" --").next().unwrap_or(line);
        let process = host.world().start(name, command);
        if line.starts_with("lgvi node") {
            nodes.push(process);
        } else {
            process.finish().expect(0);
        }
    }
    nodes
}

/// Flies as the page says, in terminals that have exported what its blocks of a `variant` say.
fn fly(hosts: &Hosts, variant: &str) {
    let run = variant.replace(' ', "_");
    let blocks = blocks();
    let host = |block: &Block| {
        if block.title.starts_with("host a") {
            &hosts.a
        } else {
            &hosts.b
        }
    };
    let exports = |of: &Block| -> Vec<String> {
        let same =
            |block: &&Block| block.title == format!("{}: {variant}", &of.title[.."host a".len()]);
        let exports = blocks.iter().filter(same);
        exports.flat_map(|block| block.lines.clone()).collect()
    };
    let of_flight = |block: &&Block| ["host a", "host b"].contains(&block.title.as_str());
    let mut nodes = Vec::new();
    for block in blocks.iter().filter(of_flight) {
        // A scene that is there already is not written again.
        let lines: Vec<_> = (block.lines.iter())
            .filter(|line| !(line.starts_with("lgvi new") && host(block).path(&run).exists()))
            .cloned()
            .collect();
        nodes.extend(enter(host(block), &run, &exports(block), &lines));
        thread::sleep(TURN);
    }
    assert_eq!(nodes.len(), 3, "propagator, recorder, planner");
    eventually("the end of the flight", || {
        nodes[0].stderr().contains("flown 1000 steps").then_some(())
    });
    thread::sleep(TURN);
    for node in nodes {
        node.stop().expect(0);
    }
    let end = blocks
        .iter()
        .find(|block| block.title == "host b, at the end");
    enter(&hosts.b, &run, &[], &end.unwrap().lines);
    let recording = Recording::read(&hosts.b.path(&run).join("flight"));
    let counts = recording.counts();
    for topic in ["state", "odometry/spacecraft", "invariants"] {
        let topic = format!("/lgvi_propagator/{topic}");
        assert_eq!(counts[topic.as_str()], 1001, "{variant}: {topic}");
    }
}

#[test]
fn the_flight_of_the_page_is_flown_across() {
    between_hosts(
        "two_hosts_page::the_flight_of_the_page_is_flown_across",
        |hosts| {
            fly(hosts, "no more");
            let variants = ["static peers", "Zenoh"];
            for block in blocks() {
                let variant = block
                    .title
                    .split_once(": ")
                    .map(|(_, variant)| variant.to_owned());
                assert!(variant.is_none_or(|variant| variants.contains(&variant.as_str())));
            }
        },
    );
}

#[test]
fn the_page_s_static_peers_find_each_other_without_multicast() {
    const TEST: &str = "two_hosts_page::the_page_s_static_peers_find_each_other_without_multicast";
    between_hosts(TEST, |hosts| {
        hosts.without_multicast();
        fly(hosts, "static peers");
    });
}

#[cfg(feature = "zenoh")]
#[test]
fn the_page_s_zenoh_connects_by_one_port() {
    between_hosts(
        "two_hosts_page::the_page_s_zenoh_connects_by_one_port",
        |hosts| {
            hosts.without_multicast();
            fly(hosts, "Zenoh");
        },
    );
}
