//! The sweep compared with a dense solution of the optimality conditions.

use fastrand::Rng;
use nalgebra::{DMatrix, DVector};

use super::*;
use crate::discrete::linear::OwnInputs;
use crate::discrete::linear::{Blocks, Exchange, KickInputs, Turn, TurnCurvature, command_rows};
use crate::discrete::stored::{SPINNING, StoredCurvature, StoredTurn};
use crate::discrete::tests::composed::Composed;
use crate::problem::Off;

fn random<const R: usize, const C: usize>(rng: &mut Rng, size: f64) -> SMatrix<f64, R, C> {
    SMatrix::from_fn(|_, _| size * (2.0 * rng.f64() - 1.0))
}

/// The model and the dynamics of a stage.
#[derive(Clone)]
struct RandomStage<const X: usize, const U: usize> {
    model: StageModel<X, U>,
    step: Linearization,
    inputs: Inputs<U>,
}

impl<const X: usize, const U: usize> RandomStage<X, U> {
    fn sweep(&self, cost: &mut CostToGo<X>, policy: &mut Policy<X, U>) -> Result<(), NotConvex> {
        let stage = Stage {
            model: &self.model,
            step: &self.step,
            inputs: &self.inputs,
        };
        cost.sweep(stage, policy)
    }

    /// The stage's model and dynamics, multiplied out.
    fn composed(&self) -> Composed<X, U> {
        let mut all = Composed::of(&self.inputs, &self.step, &self.model.curvature);
        all.state += self.model.state;
        all.mixed += self.model.mixed.transpose();
        all.command += self.model.command;
        all
    }
}

/// Random blocks, symmetric as a whole if `symmetric`.
fn blocks(rng: &mut Rng, size: f64, symmetric: bool) -> Blocks {
    let mut blocks: Blocks = std::array::from_fn(|_| std::array::from_fn(|_| random(rng, size)));
    if symmetric {
        let of: Blocks = blocks;
        for (i, row) in blocks.iter_mut().enumerate() {
            for (j, block) in row.iter_mut().enumerate() {
                *block = 0.5 * (of[i][j] + of[j][i].transpose());
            }
        }
    }
    blocks
}

/// A random step of either scheme, with its curvature: of center of mass, with drag or without, and attitude, of one of them, or
/// of the attitude and a momentum that the body stores. With more than six commands, forces turn with the body.
fn step<const X: usize, const U: usize>(
    rng: &mut Rng,
    two_kicks: bool,
    glides: bool,
) -> (Linearization, Curvature) {
    let turns = X == 12 || !glides;
    let stores = X == 12 && !glides;
    let unit = nalgebra::Matrix3::identity();
    let symmetric = |m: nalgebra::Matrix3<f64>| 0.5 * (m + m.transpose());
    let slows = glides && rng.bool();
    let by_itself = |[[a, b], [c, d]]: Blocks| [[unit + a, b], [c, unit + d]];
    let linear = Linearization {
        before: two_kicks.then(|| blocks(rng, 0.3, false)),
        glide: (glides && !slows).then_some(0.3),
        slowed: slows.then(|| Box::new(by_itself(blocks(rng, 0.3, false)))),
        turn: turns.then(|| Turn {
            pose: unit + random::<3, 3>(rng, 0.3),
            pose_by_momentum: random(rng, 0.3),
            momentum: unit + random::<3, 3>(rng, 0.3),
        }),
        stored: stores.then(|| {
            Box::new(StoredTurn {
                pose: random(rng, 0.3),
                momentum: random(rng, 0.3),
            })
        }),
        after: blocks(rng, 0.3, false),
        own: (U > 6).then(|| OwnInputs {
            frames: Some([0, 1].map(|_| lgvi_lie::exp(&random(rng, 2.0)))),
            off: Off::NONE,
        }),
    };
    let cross = |rng: &mut Rng| (U > 6).then(|| command_rows(&random::<3, U>(rng, 0.1)));
    let curvature = Curvature {
        before: two_kicks.then(|| blocks(rng, 0.1, true)),
        slowed: slows.then(|| Box::new(blocks(rng, 0.1, true))),
        turn: turns.then(|| TurnCurvature {
            pose_momentum: random(rng, 0.1),
            momentum_momentum: symmetric(random(rng, 0.1)),
        }),
        stored: stores.then(|| {
            Box::new(StoredCurvature {
                pose: random(rng, 0.1),
                momentum: random(rng, 0.1),
                stored: symmetric(random(rng, 0.1)),
            })
        }),
        after: Some(blocks(rng, 0.1, true)),
        before_commands: cross(rng).filter(|_| two_kicks),
        after_commands: cross(rng),
    };
    (linear, curvature)
}

