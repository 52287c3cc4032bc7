//! Tests against outside data and laws, apart from the unit tests beside the code.

#![allow(clippy::expect_used, clippy::panic, clippy::print_stdout)]

mod case;
mod derivatives;
mod galerkin;
mod laws;
mod truth;
