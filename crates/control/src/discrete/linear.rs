//! First derivatives of a step in factors: those of its kicks and of its drift.
//!
//! For variations `p` of pose, `m` of momentum and `v` of command a kick is `m⁺ = m + T p + τ B v` with `T = τ G`. A drift
//! is `p⁺ = P_p p + P_m m`, `m⁺ = M_m m`. The product of the factors is never formed: it has many more entries.

use std::borrow::Cow;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::stored::{SPINNING, StoredCurvature, StoredTurn};
use crate::problem::Off;

/// Derivatives of two groups of three coordinates by as many. A motion of one group uses the first block only.
pub(crate) type Blocks = [[Matrix3<f64>; 2]; 2];

/// The index in `z` of the pose of a group.
pub(crate) const fn pose(group: usize) -> usize {
    6 * group
}

/// The index in `z` of the momentum of a group.
pub(crate) const fn momentum(group: usize) -> usize {
    6 * group + 3
}

/// The number of lanes for commands.
pub(crate) const LANES: usize = 16;

/// Numbers by commands, with zeros beyond the last one, for each of three coordinates.
pub(crate) type CommandRows = [[f64; LANES]; 3];

/// The rows of a matrix.
pub(crate) fn command_rows<const U: usize>(matrix: &SMatrix<f64, 3, U>) -> CommandRows {
    const { assert!(U < LANES) };
    let mut rows = [[0.0; LANES]; 3];
    for (r, row) in rows.iter_mut().enumerate() {
        for (entry, column) in row.iter_mut().zip(&matrix.data.0) {
            *entry = column[r];
        }
    }
    rows
}

/// What the commands do in a kick.
#[derive(Clone, Debug)]
pub(crate) struct KickInputs<const U: usize> {
    /// `τ B`, by groups.
    pub(crate) columns: [SMatrix<f64, 3, U>; 2],
    /// The same by rows.
    pub(crate) rows: [CommandRows; 2],
}

impl<const U: usize> KickInputs<U> {
    pub(crate) fn new(columns: [SMatrix<f64, 3, U>; 2]) -> Self {
        let rows = columns.each_ref().map(command_rows);
        Self { columns, rows }
    }

    /// The effects where some commands are off, and forces turn with a body in this attitude, if there is one.
    fn of(&self, attitude: Option<&Matrix3<f64>>, off: Off) -> Self {
        let mut columns = self.columns;
        if let Some(attitude) = attitude {
            columns[0] = attitude * columns[0];
        }
        for columns in &mut columns {
            off.clear_columns(columns);
        }
        Self::new(columns)
    }
}

/// What the commands do to the pose of the first group, which nothing else moves: momenta that wheels exchange among each
/// other are in its place.
#[derive(Clone, Debug)]
pub(crate) struct Exchange<const U: usize> {
    /// `h N`
    pub(crate) columns: SMatrix<f64, 3, U>,
    /// The same by rows.
    pub(crate) rows: CommandRows,
}

impl<const U: usize> Exchange<U> {
    pub(crate) fn new(columns: SMatrix<f64, 3, U>) -> Self {
        Self {
            rows: command_rows(&columns),
            columns,
        }
    }

    /// The effects where some commands are off.
    fn of(&self, off: Off) -> Self {
        let mut columns = self.columns;
        off.clear_columns(&mut columns);
        Self::new(columns)
    }
}

/// What the commands do in every step.
#[derive(Clone, Debug)]
pub(crate) struct Inputs<const U: usize> {
    /// In the kick before the drift, if there is one.
    pub(crate) before: Option<KickInputs<U>>,
    /// In the kick after the drift.
    pub(crate) after: KickInputs<U>,
    /// Beside the kicks, if they do anything there.
    pub(crate) exchange: Option<Box<Exchange<U>>>,
}

impl<const U: usize> Inputs<U> {
    /// Commands without effect.
    pub(crate) fn none() -> Self {
        Self {
            before: Some(KickInputs::new([SMatrix::zeros(); 2])),
            after: KickInputs::new([SMatrix::zeros(); 2]),
            exchange: None,
        }
    }

