//! Bodies that are planned together.

use lgvi_control::constraint::{FramePose, KeepOutSphere, Moving};
use lgvi_control::{
    Actuation, Constraint, Dynamics, Formation, FormationError, Motion, NewtonSettings, Plan,
    Start, Terminal, Transfer, solve, solve_together,
};
use lgvi_dynamics::gravity::{Central, Field, Sources};
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use nalgebra::{Matrix3, Vector3};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde_json::Value;

/// Where a body goes from rest to rest: in free space, or in axes that turn with a circular orbit.
#[derive(Clone, Copy, Debug)]
struct Place {
    gm: f64,
    radius: f64,
    duration: f64,
    intervals: usize,
}

/// A body on its way.
#[derive(Clone, Copy, Debug)]
struct Way {
    mass: f64,
    weight: f64,
    ends: [Vector3<f64>; 2],
}

const FREE: Place = Place {
    gm: 0.0,
    radius: 0.0,
    duration: 3.0,
    intervals: 40,
};

const LOW_ORBIT: Place = Place {
    gm: 3.986e14,
    radius: 6.778e6,
    duration: 1200.0,
    intervals: 60,
};

impl Place {
    fn state(&self, mass: f64, time: f64, at: Vector3<f64>) -> BodyState {
        let rate = match self.gm {
            0.0 => 0.0,
            gm => (gm / self.radius.powi(3)).sqrt(),
        };
        let (sin, cos) = (rate * time).sin_cos();
        let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let position = turn * (self.radius * Vector3::x() + at);
        BodyState {
            position,
            linear_momentum: mass * (rate * Vector3::z()).cross(&position),
            attitude: Matrix3::identity(),
            angular_momentum: Vector3::zeros(),
        }
    }

    fn transfer(&self, way: &Way) -> Transfer {
        match self.gm {
            0.0 => self.in_field(way, Sources::new(Vec::new())),
            gm => self.in_field(way, Central { gm }),
        }
    }

    fn in_field(&self, way: &Way, field: impl Field + 'static) -> Transfer {
        let Way { mass, weight, ends } = *way;
        let inertia = Inertia::principal([mass; 3]).expect("inertia");
        let unit = Matrix3::identity();
        Transfer::new(
            RigidBody::new(mass, inertia, Vec::new()).expect("a body"),
            field,
            self.duration / self.intervals as f64,
            self.intervals,
            self.state(mass, 0.0, ends[0]),
            Terminal::try_from(self.state(mass, self.duration, ends[1])).expect("a state"),
            Actuation::full(&(weight * unit), &unit).expect("weights"),
        )
        .expect("a transfer")
        .with_dynamics(Dynamics::Lgvi)
        .with_motion(Motion::Translation)
    }
}

fn together(transfers: &[Transfer], separation: f64) -> Result<Formation, FormationError> {
    solve_together(
        transfers,
        separation,
        &[],
        &NewtonSettings::default(),
        |_| true,
    )
}

fn alone(transfer: &Transfer) -> Plan {
    solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true)
        .unwrap_or_else(|error| panic!("{error}"))
}

