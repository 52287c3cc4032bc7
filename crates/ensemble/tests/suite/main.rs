//! Tests of ensembles.

mod edges;
mod ensembles;
