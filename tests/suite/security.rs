//! DDS security: who is in an enclave of the keystore takes part, and nobody else reads, commands or ends anything.

use std::collections::BTreeSet;
use std::fs;
use std::net::{Ipv4Addr, UdpSocket};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

use lgvi_common::Event;
use lgvi_middleware::ros::Qos;
use lgvi_middleware::shm::ShmOptions;
use lgvi_msgs::cdr;
use lgvi_msgs::msg::Scene;
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_tests::{
    Keystore, Process, Recording, Summary, World, binary, coast, eventually, fast_dds, publish,
    scene, settled,
};

const CONTROL: &str = "/lgvi_propagator/control_sequence";
const ODOMETRY: &str = "/lgvi_propagator/odometry/spacecraft";

/// What RustDDS says of a peer whose certificate another authority has signed.
const OTHER_AUTHORITY: &str = "CertificateSignatureVerificationFailed";

fn parameter_scene() -> String {
    format!("scene:={}", scene("inclination_change").display())
}

/// A propagator in the enclave `/propagator` that waits for a control sequence.
fn propagator(world: &World, keystore: &Keystore) -> Process {
    let parameters = [&*parameter_scene(), "real_time_factor:=0.0"];
    let propagator = world.secured_node("propagator", keystore, "/propagator", &parameters);
    propagator.await_ready();
    propagator
}

/// A planner that shares no memory with the propagator.
fn remote_planner(world: &World, keystore: &Keystore, enclave: &str) -> Process {
    let parameters = [&*parameter_scene()];
    let mut command = world.secured_node_command("planner", keystore, enclave, &parameters);
    let renamed = format!("~/control_sequence:={CONTROL}");
    command
        .env("LGVI_SHM_ROOT", world.apart())
        .args(["-r", &renamed]);
    world.start("planner", command)
}

fn has_flown(propagator: &Process) -> bool {
    let stdout = propagator.stdout();
    let mut events = stdout
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok());
    events.any(|event| matches!(event, Event::Flown(_)))
}

#[test]
fn a_flight_in_its_enclave_loses_nothing_and_a_stranger_neither_hears_nor_disturbs_it() {
    let world = World::new();
    let keystore = Keystore::new(&world, "keys").enclave("/flight");
    let stranger = world.ros_node("stranger");
    let odometry = stranger
        .subscription::<Odometry>(ODOMETRY, &Qos::sensor(10))
        .unwrap();
    let control = publish(&stranger, &coast());
    let mut command = world.secured_command("lgvi", &keystore);
    let bag = world.path("bag");
    command
        .env("ROS_SECURITY_ENCLAVE_OVERRIDE", "/flight")
        .args(["run".as_ref(), scene("inclination_change").as_os_str()])
        .args(["--output".as_ref(), bag.as_os_str()])
        .args(["--json", "--no-plot", "--real-time-factor", "0.3"]);
    let finished = world.start("lgvi", command).finish().expect(0);
    let summary: Summary = finished.json();
    assert_eq!(summary.lost, Some(0), "messages lost");
    assert!(summary.flight.unwrap().miss.unwrap().norm <= 1e-12);
    assert_eq!(Recording::read(&bag).on(ODOMETRY).count(), 101);
    world.verify_agrees(&bag, 1001);

    assert_eq!(control.matched_subscriptions(), 0);
    assert!(odometry.take().unwrap().is_none());
    assert_eq!(stranger.topics(), []);
    assert_eq!(stranger.other_nodes(), Vec::<String>::new());
}

