//! What the node's own loop costs the allocator: parameters and orders looked for, a step, its state sent over shared
//! memory and handed to the ROS side.

use std::env;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread::JoinHandle;

use allocation_counter::{AllocationInfo, measure};

use super::*;

/// Tells the process with the node from that of the test.
const NODE: &str = "LGVI_TEST_NODE";

const SCENE: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../scenes/two_dumbbells.toml"
);

/// Steps before the first that is watched, and steps that are.
const STEPS: [u64; 2] = [1_000, 10_000];

/// The node, whose loop is watched, and one who receives its states.
struct Watched {
    propagator: Propagator,
    receiver: JoinHandle<u64>,
    ended: Arc<AtomicBool>,
}

impl Managed for Watched {
    const NAME: &'static str = Propagator::NAME;

    fn parameters() -> Vec<ParameterSpec> {
        Propagator::parameters()
    }

    fn configure(node: &Node) -> Result<Self, NodeError> {
        let propagator = Propagator::configure(node)?;
        let shm = node.shm()?;
        let mut subscriber = shm.state_subscriber(&propagator.state_topic, 1024)?;
        let ended = Arc::<AtomicBool>::default();
        let end = Arc::clone(&ended);
        let receiver = std::thread::spawn(move || {
            let mut received = 0;
            while !end.load(Ordering::Relaxed) {
                while subscriber.receive().is_ok_and(|sample| sample.is_some()) {
                    received += 1;
                }
                std::thread::sleep(WAIT);
            }
            received
        });
        Ok(Self {
            propagator,
            receiver,
            ended,
        })
    }

    fn run(&mut self, node: &Node) -> Result<Stopped, NodeError> {
        let propagator = &mut self.propagator;
        propagator.set_pace(node);
        while propagator.phase != Phase::Flying {
            match propagator.phase {
                Phase::Unattended => propagator.await_company()?,
                _ => propagator.await_command(node)?,
            }
        }
        let mut fly = |steps: u64| -> Result<(), NodeError> {
            for _ in 0..steps {
                propagator.heed(node)?;
                propagator.step(node)?;
                propagator.hand_over(Wait::ForRoom);
            }
            Ok(())
        };
        fly(STEPS[0])?;
        let mut flown = Ok(());
        let taken = measure(|| flown = fly(STEPS[1]));
        flown?;
        let steps = propagator.flight.step();
        // Nothing but what iceoryx2 0.10 notes of each sample that it lends, until it is sent.
        let loans = AllocationInfo {
            count_total: STEPS[1],
            count_current: 0,
            count_max: 1,
            ..taken
        };
        if taken == loans && taken.bytes_current == 0 && steps == STEPS[0] + STEPS[1] {
            return Ok(Stopped::Done);
        }
        let message = format!("{steps} steps took {taken:?}");
        Err(NodeError::Runtime(message))
    }

    fn clean_up(self, node: &Node) -> Result<(), NodeError> {
        self.ended.store(true, Ordering::Relaxed);
        let received = self.receiver.join();
        self.propagator.clean_up(node)?;
        match received {
            Ok(received) if received > STEPS[1] => Ok(()),
            received => Err(NodeError::Runtime(format!("received {received:?} states"))),
        }
    }
}

/// The node needs a process of its own, whose environment names a DDS domain and a place for shared memory.
#[test]
fn the_loop_allocates_nothing_of_its_own() {
    if env::var_os(NODE).is_some() {
        let scene = format!("scene:={SCENE}");
        let parameters = [scene.as_str(), "real_time_factor:=0.0"];
        let given = parameters.iter().flat_map(|text| ["-p", text]);
        let args = ["--ros-args"].into_iter().chain(given).map(str::to_owned);
        assert_eq!(
            format!("{:?}", lgvi_middleware::node::main::<Watched>(args)),
            format!("{:?}", std::process::ExitCode::SUCCESS)
        );
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let test = "run::tests::the_loop_allocates_nothing_of_its_own";
    let output = Command::new(env::current_exe().unwrap())
        .args(["--exact", test, "--nocapture"])
        .env(NODE, "")
        .env("ROS_DOMAIN_ID", (1 + std::process::id() % 101).to_string())
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        .env("LGVI_SHM_ROOT", folder.path())
        .output()
        .unwrap();
    let said = [output.stdout, output.stderr].concat();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&said)
    );
}
