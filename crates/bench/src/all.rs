//! All benchmarks one after the other, and what they show put into the documentation.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use crate::contents::Contents;
use crate::error::BenchError;
use crate::peer::{CASADI, HEYOKA, INTEGRATORS, Peer, Python, REBOUND, missing};
use crate::precision::Lost;
use crate::{
    auto, bag, bodies, cost, dumbbells, ensemble, feedback, free, laziness, maneuvers, planner,
    polyhedra, precision, recording, skip, stress, tables, transport,
};

/// What is run.
#[derive(Args)]
pub(crate) struct Options {
    /// Only some seconds of what needs no other process.
    #[arg(long, conflicts_with = "docs")]
    quick: bool,
    /// Only these parts.
    #[arg(long, value_delimiter = ',')]
    only: Vec<Part>,
    /// The directory of the documentation, whose tables and pictures are replaced by those of this run. A part that lacks
    /// a peer replaces none.
    #[arg(long)]
    docs: Option<PathBuf>,
    /// Parts that lack a peer replace theirs, too.
    #[arg(long, requires = "docs")]
    without_peers: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    Precision,
    Free,
    Step,
    Auto,
    Dumbbells,
    Bodies,
    Polyhedra,
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

/// Random maneuvers, and the seeds of which the documentation speaks.
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
    let pages = options.docs.as_deref().map(tables::pages).transpose()?;
    let asked = |part: &&Part| options.only.is_empty() || options.only.contains(part);
    let parts: Vec<_> = Part::value_variants().iter().filter(asked).collect();
    let peers = INTEGRATORS.into_iter().chain([CASADI]);
    let used = |peer: &Peer| parts.iter().any(|part| part.uses(*peer));
    let peers: Vec<_> = peers.filter(used).collect();
    let missing = missing(python.filter(|_| !options.quick), &peers);
    let (mut left_out, mut failed) = (Vec::new(), Vec::new());
    left_out.extend(missing.iter().map(|peer| format!("the peer {}", peer.name)));
    let mut kept = BTreeSet::new();
    for (index, part) in parts.iter().enumerate() {
        let name = part.name();
        println!("\n== {name} ({} of {})", index + 1, parts.len());
        let before = Contents::of(directory)?;
        let ran = match options.quick {
            true => part.run_quick(directory),
            false => part.run(python, repeats, directory).map(Some),
        };
        let mut new = Contents::of(directory)?.since(&before);
        match ran {
            Ok(None) => left_out.push(format!("{name}: not in a quick run")),
            Ok(Some(lost)) => {
                for lost in lost {
                    // what lacks a peer that failed is not for the documentation
                    new.retain(|path| !lost.belongs(path));
                    failed.push(format!("{} ({})", lost.method, lost.table));
                    left_out.push(lost.to_string());
                }
            }
            Err(error) => {
                left_out.push(format!("{name}: {error}"));
                failed.push(name.clone());
            }
        }
        if !options.without_peers && missing.iter().any(|peer| part.uses(*peer)) {
            new.clear();
            if options.docs.is_some() {
                left_out.push(format!("{name} in the documentation, for want of peers"));
            }
        }
        kept.extend(new);
    }
    if let (Some(docs), Some(pages)) = (&options.docs, &pages) {
        match publish(directory, &kept, docs, pages) {
            Ok(left) => left_out.extend(left),
            Err(error) => failed.push(format!("{}: {error}", docs.display())),
        }
    }
    for left_out in left_out {
        println!("left out: {left_out}");
    }
    match failed.is_empty() {
        true => Ok(()),
        false => Err(BenchError::Failed(failed)),
    }
}

/// Puts tables and pictures into the pages of `docs`; names what is left as it was.
fn publish(
    directory: &Path,
    kept: &BTreeSet<PathBuf>,
    docs: &Path,
    pages: &[PathBuf],
) -> Result<Vec<String>, BenchError> {
    let published = tables::publish(directory, kept, pages)?;
    let docs = docs.display();
    println!("{} tables and pictures in {docs}", published.taken);
    let left = published.left.into_iter();
    Ok(left
        .map(|name| format!("table {name} of {docs}, which stays"))
        .collect())
}

impl Part {
    fn name(self) -> String {
        let value = self.to_possible_value();
        value.map_or_else(String::new, |value| value.get_name().into())
    }

    /// Whether it compares with the peer.
    fn uses(self, peer: Peer) -> bool {
        let peers: &[Peer] = match self {
            Self::Precision => &INTEGRATORS,
            Self::Free => &[HEYOKA],
            Self::Bodies => &[REBOUND],
            Self::Planner => &[CASADI],
            _ => &[],
        };
        peers.contains(&peer)
    }

