//! Loads of one evaluation of gravity.

use std::hint::black_box;

use lgvi_dynamics::gravity::{Gravity, Multipole, Mutual, Polyhedron};
use lgvi_dynamics::{BodyState, Inertia, Load, RigidBody, System};
use nalgebra::{Matrix3, Vector3};

use super::{CALLS, Kernel};

/// A system and where its bodies are.
type Placed = (System, Vec<BodyState>);

fn placed(bodies: Vec<RigidBody>, gravity: Box<dyn Gravity>) -> Placed {
    let attitude = turned();
    let at = |(index, body): (u8, &RigidBody)| {
        let position = Vector3::new(3.0, 1.0 + 5.0 * f64::from(index), -2.0);
        let zero = Vector3::zeros();
        BodyState::from_velocities(body, position, zero, attitude, zero)
    };
    let states = (0..).zip(&bodies).map(at).collect();
    (System::new(bodies, vec![gravity]), states)
}

/// No axis of which is one of the inertial frame.
fn turned() -> Matrix3<f64> {
    *nalgebra::Rotation3::new(Vector3::new(0.3, -0.5, 0.8)).matrix()
}

fn inertia() -> Inertia {
    Inertia::principal([1.0, 1.2, 1.5]).expect("inertia")
}

fn multipole() -> RigidBody {
    let multipole = Multipole::of_inertia(1.0, &inertia());
    RigidBody::with_multipole(inertia(), multipole).expect("a body")
}

/// A body by its second moments round an oblate planet.
fn central_j2() -> Placed {
    placed(
        vec![multipole()],
        Box::new(Multipole::oblate(1.0, 1e-3, 0.5)),
    )
}

fn multipole_pair() -> Placed {
    placed(vec![multipole(), multipole()], Box::new(Mutual::new(1.0)))
}

/// A sphere beside a rock of 80 faces.
fn polyhedron() -> Placed {
    let rock = Polyhedron::ellipsoid([0.5, 0.4, 0.3], 1, 2.0).expect("a polyhedron");
    let rock = RigidBody::with_polyhedron(None, &rock, 4).expect("a rock");
    let sphere = RigidBody::new(1.0, inertia(), vec![]).expect("a sphere");
    placed(vec![rock, sphere], Box::new(Mutual::new(1.0)))
}

fn loads((system, states): &mut Placed) -> [Load; 2] {
    let mut loads = [Load::default(); 2];
    for _ in 0..CALLS {
        system.loads(black_box(states), &mut loads[..states.len()]);
        black_box(&mut loads);
    }
    loads
}

pub(super) fn kernels() -> Vec<Kernel> {
    let kernel = |name, placed: fn() -> Placed| Kernel::new("gravity", name, placed, loads);
    vec![
        kernel("central_j2", central_j2),
        kernel("multipole_pair", multipole_pair),
        kernel("polyhedron_and_point", polyhedron),
    ]
}
