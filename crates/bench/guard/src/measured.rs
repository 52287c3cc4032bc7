//! Instruction counts of this program's kernels, each in a process of its own under callgrind.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use crate::GuardError;
use crate::counts::Counts;
use crate::kernels::{self, COUNTED, Kernel};

/// Counts the instructions of all kernels.
pub(crate) fn measure() -> Result<Counts, GuardError> {
    let mut instructions: BTreeMap<_, BTreeMap<_, _>> = BTreeMap::new();
    for Kernel { group, name, .. } in kernels::all() {
        let count = count(name)?;
        let kernels = instructions.entry(group.to_owned()).or_default();
        kernels.insert(name.to_owned(), count);
    }
    Ok(Counts {
        toolchain: toolchain()?,
        instructions,
    })
}

/// Counts the instructions of one kernel.
fn count(kernel: &str) -> Result<u64, GuardError> {
    let failed = |reason: String| GuardError::Callgrind {
        kernel: kernel.to_owned(),
        reason,
    };
    let file = |source| GuardError::File {
        path: "counts of callgrind".into(),
        source,
    };
    let counts = tempfile::NamedTempFile::new().map_err(file)?;
    let mut out = std::ffi::OsString::from("--callgrind-out-file=");
    out.push(counts.path());
    // The environment's size moves the stack, and may change a count.
    let output = Command::new("valgrind")
        .env_clear()
        .envs(std::env::var_os("PATH").map(|path| ("PATH", path)))
        .args(["--tool=callgrind", "--collect-atstart=no"])
        .arg(format!("--toggle-collect={COUNTED}"))
        .arg(out)
        .arg(std::env::current_exe().map_err(file)?)
        .args(["--run", kernel])
        .output()
        .map_err(|error| failed(error.to_string()))?;
    if !output.status.success() {
        return Err(failed(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    total(counts.path()).map_err(failed)
}

/// The sum in a file of callgrind.
fn total(path: &Path) -> Result<u64, String> {
    let text = std::fs::read_to_string(path).map_err(|error| error.to_string())?;
    let line = text.lines().find_map(|line| line.strip_prefix("totals: "));
    match line.and_then(|count| count.trim().parse().ok()) {
        None | Some(0) => Err(format!("nothing was counted: {line:?}")),
        Some(count) => Ok(count),
    }
}

/// Version and target of the compiler, as in `1.95.0 (59807616e 2026-04-14) x86_64-unknown-linux-gnu`.
fn toolchain() -> Result<String, GuardError> {
    let compiler = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output = Command::new(compiler).arg("-vV").output();
    let output = output.map_err(|error| GuardError::Compiler(error.to_string()))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let line = |key: &str| text.lines().find_map(|line| line.strip_prefix(key));
    match (line("rustc "), line("host: ")) {
        (Some(version), Some(host)) => Ok(format!("{version} {host}")),
        _ => Err(GuardError::Compiler(format!("it said {text:?}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_is_taken_from_the_file_of_callgrind() {
        let file = tempfile::NamedTempFile::new().unwrap();
        for (text, sum) in [
            ("events: Ir\nsummary: 7\n\ntotals: 66274\n", Ok(66274)),
            ("totals: 0\n", Err("nothing was counted")),
            ("totals: many\n", Err("nothing was counted")),
            ("", Err("nothing was counted")),
        ] {
            std::fs::write(file.path(), text).unwrap();
            match (total(file.path()), sum) {
                (Ok(counted), Ok(sum)) => assert_eq!(counted, sum),
                (Err(refusal), Err(says)) => assert!(refusal.contains(says), "{refusal}"),
                (counted, sum) => panic!("{counted:?}, not {sum:?}"),
            }
        }
    }

    #[test]
    fn the_compiler_says_its_version_and_target() {
        let toolchain = toolchain().unwrap();
        let words: Vec<_> = toolchain.split(' ').collect();
        assert!(words[0].split('.').count() >= 3, "{toolchain}");
        assert!(words[words.len() - 1].contains('-'), "{toolchain}");
    }
}
