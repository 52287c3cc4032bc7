use lgvi_dynamics::{BodyState, Load};
use lgvi_scene::{Ensemble, Scene, Scheme};
use sha2::{Digest, Sha256};

use crate::{Command, Guidance, part};

/// Identity of an ensemble. Samples with equal identity belong together, whoever flew them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// SHA-256 of everything that determines a sample: scene, seed, integrator, commands and version of the program.
    pub hash: String,
    /// Name of the scene.
    pub scene: String,
    /// Seed of the samples.
    pub seed: u64,
    /// Total number of samples.
    pub samples: u64,
    /// The integrator with its substeps.
    pub scheme: String,
    /// Version of the program.
    pub version: String,
    /// Number of samples in a part. Parts begin and end at its multiples.
    pub part: u64,
}

impl Identity {
    pub(crate) fn of(
        scene: &Scene,
        ensemble: &Ensemble,
        scheme: Scheme,
        guidance: &Guidance,
        steps: u64,
    ) -> Self {
        let version = env!("CARGO_PKG_VERSION");
        let mut hash = Sha256::new();
        let mut add = |bytes: &[u8]| {
            hash.update((bytes.len() as u64).to_le_bytes());
            hash.update(bytes);
        };
        add(b"lgvi ensemble, format 4");
        add(version.as_bytes());
        add(scene.text.as_bytes());
        add(&ensemble.seed.to_le_bytes());
        add(format!("{:?}, {}", scheme.method, scheme.substeps).as_bytes());
        add(guidance.name().as_bytes());
        if let (Some(maneuver), Some(steps)) = (&scene.maneuver, guidance.steps()) {
            // The commands in the nominal state identify the plan.
            let state: &BodyState = &scene.bodies[maneuver.body].state;
            for step in 0..steps {
                let mut each = |numbers: &[f64]| {
                    let numbers = numbers.iter();
                    numbers.for_each(|number| add(&number.to_le_bytes()));
                };
                match guidance.at(step, state) {
                    Some(Command::Load(Load { force, moment })) => {
                        each(force.as_slice());
                        each(moment.as_slice());
                    }
                    Some(Command::Efforts(efforts)) => each(&efforts),
                    None => {}
                }
            }
        }
        let each = steps.saturating_mul(u64::from(scheme.substeps.max(1)));
        Self {
            hash: part::hexadecimal(&hash.finalize()),
            scene: scene.name.clone(),
            seed: ensemble.seed,
            samples: ensemble.samples,
            scheme: scheme.to_string(),
            version: version.into(),
            part: part::size(each.saturating_mul(scene.bodies.len() as u64)),
        }
    }
}
