//! Many systems of one layout side by side, a lane of a vector register each: what an ensemble is flown by.
//!
//! [`fly`] makes the steps that [`Simulation`](crate::Simulation) makes, by the same operations in the same order, for as
//! many systems at once as a register has lanes. No operation of one lane depends on another, none is fused, an implicit
//! equation is repeated in the lanes that need it, and where that does not solve it a lane is solved by itself: so the end of a flight is the same number for
//! number whatever the width, the instructions and the neighbors, and that of [`Simulation`](crate::Simulation).
//!
//! # Assumptions and limitations
//! Lanes know the methods of kicks and drifts with the discrete rotor (LGVI, Lie–Euler,
//! compositions), points of mass, attractors with and without second moments, uniform fields, mutual attraction, and bodies
//! that are free, pivoted or fixed; everything else is [`Unfit`] and for [`Simulation`](crate::Simulation).

mod body;
mod carry;
mod end;
mod fit;
mod flight;
mod gravity;
mod kernel;
mod mutual;
mod rescue;

pub use fit::{Unfit, fit};
pub use flight::{Flight, Member, Outcome, Thrust};

use fearless_simd::{Level, Simd, dispatch, f64x4, f64x8};

use crate::MethodError;
use flight::Batch;

/// How many systems fly side by side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Width {
    /// One.
    One,
    /// Four: a register of AVX2.
    Four,
    /// Eight: a register of AVX-512, or two of AVX2.
    #[default]
    Eight,
}

impl Width {
    /// Their number.
    pub fn lanes(self) -> usize {
        match self {
            Self::One => 1,
            Self::Four => 4,
            Self::Eight => 8,
        }
    }
}

/// The instructions that a flight may use. The results are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Instructions {
    /// Those that every machine has.
    Baseline,
    /// AVX2 where there is none newer that is asked for, or less where there is no AVX2.
    Avx2,
    /// The newest that the machine has.
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

/// Flies `members` from step 0; their ends in the same order.
///
/// # Errors
/// What [`Simulation::new`](crate::Simulation::new) refuses, of the first member that has it; what lanes cannot fly.
pub fn fly(
    flight: &Flight,
    members: &[Member],
    width: Width,
    instructions: Instructions,
) -> Result<Vec<Outcome>, FlyError> {
    let mut outcomes = Vec::with_capacity(members.len());
    for members in members.chunks(width.lanes()) {
        let batch = Batch::new(flight, members)?;
        let level = instructions.level();
        match width {
            Width::One => kernel::fly::<f64>((), &batch, &mut outcomes),
            Width::Four => dispatch!(level, simd => four(simd, &batch, &mut outcomes)),
            Width::Eight => dispatch!(level, simd => eight(simd, &batch, &mut outcomes)),
        }
    }
    Ok(outcomes)
}

#[inline(always)]
fn four<S: Simd>(simd: S, batch: &Batch, outcomes: &mut Vec<Outcome>) {
    kernel::fly::<f64x4<S>>(simd, batch, outcomes);
}

#[inline(always)]
fn eight<S: Simd>(simd: S, batch: &Batch, outcomes: &mut Vec<Outcome>) {
    kernel::fly::<f64x8<S>>(simd, batch, outcomes);
}

/// Why lanes do not fly.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum FlyError {
    /// What no simulation flies.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// What only [`Simulation`](crate::Simulation) flies.
    #[error(transparent)]
    Unfit(#[from] Unfit),
}
