//! Terminal residuals compared with independent formulas, and their derivatives compared with automatic differentiation
//! of these formulas.

use lgvi_dynamics::BodyState;
use lgvi_lie::exp;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use num_dual::DualNum;

use lgvi_control::terminal::{
    FinalAttitude, FinalPosition, KeplerOrbit, SpinAxis, TerminalCondition,
};
use lgvi_control::{Place, Terminal};

use crate::automatic::{
    Moved, Number, Triple, constant, cross, derivatives, dot, minus, norm, product, random_state,
    rows,
};

/// Two unit vectors perpendicular to `n`, along which conditions have their components.
fn across(n: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let sign = 1.0_f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [
        Vector3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        Vector3::new(b, sign + n.y * n.y * a, -n.y),
    ]
}

/// Residual, Jacobian and curvature of both halves.
fn both(
    target: &Terminal,
    state: &BodyState,
    nu: &SVector<f64, 12>,
) -> (SVector<f64, 12>, SMatrix<f64, 12, 12>, SMatrix<f64, 12, 12>) {
    let mut residual = SVector::<f64, 12>::zeros();
    let [mut jacobian, mut curvature] = [SMatrix::<f64, 12, 12>::zeros(); 2];
    for (at, place) in [(0, Place::Position), (6, Place::Attitude)] {
        if let Some(condition) = target.condition(place) {
            let nu = nu.fixed_rows::<6>(at).into_owned();
            let set = |all: &mut SMatrix<f64, 12, 12>, block: SMatrix<f64, 6, 6>| {
                all.fixed_view_mut::<6, 6>(at, at).copy_from(&block);
            };
            set(&mut jacobian, condition.jacobian(state));
            set(&mut curvature, condition.curvature(state, &nu));
            residual
                .fixed_rows_mut::<6>(at)
                .copy_from(&condition.residual(state));
        }
    }
    (residual, jacobian, curvature)
}

const MASS: f64 = 1.7;
const GM: f64 = 0.8;

/// Independent formulas of conditions, weighted by `ν`: six rows for `[x, γ]` and six for `[R, Π]`.
type Weighted = Box<dyn Fn(&Moved, &SVector<f64, 12>) -> Number>;

fn weigh(nu: &SVector<f64, 12>, from: usize, c: Triple) -> Number {
    c[0] * nu[from] + c[1] * nu[from + 1] + c[2] * nu[from + 2]
}

/// `θ/sin θ`: its series in sin² θ up to an angle of about 0.3, otherwise by the arctangent.
fn angle_over_sine(sine_squared: Number, cosine: Number) -> Number {
    if sine_squared.re < 0.09 && cosine.re > 0.0 {
        let mut sum = Number::from(1.0);
        for n in (1..24).rev() {
            let n = f64::from(n);
            sum =
                sum * sine_squared * ((2.0 * n - 1.0).powi(2) / (2.0 * n * (2.0 * n + 1.0))) + 1.0;
        }
        return sum;
    }
    let sine = sine_squared.sqrt();
    sine.atan2(cosine) / sine
}

/// `log(R_dᵀ R)` from the skew-symmetric part and the trace.
fn logarithm(target: &Matrix3<f64>, attitude: &[Triple; 3]) -> Triple {
    let columns: [Triple; 3] = std::array::from_fn(|j| attitude.map(|row| row[j]));
    let relative = columns.map(|column| product(&rows(&target.transpose()), column));
    let skew = [
        (relative[1][2] - relative[2][1]) * 0.5,
        (relative[2][0] - relative[0][2]) * 0.5,
        (relative[0][1] - relative[1][0]) * 0.5,
    ];
    let cosine = (relative[0][0] + relative[1][1] + relative[2][2] - 1.0) * 0.5;
    let factor = angle_over_sine(dot(skew, skew), cosine);
    skew.map(|component| component * factor)
}

