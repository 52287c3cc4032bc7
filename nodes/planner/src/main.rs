//! The planner node as a program of its own.

fn main() -> std::process::ExitCode {
    lgvi_planner::main(std::env::args().skip(1))
}
