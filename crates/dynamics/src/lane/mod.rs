//! Lanes: the values of several systems side by side, of which a single number is the simplest case. The arithmetic
//! shared by [`Simulation`] and [`lanes`](crate::lanes) is written once, generic over a [`Lane`].
//!
//! [`Simulation`]: crate::Simulation

mod linear;

pub(crate) use linear::{Matrix, Vector, attraction};

use std::ops::{Add, Div, Mul, Neg, Sub};

use fearless_simd::prelude::*;
use fearless_simd::{f64x2, f64x8};

/// Evaluates an expression with the instructions of a [`Level`](fearless_simd::Level): on x86-64 with AVX2 or SSE2 only,
/// because each further set is compiled once more.
#[cfg(target_arch = "x86_64")]
macro_rules! vectorize {
    ($level:expr, $simd:ident => $run:expr) => {{
        let level: fearless_simd::Level = $level;
        match (level.as_avx2(), level.as_sse2()) {
            (Some($simd), _) => $simd.vectorize(
                #[inline(always)]
                || $run,
            ),
            (None, Some($simd)) => $simd.vectorize(
                #[inline(always)]
                || $run,
            ),
            (None, None) => unreachable!("every x86-64 processor has SSE2"),
        }
    }};
}

#[cfg(not(target_arch = "x86_64"))]
macro_rules! vectorize {
    ($level:expr, $simd:ident => $run:expr) => {
        fearless_simd::dispatch!($level, $simd => $run)
    };
}

pub(crate) use vectorize;

/// As [`vectorize`], with AVX-512 where there is one, for long loops over eight numbers at once.
#[cfg(target_arch = "x86_64")]
macro_rules! vectorize_wide {
    ($level:expr, $simd:ident => $run:expr) => {{
        let level: fearless_simd::Level = $level;
        match level.as_avx512() {
            Some($simd) => $simd.vectorize(
                #[inline(always)]
                || $run,
            ),
            None => $crate::lane::vectorize!(level, $simd => $run),
        }
    }};
}

#[cfg(not(target_arch = "x86_64"))]
macro_rules! vectorize_wide {
    ($level:expr, $simd:ident => $run:expr) => {
        fearless_simd::dispatch!($level, $simd => $run)
    };
}

pub(crate) use vectorize_wide;

/// Values of several systems, one per lane, with arithmetic on all of them at once.
///
/// Each operation rounds as on a single number, and none is fused. So the result in a lane depends neither on the
/// number of lanes nor on the instruction set.
pub(crate) trait Lane:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<Output = Self>
    + Div<f64, Output = Self>
    + Neg<Output = Self>
{
    /// Proof that the instructions are available.
    type Token: Copy;

    /// Number of lanes.
    const COUNT: usize;

    /// A number in all lanes.
    fn splat(token: Self::Token, number: f64) -> Self;

    /// A number in all lanes, using the token carried by `self`.
    fn constant(self, number: f64) -> Self;

    fn sqrt(self) -> Self;

    fn abs(self) -> Self;

    /// The magnitude of `self` with the sign of `other`.
    fn copysign(self, other: Self) -> Self;

    /// Mask whose bit k is set if `self ≤ other` in lane k.
    fn at_most(self, other: Self) -> u32;

    /// Mask whose bit k is set if `self < other` in lane k.
    fn below(self, other: Self) -> u32;

    /// The values of `self` in `lanes`, and those of `others` elsewhere.
    fn where_in(self, lanes: u32, others: Self) -> Self;

    /// Evaluates `run`, which must be inlined, with the instructions of these lanes, in a function of its own that is
    /// not.
    fn vectorize<R>(self, run: impl FnOnce() -> R) -> R;

    /// The value in lane k.
    fn lane(&self, k: usize) -> f64;

    /// Sets the value in lane k.
    fn set_lane(&mut self, k: usize, number: f64);
}

impl Lane for f64 {
    type Token = ();

    const COUNT: usize = 1;

    #[inline(always)]
    fn splat((): (), number: f64) -> Self {
        number
    }

    #[inline(always)]
    fn constant(self, number: f64) -> Self {
        number
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }

    #[inline(always)]
    fn copysign(self, other: Self) -> Self {
        f64::copysign(self, other)
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> u32 {
        u32::from(self <= other)
    }

    #[inline(always)]
    fn below(self, other: Self) -> u32 {
        u32::from(self < other)
    }

    #[inline(always)]
    fn where_in(self, lanes: u32, others: Self) -> Self {
        if lanes & 1 == 1 { self } else { others }
    }

    #[inline(always)]
    fn vectorize<R>(self, run: impl FnOnce() -> R) -> R {
        run()
    }

    #[inline(always)]
    fn lane(&self, _k: usize) -> f64 {
        *self
    }

    #[inline(always)]
    fn set_lane(&mut self, _k: usize, number: f64) {
        *self = number;
    }
}

macro_rules! vector_lane {
    ($vector:ident, $count:literal) => {
        impl<S: Simd> Lane for $vector<S> {
            type Token = S;

            const COUNT: usize = $count;

            #[inline(always)]
            fn splat(token: S, number: f64) -> Self {
                <Self as SimdBase<S>>::splat(token, number)
            }

            #[inline(always)]
            fn constant(self, number: f64) -> Self {
                <Self as SimdBase<S>>::splat(self.simd, number)
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                SimdFloat::sqrt(self)
            }

            #[inline(always)]
            fn abs(self) -> Self {
                SimdBase::abs(self)
            }

            #[inline(always)]
            fn copysign(self, other: Self) -> Self {
                SimdFloat::copysign(self, other)
            }

            #[inline(always)]
            fn at_most(self, other: Self) -> u32 {
                self.simd_le(other).to_bitmask() as u32
            }

            #[inline(always)]
            fn below(self, other: Self) -> u32 {
                self.simd_lt(other).to_bitmask() as u32
            }

            #[inline(always)]
            fn where_in(self, lanes: u32, others: Self) -> Self {
                let mask = <Self as SimdBase<S>>::Mask::from_bitmask(self.simd, lanes.into());
                mask.select(self, others)
            }

            #[inline(always)]
            fn vectorize<R>(self, run: impl FnOnce() -> R) -> R {
                self.simd.vectorize(run)
            }

            #[inline(always)]
            fn lane(&self, k: usize) -> f64 {
                self[k]
            }

            #[inline(always)]
            fn set_lane(&mut self, k: usize, number: f64) {
                self[k] = number;
            }
        }
    };
}

vector_lane!(f64x2, 2);
vector_lane!(f64x8, 8);