#[test]
fn only_an_enclave_of_the_same_authority_commands() {
    let world = World::new();
    let keystore = Keystore::new(&world, "keys")
        .enclave("/propagator")
        .enclave("/planner");
    let others = Keystore::new(&world, "others").enclave("/planner");
    let propagator = propagator(&world, &keystore);

    let stranger = world.ros_node("stranger");
    let control = publish(&stranger, &coast());
    let impostor = remote_planner(&world, &others, "/planner");
    // Which of the two asks the other first follows from their random identities.
    eventually("a refusal", || {
        let both = [&propagator, &impostor];
        let refused = both.map(|node| node.stderr().contains(OTHER_AUTHORITY));
        refused.contains(&true).then_some(())
    });
    impostor.await_event("planned", |event| {
        matches!(event, Event::Planned { .. }).then_some(())
    });
    impostor.stop().expect(0);
    assert_eq!(control.matched_subscriptions(), 0);
    assert!(!has_flown(&propagator));

    let planner = remote_planner(&world, &keystore, "/planner");
    let report = propagator.await_flown();
    assert_eq!(report.steps, 1000);
    assert!(report.miss.unwrap().norm <= 1e-12, "not the plan");
    planner.stop().expect(0);
    propagator.stop().expect(0);
}

/// Where RustDDS announces a participant on the loopback interface: the discovery ports of RTPS 2.5, 9.6.2.3.
fn discovery_ports(domain: u16) -> impl Iterator<Item = (Ipv4Addr, u16)> {
    (0..12).map(move |place| (Ipv4Addr::LOCALHOST, 7400 + 250 * domain + 10 + 2 * place))
}

/// Who announces itself in a domain: the prefixes that RTPS messages begin with.
fn announced(domain: u16, count: usize) -> BTreeSet<[u8; 12]> {
    let places: Vec<_> = discovery_ports(domain).collect();
    let mut free = places.iter().rev().map(UdpSocket::bind);
    let inlet = free.find_map(Result::ok).unwrap();
    inlet.set_nonblocking(true).unwrap();
    let mut found = BTreeSet::new();
    eventually("announcements", || {
        let mut message = [0; 65_536];
        let length = inlet.recv(&mut message).ok()?;
        if length >= 20 && message.starts_with(b"RTPS") {
            found.insert(message[8..20].try_into().unwrap());
        }
        (found.len() >= count).then_some(())
    });
    found
}

/// Says in the name of participants that they leave: DATA of the built-in writer of participants with the participant as
/// its key, disposed and unregistered (RTPS 2.5, 9.4.5.4 and 9.6.4).
fn forge_departures(domain: u16, participants: &BTreeSet<[u8; 12]>) {
    let outlet = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    for participant in participants {
        let message = [
            b"RTPS\x02\x04\x01\x12",
            &participant[..],
            &[0x15, 3, 52, 0, 0, 0, 16, 0, 0, 1, 0, 0xc7, 0, 1, 0, 0xc2],
            &[0, 1, 0, 0, 0, 0, 0, 0, 0x70, 0, 16, 0],
            participant,
            &[0, 0, 1, 0xc1, 0x71, 0, 4, 0, 0, 0, 0, 3, 1, 0, 0, 0],
        ]
        .concat();
        for place in discovery_ports(domain) {
            outlet.send_to(&message, place).unwrap();
        }
    }
}

#[test]
fn a_forged_departure_ends_a_node_without_security_for_others() {
    let world = World::new();
    let domain = world.environment().domain_id;
    let observer = world.ros_node("observer");
    let propagator = world.node("propagator", &[&parameter_scene()]);
    propagator.await_ready();
    let node = || observer.other_nodes().contains(&"/lgvi_propagator".into());
    eventually("the propagator", || node().then_some(()));
    let participants = announced(domain, 2);
    forge_departures(domain, &participants);
    eventually("its departure", || (!node()).then_some(()));
    propagator.stop().expect(0);
}

