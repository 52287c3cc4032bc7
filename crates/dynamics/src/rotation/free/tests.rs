use lgvi_lie::exp;

use super::references::{HARD, LONG, Reference};
use super::*;

fn random(rng: &mut fastrand::Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| 2.0 * rng.f64() - 1.0)
}

fn errors(reference: &Reference) -> (f64, f64, f64) {
    let start = Vector3::from(reference.start);
    let inertia = Inertia::principal(reference.moments).unwrap();
    let (relative, end) = FreeRotation::new(&inertia).flow(&start, reference.t);
    let expected = Vector3::from(reference.end);
    (
        (relative.matrix() - Matrix3::from_row_slice(&reference.relative)).norm(),
        (end - expected).norm() / start.norm(),
        (end - expected).component_div(&expected).amax(),
    )
}

/// The bound covers rounding of the state and of a phase of `|Ω| t`. Each component of Π has relative accuracy, so that
/// the growth away from the middle axis is accurate even for tiny deviations.
#[test]
fn hard_cases_match_mpmath() {
    for reference in HARD {
        let velocity =
            Vector3::from(reference.start).component_div(&Vector3::from(reference.moments));
        let phase = velocity.norm() * reference.t.abs();
        let (attitude, momentum, component) = errors(reference);
        let bound = 4e-15 + 8e-16 * phase;
        let name = reference.name;
        assert!(attitude < bound, "{name}: attitude {attitude:.1e}");
        assert!(momentum < bound, "{name}: momentum {momentum:.1e}");
        assert!(component < 4e-15 * (1.0 + phase), "{name}: {component:.1e}");
    }
}

/// The error is that of a rounded phase, `2⁻⁵² |Ω| t` with |Ω| = 1.35 and 1, at all times. Measured errors of the
/// attitude and of `Π/|Π|`:
///
/// | | t = 1e3 | t = 1e6 | t = 1e9 |
/// | --- | --- | --- | --- |
/// | b1 | 9.2e-14, 9.8e-15 | 2.0e-11, 7.2e-12 | 3.1e-8, 8.0e-9 |
/// | b2 | 4.7e-14, 1.3e-15 | 7.9e-11, 2.4e-12 | 1.5e-8, 6.6e-10 |
#[test]
fn errors_grow_with_the_rounding_of_the_phase_alone() {
    for reference in LONG {
        let (attitude, momentum, _) = errors(reference);
        let (name, t) = (reference.name, reference.t);
        assert!(
            attitude < f64::EPSILON * 1.4 * t,
            "{name} {t}: {attitude:.1e}"
        );
        assert!(
            momentum < f64::EPSILON * 1.4 * t,
            "{name} {t}: {momentum:.1e}"
        );
    }
}

/// Integrates `Ḟ = F S(J⁻¹Π)`, `Π̇ = Π × J⁻¹Π` by Taylor series of order 24, in steps with |Ω| h ≤ 1/4.
fn integrate(inertia: &Inertia, pi: &Vector3<f64>, t: f64) -> (Matrix3<f64>, Vector3<f64>) {
    const ORDER: usize = 24;
    // |Ω| ≤ |Π| / smallest moment ≤ |Π| |J⁻¹|
    let steps = (4.0 * t.abs() * pi.norm() * inertia.inverse().norm()).ceil();
    let h = t / steps;
    let (mut f, mut pi) = (Matrix3::identity(), *pi);
    for _ in 0..steps as usize {
        let (mut momenta, mut velocities) = (vec![pi], vec![inertia.inverse() * pi]);
        let mut turns = vec![Matrix3::identity()];
        for k in 0..ORDER {
            let (mut momentum, mut turn) = (Vector3::zeros(), Matrix3::zeros());
            for j in 0..=k {
                momentum += momenta[j].cross(&velocities[k - j]);
                turn += turns[j] * lgvi_lie::hat(&velocities[k - j]);
            }
            let scale = 1.0 / (k + 1) as f64;
            momenta.push(momentum * scale);
            turns.push(turn * scale);
            velocities.push(inertia.inverse() * momenta[k + 1]);
        }
        let (mut turn, mut momentum) = (Matrix3::zeros(), Vector3::zeros());
        for k in (0..=ORDER).rev() {
            turn = turn * h + turns[k];
            momentum = momentum * h + momenta[k];
        }
        (f, pi) = (f * turn, momentum);
    }
    (f, pi)
}

