//! The highest value that an inequality takes within a step.

/// Equal parts of a step at whose ends an inequality is evaluated first.
const PARTS: usize = 8;
/// Number of evaluations that narrow a maximum down, each to 0.62 of the range before.
const NARROWINGS: u32 = 32;
/// The golden section.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// The maximum of `g` from `range[0]` to `range[1]`, or a value up to 0 if the maximum is. Maxima that are nearer to each
/// other than an eighth of the range count as one.
pub(crate) fn highest(range: [f64; 2], g: impl Fn(f64) -> f64) -> f64 {
    let width = (range[1] - range[0]) / PARTS as f64;
    let place = |sample: usize| match sample {
        PARTS => range[1],
        _ => range[0] + width * sample as f64,
    };
    let values: [f64; PARTS + 1] = std::array::from_fn(|sample| g(place(sample)));
    let mut highest = values.into_iter().fold(f64::NEG_INFINITY, f64::max);
    for (sample, value) in values.into_iter().enumerate() {
        let neighbors = [sample.saturating_sub(1), (sample + 1).min(PARTS)];
        let [before, after] = neighbors.map(|neighbor| values[neighbor]);
        let middle = sample.clamp(1, PARTS - 1);
        // A parabola rises above its best sample by up to an eighth of the second difference.
        let bend = 2.0 * values[middle] - values[middle - 1] - values[middle + 1];
        if value >= before.max(after) && value + bend.abs() > 0.0 {
            highest = highest.max(refined(neighbors.map(place), &g));
        }
    }
    highest
}

/// The maximum in a range that has one.
fn refined([mut low, mut high]: [f64; 2], g: impl Fn(f64) -> f64) -> f64 {
    let mut highest = f64::NEG_INFINITY;
    let mut inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
    let mut found = inner.map(&g);
    for _ in 0..NARROWINGS {
        highest = highest.max(found[0]).max(found[1]);
        if found[0] > found[1] {
            high = inner[1];
            inner = [high - GOLDEN * (high - low), inner[0]];
            found = [g(inner[0]), found[0]];
        } else {
            low = inner[0];
            inner = [inner[1], low + GOLDEN * (high - low)];
            found = [found[1], g(inner[1])];
        }
    }
    highest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_maximum_of_a_parabola_is_found_wherever_it_is() {
        for peak in [-0.5, 0.0, 0.01, 0.3, 0.5, 0.77, 1.0, 1.5] {
            let g = |s: f64| 0.1 - (s - peak) * (s - peak);
            let expected = g(f64::clamp(peak, 0.0, 1.0));
            let found = highest([0.0, 1.0], g);
            if expected > 0.0 {
                assert!((found - expected).abs() < 1e-12, "{peak}: {found}");
            } else {
                assert!(found <= 0.0);
            }
        }
    }

    #[test]
    fn the_higher_of_two_maxima_is_found_even_if_its_samples_are_lower() {
        // At 0.3125, between samples, and at 0.75, on one.
        let g = |s: f64| {
            let [first, second] = [s - 0.3125, s - 0.75].map(|off| 150.0 * off * off);
            f64::max(1.0 - first, 0.5 - second)
        };
        assert!(g(0.75) > g(0.25).max(g(0.375)));
        assert!((highest([0.0, 1.0], g) - 1.0).abs() < 1e-12);
    }
}
