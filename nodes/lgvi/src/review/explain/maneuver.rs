use std::fmt::{self, Display, Formatter};

use lgvi_control::terminal::FinalPosition;
use lgvi_control::{Dynamics, Motion, Place};
use lgvi_dynamics::{MassDistribution, RigidBody};
use lgvi_scene::{Minimize, Phase, Scene, SolverMethod};
use serde::Serialize;

/// What is planned, and how.
#[derive(Debug, Serialize)]
pub(super) struct Maneuver {
    /// Name of the body that moves.
    pub(super) body: String,
    /// Where to.
    target: String,
    /// The final position (m) and velocity (m/s) of a target that is relative to another body, inertial frame.
    arrival: Option<[[f64; 3]; 2]>,
    /// Which motion, in which steps.
    motion: &'static str,
    dynamics: &'static str,
    solver: &'static str,
    constraints: usize,
    /// The least distance between planned bodies (m), if there are several.
    separation: Option<f64>,
    /// The bodies that are planned together with it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    companions: Vec<Maneuver>,
    /// What is done beside planning once.
    options: Vec<String>,
}

impl Maneuver {
    pub(super) fn of(scene: &Scene) -> Option<Self> {
        Some(Self::of_part(scene, scene.maneuver.as_ref()?))
    }

    fn of_part(scene: &Scene, maneuver: &lgvi_scene::Maneuver) -> Self {
        let conditions = [Place::Position, Place::Attitude];
        let conditions = conditions.map(|place| maneuver.target.condition(place));
        let conditions = conditions.into_iter().flatten();
        let target: Vec<_> = conditions.map(|condition| condition.name()).collect();
        let mut options = Vec::new();
        if let Some(range) = maneuver.final_time {
            let seconds = |steps| scene.seconds(steps);
            let (least, most) = (seconds(range.min_steps), seconds(range.max_steps));
            let found = match range.minimize {
                Minimize::Cost => "found",
                Minimize::Time => "minimized",
            };
            options.push(format!(
                "its duration {found} between {least} s and {most} s"
            ));
        }
        if !maneuver.phases.is_empty() {
            let phase = |phase: &Phase| {
                let [least, most] = [phase.min_steps, phase.max_steps].map(|n| scene.seconds(n));
                match least < most {
                    true => format!("`{}` {least} s to {most} s", phase.name),
                    false => format!("`{}` {least} s", phase.name),
                }
            };
            let phases: Vec<_> = maneuver.phases.iter().map(phase).collect();
            options.push(format!("in phases: {}", phases.join(", ")));
        }
        if let Some(search) = maneuver.search {
            options.push(format!("the best of {} starts", search.starts));
        }
        if maneuver.feedback {
            options.push("flown with feedback".into());
        }
        if let Some(replan) = maneuver.replan {
            let (every, deadline) = (scene.seconds(replan.every), replan.deadline);
            options.push(format!("replanned every {every} s within {deadline} s"));
        }
        let other = match maneuver.motion {
            Motion::Full => None,
            Motion::Translation => Some("rotation"),
            Motion::Rotation => Some("translation"),
        };
        if let Some(other) = other
            && is_coupled(&scene.bodies[maneuver.body].body)
        {
            options.push(format!(
                "with the {other} where gravity's coupling makes it miss"
            ));
        }
        Self {
            body: scene.bodies[maneuver.body].name.clone(),
            target: target.join(", "),
            arrival: arrival(scene, maneuver),
            motion: match maneuver.motion {
                Motion::Full => "full motion",
                Motion::Translation => "translation",
                Motion::Rotation => "rotation",
            },
            dynamics: match maneuver.dynamics {
                Dynamics::LieEuler if maneuver.processed => "processed Lie–Euler",
                Dynamics::LieEuler => "Lie–Euler",
                Dynamics::Lgvi => "LGVI",
            },
            solver: match maneuver.solver.method {
                SolverMethod::Newton => "Newton's method on all steps",
                SolverMethod::Shooting => "shooting",
            },
            constraints: maneuver.all_constraints().count(),
            separation: (maneuver.separation).map(|distance| distance * scene.units.length),
            companions: (maneuver.companions.iter())
                .map(|other| Self::of_part(scene, other))
                .collect(),
            options,
        }
    }
}

/// Where a target that is relative to another body is at the end.
fn arrival(scene: &Scene, maneuver: &lgvi_scene::Maneuver) -> Option<[[f64; 3]; 2]> {
    maneuver.predicted.then_some(())?;
    let position = maneuver.target.condition(Place::Position)?;
    let position: &FinalPosition = position.downcast_ref()?;
    let (units, mass) = (&scene.units, scene.bodies[maneuver.body].body.mass());
    let velocity = position.linear_momentum()? / mass;
    let velocity = velocity * (units.length / units.time);
    Some([(position.position() * units.length).into(), velocity.into()])
}

/// Whether gravity may pull a body by how it is turned, or turn it by where it is.
fn is_coupled(body: &RigidBody) -> bool {
    match body.distribution() {
        MassDistribution::Points(points) => points.iter().any(|point| point.position.norm() > 0.0),
        MassDistribution::Multipole(_) | MassDistribution::Polyhedron(_) => true,
    }
}

impl Display for Maneuver {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self {
            body,
            target,
            arrival,
            motion,
            dynamics,
            solver,
            constraints,
            separation,
            companions,
            options,
        } = self;
        write!(
            f,
            "of {body} to {target}: {motion}, planned in {dynamics} steps by {solver}"
        )?;
        if let Some([position, velocity]) = arrival {
            write!(
                f,
                "; predicted position {position:.6?} m, velocity {velocity:.6?} m/s"
            )?;
        }
        match constraints {
            0 => {}
            1 => write!(f, ", under a constraint")?,
            _ => write!(f, ", under {constraints} constraints")?,
        }
        for option in options {
            write!(f, "; {option}")?;
        }
        for other in companions {
            write!(f, "\n              {other}")?;
        }
        if let Some(separation) = separation {
            write!(
                f,
                "\n              all together, at least {separation} m from each other"
            )?;
        }
        Ok(())
    }
}
