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
        matches!(&error, WriteError::Exists { path: found } if found == path),
        "{error}"
    );
}

#[test]
fn it_has_its_name_when_it_is_complete() {
    let folder = tempfile::tempdir().unwrap();
    let parent = folder.path().join("in/between");
    let output = parent.join("new");
    let new = NewDirectory::begin(&output).unwrap();
    assert_eq!(new.path(), parent.join("new.part"));
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
    assert_eq!(names(folder.path()), [".part"]);
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
fn what_was_left_is_removed() {
    let folder = tempfile::tempdir().unwrap();
    for (output, part) in [("new", "new.part"), ("empty", "empty/.part")] {
        let [output, part] = [output, part].map(|name| folder.path().join(name));
        fs::create_dir_all(&part).unwrap();
        // Before anything was made, and with some files.
        for left in [&[][..], &[".unfinished", "old_0.mcap"]] {
            for name in left {
                fs::write(part.join(name), "").unwrap();
            }
            let new = NewDirectory::begin(&output).unwrap();
            write(&new, &["a"]);
            assert!(!part.join("old_0.mcap").exists());
            drop(new);
            fs::create_dir_all(&part).unwrap();
        }
        let new = NewDirectory::begin(&output).unwrap();
        write(&new, &["a"]);
        new.complete().unwrap();
        assert_eq!(names(&output), ["a"]);
    }
}

#[test]
fn what_others_made_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("new");
    let part = folder.path().join("new.part");
    fs::create_dir(&part).unwrap();
    fs::write(part.join("precious"), "data").unwrap();
    is_taken(NewDirectory::begin(&output), &part);
    assert_eq!(names(&part), ["precious"]);
    is_taken(NewDirectory::begin(&part), &part);
    let file = part.join("precious");
    is_taken(NewDirectory::begin(&file), &file);
    // Made while it was filled.
    fs::remove_dir_all(&part).unwrap();
    let new = NewDirectory::begin(&output).unwrap();
    write(&new, &["a"]);
    fs::create_dir(&output).unwrap();
    fs::write(output.join("precious"), "data").unwrap();
    assert!(matches!(new.complete(), Err(WriteError::Exists { .. })));
    assert_eq!(names(&output), ["precious"]);
    assert!(!part.exists());
}

#[test]
fn one_makes_it_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("new");
    let first = NewDirectory::begin(&output).unwrap();
    write(&first, &["a"]);
    let error = NewDirectory::begin(&output).err().unwrap();
    assert!(error.to_string().contains("is being written"), "{error}");
    first.complete().unwrap();
    assert_eq!(names(&output), ["a"]);
    is_taken(NewDirectory::begin(&output), &output);
}
