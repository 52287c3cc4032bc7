//! Run time against error of every integrator on a reference case.

use std::path::Path;

use lgvi_dynamics::Method;
use lgvi_truth::{Case, Errors};

use crate::error::BenchError;
use crate::flight::fly;
use crate::methods::{Family, families};
use crate::peer::Peer;
use crate::picture::{Axis, Curve, Picture};

/// A reference case, with what is asked of it.
pub(crate) struct Setting {
    pub name: &'static str,
    /// Time of the reference state.
    t: f64,
    /// Fewest steps that a fixed step method is tried with.
    steps: u64,
    /// What error is shown.
    error: fn(&Errors) -> f64,
    label: &'static str,
    /// Errors at which times are compared.
    targets: &'static [f64],
    /// Greatest error in the picture.
    coarse: f64,
}

const ATTITUDE: fn(&Errors) -> f64 = |errors| errors.attitude;
const POSITION: fn(&Errors) -> f64 = |errors| errors.position;

/// The cases whose end a method can reach: regular ones, or times before chaos.
pub(crate) const CASES: &[Setting] = &[
    Setting {
        name: "a1_two_dumbbells_regular",
        t: 300.0,
        steps: 500,
        error: ATTITUDE,
        label: "attitude error at t = 300",
        targets: &[1e-6, 1e-8, 1e-10],
        coarse: 1e-1,
    },
    Setting {
        name: "a2_two_dumbbells_coupled",
        t: 5.0,
        steps: 20,
        error: ATTITUDE,
        label: "attitude error at t = 5",
        targets: &[1e-6, 1e-8, 1e-10],
        coarse: 1e-1,
    },
    Setting {
        name: "c3_3d_pendulum_regular_small",
        t: 100.0,
        steps: 200,
        error: ATTITUDE,
        label: "attitude error at t = 100 s",
        targets: &[1e-6, 1e-8, 1e-10],
        coarse: 1e-1,
    },
    Setting {
        name: "d_dumbbell_central",
        t: 100.0,
        steps: 100,
        error: ATTITUDE,
        label: "attitude error at t = 100",
        targets: &[1e-6, 1e-8, 1e-10],
        coarse: 1e-1,
    },
    Setting {
        name: "e_kw4_like",
        t: 2_592_000.0,
        steps: 500,
        error: POSITION,
        label: "position error after 30 days (m)",
        targets: &[1.0, 1e-3, 1e-5],
        coarse: 1e2,
    },
];

/// What is in the pictures; the tables have all.
const SHOWN: [&str; 12] = [
    "LGVI",
    "composition 4, discrete rotor",
    "composition 8, discrete rotor",
    "Nyström 4, exact rotor",
    "Nyström 6, exact rotor",
    "Nyström 8, exact rotor",
    "Galerkin 4",
    "explicit midpoint",
    "Runge–Kutta 4",
    "Fehlberg 7(8)",
    "Dormand–Prince 8(5,3)",
    "heyoka",
];

/// Longest flight tried (s).
const PATIENCE: f64 = 1.0;

/// Errors below this are rounding.
const FLOOR: f64 = 1e-13;

/// Tolerances of methods that choose their steps.
const TOLERANCES: [f64; 11] = [
    1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14,
];

/// Tolerances of the peer, whose meaning is its own.
const PEER_TOLERANCES: [f64; 8] = [1e-5, 1e-6, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-14];

/// Measures, prints a table of times at the asked errors, draws the work-precision diagram.
pub(crate) fn run(
    name: &str,
    peer: Option<&Peer>,
    repeats: u32,
    images: &Path,
) -> Result<(), BenchError> {
    let setting = CASES.iter().find(|setting| setting.name == name);
    let setting = setting.ok_or_else(|| BenchError::Case {
        name: name.into(),
        known: CASES.iter().map(|setting| setting.name).collect(),
    })?;
    let case = Case::load(name)?;
    let mut curves = Vec::new();
    for (label, family) in families() {
        let points = match family {
            Family::Stepped(method) => stepped(&case, setting, method, repeats)?,
            Family::Adaptive(method) => adaptive(&case, setting, method, repeats)?,
        };
        if !points.is_empty() {
            curves.push(Curve { label, points });
        }
    }
    let own = curves.len();
    if let Some(peer) = peer {
        let flown = peer.fly(name, setting.t, &PEER_TOLERANCES, repeats)?;
        let error = |flown: &crate::peer::PeerFlown| {
            (setting.error)(&Errors {
                position: flown.position,
                attitude: flown.attitude,
                ..Errors::default()
            })
        };
        curves.push(Curve {
            label: "heyoka".into(),
            points: flown
                .iter()
                .map(|flown| [error(flown), flown.seconds])
                .collect(),
        });
    }
    table(setting, &curves, own);
    let picture = Picture {
        title: setting.name.replace('_', " "),
        horizontal: Axis::logarithmic(setting.label),
        vertical: Axis::logarithmic("CPU time (s)"),
    };
    let shown: Vec<_> = curves
        .into_iter()
        .filter(|curve| SHOWN.contains(&curve.label.as_str()))
        .map(|curve| Curve {
            points: curve
                .points
                .into_iter()
                .filter(|point| point[0] < setting.coarse)
                .collect(),
            ..curve
        })
        .collect();
    picture.draw(&images.join(format!("precision_{name}.svg")), &shown)
}

