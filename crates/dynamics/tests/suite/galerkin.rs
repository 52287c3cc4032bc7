use crate::case::{Case, Errors};
use lgvi_dynamics::integrator::{ChartOrigin, Quadrature};
use lgvi_dynamics::{Load, Method};

const ORIGINS: [ChartOrigin; 2] = [ChartOrigin::Start, ChartOrigin::Middle];

fn galerkin(degree: u32, quadrature: Quadrature, origin: ChartOrigin) -> Method {
    Method::Galerkin {
        degree,
        quadrature,
        origin,
    }
}

fn size(e: &Errors) -> f64 {
    e.position
        .max(e.velocity)
        .max(e.attitude)
        .max(e.angular_velocity)
}

#[test]
fn probe() {
    for (case, hs) in [
        ("b1_free_asymmetric", [0.01, 0.1, 0.5]),
        ("d_dumbbell_central", [0.01, 0.1, 0.5]),
        ("a1_two_dumbbells_regular", [0.002, 0.02, 0.1]),
    ] {
        let data = Case::load(case);
        for h in hs {
            let mut methods: Vec<Method> = [1, 2, 3, 4, 5, 6, 8, 10]
                .into_iter()
                .map(|s| galerkin(s, Quadrature::Gauss(s), ChartOrigin::Middle))
                .collect();
            methods.push(galerkin(4, Quadrature::Gauss(4), ChartOrigin::Start));
            methods.push(Method::Lgvi(Default::default()));
            for method in methods {
                let mut sim = data.simulation(method, h);
                let e0 = sim.invariants().energy;
                let controls = vec![Load::default(); sim.states().len()];
                let n = 1000;
                let (mut its, mut max) = (0, 0);
                let begin = std::time::Instant::now();
                for k in 0..n {
                    match sim.advance(&controls) {
                        Ok(r) => {
                            its += r.iterations;
                            max = max.max(r.iterations);
                        }
                        Err(e) => {
                            println!("{e} at {k}");
                            break;
                        }
                    }
                }
                let t = begin.elapsed().as_secs_f64() / f64::from(n) * 1e6;
                println!(
                    "{case} h={h} {method:?}: its {:.2} max {max} {t:.2} us, energy {:.1e}",
                    f64::from(its) / f64::from(n),
                    sim.invariants().energy - e0
                );
            }
        }
    }
    for (t, steps) in [(10.0, [8, 6, 6]), (10.0, [9, 7, 7]), (5.0, [4, 4, 3])] {
        for origin in ORIGINS {
            for s in [4u32, 5, 6] {
                for q in [Quadrature::Gauss(s), Quadrature::Lobatto(s + 1)] {
                    let errors: Vec<f64> = (0..4)
                        .map(|k| {
                            let n = steps[s as usize - 4] << k;
                            let data = Case::load("d_dumbbell_central");
                            let mut sim = data.simulation(galerkin(s, q, origin), t / f64::from(n));
                            for _ in 0..n {
                                if let Err(e) = sim.advance(&[Load::default()]) {
                                    println!("{e}");
                                    return f64::NAN;
                                }
                            }
                            size(&data.compare(t, &sim))
                        })
                        .collect();
                    let orders: Vec<f64> =
                        errors.windows(2).map(|p| (p[0] / p[1]).log2()).collect();
                    println!(
                        "t {t} {steps:?} {origin:?} {q:?} s={s}: {orders:.2?} {:.1e} {:.1e}",
                        errors[0], errors[3]
                    );
                }
            }
        }
    }
}
