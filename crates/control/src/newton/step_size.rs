//! The step size as one more unknown.
//!
//! With `h`, an iterate moves along a path on which poses stay where they are: momenta go as `1/h` and commands as `1/h²`, but for
//! the states at both ends, which stay. States and commands vary by `z + η ξ` and `v + η ξ_w`, where `η` is the change of `h` and
//! `ξ`, `ξ_w` are the derivatives of that path. A cost to go has the additional part `η (q · z + n · ν + γ) + ½ α η²`.

use std::ops::Add;

use lgvi_dynamics::BodyState;
use lgvi_dynamics::rotation::Unsolvable;
use nalgebra::{SVector, Vector3};

use super::conditions::Inequalities;
use super::iteration::Newton;
use super::problem::{Iterate, Problem};
use crate::discrete::{DiscreteDynamics, Inputs, Linearization};
use crate::riccati::{CostToGo, Policy, StageModel};

/// Steps of the sizes `h ∓ by`, for derivatives by `h`.
pub(crate) struct Beside<'p, S> {
    pub(crate) steps: [&'p S; 2],
    pub(crate) by: f64,
    /// Index of ζ in z, if the attitude is planned.
    pub(crate) attitude: Option<usize>,
}

/// How a model depends on the step size.
pub(crate) struct StepSize<const X: usize, const U: usize> {
    /// `φ_k`: the derivatives of the defects.
    defects: Vec<SVector<f64, X>>,
    /// `ω_k`: how the commands answer, `v = K z + N ν + κ + ω η`.
    answers: Vec<SVector<f64, U>>,
    /// `ξ_k`
    states: Vec<SVector<f64, X>>,
    /// `q`
    gradient: SVector<f64, X>,
    /// `n`
    conditions: SVector<f64, X>,
    /// `γ`
    slope: f64,
    /// `α`
    curvature: f64,
    /// The effects of the commands in the steps of other sizes.
    inputs: [Inputs<U>; 2],
    /// Scratch space.
    linear: [Linearization; 2],
}

/// What adds to the model of an interval: to the derivatives by the step size, once and twice, and to those of its gradients by state and
/// command.
pub(crate) struct BySize<const X: usize, const U: usize> {
    pub(crate) state: SVector<f64, X>,
    pub(crate) command: SVector<f64, U>,
    pub(crate) once: f64,
    pub(crate) twice: f64,
}

/// An interval of an iterate, for [`StepSize::enter`].
pub(super) struct Interval<'i, const X: usize, const U: usize> {
    pub(super) k: usize,
    pub(super) iterate: &'i Iterate<X, U>,
    /// `λ_k`, as far as second derivatives count.
    pub(super) costate: SVector<f64, X>,
    pub(super) model: &'i StageModel<X, U>,
    pub(super) dynamics: &'i Linearization,
    pub(super) inputs: &'i Inputs<U>,
}

impl<const X: usize, const U: usize> Default for BySize<X, U> {
    fn default() -> Self {
        Self {
            state: SVector::zeros(),
            command: SVector::zeros(),
            once: 0.0,
            twice: 0.0,
        }
    }
}

impl<const X: usize, const U: usize> Add for BySize<X, U> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            state: self.state + other.state,
            command: self.command + other.command,
            once: self.once + other.once,
            twice: self.twice + other.twice,
        }
    }
}

impl<const X: usize, const U: usize> StepSize<X, U> {
    pub(super) fn new() -> Self {
        Self {
            defects: Vec::new(),
            answers: Vec::new(),
            states: Vec::new(),
            gradient: SVector::zeros(),
            conditions: SVector::zeros(),
            slope: 0.0,
            curvature: 0.0,
            inputs: [Inputs::none(), Inputs::none()],
            linear: Default::default(),
        }
    }

    /// Begins at the end of the last of these intervals.
    pub(super) fn begin<S: DiscreteDynamics<X, U>>(
        &mut self,
        intervals: usize,
        beside: &Beside<'_, S>,
    ) {
        self.inputs = beside.steps.map(|steps| steps.inputs());
        self.defects.resize(intervals, SVector::zeros());
        self.answers.resize(intervals, SVector::zeros());
        self.states.resize(intervals + 1, SVector::zeros());
        self.gradient = SVector::zeros();
        self.conditions = SVector::zeros();
        (self.slope, self.curvature) = (0.0, 0.0);
    }

