//! The sweep over one stage, from the end of its step to its start: through the kick after the drift, the drift, the
//! kick before it, and the minimum over the commands.

#![expect(
    clippy::needless_range_loop,
    reason = "several arrays have the same index"
)]

use fearless_simd::{Simd, dispatch};

use super::columns::{
    Column, add, before_drift, before_kick, before_slowing, before_stored, entry, load, load_all,
    plus, scaled, store, take, transposed, zero,
};
use super::{CostToGo, NotConvex, Policy, Square, StageModel, factorize, not_convex};
use crate::discrete::linear::{
    Blocks, CommandRows, Exchange, KickInputs, LANES, TurnCurvature, groups, momentum, pose,
};
use crate::discrete::stored::StoredCurvature;
use crate::discrete::{Inputs, Linearization};

/// A stage: its model, its first derivatives, and the effects of its commands.
#[derive(Clone, Copy)]
pub(crate) struct Stage<'s, const X: usize, const U: usize> {
    pub(crate) model: &'s StageModel<X, U>,
    pub(crate) step: &'s Linearization,
    pub(crate) inputs: &'s Inputs<U>,
}

impl<const X: usize> CostToGo<X> {
    /// Turns the cost to go at the stage's end into that at its start, and computes the policy of the stage.
    pub(crate) fn sweep<const U: usize>(
        &mut self,
        stage: Stage<'_, X, U>,
        policy: &mut Policy<X, U>,
    ) -> Result<(), NotConvex> {
        const { assert!(X <= 12 && X.is_multiple_of(6) && U < LANES) };
        // The lanes of a column of X rows, and of one of U + 1 rows, and the number of the latter.
        if X <= 6 && U < 4 {
            dispatch!(self.level, simd => Sweep::<_, X, U, 2, 1, 4>::run(simd, self, stage, policy))
        } else if U < 8 {
            dispatch!(self.level, simd => Sweep::<_, X, U, 3, 2, 8>::run(simd, self, stage, policy))
        } else {
            dispatch!(self.level, simd => Sweep::<_, X, U, 3, 4, 16>::run(simd, self, stage, policy))
        }
    }
}

/// The cost to go on the way from the end of a stage to its start, before the commands are chosen.
struct Sweep<
    S: Simd,
    const X: usize,
    const U: usize,
    const V: usize,
    const W: usize,
    const L: usize,
> {
    /// `P`
    hessian: [Column<S, V>; X],
    /// `Gᵀ`
    border: [Column<S, V>; X],
    /// The derivatives by commands and each coordinate. Row U is the gradient by that coordinate.
    mixed: [Column<S, W>; X],
    /// The derivatives by commands twice. Row U is the gradient by that command.
    command: [Column<S, W>; U],
    /// The derivatives of the conditions by each command.
    by_conditions: [Column<S, V>; U],
    simd: S,
}

