//! What a test has to itself: a DDS domain on the loopback interface, shared memory, and a directory.

use std::ffi::OsStr;
use std::fs;
use std::panic::Location;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use lgvi_middleware::ros::RosNode;
use lgvi_middleware::shm::{ShmNode, ShmOptions};
use lgvi_middleware::{Environment, NodeArgs};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use tempfile::TempDir;

use crate::domain::Domain;
use crate::process::Printed;
use crate::{Process, binary};

/// Variables with these prefixes would reach into the world from outside.
const FOREIGN: [&str; 6] = ["ROS_", "RMW_", "LGVI_", "CYCLONEDDS_", "RUST_LOG", "ZENOH_"];

/// Where iceoryx2 keeps the memory itself.
const SHARED_MEMORY: &str = "/dev/shm";

/// How long nodes have to end when whoever started them has gone.
const FAREWELL: Duration = Duration::from_secs(5);

/// A test's surroundings. Processes that are left when it is dropped are killed; when the test has failed, everything
/// that they have printed is shown.
#[derive(Debug)]
pub struct World {
    domain: Domain,
    directory: TempDir,
    variables: Vec<(&'static str, String)>,
    printed: Mutex<Vec<Arc<Printed>>>,
}

impl World {
    /// A new world, whose domain follows from the place of the call.
    #[track_caller]
    #[allow(clippy::new_without_default, reason = "the place of the call matters")]
    pub fn new() -> Self {
        let directory = tempfile::Builder::new().prefix("lgvi_").tempdir();
        let world = Self {
            domain: Domain::hold(Location::caller()),
            directory: directory.expect("a temporary directory"),
            variables: Vec::new(),
            printed: Mutex::default(),
        };
        fs::create_dir(world.shared_memory_root()).expect("a directory for shared memory");
        world
    }

    /// Sets an environment variable for all commands.
    #[must_use]
    pub fn with(mut self, name: &'static str, value: impl Into<String>) -> Self {
        self.variables.push((name, value.into()));
        self
    }

    /// A path in the world's directory.
    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// The world's domain as our own ROS nodes take it.
    pub fn environment(&self) -> Environment {
        Environment::localhost(self.domain.id)
    }

    /// A ROS node in this process.
    pub fn ros_node(&self, name: &str) -> RosNode {
        let (args, _) = NodeArgs::parse(name, []).expect("no arguments");
        RosNode::new(&args, &self.environment()).expect("a ROS node")
    }

    /// A node of shared memory in this process.
    pub fn shm_node(&self, name: &str) -> ShmNode {
        let options = ShmOptions {
            domain_id: self.domain.id,
            root: Some(self.shared_memory_root()),
        };
        ShmNode::new(name, &options).expect("a node of shared memory")
    }

    /// A command that knows no other world.
    pub fn command(&self, program: &Path) -> Command {
        let mut command = Command::new(program);
        for (name, _) in std::env::vars_os() {
            if FOREIGN
                .iter()
                .any(|prefix| name.to_string_lossy().starts_with(prefix))
            {
                command.env_remove(name);
            }
        }
        command
            .env("ROS_DOMAIN_ID", self.domain.id.to_string())
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            .env("LGVI_SHM_ROOT", self.shared_memory_root())
            .envs(self.variables.iter().map(|(name, value)| (name, value)))
            .current_dir(self.directory.path());
        command
    }

    /// Starts a command.
    pub fn start(&self, name: &str, command: Command) -> Process {
        let process = Process::start(name, command);
        self.printed
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(process.printed());
        process
    }

    /// Starts `lgvi` with arguments.
    pub fn lgvi<A: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = A>) -> Process {
        let mut command = self.command(&binary("lgvi"));
        command.args(arguments);
        self.start("lgvi", command)
    }

    /// Starts a node under supervision by its own program, with parameters as `name:=value`.
    pub fn node(&self, kind: &str, parameters: &[&str]) -> Process {
        let mut command = self.command(&binary(&format!("lgvi_{kind}")));
        command.args(["--supervised", "--ros-args"]);
        for parameter in parameters {
            command.args(["-p", parameter]);
        }
        self.start(kind, command)
    }

    /// The processes of this world, whoever has started them: process id and command line.
    pub fn processes(&self) -> Vec<(i32, String)> {
        let root = self.shared_memory_root();
        let mark = format!("LGVI_SHM_ROOT={}", root.display());
        let entries = fs::read_dir("/proc").expect("/proc").flatten();
        entries
            .filter_map(|entry| {
                let pid = entry.file_name().to_str()?.parse().ok()?;
                let fields = |file: &str| {
                    let bytes = fs::read(entry.path().join(file)).ok()?;
                    Some(String::from_utf8_lossy(&bytes).into_owned())
                };
                let ours = fields("environ")?
                    .split('\0')
                    .any(|variable| variable == mark);
                ours.then_some((pid, fields("cmdline")?.replace('\0', " ")))
            })
            .collect()
    }

    /// The process of this world whose command line holds `fragment`, if there is one.
    pub fn find_process(&self, fragment: &str) -> Option<i32> {
        let found = self
            .processes()
            .into_iter()
            .find(|(_, line)| line.contains(fragment));
        found.map(|(pid, _)| pid)
    }

    /// The files of this world's shared memory.
    pub fn shared_memory(&self) -> Vec<PathBuf> {
        let mut found = Vec::new();
        files(&self.shared_memory_root(), &mut found);
        // `lgvi run` leaves its lock, to be taken again.
        found.retain(|path| path.extension().is_none_or(|extension| extension != "lock"));
        // iceoryx2 never removes this one, of 16 bytes.
        found.extend(
            self.segments()
                .into_iter()
                .filter(|path| !is_management(path)),
        );
        found
    }

    /// Shared memory apart from that of all other processes, for one that is to speak over DDS alone.
    pub fn apart(&self) -> PathBuf {
        self.path("apart")
    }

    fn shared_memory_root(&self) -> PathBuf {
        self.path("shm")
    }

    /// The world's segments in `/dev/shm`, by the prefix that the middleware derives from `LGVI_SHM_ROOT`.
    fn segments(&self) -> Vec<PathBuf> {
        let prefixes = [self.shared_memory_root(), self.apart()].map(|root| {
            let options = ShmOptions {
                domain_id: self.domain.id,
                root: Some(root),
            };
            options.prefix()
        });
        let entries = fs::read_dir(SHARED_MEMORY).expect(SHARED_MEMORY).flatten();
        let ours = |name: &str| prefixes.iter().any(|prefix| name.starts_with(prefix));
        entries
            .filter(|entry| ours(&entry.file_name().to_string_lossy()))
            .map(|entry| entry.path())
            .collect()
    }
}

impl Drop for World {
    fn drop(&mut self) {
        let start = Instant::now();
        while !self.processes().is_empty() && start.elapsed() < FAREWELL {
            thread::sleep(Duration::from_millis(10));
        }
        for (pid, _) in self.processes() {
            // It may have ended since.
            let _ = kill(Pid::from_raw(pid), Signal::SIGKILL);
        }
        for segment in self.segments() {
            let _ = fs::remove_file(segment);
        }
        if thread::panicking() {
            for printed in self
                .printed
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .iter()
            {
                eprintln!("{}", printed.report());
            }
        }
    }
}

fn is_management(segment: &Path) -> bool {
    segment
        .extension()
        .is_some_and(|extension| extension == "global_mgmt")
}

/// All files below a directory that are no directories.
fn files(directory: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).expect("a directory").flatten() {
        let path = entry.path();
        if path.is_dir() {
            files(&path, found);
        } else {
            found.push(path);
        }
    }
}