    /// Goes from the end of an interval to its start, before the commands are chosen. `cost` is the cost to go from the end. Returns the
    /// derivative of the gradient by the commands by the step size.
    pub(super) fn enter<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        beside: &Beside<'_, S>,
        inequalities: &mut Q,
        at: &Interval<'_, X, U>,
        cost: &CostToGo<X>,
    ) -> Result<SVector<f64, U>, Unsolvable>
    where
        S: DiscreteDynamics<X, U>,
        Q: Inequalities<X, U>,
    {
        let (defect, by_steps) = self.differ(problem, beside, at)?;
        let command = &at.iterate.commands[at.k];
        let along = (&self.states[at.k], &(-2.0 / problem.h * command));
        let by_stage = by_stage(problem, at, along);
        let by_rows = inequalities.by_step_size_in(at.k, command, along);
        let own = by_steps + by_stage + by_rows;

        let raised = cost.hessian * defect;
        self.slope += defect.dot(&cost.gradient) + raised.dot(&at.model.defect);
        self.slope += self.gradient.dot(&at.model.defect) + own.once;
        self.curvature += defect.dot(&raised) + 2.0 * self.gradient.dot(&defect) + own.twice;
        self.conditions += cost.border * defect;
        let (to_start, to_command) = at.dynamics.backward(at.inputs, &(self.gradient + raised));
        self.gradient = to_start + own.state;
        self.defects[at.k] = defect;
        let mut slope = to_command + own.command;
        at.dynamics.off().clear(&mut slope);
        Ok(slope)
    }

    /// `φ`, and what the second derivatives of `λ · Φ` add, by differences. Sets `ξ`.
    fn differ<S, E>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        beside: &Beside<'_, S>,
        at: &Interval<'_, X, U>,
    ) -> Result<(SVector<f64, X>, BySize<X, U>), Unsolvable>
    where
        S: DiscreteDynamics<X, U>,
    {
        let &Interval { k, iterate, .. } = at;
        let (steps, by) = (problem.steps, beside.by);
        let here = at.model.defect;
        let mut places = [SVector::zeros(); 2];
        let mut sides = [(SVector::zeros(), SVector::zeros(), SVector::zeros()); 2];
        for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
            let ratio = problem.h / (problem.h + sign * by);
            let own = beside.steps[side];
            let dynamics = &mut self.linear[side];
            let [from, to] =
                [k, k + 1].map(|at| retimed(&iterate.states[at], at, problem.intervals, ratio));
            let command = ratio * ratio * iterate.commands[k];
            let next = own.linearize(k, &from, &command, dynamics)?;
            let defect = steps.difference(&to, &next);
            let mut costate = at.costate;
            if let Some(attitude) = beside.attitude {
                let turned = (defect - here).fixed_rows::<3>(attitude).into_owned();
                turn(&turned, &mut costate, attitude);
            }
            let (by_state, by_command) = dynamics.backward(&self.inputs[side], &costate);
            sides[side] = (defect, by_state, by_command);
            places[side] = steps.difference(&iterate.states[k], &from);
        }
        let [before, after] = sides;
        let span = 2.0 * by;
        self.states[k] = (places[1] - places[0]) / span;
        let added = BySize {
            state: (after.1 - before.1) / span,
            command: (after.2 - before.2) / span,
            once: 0.0,
            twice: at.costate.dot(&(before.0 + after.0 - 2.0 * here)) / (by * by),
        };
        Ok(((after.0 - before.0) / span, added))
    }

    /// Goes on to the start of the interval, with the policy of its commands and what [`StepSize::enter`] returned.
    pub(super) fn leave(&mut self, k: usize, policy: &Policy<X, U>, slope: &SVector<f64, U>) {
        self.gradient += policy.state * slope;
        self.conditions += policy.conditions * slope;
        self.slope += policy.constant.dot(slope);
        self.answers[k] = policy.answer(slope);
        self.curvature += slope.dot(&self.answers[k]);
    }

    /// The first and the second derivative of the model's minimum by the step size, and the multipliers at the present size and their
    /// change with it. Returns `None` if the commands cannot meet the conditions independently.
    pub(crate) fn reduced(&self, start: &CostToGo<X>) -> Option<([f64; 2], [SVector<f64, X>; 2])> {
        let nu = [start.multipliers()?, start.correction(&self.conditions)?];
        let slope = self.slope + self.conditions.dot(&nu[0]);
        let curvature = self.curvature + self.conditions.dot(&nu[1]);
        Some(([slope, curvature], nu))
    }

    /// `φ_k`, `ω_k`
    pub(super) fn answer(&self, k: usize) -> (&SVector<f64, X>, &SVector<f64, U>) {
        (&self.defects[k], &self.answers[k])
    }

    /// `ξ_k`
    pub(super) fn along(&self, k: usize) -> &SVector<f64, X> {
        &self.states[k]
    }
}

