//! Many systems of the same layout side by side, each in one lane of a vector register. Ensembles are integrated this
//! way.
//!
//! [`fly`] makes the same steps as [`Simulation`](crate::Simulation), with the same operations in the same order, for
//! as many systems at once as a register has lanes. No operation in a lane depends on another lane, and none is fused.
//! The iteration of an implicit equation continues only in the lanes that need it, and lanes in which it does not
//! converge are solved individually. Where the exact rotation has several formulas, each lane takes its own. So the result of a flight is bitwise independent of the width, the instruction set
//! and the neighboring lanes, and equals that of [`Simulation`](crate::Simulation).
//!
//! # Assumptions and limitations
//! Lanes support splitting methods (LGVI, Lie–Euler, compositions, Nyström splittings) with both rotors, point masses and
//! multipoles, attractors with and without second moments, uniform fields, mutual attraction, and bodies that are free,
//! pivoted or fixed. Everything else is [`Unfit`] and requires [`Simulation`](crate::Simulation).

mod body;
mod end;
mod fit;
mod flight;
mod fourth_order;
mod gravity;
mod kernel;
mod multipole;
mod mutual;
mod pair;
mod rescue;

pub use fit::{Unfit, fit};
pub use flight::{Flight, Member, Outcome, Thrust};

#[cfg(target_arch = "x86_64")]
use fearless_simd::f64x2;
use fearless_simd::{Level, Simd, f64x8};

use crate::MethodError;
use flight::Batch;

/// The number of systems integrated side by side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Width {
    /// One system.
    One,
    /// Eight systems: an AVX-512 register, or two AVX2 registers. On x86-64 without AVX2, two at a time.
    #[default]
    Eight,
}

impl Width {
    /// The number of lanes.
    pub fn lanes(self) -> usize {
        match self {
            Self::One => 1,
            Self::Eight => 8,
        }
    }
}

/// The instruction set that a flight may use. It does not affect the results.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Instructions {
    /// The instructions available on every machine.
    Baseline,
    /// AVX2, or the newest instructions of the machine if it has no AVX2.
    Avx2,
    /// The newest instructions of the machine.
    #[default]
    Newest,
}

impl Instructions {
    fn level(self) -> Level {
        let newest = Level::new();
        #[cfg(target_arch = "x86_64")]
        match self {
            Self::Baseline => newest.as_sse2().map_or(newest, Level::Sse2),
            Self::Avx2 => newest.as_avx2().map_or(newest, Level::Avx2),
            Self::Newest => newest,
        }
        #[cfg(not(target_arch = "x86_64"))]
        newest
    }
}

/// Integrates `members` from step 0 and returns their outcomes in the same order.
///
/// # Errors
/// Returns the error of the first member that [`Simulation::new`](crate::Simulation::new) rejects or that lanes cannot
/// integrate.
pub fn fly(
    flight: &Flight,
    members: &[Member],
    width: Width,
    instructions: Instructions,
) -> Result<Vec<Outcome>, FlyError> {
    fly_watched(flight, members, width, instructions, &|_| ())
}

/// Integrates like [`fly`], and passes the number of steps since the last call to `flown` every few hundred steps, summed over
/// the members. Steps after the failure of a member may be counted.
///
/// # Errors
/// Returns those of [`fly`].
pub fn fly_watched(
    flight: &Flight,
    members: &[Member],
    width: Width,
    instructions: Instructions,
    flown: &dyn Fn(u64),
) -> Result<Vec<Outcome>, FlyError> {
    let mut outcomes = Vec::with_capacity(members.len());
    for members in members.chunks(width.lanes()) {
        let batch = Batch::new(flight, members, flown)?;
        let level = instructions.level();
        match width {
            Width::One => kernel::fly::<f64>((), &batch, &mut outcomes),
            Width::Eight => eight(level, &batch, &mut outcomes),
        }
    }
    Ok(outcomes)
}

/// Integrates up to eight systems. Older machines have registers for two of them.
#[cfg(target_arch = "x86_64")]
fn eight(level: Level, batch: &Batch, outcomes: &mut Vec<Outcome>) {
    match level {
        Level::Avx512(simd) => side_by_side(simd, batch, outcomes),
        Level::Avx2(simd) => side_by_side(simd, batch, outcomes),
        older => match older.as_sse2() {
            Some(simd) => batch.parts(2).for_each(|pair| {
                simd.vectorize(
                    #[inline(always)]
                    || kernel::fly::<f64x2<_>>(simd, &pair, outcomes),
                );
            }),
            None => batch
                .parts(1)
                .for_each(|one| kernel::fly::<f64>((), &one, outcomes)),
        },
    }
}

/// Integrates up to eight systems.
#[cfg(not(target_arch = "x86_64"))]
fn eight(level: Level, batch: &Batch, outcomes: &mut Vec<Outcome>) {
    fearless_simd::dispatch!(level, simd => side_by_side(simd, batch, outcomes));
}

fn side_by_side<S: Simd>(simd: S, batch: &Batch, outcomes: &mut Vec<Outcome>) {
    simd.vectorize(
        #[inline(always)]
        || kernel::fly::<f64x8<S>>(simd, batch, outcomes),
    );
}

/// Reasons why a flight cannot be made.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
#[non_exhaustive]
pub enum FlyError {
    /// The input is invalid for any simulation.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// The input is only supported by [`Simulation`](crate::Simulation).
    #[error(transparent)]
    Unfit(#[from] Unfit),
}
