//! The process that receives: it is told what by arguments, and says on lines when it begins and what it has seen.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use serde::{Deserialize, Serialize};

use super::way::{Receiver, Way};
use super::{Place, failed};
use crate::clock::{monotonic_nanoseconds, process_seconds};
use crate::error::BenchError;

/// What the other process is told.
#[derive(Args, Default)]
pub(super) struct FarOptions {
    /// Receive, as the other process.
    #[arg(long = "far", hide = true)]
    pub way: Option<Way>,
    #[arg(long, hide = true)]
    spin: bool,
    #[arg(long, hide = true, default_value = ".")]
    root: PathBuf,
}

/// What it says.
#[derive(Debug, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Said {
    /// What comes now is measured.
    Begun,
    Seen(Seen),
}

/// Latencies (s), counts, and time on the processor (s).
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
pub(super) struct Seen {
    pub median: f64,
    pub percentile_99: f64,
    pub most: f64,
    pub received: u64,
    pub lost: u64,
    pub cpu: f64,
}

/// How long the first sample may take, and what follows until it is measured.
const PATIENCE: Duration = Duration::from_secs(20);
const WARMING: Duration = Duration::from_millis(300);

pub(super) fn run(
    options: &FarOptions,
    way: Way,
    domain: u16,
    seconds: f64,
) -> Result<(), BenchError> {
    let place = Place {
        domain,
        root: options.root.clone(),
    };
    let mut receiver = way.receiver(&place, options.spin)?;
    let first = receiver.receive(PATIENCE)?;
    first.ok_or_else(|| failed("nothing is received"))?;
    let warm = Instant::now();
    while warm.elapsed() < WARMING {
        receiver.receive(WARMING)?;
    }
    say(&Said::Begun)?;
    let seen = watch(receiver.as_mut(), Duration::from_secs_f64(seconds))?;
    say(&Said::Seen(seen))
}

fn watch(receiver: &mut dyn Receiver, span: Duration) -> Result<Seen, BenchError> {
    let (begun, cpu) = (Instant::now(), process_seconds());
    let mut latencies = Vec::new();
    let (mut latest, mut lost) = (None, 0);
    loop {
        let left = span.saturating_sub(begun.elapsed());
        if left.is_zero() {
            break;
        }
        let Some(stamp) = receiver.receive(left)? else {
            continue;
        };
        let latency = monotonic_nanoseconds().saturating_sub(stamp.nanoseconds);
        latencies.push(1e-9 * latency as f64);
        if let Some(latest) = latest.replace(stamp.sequence) {
            lost += stamp.sequence.saturating_sub(latest).saturating_sub(1);
        }
    }
    let cpu = process_seconds() - cpu;
    latencies.sort_by(f64::total_cmp);
    let last = latencies.len().checked_sub(1);
    let last = last.ok_or_else(|| failed("nothing is received any more"))?;
    let at = |part: f64| latencies[(part * last as f64).round() as usize];
    Ok(Seen {
        median: at(0.5),
        percentile_99: at(0.99),
        most: at(1.0),
        received: latencies.len() as u64,
        lost,
        cpu,
    })
}

fn say(said: &Said) -> Result<(), BenchError> {
    println!("{}", serde_json::to_string(said).map_err(failed)?);
    Ok(())
}
