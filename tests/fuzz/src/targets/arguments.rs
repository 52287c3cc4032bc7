//! The command line of a node and its parameter files.

use std::fs;

use lgvi_middleware::{NodeArgs, ParameterSpec, Parameters};

use super::scratch;

/// The text is a command line, an argument a line; after a NUL follows what all of its parameter files hold.
pub fn ros_args(data: &[u8]) {
    let Ok(text) = str::from_utf8(data) else {
        return;
    };
    let (line, params) = text.split_once('\0').unwrap_or((text, ""));
    given(line.split('\n'), params);
}

/// The text is a parameter file.
pub fn params_file(data: &[u8]) {
    if let Ok(text) = str::from_utf8(data) {
        given(["--ros-args", "--params-file", ""], text);
    }
}

const PARAMS_FILE: &str = "--params-file";

fn given<'a>(line: impl IntoIterator<Item = &'a str>, params: &str) {
    let directory = scratch();
    let file = directory.path().join("params.yaml");
    if fs::write(&file, params).is_err() {
        return;
    }
    let mut arguments: Vec<String> = line.into_iter().map(str::to_owned).collect();
    for index in 1..arguments.len() {
        if arguments[index - 1] == PARAMS_FILE {
            arguments[index] = file.display().to_string();
        }
    }
    let (node, _rest) = match NodeArgs::parse("lgvi_propagator", arguments) {
        Ok(parsed) => parsed,
        Err(error) => {
            let _ = error.to_string();
            return;
        }
    };
    assert!(node.fully_qualified_name().starts_with('/'));
    for name in ["~/state", "/clock", "control", "~/_action/status"] {
        for resolved in [
            node.resolve(name),
            node.resolve_service(name),
            node.resolve_action(name),
        ] {
            match resolved {
                Ok(resolved) => assert!(resolved.starts_with('/'), "{resolved:?}"),
                Err(error) => drop(error.to_string()),
            }
        }
    }
    let _ = (node.log(), node.enclave(), node.notices());
    if let Err(error) = Parameters::declare(node.parameters(), specifications()) {
        let _ = error.to_string();
    }
}

/// A parameter of each type, called as those of the nodes are.
fn specifications() -> Vec<ParameterSpec> {
    vec![
        ParameterSpec::optional::<String>("scene", ""),
        ParameterSpec::new("shared_memory", true, ""),
        ParameterSpec::new("rate", 1.0, "").range(0.0, 1e6),
        ParameterSpec::new("steps", 10_i64, "").integer_range(0, 100),
        ParameterSpec::optional::<Vec<String>>("topics", ""),
        ParameterSpec::optional::<Vec<f64>>("weights", ""),
        ParameterSpec::optional::<Vec<i64>>("counts", ""),
        ParameterSpec::optional::<Vec<bool>>("flags", ""),
        ParameterSpec::new("use_sim_time", false, ""),
    ]
}