    /// What the commands do to the pose of the first of the groups of `X` coordinates.
    #[inline(always)]
    pub(crate) fn exchange<const X: usize>(&self) -> Option<&Exchange<U>> {
        if groups(X) < 2 || U < SPINNING {
            None
        } else {
            self.exchange.as_deref()
        }
    }

    /// The effects in a step where they are other ones.
    #[cold]
    #[inline(never)]
    fn of(&self, own: &OwnInputs) -> Self {
        let [begun, drifted] = [0, 1].map(|kick| own.frames.as_ref().map(|frames| &frames[kick]));
        Self {
            before: self.before.as_ref().map(|kick| kick.of(begun, own.off)),
            after: self.after.of(drifted, own.off),
            exchange: self
                .exchange
                .as_ref()
                .map(|exchange| Box::new(exchange.of(own.off))),
        }
    }
}

/// How the effects of the commands in a step differ from those in other steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OwnInputs {
    /// The attitudes at the two kicks, if forces turn with the body.
    pub(crate) frames: Option<[Matrix3<f64>; 2]>,
    /// The commands that are off.
    pub(crate) off: Off,
}

/// First derivatives of the rotation of a drift.
#[derive(Clone, Debug)]
pub(crate) struct Turn {
    /// `P_p = Fᵀ`
    pub(crate) pose: Matrix3<f64>,
    /// `P_m = Ξ`
    pub(crate) pose_by_momentum: Matrix3<f64>,
    /// `M_m = Fᵀ + S(P) Ξ`
    pub(crate) momentum: Matrix3<f64>,
}

/// First derivatives of a step, `z⁺ = A z + B v`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Linearization {
    /// `T` of the kick before the drift, if there is one.
    pub(crate) before: Option<Blocks>,
    /// `P_m = (h/m) I` of the first group, if it is the center of mass of a body without drag. It has `P_p = M_m = I`.
    pub(crate) glide: Option<f64>,
    /// The drift of the first group by its pose and momentum, if it is the center of mass of a body with drag.
    pub(crate) slowed: Option<Box<Blocks>>,
    /// The drift of the last group, if it is the attitude.
    pub(crate) turn: Option<Turn>,
    /// What the momentum of the first group does in this drift, if it is stored in the body. The group then does not glide.
    pub(crate) stored: Option<Box<StoredTurn>>,
    /// `T` of the kick after the drift.
    pub(crate) after: Blocks,
    /// How the effects of the commands differ, if they do.
    pub(crate) own: Option<OwnInputs>,
}

fn part<const X: usize>(z: &SVector<f64, X>, at: usize) -> Vector3<f64> {
    z.fixed_rows::<3>(at).into_owned()
}

fn add<const X: usize>(z: &mut SVector<f64, X>, at: usize, what: &Vector3<f64>) {
    let mut rows = z.fixed_rows_mut::<3>(at);
    rows += what;
}

/// The number of groups among `X` coordinates.
pub(crate) const fn groups(coordinates: usize) -> usize {
    coordinates / 6
}

impl Linearization {
    /// What a stored momentum does in the drift, under `U` commands.
    #[inline(always)]
    pub(crate) fn stored<const X: usize, const U: usize>(&self) -> Option<&StoredTurn> {
        if groups(X) < 2 || U < SPINNING {
            None
        } else {
            self.stored.as_deref()
        }
    }

