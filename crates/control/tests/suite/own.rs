//! User-defined constraints and terminal conditions.

use std::ops::RangeInclusive;

use lgvi_control::constraint::{
    CommandConstraint, CommandInequality, Coordinates, KeepOutSphere, NormLimit, StateConstraint,
};
use lgvi_control::terminal::{FinalPosition, Row, TerminalCondition};
use lgvi_control::{
    Actuation, Constraint, Motion, NewtonSettings, Place, Plan, Start, Terminal, Transfer,
    TransferError, solve,
};
use lgvi_dynamics::gravity::{AutoDiff, Central, Potential, Uniform};
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use num_dual::DualNum;

use crate::automatic::{Number, derivatives};
use crate::case::Case;

const N: usize = 40;
const H: f64 = 0.05;

/// Keeps out of `|A (x − c)| < 1` from the time fraction `from` on: `g = ½ (1 − |A (x − c)|²)`.
#[derive(Clone, Debug, PartialEq)]
struct Ellipsoid {
    center: Vector3<f64>,
    /// `A`
    shape: Matrix3<f64>,
    from: f64,
}

impl StateConstraint for Ellipsoid {
    fn name(&self) -> &'static str {
        "keep_out_ellipsoid"
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::Position
    }

    fn applies(&self) -> RangeInclusive<f64> {
        self.from..=1.0
    }

    fn value(&self, state: &BodyState) -> f64 {
        0.5 * (1.0 - (self.shape * (state.position - self.center)).norm_squared())
    }

    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        let hessian = -self.shape.tr_mul(&self.shape);
        (hessian * (state.position - self.center), hessian)
    }

    fn size(&self) -> f64 {
        1.0 / self.shape.norm()
    }
}

/// Ends at a given distance from a point with any momentum: `c = ½ (|x − p|²/r² − 1)`.
#[derive(Clone, Debug, PartialEq)]
struct Distance {
    point: Vector3<f64>,
    distance: f64,
}

impl TerminalCondition for Distance {
    fn name(&self) -> &'static str {
        "a distance"
    }

    fn place(&self) -> Place {
        Place::Position
    }

    fn rows(&self) -> [Row; 6] {
        let mut rows = [Row::None; 6];
        rows[0] = Row::Number;
        rows
    }

    fn residual(&self, end: &BodyState) -> SVector<f64, 6> {
        let arm = (end.position - self.point) / self.distance;
        SVector::ith(0, 0.5 * (arm.norm_squared() - 1.0))
    }

    fn jacobian(&self, end: &BodyState) -> SMatrix<f64, 6, 6> {
        let gradient = (end.position - self.point) / (self.distance * self.distance);
        let mut jacobian = SMatrix::<f64, 6, 6>::zeros();
        jacobian
            .fixed_view_mut::<1, 3>(0, 0)
            .copy_from(&gradient.transpose());
        jacobian
    }

    fn curvature(&self, _: &BodyState, nu: &SVector<f64, 6>) -> SMatrix<f64, 6, 6> {
        let curvature = nu[0] / (self.distance * self.distance);
        SMatrix::from_fn(|i, j| if i == j && i < 3 { curvature } else { 0.0 })
    }
}

/// A limit on the norm of the force, like [`NormLimit`].
#[derive(Debug, PartialEq)]
struct Thrust(f64);

impl CommandConstraint for Thrust {
    fn name(&self) -> &'static str {
        "thrust"
    }

    fn inequalities(&self, actuation: &Actuation) -> Vec<CommandInequality> {
        let forces = actuation.matrix().fixed_rows::<3>(0).into_owned();
        vec![CommandInequality::norm(&(forces / self.0))]
    }

    fn place(&self) -> Option<Place> {
        Some(Place::Position)
    }
}

fn at(position: Vector3<f64>, velocity: Vector3<f64>) -> BodyState {
    BodyState {
        position,
        linear_momentum: velocity,
        attitude: Matrix3::identity(),
        angular_momentum: Vector3::zeros(),
    }
}

/// A transfer of the center of mass alone, with unit mass and without gravity.
fn free<T>(initial: BodyState, target: T, weight: &Matrix3<f64>) -> Transfer
where
    T: TryInto<Terminal, Error: Into<TransferError>>,
{
    let inertia = Inertia::principal([1.0, 1.4, 1.9]).expect("inertia");
    let body = RigidBody::new(1.0, inertia, Vec::new()).expect("a body");
    let actuation = Actuation::full(weight, &Matrix3::identity()).expect("weights");
    let field = Uniform {
        acceleration: Vector3::zeros(),
    };
    Transfer::new(body, field, H, N, initial, target, actuation)
        .expect("a transfer")
        .with_motion(Motion::Translation)
}

fn plan(transfer: &Transfer) -> Plan {
    let plan = solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true);
    let plan = plan.expect("a plan");
    let found = &plan.certificate;
    assert!(
        found.stationarity <= 1e-8 && found.terminal <= 1e-12 && found.sufficient,
        "{found:?}"
    );
    plan
}

