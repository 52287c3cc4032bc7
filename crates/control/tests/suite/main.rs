//! Tests against external data and automatic differentiation; the unit tests are beside the code.

#![allow(clippy::expect_used, clippy::panic, clippy::print_stdout)]

mod actuator_chances;
mod automatic;
mod between;
mod case;
mod chances;
mod classes;
mod constraints;
mod coupling;
mod drag;
mod engine;
mod final_time;
mod formation;
mod fuel;
mod inequalities;
mod maneuvers;
mod minimum_time;
mod moving;
mod multistart;
mod newton;
mod own;
mod phases;
mod processing;
mod propellant;
mod replan;
mod sensitivity;
mod sights;
mod targets;
mod terminal;
mod thrusters;
mod truth;
mod underactuated;
mod units;
mod wheels;
