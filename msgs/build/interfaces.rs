//! The messages that `.srv` and `.action` files stand for, written as `.msg` files.

use std::{
    error::Error,
    fs, io,
    path::{Path, PathBuf},
};

const SEPARATOR: &str = "---";

/// A `.srv` file.
pub struct Service {
    pub package: String,
    pub name: String,
}

/// An `.action` file.
pub struct Action {
    pub package: String,
    pub name: String,
}

/// Everything that has been found.
#[derive(Default)]
pub struct Interfaces {
    pub services: Vec<Service>,
    pub actions: Vec<Action>,
}

impl Interfaces {
    /// Writes the messages of a package's services and actions below `output/<package>`.
    pub fn expand(
        &mut self,
        package: &str,
        source: &Path,
        output: &Path,
    ) -> Result<(), Box<dyn Error>> {
        for path in files(&source.join("srv"), "srv")? {
            let name = stem(&path)?;
            let [request, response] = parts(&path)?;
            let folder = folder(source, output, package, "srv")?;
            write(&folder, &format!("{name}_Request"), &request)?;
            write(&folder, &format!("{name}_Response"), &response)?;
            self.services.push(Service {
                package: package.to_owned(),
                name,
            });
        }
        for path in files(&source.join("action"), "action")? {
            let name = stem(&path)?;
            let folder = folder(source, output, package, "action")?;
            for (suffix, text) in action_messages(package, &name, parts(&path)?) {
                write(&folder, &format!("{name}_{suffix}"), &text)?;
            }
            self.actions.push(Action {
                package: package.to_owned(),
                name,
            });
        }
        Ok(())
    }
}

/// The messages of an action, by the suffix of their name (<https://design.ros2.org/articles/actions.html>).
fn action_messages(
    package: &str,
    name: &str,
    [goal, result, feedback]: [String; 3],
) -> [(&'static str, String); 8] {
    let id = "unique_identifier_msgs/UUID goal_id\n";
    [
        (
            "SendGoal_Request",
            format!("{id}{package}/{name}_Goal goal\n"),
        ),
        (
            "SendGoal_Response",
            "bool accepted\nbuiltin_interfaces/Time stamp\n".to_owned(),
        ),
        ("GetResult_Request", id.to_owned()),
        (
            "GetResult_Response",
            format!("int8 status\n{package}/{name}_Result result\n"),
        ),
        (
            "FeedbackMessage",
            format!("{id}{package}/{name}_Feedback feedback\n"),
        ),
        ("Goal", goal),
        ("Result", result),
        ("Feedback", feedback),
    ]
}

fn files(folder: &Path, extension: &str) -> io::Result<Vec<PathBuf>> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let mut files = fs::read_dir(folder)?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<io::Result<Vec<_>>>()?;
    files.retain(|path| path.extension().is_some_and(|found| found == extension));
    files.sort();
    Ok(files)
}

fn stem(path: &Path) -> Result<String, String> {
    path.file_stem()
        .and_then(|stem| stem.to_str())
        .map(ToOwned::to_owned)
        .ok_or_else(|| format!("{} has no name", path.display()))
}

/// The parts of a file between its separators, which must be as many as wanted.
fn parts<const N: usize>(path: &Path) -> Result<[String; N], Box<dyn Error>> {
    let text = fs::read_to_string(path)?;
    let mut parts = vec![String::new()];
    for line in text.lines() {
        if line.trim_end() == SEPARATOR {
            parts.push(String::new());
        } else if let Some(part) = parts.last_mut() {
            part.push_str(line);
            part.push('\n');
        }
    }
    parts.try_into().map_err(|parts: Vec<_>| {
        format!(
            "{}: {} parts between lines of {SEPARATOR}, expected {N}",
            path.display(),
            parts.len()
        )
        .into()
    })
}

fn folder(source: &Path, output: &Path, package: &str, kind: &str) -> io::Result<PathBuf> {
    let package = output.join(package);
    let folder = package.join(kind);
    fs::create_dir_all(&folder)?;
    fs::copy(source.join("package.xml"), package.join("package.xml"))?;
    Ok(folder)
}

fn write(folder: &Path, name: &str, text: &str) -> io::Result<()> {
    fs::write(folder.join(format!("{name}.msg")), text)
}
