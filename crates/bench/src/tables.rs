//! Tables in Markdown: printed, kept as files, and put into the documentation between markers.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::error::{BenchError, write_text};

/// Rows under a head, and pictures that stand above it on a page.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    head: Vec<String>,
    rows: Vec<Vec<String>>,
    /// What each shows and the name of its file.
    pictures: Vec<[String; 2]>,
}

impl Table {
    pub(crate) fn new<Cell: Into<String>>(head: impl IntoIterator<Item = Cell>) -> Self {
        Self {
            head: head.into_iter().map(Into::into).collect(),
            rows: Vec::new(),
            pictures: Vec::new(),
        }
    }

    /// The same below another picture, which shows `what` and lies in the file called `name` in the output directory.
    pub(crate) fn below(mut self, what: &str, name: &str) -> Self {
        self.pictures.push([what.into(), name.into()]);
        self
    }

    pub(crate) fn row<Cell: Into<String>>(&mut self, cells: impl IntoIterator<Item = Cell>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    fn markdown(&self) -> String {
        let rows: String = self.rows.iter().map(|row| line(row)).collect();
        headed(&self.head) + &rows
    }

    /// With the pictures side by side.
    fn page(&self) -> String {
        if self.pictures.is_empty() {
            return self.markdown();
        }
        let shown = self.pictures.iter();
        let shown: Vec<_> = shown
            .map(|[what, name]| format!("![{what}](images/{name})"))
            .collect();
        let head = vec![String::new(); shown.len()];
        headed(&head) + &line(&shown) + "\n" + &self.markdown()
    }

    pub(crate) fn print(&self) {
        println!("\n{}", self.markdown());
    }

    /// Prints it and keeps it below `directory`, from where [`publish`] takes it.
    pub(crate) fn keep(&self, directory: &Path, name: &str) -> Result<(), BenchError> {
        self.print();
        write_text(&directory.join(path(name)), &self.page())
    }
}

fn line(cells: &[String]) -> String {
    format!("| {} |\n", cells.join(" | "))
}

fn headed(head: &[String]) -> String {
    line(head) + &line(&vec!["---".to_owned(); head.len()])
}

/// Where a table lies below the output directory.
fn path(name: &str) -> PathBuf {
    Path::new("tables").join(name).with_extension("md")
}

/// What was put into the documentation.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Published {
    /// Tables and pictures that were taken.
    pub taken: usize,
    /// What the documentation has and was not measured, which stays as it is.
    pub left: Vec<String>,
}

/// The Markdown files in the directory `docs`, all of whose markers have their ends and whose pictures a place.
pub(crate) fn pages(docs: &Path) -> Result<Vec<PathBuf>, BenchError> {
    let refuse = |source| BenchError::Read {
        path: docs.into(),
        source,
    };
    let mut pages = Vec::new();
    for entry in std::fs::read_dir(docs).map_err(refuse)? {
        let path = entry.map_err(refuse)?.path();
        if path.extension().is_some_and(|extension| extension == "md") {
            pages.push(path);
        }
    }
    pages.sort();
    for page in &pages {
        let text = read(page)?;
        let new = filled(&text, &mut Published::default(), |_| None);
        let new = new.map_err(|reason| unfilled(page, &reason))?;
        if images(&new).next().is_some() {
            let place = page.with_file_name("images");
            std::fs::read_dir(&place).map_err(|source| BenchError::Read {
                path: place,
                source,
            })?;
        }
    }
    Ok(pages)
}

fn read(page: &Path) -> Result<String, BenchError> {
    std::fs::read_to_string(page).map_err(|source| BenchError::Read {
        path: page.into(),
        source,
    })
}

fn unfilled(page: &Path, reason: &str) -> BenchError {
    BenchError::Body(format!("{}: {reason}", page.display()))
}

