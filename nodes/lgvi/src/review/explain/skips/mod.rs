//! What is computed of a scene, what is left out, and why.

mod groups;
mod text;

use lgvi_control::Motion;
use lgvi_dynamics::gravity::{Level, Partner};
use lgvi_dynamics::skip::{InteractionSummary, Rotation, Summary, Translation};
use lgvi_dynamics::{Mobility, Skip};
use lgvi_scene::{Scene, Scheme};
use serde::Serialize;

/// What is left out, at the start of the run.
#[derive(Debug, Serialize)]
pub(super) struct Skips {
    /// What may be left out: `nothing`, `exact`, `tolerance`.
    allowed: &'static str,
    /// By what more than rounding is left out; none where nothing is.
    allowance: Option<Allowance>,
    /// Why nothing is left out by a tolerance that is given.
    refused: Option<String>,
    /// Bound on the error at the end of the run, if distances stay as they are.
    bound: f64,
    /// What an evaluation of gravity costs in full and as it is, in points of mass in a central field.
    gravity_cost: [f64; 2],
    bodies: Vec<Body>,
    interactions: Vec<Interaction>,
    /// Half of the maneuver that is not planned.
    not_planned: Option<&'static str>,
    /// What is done only where somebody asks for it.
    on_demand: [&'static str; 3],
}

#[derive(Debug, Serialize)]
struct Allowance {
    /// Of the error at the end of the run: positions relative to the size of the scene, attitudes in rad.
    tolerance: f64,
    /// How errors grow, in multiples of free motion.
    growth: f64,
    /// Evaluations of gravity that took.
    evaluations: u64,
}

#[derive(Debug, Serialize)]
struct Body {
    name: String,
    translation: &'static str,
    rotation: &'static str,
    /// Whether gravity has a moment on it that is computed.
    moment: bool,
}

/// What two bodies, or a body and a fixed source, exert on each other.
#[derive(Debug, Serialize)]
struct Interaction {
    between: [String; 2],
    /// `full`, `second order`, `monopole` or `dropped`.
    computed: &'static str,
    /// Why not less, or why no more.
    why: &'static str,
    /// Distances beyond which less will do (m); none where it never will, or always.
    dropped_beyond: Option<f64>,
    monopole_beyond: Option<f64>,
    second_order_beyond: Option<f64>,
    /// On its part of the error at the end of the run.
    bound: f64,
    /// Part of its cost that is saved.
    saved: f64,
}

const ON_DEMAND: [&str; 3] = [
    "states, odometry, tf and markers are converted and sent only where somebody listens",
    "a recorder records the topics that it is told, from the time that it is told to",
    "derivatives of gravity are computed by the planner alone",
];

impl Skips {
    pub(super) fn of(scene: &Scene, scheme: Scheme) -> Self {
        let summary = scene.summary(scheme);
        let (allowed, allowance) = match scheme.skip {
            Skip::Nothing => ("nothing", None),
            Skip::Exact => ("exact", None),
            Skip::Within(allowance) => ("tolerance", Some(allowance)),
        };
        let refused = match scheme.skip {
            Skip::Exact => scene.skip_refusal().map(|refusal| refusal.to_string()),
            Skip::Nothing | Skip::Within(_) => None,
        };
        let maneuver = scene.maneuver.as_ref();
        let named = scene.bodies.iter().zip(&summary.bodies).enumerate();
        let bodies = named.map(|(index, (named, one))| {
            let controlled =
                maneuver.is_some_and(|maneuver| maneuver.planned().any(|one| one.body == index));
            Body {
                name: named.name.clone(),
                translation: translation(one.translation, controlled, neglects(&summary, index)),
                rotation: rotation(one.rotation, controlled),
                moment: one.moment,
            }
        });
        Self {
            allowed,
            allowance: allowance.map(|allowance| Allowance {
                tolerance: allowance.tolerance,
                growth: allowance.response,
                evaluations: allowance.evaluations,
            }),
            refused: refused.clone(),
            bound: summary.bound(),
            gravity_cost: summary.costs,
            bodies: bodies.collect(),
            interactions: interactions(scene, &summary, rest(scheme.skip, refused.is_some())),
            not_planned: scene
                .maneuver
                .as_ref()
                .and_then(|maneuver| match maneuver.motion {
                    Motion::Full => None,
                    Motion::Translation => Some("rotation"),
                    Motion::Rotation => Some("translation"),
                }),
            on_demand: ON_DEMAND,
        }
    }
}

/// Whether something of what acts on a body is left out by a tolerance.
fn neglects(summary: &Summary, body: usize) -> bool {
    summary.interactions.iter().any(|one| {
        let takes_part = one.interaction.body == body || one.interaction.other() == Some(body);
        takes_part && one.level < one.interaction.exact
    })
}

fn translation(translation: Translation, controlled: bool, neglects: bool) -> &'static str {
    match translation {
        Translation::Forced => "by the forces on it",
        Translation::Uniform if controlled => "uniform until a control acts",
        Translation::Uniform if neglects => "uniform, its forces are negligible",
        Translation::Uniform => "uniform, no force acts",
        Translation::Given => "given",
        Translation::Held => "held",
    }
}

