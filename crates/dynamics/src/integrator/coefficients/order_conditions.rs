//! The complete order conditions, as residuals that must vanish.

use std::collections::BTreeMap;

use super::*;

/// Words of odd letters with the sum `weight`.
fn words(weight: u32) -> Vec<Vec<u32>> {
    if weight == 0 {
        return vec![Vec::new()];
    }
    let mut all = Vec::new();
    for letter in (1..=weight).step_by(2) {
        for mut word in words(weight - letter) {
            word.push(letter);
            all.push(word);
        }
    }
    all
}

fn factorial(n: usize) -> f64 {
    (1..=n).map(|i| i as f64).product()
}

/// Largest residual of a composition at each order up to `order`.
///
/// A symmetric step is `exp(h A₁ + h³ A₃ + h⁵ A₅ + …)` with vector fields Aᵢ that generally do not commute. So `∏ᵢ
/// exp(γᵢ h A₁ + γᵢ³ h³ A₃ + …)` must agree with `exp(h A₁)` in each word of the letters A₁, A₃, A₅, …
fn composition_residuals(weights: &[f64], order: u32) -> Vec<f64> {
    let all: Vec<_> = (0..=order).flat_map(words).collect();
    let mut product: BTreeMap<_, _> = all.iter().map(|word| (word.as_slice(), 0.0)).collect();
    product.insert(&[], 1.0);
    for weight in weights {
        let coefficient =
            |word: &[u32]| weight.powi(word.iter().sum::<u32>() as i32) / factorial(word.len());
        product = all
            .iter()
            .map(|word| {
                let splits = (0..=word.len()).map(|at| word.split_at(at));
                let sum: f64 = splits.map(|(u, v)| product[u] * coefficient(v)).sum();
                (word.as_slice(), sum)
            })
            .collect();
    }
    let exact = |word: &[u32]| match word.iter().all(|&letter| letter == 1) {
        true => 1.0 / factorial(word.len()),
        false => 0.0,
    };
    (1..=order)
        .map(|weight| {
            let residual = |word: Vec<u32>| (product[word.as_slice()] - exact(&word)).abs();
            words(weight).into_iter().map(residual).fold(0.0, f64::max)
        })
        .collect()
}

/// A tree of the Nyström expansion of `q̈ = f(q)`: a derivative of f, applied `velocities` times to q̇ and once to each
/// element of `forces`.
#[derive(Clone)]
struct Tree {
    velocities: u32,
    forces: Vec<Tree>,
}

impl Tree {
    fn order(&self) -> u32 {
        1 + self.velocities + self.forces.iter().map(|tree| 1 + tree.order()).sum::<u32>()
    }

    /// The coefficient of t^(order − 1) in the tree's force in the exact solution.
    fn exact(&self) -> f64 {
        let twice_integrated = |tree: &Self| {
            let n = f64::from(tree.order());
            tree.exact() / (n * (n + 1.0))
        };
        self.forces.iter().map(twice_integrated).product()
    }

    /// The tree's force at each kick `b` of a scheme, at times `c`.
    fn at_kicks(&self, b: &[f64], c: &[f64]) -> Vec<f64> {
        let inner: Vec<_> = self.forces.iter().map(|tree| tree.at_kicks(b, c)).collect();
        let displacement = |force: &[f64], i: usize| -> f64 {
            (0..i).map(|j| b[j] * (c[i] - c[j]) * force[j]).sum()
        };
        (0..b.len())
            .map(|i| {
                let displacements = inner.iter().map(|force| displacement(force, i));
                c[i].powi(self.velocities as i32) * displacements.product::<f64>()
            })
            .collect()
    }
}

/// Trees whose branches (all below the root) have the total order `order`, built from the first `last` of `known`.
fn branchings(order: u32, known: &[Tree], last: usize) -> Vec<Tree> {
    let mut all = vec![Tree {
        velocities: order,
        forces: Vec::new(),
    }];
    for (index, branch) in known.iter().enumerate().take(last) {
        let taken = branch.order() + 1;
        if taken <= order {
            for mut tree in branchings(order - taken, known, index + 1) {
                tree.forces.push(branch.clone());
                all.push(tree);
            }
        }
    }
    all
}

