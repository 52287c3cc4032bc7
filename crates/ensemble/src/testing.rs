//! Values for tests.

use fastrand::Rng;

/// Returns values of a random distribution in a random order, at most `most` of them.
pub(crate) fn values(random: &mut Rng, most: usize) -> Vec<f64> {
    let count = (most as f64).powf(random.f64()) as usize;
    let normal = |random: &mut Rng| (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
    let family = random.u8(..8);
    let power = 4.0 * random.f64();
    let few: Vec<_> = (0..random.usize(1..9)).map(|_| normal(random)).collect();
    let one = |random: &mut Rng| match family {
        0 => random.f64(),
        1 => normal(random),
        2 => (power * normal(random)).exp(),
        // Heavy tails: the smaller the exponent, the fewer moments exist.
        3 => random.f64().powf(-power),
        4 => (std::f64::consts::PI * (random.f64() - 0.5)).tan(),
        5 => few[random.usize(..few.len())],
        6 => few[random.usize(..few.len())] + 1e-3 * normal(random),
        _ => f64::from_bits(random.u64(..)),
    };
    let (center, scale) = (normal(random), 10.0_f64.powf(12.0 * random.f64() - 6.0));
    let mut values: Vec<_> = (0..count).map(|_| one(random)).collect();
    if random.bool() && family < 7 {
        let moved = values.iter_mut();
        moved.for_each(|value| *value = center * 1e6 + scale * *value);
    }
    match random.u8(..4) {
        0 => values.sort_by(f64::total_cmp),
        1 => values.sort_by(|a, b| b.total_cmp(a)),
        2 => values.sort_by(|a, b| a.abs().total_cmp(&b.abs())),
        _ => {}
    }
    values
}