    fn run(
        self,
        python: Option<&Python>,
        repeats: u32,
        directory: &Path,
    ) -> Result<Vec<Lost>, BenchError> {
        match self {
            Self::Precision => {
                let options = precision::Options::all(false);
                return precision::run(&options, python, repeats, directory);
            }
            Self::Free => free::run(python, repeats, directory),
            Self::Step => cost::run(repeats, directory),
            Self::Auto => auto::scenes(repeats, directory),
            Self::Dumbbells => dumbbells::run(repeats, directory),
            Self::Bodies => bodies::run(false, python, repeats, directory),
            Self::Polyhedra => polyhedra::run(repeats, directory),
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
        .map(|()| Vec::new())
    }

    /// None where there is no quick run of it.
    fn run_quick(self, directory: &Path) -> Result<Option<Vec<Lost>>, BenchError> {
        match self {
            Self::Precision => {
                let options = precision::Options::all(true);
                return precision::run(&options, None, 1, directory).map(Some);
            }
            Self::Free => free::run(None, 1, directory)?,
            Self::Bodies => bodies::run(true, None, 1, directory)?,
            Self::Planner => planner::run(&planner::Options::all(true), None, 1, directory)?,
            Self::Maneuvers => maneuvers::run(2, &SEEDS, directory)?,
            Self::Feedback => feedback::run(2, 40, directory)?,
            _ => return Ok(None),
        }
        Ok(Some(Vec::new()))
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use clap::Parser;

    use super::{Options, Part, publish, run};
    use crate::contents::Contents;
    use crate::tables::{Table, pages};

    #[derive(Parser)]
    struct Arguments {
        #[command(flatten)]
        options: Options,
    }

    fn page(tables: &[&str]) -> String {
        let tables = tables.iter();
        tables
            .map(|name| format!("<!-- bench: {name} -->\nold {name}\n<!-- /bench -->\n"))
            .collect()
    }

    #[test]
    fn a_quick_run_leaves_figures_tables_and_pictures_that_fill_a_page() {
        let folder = tempfile::tempdir().unwrap();
        let (output, docs) = (folder.path().join("output"), folder.path().join("docs"));
        std::fs::create_dir_all(docs.join("images")).unwrap();
        std::fs::write(docs.join("page.md"), page(&["bodies"])).unwrap();
        let options = Options {
            quick: true,
            only: Vec::new(),
            docs: None,
            without_peers: false,
        };
        run(&options, None, 1, &output).unwrap();
        let quick = output.join("quick");
        let text = std::fs::read_to_string(quick.join("precision_g_kepler.json")).unwrap();
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
            assert!(quick.join(name).exists(), "{name}");
        }
        let kept = Contents::of(&quick).unwrap().since(&Contents::default());
        let left = publish(&quick, &kept, &docs, &pages(&docs).unwrap()).unwrap();
        assert_eq!(left, Vec::<String>::new());
        let new = std::fs::read_to_string(docs.join("page.md")).unwrap();
        assert!(new.contains("\n| 4 | "), "{new}");
        assert!(docs.join("images/bodies.svg").exists());
    }

    #[test]
    fn a_quick_run_does_not_go_into_the_documentation() {
        let parse = |more: &[&str]| {
            Arguments::try_parse_from(["all", "--quick"].iter().chain(more))
                .map(|parsed| parsed.options.quick)
        };
        assert!(parse(&[]).unwrap());
        let error = parse(&["--docs", "docs"]).unwrap_err();
        assert_eq!(error.kind(), clap::error::ErrorKind::ArgumentConflict);
    }

    /// An output directory with tables of an earlier run, and a page with them.
    fn earlier(tables: &[&str]) -> (tempfile::TempDir, PathBuf, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let (output, docs) = (folder.path().join("output"), folder.path().join("docs"));
        std::fs::create_dir(&docs).unwrap();
        std::fs::write(docs.join("page.md"), page(tables)).unwrap();
        for name in tables {
            Table::new(["stale"]).keep(&output, name).unwrap();
        }
        (folder, output, docs)
    }

    fn options(part: Part, docs: PathBuf, without_peers: bool) -> Options {
        Options {
            quick: false,
            only: vec![part],
            docs: Some(docs),
            without_peers,
        }
    }

    #[test]
    fn tables_that_lack_peers_and_those_of_an_earlier_run_stay_out_of_the_pages() {
        let (_folder, output, docs) = earlier(&["free", "step"]);
        let text = || std::fs::read_to_string(docs.join("page.md")).unwrap();
        run(&options(Part::Free, docs.clone(), false), None, 1, &output).unwrap();
        assert_eq!(text(), page(&["free", "step"]));
        run(&options(Part::Free, docs.clone(), true), None, 1, &output).unwrap();
        assert!(text().contains("closed form"), "{}", text());
        assert!(text().ends_with(&page(&["step"])), "{}", text());
    }

    #[test]
    fn pages_that_cannot_be_filled_are_refused_before_anything_is_measured() {
        let (_folder, output, docs) = earlier(&[]);
        std::fs::write(docs.join("page.md"), "<!-- bench: free -->\n").unwrap();
        let refused = run(&options(Part::Free, docs.clone(), true), None, 1, &output);
        let error = refused.unwrap_err().to_string();
        assert!(error.ends_with("a marker without its end"), "{error}");
        std::fs::write(docs.join("page.md"), "![x](images/x.svg)").unwrap();
        assert!(run(&options(Part::Free, docs.clone(), true), None, 1, &output).is_err());
        let nowhere = options(Part::Free, docs.join("nowhere"), true);
        assert!(run(&nowhere, None, 1, &output).is_err());
        assert!(!output.exists());
    }
}
