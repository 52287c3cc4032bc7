//! Nearly round and nearly linear bodies, and what is no body.

use lgvi_dynamics::{Inertia, InertiaError, Method};
use nalgebra::{Matrix3, Vector3};

use crate::bodies::{LGVI, ULP, body, fly, free, relative, turning};
use crate::{Length, Report, Trial, TrialError};

pub(crate) const TRIALS: [Trial; 4] = [
    Trial {
        name: "near sphere",
        done: "moments 1, 1 + 1e-12, 1 + 2e-12; h = 0.01, 1e6 steps of `lgvi` and one of `closed_form` to the same time",
        right: "the discrete sphere turns by `asin(h|Ω|)` a step about Π, the exact one by `h|Ω|`: the attitude is theirs to \
                4e-12 of the angle turned; as the steps of a sphere are alike so are their roundings, and Π drifts by up to 2⁻⁵² a \
                step, the angle by half of that times n",
        run: near_sphere,
    },
    Trial {
        name: "near rod",
        done: "moments 1e-12, 1, 1 and 1e-12, 1, 1 + 1e-12, turning about all axes at once; h = 0.01, 1e6 steps of `lgvi`",
        right: "every step can be made; `|Π|²`, `RΠ` and the energy are kept to `2⁻⁵²√n`; the spin about the rod, which is a \
                part 1e-12 of Π, to 1e12 times that",
        run: near_rod,
    },
    Trial {
        name: "near rod, order",
        done: "the direction of the same rods after t = 10 by `lgvi` with h = 0.02 and 0.01, beside `closed_form`",
        right: "halving the step quarters the error",
        run: rod_order,
    },
    Trial {
        name: "limits of inertia",
        done: "flat bodies at the limit of the triangle inequality down to a ratio of moments of 1e-12, 1e5 steps of `lgvi` \
               beside `closed_form`; moments past that limit, zero, negative, infinite, of a ratio beyond 1e-14",
        right: "what is a body flies, second-order accurate; what is none is refused by a typed error",
        run: limits,
    },
];

const H: f64 = 0.01;

fn near_sphere(length: Length) -> Result<Report, TrialError> {
    let steps = length.of(20_000, 1_000_000);
    let round = body([1.0, 1.0 + 1e-12, 1.0 + 2e-12])?;
    let omega = Vector3::new(1.0, 0.5, -0.75);
    let (rate, axis) = (omega.norm(), omega.normalize());
    let state = turning(&round, omega);
    let mut report = Report::default();
    let turned = steps as f64 * H * rate;
    let drift = 0.5 * ULP * steps as f64;
    let cases = [
        ("`lgvi`", LGVI, H, steps, libm::asin(H * rate)),
        (
            "`closed_form`",
            Method::ClosedForm,
            steps as f64 * H,
            1,
            turned,
        ),
    ];
    for (name, method, h, steps, angle) in cases {
        let mut simulation = free(round.clone(), state, method, h)?;
        fly(&mut simulation, steps)?;
        let expected = lgvi_lie::exp(&(axis * (steps as f64 * angle)));
        let error = (simulation.states()[0].attitude - expected).norm();
        report.at_most(format!("{name}, attitude"), error, (4e-12 + drift) * turned);
    }
    Ok(report)
}

const RODS: [[f64; 3]; 2] = [[1e-12, 1.0, 1.0], [1e-12, 1.0, 1.0 + 1e-12]];

