//! The page: `assets/page.html` with what belongs between its braces.

use super::flight::Flight;

const PAGE: &str = include_str!("assets/page.html");
const LIBRARIES: &str = include_str!("assets/libraries.min.js");
const STYLES: &str = concat!(
    include_str!("assets/libraries.css"),
    "\n",
    include_str!("assets/page.css")
);
/// Each uses what those before it define.
const SCRIPTS: &str = concat!(
    include_str!("assets/numbers.js"),
    include_str!("assets/flight.js"),
    include_str!("assets/shapes.js"),
    include_str!("assets/places.js"),
    include_str!("assets/trails.js"),
    include_str!("assets/goal.js"),
    include_str!("assets/marks.js"),
    include_str!("assets/view.js"),
    include_str!("assets/plots.js"),
    include_str!("assets/panels.js"),
    include_str!("assets/page.js"),
);

/// The page of a flight, as an HTML document.
pub(super) fn page(flight: &Flight<'_>) -> Result<String, serde_json::Error> {
    let title = text(flight.title);
    let data = data(&serde_json::to_string(flight)?);
    let mut page = String::with_capacity(PAGE.len() + LIBRARIES.len() + SCRIPTS.len() + data.len());
    let mut rest = PAGE;
    // What is put in is not looked at again, whatever braces a title has.
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        page.push_str(before);
        page.push_str(match name {
            "title" => &title,
            "styles" => STYLES,
            "libraries" => LIBRARIES,
            "flight" => &data,
            "scripts" => SCRIPTS,
            _ => "",
        });
        rest = after;
    }
    page.push_str(rest);
    Ok(page)
}

/// A text as the content of an element.
fn text(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

/// JSON as the content of a script: without `<`, which is in its texts only, nothing can end it or begin another.
fn data(json: &str) -> String {
    json.replace('<', "\\u003c")
}
