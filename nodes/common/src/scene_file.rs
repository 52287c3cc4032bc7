use std::fmt::Display;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use lgvi_scene::{LONGEST, Scene, SceneError};
use thiserror::Error;
use toml_edit::{DocumentMut, Item, Table, Value};

/// Why a scene file cannot be flown.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("scene {}: {reason}", path.display())]
pub struct SceneFileError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub reason: Reason,
}

/// What is wrong with a scene file.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Reason {
    /// It, or a mesh that it names, cannot be read.
    #[error("{0}")]
    Unreadable(String),
    /// What it says cannot be flown.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// Why a key of a scene's text cannot be set.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{key}={value}: {reason}")]
pub struct KeyError {
    /// The key.
    pub key: String,
    /// What it was to be set to.
    pub value: String,
    /// Why it was not.
    pub reason: String,
}

#[cfg(feature = "node")]
impl From<SceneFileError> for lgvi_middleware::node::NodeError {
    fn from(error: SceneFileError) -> Self {
        Self::input(error)
    }
}

#[cfg(feature = "node")]
impl From<KeyError> for lgvi_middleware::node::NodeError {
    fn from(error: KeyError) -> Self {
        Self::Input(format!("--set {error}"))
    }
}

/// Reads and compiles a scene file; the scene is named after the file.
pub fn load_scene(path: &Path) -> Result<Scene, SceneFileError> {
    parse_scene(path, &read_scene(path)?)
}

/// Compiles a scene's text as if it came from a file at `path`.
pub fn parse_scene(path: &Path, text: &str) -> Result<Scene, SceneFileError> {
    let name = path
        .file_stem()
        .map_or_else(|| "scene".into(), |stem| stem.to_string_lossy());
    Scene::parse(&name, text).map_err(|error| refuse(path, error.into()))
}

/// Reads a scene file. A mesh that it names by `obj_file`, relative to its own directory, becomes a part of the text.
pub fn read_scene(path: &Path) -> Result<String, SceneFileError> {
    let text = read(path).map_err(|reason| refuse(path, reason))?;
    let Some(mut document) = text
        .contains(OBJ_FILE)
        .then(|| text.parse::<DocumentMut>().ok())
        .flatten()
    else {
        // Without meshes, or with a fault that the parser of scenes names.
        return Ok(text);
    };
    let directory = path.parent().unwrap_or(Path::new(""));
    for table in polyhedra(&mut document) {
        let Some(Item::Value(Value::String(file))) = table.remove(OBJ_FILE) else {
            continue;
        };
        let file = directory.join(file.value());
        let mesh = read(&file).map_err(|error| {
            let reason = format!("`{OBJ_FILE}` {}: {error}", file.display());
            refuse(path, Reason::Unreadable(reason))
        })?;
        table.insert("obj", toml_edit::value(mesh));
    }
    Ok(document.to_string())
}

/// Sets a key of a scene's text, as `run.duration`, `bodies[0].mass` or `bodies.spacecraft.mass`, to a TOML value; one that
/// is none is a string.
pub fn set_key(text: &str, key: &str, value: &str) -> Result<String, KeyError> {
    let fail = |why: &dyn Display| KeyError {
        key: key.to_owned(),
        value: value.to_owned(),
        reason: why.to_string(),
    };
    let mut document = text.parse::<DocumentMut>().map_err(|error| fail(&error))?;
    let value = value.parse().unwrap_or_else(|_| Value::from(value));
    let (parents, name) = key.rsplit_once('.').unwrap_or(("", key));
    let mut item = document.as_item_mut();
    for part in parents.split('.').filter(|part| !part.is_empty()) {
        let expected = known(item);
        item = enter(item, part)
            .ok_or_else(|| fail(&format!("the scene has no `{part}`, expected {expected}")))?;
    }
    let (name, index) = indexed(name);
    let place = match index {
        None => {
            let table = item.as_table_like_mut();
            let table = table.ok_or_else(|| fail(&format!("`{parents}` is no table")))?;
            table.entry(name).or_insert(Item::None)
        }
        Some(_) => enter(item, key.rsplit('.').next().unwrap_or(key))
            .ok_or_else(|| fail(&format!("the scene has no `{key}`")))?,
    };
    match place {
        Item::Value(old) => {
            let decor = old.decor().clone();
            *old = value;
            *old.decor_mut() = decor;
        }
        place => *place = Item::Value(value),
    }
    Ok(document.to_string())
}

const OBJ_FILE: &str = "obj_file";

fn refuse(path: &Path, reason: Reason) -> SceneFileError {
    SceneFileError {
        path: path.to_owned(),
        reason,
    }
}

/// Reads a text that is no longer than a scene may be.
fn read(path: &Path) -> Result<String, Reason> {
    // Without the number of the system's error.
    let text = |error: io::Error| {
        let text = error.to_string();
        let words = text.split(" (os error").next();
        Reason::Unreadable(words.unwrap_or_default().to_owned())
    };
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(text)?;
    file.take(LONGEST as u64 + 1)
        .read_to_end(&mut bytes)
        .map_err(text)?;
    if bytes.len() > LONGEST {
        return Err(SceneError::TooLong.into());
    }
    String::from_utf8(bytes).map_err(|error| Reason::Unreadable(error.to_string()))
}