fn translation(target: &Terminal) -> Weighted {
    let Some(condition) = target.condition(Place::Position) else {
        return Box::new(|_, _| Number::from(0.0));
    };
    if let Some(orbit) = condition.downcast_ref::<KeplerOrbit>() {
        let (center, position, velocity) = (orbit.center(), orbit.position(), orbit.velocity());
        return Box::new(move |s, nu| {
            let elements = |r: Triple, v: Triple| {
                let h = cross(r, v);
                let distance = norm(r);
                let lift = cross(v, h);
                (h, std::array::from_fn(|i| lift[i] / GM - r[i] / distance))
            };
            let v = s.linear_momentum.map(|component| component / MASS);
            let (h, e): (Triple, Triple) = elements(minus(s.position, constant(&center)), v);
            let (h_d, e_d): (Triple, Triple) =
                elements(constant(&(position - center)), constant(&velocity));
            let size = norm(h_d).re;
            let normal = Vector3::from(h_d.map(|component| component.re)) / size;
            let [p, q] = across(&normal).map(|axis| dot(constant(&axis), minus(e, e_d)));
            weigh(nu, 0, minus(h, h_d).map(|component| component / size)) + p * nu[3] + q * nu[4]
        });
    }
    let target: FinalPosition = *condition.downcast_ref().expect("a position");
    Box::new(move |s, nu| {
        let place = weigh(nu, 0, minus(s.position, constant(&target.position())));
        let Some(momentum) = target.linear_momentum() else {
            return place;
        };
        place + weigh(nu, 3, minus(s.linear_momentum, constant(&momentum)))
    })
}

fn rotation(target: &Terminal) -> Weighted {
    let Some(condition) = target.condition(Place::Attitude) else {
        return Box::new(|_, _| Number::from(0.0));
    };
    if let Some(spin) = condition.downcast_ref::<SpinAxis>() {
        let (axis, direction) = (spin.axis(), spin.direction());
        let momentum = spin.angular_momentum();
        return Box::new(move |s, nu| {
            let pointing = product(&s.attitude, constant(&axis));
            let cosine = dot(pointing, constant(&direction));
            let [p, q] = across(&direction).map(|axis| dot(constant(&axis), pointing));
            let factor = angle_over_sine(p * p + q * q, cosine);
            (p * nu[6] + q * nu[7]) * factor
                + weigh(nu, 9, minus(s.angular_momentum, constant(&momentum)))
        });
    }
    let target: FinalAttitude = *condition.downcast_ref().expect("an attitude");
    Box::new(move |s, nu| {
        let turn = weigh(nu, 6, logarithm(&target.attitude(), &s.attitude));
        let Some(momentum) = target.angular_momentum() else {
            return turn;
        };
        turn + weigh(nu, 9, minus(s.angular_momentum, constant(&momentum)))
    })
}

/// Every kind of target, at small and large distances from `state`.
fn targets(rng: &mut fastrand::Rng, state: &BodyState) -> Vec<Terminal> {
    let mut all = Vec::new();
    for angle in [0.0, 1e-5, 0.19, 0.21, 0.7, 2.0, 3.0] {
        let goal = random_state(rng);
        let turn = Vector3::from_fn(|_, _| rng.f64() - 0.5).normalize() * angle;
        let attitude = state.attitude * exp(&turn);
        let axis = Vector3::from_fn(|_, _| rng.f64() - 0.5).normalize();
        let circular = goal.position.cross(&Vector3::x()).normalize();
        let spin = SpinAxis::new(axis, attitude * axis, goal.angular_momentum);
        let attitude = |momentum| FinalAttitude::new(attitude, momentum).expect("an attitude");
        let center = Vector3::new(0.2, -0.1, 3.0);
        let arm = goal.position;
        let speed = (GM / arm.norm()).sqrt();
        let orbit = |velocity| {
            KeplerOrbit::new(GM, center, MASS, center + arm, velocity).expect("an orbit")
        };
        let position = |momentum| FinalPosition::new(arm, momentum).expect("a position");
        all.extend([
            Terminal::FREE
                .with(position(Some(goal.linear_momentum)))
                .with(attitude(Some(goal.angular_momentum))),
            Terminal::FREE.with(position(None)).with(attitude(None)),
            Terminal::FREE
                .with(orbit(circular * speed))
                .with(spin.expect("a spin axis")),
            Terminal::FREE.with(orbit((circular + 0.3 * arm.normalize()) * speed)),
        ]);
    }
    all
}

