use serde::Deserialize;

use super::{AttitudeFile, PhaseFile, RelativeFile};
use crate::compile::ConstraintFile;

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct ManeuverFile {
    /// Name of the planned body.
    pub body: String,
    /// Discrete dynamics of the plan; by default the scene's integrator if it is one of the two, else "lgvi".
    pub dynamics: Option<DynamicsFile>,
    /// Plans Lie–Euler steps between boundary states that are moved by half a drift (§4.5).
    #[serde(default)]
    pub processed: bool,
    /// The planned motion: "full" by default.
    #[serde(default)]
    pub motion: MotionFile,
    /// What the weights are of: "energy" (squares of the commands, by default) or "fuel" (their magnitudes).
    #[serde(default)]
    pub cost: CostFile,
    /// Weight of the force: a number, three, or a symmetric positive definite 3×3 matrix; 1 by default.
    pub force_weight: Option<WeightFile>,
    /// Weight of the moment: a number, three, or a symmetric positive definite 3×3 matrix; 1 by default.
    pub moment_weight: Option<WeightFile>,
    /// One to fifteen actuators that replace force, moment and their weights.
    pub actuators: Option<Vec<ActuatorFile>>,
    /// "thrusters" plans the forces of the body's thrusters, "wheels" the torques of its reaction wheels, within their limits, in
    /// the place of force and moment.
    pub commands: Option<CommandsFile>,
    /// Weight of the forces of thrusters: one number, or one per thruster; 1 by default. Only with `commands = "thrusters"`.
    pub thruster_weight: Option<EachFile>,
    /// Weight of the torques of wheels: one number, or one per wheel; 1 by default. Only with `commands = "wheels"`.
    pub wheel_weight: Option<EachFile>,
    /// Constraints along the path.
    #[serde(default)]
    pub constraints: Vec<ConstraintFile>,
    /// Phases that follow each other, with constraints and commands of their own.
    #[serde(default)]
    pub phases: Vec<PhaseFile>,
    /// Probability with which each constraint on states holds at each step under the deviations of `ensemble`, or else of
    /// `disturbance`: from 0.5 to below 1. By default constraints hold for the nominal flight.
    pub confidence: Option<f64>,
    /// Finds the duration: a local minimum of the cost plus `weight` times the duration, or the shortest one.
    pub final_time: Option<FinalTimeFile>,
    /// Takes the best local minimum from several starts; not with a `final_time` that minimizes the cost.
    pub search: Option<SearchFile>,
    /// Replans in flight.
    pub replan: Option<ReplanFile>,
    /// Flies the gains of neighboring extremals.
    #[serde(default)]
    pub feedback: bool,
    /// Settings of the solver.
    #[serde(default)]
    pub solver: SolverFile,
    /// Set of states in which the maneuver may end; what it omits is free.
    pub target: TargetFile,
    /// Least distance between the planned bodies; with `companions`.
    pub separation: Option<f64>,
    /// Other bodies that are planned together with this one.
    #[serde(default)]
    #[cfg_attr(test, schemars(with = "Vec<CompanionKeys>"))]
    pub companions: Vec<CompanionFile>,
}

impl ManeuverFile {
    /// Gives the companions what all planned bodies have in common.
    pub(crate) fn join(&mut self) {
        for CompanionFile(companion) in &mut self.companions {
            companion.dynamics = self.dynamics;
            companion.feedback = self.feedback;
            companion.solver = self.solver;
        }
    }
}

/// The part of the maneuver of a companion, as a maneuver of its own.
#[derive(Deserialize)]
#[serde(from = "CompanionKeys")]
pub(crate) struct CompanionFile(pub ManeuverFile);

/// A body that is planned together with that of the maneuver.
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct CompanionKeys {
    /// Name of the body.
    body: String,
    /// The planned motion: "full" by default.
    #[serde(default)]
    motion: MotionFile,
    /// Weight of the force, as that of the maneuver.
    force_weight: Option<WeightFile>,
    /// Weight of the moment, as that of the maneuver.
    moment_weight: Option<WeightFile>,
    /// One to fifteen actuators that replace force, moment and their weights.
    actuators: Option<Vec<ActuatorFile>>,
    /// "thrusters" plans the forces of the body's thrusters.
    commands: Option<CommandsFile>,
    /// Weight of the forces of thrusters, as that of the maneuver.
    thruster_weight: Option<EachFile>,
    /// Constraints along its path.
    #[serde(default)]
    constraints: Vec<ConstraintFile>,
    /// Set of states in which it may end.
    target: TargetFile,
}

impl From<CompanionKeys> for CompanionFile {
    fn from(keys: CompanionKeys) -> Self {
        Self(ManeuverFile {
            body: keys.body,
            dynamics: None,
            processed: false,
            motion: keys.motion,
            cost: CostFile::Energy,
            force_weight: keys.force_weight,
            moment_weight: keys.moment_weight,
            actuators: keys.actuators,
            commands: keys.commands,
            thruster_weight: keys.thruster_weight,
            wheel_weight: None,
            constraints: keys.constraints,
            phases: Vec::new(),
            confidence: None,
            final_time: None,
            search: None,
            replan: None,
            feedback: false,
            solver: SolverFile::default(),
            target: keys.target,
            separation: None,
            companions: Vec::new(),
        })
    }
}

