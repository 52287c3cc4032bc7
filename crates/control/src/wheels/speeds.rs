//! Limits on the speeds of wheels, as a transfer of a gyrostat states them.
//!
//! The momenta of the wheels are `h = A⁺ s + Z q`: `A` holds their axes, so that `s = A h` is what they store, and the columns of
//! `Z`, orthonormal, span what stores nothing. `q = Zᵀ h` is what the wheels exchange among each other, `q̇ = Zᵀ u`.

use std::sync::Arc;

use lgvi_dynamics::wheels::ReactionWheel;
use nalgebra::{SMatrix, SVD, SVector, Vector3};

use super::flight;
use crate::problem::WheelSpeed;
use crate::solver::PlanError;
use crate::{Command, MAX_COMMANDS, Plan, Transfer};

/// The part of the greatest singular value of `A` below which wheels store nothing along a direction.
const RANK: f64 = 1e-9;

/// The part of its limit that a speed stays below it, twice what plans violate inequalities by.
const MARGIN: f64 = 2e-9;

/// The part of its limit from which on a speed counts as having reached it.
const REACHED: f64 = 0.99;

/// Most iterations for singular values, which converge in a few.
const PATIENCE: usize = 1000;

type Columns = SMatrix<f64, 3, MAX_COMMANDS>;

/// The wheels of a transfer that have limits of speed, and how states tell their momenta.
pub(super) struct Speeds {
    limits: Vec<Limited>,
    /// `A⁺ᵀ`
    by_stored: Columns,
    /// `Zᵀ`; `None` if the wheels cannot exchange momenta.
    exchange: Option<Columns>,
}

struct Limited {
    wheel: usize,
    limit: f64,
}

impl Speeds {
    /// Returns `None` if no wheel has a limit, or if more than three momenta can be exchanged.
    pub(super) fn of(transfer: &Transfer) -> Option<Self> {
        let wheels = transfer.body.wheels()?;
        let rate = transfer.initial.angular_velocity(&transfer.body);
        let limits = wheels.wheels().iter().enumerate();
        let limits = limits.filter(|(_, wheel)| wheel.max_speed.is_finite());
        let limits: Vec<_> = limits
            .map(|(wheel, own)| Limited {
                wheel,
                limit: own.max_speed.max(wheels.speed(wheel, &rate).abs()),
            })
            .collect();
        if limits.is_empty() {
            return None;
        }
        let (by_stored, exchange) = split(wheels.wheels())?;
        Some(Self {
            limits,
            by_stored,
            exchange,
        })
    }

    /// A transfer of a gyrostat along an orbit, under the limits.
    pub(super) fn impose(&self, transfer: &Transfer, stated: &mut Transfer) {
        let (Some(wheels), Some(orbit)) = (transfer.body.wheels(), &stated.orbit) else {
            return;
        };
        let inverse = transfer.body.inertia().inverse();
        if let Some(exchange) = &self.exchange {
            stated.inequalities = stated.inequalities.along(orbit);
            stated.exchange = Some(Arc::new(*exchange));
            stated.initial.position = exchange * flight::momenta(transfer, 0.0, &[])[0];
        }
        let first = self.first_index(transfer);
        for (at, Limited { wheel, limit }) in self.limits.iter().enumerate() {
            let own = &wheels.wheels()[*wheel];
            let ReactionWheel { axis, inertia, .. } = own;
            let by = |columns: &Columns| columns.column(*wheel) / *inertia;
            let by_momenta = [
                self.exchange.as_ref().map_or_else(Vector3::zeros, by),
                by(&self.by_stored),
                -(inverse * axis),
            ];
            let mut per_time = Command::zeros();
            per_time[*wheel] = own.per_torque(inverse);
            let limit = (1.0 - MARGIN) * limit;
            let row = WheelSpeed::new(first + at, by_momenta, per_time, limit);
            stated.inequalities.wheels.push(row);
        }
    }