    /// The effects of the commands in this step; `inputs` are those in the body's own axes, with all commands on.
    #[inline]
    pub(crate) fn inputs<'i, const U: usize>(&self, inputs: &'i Inputs<U>) -> Cow<'i, Inputs<U>> {
        match &self.own {
            None => Cow::Borrowed(inputs),
            Some(own) => Cow::Owned(inputs.of(own)),
        }
    }

    /// The commands that are off in this step.
    #[inline]
    pub(crate) fn off(&self) -> Off {
        match &self.own {
            None => Off::NONE,
            Some(own) => own.off,
        }
    }

    /// `A z + B v`
    #[inline]
    pub(crate) fn forward<const X: usize, const U: usize>(
        &self,
        inputs: &Inputs<U>,
        z: &SVector<f64, X>,
        v: &SVector<f64, U>,
    ) -> SVector<f64, X> {
        let inputs = &*self.inputs(inputs);
        let mut z = *z;
        let kick =
            |z: &mut SVector<f64, X>, t: &Blocks, KickInputs { columns, .. }: &KickInputs<U>| {
                for i in 0..groups(X) {
                    let mut impulse = columns[i] * v;
                    for (j, t) in t[i].iter().enumerate().take(groups(X)) {
                        impulse += t * part(z, pose(j));
                    }
                    add(z, momentum(i), &impulse);
                }
            };
        if let (Some(t), Some(inputs)) = (&self.before, &inputs.before) {
            kick(&mut z, t, inputs);
        }
        if let Some(by_momentum) = self.glide {
            let moved = by_momentum * part(&z, momentum(0));
            add(&mut z, pose(0), &moved);
        } else if let Some(by) = &self.slowed {
            let from = [part(&z, pose(0)), part(&z, momentum(0))];
            for (at, by) in [pose(0), momentum(0)].into_iter().zip(&**by) {
                let moved = by[0] * from[0] + by[1] * from[1];
                z.fixed_rows_mut::<3>(at).copy_from(&moved);
            }
        }
        if let Some(turn) = &self.turn {
            let last = groups(X) - 1;
            let (zeta, delta) = (part(&z, pose(last)), part(&z, momentum(last)));
            let moved = turn.pose * zeta + turn.pose_by_momentum * delta;
            z.fixed_rows_mut::<3>(pose(last)).copy_from(&moved);
            z.fixed_rows_mut::<3>(momentum(last))
                .copy_from(&(turn.momentum * delta));
            if let Some(StoredTurn {
                pose: by,
                momentum: also,
            }) = self.stored::<X, U>()
            {
                let stored = part(&z, momentum(0));
                add(&mut z, pose(last), &(by * stored));
                add(&mut z, momentum(last), &(also * stored));
            }
        }
        kick(&mut z, &self.after, &inputs.after);
        if let Some(Exchange { columns, .. }) = inputs.exchange::<X>() {
            add(&mut z, pose(0), &(columns * v));
        }
        z
    }

    /// `Aᵀ λ` and `Bᵀ λ`
    #[inline]
    pub(crate) fn backward<const X: usize, const U: usize>(
        &self,
        inputs: &Inputs<U>,
        lambda: &SVector<f64, X>,
    ) -> (SVector<f64, X>, SVector<f64, U>) {
        let inputs = &*self.inputs(inputs);
        let mut lambda = *lambda;
        let mut by_command = match inputs.exchange::<X>() {
            Some(Exchange { columns, .. }) => columns.tr_mul(&part(&lambda, pose(0))),
            None => SVector::zeros(),
        };
        let mut kick = |lambda: &mut SVector<f64, X>,
                        t: &Blocks,
                        KickInputs { columns, .. }: &KickInputs<U>| {
            for i in 0..groups(X) {
                let by_momentum = part(lambda, momentum(i));
                by_command += columns[i].tr_mul(&by_momentum);
                for (j, t) in t[i].iter().enumerate().take(groups(X)) {
                    add(lambda, pose(j), &t.tr_mul(&by_momentum));
                }
            }
        };
        kick(&mut lambda, &self.after, &inputs.after);
        self.before_drift(&mut lambda, self.stored::<X, U>());
        if let (Some(t), Some(inputs)) = (&self.before, &inputs.before) {
            kick(&mut lambda, t, inputs);
        }
        (lambda, by_command)
    }

    /// Turns a gradient by the state at the end of the drift into that by the state at its beginning.
    #[inline]
    fn before_drift<const X: usize>(
        &self,
        lambda: &mut SVector<f64, X>,
        stored: Option<&StoredTurn>,
    ) {
        if let Some(by_momentum) = self.glide {
            let moved = by_momentum * part(lambda, pose(0));
            add(lambda, momentum(0), &moved);
        } else if let Some(by) = &self.slowed {
            let from = [part(lambda, pose(0)), part(lambda, momentum(0))];
            for (column, at) in [pose(0), momentum(0)].into_iter().enumerate() {
                let moved = by[0][column].tr_mul(&from[0]) + by[1][column].tr_mul(&from[1]);
                lambda.fixed_rows_mut::<3>(at).copy_from(&moved);
            }
        }
        if let Some(turn) = &self.turn {
            let last = groups(X) - 1;
            let (by_pose, by_momentum) = (part(lambda, pose(last)), part(lambda, momentum(last)));
            if let Some(stored) = stored {
                let moved = stored.pose.tr_mul(&by_pose) + stored.momentum.tr_mul(&by_momentum);
                add(lambda, momentum(0), &moved);
            }
            let moved = turn.pose_by_momentum.tr_mul(&by_pose) + turn.momentum.tr_mul(&by_momentum);
            lambda
                .fixed_rows_mut::<3>(pose(last))
                .copy_from(&turn.pose.tr_mul(&by_pose));
            lambda.fixed_rows_mut::<3>(momentum(last)).copy_from(&moved);
        }
    }

    /// The gradients `λ` by the state at the end of the drift and at its beginning, from that at the end of the step.
    #[inline]
    pub(super) fn about_drift<const X: usize, const U: usize>(
        &self,
        lambda: &SVector<f64, X>,
    ) -> [SVector<f64, X>; 2] {
        let mut after = *lambda;
        for i in 0..groups(X) {
            let by_momentum = part(lambda, momentum(i));
            for j in 0..groups(X) {
                add(&mut after, pose(j), &self.after[i][j].tr_mul(&by_momentum));
            }
        }
        let mut before = after;
        self.before_drift(&mut before, self.stored::<X, U>());
        [after, before]
    }

    /// The changes at the end of the step for changes of the first group's pose and momentum at the end of the drift.
    pub(crate) fn after_drift<const X: usize>(
        &self,
        [by_pose, by_momentum]: &[Vector3<f64>; 2],
    ) -> SVector<f64, X> {
        let mut z = SVector::zeros();
        add(&mut z, pose(0), by_pose);
        add(&mut z, momentum(0), by_momentum);
        for (i, row) in self.after.iter().enumerate().take(groups(X)) {
            add(&mut z, momentum(i), &(row[0] * by_pose));
        }
        z
    }

    /// `B`
    pub(crate) fn by_command<const X: usize, const U: usize>(
        &self,
        inputs: &Inputs<U>,
    ) -> SMatrix<f64, X, U> {
        let mut b = SMatrix::<f64, X, U>::zeros();
        for command in 0..U {
            let mut unit = SVector::zeros();
            unit[command] = 1.0;
            b.set_column(command, &self.forward(inputs, &SVector::zeros(), &unit));
        }
        b
    }
}

