//! The omitted part of interactions is within the stated bounds, and not much smaller.

use lgvi_dynamics::gravity::{
    Central, Falloff, Fixed, Gravity, Interaction, Kept, Level, Multipole, Mutual, Polyhedron,
    Separable, Uniform,
};
use lgvi_dynamics::{BodyState, Load, MassDistribution, Mobility, PointMass, RigidBody};
use lgvi_truth::random::Random;
use nalgebra::{Matrix3, Vector3};

use super::{ball, dumbbell, inertia};

/// Four points about their center of mass.
fn tetrapod(random: &mut Random) -> RigidBody {
    let mut points: Vec<_> = (0..4)
        .map(|_| PointMass {
            mass: random.uniform(0.2, 1.0),
            position: random.normals(),
        })
        .collect();
    let mass: f64 = points.iter().map(|point| point.mass).sum();
    let first: Vector3<f64> = points.iter().map(|point| point.mass * point.position).sum();
    for point in &mut points {
        point.position -= first / mass;
    }
    RigidBody::new(mass, inertia([1.0, 1.3, 1.5]), points).expect("a body")
}

fn quadrupole(random: &mut Random) -> RigidBody {
    let [a, b] = [random.uniform(1.0, 2.0), random.uniform(1.0, 2.0)];
    let moments = inertia([a, b, random.uniform((a - b).abs() + 0.01, a + b)]);
    let multipole = Multipole::of_inertia(random.uniform(1.0, 5.0), &moments);
    RigidBody::with_multipole(moments, multipole).expect("a body")
}

fn cuboid(random: &mut Random) -> RigidBody {
    let edges = [0; 3].map(|_| random.uniform(0.2, 1.0));
    let polyhedron = Polyhedron::cuboid(edges, 2.0).expect("a cuboid");
    RigidBody::with_polyhedron(None, &polyhedron, 4).expect("a body")
}

/// Bodies of all kinds, five of each.
fn kinds() -> Vec<RigidBody> {
    let each = (0..25).map(|index| {
        let mut random = Random::new(3, index);
        let random = &mut random;
        match index % 5 {
            0 => ball(random.uniform(0.1, 3.0)),
            1 => dumbbell(random.uniform(0.1, 3.0), random.uniform(0.1, 2.0)),
            2 => tetrapod(random),
            3 => quadrupole(random),
            _ => cuboid(random),
        }
    });
    each.collect()
}

fn any(kinds: &[RigidBody], random: &mut Random) -> RigidBody {
    kinds[random.below(kinds.len())].clone()
}

fn at(position: Vector3<f64>, random: &mut Random) -> BodyState {
    BodyState {
        position,
        linear_momentum: Vector3::zeros(),
        attitude: random.rotation(),
        angular_momentum: Vector3::zeros(),
    }
}

fn separable(gravity: &mut dyn Gravity) -> &mut dyn Separable {
    gravity.separable().expect("interactions")
}

/// The omitted acceleration and angular acceleration of each body at a level, as fractions of the bounds.
fn parts(
    gravity: &mut dyn Gravity,
    bodies: &[RigidBody],
    states: &[BodyState],
    level: Level,
    distance: f64,
) -> Vec<[f64; 2]> {
    let interactions = separable(gravity).interactions(bodies);
    let [Interaction { remainder, .. }] = interactions[..] else {
        panic!("one interaction, not {}", interactions.len());
    };
    let bounds = remainder.expect("a remainder").neglect(level, distance);
    let mut loads = [0; 2].map(|_| vec![Load::default(); bodies.len()]);
    gravity.add_loads(bodies, states, &mut loads[0]);
    let kept = (level > Level::Dropped).then_some(Kept {
        body: 0,
        other: bodies.len() - 1,
        level,
        masses: bodies.iter().map(RigidBody::mass).product(),
    });
    separable(gravity).add_kept_loads(bodies, states, &mut loads[1], kept.as_slice());
    let [full, kept] = &loads;
    let each = bodies.iter().enumerate().zip(bounds);
    each.map(|((index, body), bound)| {
        let force = (full[index].force - kept[index].force).norm() / body.mass();
        let moment = full[index].moment - kept[index].moment;
        let turning = (body.inertia().inverse() * moment).norm();
        // Loads that cancel leave a rounding error, and so do moments of the force through the other body's center. The
        // rounding error of a polyhedron's closed form grows with the square of the distance over its size.
        let closed =
            |body: &RigidBody| matches!(body.distribution(), MassDistribution::Polyhedron(_));
        let far = if bodies.iter().any(closed) {
            (distance / 0.2).powi(2).max(1.0)
        } else {
            1.0
        };
        let rounding = 1e-14 * far * full[index].force.norm();
        let part = |found: f64, rounding: f64, bound: f64| {
            (found - rounding).max(0.0) / bound.max(f64::MIN_POSITIVE)
        };
        let of_force = rounding / body.mass();
        let of_moment = rounding * distance * body.inertia().inverse().norm();
        [
            part(force, of_force, bound.acceleration),
            part(turning, of_moment, bound.angular_acceleration),
        ]
    })
    .collect()
}

const LEVELS: [Level; 3] = [Level::Dropped, Level::Monopole, Level::Quadrupole];