/// `[error, seconds]` over growing numbers of steps, until rounding or patience ends it.
fn stepped(
    case: &Case,
    setting: &Setting,
    method: Method,
    repeats: u32,
) -> Result<Vec<[f64; 2]>, BenchError> {
    let mut points: Vec<[f64; 2]> = Vec::new();
    let mut steps = setting.steps as f64;
    loop {
        let flown = match fly(case, setting.t, method, steps as u64, repeats) {
            Ok(flown) => flown,
            Err(BenchError::Step(_)) if steps < 1e8 => {
                steps *= 2.0;
                continue;
            }
            Err(BenchError::Method(_)) => return Ok(points),
            Err(error) => return Err(error),
        };
        let error = (setting.error)(&flown.errors);
        let risen = points
            .last()
            .is_some_and(|last| error > last[0] && last[0] < 1e-6);
        if risen || error < FLOOR {
            return Ok(points);
        }
        points.push([error, flown.seconds]);
        if flown.seconds > PATIENCE {
            return Ok(points);
        }
        steps *= std::f64::consts::SQRT_2;
    }
}

fn adaptive(
    case: &Case,
    setting: &Setting,
    method: fn(f64) -> Method,
    repeats: u32,
) -> Result<Vec<[f64; 2]>, BenchError> {
    let mut points = Vec::new();
    for tolerance in TOLERANCES {
        match fly(case, setting.t, method(tolerance), 1, repeats) {
            Ok(flown) => points.push([(setting.error)(&flown.errors), flown.seconds]),
            Err(BenchError::Step(_) | BenchError::Method(_)) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(points)
}

/// The time from which on the error is at most `error`, interpolated on a logarithmic scale: a chance dip of a coarser
/// flight does not count.
fn time_at(curve: &Curve, error: f64) -> Option<f64> {
    let mut points = curve.points.clone();
    points.sort_by(|a, b| a[1].total_cmp(&b[1]));
    match points.iter().rposition(|point| point[0] > error) {
        None => points.first().map(|point| point[1]),
        Some(last) => points.get(last + 1).map(|&[e1, t1]| {
            let [e0, t0] = points[last];
            let part = (e0 / error).ln() / (e0 / e1).ln();
            t0 * (t1 / t0).powf(part)
        }),
    }
}

/// Times at the asked errors, and their ratio to heyoka's.
fn table(setting: &Setting, curves: &[Curve], own: usize) {
    println!("\n{}: CPU time (ms) at {}", setting.name, setting.label);
    print!("{:32}", "");
    for target in setting.targets {
        print!("{target:>22.0e}");
    }
    println!();
    let reference = curves.get(own);
    for curve in curves {
        print!("{:32}", curve.label);
        for &target in setting.targets {
            let time = time_at(curve, target);
            let ratio = reference
                .and_then(|reference| time_at(reference, target))
                .zip(time)
                .map(|(reference, time)| format!("(1/{:.2})", reference / time));
            let time = time.map_or("-".into(), |time| format!("{:.3}", 1e3 * time));
            print!("{:>22}", format!("{time} {}", ratio.unwrap_or_default()));
        }
        println!();
    }
    for &target in setting.targets {
        let best = curves[..own]
            .iter()
            .filter_map(|curve| Some((time_at(curve, target)?, &curve.label)))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, label)) = best {
            println!("fastest at {target:.0e}: {label}");
        }
    }
}
