//! Galerkin Lie group variational integrators: order, laws, equivariance, and the reduced equations.

use crate::case::{Case, Errors};
use lgvi_dynamics::Method;
use lgvi_dynamics::integrator::{ChartOrigin, Quadrature};

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
    for (case, t, steps) in [
        ("b1_free_asymmetric", 1.0, [8, 4, 2, 2, 1, 1]),
        ("d_dumbbell_central", 1.0, [8, 4, 2, 2, 1, 1]),
        ("a1_two_dumbbells_regular", 1.0, [64, 32, 16, 12, 8, 8]),
    ] {
        let case_data = Case::load(case);
        for origin in ORIGINS {
            for degree in 1..=6 {
                for quadrature in [Quadrature::Gauss(degree), Quadrature::Lobatto(degree + 1)] {
                    let method = galerkin(degree, quadrature, origin);
                    let errors: Vec<f64> = (0..4)
                        .map(|k| {
                            let n = steps[degree as usize - 1] << k;
                            size(&case_data.errors_at(t, n, method))
                        })
                        .collect();
                    let orders: Vec<f64> =
                        errors.windows(2).map(|p| (p[0] / p[1]).log2()).collect();
                    println!(
                        "{case} {origin:?} {quadrature:?} s={degree}: {orders:.2?} {:.1e} {:.1e}",
                        errors[0], errors[3]
                    );
                }
            }
        }
    }
}