impl ManeuverFile {
    /// The constraints of the maneuver and of its phases, with their keys.
    pub(crate) fn all_constraints(&self) -> impl Iterator<Item = (String, &ConstraintFile)> {
        let own = self.constraints.iter().enumerate();
        let own = own.map(|(index, file)| (format!("maneuver.constraints[{index}]"), file));
        let phases = self.phases.iter().enumerate();
        own.chain(phases.flat_map(|(phase, file)| {
            let each = file.constraints.iter().enumerate();
            each.map(move |(index, file)| {
                (
                    format!("maneuver.phases[{phase}].constraints[{index}]"),
                    file,
                )
            })
        }))
    }
}

#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum DynamicsFile {
    LieEuler,
    Lgvi,
}

#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum CostFile {
    #[default]
    /// Squares of the commands.
    Energy,
    /// Magnitudes of the commands.
    Fuel,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum MotionFile {
    #[default]
    /// Position and attitude.
    Full,
    /// The position alone.
    Translation,
    /// The attitude alone.
    Rotation,
}

#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "expected a number, three numbers or a 3×3 matrix"
)]
pub(crate) enum WeightFile {
    Scalar(f64),
    Diagonal([f64; 3]),
    Matrix([[f64; 3]; 3]),
}

#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum CommandsFile {
    /// The forces of the body's thrusters.
    Thrusters,
    /// The torques of the body's reaction wheels.
    Wheels,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "expected a number, or one for each axis or command"
)]
pub(crate) enum EachFile {
    All(f64),
    Each(Vec<f64>),
}

impl EachFile {
    /// A number for each of `count`, or `None` if there are not as many.
    pub(crate) fn each(&self, count: usize) -> Option<Vec<f64>> {
        let each = match self {
            Self::All(number) => vec![*number; count],
            Self::Each(numbers) => numbers.clone(),
        };
        (each.len() == count).then_some(each)
    }

    /// The numbers that are given.
    pub(crate) fn given(&self) -> &[f64] {
        match self {
            Self::All(number) => std::slice::from_ref(number),
            Self::Each(numbers) => numbers,
        }
    }
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct ActuatorFile {
    /// Force of a unit command, inertial frame.
    #[serde(default)]
    pub force: [f64; 3],
    /// Moment of a unit command, body frame.
    #[serde(default)]
    pub moment: [f64; 3],
    /// Weight of the command.
    #[serde(default = "one")]
    pub weight: f64,
}

fn one() -> f64 {
    1.0
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct FinalTimeFile {
    /// Shortest duration.
    pub min: f64,
    /// Longest duration; that of the run by default.
    pub max: Option<f64>,
    /// Cost of a unit of time; not where the time is minimized.
    #[serde(default)]
    pub weight: f64,
    /// What is minimized: the cost plus `weight` times the duration, or the duration. The least duration needs limits of
    /// all commands.
    #[serde(default)]
    pub minimize: MinimizeFile,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum MinimizeFile {
    #[default]
    /// The cost plus `weight` times the duration.
    Cost,
    /// The duration.
    Time,
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct SearchFile {
    /// Number of starts.
    pub starts: u32,
    /// Seed of the random starts.
    #[serde(default)]
    pub seed: u64,
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct ReplanFile {
    /// Steps from one plan to the next.
    pub every: u64,
    /// Wall-clock time in which a plan must be ready (s).
    pub deadline: f64,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(crate) struct SolverFile {
    /// "newton" by default; "shooting" plans only the full motion to a state in Lie–Euler steps.
    pub method: SolverMethodFile,
    /// Largest terminal error, relative to the size of each quantity; 1e-12 by default.
    pub tolerance: Option<f64>,
    /// Largest number of iterations per resolution and guess; 300 by default, 200 for shooting.
    pub max_iterations: Option<u32>,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum SolverMethodFile {
    #[default]
    Newton,
    Shooting,
}

#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct TargetFile {
    /// Axes that position, velocity, attitude and angular velocity are relative to, at the end of the run; the inertial
    /// frame by default.
    pub relative_to: Option<RelativeFile>,
    /// Final position.
    pub position: Option<[f64; 3]>,
    /// Final velocity, as seen in the axes of the position; only with `position`.
    pub velocity: Option<[f64; 3]>,
    /// An ellipse about the central attractor, any point of which may be the end.
    pub orbit: Option<OrbitFile>,
    /// Final attitude, from the body frame to the inertial frame or to the axes of `relative_to`.
    pub attitude: Option<AttitudeFile>,
    /// An axis of the body that points in a given direction at the end.
    pub spin_axis: Option<SpinAxisFile>,
    /// Final angular velocity relative to these axes, body frame (rad per unit of time).
    pub angular_velocity: Option<[f64; 3]>,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct OrbitFile {
    /// A position on the ellipse, inertial frame.
    pub position: [f64; 3],
    /// The velocity there, inertial frame.
    pub velocity: [f64; 3],
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct SpinAxisFile {
    /// Axis, body frame, of any length.
    pub axis: [f64; 3],
    /// Direction of the axis, inertial frame, of any length.
    pub direction: [f64; 3],
}
