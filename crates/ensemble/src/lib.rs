//! Monte Carlo flights: a scene flown many times over, each sample with deviations of its own.
//!
//! A [`Campaign`] knows what is flown; [`run()`] spreads it over cores, as many samples side by side as a vector register has
//! lanes, and keeps what comes of it in Parquet files of some samples each, so that a run that was ended goes on from
//! whole parts; [`merge()`] joins parts that were flown elsewhere; [`Summary`] says what all samples come to.
//!
//! A sample depends on scene, seed and index alone, and its numbers not on the number of threads or lanes.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod campaign;
mod error;
mod guidance;
mod identity;
mod merge;
mod part;
mod picture;
mod read;
mod row;
mod run;
mod store;
mod summary;
mod table;
mod temporary;

pub use campaign::{Campaign, FlownBy, Settings};
pub use error::EnsembleError;
pub use guidance::{Commands, Guidance};
pub use identity::Identity;
pub use merge::{MergeOptions, Merged, merge};
pub use picture::draw;
pub use row::{Failure, FailureKind, Row};
pub use run::{Options, Progress, Report, run};
pub use store::Store;
pub use summary::{Statistics, Summary};