/// Puts what was `kept` below `directory` into the Markdown files `pages`: tables between `<!-- bench: name -->` and
/// `<!-- /bench -->`, pictures that a page shows from `images/` beside it.
pub(crate) fn publish(
    directory: &Path,
    kept: &BTreeSet<PathBuf>,
    pages: &[PathBuf],
) -> Result<Published, BenchError> {
    let mut published = Published::default();
    for page in pages {
        let text = read(page)?;
        let new = filled(&text, &mut published, |name| {
            let path = Some(path(name)).filter(|path| kept.contains(path))?;
            std::fs::read_to_string(directory.join(path)).ok()
        })
        .map_err(|reason| unfilled(page, &reason))?;
        if new != text {
            write_text(page, &new)?;
        }
        for image in images(&new) {
            let (from, to) = (
                directory.join(image),
                page.with_file_name("images").join(image),
            );
            if kept.contains(Path::new(image)) {
                std::fs::copy(&from, &to)
                    .map_err(|source| BenchError::Write { path: to, source })?;
                published.taken += 1;
            }
        }
    }
    published.left.dedup();
    Ok(published)
}

/// Names of the pictures in `images/` that a page shows.
fn images(text: &str) -> impl Iterator<Item = &str> {
    text.split("](images/")
        .skip(1)
        .filter_map(|rest| rest.split_once(')').map(|(name, _)| name))
}

const OPEN: &str = "<!-- bench: ";
const CLOSE: &str = "<!-- /bench -->";

/// The text with what `find` has between the markers: on lines of their own a table, within a line a figure.
fn filled(
    text: &str,
    published: &mut Published,
    find: impl Fn(&str) -> Option<String>,
) -> Result<String, String> {
    let mut new = String::new();
    let mut rest = text;
    while let Some(begin) = rest.find(OPEN) {
        let (before, marked) = rest.split_at(begin);
        let marked_end = marked.find(CLOSE).ok_or("a marker without its end")?;
        let (name, old) = marked[OPEN.len()..marked_end]
            .split_once(" -->")
            .ok_or("a marker that does not end")?;
        new.push_str(before);
        new.push_str(&format!("{OPEN}{name} -->"));
        match find(name) {
            Some(found) if old.starts_with('\n') => new.push_str(&format!("\n{}\n", found.trim())),
            Some(found) => new.push_str(found.trim()),
            None => new.push_str(old),
        }
        match find(name) {
            Some(_) => published.taken += 1,
            None => published.left.push(name.into()),
        }
        new.push_str(CLOSE);
        rest = &marked[marked_end + CLOSE.len()..];
    }
    Ok(new + rest)
}

#[cfg(test)]
mod tests {
    use super::{Published, Table, filled, images};

    const PAGE: &str = "Takes <!-- bench: time -->3 s<!-- /bench -->.\n\n<!-- bench: all -->\nold\n<!-- /bench -->\n\
        <!-- bench: other -->\nstays\n<!-- /bench -->\nend ![x](images/a.svg) ![y](images/b.svg)\n";

    #[test]
    fn tables_and_figures_go_between_their_markers_and_the_rest_stays() {
        let mut table = Table::new(["a", "b"]);
        table.row(["1", "2"]);
        assert_eq!(
            table.clone().below("c", "c.svg").page(),
            "|  |\n| --- |\n| ![c](images/c.svg) |\n\n| a | b |\n| --- | --- |\n| 1 | 2 |\n"
        );
        let find = |name: &str| match name {
            "time" => Some("4 s\n".to_owned()),
            "all" => Some(table.markdown()),
            _ => None,
        };
        let mut published = Published::default();
        let new = filled(PAGE, &mut published, find);
        let expected = PAGE
            .replace("3 s", "4 s")
            .replace("old", "| a | b |\n| --- | --- |\n| 1 | 2 |");
        assert_eq!(new.as_deref(), Ok(expected.as_str()));
        assert_eq!(published.taken, 2);
        assert_eq!(published.left, ["other"]);
        let again = new.and_then(|new| filled(&new, &mut Published::default(), find));
        assert_eq!(again.as_deref(), Ok(expected.as_str()));
    }

    #[test]
    fn a_marker_without_its_end_is_refused() {
        let page = "<!-- bench: all -->\nold\n";
        let filled = filled(page, &mut Published::default(), |_| None);
        assert_eq!(filled, Err("a marker without its end".to_owned()));
    }

    #[test]
    fn pictures_of_a_page_are_found() {
        assert_eq!(images(PAGE).collect::<Vec<_>>(), ["a.svg", "b.svg"]);
    }
}