    fn first_index(&self, transfer: &Transfer) -> usize {
        transfer.inequalities.next_index()
    }

    /// A plan along the orbit as one of the transfer that [`impose`](Self::impose) states.
    pub(super) fn entered(&self, transfer: &Transfer, mut plan: Plan) -> Plan {
        if let Some(exchange) = &self.exchange {
            let momenta = flight::momenta(transfer, plan.h, &plan.commands);
            for (state, momenta) in plan.states.iter_mut().zip(&momenta) {
                state.position = exchange * momenta;
            }
        }
        plan
    }

    /// Whether a plan takes a wheel to its limit, or nearly.
    pub(super) fn are_reached(&self, transfer: &Transfer, plan: &Plan) -> bool {
        let body = &transfer.body;
        let Some(wheels) = body.wheels() else {
            return false;
        };
        let momenta = flight::momenta(transfer, plan.h, &plan.commands);
        let steps = momenta.iter().zip(&plan.states).zip(&plan.commands);
        steps.into_iter().any(|((momenta, state), command)| {
            let rate = state.angular_velocity(body);
            self.limits.iter().any(|&Limited { wheel, limit }| {
                let own = &wheels.wheels()[wheel];
                let speed = momenta[wheel] / own.inertia - own.axis.dot(&rate);
                let per_torque = own.per_torque(body.inertia().inverse());
                let reached = speed + plan.h * per_torque * command[wheel];
                reached.abs() > REACHED * limit
            })
        })
    }

    /// The error, with the wheel where it names its limit.
    pub(super) fn named(&self, transfer: &Transfer, error: PlanError) -> PlanError {
        let PlanError::NotFound {
            constraint,
            step,
            violation,
        } = error
        else {
            return error;
        };
        let at = constraint.checked_sub(self.first_index(transfer));
        match at.and_then(|at| self.limits.get(at)) {
            Some(Limited { wheel, limit }) => PlanError::WheelSpeed {
                wheel: *wheel,
                step,
                speed: limit * (1.0 + violation),
                limit: *limit,
            },
            None => error,
        }
    }
}

/// `A⁺ᵀ` and `Zᵀ` of wheels; `None` if `Z` has more than three columns.
fn split(wheels: &[ReactionWheel]) -> Option<(Columns, Option<Columns>)> {
    let mut axes = Columns::zeros();
    for (mut column, wheel) in axes.column_iter_mut().zip(wheels) {
        column.copy_from(&wheel.axis);
    }
    let SVD {
        u: Some(left),
        v_t: Some(right),
        singular_values,
    } = SVD::try_new(axes, true, true, f64::EPSILON, PATIENCE)?
    else {
        return None;
    };
    let least = RANK * singular_values.max();
    let mut by_stored = Columns::zeros();
    let mut basis: Vec<Command> = Vec::new();
    for (at, size) in singular_values.iter().enumerate() {
        if *size > least {
            let direction = right.row(at).transpose();
            by_stored += left.column(at) * direction.transpose() / *size;
            basis.push(direction);
        }
    }
    let stored = basis.len();
    let free = wheels.len() - stored;
    if free > 3 {
        return None;
    }
    let mut exchange = Columns::zeros();
    for row in 0..free {
        let rests = (0..wheels.len()).map(|wheel| apart(&basis, wheel));
        let most = rests.max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
        let direction = most.normalize();
        exchange.set_row(row, &direction.transpose());
        basis.push(direction);
    }
    Some((by_stored, (free > 0).then_some(exchange)))
}

/// The unit vector of a wheel without its parts along an orthonormal basis.
fn apart(basis: &[Command], wheel: usize) -> Command {
    let mut rest: Command = SVector::zeros();
    rest[wheel] = 1.0;
    // Each projection is applied twice against rounding errors.
    for direction in basis.iter().chain(basis) {
        rest -= direction * direction.dot(&rest);
    }
    rest
}
