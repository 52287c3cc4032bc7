//! The process that sends, and starts the one that receives.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;
use std::time::{Duration, Instant};

use super::far::{Said, Seen};
use super::way::{Sender, Stamp};
use super::{Look, Options, Place, Round, Setup, failed};
use crate::clock::{monotonic_nanoseconds, process_seconds};
use crate::error::BenchError;

/// How long a measurement may take besides its span.
const PATIENCE: Duration = Duration::from_secs(40);

pub(super) fn measure(setup: Setup, options: &Options, root: &Path) -> Result<Round, BenchError> {
    let place = Place {
        domain: options.domain,
        root: root.into(),
    };
    let mut sender = setup.way.sender(&place, setup.bodies)?;
    let mut far = Far::start(setup, options.seconds, &place)?;
    let measured = fly(sender.as_mut(), &far, setup.rate, options.seconds);
    far.end();
    let (seen, sending) = measured?;
    let sent = (seen.received + seen.lost) as f64;
    Ok(Round {
        median: seen.median,
        percentile_99: seen.percentile_99,
        most: seen.most,
        received: seen.received,
        lost: seen.lost,
        sending: sending / sent,
        receiving: seen.cpu / sent,
    })
}

/// Sends at `rate` until the other process has seen enough; with it the seconds on the processor meanwhile.
fn fly(
    sender: &mut dyn Sender,
    far: &Far,
    rate: f64,
    seconds: f64,
) -> Result<(Seen, f64), BenchError> {
    let begun = Instant::now();
    let mut cpu = f64::NAN;
    let mut sequence: u64 = 0;
    loop {
        match far.said.try_recv() {
            Ok(Said::Begun) => cpu = process_seconds(),
            Ok(Said::Seen(seen)) => return Ok((seen, process_seconds() - cpu)),
            Err(TryRecvError::Empty) => {}
            Err(TryRecvError::Disconnected) => return Err(failed("the receiving process ended")),
        }
        let elapsed = begun.elapsed();
        if elapsed.as_secs_f64() > seconds + PATIENCE.as_secs_f64() {
            return Err(failed("the receiving process says nothing"));
        }
        let due = Duration::from_secs_f64(sequence as f64 / rate);
        thread::sleep(due.saturating_sub(elapsed));
        sender.send(Stamp {
            sequence,
            nanoseconds: monotonic_nanoseconds(),
        })?;
        sequence += 1;
    }
}

/// The other process.
struct Far {
    child: Child,
    said: Receiver<Said>,
}

impl Far {
    fn start(setup: Setup, seconds: f64, place: &Place) -> Result<Self, BenchError> {
        let this = std::env::current_exe().map_err(failed)?;
        let way = clap::ValueEnum::to_possible_value(&setup.way);
        let way = way.ok_or_else(|| failed("a way without a name"))?;
        let mut command = Command::new(this);
        command
            .args(["transport", "--far", way.get_name()])
            .args(["--domain", &place.domain.to_string()])
            .args(["--seconds", &seconds.to_string()])
            .arg("--root")
            .arg(&place.root);
        if setup.look == Look::Spinning {
            command.arg("--spin");
        }
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(failed)?;
        let (sender, said) = channel();
        if let Some(stdout) = child.stdout.take() {
            thread::spawn(move || {
                for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                    if let Ok(said) = serde_json::from_str(&line)
                        && sender.send(said).is_err()
                    {
                        return;
                    }
                }
            });
        }
        Ok(Self { child, said })
    }

    /// It ends by itself when it has said what it has seen; else it is ended.
    fn end(&mut self) {
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_secs(2) {
            if matches!(self.child.try_wait(), Ok(Some(_))) {
                return;
            }
            thread::sleep(Duration::from_millis(5));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