fn rotation(rotation: Rotation, controlled: bool) -> &'static str {
    match rotation {
        Rotation::Staged => "in every stage of a step",
        Rotation::Once if controlled => "once a step in closed form until a control acts",
        Rotation::Once => "once a step in closed form",
        Rotation::AtRest if controlled => "none until a control acts",
        Rotation::AtRest => "none, at rest",
        Rotation::Given => "given",
        Rotation::Held => "held",
    }
}

/// Why an interaction is computed in full of which less is known to do at some distance.
fn rest(skip: Skip, refused: bool) -> &'static str {
    match skip {
        Skip::Nothing => "nothing is left out",
        Skip::Exact if refused => "nothing is left out by the tolerance",
        Skip::Exact => "no tolerance is given",
        Skip::Within(_) => "the rest matters",
    }
}

fn interactions(scene: &Scene, summary: &Summary, rest: &'static str) -> Vec<Interaction> {
    let each = summary.interactions.iter().map(|one| {
        let [dropped, monopole, second_order] = one
            .limits
            .map(|limit| (limit > 0.0 && limit.is_finite()).then_some(limit * scene.units.length));
        let costs = one.interaction.costs;
        let [kept, full] = [one.level, Level::Full].map(|level| costs[level as usize]);
        let name = |body: usize| scene.bodies[body].name.clone();
        Interaction {
            between: [
                name(one.interaction.body),
                match one.interaction.partner {
                    Partner::Body(other) => name(other),
                    Partner::Source(_) => "the attractor".into(),
                    Partner::Field => "the field".into(),
                },
            ],
            computed: match one.level {
                Level::Dropped => "dropped",
                Level::Monopole => "monopole",
                Level::Quadrupole => "second order",
                Level::Full => "full",
            },
            why: why(scene, one, rest),
            dropped_beyond: dropped,
            monopole_beyond: monopole,
            second_order_beyond: second_order,
            bound: one.bound,
            saved: if full > 0.0 { 1.0 - kept / full } else { 0.0 },
        }
    });
    each.collect()
}

fn why(scene: &Scene, summary: &InteractionSummary, rest: &'static str) -> &'static str {
    let InteractionSummary {
        interaction, level, ..
    } = summary;
    let bounded = summary.limits.iter().any(|limit| limit.is_finite());
    match (interaction.exact, level) {
        (Level::Dropped, Level::Dropped) => "it moves neither",
        (Level::Monopole, Level::Monopole) => match interaction.partner {
            Partner::Field if interaction.remainder.is_some() => {
                "a uniform field has no moment about the center of mass"
            }
            _ => "points of mass have no moment",
        },
        (_, Level::Dropped | Level::Monopole | Level::Quadrupole) => {
            "the distance makes the rest negligible"
        }
        (_, Level::Full) if bounded => "the distance is too short for less",
        (_, Level::Full) if interaction.remainder.is_none() => {
            let mobility = scene.bodies[interaction.body].body.mobility();
            match mobility {
                Mobility::Pivoted => "it turns the body about its pivot",
                _ => "no bound is known of the rest",
            }
        }
        (_, Level::Full) => rest,
    }
}