/// What the cost of an interval and its inequalities add, where its state and its command change `along` the path.
fn by_stage<S, E, const X: usize, const U: usize>(
    problem: &Problem<'_, S, E, X, U>,
    at: &Interval<'_, X, U>,
    (xi, xi_w): (&SVector<f64, X>, &SVector<f64, U>),
) -> BySize<X, U> {
    let (h, model) = (problem.h, at.model);
    let command = &at.iterate.commands[at.k];
    let rate = problem.weight * command;
    let state = model.state * xi + model.mixed.tr_mul(xi_w);
    let by_command = model.mixed * xi + model.command * xi_w;
    let [by_path, by_path_w] = [
        model.state_gradient.dot(xi),
        model.command_gradient.dot(xi_w),
    ];
    // The path bends: its second derivatives are `−2 ξ/h` and `−3 ξ_w/h`.
    let bent = -(2.0 * by_path + 3.0 * by_path_w) / h;
    BySize {
        state,
        command: by_command + rate,
        once: by_path + by_path_w + 0.5 * command.dot(&rate),
        twice: xi.dot(&state) + xi_w.dot(&by_command) + 2.0 * xi_w.dot(&rate) + bent,
    }
}

/// Turns a costate with an attitude that is turned by a small rotation: `ln(exp(ρ) exp(ζ)) = ρ + (1 + ½ S(ρ)) ζ + …`.
fn turn<const X: usize>(by: &Vector3<f64>, costate: &mut SVector<f64, X>, attitude: usize) {
    let mut own = costate.fixed_rows_mut::<3>(attitude);
    let turned = own.clone_owned() - 0.5 * by.cross(&own);
    own.copy_from(&turned);
}

/// State number `at` of an iterate over these intervals if the step size is divided by `ratio`.
fn retimed(state: &BodyState, at: usize, intervals: usize, ratio: f64) -> BodyState {
    let mut state = *state;
    if at > 0 && at < intervals {
        state.linear_momentum *= ratio;
        state.angular_momentum *= ratio;
    }
    state
}

impl<const X: usize, const U: usize> Newton<X, U> {
    /// Sets the direction for multipliers `nu` and a change of the step size from `h`.
    pub(crate) fn direct_with_step_size(
        &mut self,
        (change, h): (f64, f64),
        nu: SVector<f64, X>,
        inequalities: &mut impl Inequalities<X, U>,
    ) {
        let from = &self.iterate;
        let direction = &mut self.direction;
        direction.solve_with_step_size(&self.model, (change, h), nu, from, inequalities);
    }
}

impl<const X: usize, const U: usize> Iterate<X, U> {
    /// The iterate if the step size is divided by `ratio`.
    pub(crate) fn retimed(&self, ratio: f64) -> Self {
        let intervals = self.commands.len();
        let states = self.states.iter().enumerate();
        Self {
            states: states
                .map(|(at, state)| retimed(state, at, intervals, ratio))
                .collect(),
            commands: self.commands.iter().map(|w| ratio * ratio * w).collect(),
            nu: self.nu,
        }
    }
}