/// All trees of orders 1 to `order`, grouped by order.
fn trees(order: u32) -> Vec<Vec<Tree>> {
    let mut known: Vec<Tree> = Vec::new();
    let mut groups = Vec::new();
    for order in 1..=order {
        let group = branchings(order - 1, &known, known.len());
        known.extend(group.iter().cloned());
        groups.push(group);
    }
    groups
}

/// Largest residual of a splitting at each order up to `order`: `Σᵢ bᵢ Φᵢ(τ) = ∫₀¹ Φ(τ)` for each tree τ. A symplectic
/// scheme that satisfies these conditions for the momenta also satisfies those for the positions.
fn nystrom_residuals(scheme: &Scheme, order: u32) -> Vec<f64> {
    let b = &scheme.kicks;
    let mut c = vec![0.0];
    for (i, drift) in scheme.drifts.iter().enumerate() {
        c.push(c[i] + drift);
    }
    let residual = |tree: &Tree| {
        let force = tree.at_kicks(b, &c);
        let momentum: f64 = b.iter().zip(force).map(|(b, force)| b * force).sum();
        (momentum - tree.exact() / f64::from(tree.order())).abs()
    };
    let group = |trees: &Vec<Tree>| trees.iter().map(residual).fold(0.0, f64::max);
    trees(order).iter().map(group).collect()
}

/// Bound above the rounding of coefficients and sums (measured: at most 3e-16) and below the effect of an error in the
/// twelfth digit.
const ROUNDING: f64 = 1e-15;

/// Checks that residuals vanish up to `order`, and not beyond.
fn assert_order(residuals: &[f64], order: u32) {
    let (within, beyond) = residuals.split_at(order as usize);
    assert!(within.iter().all(|&r| r < ROUNDING), "{order}: {within:?}");
    assert!(beyond[0] > 1e-6, "{order}: {beyond:?}");
}

/// Checks that a change in the twelfth decimal place of any entry of `half` is detected.
fn assert_sensitive(half: &[f64], residuals: impl Fn(&[f64]) -> Vec<f64>) {
    for i in (0..half.len()).filter(|&i| half[i] != 0.0) {
        let mut wrong = half.to_vec();
        wrong[i] += 1e-12;
        let largest = residuals(&mirrored(&wrong)).into_iter().fold(0.0, f64::max);
        assert!(largest > 100.0 * ROUNDING, "coefficient {i}: {largest:e}");
    }
}

const COMPOSITIONS: [&Composition; 4] = [
    &SUZUKI_4,
    &SOFRONIOU_SPALETTA_6,
    &SOFRONIOU_SPALETTA_8,
    &SOFRONIOU_SPALETTA_10,
];
const NYSTROM: [&Nystrom; 3] = [&SRKN_6B, &SRKN_14A, &RKN_A19];

#[test]
fn compositions_satisfy_their_order_conditions() {
    for table in COMPOSITIONS {
        let residuals = composition_residuals(&table.weights(), table.order + 1);
        assert_order(&residuals, table.order);
        assert_sensitive(table.half, |weights| {
            composition_residuals(weights, table.order)
        });
    }
}

#[test]
fn nystrom_splittings_satisfy_their_order_conditions() {
    for table in NYSTROM {
        let residuals = nystrom_residuals(&table.scheme(), table.order + 1);
        assert_order(&residuals, table.order);
        assert_sensitive(table.half, |stages| {
            nystrom_residuals(&Scheme::alternating(stages), table.order)
        });
    }
}

/// Checks the number of conditions: Fibonacci numbers for words; E. Hairer, S. P. Nørsett, G. Wanner, *Solving Ordinary
/// Differential Equations I*, II.14 for trees.
#[test]
fn no_condition_is_missing() {
    let counts: Vec<_> = (1..=10).map(|weight| words(weight).len()).collect();
    assert_eq!(counts, [1, 1, 2, 3, 5, 8, 13, 21, 34, 55]);
    let counts: Vec<_> = trees(8).iter().map(Vec::len).collect();
    assert_eq!(counts, [1, 1, 2, 3, 6, 10, 20, 36]);
}

