//! Logging through `tracing`: to the console, and to `/rosout`.

mod levels;

use std::{
    borrow::Cow,
    env,
    fmt::{self, Write as _},
    io::{self, IsTerminal, Write},
    sync::{
        Arc, Mutex,
        mpsc::{self, Receiver, SyncSender},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use lgvi_msgs::{rcl_interfaces, stamp};
use tracing::{
    Event, Level, Subscriber,
    field::{Field, Visit},
};
use tracing_subscriber::{
    Layer, Registry,
    filter::{FilterExt, LevelFilter, Targets, filter_fn},
    fmt::layer,
    layer::{Context, SubscriberExt},
    reload,
    util::{SubscriberInitExt, TryInitError},
};

use crate::{
    LogSettings, NodeArgs,
    ros::{Publisher, Qos, RosError, RosNode},
    security,
    sync::lock,
    wall,
};

pub use levels::{LevelError, Levels};

/// The crates of this project share this prefix; all others are external libraries.
const OWN_TARGETS: &str = "lgvi";

/// Messages that wait for `/rosout`, those before [`Logging::attach`] included; further ones are not sent there.
const QUEUE: usize = 256;

/// How many messages a late reader of `/rosout` gets, as in other nodes.
const ROSOUT_DEPTH: usize = 1000;

/// The longest message (byte): it may hold a text from outside.
const LONGEST: usize = 900;

/// How long the last messages may take when a node leaves.
const FAREWELL: Duration = Duration::from_millis(100);

/// Logging cannot be set up.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// Something else has set up logging in this process.
    #[error("logging is already set up")]
    AlreadySet(#[from] TryInitError),
}

/// `None` ends the sending.
type Queued = Option<rcl_interfaces::Log>;

/// The end of the queue that a node takes messages for `/rosout` from.
pub struct Logging {
    levels: Levels,
    sender: SyncSender<Queued>,
    receiver: Arc<Mutex<Receiver<Queued>>>,
}

/// Sends messages to `/rosout` until it is dropped.
#[derive(Debug)]
pub struct Rosout {
    sender: SyncSender<Queued>,
    thread: Option<JoinHandle<()>>,
}

/// Sets up logging for the process; may be called once.
///
/// The console is stderr. It shows INFO and above of this project, WARN and above of other libraries (ERROR of the DDS
/// stack), or what `--log-level` asks for. `/rosout` gets WARN and above of this project, or what `--log-level` asks
/// for; a message never waits for it. The node's own name in `LOGGER:=LEVEL` stands for all of this project.
pub fn init(args: &NodeArgs) -> Result<Logging, LogError> {
    let (subscriber, logging) = build(args);
    subscriber.try_init()?;
    for notice in args.notices() {
        tracing::warn!("{notice}");
    }
    Ok(logging)
}

impl Logging {
    /// What is logged from which level on; it can be changed at run time.
    pub fn levels(&self) -> &Levels {
        &self.levels
    }

    /// Sends what is logged to `/rosout`, until the returned guard is dropped: it keeps the node in the graph.
    pub fn attach(&self, node: &RosNode) -> Result<Rosout, RosError> {
        let publisher = node.publisher("/rosout", &Qos::reliable(ROSOUT_DEPTH))?;
        let receiver = Arc::clone(&self.receiver);
        let thread = thread::Builder::new()
            .name("rosout".into())
            .spawn(move || send(&publisher, &receiver))
            .inspect_err(|error| tracing::warn!(%error, "nothing is sent to /rosout"))
            .ok();
        Ok(Rosout {
            sender: self.sender.clone(),
            thread,
        })
    }
}

impl Drop for Rosout {
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take()
            && self.sender.send(None).is_ok()
        {
            // A panic of that thread has been reported already.
            let _ = thread.join();
        }
    }
}

fn send(publisher: &Publisher<rcl_interfaces::Log>, receiver: &Mutex<Receiver<Queued>>) {
    let receiver = lock(receiver);
    while let Ok(Some(message)) = receiver.recv() {
        // Logging a failure here would make another message.
        let _ = publisher.publish(&message);
    }
    let _ = publisher.flush(FAREWELL);
}

fn build(args: &NodeArgs) -> (impl Subscriber + Send + Sync + use<>, Logging) {
    let own = [args.name(), &logger_name(args), OWN_TARGETS].map(String::from);
    let settings = &levels::settle(args.log(), &own);
    let (sender, receiver) = mpsc::sync_channel(QUEUE);
    let (console_level, console_handle) = reload::Layer::new(console_filter(settings));
    let console = layer()
        .compact()
        .with_ansi(io::stderr().is_terminal())
        .with_writer(|| Console)
        .with_filter(console_level.and(filter_fn(|metadata| {
            metadata.target() != REFUSALS || BURSTS.allow(Instant::now())
        })));
    let (rosout_level, rosout_handle) = reload::Layer::new(rosout_filter(settings));
    let rosout = ToRosout {
        sender: sender.clone(),
        name: logger_name(args),
    }
    .with_filter(rosout_level);
    let subscriber = Registry::default()
        .with(settings.console.then_some(console))
        .with(settings.rosout.then_some(rosout));
    let mut apply: Vec<levels::Apply> = Vec::new();
    if settings.console {
        apply.push(Box::new(move |settings| {
            console_handle.reload(console_filter(settings))
        }));
    }
    if settings.rosout {
        apply.push(Box::new(move |settings| {
            rosout_handle.reload(rosout_filter(settings))
        }));
    }
    let logging = Logging {
        levels: Levels::new(settings.clone(), own, apply),
        sender,
        receiver: Arc::new(Mutex::new(receiver)),
    };
    (subscriber, logging)
}

/// Where RustDDS says which participants it refuses, of each again every second.
const REFUSALS: &str = "rustdds::discovery::secure_discovery";

static BURSTS: Bursts = Bursts(Mutex::new(None));

/// Lets pass what comes within a moment, and then nothing for a while.
struct Bursts(Mutex<Option<Instant>>);

impl Bursts {
    const MOMENT: Duration = Duration::from_millis(100);
    const WHILE: Duration = Duration::from_secs(3);

    fn allow(&self, now: Instant) -> bool {
        let mut begun = lock(&self.0);
        match *begun {
            Some(begun) if now.saturating_duration_since(begun) < Self::MOMENT => true,
            Some(begun) if now.saturating_duration_since(begun) < Self::WHILE => false,
            _ => {
                *begun = Some(now);
                true
            }
        }
    }
}

fn console_filter(settings: &LogSettings) -> Targets {
    let external = if settings.external {
        LevelFilter::WARN
    } else {
        LevelFilter::OFF
    };
    let filter = Targets::new()
        .with_default(external)
        .with_target("rustdds", external.min(LevelFilter::ERROR))
        // It warns at every start that it has no configuration file.
        .with_target("iceoryx2_bb_loggers", external.min(LevelFilter::ERROR))
        // It complains at every exit about a multicast group that loopback has not joined.
        .with_target("rustdds::network::udp_listener", LevelFilter::OFF)
        // What it cannot read, which the fence of endpoints sends on purpose.
        .with_target("rustdds::discovery::discovery", LevelFilter::OFF);
    // Until endpoints have exchanged their keys, and of each message of a stranger.
    let repetitive = [
        "rustdds::rtps::message_receiver",
        "rustdds::rtps::reader",
        "rustdds::rtps::writer",
        "rustdds::security::security_plugins",
    ];
    let secure = env::var_os(security::ENABLE).is_some_and(|enable| enable == "true");
    let repetitive = repetitive.into_iter().filter(|_| secure);
    let filter = repetitive.fold(filter, |filter, target| {
        filter.with_target(target, LevelFilter::OFF)
    });
    own_filter(filter, settings, LevelFilter::INFO)
}

fn rosout_filter(settings: &LogSettings) -> Targets {
    own_filter(Targets::new(), settings, LevelFilter::WARN)
}

fn own_filter(filter: Targets, settings: &LogSettings, default: LevelFilter) -> Targets {
    let filter = filter.with_target(OWN_TARGETS, settings.level.unwrap_or(default));
    settings
        .loggers
        .iter()
        .fold(filter, |filter, (logger, level)| {
            filter.with_target(logger, *level)
        })
}

/// ROS names loggers after nodes, with dots: `chaser.lgvi_propagator`.
fn logger_name(args: &NodeArgs) -> String {
    args.fully_qualified_name()
        .trim_start_matches('/')
        .replace('/', ".")
}

/// A message as it is, or its beginning and how long it is.
fn brief(message: &str) -> Cow<'_, str> {
    if message.len() <= LONGEST {
        return message.into();
    }
    let letters = message.char_indices().map(|(at, _)| at);
    let cut = letters.take_while(|at| *at <= LONGEST).last();
    let begin = &message[..cut.unwrap_or(0)];
    let end = if message.ends_with('\n') { "\n" } else { "" };
    format!("{begin}… ({} bytes){end}", message.len()).into()
}

