//! Truncation errors of multipole expansions.

use lgvi_dynamics::BodyState;
use lgvi_dynamics::gravity::{Field, Multipole};
use nalgebra::Vector3;

use crate::mutual::Pair;
use crate::potentials::{Cloud, Kind, vector};

const KINDS: [Kind; 3] = [Kind::Points, Kind::Series(2), Kind::Series(4)];

/// The force between two multipoles has a truncation error, relative to the force between the points they represent,
/// that decays with the power 3 of the distance at second order and with the power 5 at fourth order.
#[test]
fn the_error_of_the_series_falls_with_the_distance() {
    let mut rng = fastrand::Rng::with_seed(5);
    let exact = [0, 1].map(|_| Cloud::random(Kind::Points, &mut rng, 0.4));
    let attitudes = [0, 1].map(|_| lgvi_lie::exp(&vector(&mut rng, 1.8)));
    let direction = vector(&mut rng, 1.0).normalize();
    let force = |kind: Kind, distance: f64| {
        let clouds = exact.clone().map(|cloud| Cloud { kind, ..cloud });
        let states = [0, 1].map(|own: usize| BodyState {
            position: own as f64 * distance * direction,
            linear_momentum: Vector3::zeros(),
            attitude: attitudes[own],
            angular_momentum: Vector3::zeros(),
        });
        Pair { clouds, states }.loads()[0].force
    };
    let error = |kind: Kind, distance: f64| {
        let expected = force(KINDS[0], distance);
        (force(kind, distance) - expected).norm() / expected.norm()
    };
    for (kind, power) in [(KINDS[1], 3.0), (KINDS[2], 5.0)] {
        let errors = [20.0, 40.0, 80.0].map(|distance| error(kind, distance));
        println!("{kind:?}: {errors:?}");
        for pair in errors.windows(2) {
            let slope = (pair[0] / pair[1]).log2();
            assert!((slope - power).abs() < 0.15, "{kind:?}: {errors:?}");
        }
    }
}

/// A planet's oblateness acts only on the center of a multipole body. The omitted moment is of order `J₂ (a/r)²`
/// relative to the actual moment.
#[test]
fn the_moment_that_oblateness_adds_is_small_as_stated() {
    let mut rng = fastrand::Rng::with_seed(6);
    let (j2, radius) = (0.1, 1.0);
    let planet = Multipole::oblate(1.0, j2, radius);
    let exact = Cloud::random(Kind::Points, &mut rng, 0.02);
    let r = lgvi_lie::exp(&vector(&mut rng, 1.8));
    let direction = vector(&mut rng, 1.0).normalize();
    let moment = |kind: Kind, distance: f64| {
        let body = Cloud {
            kind,
            ..exact.clone()
        }
        .body();
        planet.load(&body, &(distance * direction), &r).moment
    };
    let errors = [5.0, 10.0, 20.0].map(|distance| {
        let expected = moment(KINDS[0], distance);
        (moment(KINDS[2], distance) - expected).norm() / expected.norm()
    });
    println!("moment left out: {errors:?}");
    for (error, distance) in errors.iter().zip([5.0, 10.0, 20.0]) {
        let stated = j2 * (radius / distance).powi(2);
        assert!((0.1..10.0).contains(&(error / stated)), "{errors:?}");
    }
    for pair in errors.windows(2) {
        let slope = (pair[0] / pair[1]).log2();
        assert!((slope - 2.0).abs() < 0.05, "{errors:?}");
    }
}
