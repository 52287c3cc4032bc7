//! All benchmarks one after the other, and what they show put into the documentation.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use crate::error::BenchError;
use crate::peer::{CASADI, INTEGRATORS, Python, missing};
use crate::{
    auto, bag, bodies, cost, dumbbells, ensemble, feedback, free, laziness, maneuvers, planner,
    precision, recording, skip, stress, tables, transport,
};

/// What is run.
#[derive(Args)]
pub(crate) struct Options {
    /// Only some seconds of what needs no other process.
    #[arg(long)]
    quick: bool,
    /// Only these parts.
    #[arg(long, value_delimiter = ',')]
    only: Vec<Part>,
    /// The directory of the documentation, whose tables and pictures are replaced by what lies in the output directory,
    /// of this run and of earlier ones.
    #[arg(long)]
    docs: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    Precision,
    Free,
    Step,
    Auto,
    Dumbbells,
    Bodies,
    Skip,
    Ensemble,
    Planner,
    Maneuvers,
    Feedback,
    Bag,
    Transport,
    Recording,
    Laziness,
    Stress,
}

/// Random manoeuvres, and the seeds of which the documentation speaks.
const MANEUVERS: u64 = 1000;
const SEEDS: [u64; 2] = [1, 2];

/// Flights of the parts that measure whole nodes (s).
const FLIGHT: f64 = 10.0;

/// Runs the parts; one that fails is named in the end and does not keep the others from running.
pub(crate) fn run(
    options: &Options,
    python: Option<&Python>,
    repeats: u32,
    directory: &Path,
) -> Result<(), BenchError> {
    // what a quick run leaves is not taken for the figures of a whole one
    let quick = directory.join("quick");
    let directory = if options.quick {
        quick.as_path()
    } else {
        directory
    };
    let asked = |part: &&Part| options.only.is_empty() || options.only.contains(part);
    let parts: Vec<_> = Part::value_variants().iter().filter(asked).collect();
    let mut left_out = Vec::new();
    let mut failed = Vec::new();
    for (index, part) in parts.iter().enumerate() {
        println!("\n== {} ({} of {})", part.name(), index + 1, parts.len());
        let ran = match options.quick {
            true => part.run_quick(directory),
            false => part.run(python, repeats, directory).map(|()| true),
        };
        match ran {
            Ok(true) => {}
            Ok(false) => left_out.push(format!("{}: not in a quick run", part.name())),
            Err(error) => failed.push(format!("{}: {error}", part.name())),
        }
    }
    let peers: Vec<_> = INTEGRATORS.into_iter().chain([CASADI]).collect();
    let missing = missing(python.filter(|_| !options.quick), &peers);
    left_out.extend(missing.iter().map(|peer| format!("the peer {peer}")));
    if let Some(docs) = &options.docs {
        publish(directory, docs, &mut left_out)?;
    }
    for left_out in left_out {
        println!("left out: {left_out}");
    }
    match failed.is_empty() {
        true => Ok(()),
        false => Err(BenchError::Body(failed.join("\n"))),
    }
}

/// Puts tables and pictures into the pages in `docs`.
fn publish(directory: &Path, docs: &Path, left_out: &mut Vec<String>) -> Result<(), BenchError> {
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
    let published = tables::publish(directory, &pages)?;
    println!(
        "{} tables and pictures in {}",
        published.taken,
        docs.display()
    );
    let left = published.left.iter();
    left_out.extend(left.map(|name| format!("table {name} of {}, which stays", docs.display())));
    Ok(())
}

impl Part {
    fn name(self) -> String {
        let value = self.to_possible_value();
        value.map_or_else(String::new, |value| value.get_name().into())
    }

    fn run(
        self,
        python: Option<&Python>,
        repeats: u32,
        directory: &Path,
    ) -> Result<(), BenchError> {
        match self {
            Self::Precision => {
                precision::run(&precision::Options::all(false), python, repeats, directory)
            }
            Self::Free => free::run(python, repeats, directory),
            Self::Step => cost::run(repeats, directory),
            Self::Auto => auto::scenes(repeats, directory),
            Self::Dumbbells => dumbbells::run(repeats, directory),
            Self::Bodies => bodies::run(false, python, repeats, directory),
            Self::Skip => skip::run(None, repeats, directory),
            Self::Ensemble => ensemble::run(&ensemble::Options::default(), repeats, directory),
            Self::Planner => {
                planner::run(&planner::Options::all(false), python, repeats, directory)
            }
            Self::Maneuvers => maneuvers::run(MANEUVERS, &SEEDS, directory),
            Self::Feedback => feedback::run(200, 200, directory),
            Self::Bag => bag::run(repeats, directory),
            Self::Transport => transport::run(&transport::Options::default(), directory),
            Self::Recording => recording::run(&recording::Options::of(FLIGHT), directory),
            Self::Laziness => laziness::run(&laziness::Options::of(FLIGHT), directory),
            // What is not as it should be stands in the tables.
            Self::Stress => stress::run(None, directory).map(drop),
        }
    }

    /// Whether there is a quick run of it.
    fn run_quick(self, directory: &Path) -> Result<bool, BenchError> {
        match self {
            Self::Precision => precision::run(&precision::Options::all(true), None, 1, directory)?,
            Self::Free => free::run(None, 1, directory)?,
            Self::Bodies => bodies::run(true, None, 1, directory)?,
            Self::Planner => planner::run(&planner::Options::all(true), None, 1, directory)?,
            Self::Maneuvers => maneuvers::run(2, &SEEDS, directory)?,
            Self::Feedback => feedback::run(2, 40, directory)?,
            _ => return Ok(false),
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::{Options, run};

    #[test]
    fn a_quick_run_leaves_figures_tables_and_pictures_and_fills_a_page() {
        let folder = tempfile::tempdir().unwrap();
        let (output, docs) = (folder.path().join("output"), folder.path().join("docs"));
        std::fs::create_dir_all(docs.join("images")).unwrap();
        let page = docs.join("page.md");
        let old = "<!-- bench: bodies -->\nold\n<!-- /bench -->\n";
        std::fs::write(&page, old).unwrap();
        let options = Options {
            quick: true,
            only: Vec::new(),
            docs: Some(docs.clone()),
        };
        run(&options, None, 1, &output).unwrap();
        let text = std::fs::read_to_string(output.join("quick/precision_g_kepler.json")).unwrap();
        let report: serde_json::Value = serde_json::from_str(&text).unwrap();
        let methods = report["methods"].as_array().unwrap();
        assert!(methods.len() > 20, "{} methods", methods.len());
        for method in methods {
            for point in method["points"].as_array().unwrap() {
                assert_eq!(point["seconds"].as_array().unwrap().len(), 1, "{method}");
                assert!(point["errors"][0]["energy"].is_number(), "{method}");
            }
        }
        for name in [
            "precision_e_kw4_like.svg",
            "precision_e_kw4_like_energy.svg",
        ] {
            assert!(output.join("quick").join(name).exists(), "{name}");
        }
        let new = std::fs::read_to_string(page).unwrap();
        assert!(new.contains("\n| 4 | "), "{new}");
        assert!(docs.join("images/bodies.svg").exists());
    }
}
