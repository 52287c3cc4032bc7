//! Damaged bags, by the memory that they may ask for.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../common/mod.rs"]
mod common;
mod damage;
mod largest;
mod recover;
