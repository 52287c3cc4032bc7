use lgvi_dynamics::thrusters::Thrusters;
use lgvi_dynamics::{Inertia, MassDistribution, Mobility, RigidBody};
use lgvi_scene::{NamedBody, Units};
use serde::Serialize;

/// What a body is to the integrators and to gravity.
#[derive(Debug, Serialize)]
pub(super) struct Body {
    pub(super) name: String,
    pub(super) kind: &'static str,
    /// Names of its reaction wheels.
    pub(super) wheels: Vec<String>,
    /// Names of its thrusters.
    pub(super) thrusters: Vec<String>,
    pub(super) engine: Option<Engine>,
    pub(super) mobility: &'static str,
    pub(super) distribution: String,
    /// How the scene gives the initial state, unless by numbers in the inertial frame.
    pub(super) given: Option<String>,
    /// Initial position, inertial frame (m).
    pub(super) position: [f64; 3],
    /// Initial velocity, inertial frame (m/s).
    pub(super) velocity: [f64; 3],
    /// Initial attitude, body to inertial, by rows.
    pub(super) attitude: [[f64; 3]; 3],
    /// Initial angular velocity, body frame (rad/s).
    pub(super) angular_velocity: [f64; 3],
}

/// The engine of a body.
#[derive(Debug, Serialize)]
pub(super) struct Engine {
    /// Largest force (N); none without a limit.
    pub(super) thrust: Option<f64>,
    /// Effective exhaust velocity (m/s).
    pub(super) exhaust_velocity: f64,
}

/// Difference of principal moments, of the greatest, that is rounding.
const EQUAL: f64 = 1e-9;

impl Body {
    pub(super) fn of(named: &NamedBody, units: &Units) -> Self {
        let (body, state) = (&named.body, &named.state);
        let attitude = &state.attitude;
        Self {
            given: named.given.clone(),
            position: (state.position * units.length).into(),
            velocity: (state.velocity(body) * (units.length / units.time)).into(),
            attitude: std::array::from_fn(|i| std::array::from_fn(|j| attitude[(i, j)])),
            angular_velocity: (state.angular_velocity(body) / units.time).into(),
            name: named.name.clone(),
            kind: kind(&named.body.locked_inertia()),
            wheels: named.wheels.clone(),
            thrusters: named.thrusters.clone(),
            engine: body
                .thrusters()
                .and_then(Thrusters::engine)
                .map(|engine| Engine {
                    thrust: Some(engine.thrust * units.force()).filter(|thrust| thrust.is_finite()),
                    exhaust_velocity: engine.exhaust_velocity * (units.length / units.time),
                }),
            mobility: match named.body.mobility() {
                Mobility::Free => "free",
                Mobility::Pivoted => "pivoted",
                Mobility::Fixed => "fixed",
                Mobility::Driven(_) => "driven",
            },
            distribution: distribution(&named.body),
        }
    }
}

fn kind(inertia: &Inertia) -> &'static str {
    let moments = inertia.principal_moments();
    let greatest = moments.into_iter().fold(0.0, f64::max);
    let equal = |i: usize, j: usize| (moments[i] - moments[j]).abs() <= EQUAL * greatest;
    match [equal(0, 1), equal(1, 2), equal(0, 2)] {
        [false, false, false] => "asymmetric",
        [true, true, _] | [true, _, true] | [_, true, true] => "sphere",
        _ => "axisymmetric",
    }
}

fn distribution(body: &RigidBody) -> String {
    match body.distribution() {
        MassDistribution::Points(points) => match points.as_slice() {
            [point] if point.position.norm() == 0.0 => "a point".into(),
            [_] => "a point away from the origin".into(),
            points => format!("{} points", points.len()),
        },
        MassDistribution::Multipole(multipole) => {
            format!("multipole of order {}", multipole.order())
        }
        MassDistribution::Polyhedron(mass) => {
            format!("polyhedron, cloud of {} points", mass.cloud().len())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_are_told_apart_by_their_principal_moments() {
        let kind = |moments| kind(&Inertia::principal(moments).unwrap());
        assert_eq!(kind([2.0, 2.0, 2.0]), "sphere");
        assert_eq!(kind([2.0, 2.5, 2.0]), "axisymmetric");
        assert_eq!(kind([1.0, 2.0, 2.5]), "asymmetric");
    }
}