/// Writes to stderr what comes as one message at a time.
struct Console;

impl Write for Console {
    fn write(&mut self, message: &[u8]) -> io::Result<usize> {
        let text = String::from_utf8_lossy(message);
        io::stderr().write_all(brief(&text).as_bytes())?;
        Ok(message.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// Queues messages for `/rosout`.
struct ToRosout {
    sender: SyncSender<Queued>,
    name: String,
}

impl<S: Subscriber> Layer<S> for ToRosout {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let metadata = event.metadata();
        let mut text = Text::default();
        event.record(&mut text);
        let message = rcl_interfaces::Log {
            stamp: stamp::to_message(wall::now()).unwrap_or_default(),
            level: ros_level(*metadata.level()),
            name: self.name.clone(),
            msg: brief(&(text.message + &text.fields)).into_owned(),
            file: metadata.file().unwrap_or_default().into(),
            function: metadata.target().into(),
            line: metadata.line().unwrap_or_default(),
        };
        // A full queue has no room to say so either.
        let _ = self.sender.try_send(Some(message));
    }
}

fn ros_level(level: Level) -> u8 {
    match level {
        Level::ERROR => rcl_interfaces::Log::ERROR,
        Level::WARN => rcl_interfaces::Log::WARN,
        Level::INFO => rcl_interfaces::Log::INFO,
        _ => rcl_interfaces::Log::DEBUG,
    }
}

/// The message of an event, and its fields after it.
#[derive(Default)]
struct Text {
    message: String,
    fields: String,
}

impl Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        // Writing to a string cannot fail.
        let _ = match field.name() {
            "message" => write!(self.message, "{value:?}"),
            name => write!(self.fields, " {name}={value:?}"),
        };
    }
}