/// The two independently derived families of conditions agree: compositions of Störmer–Verlet steps are also Nyström
/// splittings.
#[test]
fn compositions_of_kicks_and_drifts_satisfy_the_nystrom_conditions() {
    for table in COMPOSITIONS {
        assert_order(
            &nystrom_residuals(&table.scheme(), table.order + 1),
            table.order,
        );
    }
}

/// Words of `length` letters with this number of kicks (true) among them.
fn words_with(kicks: usize, length: usize) -> Vec<Vec<bool>> {
    let all = (0_u32..1 << length).filter(|bits| bits.count_ones() as usize == kicks);
    all.map(|bits| (0..length).map(|at| bits >> at & 1 == 1).collect())
        .collect()
}

/// The coefficient of a word of drifts A and kicks B in the product `… exp(bᵢ B) exp(aᵢ A) …`: that of each beginning of the word
/// after each factor.
fn coefficient(scheme: &Scheme, word: &[bool]) -> f64 {
    let mut sums = vec![0.0; word.len() + 1];
    sums[0] = 1.0;
    let drifts = scheme
        .drifts
        .iter()
        .map(|&a| (false, a))
        .chain([(false, 0.0)]);
    let factors = scheme.kicks.iter().map(|&b| (true, b)).zip(drifts);
    for (letter, weight) in factors.flat_map(|(kick, drift)| [kick, drift]) {
        for end in (1..=word.len()).rev() {
            let mut power = 1.0;
            for begin in (0..end).rev() {
                if word[begin] != letter {
                    break;
                }
                power *= weight / (end - begin) as f64;
                sums[end] += sums[begin] * power;
            }
        }
    }
    sums[word.len()]
}

/// Largest residual of the words with this number of kicks and this length, which `exp(A + B)` has with `1/n!`.
fn near_integrable_residual(scheme: &Scheme, kicks: usize, length: usize) -> f64 {
    let words = words_with(kicks, length);
    let residual = |word: &Vec<bool>| (coefficient(scheme, word) - 1.0 / factorial(length)).abs();
    words.iter().map(residual).fold(0.0, f64::max)
}

#[test]
fn near_integrable_splittings_satisfy_their_order_conditions() {
    let tables: [(&NearIntegrable, [usize; 3]); 4] = [
        (&LEAPFROG, [2, 2, 2]),
        (&ABA_82, [8, 2, 2]),
        (&ABA_864, [8, 6, 4]),
        (&ABA_1064, [10, 6, 4]),
    ];
    for (table, orders) in tables {
        let scheme = table.scheme();
        let largest = |scheme: &Scheme| {
            let within = (1..)
                .zip(orders)
                .flat_map(|(kicks, order)| (kicks..=order).map(move |length| (kicks, length)));
            let four = (4..=orders[2]).map(|length| (4, length));
            let each = within.chain(four);
            each.map(|(kicks, length)| near_integrable_residual(scheme, kicks, length))
                .fold(0.0, f64::max)
        };
        assert!(
            largest(&scheme) < ROUNDING,
            "{orders:?}: {:e}",
            largest(&scheme)
        );
        for (kicks, order) in (1..).zip(orders) {
            // A word of kicks alone is in every consistent scheme as it should be.
            let beyond = near_integrable_residual(&scheme, kicks, order.max(kicks) + 1);
            assert!(beyond > 1e-11, "{orders:?}: {beyond:e}");
        }
        for i in (0..table.half.len()).filter(|&i| table.half[i] != 0.0) {
            let mut wrong = table.half.to_vec();
            wrong[i] += 1e-12;
            let wrong = Scheme::alternating(&mirrored(&wrong));
            assert!(largest(&wrong) > 100.0 * ROUNDING, "coefficient {i}");
        }
    }
}