/// Bodies of all kinds, with the axes in random order, each also rotated out of its principal axes.
fn bodies(rng: &mut fastrand::Rng) -> Vec<Inertia> {
    let mut all = Vec::new();
    for moments in [
        [1.0, 1.0, 1.0],
        [1.0, 1.0, 1.7],
        [0.1, 1.0, 1.0],
        [1.0, 2.0, 3.0],
        [1.0, 1.9, 2.0],
        [1.0, 1.1, 2.0],
        [0.05, 1.0, 1.01],
        [1.0, 1.0 + 1e-9, 1.5],
        [0.7, 1.0, 1.0 + 1e-12],
        [1.0, 1.0 + 1e-7, 1.0 + 3e-7],
    ] {
        let mut order = moments;
        rng.shuffle(&mut order);
        all.push(Inertia::principal(order).unwrap());
        let turn = exp(&(2.0 * random(rng)));
        let turned = turn * Matrix3::from_diagonal(&moments.into()) * turn.transpose();
        all.push(Inertia::new(0.5 * (turned + turned.transpose())).unwrap());
    }
    all
}

/// Momenta of random direction, on and near axes, and on both sides of the separatrix of `[1, 2, 3]`.
fn momenta(rng: &mut fastrand::Rng) -> Vec<Vector3<f64>> {
    let mut all: Vec<_> = (0..12).map(|_| random(rng)).collect();
    for axis in 0..3 {
        for deviation in [0.0, 1e-200, 1e-9, 1e-3] {
            all.push(Vector3::ith(axis, -0.9) + deviation * random(rng));
        }
    }
    for z in [3.0, 3.0 * (1.0 - 1e-13), 3.0 * (1.0 + 1e-7)] {
        all.push(Vector3::new(1.0, 0.4, libm::sqrt(z)) * 0.5);
    }
    all
}

#[test]
fn the_flow_solves_the_equations_of_motion() {
    let mut rng = fastrand::Rng::with_seed(21);
    for inertia in bodies(&mut rng) {
        let flow = FreeRotation::new(&inertia);
        // The entries of a rotated inertia determine its smallest moment no more accurately.
        let condition = match inertia.matrix()[(0, 1)] {
            0.0 => 1.0,
            _ => inertia.matrix().norm() * inertia.inverse().norm() / 3.0,
        };
        for pi in momenta(&mut rng) {
            for t in [1e-3, -0.2, 4.0] {
                let (relative, end) = flow.flow(&pi, t);
                let (f, expected) = integrate(&inertia, &pi, t);
                let bound =
                    2e-15 * (4.0 + condition * t.abs() * pi.norm() * inertia.inverse().norm());
                let case = || format!("{} {pi} {t}", inertia.matrix());
                assert!((relative.matrix() - f).norm() < bound, "{}", case());
                assert!((end - expected).norm() < bound, "{}", case());
            }
        }
    }
}

