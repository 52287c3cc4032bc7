//! What gungraun has measured: a JSON object a benchmark.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::GuardError;
use crate::counts::Counts;

/// Where gungraun tells the number of instructions, of its form 7.
const INSTRUCTIONS: &str = "/profiles/0/data/total/metrics/Ir/values/new";

/// The counts in the file at `path`, by the compiler that is here.
pub(crate) fn read(path: &Path) -> Result<Counts, GuardError> {
    let text = std::fs::read_to_string(path).map_err(|source| GuardError::File {
        path: path.into(),
        source,
    })?;
    let instructions = parse(&text).map_err(|reason| GuardError::form(path, reason))?;
    Ok(Counts {
        toolchain: toolchain()?,
        instructions,
    })
}

fn parse(text: &str) -> Result<BTreeMap<String, BTreeMap<String, u64>>, String> {
    let mut instructions: BTreeMap<_, BTreeMap<_, _>> = BTreeMap::new();
    for summary in serde_json::Deserializer::from_str(text).into_iter::<Value>() {
        let summary = summary.map_err(|error| error.to_string())?;
        let name = |key: &str| summary[key].as_str().map(str::to_owned);
        let kernel = name("id").or_else(|| name("function_name"));
        let count = summary.pointer(INSTRUCTIONS).and_then(Value::as_u64);
        match (name("group"), kernel, count) {
            (Some(group), Some(kernel), Some(count)) => {
                instructions.entry(group).or_default().insert(kernel, count);
            }
            _ => return Err(format!("no count of instructions in {summary}")),
        }
    }
    if instructions.is_empty() {
        return Err("no benchmark was run".to_owned());
    }
    Ok(instructions)
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
    fn counts_are_taken_from_one_object_a_benchmark() {
        let summary = |id: &str, count: &str| {
            format!(
                r#"{{"group": "steps", "function_name": "step", {id} "profiles": [{{"data": {{"total": {{"metrics":
                {{"Ir": {{"values": {{"new": {count}, "old": 7}}}}}}}}}}}}]}}"#
            )
        };
        let text = [summary(r#""id": "lgvi","#, "100"), summary("", "200")].join("\n");
        let instructions = parse(&text).unwrap();
        let expected = [("lgvi".to_owned(), 100), ("step".to_owned(), 200)];
        assert_eq!(instructions["steps"], BTreeMap::from(expected));
        for (bad, says) in [
            ("", "no benchmark"),
            ("{}", "no count"),
            ("{", "EOF"),
            (&summary("", "null"), "no count"),
        ] {
            let refusal = parse(bad).unwrap_err();
            assert!(refusal.contains(says), "{refusal}");
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
