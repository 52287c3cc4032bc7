//! The player node as a program of its own.

fn main() -> std::process::ExitCode {
    lgvi_player::main(std::env::args().skip(1))
}