/// A random problem with `conditions` of its X terminal conditions; `convexity` shifts the state Hessians.
fn problem<const X: usize, const U: usize>(
    rng: &mut Rng,
    intervals: usize,
    conditions: usize,
    convexity: f64,
) -> (Vec<RandomStage<X, U>>, EndModel<X>) {
    let two_kicks = rng.bool();
    let glides = X == 12 || rng.bool();
    problem_of(rng, intervals, conditions, convexity, [two_kicks, glides])
}

fn problem_of<const X: usize, const U: usize>(
    rng: &mut Rng,
    intervals: usize,
    conditions: usize,
    convexity: f64,
    [two_kicks, glides]: [bool; 2],
) -> (Vec<RandomStage<X, U>>, EndModel<X>) {
    let symmetric = |m: SMatrix<f64, X, X>| 0.5 * (m + m.transpose());
    let inputs = Inputs {
        before: two_kicks.then(|| KickInputs::new(std::array::from_fn(|_| random(rng, 1.0)))),
        after: KickInputs::new(std::array::from_fn(|_| random(rng, 1.0))),
        exchange: (X == 12 && U >= SPINNING && two_kicks)
            .then(|| Box::new(Exchange::new(random(rng, 1.0)))),
    };
    let stages = (0..intervals)
        .map(|_| {
            let command = random::<U, U>(rng, 0.3);
            let (step, curvature) = step::<X, U>(rng, two_kicks, glides);
            let model = StageModel {
                curvature,
                state: symmetric(random(rng, 0.1)) + convexity * SMatrix::identity(),
                mixed: random(rng, 0.1),
                command: 0.5 * (command + command.transpose()) + 3.0 * SMatrix::identity(),
                state_gradient: random(rng, 1.0),
                command_gradient: random(rng, 1.0),
                defect: random(rng, 1.0),
            };
            RandomStage {
                model,
                step,
                inputs: inputs.clone(),
            }
        })
        .collect();
    let mut jacobian = random::<X, X>(rng, 1.0);
    let mut residual = random::<X, 1>(rng, 1.0);
    for row in conditions..X {
        jacobian.fill_row(row, 0.0);
        residual[row] = 0.0;
    }
    let end = EndModel {
        hessian: symmetric(random(rng, 0.1)) + convexity * SMatrix::identity(),
        gradient: random(rng, 1.0),
        jacobian,
        residual,
    };
    (stages, end)
}

/// States `z_1 … z_N`, commands and ν.
type Swept<const X: usize, const U: usize> =
    (Vec<SVector<f64, X>>, Vec<SVector<f64, U>>, SVector<f64, X>);

/// Solves the problem by the sweep.
fn swept<const X: usize, const U: usize>(
    stages: &[RandomStage<X, U>],
    end: &EndModel<X>,
) -> Result<Swept<X, U>, NotConvex> {
    let mut cost = CostToGo::end(end);
    let mut policies = vec![Policy::zeros(); stages.len()];
    for (stage, policy) in stages.iter().zip(&mut policies).rev() {
        stage.sweep(&mut cost, policy)?;
    }
    let nu = cost.multipliers().ok_or(NotConvex)?;
    let mut z = SVector::zeros();
    let (mut states, mut commands) = (vec![], vec![]);
    for (stage, policy) in stages.iter().zip(&policies) {
        let v = policy.command(&z, &nu);
        z = stage.step.forward(&stage.inputs, &z, &v) + stage.model.defect;
        states.push(z);
        commands.push(v);
    }
    Ok((states, commands, nu))
}

