//! Directories are complete or not there, and never made over anything.

use std::{fs, path::Path};

use lgvi_bag::{NewDirectory, WriteError};

fn write(new: &NewDirectory, names: &[&str]) {
    for name in names {
        fs::write(new.path().join(name), name).unwrap();
    }
}

fn names(directory: &Path) -> Vec<String> {
    let entries = fs::read_dir(directory).unwrap().flatten();
    let names = entries.map(|entry| entry.file_name().into_string().unwrap());
    let mut names: Vec<_> = names.collect();
    names.sort();
    names
}

fn is_taken(begun: Result<NewDirectory, WriteError>, path: &Path) {
    let error = begun.err().unwrap();
    assert!(
        matches!(&error, WriteError::Exists(found) if found == path),
        "{error}"
    );
}

#[test]
fn it_has_its_name_when_it_is_complete() {
    let folder = tempfile::tempdir().unwrap();
    let parent = folder.path().join("in/between");
    let output = parent.join("new");
    let new = NewDirectory::begin(&output).unwrap();
    let part = new.path().to_str().unwrap();
    assert!(
        part.starts_with(parent.join("new.part").to_str().unwrap()),
        "{part}"
    );
    write(&new, &["a", "b"]);
    assert!(!output.exists());
    new.complete().unwrap();
    assert_eq!(names(&output), ["a", "b"]);
    assert_eq!(names(&parent), ["new"]);
}

#[test]
fn an_empty_directory_stays_the_same() {
    use std::os::unix::fs::MetadataExt;

    let folder = tempfile::tempdir().unwrap();
    let node = || fs::metadata(folder.path()).unwrap().ino();
    let before = node();
    let new = NewDirectory::begin(folder.path()).unwrap();
    write(&new, &["a", "metadata.yaml"]);
    let [part] = &names(folder.path())[..] else {
        panic!("{:?}", names(folder.path()));
    };
    assert!(part.starts_with(".part"), "{part}");
    new.complete().unwrap();
    assert_eq!(names(folder.path()), ["a", "metadata.yaml"]);
    assert_eq!(node(), before);
}

#[test]
fn what_is_dropped_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let empty = folder.path().join("empty");
    fs::create_dir(&empty).unwrap();
    for output in ["new", "empty"] {
        let new = NewDirectory::begin(&folder.path().join(output)).unwrap();
        write(&new, &["a"]);
    }
    assert_eq!(names(folder.path()), ["empty"]);
    assert!(names(&empty).is_empty());
}

/// As a process leaves it that is killed.
#[test]
fn what_was_left_is_no_hindrance() {
    let folder = tempfile::tempdir().unwrap();
    for (output, part) in [("new", "new.partAb1Cd2"), ("empty", "empty/.partAb1Cd2")] {
        let [output, part] = [output, part].map(|name| folder.path().join(name));
        fs::create_dir_all(&part).unwrap();
        fs::write(part.join("old_0.mcap"), "").unwrap();
        let new = NewDirectory::begin(&output).unwrap();
        write(&new, &["a"]);
        new.complete().unwrap();
        assert!(output.join("a").exists() && part.join("old_0.mcap").exists());
    }
}

#[test]
fn what_others_made_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("new");
    fs::create_dir(&output).unwrap();
    let file = output.join("precious");
    fs::write(&file, "data").unwrap();
    is_taken(NewDirectory::begin(&output), &output);
    is_taken(NewDirectory::begin(&file), &file);
    fs::remove_dir_all(&output).unwrap();
    // Made while it was filled.
    let new = NewDirectory::begin(&output).unwrap();
    write(&new, &["a"]);
    let part = new.path().to_owned();
    fs::create_dir(&output).unwrap();
    fs::write(&file, "data").unwrap();
    assert!(matches!(new.complete(), Err(WriteError::Exists(_))));
    assert_eq!(names(&output), ["precious"]);
    assert!(!part.exists());
}

/// It is as open to others as any directory that the user makes.
#[test]
fn it_has_usual_permissions() {
    use std::os::unix::fs::PermissionsExt;

    let folder = tempfile::tempdir().unwrap();
    let [output, usual] = ["new", "usual"].map(|name| folder.path().join(name));
    NewDirectory::begin(&output).unwrap().complete().unwrap();
    fs::create_dir(&usual).unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&output), mode(&usual));
}
