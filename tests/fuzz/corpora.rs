//! Every input of the fuzz targets' corpora, and what chance makes of it, without cargo-fuzz: what was found before is not
//! found again. `LGVI_MUTANTS` sets how many mutants of each input are tried, 8 if not told; they are the same in every run.

#![allow(clippy::panic, clippy::unwrap_used)]

#[path = "src/memory.rs"]
mod memory;
#[path = "src/sample.rs"]
mod sample;
mod seeds;
#[path = "src/targets/mod.rs"]
mod targets;

use std::{
    env, fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus")
}

#[test]
#[ignore = "writes into the repository"]
fn make_seeds() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    seeds::make(&root, &corpus()).unwrap();
}

#[test]
fn all_that_the_repository_ships_is_among_the_seeds() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let made = tempfile::tempdir().unwrap();
    seeds::make(&root, made.path()).unwrap();
    for target in fs::read_dir(made.path()).unwrap() {
        let target = target.unwrap();
        for seed in fs::read_dir(target.path()).unwrap() {
            let seed = seed.unwrap();
            let kept = corpus().join(target.file_name()).join(seed.file_name());
            assert!(
                fs::read(&kept).ok() == fs::read(seed.path()).ok(),
                "{} is missing or outdated: make_seeds writes it",
                kept.display()
            );
        }
    }
}

fn examine_all(target: &str, examine: fn(&[u8]), most_memory: usize) {
    let mutants = env::var("LGVI_MUTANTS").map_or(8, |count| count.parse().unwrap());
    let mut inputs = Vec::new();
    for entry in fs::read_dir(corpus().join(target)).unwrap() {
        let path = entry.unwrap().path();
        inputs.push((fs::read(&path).unwrap(), path));
    }
    assert!(!inputs.is_empty(), "no input for {target}");
    inputs.sort();
    let mut chance = Chance(1);
    for (data, path) in &inputs {
        // Past the capture of the test harness, whose text would be lost if the process were aborted.
        let told = |what: &str| writeln!(io::stdout(), "{}: {what}", path.display());
        told("itself").unwrap();
        memory::watch(most_memory, || examine(data));
        for number in 0..mutants {
            let (other, _) = &inputs[chance.below(inputs.len())];
            let mutant = chance.mutate(data, other);
            told(&format!("mutant {number}")).unwrap();
            memory::watch(most_memory, || examine(&mutant));
        }
    }
}

/// SplitMix64.
struct Chance(u64);

impl Chance {
    fn number(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.number() % end as u64) as usize
    }

    /// Up to four changes: a byte, a number, a part left out, doubled or taken from another input.
    fn mutate(&mut self, data: &[u8], other: &[u8]) -> Vec<u8> {
        let mut mutant = data.to_vec();
        for _ in 0..=self.below(4) {
            if mutant.is_empty() {
                return other.to_vec();
            }
            let at = self.below(mutant.len());
            let length = self.below(16.min(mutant.len() - at)) + 1;
            let part = at..at + length;
            match self.below(6) {
                0 => mutant[at] = self.number() as u8,
                1 => mutant[at] ^= 1 << self.below(8),
                2 => drop(mutant.drain(part)),
                3 => {
                    let copy = mutant[part].to_vec();
                    mutant.splice(at..at, copy);
                }
                4 => mutant[part].fill([0, 0x7f, 0xff, b'9'][self.below(4)]),
                _ if other.is_empty() => {}
                _ => {
                    let from = self.below(other.len());
                    let end = (from + 1 + self.below(64)).min(other.len());
                    mutant.splice(part, other[from..end].iter().copied());
                }
            }
        }
        mutant
    }
}

macro_rules! corpora {
    ($limit:ident: $($target:ident),* $(,)?) => {$(
        #[test]
        fn $target() {
            examine_all(stringify!($target), targets::$target, targets::$limit);
        }
    )*};
}

corpora!(
    MOST_MEMORY: bag_metadata,
    bag_reader,
    bag_records,
    bag_recover,
    tables,
);
corpora!(
    LITTLE_MEMORY: cdr,
    params_file,
    ros_args,
    scene,
);