/// Two bodies without gravity are a center that flies freely and a relative motion around a fixed sphere: with `K = w m²`, the cost is
/// `(K₁ + K₂) j(center) + K₁ K₂/(K₁ + K₂) j(relative motion)`, and each gives way in the ratio of the other's `K`.
#[test]
fn two_bodies_give_way_as_their_relative_motion_does() {
    let separation = 0.5;
    for (masses, weights, aside) in [
        ([1.0, 1.0], [1.0, 1.0], 0.0),
        ([1.0, 3.0], [1.0, 1.0], 0.0),
        ([2.0, 1.0], [0.1, 5.0], 0.05),
    ] {
        let [left, right] = [-1.0, 1.0].map(|x| Vector3::new(x, aside, 0.0));
        let ends = [[left, right], [right, left - 3.0 * aside * Vector3::y()]];
        let ways = [0, 1].map(|body| Way {
            mass: masses[body],
            weight: weights[body],
            ends: ends[body],
        });
        let transfers = ways.map(|way| FREE.transfer(&way));
        let found = together(&transfers, separation).unwrap_or_else(|error| panic!("{error}"));
        assert!(found.agreement.price < 1e-6, "{:?}", found.agreement);
        assert!((found.agreement.distance / separation - 1.0).abs() < 1e-3);

        let [one, two] = ways.map(|way| way.weight * way.mass * way.mass);
        let unit = |ends| Way {
            mass: 1.0,
            weight: 1.0,
            ends,
        };
        let center = [0, 1].map(|end| (one * ends[0][end] + two * ends[1][end]) / (one + two));
        let center = alone(&FREE.transfer(&unit(center)));
        // Around the sphere on the side that the formation has chosen.
        let relative = unit([0, 1].map(|end| ends[0][end] - ends[1][end]));
        let sphere = KeepOutSphere::new(Vector3::zeros(), separation).expect("a sphere");
        let transfer = FREE
            .transfer(&relative)
            .with_constraints(&[Constraint::state(sphere)]);
        let mut guess = found.plans[0].clone();
        for (state, other) in guess.states.iter_mut().zip(&found.plans[1].states) {
            state.position -= other.position;
            state.linear_momentum =
                (state.linear_momentum / masses[0]) - other.linear_momentum / masses[1];
        }
        guess.multipliers.clear();
        let settings = NewtonSettings::default();
        let relative = solve(&transfer, Start::Warm(&guess), &settings, |_| true)
            .unwrap_or_else(|error| panic!("{error}"));
        let expected = (one + two) * center.cost + one * two / (one + two) * relative.cost;
        let off = found.total_cost() / expected - 1.0;
        println!(
            "{:?}: cost {} off {off:.1e}",
            found.agreement,
            found.total_cost()
        );
        assert!(off.abs() < 1e-6, "{off:e}");

        let free = transfers.map(|transfer| alone(&transfer));
        let mut largest = 0.0_f64;
        for end in 0..=FREE.intervals {
            let [first, second] = [0, 1].map(|body| {
                found.plans[body].states[end].position - free[body].states[end].position
            });
            let off = (one * first + two * second).norm();
            assert!(off < 1e-5 * (one + two), "{end}: {off:e}");
            largest = largest.max(first.norm());
        }
        assert!(largest > 0.05, "{largest}");
    }
}

fn cube(rng: &mut Pcg64Mcg) -> Vector3<f64> {
    Vector3::from_fn(|_, _| (rng.next_u64() >> 11) as f64 * f64::EPSILON - 1.0)
}

/// Two to four bodies of random masses and weights that fly past each other.
fn random(rng: &mut Pcg64Mcg, count: usize, place: &Place) -> Vec<Way> {
    let size = if place.gm == 0.0 { 1.0 } else { 100.0 };
    loop {
        let starts: Vec<_> = (0..count).map(|_| cube(rng)).collect();
        let ends: Vec<_> = starts.iter().map(|at| -at + 0.2 * cube(rng)).collect();
        let apart = |all: &[Vector3<f64>]| {
            let mut pairs = (0..count).flat_map(|i| (0..i).map(move |j| [i, j]));
            pairs.all(|[i, j]| (all[i] - all[j]).norm() > 0.45)
        };
        if apart(&starts) && apart(&ends) {
            let way = |(from, to): (&Vector3<f64>, &Vector3<f64>)| Way {
                mass: size * (1.5 * cube(rng).x).exp(),
                weight: cube(rng).x.exp(),
                ends: [size * from, size * to],
            };
            return starts.iter().zip(&ends).map(way).collect();
        }
    }
}

