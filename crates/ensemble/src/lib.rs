//! Monte Carlo ensembles: a scene flown many times, each sample with its own random deviations.
//!
//! A [`Campaign`] defines what is flown. [`run()`] distributes it over the cores, with as many samples side by side as
//! a vector register has lanes. It stores the results in Parquet files of some samples each, so that an interrupted run
//! can continue from complete parts. [`merge()`] joins parts that were flown elsewhere. [`Summary`] computes the
//! statistics of all samples.
//!
//! A sample depends on scene, seed and index alone. Its numbers do not depend on the number of threads or lanes.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod campaign;
mod error;
mod guidance;
mod histogram;
mod identity;
mod merge;
mod part;
mod picture;
mod place;
mod quantiles;
mod queue;
mod read;
mod row;
mod run;
mod statistics;
mod store;
mod summary;
mod table;
mod temporary;
#[cfg(test)]
mod testing;
mod violations;

pub use campaign::{Campaign, FlownBy, Settings};
pub use error::EnsembleError;
pub use guidance::{Command, Commands, Guidance};
pub use identity::Identity;
pub use merge::{MergeOptions, Merged, merge};
pub use picture::draw;
pub use place::Place;
pub use row::{Failure, FailureKind, Row};
pub use run::{Options, Progress, Report, run};
pub use statistics::Statistics;
pub use store::Store;
pub use summary::Summary;
pub use table::ends;
