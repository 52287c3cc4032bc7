//! Pages as a browser shows them: Chromium without a window.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::World;

/// What the tests in `chromium` need.
const NEEDS: &str =
    "apt-get install chromium (Debian 12); tests/run leaves these tests out where it is missing";

const FLAGS: [&str; 12] = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    // Draws WebGL without a graphics card.
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--window-size=1200,800",
    // (ms) of the page's own time.
    "--virtual-time-budget=3000",
];

/// Collects what goes wrong before the page's own scripts begin.
const BEFORE: &str = r#"<script>
window.problems = [];
for (const kind of ["error", "warn"]) console[kind] = (...words) => window.problems.push(`${kind}: ${words.join(" ")}`);
addEventListener("error", (event) => window.problems.push(`thrown: ${event.message}`));
addEventListener("securitypolicyviolation", (event) => window.problems.push(`refused: ${event.blockedURI}`));
</script>"#;

/// Shows a page, runs `script` in it when it has been loaded, and returns what the script returns, with everything in
/// `problems` that a developer would see in the browser's console.
#[track_caller]
pub fn browse(world: &World, page: &Path, script: &str) -> (Value, Vec<String>) {
    let text = fs::read_to_string(page).expect("a page");
    let (head, rest) = text.split_once("<title>").expect("a title");
    let (body, end) = rest.rsplit_once("</body>").expect("the end of the body");
    let after = format!(
        r#"<script>
(async () => {{
  const found = await (async () => {{ {script} }})().catch((error) => window.problems.push(`test: ${{error.stack}}`));
  const bytes = new TextEncoder().encode(JSON.stringify({{ found, problems: window.problems }}));
  document.documentElement.dataset.outcome = Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}})();
</script>"#
    );
    let probed = page.with_extension("probed.html");
    fs::write(
        &probed,
        format!("{head}{BEFORE}<title>{body}{after}</body>{end}"),
    )
    .expect("a page");
    let profile = world.path(&format!(
        "profile_{}",
        page.file_stem().expect("a name").display()
    ));
    let mut command = world.command(Path::new("chromium"));
    command
        .args(FLAGS)
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg("--dump-dom")
        .arg(format!("file://{}", probed.display()))
        // Where it keeps what is not in the profile.
        .env("HOME", &profile);
    let started = std::process::Command::new("chromium")
        .arg("--version")
        .output();
    assert!(started.is_ok(), "no chromium; it takes {NEEDS}");
    let dom = world.start("chromium", command).finish().expect(0).stdout;
    let outcome = dom
        .split_once("data-outcome=\"")
        .and_then(|(_, rest)| rest.split_once('"'));
    let (hex, _) = outcome.unwrap_or_else(|| panic!("no outcome in the page: {}", head_of(&dom)));
    let bytes: Vec<u8> = (0..hex.len() / 2)
        .map(|i| u8::from_str_radix(&hex[2 * i..2 * i + 2], 16).expect("hexadecimal digits"))
        .collect();
    let mut outcome: Value = serde_json::from_slice(&bytes).expect("JSON");
    let problems = outcome["problems"].as_array().expect("a list").iter();
    let problems = problems
        .map(|problem| problem.as_str().unwrap_or_default().to_owned())
        .collect();
    (outcome["found"].take(), problems)
}

fn head_of(text: &str) -> String {
    text.chars().take(500).collect()
}
