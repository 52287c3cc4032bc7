//! Steps of the simulation, once all that is extrapolated from the steps before is there.

use std::hint::black_box;

use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, Simulation, System};
use lgvi_truth::Case;
use nalgebra::{Matrix3, Vector3};

use super::{CALLS, Kernel};

const CAYLEY: Rotor = Rotor::Discrete;
const LGVI: Method = Method::Lgvi(CAYLEY);
const LIE_EULER: Method = Method::LieEuler(CAYLEY);
const NYSTROM: Method = Method::Nystrom { order: 8 };
const COMPOSITION: Method = Method::Composition {
    order: 8,
    rotor: CAYLEY,
};

const FREE: &str = "b1_free_asymmetric";
const DUMBBELLS: &str = "a1_two_dumbbells_regular";
const PENDULUM: &str = "c1_3d_pendulum";

fn begun(mut simulation: Simulation) -> Simulation {
    fly(&mut simulation);
    simulation
}

fn fly(simulation: &mut Simulation) {
    let controls = [Load::default(); 2];
    let controls = &controls[..simulation.states().len()];
    for _ in 0..CALLS {
        black_box(simulation.advance(black_box(controls))).expect("a step");
    }
}

fn of_case(name: &str, method: Method, h: f64) -> Simulation {
    let (system, states) = Case::load(name)
        .and_then(|case| case.system())
        .expect("a case");
    begun(Simulation::new(system, states, method, h).expect("a method"))
}

/// A free body of revolution.
fn axisymmetric(method: Method) -> Simulation {
    let inertia = Inertia::principal([1.0, 1.0, 1.5]).expect("inertia");
    let body = RigidBody::new(1.0, inertia, vec![]).expect("body");
    let (zero, omega) = (Vector3::zeros(), Vector3::new(1.0, 0.5, -0.75));
    let state = BodyState::from_velocities(&body, zero, zero, Matrix3::identity(), omega);
    let system = System::new(vec![body], vec![]);
    begun(Simulation::new(system, vec![state], method, 0.01).expect("a method"))
}

pub(super) fn kernels() -> Vec<Kernel> {
    fn kernel(name: &'static str, prepare: impl FnOnce() -> Simulation + 'static) -> Kernel {
        Kernel::new("steps", name, prepare, fly)
    }
    vec![
        kernel("lgvi_free", || of_case(FREE, LGVI, 0.01)),
        kernel("lgvi_axisymmetric", || axisymmetric(LGVI)),
        kernel("lgvi_two_dumbbells", || of_case(DUMBBELLS, LGVI, 0.002)),
        kernel("lgvi_pendulum", || of_case(PENDULUM, LGVI, 1e-3)),
        kernel("lie_euler_two_dumbbells", || {
            of_case(DUMBBELLS, LIE_EULER, 0.002)
        }),
        kernel("nystrom_8_two_dumbbells", || {
            of_case(DUMBBELLS, NYSTROM, 0.02)
        }),
        kernel("composition_8_two_dumbbells", || {
            of_case(DUMBBELLS, COMPOSITION, 0.02)
        }),
        kernel("closed_form_asymmetric", || {
            of_case(FREE, Method::ClosedForm, 0.1)
        }),
        kernel("closed_form_axisymmetric", || {
            axisymmetric(Method::ClosedForm)
        }),
    ]
}
