//! Tests against outside data and automatic differentiation, apart from the unit tests beside the code.

#![allow(clippy::expect_used, clippy::panic, clippy::print_stdout)]

mod case;
mod constraints;
mod scratch;
mod sweep;
mod sensitivity;
mod truth;
