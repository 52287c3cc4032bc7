//! What is no terminal set and no constraint is refused with what is wrong.

use std::f64::consts::FRAC_PI_2;

use lgvi_control::constraint::{
    CommandLimit, ComponentLimit, Corridor, KeepOutCone, KeepOutSphere, NormLimit, Place,
};
use lgvi_control::{
    Actuation, RotationTarget, Terminal, TerminalError, Transfer, TransferError, TranslationTarget,
};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use nalgebra::{Matrix3, Vector3};

fn state() -> BodyState {
    BodyState {
        position: Vector3::x(),
        linear_momentum: Vector3::y(),
        attitude: Matrix3::identity(),
        angular_momentum: Vector3::zeros(),
    }
}

fn to(terminal: Terminal) -> Result<Transfer<Central>, TransferError> {
    let inertia = Inertia::principal([1.0, 1.0, 1.0]).expect("inertia");
    let body = RigidBody::new(1.0, inertia, Vec::new()).expect("a body");
    let identity = Matrix3::identity();
    let actuation = Actuation::full(&identity, &identity).expect("weights");
    Transfer::new(
        body,
        Central { gm: 1.0 },
        0.1,
        10,
        state(),
        terminal,
        actuation,
    )
}

fn translation(translation: TranslationTarget) -> TransferError {
    let rotation = RotationTarget::Free;
    to(Terminal {
        translation,
        rotation,
    })
    .err()
    .expect("an error")
}

fn rotation(rotation: RotationTarget) -> TransferError {
    let translation = TranslationTarget::Free;
    to(Terminal {
        translation,
        rotation,
    })
    .err()
    .expect("an error")
}

#[test]
fn bad_targets_are_refused_by_name() {
    let nowhere = translation(TranslationTarget::Position {
        position: Vector3::new(0.0, f64::NAN, 0.0),
    });
    assert!(nowhere.to_string().contains("position"), "{nowhere}");

    let orbit = |gm, linear_momentum| {
        translation(TranslationTarget::Orbit {
            gm,
            center: Vector3::zeros(),
            position: Vector3::x(),
            linear_momentum,
        })
    };
    let massless = orbit(-1.0, Vector3::y());
    assert_eq!(massless, TransferError::Terminal(TerminalError::Gm(-1.0)));
    // A parabola, a hyperbola, a fall and a body at rest.
    for momentum in [
        1.5 * Vector3::y(),
        2.0 * Vector3::y(),
        0.5 * Vector3::x(),
        Vector3::zeros(),
    ] {
        let unbound = orbit(1.0, momentum);
        let expected = matches!(
            unbound,
            TransferError::Terminal(TerminalError::Orbit { .. })
        );
        assert!(expected, "{unbound}");
    }

    let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
    let stretched = 1.001 * Matrix3::<f64>::identity();
    for attitude in [mirror, stretched, Matrix3::from_element(f64::NAN)] {
        let refused = rotation(RotationTarget::Attitude { attitude });
        let expected = matches!(
            refused,
            TransferError::Terminal(TerminalError::Attitude { .. })
        );
        assert!(expected, "{refused}");
    }

    let long = rotation(RotationTarget::SpinAxis {
        axis: Vector3::x(),
        direction: Vector3::new(1.0, 1.0, 0.0),
        angular_momentum: Vector3::zeros(),
    });
    let expected = matches!(
        long,
        TransferError::Terminal(TerminalError::Unit { which: "direction", norm, .. }) if norm > 1.4
    );
    assert!(expected, "{long}");
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
        (CommandLimit::new([-2.0; 6]).err(), "limit", "-2.0"),
        (KeepOutSphere::new(zero, -1.0).err(), "radius", "-1.0"),
        (
            KeepOutSphere::new(zero, f64::INFINITY).err(),
            "radius",
            "inf",
        ),
        (
            KeepOutSphere::new(far, 1.0).err(),
            "centre",
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