#[test]
fn conditions_and_both_derivatives_are_those_of_automatic_differentiation() {
    let mut rng = fastrand::Rng::with_seed(3);
    for _ in 0..5 {
        let state = random_state(&mut rng);
        for target in targets(&mut rng, &state) {
            let nu = SVector::from_fn(|_, _| 2.0 * rng.f64() - 1.0);
            let (c, jacobian, found) = both(&target, &state, &nu);
            let (place, turn) = (translation(&target), rotation(&target));
            for row in 0..12 {
                let nu = SVector::ith(row, 1.0);
                let (value, gradient, _) = derivatives(&state, |s| place(s, &nu) + turn(s, &nu));
                let scale = value.abs().max(gradient.amax()).max(1.0);
                assert!(
                    (c[row] - value).abs() <= 1e-12 * scale,
                    "{target:?}: row {row}"
                );
                let error = (jacobian.row(row).transpose() - gradient).amax();
                assert!(error <= 1e-12 * scale, "{target:?}: row {row} by {error:e}");
            }
            let (_, _, expected) = derivatives(&state, |s| place(s, &nu) + turn(s, &nu));
            let error = (found - expected).amax();
            assert!(
                error <= 1e-12 * expected.amax().max(1.0),
                "{target:?}: curvature by {error:e} of {:e}",
                expected.amax()
            );
            assert!((found - found.transpose()).amax() <= 1e-15 * found.amax().max(1.0));
        }
    }
}

/// A state on the orbit at the true anomaly `anomaly`.
fn later(
    center: Vector3<f64>,
    arm: Vector3<f64>,
    velocity: Vector3<f64>,
    anomaly: f64,
) -> BodyState {
    let h = arm.cross(&velocity);
    let e = velocity.cross(&h) / GM - arm / arm.norm();
    let periapsis = if e.norm() > 1e-8 {
        e.normalize()
    } else {
        arm.normalize()
    };
    let side = h.normalize().cross(&periapsis);
    let p = h.norm_squared() / GM;
    let (sin, cos) = anomaly.sin_cos();
    let r = p / (1.0 + e.norm() * cos) * (cos * periapsis + sin * side);
    let v = (GM / p).sqrt() * (-sin * periapsis + (e.norm() + cos) * side);
    BodyState {
        position: center + r,
        linear_momentum: MASS * v,
        attitude: Matrix3::identity(),
        angular_momentum: Vector3::zeros(),
    }
}

#[test]
fn an_orbit_is_met_at_every_phase_and_nowhere_else_and_its_conditions_are_independent() {
    let center = Vector3::new(0.3, 0.1, -0.4);
    let arm = Vector3::new(1.1, 0.2, -0.1);
    let across = arm.cross(&Vector3::new(0.1, -0.4, 0.9)).normalize();
    let circular = f64::sqrt(GM / arm.norm());
    for factor in [1.0, 1.2, 0.5] {
        let velocity = factor * circular * across;
        let set = KeplerOrbit::new(GM, center, MASS, center + arm, velocity).expect("an orbit");
        for phase in 0..12 {
            let state = later(center, arm, velocity, 0.5 * f64::from(phase));
            assert!(set.residual(&state).norm() < 1e-14);
            let values = nalgebra::SVD::try_new(set.jacobian(&state), false, false, 1e-15, 1000);
            let singular = values.unwrap().singular_values;
            assert!(singular[4] > 0.05 && singular[5] < 1e-12, "{singular}");
            let other = later(center, arm, 1.001 * velocity, 0.5 * f64::from(phase));
            assert!(set.residual(&other).norm() > 1e-4);
        }
    }
}

#[test]
fn a_spin_axis_is_met_at_every_turn_about_it_and_nowhere_else_the_way_back_included() {
    let axis = Vector3::new(0.6, 0.0, 0.8);
    let direction = Vector3::new(0.0, 0.28, -0.96);
    let set = SpinAxis::new(axis, direction, Vector3::zeros()).expect("a spin axis");
    let shortest = axis.cross(&direction);
    let angle = shortest.norm().atan2(axis.dot(&direction));
    let aligned = exp(&(shortest.normalize() * angle));
    for turn in 0..7 {
        let turned = aligned * exp(&(f64::from(turn) * axis));
        let at = |attitude: Matrix3<f64>| BodyState {
            position: Vector3::zeros(),
            linear_momentum: Vector3::zeros(),
            attitude,
            angular_momentum: Vector3::zeros(),
        };
        assert!(set.residual(&at(turned)).norm() < 1e-14);
        let off = set
            .residual(&at(turned * exp(&(0.3 * Vector3::y()))))
            .norm();
        assert!((off - 0.3).abs() < 1e-14);
        let back = at(turned * exp(&(std::f64::consts::PI * Vector3::y())));
        assert!((set.residual(&back).norm() - std::f64::consts::PI).abs() < 1e-7);
        let jacobian: SMatrix<f64, 6, 6> = set.jacobian(&back);
        let curvature = set.curvature(&back, &SVector::from_element(1.0));
        assert!(
            jacobian
                .iter()
                .chain(&curvature)
                .all(|entry| entry.is_finite())
        );
    }
}
