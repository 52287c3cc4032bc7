//! Two hosts on one machine: network namespaces, joined by a cable that can be cut.

use std::env;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::thread;

use lgvi_middleware::ros::RosNode;
use lgvi_middleware::{Environment, NodeArgs, Reach};
use nix::sched::{CloneFlags, setns};

use crate::{Process, World, binary, ros_python};

/// Set where a test runs in namespaces of its own.
const APART: &str = "LGVI_TESTS_APART";

/// Namespaces of the network, and of mounts for the names that `ip netns` gives to others. They end with the process.
const UNSHARE: [&str; 2] = ["--net", "--mount"];

/// The same without being root.
const UNSHARE_AS_USER: [&str; 4] = ["--user", "--map-root-user", "--net", "--mount"];

/// `/run` belongs to somebody else: that of this process is empty.
const SCRIPT: &str = "mount -t tmpfs tmpfs /run && exec \"$@\"";

/// What is missing where neither works.
const HELP: &str = "two hosts need namespaces of the network. Install iproute2 and util-linux, and be root (in a container with \
     CAP_SYS_ADMIN), or allow user namespaces: `sysctl kernel.unprivileged_userns_clone=1`, on Ubuntu also \
     `sysctl kernel.apparmor_restrict_unprivileged_userns=0`";

/// The device at either end of the cable.
const DEVICE: &str = "veth0";

/// No other domain is in these networks.
const DOMAIN: u16 = 7;

/// Two hosts and the cable between them. Nothing joins them but the network: shared memory is apart.
#[derive(Debug)]
pub struct Hosts {
    /// One of them.
    pub a: Host,
    /// The other.
    pub b: Host,
}

/// A host.
#[derive(Debug)]
pub struct Host {
    name: &'static str,
    world: World,
}

/// What befalls the cable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// It is pulled out: the device goes down, and sending fails.
    Unplugged,
    /// It is cut somewhere on the way: all is lost, and nobody is told.
    Silent,
}

/// Runs the body of a test, which must name itself as `module::function`, between two hosts.
///
/// The namespaces go with the process that they are made for, however the test ends.
#[track_caller]
pub fn between_hosts(test: &str, body: impl FnOnce(&Hosts)) {
    if env::var_os(APART).is_some() {
        return body(&Hosts::new());
    }
    // There is no network inside for what may have to be built.
    binary("lgvi");
    let unshare = |options: &[&str], command: &[&str]| {
        let mut unshare = Command::new("unshare");
        unshare.args(options).args(["sh", "-c", SCRIPT, "sh"]);
        unshare.args(command).env(APART, "1").output()
    };
    let works = |options: &[&str]| {
        unshare(options, &["ip", "netns", "add", "probe"]).is_ok_and(|done| done.status.success())
    };
    let options: &[&str] = match () {
        () if works(&UNSHARE) => &UNSHARE,
        () if works(&UNSHARE_AS_USER) => &UNSHARE_AS_USER,
        () => panic!("{HELP}"),
    };
    let this = env::current_exe().expect("the path of the running test");
    let this = this.to_str().expect("a path in Unicode");
    let output = unshare(options, &[this, "--exact", test, "--nocapture"]).expect("unshare");
    let (stdout, stderr) = texts(&output);
    assert!(
        output.status.success() && stdout.contains("1 passed"),
        "{stdout}\n{stderr}"
    );
    eprint!("{stderr}");
}

impl Hosts {
    fn new() -> Self {
        for name in ["a", "b"] {
            run("ip", &format!("netns add {name}"));
        }
        run(
            "ip",
            &format!("link add {DEVICE} netns a type veth peer name {DEVICE} netns b"),
        );
        Self {
            a: Host::new("a", "10.77.0.1/24"),
            b: Host::new("b", "10.77.0.2/24"),
        }
    }

    /// Cuts the cable.
    pub fn cut(&self, cut: Cut) {
        match cut {
            Cut::Unplugged => self.a.link("down"),
            Cut::Silent => {
                // A queue without places.
                self.a.queue("add", "pfifo limit 0");
                self.b.queue("add", "pfifo limit 0");
            }
        }
    }

