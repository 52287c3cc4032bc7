//! `lgvi ensemble` with an object store: runs that are killed come to the bytes of one in a directory that was not.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use lgvi_tests::{Process, Signal, World, edited, eventually};
use serde_json::Value;

/// Samples of the test's ensembles, in eight parts.
const CHANGES: [(&str, &str); 1] = [("samples = 10000", "samples = 7500")];

/// A server that speaks S3.
struct Server {
    process: Process,
    answers: usize,
}

impl Server {
    /// Starts a server, and returns a world whose programs know it.
    fn start() -> (World, Self) {
        let world = World::new();
        let mut server = Self {
            process: world.python("s3_server.py", &[]),
            answers: 0,
        };
        let url = server.answer();
        let world = world
            .with("AWS_ENDPOINT", url)
            .with("AWS_ALLOW_HTTP", "true")
            .with("AWS_ACCESS_KEY_ID", "key")
            .with("AWS_SECRET_ACCESS_KEY", "secret")
            .with("AWS_REGION", "us-east-1");
        (world, server)
    }

    fn answer(&mut self) -> String {
        self.answers += 1;
        eventually("an answer of the server", || {
            let line = self.process.stdout();
            let mut lines = line
                .split_inclusive('\n')
                .filter(|line| line.ends_with('\n'));
            lines
                .nth(self.answers - 1)
                .map(|line| line.trim().to_owned())
        })
    }

    fn ask(&mut self, line: &str) -> Value {
        self.process.tell(line);
        serde_json::from_str(&self.answer()).unwrap()
    }

    /// The names of the parts in a folder.
    fn parts(&mut self, folder: &str) -> BTreeSet<String> {
        let names = self.ask(&format!("list {folder}/"));
        let names = names.as_array().unwrap().iter();
        let names = names.map(|name| name.as_str().unwrap().to_owned());
        names.filter(|name| name.ends_with(".parquet")).collect()
    }

    /// Names and bytes of all objects in a folder.
    fn contents(&mut self, world: &World, folder: &str) -> BTreeMap<String, Vec<u8>> {
        let directory = world.path(&format!("downloaded_{folder}"));
        fs::create_dir(&directory).unwrap();
        self.ask(&format!("get {folder}/ {}", directory.display()));
        contents(&directory)
    }
}

fn contents(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(directory).unwrap().map(Result::unwrap);
    let read = |entry: fs::DirEntry| {
        let name = entry.file_name().into_string().unwrap();
        (name, fs::read(entry.path()).unwrap())
    };
    entries.map(read).collect()
}

fn start(world: &World, scene: &Path, output: &str, more: &[&str]) -> Process {
    let arguments = [
        "ensemble",
        "run",
        scene.to_str().unwrap(),
        "--output",
        output,
    ];
    world.lgvi(arguments.iter().chain(more))
}

/// Flies the ensemble in a directory.
fn whole(world: &World, scene: &Path) -> BTreeMap<String, Vec<u8>> {
    let whole = world.path("whole");
    start(world, scene, whole.to_str().unwrap(), &[])
        .finish()
        .expect(0);
    let contents = contents(&whole);
    assert_eq!(contents.len(), 8 + 3, "parts, summary and picture");
    contents
}

#[test]
fn runs_killed_at_random_moments_come_to_the_bytes_of_a_whole_one() {
    let (world, mut server) = Server::start();
    let scene = edited(&world, "dispersed_capture", &CHANGES);
    let expected = whole(&world, &scene);
    let mut random = fastrand::Rng::with_seed(1);
    let mut kills = 0;
    loop {
        let before = server.parts("capture").len();
        let url = "s3://flights/capture/";
        let mut running = start(&world, &scene, url, &["--threads", "1", "--lanes", "1"]);
        eventually("a further part, or the end", || {
            (server.parts("capture").len() > before || !running.runs()).then_some(())
        });
        sleep(Duration::from_millis(random.u64(..150)));
        if !running.runs() {
            let finished = running.finish().expect(0);
            finished.says(&[]);
            assert!(
                finished
                    .stdout
                    .contains("results in s3://flights/capture\n")
            );
            break;
        }
        running.signal(Signal::SIGKILL);
        running.finish();
        kills += 1;
    }
    assert!(kills > 0, "it was killed on the way");
    let url = "s3://flights/capture";
    let again = start(&world, &scene, url, &[]).finish().expect(0);
    assert!(again.stdout.contains("7500 samples were there already"));
    let found = server.contents(&world, "capture");
    assert_eq!(
        found.keys().collect::<Vec<_>>(),
        expected.keys().collect::<Vec<_>>()
    );
    assert!(found == expected, "{kills} kills");
}

