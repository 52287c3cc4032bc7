//! Whether RustDDS can open what it needs: 0.15 panics on its threads, or goes on without a part, where it cannot.

use std::{fs::File, io};

/// What a participant opens, with its first two endpoints and a margin.
pub(super) const PARTICIPANT: usize = if cfg!(feature = "security") { 104 } else { 64 };

/// What an endpoint opens, with a margin for what else opens files at the same time.
pub(super) const ENDPOINT: usize = 16;

/// No file for some that are needed.
#[derive(Debug, thiserror::Error)]
#[error("{found} more files can be opened, DDS needs {wanted} (`ulimit -n`): {source}")]
pub(super) struct TooFew {
    wanted: usize,
    found: usize,
    source: io::Error,
}

/// Opens and closes as many files.
pub(super) fn spare(wanted: usize) -> Result<(), TooFew> {
    let mut files = Vec::with_capacity(wanted);
    while files.len() < wanted {
        match File::open("/dev/null") {
            Ok(file) => files.push(file),
            Err(source) => {
                return Err(TooFew {
                    wanted,
                    found: files.len(),
                    source,
                });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::{env, process::Command};

    use crate::{Environment, NodeArgs, ros::RosNode};

    /// Set in the process that may open few files.
    const LIMITED: &str = "LGVI_TEST_FEW_FILES";

    /// As after `ulimit -n`.
    #[test]
    fn a_node_that_may_open_too_few_files_says_so() {
        if env::var_os(LIMITED).is_some() {
            let (args, _) = NodeArgs::parse("limited", []).unwrap();
            let error = RosNode::new(&args, &Environment::localhost(101)).unwrap_err();
            println!("{error}");
            return;
        }
        let name = "ros::dds::descriptors::tests::a_node_that_may_open_too_few_files_says_so";
        let limited = format!("ulimit -n 20; exec \"$0\" --exact {name} --nocapture");
        let output = Command::new("sh")
            .args(["-c", &limited])
            .arg(env::current_exe().unwrap())
            .env(LIMITED, "1")
            .output()
            .unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(
            output.status.success()
                && text.contains(&format!("DDS needs {} (`ulimit -n`)", super::PARTICIPANT)),
            "{text}"
        );
        assert!(
            !String::from_utf8(output.stderr)
                .unwrap()
                .contains("panicked")
        );
    }
}