#[test]
fn a_forged_departure_ends_nothing_with_security() {
    let world = World::new();
    let domain = world.environment().domain_id;
    let keystore = Keystore::new(&world, "keys")
        .enclave("/propagator")
        .enclave("/recorder")
        .enclave("/planner");
    let propagator = {
        let parameters = [
            &*parameter_scene(),
            "real_time_factor:=0.2",
            "await_subscribers:=1",
        ];
        world.secured_node("propagator", &keystore, "/propagator", &parameters)
    };
    propagator.await_ready();
    let bag = world.path("bag");
    let output = format!("output:={}", bag.display());
    let recorder = world.secured_node("recorder", &keystore, "/recorder", &[&output]);
    recorder.await_ready();
    let participants = announced(domain, 2);
    let planner = remote_planner(&world, &keystore, "/planner");
    let recorded = || {
        let stdout = recorder.stdout();
        let events = stdout
            .lines()
            .filter_map(|line| serde_json::from_str(line).ok());
        let mut latest = events.filter_map(|event| match event {
            Event::Recording { messages, .. } => messages.get(ODOMETRY).copied(),
            _ => None,
        });
        latest.next_back().unwrap_or(0)
    };
    eventually("odometry", || (recorded() >= 5).then_some(()));
    // Again and again, until most of the flight is over.
    eventually("the end of the flight", || {
        forge_departures(domain, &participants);
        (recorded() >= 90).then_some(())
    });
    propagator.await_flown();
    planner.stop().expect(0);
    propagator.stop().expect(0);
    settled(recorded);
    recorder.stop().expect(0);
    assert_eq!(Recording::read(&bag).on(ODOMETRY).count(), 101);
}

#[test]
fn an_enclave_gives_no_more_than_its_permissions() {
    let world = World::new();
    let all = ["rq/*Request", "rr/*Reply", "rt/*", "ros_discovery_info"];
    let own = [
        "rr/lgvi_planner/*Reply",
        "rt/lgvi_planner/*",
        "rt/rosout",
        "rt/parameter_events",
        "rt/diagnostics",
        "ros_discovery_info",
    ];
    let keystore = Keystore::new(&world, "keys").enclave_for("/planner", &own, &all);
    let planner = remote_planner(&world, &keystore, "/planner");
    let finished = planner.finish().expect(1);
    finished.says(&[CONTROL, "Security"]);
}

#[test]
fn what_is_missing_is_an_error_that_names_it() {
    let world = World::new();
    let keystore = Keystore::new(&world, "keys").enclave("/a");
    let output = format!("output:={}", world.path("bag").display());
    let refused = |mut command: Command, fragments: &[&str]| {
        let node = {
            command.args(["-p", &output]);
            world.start("recorder", command)
        };
        node.finish().expect(2).says(fragments);
    };
    let command = |enclave| world.secured_node_command("recorder", &keystore, enclave, &[]);
    let path = keystore.path().display().to_string();
    let nowhere = keystore.directory("/b").display().to_string();
    let variable = "ROS_SECURITY_KEYSTORE";
    refused(
        command("/b"),
        &["\"/b\"", "--enclave", &nowhere, variable, &path],
    );
    let mut overridden = command("/a");
    overridden.env("ROS_SECURITY_ENCLAVE_OVERRIDE", "/b");
    refused(
        overridden,
        &["\"/b\"", "ROS_SECURITY_ENCLAVE_OVERRIDE", &nowhere],
    );
    let mut without = command("/a");
    without.env_remove(variable);
    refused(
        without,
        &["ROS_SECURITY_ENABLE is true", variable, "not set"],
    );
    let key = keystore.directory("/a").join("key.pem");
    fs::remove_file(&key).unwrap();
    refused(
        command("/a"),
        &["\"/a\"", "lacks", &key.display().to_string(), variable],
    );

    for (variable, value) in [
        ("ROS_SECURITY_ENABLE", "1"),
        ("ROS_SECURITY_STRATEGY", "enforce"),
        ("ROS_SECURITY_ENCLAVE_OVERRIDE", "b"),
    ] {
        let mut wrong = command("/a");
        wrong.env(variable, value);
        refused(wrong, &[variable, &format!("{value:?}")]);
    }
}

