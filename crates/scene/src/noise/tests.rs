use super::*;

/// Indices in an order that jumps back and forth.
const ORDER: [u64; 12] = [0, 7, 3, 1 << 40, 8, 9, 1000, 999, 1, 1 << 40, 12, 7];

fn processes(seed: u64) -> [Process; 2] {
    let stream = |number| Stream::new(seed, number);
    [
        Process::gauss_markov(0.5, 20.0, stream(0)),
        Process::random_walk(0.25, stream(1)),
    ]
}

#[test]
fn an_element_has_the_same_bits_in_any_order() {
    for mut process in processes(3) {
        let alone = ORDER.map(|k| process.clone().at(k));
        assert_eq!(ORDER.map(|k| process.at(k)), alone);
        let in_order: Vec<_> = (0..=1000).map(|k| process.at(k)).collect();
        for (k, value) in ORDER.into_iter().zip(alone) {
            if let Some(other) = in_order.get(k as usize) {
                assert_eq!(*other, value, "element {k}");
            }
        }
    }
}

/// Jumps ahead in the generator are the steps that they stand for.
#[test]
fn elements_of_a_stream_follow_each_other_in_its_generator() {
    let stream = Stream::new(11, 4);
    let mut rng = stream.0.clone();
    for k in 0..100 {
        assert_eq!(stream.at(k), normals(&mut rng));
    }
}

/// The mean of products of components of two processes, over seeds and components.
fn covariance(count: u64, element: impl Fn(u64) -> [Vector3<f64>; 2]) -> f64 {
    let products = (0..count).map(|seed| {
        let [one, other] = element(seed);
        one.dot(&other)
    });
    products.sum::<f64>() / (3 * count) as f64
}

/// `E[x_i x_k] = σ² exp(−|i − k|/τ)` within 5 standard errors, whatever intervals `i` and `k` are drawn in.
#[test]
fn a_gauss_markov_process_has_its_autocovariance() {
    const SEEDS: u64 = 20_000;
    for [i, k] in [
        [0, 0],
        [0, 1],
        [5, 6],
        [7, 9],
        [31, 33],
        [20, 45],
        [100, 100],
    ] {
        let found = covariance(SEEDS, |seed| {
            let [mut process, _] = processes(seed);
            [process.at(i), process.at(k)]
        });
        let (sigma, tau) = (0.5_f64, 20.0);
        let expected = sigma * sigma * (-(i.abs_diff(k) as f64) / tau).exp();
        // The variance of a product of two normals of variance σ² is at most 2 σ⁴.
        let error = sigma * sigma * (2.0 / (3 * SEEDS) as f64).sqrt();
        assert!(
            (found - expected).abs() < 5.0 * error,
            "{i}, {k}: {found} for {expected}"
        );
    }
}

/// `E[x_i x_k] = q² min(i, k)`, and disjoint increments are independent.
#[test]
fn a_random_walk_has_independent_increments() {
    const SEEDS: u64 = 20_000;
    let q = 0.25_f64;
    for [i, k] in [[0_u64, 0], [1, 1], [3, 3], [3, 8], [17, 30], [64, 100]] {
        let found = covariance(SEEDS, |seed| {
            let [_, mut process] = processes(seed);
            [process.at(i), process.at(k)]
        });
        let expected = q * q * i.min(k) as f64;
        let error = q * q * ((2 * i * k) as f64 / (3 * SEEDS) as f64).sqrt();
        assert!(
            (found - expected).abs() <= 5.0 * error,
            "{i}, {k}: {found} for {expected}"
        );
    }
    let found = covariance(SEEDS, |seed| {
        let [_, mut process] = processes(seed);
        let [a, b, c] = [5, 12, 13].map(|k| process.at(k));
        [b - a, c - b]
    });
    let error = q * q * (7.0 / (3 * SEEDS) as f64).sqrt();
    assert!(found.abs() < 5.0 * error, "{found}");
}

/// Neighbors in seed and number are as independent as any two sequences.
#[test]
fn streams_are_independent_of_each_other() {
    const COUNT: u64 = 30_000;
    let error = 1.0 / ((3 * COUNT) as f64).sqrt();
    let one = Stream::new(1, 1);
    for (other, lag) in [
        (Stream::new(1, 2), 0),
        (Stream::new(2, 1), 0),
        (Stream::new(1, 2), 1),
        (Stream::new(1, 1), 1),
    ] {
        let found = covariance(COUNT, |k| [one.at(k), other.at(k + lag)]);
        assert!(found.abs() < 5.0 * error, "{found}");
    }
}