/// Solves the problem by LU factorization of the optimality conditions in all unknowns at once: `[v_k, z_{k+1}]`,
/// `λ_k`, ν.
fn dense<const X: usize, const U: usize>(
    stages: &[RandomStage<X, U>],
    end: &EndModel<X>,
    conditions: usize,
) -> DVector<f64> {
    let (n, width) = (stages.len(), X + U);
    let primal = n * width;
    let size = primal + n * X + conditions;
    let mut kkt = DMatrix::zeros(size, size);
    let mut right = DVector::zeros(size);
    for (k, RandomStage { model, .. }) in stages.iter().enumerate() {
        let stage = stages[k].composed();
        let (v, z, row) = (k * width, k * width + U, primal + k * X);
        kkt.view_mut((v, v), (U, U)).copy_from(&stage.command);
        right.rows_mut(v, U).copy_from(&-model.command_gradient);
        // z⁺ − A z − B v = d
        kkt.view_mut((row, z), (X, X)).fill_with_identity();
        kkt.view_mut((row, v), (X, U)).copy_from(&-stage.b);
        right.rows_mut(row, X).copy_from(&model.defect);
        if k > 0 {
            let before = z - width;
            kkt.view_mut((before, before), (X, X))
                .copy_from(&stage.state);
            kkt.view_mut((before, v), (X, U)).copy_from(&stage.mixed);
            kkt.view_mut((v, before), (U, X))
                .copy_from(&stage.mixed.transpose());
            right.rows_mut(before, X).copy_from(&-model.state_gradient);
            kkt.view_mut((row, before), (X, X)).copy_from(&-stage.a);
        }
    }
    let last = primal - X;
    kkt.view_mut((last, last), (X, X)).copy_from(&end.hessian);
    right.rows_mut(last, X).copy_from(&-end.gradient);
    let rows = end.jacobian.rows(0, conditions);
    kkt.view_mut((size - conditions, last), (conditions, X))
        .copy_from(&rows);
    right
        .rows_mut(size - conditions, conditions)
        .copy_from(&-end.residual.rows(0, conditions));
    let below = kkt.view((primal, 0), (size - primal, primal)).transpose();
    kkt.view_mut((0, primal), (primal, size - primal))
        .copy_from(&below);
    kkt.lu().solve(&right).unwrap()
}

fn agrees<const X: usize, const U: usize>(seed: u64, intervals: usize, conditions: usize) {
    let mut rng = Rng::with_seed(seed);
    agree(
        problem::<X, U>(&mut rng, intervals, conditions, 0.5),
        conditions,
    );
}

fn agree<const X: usize, const U: usize>(
    (stages, end): (Vec<RandomStage<X, U>>, EndModel<X>),
    conditions: usize,
) {
    let intervals = stages.len();
    let (states, commands, nu) = swept(&stages, &end).unwrap();
    let expected = dense(&stages, &end, conditions);
    let scale = expected.amax();
    for k in 0..intervals {
        let at = k * (X + U);
        let off = (expected.rows(at, U) - commands[k]).amax()
            + (expected.rows(at + U, X) - states[k]).amax();
        assert!(
            off < 1e-9 * scale,
            "stage {k} of {intervals}: off by {off:e} of {scale:e}"
        );
    }
    let multipliers = expected.rows(expected.len() - conditions, conditions);
    assert!((multipliers - nu.rows(0, conditions)).amax() < 1e-9 * scale);
    assert!(nu.rows(conditions, X - conditions).amax() == 0.0);
}

#[test]
fn the_sweep_solves_the_optimality_conditions() {
    for intervals in [2, 3, 10, 30] {
        agrees::<12, 6>(intervals as u64, intervals, 12);
        agrees::<6, 3>(intervals as u64, intervals, 6);
        agrees::<12, 9>(intervals as u64, intervals, 12);
        agrees::<12, 15>(intervals as u64, intervals, 12);
    }
    for conditions in [0, 1, 5, 9, 11] {
        agrees::<12, 6>(7, 8, conditions);
    }
    agrees::<6, 3>(7, 8, 3);
}

#[test]
fn a_momentum_that_the_body_stores_turns_it() {
    let mut rng = Rng::with_seed(17);
    for intervals in [2, 3, 6] {
        let two_kicks = intervals != 3;
        let few = problem_of::<12, SPINNING>(&mut rng, intervals, 9, 1.0, [two_kicks, false]);
        assert!(few.0.iter().all(|stage| stage.step.stored.is_some()));
        agree(few, 9);
        // Only exchanges move the pose of the first group.
        let many = problem_of::<12, 15>(&mut rng, intervals, 9, 1.0, [two_kicks, false]);
        agree(many, 9);
    }
}

