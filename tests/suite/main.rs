//! Tests across processes: whole flights, replay, foreign DDS peers, bad input, sudden ends.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bad_arguments;
mod bad_bags;
mod bad_controls;
mod bad_scenes;
mod clock;
mod determinism;
mod diagnostics;
mod endings;
mod failures;
mod fast_dds;
mod feedback;
mod frames;
mod inclination_change;
mod instances;
mod interfaces;
mod interventions;
mod launch_file;
mod layouts;
mod laziness;
mod lifecycle;
mod names;
mod one_flight;
mod outsider;
mod pace;
mod packages;
mod parameter_files;
mod planning;
mod plugging_in;
mod real_cdr;
mod real_ros;
mod recorder;
mod reference_bags;
mod replay;
mod scenes;
mod shutdown;
mod stalls;
mod two_hosts;
mod waiting;