/// Second derivatives of the product of multipliers and a step, in factors: each by the variations before its own part.
#[derive(Clone, Debug, Default)]
pub(crate) struct Curvature {
    /// Of the kick before the drift, by poses.
    pub(crate) before: Option<Blocks>,
    /// Of the drift of the center of mass with drag, by its pose and momentum.
    pub(crate) slowed: Option<Box<Blocks>>,
    /// Of the rotation.
    pub(crate) turn: Option<TurnCurvature>,
    /// Of the rotation, by the momentum of the first group, if that is stored in the body.
    pub(crate) stored: Option<Box<StoredCurvature>>,
    /// Of the kick after the drift, by poses.
    pub(crate) after: Option<Blocks>,
    /// Of the kick before the drift, by the attitude and the commands, if forces turn with the body.
    pub(crate) before_commands: Option<CommandRows>,
    /// Of the kick after the drift, by the attitude and the commands, if forces turn with the body.
    pub(crate) after_commands: Option<CommandRows>,
}

/// Second derivatives of the rotation of a drift. Those by pose twice are zero.
#[derive(Clone, Debug)]
pub(crate) struct TurnCurvature {
    pub(crate) pose_momentum: Matrix3<f64>,
    /// Symmetric.
    pub(crate) momentum_momentum: Matrix3<f64>,
}
