//! Round numbers along an axis.

/// At most about `count` multiples of a round step within `low..=high`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ticks {
    pub(super) values: Vec<f64>,
    decimals: usize,
}

/// The least of 1, 2, 5 × 10ⁿ that divides `span` into no more than `count` parts.
pub(super) fn step(span: f64, count: u32) -> f64 {
    let rough = span / f64::from(count);
    let power = libm::exp10(libm::floor(libm::log10(rough)));
    let factor = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|factor| factor * power >= rough * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * power
}

impl Ticks {
    pub(super) fn new(low: f64, high: f64, count: u32) -> Self {
        Self::with_step(low, high, step(high - low, count))
    }

    pub(super) fn with_step(low: f64, high: f64, step: f64) -> Self {
        let first = (low / step - 1e-6).ceil();
        let count = (high / step + 1e-6).floor() - first;
        let decimals = (-libm::floor(libm::log10(step) + 1e-9)).clamp(0.0, 12.0);
        let values = (0..=count.clamp(0.0, 1000.0) as u32)
            .map(|k| (first + f64::from(k)) * step)
            .collect();
        Self {
            values,
            decimals: decimals as usize,
        }
    }

    /// A tick's value as text, all with the same decimals.
    pub(super) fn label(&self, value: f64) -> String {
        let text = format!("{:.*}", self.decimals, value.abs());
        let zero = text.chars().all(|c| c == '0' || c == '.');
        if value < 0.0 && !zero {
            format!("−{text}")
        } else {
            text
        }
    }
}

/// The power of ten to take out of an axis's labels: 0 where they are short anyway, else a multiple of 3.
pub(super) fn exponent(greatest: f64) -> i32 {
    if greatest == 0.0 || (0.05..1e4).contains(&greatest) {
        return 0;
    }
    3 * (libm::floor(libm::log10(greatest) / 3.0) as i32)
}

/// A unit with a power of ten before it, such as `10⁻⁶ J`.
pub(super) fn unit(exponent: i32, unit: &str) -> String {
    if exponent == 0 {
        return unit.into();
    }
    let digits = exponent.abs().to_string();
    let raised = digits
        .bytes()
        .map(|digit| ["⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"][usize::from(digit - b'0')]);
    let sign = if exponent < 0 { "⁻" } else { "" };
    let power = format!("10{sign}{}", raised.collect::<String>());
    if unit.is_empty() {
        power
    } else {
        format!("{power} {unit}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_within_and_written_alike() {
        let ticks = Ticks::new(-0.31, 0.92, 6);
        let labels: Vec<_> = ticks
            .values
            .iter()
            .map(|value| ticks.label(*value))
            .collect();
        assert_eq!(labels, ["0.0", "0.5"]);

        let ticks = Ticks::new(-0.31, 0.92, 8);
        let labels: Vec<_> = ticks
            .values
            .iter()
            .map(|value| ticks.label(*value))
            .collect();
        assert_eq!(labels, ["−0.2", "0.0", "0.2", "0.4", "0.6", "0.8"]);
        assert_eq!(
            Ticks::new(0.0, 30.0, 6).values,
            [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0]
        );
        assert_eq!(Ticks::new(1e4, 7e4, 3).label(2e4), "20000");
    }

    #[test]
    fn tiny_and_huge_axes_take_out_a_power_of_a_thousand() {
        assert_eq!(exponent(3.0), 0);
        assert_eq!(unit(exponent(3.2e-15), ""), "10⁻¹⁵");
        assert_eq!(unit(exponent(2.5e7), "J"), "10⁶ J");
        assert_eq!(unit(exponent(0.0), "N"), "N");
    }
}
