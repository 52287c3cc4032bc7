//! Growth in time.

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