/// An indefinite end without augmentation is rejected. Conditions that fix the indefinite directions make it convex
/// when they are augmented.
#[test]
fn convexity_is_that_of_what_the_conditions_leave_free() {
    let mut rng = Rng::with_seed(3);
    let (stages, mut end) = problem::<6, 3>(&mut rng, 12, 6, 0.2);
    end.hessian -= 5.0 * SMatrix::<f64, 6, 6>::identity();
    assert!(swept(&stages, &end).is_err());
    let expected = dense(&stages, &end, 6);
    end.hessian += 1e3 * end.jacobian.tr_mul(&end.jacobian);
    end.gradient += 1e3 * end.jacobian.tr_mul(&end.residual);
    let (_, commands, _) = swept(&stages, &end).unwrap();
    for (k, command) in commands.iter().enumerate() {
        assert!((expected.rows(9 * k, 3) - command).amax() < 1e-7 * expected.amax());
    }
}

/// The double integrator with a terminal state: `v` is linear in time for every number of stages, and the conditions
/// are met.
#[test]
fn long_arcs_lose_nothing() {
    for intervals in [2_usize, 1000, 100_000] {
        let h = (intervals as f64).recip();
        let stage = RandomStage {
            model: StageModel::<6, 3> {
                command: SMatrix::identity() * h,
                ..StageModel::zeros()
            },
            step: Linearization {
                glide: Some(h),
                ..Linearization::default()
            },
            inputs: Inputs {
                before: None,
                after: KickInputs::new([SMatrix::identity() * h, SMatrix::zeros()]),
                exchange: None,
            },
        };
        let wanted = SVector::<f64, 6>::from_fn(|i, _| if i < 3 { 1.0 } else { 0.0 });
        let weights = SVector::<f64, 6>::from_fn(|i, _| if i < 3 { 120.0 } else { 40.0 });
        let weights = SMatrix::<f64, 6, 6>::from_diagonal(&weights);
        let end = EndModel {
            hessian: weights,
            gradient: -(weights * wanted),
            jacobian: SMatrix::identity(),
            residual: -wanted,
        };
        let stages = vec![stage; intervals];
        let (states, commands, _) = swept(&stages, &end).unwrap();
        assert!((states[intervals - 1] - wanted).amax() < 1e-11);
        let (first, last) = (commands[0][0], commands[intervals - 1][0]);
        for (k, command) in commands.iter().enumerate() {
            let part = k as f64 / (intervals - 1) as f64;
            let linear = first + part * (last - first);
            assert!(
                (command[0] - linear).abs() < 1e-9 * first.abs(),
                "{k} of {intervals}"
            );
        }
    }
}

/// With many stages left, commands under the gain follow a change of state as the optimum does.
#[test]
fn gains_are_those_of_neighboring_optima() {
    let mut rng = Rng::with_seed(11);
    let (stages, end) = problem::<6, 3>(&mut rng, 20, 6, 0.5);
    let mut cost = CostToGo::end(&end);
    let mut policy = Policy::zeros();
    for stage in stages.iter().rev() {
        stage.sweep(&mut cost, &mut policy).unwrap();
    }
    let mut gain = SMatrix::zeros();
    cost.gain(&policy, &SVector::zeros(), &mut gain);
    let (_, commands, _) = swept(&stages, &end).unwrap();
    for i in 0..6 {
        let mut off = SVector::<f64, 6>::zeros();
        off[i] = 1.0;
        // A start off by `off` is equivalent to a change of the first defect and of the first command gradient by its
        // contributions.
        let mut moved = stages.clone();
        let first = stages[0].composed();
        moved[0].model.defect += first.a * off;
        moved[0].model.command_gradient += first.mixed.tr_mul(&off);
        let (_, others, _) = swept(&moved, &end).unwrap();
        let change = others[0] - commands[0];
        assert!((change + gain.column(i)).amax() < 1e-9);
    }
}

/// The results do not depend on the instructions of the lanes.
#[test]
fn instructions_change_no_bit() {
    on_all_instructions::<6>();
    on_all_instructions::<15>();
}

fn on_all_instructions<const U: usize>() {
    let mut rng = Rng::with_seed(13);
    let (stages, end) = problem::<12, U>(&mut rng, 20, 12, 0.5);
    let results = [Level::baseline(), Level::new()].map(|level| {
        let mut cost = CostToGo::end(&end);
        cost.level = level;
        let mut policy = Policy::zeros();
        let mut gains = vec![SMatrix::zeros(); stages.len()];
        for (stage, gain) in stages.iter().zip(&mut gains).rev() {
            stage.sweep(&mut cost, &mut policy).unwrap();
            cost.gain(&policy, &SVector::repeat(1e-3), gain);
        }
        (cost.hessian, cost.border, cost.gram, policy.state, gains)
    });
    let [first, second] = results;
    assert!(first == second);
}