fn apart(a: &Plan, b: &Plan) -> f64 {
    let states = a.states.iter().zip(&b.states);
    let apart = states.map(|(a, b)| (a.position - b.position).norm());
    apart.fold((a.cost / b.cost - 1.0).abs(), f64::max)
}

const CENTER: Vector3<f64> = Vector3::new(1.0, 0.06, -0.04);

fn across() -> [BodyState; 2] {
    [0.0, 2.0].map(|x| at(Vector3::new(x, 0.0, 0.0), Vector3::zeros()))
}

#[test]
fn derivatives_of_own_conditions_are_those_of_automatic_differentiation() {
    let x = Vector3::new(0.3, -0.7, 1.1);
    let state = at(x, Vector3::zeros());
    let center = CENTER;
    let shape = Matrix3::new(2.0, 0.3, 0.0, -0.4, 1.5, 0.2, 0.1, 0.0, 3.0);
    let ellipsoid = Ellipsoid {
        center,
        shape,
        from: 0.0,
    };
    let (value, gradient, hessian) = derivatives(&state, |s| {
        let x = s.position;
        let arm = |j: usize| x[j] - center[j];
        let row =
            |i: usize| arm(0) * shape[(i, 0)] + arm(1) * shape[(i, 1)] + arm(2) * shape[(i, 2)];
        (-(row(0) * row(0)) - row(1) * row(1) - row(2) * row(2) + 1.0) * 0.5
    });
    let (by_hand, twice) = ellipsoid.derivatives(&state);
    assert!((ellipsoid.value(&state) - value).abs() < 1e-13);
    assert!(
        (by_hand - gradient.fixed_rows::<3>(0)).amax() < 1e-13
            && (twice - hessian.fixed_view::<3, 3>(0, 0)).amax() < 1e-13
    );

    let distance = Distance {
        point: center,
        distance: 0.8,
    };
    let (value, gradient, hessian) = derivatives(&state, |s| {
        let x = s.position;
        let arm: [Number; 3] = std::array::from_fn(|j| (x[j] - center[j]) / 0.8);
        (arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2] - 1.0) * 0.5
    });
    let row = distance
        .jacobian(&state)
        .fixed_view::<1, 3>(0, 0)
        .transpose();
    let twice = distance.curvature(&state, &SVector::ith(0, 1.0));
    assert!((distance.residual(&state)[0] - value).abs() < 1e-13);
    assert!((row - gradient.fixed_rows::<3>(0)).amax() < 1e-13);
    assert!((twice.fixed_view::<3, 3>(0, 0) - hessian.fixed_view::<3, 3>(0, 0)).amax() < 1e-13);
}

#[test]
fn an_own_ellipsoid_that_is_a_sphere_gives_the_plan_of_the_sphere() {
    let [initial, target] = across();
    let transfer = free(initial, target, &Matrix3::identity());
    let ellipsoid = Ellipsoid {
        center: CENTER,
        shape: Matrix3::from_diagonal_element(1.0 / 0.4),
        from: 0.0,
    };
    let sphere = KeepOutSphere::new(CENTER, 0.4).expect("a sphere");
    let own = plan(
        &transfer
            .clone()
            .with_constraints(&[Constraint::state(ellipsoid)]),
    );
    let ours = plan(
        &transfer
            .clone()
            .with_constraints(&[Constraint::state(sphere)]),
    );
    assert!(
        own.cost > 1.01 * plan(&transfer).cost,
        "the way round is longer"
    );
    assert!(apart(&own, &ours) < 1e-8, "{:e}", apart(&own, &ours));
}

/// `y = A x` turns the ellipsoid into a unit sphere and the weight into `A⁻ᵀ W A⁻¹`.
#[test]
fn an_own_ellipsoid_gives_the_plan_past_a_sphere_in_stretched_coordinates() {
    let [initial, target] = across();
    let shape = Matrix3::from_diagonal(&Vector3::new(1.0 / 0.5, 1.0 / 0.3, 1.0 / 0.35));
    let ellipsoid = Constraint::state(Ellipsoid {
        center: CENTER,
        shape,
        from: 0.0,
    });
    let own = plan(&free(initial, target, &Matrix3::identity()).with_constraints(&[ellipsoid]));
    let [initial, target] =
        [initial, target].map(|state| at(shape * state.position, Vector3::zeros()));
    let weight = Matrix3::from_diagonal(&shape.diagonal().map(|a| 1.0 / (a * a)));
    let sphere = KeepOutSphere::new(shape * CENTER, 1.0).expect("a sphere");
    let sphere = [Constraint::state(sphere)];
    let stretched = plan(&free(initial, target, &weight).with_constraints(&sphere));
    assert!((own.cost / stretched.cost - 1.0).abs() < 1e-8);
    for (own, stretched) in own.states.iter().zip(&stretched.states) {
        let miss = (shape * own.position - stretched.position).norm();
        assert!(miss < 1e-6, "{miss:e}");
    }
}

