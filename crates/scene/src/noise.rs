//! Random sequences of which any element can be computed at any time, with the same bits in any order.

use nalgebra::Vector3;
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

use crate::disturbance::normals;

/// Random numbers of an element of a [`Stream`].
const DRAWS: u128 = 4;

/// `2⁶⁴` divided by the golden ratio, odd.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Returns a seed that depends on every bit of another one and of a number: the finalizer of SplitMix64 (Steele, Lea and
/// Flood 2014).
pub(crate) fn seed(seed: u64, number: u64) -> u64 {
    let mut z = seed.wrapping_add(number.wrapping_mul(GOLDEN));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A sequence of independent vectors of three standard normal numbers.
#[derive(Clone, Debug)]
pub struct Stream(Pcg64Mcg);

impl Stream {
    /// Creates the sequence of a seed and a number. Sequences that differ in either are independent.
    pub fn new(seed: u64, number: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(self::seed(seed, number)))
    }

    /// Returns element `k`. Takes a time that grows with the logarithm of `k`.
    pub fn at(&self, k: u64) -> Vector3<f64> {
        let mut rng = self.0.clone();
        rng.advance(u128::from(k) * DRAWS);
        normals(&mut rng)
    }
}

/// A Gaussian Markov process at equal intervals, three independent components each.
///
/// Element `k` is drawn between its neighbors on the grid of the powers of two, given their values (Lévy's construction of
/// Brownian motion). So it takes a number of draws that grows with the logarithm of `k`, and two on average if the
/// elements are asked for in order.
#[derive(Clone, Debug)]
pub struct Process {
    law: Law,
    stream: Stream,
    /// Nested intervals, of which the last one contains the last element.
    path: Vec<Interval>,
}

#[derive(Clone, Copy, Debug)]
enum Law {
    /// Standard deviation, and intervals in a correlation time.
    Markov { deviation: f64, correlation: f64 },
    /// Standard deviation of the change in an interval.
    Walk { deviation: f64 },
}

#[derive(Clone, Copy, Debug)]
struct Interval {
    ends: [u64; 2],
    values: [Vector3<f64>; 2],
}

impl Process {
    /// Creates a stationary first-order Gauss–Markov process: `E[x_i x_k] = σ² exp(−|i − k|/τ)`, with the standard
    /// deviation `σ` and the correlation time `τ` in intervals.
    pub fn gauss_markov(deviation: f64, correlation: f64, stream: Stream) -> Self {
        Self::new(
            Law::Markov {
                deviation,
                correlation,
            },
            stream,
        )
    }

    /// Creates a random walk from 0, with the standard deviation of its change in an interval.
    pub fn random_walk(deviation: f64, stream: Stream) -> Self {
        Self::new(Law::Walk { deviation }, stream)
    }

    fn new(law: Law, stream: Stream) -> Self {
        Self {
            law,
            stream,
            path: Vec::new(),
        }
    }

    /// Returns element `k`.
    pub fn at(&mut self, k: u64) -> Vector3<f64> {
        let outside = |interval: &Interval| !(interval.ends[0]..=interval.ends[1]).contains(&k);
        while self.path.last().is_some_and(outside) {
            self.path.pop();
        }
        let mut interval = match self.path.last() {
            Some(interval) => *interval,
            None => self.first(k),
        };
        loop {
            let Interval {
                ends: [start, end],
                values: [at_start, at_end],
            } = interval;
            if k == start {
                return at_start;
            }
            if k == end {
                return at_end;
            }
            let half = (end - start) / 2;
            let middle = start + half;
            let [weight, deviation] = self.law.between(half as f64);
            let value = weight * (at_start + at_end) + deviation * self.stream.at(middle);
            interval = if k < middle {
                Interval {
                    ends: [start, middle],
                    values: [at_start, value],
                }
            } else {
                Interval {
                    ends: [middle, end],
                    values: [value, at_end],
                }
            };
            self.path.push(interval);
        }
    }

    /// Begins the path to `k` by the interval between two powers of two, or the one from 0 to 1.
    fn first(&mut self, k: u64) -> Interval {
        let start = self.law.start() * self.stream.at(0);
        let mut interval = Interval {
            ends: [0, 1],
            values: [start, self.after(&start, 1, 1)],
        };
        while interval.ends[1] < k {
            let (end, value) = (interval.ends[1], interval.values[1]);
            let next = end.saturating_mul(2);
            interval = Interval {
                ends: [end, next],
                values: [value, self.after(&value, next - end, next)],
            };
        }
        self.path.push(interval);
        interval
    }

    /// Draws element `k`, which is `distance` after one that has a value.
    fn after(&self, value: &Vector3<f64>, distance: u64, k: u64) -> Vector3<f64> {
        let [weight, deviation] = self.law.after(distance as f64);
        weight * value + deviation * self.stream.at(k)
    }
}

impl Law {
    /// Standard deviation at element 0.
    fn start(self) -> f64 {
        match self {
            Self::Markov { deviation, .. } => deviation,
            Self::Walk { .. } => 0.0,
        }
    }

    /// Weight of the value before, and standard deviation about its product with it: for the Gauss–Markov process
    /// `ρ = exp(−d/τ)` and `σ √(1 − ρ²)`.
    fn after(self, distance: f64) -> [f64; 2] {
        match self {
            Self::Markov {
                deviation,
                correlation,
            } => {
                let (weight, rest) = decay(distance / correlation);
                [weight, deviation * rest.sqrt()]
            }
            Self::Walk { deviation } => [1.0, deviation * distance.sqrt()],
        }
    }

    /// Weight of the sum of the values at the same distance before and after, and standard deviation about it: for the
    /// Gauss–Markov process `ρ/(1 + ρ²)` and `σ √((1 − ρ²)/(1 + ρ²))`.
    fn between(self, distance: f64) -> [f64; 2] {
        match self {
            Self::Markov {
                deviation,
                correlation,
            } => {
                let (weight, rest) = decay(distance / correlation);
                let sum = 1.0 + weight * weight;
                [weight / sum, deviation * (rest / sum).sqrt()]
            }
            Self::Walk { deviation } => [0.5, deviation * (0.5 * distance).sqrt()],
        }
    }
}

/// `ρ = exp(−x)` and `1 − ρ²`.
fn decay(x: f64) -> (f64, f64) {
    (libm::exp(-x), -libm::expm1(-2.0 * x))
}

#[cfg(test)]
mod tests;