#[test]
fn ranges_in_one_folder_are_summarized_and_merged() {
    let (world, mut server) = Server::start();
    let scene = edited(&world, "dispersed_capture", &CHANGES);
    let expected = whole(&world, &scene);
    let url = "s3://flights/a/b";
    // Two runs of the same range write the same bytes.
    let shards = ["0..1500", "1500..7500", "1500..7500"]
        .map(|range| (range, start(&world, &scene, url, &["--range", range])));
    for (_, shard) in shards {
        let finished = shard.finish().expect(0);
        assert!(
            finished
                .stdout
                .contains("a run without --range summarizes them")
        );
    }
    assert_eq!(server.parts("a/b").len(), 9);
    let run = start(&world, &scene, url, &["--json"]).finish().expect(0);
    let report: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(report["output"], url);
    assert_eq!(report["picture"], format!("{url}/summary.svg"));
    assert_eq!(
        (&report["present"], &report["samples"]),
        (&7500.into(), &7500.into())
    );
    let merged = world.path("merged");
    let merge = [
        "ensemble",
        "merge",
        url,
        "--output",
        merged.to_str().unwrap(),
    ];
    world.lgvi(merge).finish().expect(0);
    assert!(contents(&merged) == expected);
    let refused = world.lgvi(["ensemble", "merge", url, "--output", "s3://flights/merged"]);
    refused
        .finish()
        .expect(2)
        .says(&["s3://flights/merged", "directory of this machine"]);
    // A URL of a directory is the directory.
    let local = format!("file://{}", world.path("local").display());
    start(&world, &scene, &local, &[]).finish().expect(0);
    assert!(contents(&world.path("local")) == expected);
}

#[test]
fn what_a_store_does_not_have_or_take_is_told_with_its_url() {
    let (world, mut server) = Server::start();
    let scene = edited(&world, "dispersed_capture", &CHANGES);
    for (url, code, reasons) in [
        (
            "s3://nowhere/capture",
            1,
            ["s3://nowhere/capture", "NoSuchBucket"],
        ),
        ("ftp://flights/capture", 2, ["ftp://flights/capture", "ftp"]),
        (
            "memory:///capture",
            2,
            ["memory:///capture", "expected s3://"],
        ),
        (
            "http://flights/capture",
            2,
            ["http://flights/capture", "expected s3://"],
        ),
        ("s3://flights/a?b", 2, ["s3://flights/a?b", "no query"]),
        ("az://flights/a", 2, ["az://flights/a", "ccount"]),
    ] {
        let refused = start(&world, &scene, url, &[]).finish().expect(code);
        refused.says(&reasons);
    }
    let part = "capture/samples_0000000000_0000001024.parquet";
    server.ask(&format!("put {part} PAR1"));
    let refused = start(&world, &scene, "s3://flights/capture", &[])
        .finish()
        .expect(2);
    refused.says(&[&format!("s3://flights/{part}"), "can be flown again"]);
    let nothing = world.path("merged");
    let merge = [
        "ensemble",
        "merge",
        "s3://flights/empty",
        "--output",
        nothing.to_str().unwrap(),
    ];
    world
        .lgvi(merge)
        .finish()
        .expect(2)
        .says(&["s3://flights/empty", "no parts of an ensemble"]);
}