/// Checks that `F(s + t) = F(s) F(t)` with the momentum at s, that −t leads back to the start, and that `F Π(t) = Π(0)`
/// and the energy are conserved.
#[test]
fn the_flow_is_a_group_that_keeps_momentum_and_energy() {
    let mut rng = fastrand::Rng::with_seed(22);
    for inertia in bodies(&mut rng) {
        let flow = FreeRotation::new(&inertia);
        let energy = |pi: &Vector3<f64>| 0.5 * pi.dot(&(inertia.inverse() * pi));
        for pi in momenta(&mut rng) {
            if !is_regular(&inertia, &pi) {
                continue;
            }
            for (s, t) in [(0.01, 0.02), (1.0, -7.0), (-30.0, 12.0), (300.0, 1e-3)] {
                let (first, middle) = flow.flow(&pi, s);
                let (second, end) = flow.flow(&middle, t);
                let (whole, whole_end) = flow.flow(&pi, s + t);
                let fast = inertia.inverse().norm() * pi.norm();
                let duration = f64::abs(s) + f64::abs(t);
                let bound = 1e-15 * (10.0 + fast * duration);
                let case = || format!("{} {pi} {s} {t}", inertia.matrix());
                let product = first.product(&second).matrix();
                assert!((product - whole.matrix()).norm() < bound, "{}", case());
                assert!((end - whole_end).norm() < bound, "{}", case());
                let (back, start) = flow.flow(&end, -t);
                let returned = second.product(&back).matrix();
                assert!(
                    (returned - Matrix3::identity()).norm() < bound,
                    "{}",
                    case()
                );
                assert!((start - middle).norm() < bound, "{}", case());

                let rounding = 8e-15 * pi.norm();
                assert!(
                    (whole.matrix() * whole_end - pi).norm() < rounding,
                    "{}",
                    case()
                );
                let gain = (energy(&whole_end) - energy(&pi)).abs();
                assert!(gain < 2e-14 * fast * pi.norm(), "{}: {gain:e}", case());
            }
        }
    }
}

/// Returns true if Π is clear of the separatrix, near which errors grow as the motion itself does: `|2E J₂ − |Π|²|`
/// must not be small compared with its maximum.
fn is_regular(inertia: &Inertia, pi: &Vector3<f64>) -> bool {
    let ([least, middle, greatest], _) = principal(inertia);
    let distance = middle * pi.dot(&(inertia.inverse() * pi)) / pi.norm_squared() - 1.0;
    distance.abs() > 0.02 * (greatest - least) / greatest
}

/// The rotation does not depend on the units, even near the ends of the range of double precision.
#[test]
fn units_do_not_matter() {
    for moments in [[1.0, 1.0, 1.0], [1.0, 1.0, 1.5], [1.0, 2.0, 2.5]] {
        for pi in [[0.3, -0.5, 0.2], [0.9, 0.1, 0.3]] {
            let run = |unit: f64, second: f64| {
                let inertia = Inertia::principal(moments.map(|j| j * unit)).unwrap();
                let pi = Vector3::from(pi) * (unit / second);
                let (relative, end) = FreeRotation::new(&inertia).flow(&pi, 9.0 * second);
                (relative.matrix(), end / (unit / second))
            };
            let (expected, end) = run(1.0, 1.0);
            for unit in [1e-150, 1e-80, 1e80, 1e150] {
                for second in [1e-100, 1.0, 1e100] {
                    let (found, found_end) = run(unit, second);
                    assert!((found - expected).norm() < 1e-14, "{unit:e} {second:e}");
                    assert!((found_end - end).norm() < 1e-14, "{unit:e} {second:e}");
                }
            }
        }
    }
}

/// A rotation about a principal axis is steady, including the middle axis. Without momentum the body is at rest.
#[test]
fn on_an_axis_the_rotation_is_steady() {
    for moments in [
        [1.0, 2.0, 2.5],
        [2.5, 1.0, 2.4],
        [1.0, 1.0, 1.5],
        [1.0, 1.0, 1.0],
    ] {
        let flow = FreeRotation::new(&Inertia::principal(moments).unwrap());
        for (axis, moment) in moments.into_iter().enumerate() {
            for size in [-1.0, 0.7, 1e-200, 1e200] {
                for angle in [0.1, -3.0, 4e3] {
                    let pi = Vector3::ith(axis, size);
                    let (relative, end) = flow.flow(&pi, angle * moment / size);
                    let expected = exp(&Vector3::ith(axis, angle));
                    assert!((relative.matrix() - expected).norm() < 4e-15 + 4e-16 * angle.abs());
                    assert_eq!(end, pi);
                }
            }
        }
        let (relative, end) = flow.flow(&Vector3::zeros(), 1e9);
        assert_eq!(
            (relative.matrix(), end),
            (Matrix3::identity(), Vector3::zeros())
        );
        let (relative, end) = flow.flow(&Vector3::new(0.1, 0.2, 0.3), 0.0);
        assert_eq!(
            (relative.matrix(), end),
            (Matrix3::identity(), Vector3::new(0.1, 0.2, 0.3))
        );
    }
}

