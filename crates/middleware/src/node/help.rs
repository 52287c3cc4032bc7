//! `--help` of a node.

use std::io::Write;
use std::process::ExitCode;

use crate::ParameterSpec;

use super::start;

const ROS_ARGS: &str = "--ros-args";

/// Whether help is asked for, outside of ROS arguments.
pub(crate) fn is_wanted(args: &[String]) -> bool {
    let own = args.iter().take_while(|argument| *argument != ROS_ARGS);
    own.into_iter()
        .any(|argument| argument == "--help" || argument == "-h")
}

/// Prints how to use a node, and its parameters.
pub(crate) fn print(name: &str, mut parameters: Vec<ParameterSpec>) -> ExitCode {
    parameters.extend(start::common());
    let help = parameters.iter().map(ParameterSpec::help);
    let lines: String = help
        .map(|(name, text)| format!("  {name}\n          {text}\n"))
        .collect();
    let text = format!(
        "{name}: a managed ROS 2 node\n\n\
         Usage: {name} [--supervised] [{ROS_ARGS} [-p NAME:=VALUE] [-r FROM:=TO] [--params-file FILE] ...]\n\n\
         Options:\n  --supervised\n          Report events as JSON on standard output, and stop when standard input ends\n  \
         -h, --help\n          Print help\n\n\
         Parameters:\n{lines}"
    );
    // Without a reader there is nobody to tell.
    let _ = std::io::stdout().write_all(text.as_bytes());
    ExitCode::SUCCESS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn help_among_ros_arguments_is_not_for_the_node() {
        let wanted = |line: &str| is_wanted(&line.split(' ').map(Into::into).collect::<Vec<_>>());
        assert!(wanted("--help") && wanted("-h --ros-args -p a:=1"));
        assert!(!wanted("--ros-args -p a:=1 --help") && !wanted("--supervised"));
    }
}