/// Returns the polyhedra that name a mesh file.
fn polyhedra(document: &mut DocumentMut) -> impl Iterator<Item = &mut dyn toml_edit::TableLike> {
    let bodies = document
        .get_mut("bodies")
        .and_then(Item::as_array_of_tables_mut);
    let bodies = bodies.into_iter().flat_map(|bodies| bodies.iter_mut());
    let shapes = bodies.filter_map(|body: &mut Table| body.get_mut("polyhedron"));
    let shapes = shapes.filter_map(Item::as_table_like_mut);
    shapes.filter(|shape| shape.contains_key(OBJ_FILE))
}

/// Splits `name[3]` into name and index.
fn indexed(part: &str) -> (&str, Option<usize>) {
    let split = part.strip_suffix(']').and_then(|part| part.split_once('['));
    match split.and_then(|(name, index)| Some((name, index.parse().ok()?))) {
        Some((name, index)) => (name, Some(index)),
        None => (part, None),
    }
}

/// Returns the item of a name in a table, of an index in it, or the table of that name in an array of tables.
fn enter<'a>(item: &'a mut Item, part: &str) -> Option<&'a mut Item> {
    if item.is_array_of_tables() {
        let named = |table: &Table| table.get("name").and_then(Item::as_str) == Some(part);
        let index = item.as_array_of_tables()?.iter().position(named)?;
        return item.get_mut(index);
    }
    let (name, index) = indexed(part);
    // What is not there is made up as `None`.
    let inner = item.get_mut(name).filter(|inner| !inner.is_none())?;
    match index {
        None => Some(inner),
        Some(index) => inner.get_mut(index),
    }
}

/// Returns what [`enter`] finds in an item, in words.
fn known(item: &Item) -> String {
    let names: Vec<_> = match (item.as_array_of_tables(), item.as_table_like()) {
        (Some(tables), _) => (tables.iter())
            .filter_map(|table| table.get("name")?.as_str())
            .collect(),
        (None, Some(table)) => table.iter().map(|(name, _)| name).collect(),
        (None, None) => return "no key of what is no table".into(),
    };
    format!("one of {}", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "title = \"t\" # of all\n[run]\nsteps = 1 # few\n[[bodies]]\nname = \"a\"\npoints = [1, 2]\n[[bodies]]\nname = \"b\"\nmass = 1.0\n";

    #[test]
    fn keys_are_set_and_the_rest_stays() {
        let set = |key, value| set_key(TEXT, key, value).map_err(|error| error.to_string());
        let replaced = |from, to| Ok(TEXT.replace(from, to));
        assert_eq!(
            set("run.steps", "20"),
            replaced("steps = 1 #", "steps = 20 #")
        );
        assert_eq!(
            set("title", "other words"),
            replaced("\"t\"", "\"other words\"")
        );
        assert_eq!(
            set("bodies[1].mass", "2.5"),
            replaced("mass = 1.0", "mass = 2.5")
        );
        assert_eq!(
            set("bodies.b.mass", "2.5"),
            replaced("mass = 1.0", "mass = 2.5")
        );
        assert_eq!(
            set("run.duration", "[1, 2]"),
            replaced("few\n", "few\nduration = [1, 2]\n")
        );
        for (wrong, expected) in [
            (
                "bodies.c.mass",
                "the scene has no `c`, expected one of a, b",
            ),
            ("bodies[2].mass", "no `bodies[2]`"),
            ("rum.steps", "no `rum`, expected one of title, run, bodies"),
            ("title.x", "`title` is no table"),
            ("title.x.y", "no `x`"),
        ] {
            let error = set(wrong, "1").unwrap_err();
            assert!(error.contains(wrong) && error.contains(expected), "{error}");
        }
    }

    #[test]
    fn a_mesh_file_becomes_a_part_of_the_text() {
        let directory = tempfile::tempdir().unwrap();
        let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
        std::fs::write(directory.path().join("rock.obj"), mesh).unwrap();
        let scene = |shape: &str| {
            format!(
                "title = \"t\"\n[units]\nlength = \"1 m\"\nmass = \"1 kg\"\ntime = \"1 s\"\n[run]\nduration = 1.0\nsteps = 10\n\
                 integrator = \"lgvi\"\n[publish]\nstate_every = 1\nros_every = 1\n[gravity]\nmutual = 1.0\n[[bodies]]\nname = \"rock\"\n\
                 mass = 1.0\npolyhedron = {{ {shape} }}\nposition = [0, 0, 0]\nattitude = {{ w = 1, x = 0, y = 0, z = 0 }}\n"
            )
        };
        let path = directory.path().join("scene.toml");
        std::fs::write(&path, scene("obj_file = \"rock.obj\"")).unwrap();
        let text = read_scene(&path).unwrap();
        assert!(
            text.contains("v 0 0 1") && !text.contains(OBJ_FILE),
            "{text}"
        );
        std::fs::write(&path, scene("obj_file = \"none.obj\"")).unwrap();
        let error = load_scene(&path).unwrap_err().to_string();
        assert!(
            error.contains("none.obj") && error.contains("scene.toml"),
            "{error}"
        );
    }
}