#[cfg(test)]
mod tests {
    use tracing::{info, subscriber::with_default, warn};

    use super::*;

    #[test]
    fn a_burst_passes_and_its_repetitions_do_not() {
        let (bursts, start) = (Bursts(Mutex::default()), Instant::now());
        let allowed = |milliseconds| bursts.allow(start + Duration::from_millis(milliseconds));
        let passed: Vec<_> = [0, 1, 99, 100, 1000, 2999, 3000, 3001, 4000]
            .into_iter()
            .filter(|&at| allowed(at))
            .collect();
        assert_eq!(passed, [0, 1, 99, 3000, 3001]);
    }

    fn logged(line: &str, log: impl FnOnce()) -> Vec<rcl_interfaces::Log> {
        let (args, _) =
            NodeArgs::parse("lgvi_test", line.split_whitespace().map(Into::into)).unwrap();
        let (subscriber, logging) = build(&args);
        with_default(subscriber, log);
        let receiver = logging.receiver.lock().unwrap();
        receiver.try_iter().flatten().collect()
    }

    #[test]
    fn warnings_of_this_project_go_to_rosout() {
        let messages = logged("--ros-args -r __ns:=/chaser", || {
            info!("unimportant");
            warn!(step = 7, cause = %"gap", "lost a sample");
            warn!(target: "rustdds", "not ours");
        });
        let [message] = messages.as_slice() else {
            panic!("{messages:?}");
        };
        assert_eq!(message.msg, "lost a sample step=7 cause=gap");
        assert_eq!(message.level, rcl_interfaces::Log::WARN);
        assert_eq!(message.name, "chaser.lgvi_test");
        assert!(message.file.ends_with("log.rs") && message.line > 0);
        assert!(message.stamp.sec > 0);
    }

