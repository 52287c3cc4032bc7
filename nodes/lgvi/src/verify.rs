//! The command `lgvi verify`.

use std::path::Path;
use std::process::ExitCode;

use lgvi_middleware::node::NodeError;
use lgvi_review::{FlightBag, Outcome};

use crate::bars;
use crate::output::say;

/// Compares every recorded state with the repetition; exit code 0 if all agree, 1 if one differs or states are missing.
pub(crate) fn verify(path: &Path, flight: Option<&str>, json: bool) -> Result<ExitCode, NodeError> {
    let bag = FlightBag::open(path, flight)?;
    let bar = bars::bar("repeating", bag.state_count(), "states");
    let verdict = lgvi_review::verify(&bag, &mut |states| {
        bar.set_position(states);
        true
    })?;
    bar.finish_and_clear();
    if json {
        say(&serde_json::to_string(&verdict).map_err(NodeError::runtime)?)?;
    } else {
        say(&verdict)?;
    }
    Ok(ExitCode::from(u8::from(verdict.outcome != Outcome::Agrees)))
}