/// The elliptic formulas converge to those of a symmetric body as the difference of its moments vanishes, down to
/// rounding.
#[test]
fn nearly_equal_moments_are_nearly_symmetric() {
    let mut rng = fastrand::Rng::with_seed(23);
    for moments in [[1.0, 1.0, 1.5], [1.0, 1.0, 0.3], [1.0, 1.0, 1.0]] {
        let symmetric = FreeRotation::new(&Inertia::principal(moments).unwrap());
        for difference in [1e-15, 3e-15, 1e-14, 1e-11, 1e-8] {
            let [a, b, c] = moments;
            let near = Inertia::principal([a, b + difference, c - 1.3 * difference]).unwrap();
            let near = FreeRotation::new(&near);
            for _ in 0..50 {
                let (pi, t) = (random(&mut rng), 20.0 * rng.f64());
                let ((f, end), (f0, end0)) = (near.flow(&pi, t), symmetric.flow(&pi, t));
                let bound = 5e-14 + 500.0 * difference;
                assert!((f.matrix() - f0.matrix()).norm() < bound, "{difference:e}");
                assert!((end - end0).norm() < bound, "{difference:e}");
            }
        }
    }
}

/// Repeated equal steps do not drift: the rounding errors of |Π| and of the energy stay close to those of a random
/// walk, `ε √N`.
#[test]
fn many_steps_leave_no_bias() {
    const STEPS: u32 = 200_000;
    let walk = f64::EPSILON * f64::from(STEPS).sqrt();
    for moments in [[1.0, 2.0, 2.5], [1.0, 1.0001, 1.5], [1.0, 1.0, 1.5]] {
        let inertia = Inertia::principal(moments).unwrap();
        let flow = FreeRotation::new(&inertia);
        for start in [[0.3, 0.5, -0.8], [1e-3, 2e-3, 1.0], [1e-3, 1.0, 2e-3]] {
            for h in [0.01, 0.1] {
                let start = Vector3::from(start);
                let energy = |pi: &Vector3<f64>| pi.dot(&(inertia.inverse() * pi));
                let (mut attitude, mut pi) = (Matrix3::identity(), start);
                for _ in 0..STEPS {
                    let (relative, end) = flow.flow(&pi, h);
                    (attitude, pi) = (relative.compose(&attitude), end);
                }
                assert!((pi.norm() / start.norm() - 1.0).abs() < walk);
                assert!((energy(&pi) / energy(&start) - 1.0).abs() < 2.0 * walk);
                assert!((attitude * pi - start).norm() < 2.0 * walk * start.norm());
                let (whole, _) = flow.flow(&start, h * f64::from(STEPS));
                // A random walk of the energy causes one of the rate.
                let error = (whole.matrix() - attitude).norm();
                let bound = walk * (1.0 + h * f64::from(STEPS));
                assert!(error < bound || !is_regular(&inertia, &start), "{error:e}");
            }
        }
    }
}

/// The result is a rotation even for excessively large times.
#[test]
fn absurd_times_give_rotations_still() {
    let flow = FreeRotation::new(&Inertia::principal([1.0, 2.0, 2.5]).unwrap());
    for t in [1e15, -1e20, 1e100, 1e140] {
        let (relative, end) = flow.flow(&Vector3::new(0.3, -0.5, 0.2), t);
        assert!(
            lgvi_lie::orthogonality_error(&relative.matrix()) < 4e-15,
            "{t:e}"
        );
        assert!((end.norm_squared() - 0.38).abs() < 1e-14, "{t:e}");
    }
}
