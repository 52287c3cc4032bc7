//! The tableaus against Butcher's order conditions: `Σ_i b_i(θ) Φ_i(τ) = θ^|τ| / γ(τ)` for every rooted tree τ up to the
//! order (Hairer, Nørsett, Wanner, *Solving Ordinary Differential Equations I*, §II.2, §II.6).

use super::{CLASSICAL, DORMAND_PRINCE, EXPLICIT_MIDPOINT, FEHLBERG, Pair, Row, Stage, Tableau};

/// A rooted tree: what its root bears, in order.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Tree(Vec<Tree>);

impl Tree {
    fn order(&self) -> usize {
        1 + self.0.iter().map(Self::order).sum::<usize>()
    }

    /// `γ(τ)`
    fn density(&self) -> f64 {
        self.order() as f64 * self.0.iter().map(Self::density).product::<f64>()
    }

    /// `Φ_i(τ)` of each stage.
    fn weights(&self, stages: &[Vec<f64>]) -> Vec<f64> {
        let mut product = vec![1.0; stages.len()];
        for branch in &self.0 {
            let inner = branch.weights(stages);
            for (product, row) in product.iter_mut().zip(stages) {
                *product *= dot(row, &inner);
            }
        }
        product
    }

    /// All trees of an order: a leaf set on any vertex of those of one less.
    fn all(order: usize) -> Vec<Self> {
        if order == 1 {
            return vec![Self(vec![])];
        }
        let mut trees: Vec<_> = Self::all(order - 1).iter().flat_map(Self::grown).collect();
        trees.sort();
        trees.dedup();
        trees
    }

    fn grown(&self) -> Vec<Self> {
        let with = |mut branches: Vec<Self>, branch| {
            branches.push(branch);
            branches.sort();
            Self(branches)
        };
        let mut trees = vec![with(self.0.clone(), Self(vec![]))];
        for (index, branch) in self.0.iter().enumerate() {
            let mut others = self.0.clone();
            others.remove(index);
            trees.extend(branch.grown().into_iter().map(|b| with(others.clone(), b)));
        }
        trees
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn dense(row: Row, stages: usize) -> Vec<f64> {
    let mut numbers = vec![0.0; stages];
    for &(stage, value) in row {
        assert_eq!(numbers[stage], 0.0, "given twice");
        numbers[stage] = value;
    }
    numbers
}

fn rows<'a>(stages: impl IntoIterator<Item = &'a Stage>, count: usize) -> Vec<Vec<f64>> {
    let mut rows = Vec::new();
    for (index, stage) in stages.into_iter().enumerate() {
        assert!(stage.row.iter().all(|&(from, _)| from < index));
        let row = dense(stage.row, count);
        let sum: f64 = row.iter().sum();
        assert!(
            (sum - stage.node).abs() < 2e-14,
            "c of stage {index}: {sum}"
        );
        rows.push(row);
    }
    rows
}

/// The largest violation of the conditions of an order at `theta`.
fn violation(stages: &[Vec<f64>], weights: &[f64], order: usize, theta: f64) -> f64 {
    let power = (0..order).fold(1.0, |power, _| power * theta);
    let of = |tree: &Tree| (dot(weights, &tree.weights(stages)) - power / tree.density()).abs();
    Tree::all(order).iter().map(of).fold(0.0, f64::max)
}

fn assert_order(stages: &[Vec<f64>], weights: &[f64], order: usize, theta: f64) {
    for order in 1..=order {
        let violation = violation(stages, weights, order, theta);
        assert!(violation < 2e-14, "order {order}: {violation:e}");
    }
    let next = violation(stages, weights, order + 1, theta);
    assert!(next > 1e-6, "not more than order {order}: {next:e}");
}

fn assert_tableau(tableau: &Tableau, order: usize) {
    let count = tableau.stages.len();
    let stages = rows(tableau.stages, count);
    assert_order(&stages, &dense(tableau.weights, count), order, 1.0);
}

#[test]
fn there_are_as_many_trees_as_known() {
    let counts: Vec<_> = (1..=8).map(|order| Tree::all(order).len()).collect();
    assert_eq!(counts, [1, 1, 2, 4, 9, 20, 48, 115]);
}

#[test]
fn methods_have_their_order_and_no_more() {
    assert_tableau(&EXPLICIT_MIDPOINT, 2);
    assert_tableau(&CLASSICAL, 4);
    assert_tableau(&FEHLBERG.tableau, 8);
    assert_tableau(&DORMAND_PRINCE.tableau, 8);
}

/// An error estimate is the difference of two methods: less it, the weights are of the lower order.
#[test]
fn error_estimates_have_their_order_and_no_more() {
    let lower = |pair: &Pair, row: Row, order: usize| {
        let count = pair.tableau.stages.len();
        let stages = rows(pair.tableau.stages, count);
        let weights = dense(pair.tableau.weights, count);
        let lower: Vec<_> = weights
            .iter()
            .zip(dense(row, count))
            .map(|(b, e)| b - e)
            .collect();
        assert_order(&stages, &lower, order, 1.0);
    };
    lower(&FEHLBERG, FEHLBERG.error, 7);
    lower(&DORMAND_PRINCE, DORMAND_PRINCE.error, 5);
    lower(&DORMAND_PRINCE, DORMAND_PRINCE.damping, 3);
}

#[test]
fn continuous_extensions_are_of_seventh_order_throughout_the_step() {
    for pair in [&FEHLBERG, &DORMAND_PRINCE] {
        let own = pair.tableau.stages.len();
        let count = own + 1 + pair.extra.len();
        let end = Stage {
            node: 1.0,
            row: pair.tableau.weights,
        };
        let stages = rows(
            pair.tableau.stages.iter().chain([&end]).chain(pair.extra),
            count,
        );
        let weights = dense(pair.tableau.weights, count);
        let d = pair.dense.map(|row| dense(row, count));
        for theta in [0.1, 0.3, 0.5, 0.8, 0.95] {
            let rest = 1.0 - theta;
            let at = |stage: usize| {
                let is = |index: usize| f64::from(u8::from(stage == index));
                let slope = is(0) - weights[stage];
                let bend = weights[stage] - is(own) - slope;
                let quartic = d[0][stage]
                    + theta * (d[1][stage] + rest * (d[2][stage] + theta * d[3][stage]));
                theta * (weights[stage] + rest * (slope + theta * (bend + rest * quartic)))
            };
            let weights: Vec<_> = (0..count).map(at).collect();
            for order in 1..=7 {
                let violation = violation(&stages, &weights, order, theta);
                assert!(
                    violation < 5e-14,
                    "order {order}, θ = {theta}: {violation:e}"
                );
            }
        }
    }
}