    /// Lets no multicast pass the cable.
    pub fn without_multicast(&self) {
        for host in [&self.a, &self.b] {
            run(
                "ip",
                &format!("-netns {} route del 224.0.0.0/4 dev {DEVICE}", host.name),
            );
            run(
                "ip",
                &format!("-netns {} link set {DEVICE} multicast off", host.name),
            );
        }
    }

    /// Mends it.
    pub fn mend(&self, cut: Cut) {
        match cut {
            Cut::Unplugged => self.a.link("up"),
            Cut::Silent => {
                self.a.queue("del", "");
                self.b.queue("del", "");
            }
        }
    }
}

impl Host {
    #[track_caller]
    fn new(name: &'static str, address: &str) -> Self {
        let ip = |what: &str| run("ip", &format!("-netns {name} {what}"));
        ip(&format!("address add {address} dev {DEVICE}"));
        ip("link set lo up");
        ip(&format!("link set {DEVICE} up"));
        ip(&format!("route add 224.0.0.0/4 dev {DEVICE}"));
        Self {
            name,
            world: World::new(),
        }
    }

    fn link(&self, state: &str) {
        run(
            "ip",
            &format!("-netns {} link set {DEVICE} {state}", self.name),
        );
    }

    fn queue(&self, action: &str, discipline: &str) {
        let arguments = format!(
            "-netns {} qdisc {action} dev {DEVICE} root {discipline}",
            self.name
        );
        run("tc", &arguments);
    }

    /// What a test on this host has to itself.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// A path in the host's directory.
    pub fn path(&self, name: &str) -> PathBuf {
        self.world.path(name)
    }

    /// A command on this host.
    pub fn command(&self, program: &Path) -> Command {
        let mut command = self.world.command(Path::new("nsenter"));
        command
            .env("ROS_DOMAIN_ID", DOMAIN.to_string())
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
            .arg(format!("--net={}", self.namespace().display()))
            .arg(program);
        command
    }

    /// Starts a node under supervision, with arguments after `--ros-args`.
    pub fn node(&self, kind: &str, arguments: &[&str]) -> Process {
        let mut command = self.command(&binary(&format!("lgvi_{kind}")));
        command.args(["--supervised", "--ros-args"]).args(arguments);
        self.world.start(kind, command)
    }

    /// Starts a script of `tests/python` on ROS 2 Jazzy with Fast DDS.
    pub fn ros_python(&self, script: &str, arguments: &[&str]) -> Process {
        let command = self
            .world
            .ros_script(self.command(&ros_python()), script, arguments);
        self.world.start(script, command)
    }

    /// A ROS node in this process, on this host.
    pub fn ros_node(&self, name: &str) -> RosNode {
        let namespace = File::open(self.namespace()).expect("the host's namespace");
        let environment = Environment {
            reach: Reach::Subnet,
            ..Environment::localhost(DOMAIN)
        };
        let (args, _) = NodeArgs::parse(name, []).expect("no arguments");
        // A thread is where its sockets are, and its threads are there too.
        thread::scope(|scope| {
            let joined = scope.spawn(|| {
                setns(&namespace, CloneFlags::CLONE_NEWNET).expect("a thread on the host");
                RosNode::new(&args, &environment).expect("a ROS node")
            });
            joined.join().expect("a thread on the host")
        })
    }

    fn namespace(&self) -> PathBuf {
        Path::new("/run/netns").join(self.name)
    }
}

#[track_caller]
fn run(program: &str, arguments: &str) {
    let output = Command::new(program)
        .args(arguments.split_whitespace())
        .output()
        .unwrap_or_else(|error| panic!("{program}, of iproute2: {error}"));
    let (_, stderr) = texts(&output);
    assert!(output.status.success(), "{program} {arguments}: {stderr}");
}

fn texts(output: &Output) -> (String, String) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout), text(&output.stderr))
}
