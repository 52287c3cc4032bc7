//! Tests of the messages.

mod hashes;
mod shared_memory;
