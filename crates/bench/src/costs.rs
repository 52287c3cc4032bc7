//! What the parts of a flight cost, in nanoseconds: the constants by which the automatic choice predicts.

use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::{Integrator, KeplerScheme, Rotor};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, System};
use nalgebra::{Matrix3, Vector3};

use crate::clock::{Moment, nanoseconds};
use crate::error::BenchError;
use crate::run::Run;

/// Principal moments by their kind.
const KINDS: [(&str, [f64; 3]); 3] = [
    ("spherical", [1.0, 1.0, 1.0]),
    ("axisymmetric", [1.0, 2.0, 2.0]),
    ("asymmetric", [1.0, 2.0, 3.0]),
];

const ROTORS: [(&str, Rotor); 2] = [("discrete", Rotor::Discrete), ("exact", Rotor::Exact)];

/// Step of the bodies that turn by themselves.
const H: f64 = 0.1;

/// Tolerance of methods with error control, and the steps of a run in which it shows few states and many.
const TOLERANCE: f64 = 1e-9;
const STATES: [u64; 2] = [1, 10_000];

pub(crate) fn run(repeats: u32) -> Result<(), BenchError> {
    println!("| body | rotor | stage (ns) | LGVI step, one body (ns) | two (ns) |");
    println!("|---|---|---|---|---|");
    for (kind, moments) in KINDS {
        for (name, rotor) in ROTORS {
            let one = [free(moments)?];
            let two = [free(moments)?, free(moments)?];
            let lgvi = Method::Lgvi(rotor);
            println!(
                "| {kind} | {name} | {:.0} | {:.0} | {:.0} |",
                stage(&one, rotor, repeats)?,
                step(&one, lgvi, repeats)?,
                step(&two, lgvi, repeats)?
            );
        }
        println!(
            "| {kind} | closed form | | {:.0} | {:.0} |",
            step(&[free(moments)?], Method::ClosedForm, repeats)?,
            step(
                &[free(moments)?, free(moments)?],
                Method::ClosedForm,
                repeats
            )?
        );
    }
    for (name, rotor) in ROTORS {
        let one = [pivoted([1.0, 2.0, 3.0])?];
        println!(
            "| pivoted | {name} | {:.0} | | |",
            stage(&one, rotor, repeats)?
        );
    }
    println!();
    println!("Kepler's motion: {:.0} ns", kepler(repeats)?);
    println!();
    println!(
        "| run | gravity (ns) | predicted points | a point (ns) | discrete stage (ns) | Dormand–Prince step (ns) | state shown (ns) | \
         Taylor step (ns) | state shown (ns) |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut last = String::new();
    for run in Run::all()? {
        if run.name == last {
            continue;
        }
        last.clone_from(&run.name);
        let (mut system, mut states) = run.system()?;
        system.constrain(&mut states);
        let mut loads = vec![Load::default(); states.len()];
        let gravity = nanoseconds(repeats, || system.loads(&states, &mut loads));
        let points = system.cost();
        let tolerance = TOLERANCE;
        let [adaptive, shown] = tuned(&run, Method::DormandPrince853 { tolerance }, repeats)?;
        // Some gravity has no series.
        let [expansion, evaluated] =
            tuned(&run, Method::Taylor { tolerance }, repeats).unwrap_or([f64::NAN; 2]);
        println!(
            "| {} | {gravity:.0} | {points:.1} | {:.1} | {:.0} | {adaptive:.0} | {shown:.0} | {expansion:.0} | {evaluated:.0} |",
            run.name,
            gravity / points,
            // the steps of some runs are too long for one
            flown(&run, repeats).unwrap_or(f64::NAN)
        );
    }
    Ok(())
}

fn free(moments: [f64; 3]) -> Result<RigidBody, BenchError> {
    RigidBody::new(1.0, inertia(moments)?, vec![]).map_err(|e| BenchError::Body(e.to_string()))
}

fn pivoted(moments: [f64; 3]) -> Result<RigidBody, BenchError> {
    RigidBody::pivoted(1.0, inertia(moments)?, vec![]).map_err(|e| BenchError::Body(e.to_string()))
}

fn inertia(moments: [f64; 3]) -> Result<Inertia, BenchError> {
    Inertia::principal(moments).map_err(|error| BenchError::Body(error.to_string()))
}

/// Time (ns) of a step of bodies on which nothing acts.
fn step(bodies: &[RigidBody], method: Method, repeats: u32) -> Result<f64, BenchError> {
    let turning = |body| {
        let turn = Vector3::new(0.7, -0.4, 0.9);
        BodyState::from_velocities(body, turn, turn, Matrix3::identity(), turn)
    };
    let mut states: Vec<_> = bodies.iter().map(turning).collect();
    let mut system = System::new(bodies.to_vec(), vec![]);
    let mut integrator = method.integrator(&system)?;
    system.constrain(&mut states);
    integrator.start(&mut system, &states);
    advance(&mut *integrator, &mut system, &mut states, repeats)
}

/// Time (ns) of a step.
fn advance(
    integrator: &mut dyn Integrator,
    system: &mut System,
    states: &mut [BodyState],
    repeats: u32,
) -> Result<f64, BenchError> {
    let controls = vec![Load::default(); states.len()];
    let mut failed = None;
    let time = nanoseconds(repeats, || {
        if let Err(error) = integrator.step(system, states, &controls, H) {
            failed = Some(error);
        }
    });
    failed.map_or(Ok(time), |error| Err(error.into()))
}

/// Time (ns) of a stage, from two compositions of different length.
fn stage(bodies: &[RigidBody], rotor: Rotor, repeats: u32) -> Result<f64, BenchError> {
    let at = |order| step(bodies, Method::Composition { order, rotor }, repeats);
    Ok((at(8)? - at(4)?) / 16.0)
}

/// Time (ns) of Kepler's motion of a body, from two schemes of different length.
fn kepler(repeats: u32) -> Result<f64, BenchError> {
    let at = |scheme| {
        let body = free([1.0; 3])?;
        let zero = Vector3::zeros();
        let [position, velocity] = [Vector3::x(), Vector3::new(0.1, 0.9, 0.2)];
        let state =
            BodyState::from_velocities(&body, position, velocity, Matrix3::identity(), zero);
        let mut system = System::new(vec![body], vec![Box::new(Central { gm: 1.0 })]);
        let mut states = vec![state];
        let mut integrator = Method::WisdomHolman { scheme }.integrator(&system)?;
        integrator.start(&mut system, &states);
        advance(&mut *integrator, &mut system, &mut states, repeats)
    };
    Ok((at(KeplerScheme::Aba1064)? - at(KeplerScheme::Leapfrog)?) / 8.0)
}

/// Time (ns) of a step of a method with error control, and of a state that it shows.
fn tuned(run: &Run, method: Method, repeats: u32) -> Result<[f64; 2], BenchError> {
    let mut times = [f64::INFINITY; 2];
    let mut made = 0_u64;
    for _ in 0..repeats {
        for (least, steps) in times.iter_mut().zip(STATES) {
            let mut simulation = run.simulation(method, steps, 1)?;
            let controls = vec![Load::default(); simulation.states().len()];
            let begun = Moment::now();
            let mut cuts = 0;
            for _ in 0..steps {
                cuts += u64::from(simulation.advance(&controls)?.cuts);
            }
            *least = least.min(1e9 * begun.elapsed());
            if steps == STATES[0] {
                made = cuts;
            }
        }
    }
    let [few, many] = times;
    Ok([
        few / made as f64,
        (many - few) / (STATES[1] - STATES[0]) as f64,
    ])
}

/// Time (ns) of a stage by the discrete rotor in a run, with its gravity, from the first parts of two compositions.
fn flown(run: &Run, repeats: u32) -> Result<f64, BenchError> {
    let mut times = [f64::INFINITY; 2];
    let made = run.wanted.steps.min(100);
    for _ in 0..repeats {
        for (least, order) in times.iter_mut().zip([4, 8]) {
            let rotor = Rotor::default();
            let method = Method::Composition { order, rotor };
            let mut simulation = run.simulation(method, run.wanted.steps, 1)?;
            let controls = vec![Load::default(); simulation.states().len()];
            let begun = Moment::now();
            for _ in 0..made {
                simulation.advance(&controls)?;
            }
            *least = least.min(1e9 * begun.elapsed() / made as f64);
        }
    }
    Ok((times[1] - times[0]) / 16.0)
}
