//! Tests of ensembles.

mod edges;
mod ensembles;
mod large;
