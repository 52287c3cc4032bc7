//! Tests against outside data and automatic differentiation, apart from the unit tests beside the code.

#![allow(clippy::expect_used, clippy::panic, clippy::print_stdout)]

mod case;
mod final_time;
mod maneuvers;
mod minima;
mod replan;
mod processing;
mod constraints;
mod scratch;
mod newton;
mod sweep;
mod sensitivity;
mod truth;
