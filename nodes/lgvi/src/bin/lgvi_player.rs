//! The player node as a program of its own.

fn main() -> std::process::ExitCode {
    lgvi_middleware::node::with_arguments(lgvi_player::main)
}
