//! Growth in time.

use crate::bodies::keep;

/// The exponent a of `value ∝ time^a` that fits best: the slope of logarithms by least squares.
pub(crate) fn exponent(points: &[[f64; 2]]) -> f64 {
    let logs = || points.iter().map(|point| point.map(libm::log));
    let count = points.len() as f64;
    let mean = logs().fold([0.0; 2], |sum, [x, y]| {
        [sum[0] + x / count, sum[1] + y / count]
    });
    let (mut covariance, mut variance) = (0.0, 0.0);
    for [x, y] in logs() {
        covariance += (x - mean[0]) * (y - mean[1]);
        variance += (x - mean[0]) * (x - mean[0]);
    }
    covariance / variance
}

/// The mean of samples of a quasi-periodic motion. Weighted by `exp(−1/(s(1 − s)))` over the time s from 0 to 1, it is that of
/// infinite time but for a rest that falls faster than any power of their number (the weighted Birkhoff average).
struct Mean {
    count: u64,
    taken: u64,
    weight: f64,
    sum: f64,
}

impl Mean {
    fn of(count: u64) -> Self {
        Self {
            count,
            taken: 0,
            weight: 0.0,
            sum: 0.0,
        }
    }

    fn add(&mut self, value: f64) {
        let s = (self.taken as f64 + 0.5) / self.count as f64;
        let weight = libm::exp(-1.0 / (s * (1.0 - s)));
        self.weight += weight;
        self.sum += weight * value;
        self.taken += 1;
    }

    fn value(&self) -> f64 {
        self.sum / self.weight
    }
}

/// What becomes of an oscillation over a time: its size, and how far its mean moves.
pub(crate) struct Drift {
    /// Means of the four quarters of the time.
    means: [f64; 4],
    /// Greatest sizes in them.
    greatest: [f64; 4],
}

impl Drift {
    /// Of four times `quarter` samples, one after the other, of several oscillations.
    pub(crate) fn of<const N: usize, E>(
        quarter: u64,
        mut sample: impl FnMut() -> Result<[f64; N], E>,
    ) -> Result<[Self; N], E> {
        let mut drifts = [const {
            Self {
                means: [0.0; 4],
                greatest: [0.0; 4],
            }
        }; N];
        for n in 0..4 {
            let mut means = std::array::from_fn::<_, N, _>(|_| Mean::of(quarter));
            for _ in 0..quarter {
                let values = sample()?;
                for ((drift, mean), value) in drifts.iter_mut().zip(&mut means).zip(values) {
                    mean.add(value);
                    keep(&mut drift.greatest[n], value.abs());
                }
            }
            for (drift, mean) in drifts.iter_mut().zip(means) {
                drift.means[n] = mean.value();
            }
        }
        Ok(drifts)
    }

    /// By how much a linear drift moves it over the whole time: from the middle of the first quarter to that of the last
    /// are three of them.
    pub(crate) fn secular(&self) -> f64 {
        (self.means[3] - self.means[0]).abs() * 4.0 / 3.0
    }

    pub(crate) fn greatest(&self) -> f64 {
        let mut greatest = 0.0;
        for value in self.greatest {
            keep(&mut greatest, value);
        }
        greatest
    }

    /// The greatest size in the last quarter to that in the first.
    pub(crate) fn last_to_first(&self) -> f64 {
        self.greatest[3] / self.greatest[0]
    }
}

/// Root mean squares over an ensemble, at several times.
pub(crate) struct Spread {
    times: Vec<f64>,
    squares: Vec<f64>,
    members: u32,
}

impl Spread {
    /// At a number of times, each the double of the one before.
    pub(crate) fn doubling(last: u64, count: u32) -> Self {
        let times: Vec<_> = (0..count).rev().map(|n| (last >> n) as f64).collect();
        Self {
            squares: vec![0.0; times.len()],
            times,
            members: 0,
        }
    }

    pub(crate) fn times(&self) -> impl Iterator<Item = u64> + use<> {
        self.times.clone().into_iter().map(|time| time as u64)
    }

    /// Adds a member's deviations, one a time.
    pub(crate) fn add(&mut self, deviations: &[f64]) {
        for (square, deviation) in self.squares.iter_mut().zip(deviations) {
            *square += deviation * deviation;
        }
        self.members += 1;
    }

    pub(crate) fn last(&self) -> f64 {
        let square = self.squares.last().copied().unwrap_or(f64::NAN);
        (square / f64::from(self.members)).sqrt()
    }

    pub(crate) fn exponent(&self) -> f64 {
        let points = self.times.iter().zip(&self.squares);
        let points: Vec<_> = points
            .map(|(&time, square)| [time, square.sqrt()])
            .collect();
        exponent(&points)
    }
}

#[cfg(test)]
mod tests {
    use lgvi_truth::random::Random;

    use super::*;

    #[test]
    fn powers_have_their_exponents() {
        for power in [0.0, 0.5, 2.0] {
            let points: Vec<_> = (1..9)
                .map(|n| [f64::from(n), 3.0 * f64::from(n).powf(power)])
                .collect();
            assert!((exponent(&points) - power).abs() < 1e-12);
        }
    }

    /// An oscillation of size 1 whose frequency and overtones are those of no whole number of samples.
    fn oscillation(n: u64, drift: f64, count: u64) -> f64 {
        let phase = 0.7 * n as f64;
        let wave = libm::cos(phase) + 0.3 * libm::cos(2.0 * phase) + 0.1 * libm::sin(3.0 * phase);
        (1.0 - wave / 1.4) / 2.0 + drift * n as f64 / count as f64
    }

    #[test]
    fn drifts_of_a_part_1e_9_of_the_oscillation_are_found_and_where_there_is_none_none_is() {
        let quarter = 4096;
        for drift in [0.0, 1e-9, 1e-3, 1.0] {
            let mut n = 0;
            let [found] = Drift::of::<1, ()>(quarter, || {
                n += 1;
                Ok([oscillation(n, drift, 4 * quarter)])
            })
            .unwrap();
            let secular = found.secular();
            assert!((secular - drift).abs() < 1e-13, "{secular} for {drift}");
        }
    }

    #[test]
    fn random_walks_spread_as_the_root_of_time_and_biased_ones_as_time() {
        for (bias, expected) in [(0.0, 0.5), (1.0, 1.0)] {
            let mut spread = Spread::doubling(4096, 8);
            for member in 0..64 {
                let mut random = Random::new(1, member);
                let (mut step, mut place) = (0, 0.0);
                let mut deviations = Vec::new();
                for time in spread.times() {
                    while step < time {
                        place += bias + random.normal();
                        step += 1;
                    }
                    deviations.push(place);
                }
                spread.add(&deviations);
            }
            let found = spread.exponent();
            assert!((found - expected).abs() < 0.1, "{found} for {expected}");
        }
    }
}
