//! The propagator node as a program of its own.

fn main() -> std::process::ExitCode {
    lgvi_propagator::main(std::env::args().skip(1))
}