/// The least distance of two plans at many places of each step, between which bodies move along cubics.
fn nearest(h: f64, masses: [f64; 2], plans: [&Plan; 2]) -> f64 {
    let mut least = f64::INFINITY;
    for step in 0..plans[0].commands.len() {
        let seen = |end: usize| {
            let [one, other] = [0, 1].map(|body| &plans[body].states[end]);
            let velocity = one.linear_momentum / masses[0] - other.linear_momentum / masses[1];
            (one.position - other.position, h * velocity)
        };
        let ((x0, v0), (x1, v1)) = (seen(step), seen(step + 1));
        for sample in 0..=50 {
            let s = f64::from(sample) / 50.0;
            let (a, b) = (s * s * (3.0 - 2.0 * s), s * (1.0 - s));
            let at = x0 + a * (x1 - x0) + b * ((1.0 - s) * v0 - s * v1);
            least = least.min(at.norm());
        }
    }
    least
}

/// The cost where one body after the other gives way to the plans before it.
fn one_after_the_other(place: &Place, ways: &[Way], separation: f64) -> Option<f64> {
    let h = place.duration / place.intervals as f64;
    let mut spheres = Vec::new();
    let mut cost = 0.0;
    for way in ways {
        let transfer = place.transfer(way).with_constraints(&spheres);
        let settings = NewtonSettings::default();
        let plan = solve(&transfer, Start::Cold, &settings, |_| true).ok()?;
        cost += plan.cost;
        let poses = plan.states.iter().map(|state| FramePose {
            origin: state.position,
            rotation: Matrix3::identity(),
        });
        let poses: Vec<_> = poses.collect();
        let sphere = KeepOutSphere::new(Vector3::zeros(), separation).ok()?;
        let sphere = Moving::new(sphere, poses, h).ok()?;
        spheres.push(Constraint::state(sphere));
    }
    Some(cost)
}

/// The prices settle, nobody comes too near, and nothing is gained by the right of way.
#[test]
fn random_formations_keep_apart_at_a_lower_cost_than_one_after_the_other() {
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    let (mut rounds, mut compared) = (0, 0);
    for case in 0..30 {
        let place = [FREE, LOW_ORBIT][case % 2];
        let ways = random(&mut rng, 2 + case % 3, &place);
        let separation = if place.gm == 0.0 { 0.4 } else { 40.0 };
        let transfers: Vec<_> = ways.iter().map(|way| place.transfer(way)).collect();
        let found =
            together(&transfers, separation).unwrap_or_else(|error| panic!("{case}: {error}"));
        let agreement = found.agreement;
        rounds += agreement.rounds;
        assert!(agreement.price <= 1e-2, "{case}: {agreement:?}");
        let h = place.duration / place.intervals as f64;
        for body in 0..ways.len() {
            assert!(found.plans[body].certificate.terminal <= 1e-11);
            for other in 0..body {
                let pair = [other, body];
                let masses = pair.map(|body| ways[body].mass);
                let least = nearest(h, masses, pair.map(|body| &found.plans[body]));
                assert!(least > separation * (1.0 - 2e-7), "{case}: {least}");
                assert!(least > agreement.distance * (1.0 - 1e-9), "{case}: {least}");
            }
        }
        let mut reversed = ways.clone();
        reversed.reverse();
        for order in [ways, reversed] {
            if let Some(cost) = one_after_the_other(&place, &order, separation) {
                compared += 1;
                let gain = 1.0 - found.total_cost() / cost;
                println!("{case}: {agreement:?}, {gain:.1e} of the cost gained");
                assert!(gain > -1e-6, "{case}: {gain:e}");
            }
        }
    }
    println!("{rounds} rounds, {compared} comparisons");
    assert!(compared >= 50);
}

