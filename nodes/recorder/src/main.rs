//! The recorder node as a program of its own.

fn main() -> std::process::ExitCode {
    lgvi_recorder::main(std::env::args().skip(1))
}
