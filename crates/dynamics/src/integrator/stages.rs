use super::flow::{Components, Flow, place};
use super::tableau::{Row, Stage};
use crate::{Load, System};

/// Stages of a Runge–Kutta method: derivatives `k_i = f(y + h Σ_j a_ij k_j)` and their weighted sums.
pub(super) struct Stages {
    flow: Flow,
    /// Derivatives, ordered by stage, then by body.
    k: Vec<Components>,
    bodies: usize,
}

impl Stages {
    pub(super) fn new(stages: usize, bodies: usize) -> Self {
        Self {
            flow: Flow::new(bodies),
            k: vec![[0.0; 18]; stages * bodies],
            bodies,
        }
    }

    /// Sets the controls.
    pub(super) fn set_controls(&mut self, controls: &[Load]) {
        self.flow.set_controls(controls);
    }

    pub(super) fn controls(&self) -> &[Load] {
        self.flow.controls()
    }

    /// The derivatives of one stage.
    pub(super) fn derivative(&self, stage: usize) -> &[Components] {
        &self.k[stage * self.bodies..][..self.bodies]
    }

    /// Copies the derivatives of stage `from` to stage `to`.
    pub(super) fn reuse(&mut self, from: usize, to: usize) {
        let first = from * self.bodies;
        self.k
            .copy_within(first..first + self.bodies, to * self.bodies);
    }

    /// Evaluates stage `index` of a step `h` from `y`, using the earlier stages.
    pub(super) fn evaluate(
        &mut self,
        system: &mut System,
        y: &[Components],
        h: f64,
        stage: &Stage,
        index: usize,
    ) {
        let (bodies, row) = (self.bodies, stage.row);
        let (known, rest) = self.k.split_at_mut(index * bodies);
        let at = |body: usize, at: &mut Components| {
            sum_to(known, bodies, body, row, at);
            advance(&y[body], h, at);
        };
        self.flow
            .evaluate(system, y, stage.node * h, at, &mut rest[..bodies]);
    }

    /// Evaluates stage `index` at `y`.
    pub(super) fn evaluate_at(&mut self, system: &mut System, y: &[Components], index: usize) {
        let derivative = &mut self.k[index * self.bodies..][..self.bodies];
        self.flow
            .evaluate(system, y, 0.0, |body, at| *at = y[body], derivative);
    }

    /// Sets `end` to the result of a step `h` from `y` with these weights.
    pub(super) fn finish(
        &self,
        system: &System,
        y: &[Components],
        h: f64,
        weights: Row,
        end: &mut [Components],
    ) {
        for (index, (body, end)) in system.bodies().iter().zip(end).enumerate() {
            place(body, &y[index], h, end, |end| {
                self.sum(index, weights, end);
                advance(&y[index], h, end);
            });
        }
    }

    /// Sets `total` to `Σ_j b_j k_j` of a body.
    #[inline]
    pub(super) fn sum(&self, body: usize, row: Row, total: &mut Components) {
        sum_to(&self.k, self.bodies, body, row, total);
    }
}

#[inline]
fn sum_to(k: &[Components], bodies: usize, body: usize, row: Row, total: &mut Components) {
    total.fill(0.0);
    for &(stage, weight) in row {
        let k = &k[stage * bodies + body];
        for (total, k) in total.iter_mut().zip(k) {
            *total += weight * k;
        }
    }
}

/// Replaces a derivative `k` by `y + h k`.
#[inline]
pub(super) fn advance(y: &Components, h: f64, k: &mut Components) {
    for (k, y) in k.iter_mut().zip(y) {
        *k = y + h * *k;
    }
}