#[test]
fn files_that_do_not_belong_together_are_refused_at_the_start() {
    let world = World::new();
    let keystore = Keystore::new(&world, "keys").enclave("/a").enclave("/b");
    let others = Keystore::new(&world, "others").enclave("/a");
    let output = format!("output:={}", world.path("bag").display());
    let of = |keystore: &Keystore, enclave, file| keystore.directory(enclave).join(file);
    let nonsense = world.path("nonsense");
    fs::write(&nonsense, "nonsense").unwrap();
    for (file, by) in [
        ("cert.pem", nonsense.clone()),
        ("key.pem", nonsense.clone()),
        ("identity_ca.cert.pem", nonsense.clone()),
        ("governance.p7s", nonsense.clone()),
        ("permissions.p7s", nonsense.clone()),
        ("cert.pem", of(&others, "/a", "cert.pem")),
        ("governance.p7s", of(&others, "/a", "governance.p7s")),
        ("permissions.p7s", of(&others, "/a", "permissions.p7s")),
        ("permissions.p7s", of(&keystore, "/b", "permissions.p7s")),
    ] {
        let path = of(&keystore, "/a", file);
        let kept = world.path("kept");
        fs::rename(&path, &kept).unwrap();
        fs::copy(&by, &path).unwrap();
        let node = world.secured_node("recorder", &keystore, "/a", &[&output]);
        let finished = node.finish().expect(1);
        let directory = keystore.directory("/a").display().to_string();
        finished.says(&["cannot join domain", "\"/a\"", &directory]);
        assert!(!finished.stderr.contains("panicked"), "{file}");
        fs::rename(&kept, &path).unwrap();
    }
}

#[test]
fn a_permissive_node_without_files_joins_without_security_and_says_so() {
    let world = World::new();
    let keystore = Keystore::new(&world, "keys");
    let observer = world.ros_node("observer");
    let output = format!("output:={}", world.path("bag").display());
    let mut command = world.command(&binary("lgvi_recorder"));
    command
        .env("ROS_SECURITY_ENABLE", "true")
        .env("ROS_SECURITY_KEYSTORE", keystore.path())
        .args(["--supervised", "--ros-args", "--enclave", "/missing"])
        .args(["-p", &output]);
    let recorder = world.start("recorder", command);
    recorder.await_ready();
    recorder.await_stderr("joining without security");
    let there = || observer.other_nodes().contains(&"/lgvi_recorder".into());
    eventually("the recorder", || there().then_some(()));
    recorder.stop().expect(0);
    eventually("its end", || (!there()).then_some(()));
}

/// The number of the user who owns nothing.
const NOBODY: &str = "65534";

/// A command that runs a shell script as another user.
fn as_nobody(world: &World, script: &str) -> Command {
    let mut command = world.command("setpriv".as_ref());
    let user = [&format!("--reuid={NOBODY}"), &format!("--regid={NOBODY}")];
    command
        .args(user)
        .args(["--clear-groups", "sh", "-c", script])
        .current_dir("/");
    command
}

