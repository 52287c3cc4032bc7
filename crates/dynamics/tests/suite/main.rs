//! Tests against outside data and laws, apart from the unit tests beside the code.

#![allow(clippy::expect_used, clippy::panic, clippy::print_stdout)]

mod case;
mod conservation;
mod derivatives;
mod laws;
mod mutual;
mod potentials;
mod truncation;
mod truth;