#[test]
fn an_own_constraint_holds_where_it_applies_and_only_there() {
    let [initial, target] = across();
    let transfer = free(initial, target, &Matrix3::identity());
    let leave = |from| {
        Constraint::state(Ellipsoid {
            center: initial.position,
            shape: Matrix3::from_diagonal_element(2.0),
            from,
        })
    };
    let plan = plan(&transfer.clone().with_constraints(&[leave(0.25)]));
    let distance = |k: usize| (plan.states[k].position - initial.position).norm();
    assert!(distance(N / 4 - 1) < 0.5, "{}", distance(N / 4 - 1));
    assert!((distance(N / 4) - 0.5).abs() < 1e-6, "{}", distance(N / 4));
    let always = transfer.with_constraints(&[leave(0.0)]);
    assert!(solve(&always, Start::Cold, &NewtonSettings::default(), |_| true).is_err());
}

#[test]
fn an_own_limit_of_commands_is_the_limit_that_it_repeats() {
    let [initial, target] = across();
    let transfer = free(initial, target, &Matrix3::identity());
    let limit = 0.8 * plan(&transfer).controls[0].force.norm();
    let ours = Constraint::commands(NormLimit::new(Place::Position, limit).expect("a limit"));
    let [own, ours] = [Constraint::commands(Thrust(limit)), ours]
        .map(|constraint| plan(&transfer.clone().with_constraints(&[constraint])));
    assert_eq!(own.controls, ours.controls);
    assert!((own.controls[0].force.norm() - limit).abs() < 1e-6);
}

/// Without gravity, the least energy to reach a position grows with the square of its distance from the end of the
/// drift. The cheapest point of the sphere is therefore the nearest.
#[test]
fn an_own_target_is_reached_at_its_cheapest_place() {
    let initial = at(Vector3::new(2.0, 0.0, 0.0), Vector3::new(0.0, 0.7, 0.2));
    let drifted = initial.position + N as f64 * H * initial.linear_momentum;
    let target = |distance| Distance {
        point: Vector3::zeros(),
        distance,
    };
    let identity = Matrix3::identity();
    for distance in [1.0, 4.0] {
        let own = plan(&free(
            initial,
            Terminal::FREE.with(target(distance)),
            &identity,
        ));
        let nearest = FinalPosition::new(distance * drifted.normalize(), None).expect("a position");
        let known = plan(&free(initial, Terminal::FREE.with(nearest), &identity));
        assert!(apart(&own, &known) < 1e-8, "{:e}", apart(&own, &known));
    }
}

/// If the end is free along the sphere and in all else, its costate is normal to the sphere and zero in all else.
#[test]
fn an_own_target_ends_with_the_costate_across_it() {
    let case = Case::load("C_i");
    let plain = case.transfer(N);
    let (initial, state) = (*plain.initial(), plain.target().state().expect("a state"));
    let distance = Distance {
        point: Vector3::zeros(),
        distance: state.position.norm(),
    };
    let identity = Matrix3::identity();
    let actuation = Actuation::full(&identity, &identity).expect("weights");
    let target = Terminal::FREE.with(distance);
    assert_eq!(target.state(), None);
    let (field, h) = (Central { gm: 1.0 }, plain.h());
    let transfer = Transfer::new(case.body(), field, h, N, initial, target.clone(), actuation);
    let plan = plan(&transfer.expect("a transfer"));
    let end = plan.states[N];
    assert!(target.miss(&end).norm() < 1e-12);
    let last = plan.multipliers[N - 1];
    let force = last.fixed_rows::<3>(0).into_owned();
    assert!(force.cross(&end.position.normalize()).norm() < 1e-9 * force.norm());
    assert!(last.fixed_rows::<9>(3).norm() < 1e-9 * force.norm());
}

/// A point, known by its potential alone.
struct Point(f64);

impl Potential for Point {
    fn potential<D: DualNum<f64>>(&self, [x, y, z]: &[D; 3]) -> D {
        -(x.powi(2) + y.powi(2) + z.powi(2)).sqrt().recip() * self.0
    }
}

#[test]
fn a_field_known_by_its_potential_gives_the_plan_of_the_field() {
    let case = Case::load("C_i");
    let plain = case.transfer(N);
    let own = |field: bool| {
        let (initial, target) = (*plain.initial(), plain.target().clone());
        let actuation =
            Actuation::full(&Matrix3::identity(), &Matrix3::identity()).expect("weights");
        let (body, h) = (case.body(), plain.h());
        let transfer = if field {
            Transfer::new(body, AutoDiff(Point(1.0)), h, N, initial, target, actuation)
        } else {
            Transfer::new(body, Central { gm: 1.0 }, h, N, initial, target, actuation)
        };
        plan(&transfer.expect("a transfer"))
    };
    let (own, ours) = (own(true), own(false));
    assert!(apart(&own, &ours) < 1e-9, "{:e}", apart(&own, &ours));
}
