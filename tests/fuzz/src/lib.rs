//! What the fuzz targets do with an input, and how they keep account of its memory.
//!
//! Each function of [`targets`] takes any bytes and must return: a panic, an input that takes longer than the run allows
//! or more memory than [`memory::watch`] allows is a finding. The functions are plain ones, which the test `corpora` of
//! the main workspace calls with all that lies in `corpus`.

pub mod memory;
pub mod sample;
pub mod targets;
