//! Invalid terminal sets and constraints are rejected with the cause.

use std::f64::consts::FRAC_PI_2;

use lgvi_control::constraint::{
    CommandLimit, ComponentLimit, Corridor, KeepOutCone, KeepOutSphere, NormLimit, Place,
};
use lgvi_control::terminal::{FinalAttitude, FinalPosition, KeplerOrbit, SpinAxis};
use lgvi_control::{Actuation, ParameterError, Transfer};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use nalgebra::{Matrix3, Vector3};

#[test]
fn bad_targets_are_refused_by_name() {
    let [zero, x, y] = [Vector3::zeros(), Vector3::x(), Vector3::y()];
    let nowhere = Vector3::new(0.0, f64::NAN, 0.0);
    let orbit = |gm, velocity| KeplerOrbit::new(gm, zero, 1.0, x, velocity).err();
    let attitude = |attitude| FinalAttitude::new(attitude, None).err();
    let [identity, x_mirrored] =
        [[1.0; 3], [-1.0, 1.0, 1.0]].map(|d| Matrix3::from_diagonal(&d.into()));
    let refusals: [(Option<ParameterError>, &str, &str); 13] = [
        (
            FinalPosition::new(nowhere, None).err(),
            "position",
            "finite",
        ),
        (
            FinalPosition::new(x, Some(nowhere)).err(),
            "linear_momentum",
            "finite",
        ),
        (orbit(-1.0, y), "gm", "> 0"),
        (KeplerOrbit::new(1.0, zero, 0.0, x, y).err(), "mass", "> 0"),
        // A parabola, a hyperbola, a fall and a body at rest.
        (orbit(1.0, 1.5 * y), "velocity", "escape"),
        (orbit(1.0, 2.0 * y), "velocity", "escape"),
        (orbit(1.0, 0.5 * x), "orbit", "through the attractor"),
        (orbit(1.0, zero), "orbit", "through the attractor"),
        (attitude(x_mirrored), "attitude", "a rotation"),
        (attitude(1.001 * identity), "attitude", "a rotation"),
        (attitude(f64::NAN * identity), "attitude", "a rotation"),
        (
            FinalAttitude::new(identity, Some(nowhere)).err(),
            "angular_momentum",
            "finite",
        ),
        (SpinAxis::new(zero, x, zero).err(), "axis", "not zero"),
    ];
    for (refused, name, expected) in refusals {
        let error = refused.expect(name);
        assert!(
            error.name == name && error.expected.contains(expected),
            "{error}"
        );
    }
}

#[test]
fn a_state_that_is_none_is_refused_by_the_transfer() {
    let state = BodyState {
        position: Vector3::x(),
        linear_momentum: Vector3::y(),
        attitude: Matrix3::identity(),
        angular_momentum: Vector3::zeros(),
    };
    let target = BodyState {
        attitude: 2.0 * state.attitude,
        ..state
    };
    let inertia = Inertia::principal([1.0, 1.0, 1.0]).expect("inertia");
    let body = RigidBody::new(1.0, inertia, Vec::new()).expect("a body");
    let identity = Matrix3::identity();
    let actuation = Actuation::full(&identity, &identity).expect("weights");
    let field = Central { gm: 1.0 };
    let refused = Transfer::new(body, field, 0.1, 10, state, target, actuation).err();
    let refused = refused.expect("an error").to_string();
    assert!(refused.contains("the target's `attitude`"), "{refused}");
}

#[test]
fn bad_constraints_are_refused_by_name() {
    let [zero, x, z] = [Vector3::zeros(), Vector3::x(), Vector3::z()];
    let far = Vector3::new(f64::INFINITY, 0.0, 0.0);
    let negative = Vector3::new(1.0, 1.0, -1.0);
    assert!(NormLimit::new(Place::Position, f64::INFINITY).is_ok());
    for (refused, name, value) in [
        (NormLimit::new(Place::Position, 0.0).err(), "limit", "0.0"),
        (
            NormLimit::new(Place::Attitude, f64::NAN).err(),
            "limit",
            "NaN",
        ),
        (
            ComponentLimit::new(Place::Position, negative).err(),
            "limit",
            "-1.0",
        ),
        (CommandLimit::new(&[-2.0; 6]).err(), "limit", "-2.0"),
        (KeepOutSphere::new(zero, -1.0).err(), "radius", "-1.0"),
        (
            KeepOutSphere::new(zero, f64::INFINITY).err(),
            "radius",
            "inf",
        ),
        (
            KeepOutSphere::new(far, 1.0).err(),
            "center",
            "[inf, 0.0, 0.0]",
        ),
        (KeepOutCone::new(x, z, 0.0).err(), "half_angle", "0.0"),
        (KeepOutCone::new(x, z, 3.2).err(), "half_angle", "3.2"),
        (
            KeepOutCone::new(zero, z, 0.3).err(),
            "axis",
            "[0.0, 0.0, 0.0]",
        ),
        (
            KeepOutCone::new(x, far, 0.3).err(),
            "direction",
            "[inf, 0.0, 0.0]",
        ),
        (
            Corridor::new(zero, x, FRAC_PI_2).err(),
            "half_angle",
            "1.57",
        ),
        (Corridor::new(zero, x, f64::NAN).err(), "half_angle", "NaN"),
        (Corridor::new(far, x, 0.3).err(), "apex", "[inf, 0.0, 0.0]"),
    ] {
        let error = refused.expect(name);
        assert!(
            error.name == name && error.value.starts_with(value),
            "{error}"
        );
    }
}
