use lgvi_control::constraint::{ComponentLimit, NormLimit, Place};
use lgvi_control::nalgebra;
use lgvi_control::*;
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use nalgebra::{Matrix3, Vector3};
fn rest(x: f64, r: Matrix3<f64>) -> BodyState {
    BodyState {
        position: Vector3::new(x, 0., 0.),
        linear_momentum: Vector3::zeros(),
        attitude: r,
        angular_momentum: Vector3::zeros(),
    }
}
fn main() {
    let n: usize = std::env::args().nth(1).unwrap().parse().unwrap();
    let kind = std::env::args().nth(2).unwrap();
    let inertia = Inertia::principal([1.0; 3]).unwrap();
    let body = RigidBody::new(1.0, inertia, vec![]).unwrap();
    let id = Matrix3::identity();
    let act = Actuation::full(&id, &id).unwrap();
    let field = Central { gm: 0.0 };
    let (tr, t0) = match kind.as_str() {
        "line" => (
            Transfer::new(body, field, 0.1, n, rest(1.0, id), rest(2.0, id), act)
                .unwrap()
                .with_dynamics(Dynamics::Lgvi)
                .with_constraints(&[Constraint::commands(
                    NormLimit::new(Place::Position, 1.0).unwrap(),
                )])
                .with_motion(Motion::Translation),
            2.0,
        ),
        _ => (
            Transfer::new(
                body,
                field,
                0.1,
                n,
                rest(1.0, id),
                rest(
                    1.0,
                    lgvi_lie::exp(&Vector3::new(0., 0., std::f64::consts::PI - 1e-3)),
                ),
                act,
            )
            .unwrap()
            .with_dynamics(Dynamics::Lgvi)
            .with_constraints(&[Constraint::commands(
                ComponentLimit::new(Place::Attitude, Vector3::repeat(1.0)).unwrap(),
            )])
            .with_motion(Motion::Rotation),
            3.243,
        ),
    };
    let settings = NewtonSettings::default();
    if kind == "thrust" {
        let column = |x: f64| ([x, 0.0, 0.0, 0.0, 0.0, 0.0], 1.0);
        let pair = Actuation::actuators(&[column(1.0), column(-1.0)]).unwrap();
        let limit = lgvi_control::constraint::CommandLimit::new(&[3.0, 1.0])
            .unwrap()
            .one_sided();
        let body = RigidBody::new(2.0, Inertia::principal([1.0; 3]).unwrap(), vec![]).unwrap();
        let tr = Transfer::new(
            body,
            Central { gm: 0.0 },
            7.0 / n as f64,
            n,
            rest(1.0, id),
            rest(4.0, id),
            pair,
        )
        .unwrap()
        .with_dynamics(Dynamics::Lgvi)
        .with_motion(Motion::Translation)
        .with_constraints(&[Constraint::commands(limit)]);
        let range = TimeRange {
            shortest: 0.1,
            longest: 8.0,
            tolerance: 1e-5,
        };
        let now = std::time::Instant::now();
        let mut its = 0;
        if let Some(t) = std::env::args().nth(3) {
            let tr = tr.clone().with_final_time(4.05).unwrap();
            let plan = solve(&tr, Start::Cold, &settings, |_| true).unwrap();
            let tr = tr.clone().with_final_time(t.parse().unwrap()).unwrap();
            println!(
                "{:?}",
                solve(&tr, Start::Warm(&plan), &settings, |p| {
                    println!(
                        "{:?} {} len {:.1e} viol {:.2e} stat {:.2e} cost {:.6}",
                        p.phase, p.iteration, p.step_length, p.violation, p.stationarity, p.cost
                    );
                    true
                })
                .map_err(|e| e.to_string())
            );
            return;
        }
        println!(
            "{:?} {its} {:?}",
            solve_minimum_time(&tr, &range, Start::Cold, &settings, |_| {
                its += 1;
                true
            }),
            now.elapsed()
        );
        return;
    }
    if kind == "search" {
        let t: f64 = std::env::args().nth(3).unwrap().parse().unwrap();
        let down: Vec<f64> = std::env::args()
            .skip(4)
            .map(|a| a.parse().unwrap())
            .collect();
        let now = std::time::Instant::now();
        let found = search(
            &tr.clone().with_final_time(t).unwrap(),
            &SearchSettings::default(),
            |_| true,
        );
        match found {
            Err(e) => println!("{e}"),
            Ok(all) => {
                for m in all {
                    println!(
                        "J {} starts {} winding {:?}",
                        m.plan.cost, m.starts, m.winding
                    );
                    let mut warm = m.plan;
                    for &t in &down {
                        let time = FinalTime {
                            shortest: t,
                            longest: t,
                            weight: 0.0,
                            tolerance: 1e-9,
                        };
                        match solve_final_time(&tr, &time, Start::Warm(&warm), &settings, |_| true)
                        {
                            Ok(f) => {
                                let lower = t - (1.5 * t - f.plan.cost) / f.slope.abs();
                                println!(
                                    "  T {t} J {} slope {} lower {lower} mean|u| {:?}",
                                    f.plan.cost,
                                    f.slope,
                                    f.plan
                                        .controls
                                        .iter()
                                        .map(|u| u.moment.abs())
                                        .sum::<Vector3<f64>>()
                                        / n as f64
                                );
                                warm = f.plan;
                            }
                            Err(e) => {
                                println!("  T {t} {e}");
                                break;
                            }
                        }
                    }
                }
            }
        }
        println!("{:?}", now.elapsed());
        return;
    }
    if std::env::args().nth(3).as_deref() == Some("min") {
        let tol: f64 = std::env::args().nth(4).unwrap().parse().unwrap();
        let range = TimeRange {
            shortest: 0.1,
            longest: 8.0,
            tolerance: tol,
        };
        let tr = tr.clone().with_final_time(4.0).unwrap();
        let now = std::time::Instant::now();
        let mut its = 0;
        let watch = |_: &Progress| {
            its += 1;
            true
        };
        let found = if std::env::args().nth(5).is_some() {
            search_minimum_time(
                &tr,
                &range,
                &SearchSettings {
                    starts: 40,
                    ..SearchSettings::default()
                },
                watch,
            )
        } else {
            solve_minimum_time(&tr, &range, Start::Cold, &settings, watch)
        };
        match found {
            Ok(m) => {
                println!(
                    "T {} bound {} not found {:?} solves {} its {its} {:?} {:?}",
                    m.final_time,
                    m.lower_bound,
                    m.not_found,
                    m.solves,
                    now.elapsed(),
                    m.plan
                );
                let inner = |f: &dyn Fn(&lgvi_dynamics::Load) -> f64| {
                    m.plan.controls.iter().filter(|u| f(u) < 0.999).count()
                };
                println!(
                    "inner x {} y {} z {} force {}",
                    inner(&|u| u.moment.x.abs()),
                    inner(&|u| u.moment.y.abs()),
                    inner(&|u| u.moment.z.abs()),
                    inner(&|u| u.force.norm())
                );
            }
            Err(e) => println!("{e}"),
        }
        return;
    }
    let mut warm: Option<Plan> = None;
    let list: Vec<f64> = std::env::args()
        .skip(3)
        .map(|a| a.parse().unwrap())
        .collect();
    for excess in list {
        let t = t0 * (1.0 + excess);
        let time = FinalTime {
            shortest: t,
            longest: t,
            weight: 0.0,
            tolerance: 1e-9,
        };
        let start = warm.as_ref().map_or(Start::Cold, Start::Warm);
        let mut its = 0;
        let now = std::time::Instant::now();
        match solve_final_time(&tr, &time, start, &settings, |_| {
            its += 1;
            true
        }) {
            Ok(f) => {
                let jmax = 0.5 * t * if kind == "line" { 1.0 } else { 3.0 };
                let lower = t - (jmax - f.plan.cost) / f.slope.abs();
                println!(
                    "T {t:.8} J {:.8} slope {:.6e} T-1/V'^2*.. {:.4e} lower {lower:.8} its {its} {:?} compl {:.1e} suff {}",
                    f.plan.cost,
                    f.slope,
                    (t - t0) * f.slope * f.slope,
                    now.elapsed(),
                    f.plan.certificate.complementarity,
                    f.plan.certificate.sufficient
                );
                warm = Some(f.plan);
            }
            Err(e) => println!("T {t}: {e} its {its} {:?}", now.elapsed()),
        }
    }
}
