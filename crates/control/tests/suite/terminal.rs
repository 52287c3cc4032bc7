//! What is no terminal set and no constraint is refused with what is wrong.

use std::f64::consts::FRAC_PI_2;

use lgvi_control::{
    Actuation, Constraint, ConstraintError, RotationTarget, Terminal, TerminalError, Transfer,
    TransferError, TranslationTarget,
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
fn bad_constraints_are_refused_by_number_and_name() {
    let fine = Constraint::ForceNorm {
        limit: f64::INFINITY,
    };
    let refused = |constraint| {
        let transfer = to(Terminal::from(state())).expect("a transfer");
        match transfer.with_constraints(vec![fine, constraint]).err() {
            Some(TransferError::Constraint(error)) => error,
            other => panic!("{other:?}"),
        }
    };
    let cone = |axis, half_angle| Constraint::KeepOutCone {
        axis,
        direction: Vector3::z(),
        half_angle,
    };
    let corridor = |half_angle| Constraint::Corridor {
        apex: Vector3::zeros(),
        axis: Vector3::x(),
        half_angle,
    };
    let limit = |error: &ConstraintError, name: &str| matches!(error, ConstraintError::Limit { constraint: 1, which, .. } if *which == name);
    assert!(limit(
        &refused(Constraint::ForceNorm { limit: 0.0 }),
        "limit"
    ));
    assert!(limit(
        &refused(Constraint::MomentNorm { limit: f64::NAN }),
        "limit"
    ));
    let one_negative = Vector3::new(1.0, 1.0, -1.0);
    assert!(limit(
        &refused(Constraint::ForceComponents {
            limit: one_negative
        }),
        "limit"
    ));
    for radius in [-1.0, f64::INFINITY] {
        let center = Vector3::zeros();
        assert!(limit(
            &refused(Constraint::KeepOutSphere { center, radius }),
            "radius"
        ));
    }
    for bad in [
        cone(Vector3::x(), 0.0),
        cone(Vector3::x(), 3.2),
        corridor(FRAC_PI_2),
        corridor(f64::NAN),
    ] {
        assert!(matches!(
            refused(bad),
            ConstraintError::Angle { constraint: 1, .. }
        ));
    }
    let short = refused(cone(0.9 * Vector3::x(), 0.3));
    assert!(
        matches!(short, ConstraintError::Unit { which: "axis", .. }),
        "{short}"
    );
    let lost = refused(Constraint::Corridor {
        apex: Vector3::new(f64::INFINITY, 0.0, 0.0),
        axis: Vector3::x(),
        half_angle: 0.3,
    });
    assert!(
        matches!(lost, ConstraintError::NotFinite { which: "apex", .. }),
        "{lost}"
    );
}
