//! The tables of docs/interfaces.md.

use std::fs;

use crate::root;

/// A row of a table that has its nodes in the first column.
#[derive(Debug)]
pub struct Row {
    /// The node, `propagator` for example, or `all`.
    pub node: String,
    /// The cells after it.
    pub cells: Vec<String>,
}

/// The rows of the first table of a section.
pub fn documented(section: &str) -> Vec<Row> {
    let page = fs::read_to_string(root().join("docs/interfaces.md")).expect("the page");
    let heading = format!("\n## {section}\n");
    let (_, text) = page.split_once(&heading).expect("the section");
    let text = text.split("\n## ").next().unwrap_or(text);
    let table = text
        .lines()
        .skip_while(|line| !line.starts_with("| Node |"));
    let rows = table.take_while(|line| line.starts_with('|')).skip(2);
    let mut node = String::new();
    rows.map(|row| {
        let row = row.trim_matches('|');
        let mut cells = row.split('|').map(|cell| cell.trim().to_owned());
        let name = cells.next().unwrap_or_default();
        if !name.is_empty() {
            node = name;
        }
        Row {
            node: node.clone(),
            cells: cells.collect(),
        }
    })
    .collect()
}

/// Spans of code in Markdown.
pub fn codes(cell: &str) -> Vec<String> {
    cell.split('`').skip(1).step_by(2).map(Into::into).collect()
}
