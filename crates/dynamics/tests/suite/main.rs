//! Tests against external data and physical laws, in addition to the unit tests next to the code.

#![allow(clippy::expect_used, clippy::panic, clippy::print_stdout)]

mod actuated;
mod auto;
mod baselines;
mod case;
mod company;
mod conformance;
mod conservation;
mod derivatives;
mod docking;
mod drag;
mod engine;
mod equivalence;
mod failures;
mod floor;
mod free_rotation;
mod galerkin;
mod lanes;
mod laws;
mod mobility;
mod models;
mod mutual;
mod polyhedra;
mod potentials;
mod rotation;
mod skips;
mod taylor;
mod thrusters;
mod truncation;
mod truth;
mod wheels;
mod wisdom_holman;