fn near_rod(length: Length) -> Result<Report, TrialError> {
    let steps = length.of(20_000, 1_000_000);
    let mut report = Report::default();
    let walk = ULP * (steps as f64).sqrt();
    for (name, moments) in ["axisymmetric", "asymmetric"].into_iter().zip(RODS) {
        let rod = body(moments)?;
        let state = turning(&rod, Vector3::new(1.0, 0.5, -0.75));
        let mut simulation = free(rod, state, LGVI, H)?;
        let start = simulation.invariants();
        fly(&mut simulation, steps)?;
        let end = simulation.invariants();
        let pi = simulation.states()[0].angular_momentum;
        let square = pi.norm_squared() / state.angular_momentum.norm_squared() - 1.0;
        report.at_most(format!("{name}: `|Π|²`"), square.abs(), walk);
        let turned = relative(&end.angular_momentum, &start.angular_momentum);
        report.at_most("`RΠ`", turned, 4.0 * walk);
        report.at_most(
            "energy",
            (end.energy / start.energy - 1.0).abs(),
            4.0 * walk,
        );
        // The other's turns under the body's asymmetry, small as that is.
        if moments[1] == moments[2] {
            let spin = (pi.x / moments[0] - 1.0).abs();
            report.at_most("spin about the rod", spin, walk / moments[0]);
        }
    }
    Ok(report)
}

fn rod_order(_: Length) -> Result<Report, TrialError> {
    let mut report = Report::default();
    let t = 10.0;
    for (name, moments) in ["axisymmetric", "asymmetric"].into_iter().zip(RODS) {
        let rod = body(moments)?;
        let state = turning(&rod, Vector3::new(1.0, 0.5, -0.75));
        let direction = |method, h: f64| -> Result<Vector3<f64>, TrialError> {
            let mut simulation = free(rod.clone(), state, method, h)?;
            fly(&mut simulation, (t / h).round() as u64)?;
            Ok(simulation.states()[0].attitude.column(0).into())
        };
        let exact = direction(Method::ClosedForm, t)?;
        let errors = [
            (direction(LGVI, 2.0 * H)? - exact).norm(),
            (direction(LGVI, H)? - exact).norm(),
        ];
        report.within(
            format!("{name}: order"),
            (errors[0] / errors[1]).log2(),
            [1.9, 2.1],
        );
        report.shows("error at 0.01", errors[1]);
    }
    Ok(report)
}

fn limits(length: Length) -> Result<Report, TrialError> {
    let steps = length.of(5_000, 100_000);
    let mut report = Report::default();
    for small in [1.0, 1e-3, 1e-6, 1e-9, 1e-12] {
        let flat = body([small, 1.0, 1.0 + small])?;
        // Little spin about the axis of the small moment, in which the step is not resolved else.
        let state = turning(&flat, Vector3::new(0.1, 0.5, -0.75));
        let attitude = |method, h: f64, steps| -> Result<Matrix3<f64>, TrialError> {
            let mut simulation = free(flat.clone(), state, method, h)?;
            fly(&mut simulation, steps)?;
            Ok(simulation.states()[0].attitude)
        };
        let t = H * steps as f64;
        let exact = attitude(Method::ClosedForm, t, 1)?;
        let found = attitude(LGVI, H, steps)?;
        let miss = (found.column(0) - exact.column(0)).norm();
        // The phase errs by a twelfth or so of the turn squared a step.
        report.at_most(
            format!("moments {small:e}, 1, sum: direction"),
            miss,
            H * H * t,
        );
    }
    let refusals = [
        ("triangle", [1.0, 1.0, 2.0 + 1e-11]),
        ("zero", [0.0, 1.0, 1.0]),
        ("negative", [-1.0, 1.0, 1.0]),
        ("slender", [1e-15, 1.0, 1.0]),
        ("infinite", [f64::INFINITY, 1.0, 1.0]),
        ("NaN", [f64::NAN, 1.0, 1.0]),
    ];
    let wrong = refusals.iter().filter(|(kind, moments)| {
        let found = Inertia::principal(*moments);
        !matches!(
            (*kind, found),
            ("triangle", Err(InertiaError::TriangleInequality(_)))
                | (
                    "zero" | "negative" | "slender",
                    Err(InertiaError::NotPositive(_))
                )
                | ("infinite" | "NaN", Err(InertiaError::NotFinite { .. }))
        )
    });
    let wrong = wrong.count() as f64;
    report.within(
        format!("of {} that are none, not refused", refusals.len()),
        wrong,
        [0.0; 2],
    );
    Ok(report)
}