impl<S: Simd, const X: usize, const U: usize, const V: usize, const W: usize, const L: usize>
    Sweep<S, X, U, V, W, L>
{
    #[inline(always)]
    fn run(
        simd: S,
        cost: &mut CostToGo<X>,
        stage: Stage<'_, X, U>,
        policy: &mut Policy<X, U>,
    ) -> Result<(), NotConvex> {
        let Stage {
            model,
            step,
            inputs,
        } = stage;
        let curvature = &model.curvature;
        let inputs = &*step.inputs(inputs);
        let mut sweep = Self::begin(simd, cost, model);
        match inputs.exchange::<X>() {
            Some(exchange) => {
                sweep.take_exchange(exchange);
                sweep.take_more_commands(&inputs.after);
            }
            None => sweep.take_commands(&inputs.after),
        }
        sweep.pass_kick(&step.after, curvature.after.as_ref());
        sweep.cross(curvature.after_commands.as_ref());
        sweep.pass_drift(step, curvature.turn.as_ref());
        if let Some(by) = &step.slowed {
            sweep.pass_slowing(by, curvature.slowed.as_deref());
        }
        if step.stored::<X, U>().is_some() {
            sweep.add_stored(curvature.stored.as_deref());
        }
        if let (Some(by_pose), Some(kick)) = (&step.before, &inputs.before) {
            sweep.take_more_commands(kick);
            sweep.pass_kick(by_pose, curvature.before.as_ref());
            sweep.cross(curvature.before_commands.as_ref());
        }
        sweep.end(cost, model, policy)
    }

    /// The cost to go at the end of the stage's step, after its defect.
    #[inline(always)]
    fn begin(simd: S, cost: &mut CostToGo<X>, model: &StageModel<X, U>) -> Self {
        let hessian = load_all(simd, &cost.hessian.data.0);
        let border = load_all(simd, &cost.border.data.0);
        let mut gradient = load(simd, &cost.gradient.data.0[0]);
        let mut offset: Column<S, V> = load(simd, &cost.offset.data.0[0]);
        for c in 0..X {
            add(&mut gradient, model.defect[c], &hessian[c]);
            add(&mut offset, model.defect[c], &border[c]);
        }
        store(&gradient, &mut cost.gradient.data.0[0]);
        store(&offset, &mut cost.offset.data.0[0]);
        let last = last_row::<_, W, L>(simd, U);
        let mut mixed = [zero(simd); X];
        for (c, mixed) in mixed.iter_mut().enumerate() {
            *mixed = scaled(last, cost.gradient[c]);
        }
        let mut command = load_all(simd, &model.command.data.0);
        for (u, command) in command.iter_mut().enumerate() {
            add(command, model.command_gradient[u], &last);
        }
        Self {
            hessian,
            border,
            mixed,
            command,
            by_conditions: [zero(simd); U],
            simd,
        }
    }

    /// Adds the derivatives by the commands that act in a kick, at its end.
    #[inline(always)]
    fn take_commands(&mut self, kick: &KickInputs<U>) {
        let mut rows = [[zero(self.simd); 3]; 2];
        let mut factors = [[[0.0; X]; 3]; 2];
        for i in 0..groups(X) {
            for r in 0..3 {
                rows[i][r] = load(self.simd, &kick.rows[i][r]);
                store(&self.hessian[momentum(i) + r], &mut factors[i][r]);
            }
        }
        for c in 0..X {
            let mut mixed = self.mixed[c];
            for i in 0..groups(X) {
                for r in 0..3 {
                    add(&mut mixed, factors[i][r][c], &rows[i][r]);
                }
            }
            self.mixed[c] = mixed;
        }
        for u in 0..U {
            let (mut command, mut by_conditions) = (self.command[u], self.by_conditions[u]);
            for i in 0..groups(X) {
                for r in 0..3 {
                    let factor = kick.columns[i].data.0[u][r];
                    if factor != 0.0 {
                        let at = momentum(i) + r;
                        add(&mut command, factor, &self.mixed[at]);
                        add(&mut by_conditions, factor, &self.border[at]);
                    }
                }
            }
            (self.command[u], self.by_conditions[u]) = (command, by_conditions);
        }
    }

    /// Adds the derivatives by the commands that act on the pose of the first group.
    #[inline(always)]
    fn take_exchange(&mut self, exchange: &Exchange<U>) {
        let rows: [Column<S, W>; 3] = std::array::from_fn(|r| load(self.simd, &exchange.rows[r]));
        let mut factors = [[0.0; X]; 3];
        for r in 0..3 {
            store(&self.hessian[pose(0) + r], &mut factors[r]);
        }
        for c in 0..X {
            for r in 0..3 {
                add(&mut self.mixed[c], factors[r][c], &rows[r]);
            }
        }
        for u in 0..U {
            for r in 0..3 {
                let (factor, at) = (exchange.columns.data.0[u][r], pose(0) + r);
                add(&mut self.command[u], factor, &self.mixed[at]);
                add(&mut self.by_conditions[u], factor, &self.border[at]);
            }
        }
    }

    /// [`Sweep::take_commands`] for commands that have acted later, too.
    #[inline(always)]
    fn take_more_commands(&mut self, kick: &KickInputs<U>) {
        for i in 0..groups(X) {
            for r in 0..3 {
                let row = load(self.simd, &kick.rows[i][r]);
                let mut factors = [0.0; U];
                store(&self.mixed[momentum(i) + r], &mut factors);
                for (command, factor) in self.command.iter_mut().zip(factors) {
                    add(command, factor, &row);
                }
            }
        }
        self.take_commands(kick);
    }

    /// Goes from the end of a kick to its start.
    #[inline(always)]
    fn pass_kick(&mut self, by_pose: &Blocks, curvature: Option<&Blocks>) {
        before_kick(&mut self.border, by_pose);
        before_kick(&mut self.mixed, by_pose);
        before_kick(&mut self.hessian, by_pose);
        self.hessian = transposed(self.simd, &self.hessian);
        before_kick(&mut self.hessian, by_pose);
        if let Some(curvature) = curvature {
            for j in 0..groups(X) {
                for c in 0..3 {
                    let mut rows = [0.0; X];
                    for i in 0..groups(X) {
                        rows[pose(i)..pose(i) + 3].copy_from_slice(&curvature[i][j].data.0[c]);
                    }
                    plus(&mut self.hessian[pose(j) + c], &load(self.simd, &rows));
                }
            }
        }
    }

    /// Adds the second derivatives of a kick by the attitude and the commands, at its start.
    #[inline(always)]
    fn cross(&mut self, curvature: Option<&CommandRows>) {
        if let Some(curvature) = curvature {
            let attitude = pose(groups(X) - 1);
            for (c, rows) in curvature.iter().enumerate() {
                plus(&mut self.mixed[attitude + c], &load(self.simd, rows));
            }
        }
    }

    /// Goes from the end of the drift to its start.
    #[inline(always)]
    fn pass_drift(&mut self, step: &Linearization, curvature: Option<&TurnCurvature>) {
        let stored = step.stored::<X, U>();
        if let Some(stored) = stored {
            before_stored(&mut self.border, stored);
            before_stored(&mut self.mixed, stored);
            before_stored(&mut self.hessian, stored);
        }
        before_drift(self.simd, &mut self.border, step);
        before_drift(self.simd, &mut self.mixed, step);
        before_drift(self.simd, &mut self.hessian, step);
        self.hessian = transposed(self.simd, &self.hessian);
        if let Some(stored) = stored {
            before_stored(&mut self.hessian, stored);
        }
        before_drift(self.simd, &mut self.hessian, step);
        if let Some(curvature) = curvature {
            let [from, to] = [pose(groups(X) - 1), momentum(groups(X) - 1)];
            let TurnCurvature {
                pose_momentum,
                momentum_momentum,
            } = curvature;
            for c in 0..3 {
                let mut rows = [0.0; X];
                for r in 0..3 {
                    rows[to + r] = pose_momentum.data.0[r][c];
                }
                plus(&mut self.hessian[from + c], &load(self.simd, &rows));
                let mut rows = [0.0; X];
                rows[from..from + 3].copy_from_slice(&pose_momentum.data.0[c]);
                rows[to..to + 3].copy_from_slice(&momentum_momentum.data.0[c]);
                plus(&mut self.hessian[to + c], &load(self.simd, &rows));
            }
        }
    }

    /// Goes from the end of the drift of a center of mass with drag to its start.
    #[inline(always)]
    fn pass_slowing(&mut self, by: &Blocks, curvature: Option<&Blocks>) {
        before_slowing(self.simd, &mut self.border, by);
        before_slowing(self.simd, &mut self.mixed, by);
        before_slowing(self.simd, &mut self.hessian, by);
        self.hessian = transposed(self.simd, &self.hessian);
        before_slowing(self.simd, &mut self.hessian, by);
        let Some(curvature) = curvature else {
            return;
        };
        let places = [pose(0), momentum(0)];
        for (j, to) in places.into_iter().enumerate() {
            for c in 0..3 {
                let mut column = [0.0; X];
                for (by, from) in curvature.iter().zip(places) {
                    column[from..from + 3].copy_from_slice(&by[j].data.0[c]);
                }
                plus(&mut self.hessian[to + c], &load(self.simd, &column));
            }
        }
    }

    /// Adds the second derivatives of a drift by a stored momentum, at its start.
    #[inline(always)]
    fn add_stored(&mut self, curvature: Option<&StoredCurvature>) {
        let Some(curvature) = curvature else {
            return;
        };
        let last = groups(X) - 1;
        let [from, to, stored] = [pose(last), momentum(last), momentum(0)];
        for c in 0..3 {
            let mut column = [0.0; X];
            column[from..from + 3].copy_from_slice(&curvature.pose.data.0[c]);
            column[to..to + 3].copy_from_slice(&curvature.momentum.data.0[c]);
            column[stored..stored + 3].copy_from_slice(&curvature.stored.data.0[c]);
            plus(&mut self.hessian[stored + c], &load(self.simd, &column));
            for (at, by) in [(from, &curvature.pose), (to, &curvature.momentum)] {
                let mut column = [0.0; X];
                for r in 0..3 {
                    column[stored + r] = by.data.0[r][c];
                }
                plus(&mut self.hessian[at + c], &load(self.simd, &column));
            }
        }
    }

    /// Adds the stage's own model and chooses the commands.
    #[inline(always)]
    fn end(
        &mut self,
        cost: &mut CostToGo<X>,
        model: &StageModel<X, U>,
        policy: &mut Policy<X, U>,
    ) -> Result<(), NotConvex> {
        let simd = self.simd;
        let last = last_row::<_, W, L>(simd, U);
        for c in 0..X {
            plus(&mut self.hessian[c], &load(simd, &model.state.data.0[c]));
            plus(&mut self.mixed[c], &load(simd, &model.mixed.data.0[c]));
            add(&mut self.mixed[c], model.state_gradient[c], &last);
        }
        let mut factor: Square<U> = [[0.0; U]; U];
        let mut constant = [0.0; U];
        for u in 0..U {
            store(&self.command[u], &mut factor[u]);
            constant[u] = entry(&self.command[u], U);
        }
        if let Err(row) = factorize(&mut factor) {
            *policy = Policy::zeros();
            policy.constant = not_convex(&factor, row);
            return Err(NotConvex);
        }
        let mut by_state: [Column<S, V>; L] = transposed(simd, &self.mixed);
        let by_conditions = &mut self.by_conditions;
        for k in 0..U {
            let (own, own_conditions) = (by_state[k], by_conditions[k]);
            for i in k + 1..U {
                take(&mut by_state[i], factor[k][i], &own);
                take(&mut by_conditions[i], factor[k][i], &own_conditions);
                constant[i] -= factor[k][i] * constant[k];
            }
        }
        let mut gradient = by_state[U];
        let mut offset = load(simd, &cost.offset.data.0[0]);
        let (mut state, mut conditions) = ([zero(simd); U], [zero(simd); U]);
        for u in 0..U {
            let reciprocal = -factor[u][u];
            state[u] = scaled(by_state[u], reciprocal);
            conditions[u] = scaled(by_conditions[u], reciprocal);
            let share = reciprocal * constant[u];
            add(&mut gradient, share, &by_state[u]);
            add(&mut offset, share, &by_conditions[u]);
            constant[u] = share;
            store(&state[u], &mut policy.state.data.0[u]);
            store(&conditions[u], &mut policy.conditions.data.0[u]);
        }
        for c in 0..X {
            let mut gram: Column<S, V> = load(simd, &cost.gram.data.0[c]);
            let (mut hessian, mut border) = (self.hessian[c], self.border[c]);
            for u in 0..U {
                let by_coordinate = policy.state.data.0[u][c];
                add(&mut hessian, by_coordinate, &by_state[u]);
                add(&mut border, by_coordinate, &by_conditions[u]);
                let by_condition = policy.conditions.data.0[u][c];
                add(&mut gram, by_condition, &by_conditions[u]);
            }
            store(&gram, &mut cost.gram.data.0[c]);
            store(&hessian, &mut cost.hessian.data.0[c]);
            store(&border, &mut cost.border.data.0[c]);
        }
        // Copies one triangle to the other, because rounding would let the two drift apart.
        cost.hessian.fill_upper_triangle_with_lower_triangle();
        store(&gradient, &mut cost.gradient.data.0[0]);
        store(&offset, &mut cost.offset.data.0[0]);

        for k in (0..U).rev() {
            let (own, own_conditions) = (state[k], conditions[k]);
            for i in 0..k {
                take(&mut state[i], factor[i][k], &own);
                take(&mut conditions[i], factor[i][k], &own_conditions);
                constant[i] -= factor[i][k] * constant[k];
            }
            store(&own, &mut policy.state.data.0[k]);
            store(&own_conditions, &mut policy.conditions.data.0[k]);
        }
        policy.constant.data.0[0] = constant;
        policy.factor = factor;
        Ok(())
    }
}

/// A column of zeros except for a 1 in this row.
#[inline(always)]
fn last_row<S: Simd, const W: usize, const L: usize>(simd: S, row: usize) -> Column<S, W> {
    let mut rows = [0.0; L];
    rows[row] = 1.0;
    let mut column = zero(simd);
    for (four, rows) in column.iter_mut().zip(rows.as_chunks::<4>().0) {
        *four = fearless_simd::SimdFrom::simd_from(simd, *rows);
    }
    column
}