#[test]
fn no_other_user_reads_or_writes_the_shared_memory_of_a_flight() {
    if !nix::unistd::geteuid().is_root() {
        // Only root can act as another user.
        return;
    }
    let world = World::new();
    // As for a user's own directory, which is not in a temporary directory that nobody else may enter.
    let root = tempfile::Builder::new()
        .prefix("lgvi_shm_")
        .tempdir_in("/tmp")
        .unwrap();
    let root = root.path().join("own");
    let mut command = world.command(&binary("lgvi_propagator"));
    command.env("LGVI_SHM_ROOT", &root).args([
        "--supervised",
        "--ros-args",
        "-p",
        &parameter_scene(),
    ]);
    let propagator = world.start("propagator", command);
    propagator.await_ready();
    fs::set_permissions(root.parent().unwrap(), fs::Permissions::from_mode(0o755)).unwrap();
    assert_eq!(
        fs::metadata(&root).unwrap().permissions().mode() & 0o777,
        0o700
    );
    let options = ShmOptions {
        root: Some(root.clone()),
        ..ShmOptions::default()
    };
    let prefix = options.prefix();
    let script = format!(
        "ls {root} && echo entered
         for file in /dev/shm/{prefix}*; do
             echo found
             cat $file >/dev/null && echo read
             : >>$file && echo written
             rm -f $file && echo removed
         done; true",
        root = root.display()
    );
    let attempt = world.start("nobody", as_nobody(&world, &script)).finish();
    let did: BTreeSet<_> = attempt.stdout.lines().collect();
    assert_eq!(did, BTreeSet::from(["found"]), "{}", attempt.stderr);
    propagator.stop().expect(0);
}

/// `cpp/fastdds_secure_peer.cpp`, in an enclave or in none.
fn stranger(world: &World, enclave: Option<&Path>, arguments: [&str; 4]) -> Process {
    let mut command = world.command(&fast_dds("tests/cpp/fastdds_secure_peer.cpp"));
    command
        .arg(world.environment().domain_id.to_string())
        .arg(enclave.unwrap_or("none".as_ref()))
        .args(arguments);
    world.start("fastdds_secure_peer", command)
}

const SCENE: [&str; 4] = [
    "latched",
    "rt/lgvi_propagator/scene",
    "lgvi_msgs::msg::dds_::Scene_",
    "1",
];

#[test]
fn an_enclave_on_fast_dds_reads_and_commands() {
    let world = World::new();
    let keystore = Keystore::new(&world, "keys")
        .enclave("/propagator")
        .enclave("/stranger");
    let enclave = keystore.directory("/stranger");
    let propagator = propagator(&world, &keystore);

    let printed = stranger(&world, Some(&enclave), SCENE).finish().expect(0);
    let bytes: Vec<_> = (0..printed.stdout.trim().len() / 2)
        .map(|at| u8::from_str_radix(&printed.stdout[2 * at..2 * at + 2], 16).unwrap())
        .collect();
    let read: Scene = cdr::decode(&bytes).unwrap();
    assert_eq!(read.name, "inclination_change");

    let file = world.path("control.cdr");
    fs::write(&file, cdr::encode(&coast()).unwrap()).unwrap();
    let message = "lgvi_msgs::msg::dds_::ControlSequence_";
    let topic = format!("rt{CONTROL}");
    let send = ["send", &topic, message, file.to_str().unwrap()];
    stranger(&world, Some(&enclave), send).finish().expect(0);
    assert_eq!(propagator.await_flown().steps, 1000);
    propagator.stop().expect(0);
}

#[test]
fn fast_dds_without_an_enclave_or_of_another_authority_neither_reads_nor_commands() {
    let world = World::new();
    let keystore = Keystore::new(&world, "keys").enclave("/propagator");
    let others = Keystore::new(&world, "others").enclave("/stranger");
    let propagator = propagator(&world, &keystore);
    let file = world.path("control.cdr");
    fs::write(&file, cdr::encode(&coast()).unwrap()).unwrap();
    let topic = format!("rt{CONTROL}");
    let message = "lgvi_msgs::msg::dds_::ControlSequence_";
    let send = ["send", &topic, message, file.to_str().unwrap()];
    let other = others.directory("/stranger");
    let peers = [None, Some(&*other)]
        .map(|enclave| [SCENE, send].map(|arguments| stranger(&world, enclave, arguments)));
    for peer in peers.into_iter().flatten() {
        let finished = peer.finish().expect(1);
        assert_eq!(finished.stdout, "");
        assert!(!finished.stderr.contains("matched"), "{}", finished.stderr);
    }
    assert!(!has_flown(&propagator));
    propagator.stop().expect(0);
}
