#![no_main]

use lgvi_fuzz::{memory, targets};

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    memory::watch(targets::LITTLE_MEMORY, || targets::cdr(data));
});