/// Radius about the origin that contains the mass, at least 1.
fn radius(body: &RigidBody) -> f64 {
    let points = body.points().iter().map(|point| point.position.norm());
    points.fold(1.0, f64::max)
}

#[test]
fn what_is_left_out_of_pairs_is_within_the_bounds() {
    let kinds = kinds();
    let mut most = [[0.0_f64; 2]; 3];
    for trial in 0..20_000 {
        let mut random = Random::new(4, trial);
        let bodies = [any(&kinds, &mut random), any(&kinds, &mut random)];
        let distance = random.log_uniform(1.05, 1e3) * (radius(&bodies[0]) + radius(&bodies[1]));
        let states = [
            at(distance * random.direction(), &mut random),
            at(Vector3::zeros(), &mut random),
        ];
        for (level, most) in LEVELS.into_iter().zip(&mut most) {
            for part in parts(&mut Mutual::new(0.7), &bodies, &states, level, distance) {
                assert!(
                    part.iter().all(|part| *part <= 1.0),
                    "{trial}: {part:?} {bodies:?}"
                );
                *most = [0, 1].map(|i| most[i].max(part[i]));
            }
        }
    }
    // The bounds are not too loose: some configuration comes close to them.
    println!("{most:?}");
    let [[dropped, _], [monopole, moment], [second_order, _]] = most;
    assert!(dropped > 0.9 && monopole > 0.3 && moment > 0.3, "{most:?}");
    assert!(second_order > 0.1, "{most:?}");
}

#[test]
fn what_is_left_out_under_fixed_sources_is_within_the_bounds() {
    let kinds = kinds();
    let mut most = [0.0_f64; 2];
    for trial in 0..20_000 {
        let mut random = Random::new(5, trial);
        let body = [any(&kinds, &mut random)];
        let place = random.normals();
        let distance = random.log_uniform(1.05, 1e3) * radius(&body[0]);
        let states = [at(place + distance * random.direction(), &mut random)];
        let turned = random.rotation();
        let planet = Multipole::oblate(3.0, random.uniform(-0.1, 0.1), 0.5);
        let mut sources: [Box<dyn Gravity>; 2] = [
            Box::new(Fixed::new(Central { gm: 3.0 }, place, Matrix3::identity())),
            Box::new(Fixed::new(planet, place, turned)),
        ];
        for source in &mut sources {
            let parts = parts(source.as_mut(), &body, &states, Level::Monopole, distance);
            assert!(
                parts[0].iter().all(|part| *part <= 1.0),
                "{trial}: {parts:?} {body:?}"
            );
            most = [0, 1].map(|i| most[i].max(parts[0][i]));
        }
    }
    println!("{most:?}");
    assert!(most.iter().all(|most| *most > 0.3), "{most:?}");
}

/// Checks the exact levels and the falloff that interactions report.
#[test]
fn exact_levels_are_those_that_leave_nothing_out() {
    let mut random = Random::new(6, 0);
    let bodies = [
        ball(1.0),
        ball(2.0),
        dumbbell(1.0, 1.0),
        ball(1.0).with_mobility(Mobility::Fixed),
        quadrupole(&mut random).with_mobility(Mobility::Fixed),
    ];
    let level = |gravity: &dyn Separable| -> Vec<_> {
        let interactions = gravity.interactions(&bodies);
        interactions
            .iter()
            .map(|interaction| interaction.exact)
            .collect()
    };
    use Level::{Dropped, Full, Monopole};
    let pairs = [
        Monopole, Full, Monopole, Full, // the first ball with each
        Full, Monopole, Full, // the second ball
        Full, Full,    // the dumbbell
        Dropped, // the fixed bodies
    ];
    assert_eq!(level(&Mutual::new(1.0)), pairs);
    let central = [Monopole, Monopole, Full, Dropped, Dropped];
    assert_eq!(level(&Central { gm: 1.0 }), central);
    let acceleration = Vector3::new(0.0, 0.0, -1.0);
    let uniform = [Monopole, Monopole, Monopole, Dropped, Dropped];
    assert_eq!(level(&Uniform { acceleration }), uniform);
    let falloff = lgvi_dynamics::gravity::Attractor::falloff(&Central { gm: -2.0 });
    let expected = Falloff {
        strength: -2.0,
        harmonic: 0.0,
    };
    assert_eq!(falloff, Some(expected));
}

/// A pivoted body and a multipole of fourth order are computed in full.
#[test]
fn what_has_no_bound_is_not_simplified() {
    let pivoted = RigidBody::pivoted(1.0, inertia([1.0; 3]), vec![]).expect("a body");
    let rock = Polyhedron::cuboid([1.0, 0.8, 0.6], 1.0).expect("a cuboid");
    let series = Multipole::of_moments(rock.mass(), &rock.moments());
    let series = RigidBody::with_multipole(rock.inertia().expect("an inertia"), series);
    for body in [pivoted, series.expect("a body")] {
        let bodies = [body, dumbbell(1.0, 1.0)];
        let interactions = Mutual::new(1.0).interactions(&bodies);
        assert_eq!(interactions[0].exact, Level::Full);
        assert_eq!(interactions[0].remainder, None);
    }
}
