//! A scene flown with every combination of some values.
//!
//! [`combinations`] makes them, [`fly_all`] flies them side by side, each as [`Flown`], and [`Table`] has a row for each.

mod combination;
mod flown;
mod fly_all;
mod table;

pub use combination::{Combination, SweepError, Variation, combinations};
pub use flown::Flown;
pub use fly_all::fly_all;
pub use table::{Column, Table};