/// Minima of the same discrete problem that IPOPT finds from random starts.
#[test]
fn formations_reach_the_costs_of_another_solver() {
    let path = format!(
        "{}/../../tests/truth/formation.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(&path).expect(&path);
    let cases: Value = serde_json::from_str(&text).expect(&path);
    let number = |value: &Value| value.as_f64().expect("a number");
    let vector = |value: &Value| Vector3::from_fn(|i, _| number(&value[i]));
    let mut least = 0;
    for (case, json) in cases.as_array().expect("cases").iter().enumerate() {
        let place = Place {
            gm: number(&json["gm"]),
            radius: number(&json["radius"]),
            duration: number(&json["duration"]),
            intervals: number(&json["n"]) as usize,
        };
        let bodies = json["bodies"].as_array().expect("bodies");
        let transfers = bodies.iter().map(|body| {
            let way = Way {
                mass: number(&body["mass"]),
                weight: number(&body["weight"]),
                ends: [vector(&body["from"]), vector(&body["to"])],
            };
            place.transfer(&way).with_constraints_at_ends(&[])
        });
        let transfers: Vec<_> = transfers.collect();
        let found = together(&transfers, number(&json["separation"]))
            .unwrap_or_else(|error| panic!("{case}: {error}"));
        let minima = json["minima"].as_array().expect("minima");
        let off = minima
            .iter()
            .map(|cost| found.total_cost() / number(cost) - 1.0);
        let off: Vec<_> = off.collect();
        let best = off
            .iter()
            .map(|off| off.abs())
            .fold(f64::INFINITY, f64::min);
        println!(
            "{case}: {:?}, cost {}, off {best:.1e}",
            found.agreement,
            found.total_cost()
        );
        assert!(off.iter().any(|off| off.abs() < 1e-6), "{case}: {off:?}");
        least += usize::from(off[0].abs() < 1e-6);
    }
    println!("{least} of them the least");
    assert!(least >= 6);
}

#[test]
fn the_same_formation_has_the_same_bits() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    let ways = random(&mut rng, 3, &FREE);
    let transfers: Vec<_> = ways.iter().map(|way| FREE.transfer(way)).collect();
    let [one, other] = [(); 2].map(|()| together(&transfers, 0.4));
    assert!(one.is_ok());
    assert_eq!(one, other);
}

#[test]
fn what_cannot_be_planned_together_is_an_error() {
    let way = |y: f64, ends: [f64; 2]| Way {
        mass: 1.0,
        weight: 1.0,
        ends: ends.map(|x| Vector3::new(x, y, 0.0)),
    };
    let one = FREE.transfer(&way(0.0, [-1.0, 1.0]));
    let other = FREE.transfer(&way(0.3, [1.0, 1.0]));
    assert_eq!(
        together(std::slice::from_ref(&one), 0.1),
        Err(FormationError::Few(1))
    );
    for separation in [0.0, -1.0, f64::INFINITY] {
        let error = together(&[one.clone(), other.clone()], separation);
        assert_eq!(error, Err(FormationError::Separation(separation)));
    }
    let error = together(&[one.clone(), other.clone()], 0.5).expect_err("an error");
    let FormationError::Near {
        bodies,
        at,
        distance,
        separation,
    } = error
    else {
        panic!("{error}");
    };
    assert_eq!((bodies, at, separation), ([0, 1], "end", 0.5));
    assert!((distance - 0.3).abs() < 1e-12);
    let longer = Place {
        intervals: 41,
        ..FREE
    };
    let longer = longer.transfer(&way(0.3, [1.0, 1.0]));
    let error = together(&[one.clone(), longer], 0.1);
    assert!(matches!(
        error,
        Err(FormationError::Steps {
            body: 1,
            intervals: 41,
            ..
        })
    ));
    let turning = other.clone().with_motion(Motion::Rotation);
    let error = together(&[one.clone(), turning], 0.1);
    assert!(matches!(
        error,
        Err(FormationError::Unsupported { body: 1, .. })
    ));
    let stopped = solve_together(&[one, other], 0.2, &[], &NewtonSettings::default(), |now| {
        now.iteration < 3
    });
    assert_eq!(stopped, Err(FormationError::Stopped));
}