    #[test]
    fn a_long_message_is_told_by_its_beginning() {
        let name = "ä".repeat(1 << 19);
        let messages = logged("", || warn!("{name} is unknown"));
        let told = &messages[0].msg;
        assert!(
            told.len() < 1000 && told.ends_with("ä… (1048587 bytes)"),
            "{told}"
        );
        let line = format!("WARN {name}\n");
        assert!(brief(&line).ends_with("… (1048582 bytes)\n"));
        assert_eq!(brief("WARN short\n"), "WARN short\n");
    }

    #[test]
    fn levels_are_those_asked_for() {
        let log = || {
            info!("one");
            warn!("two");
        };
        for (line, expected) in [
            ("--ros-args --log-level info", 2),
            ("--ros-args --log-level error", 0),
            ("--ros-args --log-level lgvi_test:=info", 2),
            ("--ros-args -r __ns:=/a --log-level lgvi_test:=info", 2),
            ("--ros-args -r __ns:=/a --log-level a.lgvi_test:=info", 2),
            ("--ros-args --log-level lgvi_middleware::log:=error", 0),
            ("--ros-args --disable-rosout-logs --log-level info", 0),
        ] {
            assert_eq!(logged(line, log).len(), expected, "{line}");
        }
    }

    #[test]
    fn levels_change_at_run_time() {
        let (args, _) = NodeArgs::parse("lgvi_test", []).unwrap();
        let (subscriber, logging) = build(&args);
        let heard = || {
            info!("one");
            warn!("two");
            logging.receiver.lock().unwrap().try_iter().count()
        };
        with_default(subscriber, || {
            let levels = logging.levels();
            assert_eq!((levels.get(), heard()), ("info", 1));
            for (level, expected) in [("debug", 2), ("error", 0), ("fatal", 0), ("warn", 1)] {
                levels.set(level).unwrap();
                assert_eq!(heard(), expected, "{level}");
            }
            assert_eq!(levels.get(), "warn");
            levels
                .set_logger("lgvi_middleware::log", Some(LevelFilter::INFO))
                .unwrap();
            assert_eq!(heard(), 2);
            levels.set_logger("lgvi_middleware::log", None).unwrap();
            assert!(matches!(levels.set("loud"), Err(LevelError::Name(level)) if level == "loud"));
            assert_eq!(heard(), 1);
        });
    }

    #[test]
    fn a_parameter_is_the_level() {
        use crate::parameters::{Given, Parameters};

        let line = "--ros-args --log-level lgvi_test:=error".split_whitespace();
        let (args, _) = NodeArgs::parse("lgvi_test", line.map(Into::into)).unwrap();
        let (subscriber, logging) = build(&args);
        let levels = logging.levels();
        let parameters =
            Parameters::declare(Given::default(), vec![levels.specification()]).unwrap();
        with_default(subscriber, || {
            levels.follow(&parameters).unwrap();
            assert_eq!(parameters.get("log_level"), Ok("error".to_string()));
            assert!(parameters.set("log_level", "loud".into()).is_err());
            parameters.set("log_level", "info".into()).unwrap();
            info!("one");
        });
        assert_eq!(levels.get(), "info");
        assert_eq!(logging.receiver.lock().unwrap().try_iter().count(), 1);
    }

    #[test]
    fn a_full_queue_makes_nobody_wait() {
        let messages = logged("", || (0..2 * QUEUE).for_each(|number| warn!(number)));
        assert_eq!(messages.len(), QUEUE);
    }
}
