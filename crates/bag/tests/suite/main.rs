//! Bags written, read and recovered: whole, split, damaged, and of others.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../common/mod.rs"]
mod common;

mod bounds;
mod check;
mod custom_data;
mod errors;
mod failing;
mod foreign;
mod hostile;
mod latched;
mod layouts;
mod left_out;

mod listed_files;
mod many_channels;
mod mutations;
mod new_directory;
mod qos;
mod recover_counts;
mod recover_custom_data;
mod recover_definitions;
mod recover_kinds;
mod recover_others;
mod recover_repeats;
mod repeats;
mod rosbags;
mod round_trip;
mod splits;
