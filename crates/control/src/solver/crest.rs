//! The highest value that an inequality takes within a step.

/// Equal parts of a step at whose ends an inequality is evaluated first.
const PARTS: usize = 8;
/// Number of evaluations that narrow a maximum down, each to 0.62 of the range before.
const NARROWINGS: u32 = 32;
/// The golden section.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// The maximum of `g` from `range[0]` to `range[1]`, or a value below 0 if the maximum is. Of several maxima within the
/// eighth of the range, one is found.
pub(super) fn highest(range: [f64; 2], g: impl Fn(f64) -> f64) -> f64 {
    let width = (range[1] - range[0]) / PARTS as f64;
    let place = |sample: usize| match sample {
        PARTS => range[1],
        _ => range[0] + width * sample as f64,
    };
    let values: [f64; PARTS + 1] = std::array::from_fn(|sample| g(place(sample)));
    let mut best = 0;
    for (sample, value) in values.iter().enumerate() {
        if *value > values[best] {
            best = sample;
        }
    }
    let [before, after] = [best.saturating_sub(1), (best + 1).min(PARTS)];
    let lower = values[before].min(values[after]);
    // Between the neighbors, a curve is not higher above its best sample than that is above them.
    if 2.0 * values[best] <= lower {
        return values[best];
    }
    let [mut low, mut high] = [place(before), place(after)];
    let mut highest = values[best];
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
}