/// The rest of a formation, from where it will be, is the rest of its plans; plans of other steps are refused.
#[test]
fn the_rest_of_a_formation_is_planned_as_it_was() {
    for place in [FREE, LOW_ORBIT] {
        let ways = [0.0, 1.0, -2.0].map(|turn: f64| {
            let end = 2.0 * Vector3::new(turn.cos(), turn.sin(), 0.1 * turn);
            Way {
                mass: 1.0 + 0.1 * turn.abs(),
                weight: 1.0,
                ends: [-end, end],
            }
        });
        let transfers = ways.map(|way| place.transfer(&way));
        let found = together(&transfers, 0.6).unwrap_or_else(|error| panic!("{error}"));
        // In orbit their ways bend apart.
        assert!(place.gm > 0.0 || found.agreement.distance < 0.6 * (1.0 + 1e-3));
        let gone = place.intervals / 4;
        let bodies = || transfers.iter().zip(&found.plans);
        let rest = bodies().map(|(transfer, plan)| transfer.remaining(gone, plan.states[gone]));
        let rest: Vec<_> = rest.map(|rest| rest.expect("enough steps")).collect();
        let warm = bodies().map(|(transfer, plan)| plan.remaining(transfer, gone));
        let warm: Vec<_> = warm.map(|rest| rest.expect("enough steps")).collect();
        let settings = NewtonSettings::default();
        let again = solve_together(&rest, 0.6, &warm, &settings, |_| true)
            .unwrap_or_else(|error| panic!("{error}"));
        for (plan, rest) in found.plans.iter().zip(&again.plans) {
            for (one, other) in plan.states[gone..].iter().zip(&rest.states) {
                let apart = (one.position - other.position).norm();
                assert!(apart < 1e-4, "{apart:e}");
            }
        }
        let expected: f64 = warm.iter().map(|plan| plan.cost).sum();
        let cost = again.total_cost();
        assert!((cost / expected - 1.0).abs() < 1e-4, "{cost} {expected}");
        let refused = solve_together(&rest, 0.6, &found.plans, &settings, |_| true);
        assert!(matches!(refused, Err(FormationError::Warm { .. })));
        let refused = solve_together(&rest, 0.6, &warm[1..], &settings, |_| true);
        assert!(matches!(refused, Err(FormationError::Warm { .. })));
    }
}

/// Bodies pass each other on the side of the plans that they start from, though the other one is cheaper.
#[test]
fn sides_are_kept_by_plans_that_start_from_others() {
    let transfers = |aside: f64| {
        let end = Vector3::new(1.0, aside, 0.0);
        let ends = [[-Vector3::x(), end], [Vector3::x(), -end]];
        ends.map(|ends| {
            FREE.transfer(&Way {
                mass: 1.0,
                weight: 1.0,
                ends,
            })
        })
    };
    let side = |found: &Formation| {
        let [one, other] = [0, 1].map(|body| found.plans[body].states[20].position.y);
        (one - other).signum()
    };
    let left = together(&transfers(0.05), 0.5).unwrap_or_else(|error| panic!("{error}"));
    let right = transfers(-0.02);
    let cold = together(&right, 0.5).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!([side(&left), side(&cold)], [1.0, -1.0]);
    let settings = NewtonSettings::default();
    let warm = solve_together(&right, 0.5, &left.plans, &settings, |_| true)
        .unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(side(&warm), 1.0);
    assert!(warm.total_cost() > cold.total_cost());
}

/// A body that stays where it is gives way and comes back.
#[test]
fn a_body_at_rest_gives_way() {
    let resting = Way {
        mass: 1.0,
        weight: 1.0,
        ends: [Vector3::new(0.0, 0.1, 0.0); 2],
    };
    let passing = Way {
        ends: [-1.0, 1.0].map(|x| Vector3::new(x, 0.0, 0.0)),
        ..resting
    };
    let transfers = [resting, passing].map(|way| FREE.transfer(&way));
    let found = together(&transfers, 0.3).unwrap_or_else(|error| panic!("{error}"));
    assert!(found.agreement.price < 1e-6);
    let free = [0, 1].map(|body| alone(&transfers[body]));
    for end in 0..=FREE.intervals {
        let [first, second] = [0, 1]
            .map(|body| found.plans[body].states[end].position - free[body].states[end].position);
        assert!((first + second).norm() < 1e-5);
    }
    let most = found.plans[0].states.iter().map(|state| state.position.y);
    let most = most.fold(0.0, f64::max);
    assert!((most - 0.2).abs() < 2e-3, "both give way by half: {most}");
}
