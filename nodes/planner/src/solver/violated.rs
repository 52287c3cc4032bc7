//! A violated constraint in words: its kind, and by how much in a unit.

use lgvi_control::constraint::{Coordinates, KeepOutCone, KeepOutSphere, LineOfSight};
use lgvi_control::{Constraint, PlanError};
use lgvi_scene::{Maneuver, Scene};

/// What no plan meets.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Violated {
    /// A constraint.
    Constraint {
        number: usize,
        step: usize,
        /// In parts of a limit, a radius or a length, in radians of a cone.
        by: f64,
        what: What,
    },
    /// The limit of the speed of a wheel.
    Speed {
        wheel: usize,
        step: usize,
        speed: f64,
        limit: f64,
    },
}

/// What violates a constraint.
#[derive(Clone, Copy, Debug)]
pub(crate) enum What {
    /// A state that start or target decide.
    Given,
    /// The closest plan.
    Closest,
    /// The motion between the ends of a step.
    Between,
}

impl Violated {
    pub(super) fn of(error: &PlanError) -> Option<Self> {
        let (number, step, by, what) = match *error {
            PlanError::Infeasible {
                constraint,
                step,
                violation,
            } => (constraint, step, violation, What::Given),
            PlanError::NotFound {
                constraint,
                step,
                violation,
            } => (constraint, step, violation, What::Closest),
            PlanError::Between {
                constraint,
                step,
                violation,
                ..
            } => (constraint, step, violation, What::Between),
            PlanError::WheelSpeed {
                wheel,
                step,
                speed,
                limit,
            } => {
                return Some(Self::Speed {
                    wheel,
                    step,
                    speed,
                    limit,
                });
            }
            _ => return None,
        };
        Some(Self::Constraint {
            number,
            step,
            by,
            what,
        })
    }

    pub(super) fn told(&self, scene: &Scene, maneuver: &Maneuver) -> String {
        let (number, step, by, what) = match *self {
            Self::Constraint {
                number,
                step,
                by,
                what,
            } => (number, step, by, what),
            Self::Speed {
                wheel,
                step,
                speed,
                limit,
            } => {
                let [speed, limit] = [speed, limit].map(|rate| rate / scene.units.time);
                let names = &scene.bodies[maneuver.body].wheels;
                let name = names.get(wheel).map_or("a wheel", String::as_str);
                return format!(
                    "in step {step} the plan takes {name} to {speed:.1} rad/s, expected at most {limit:.1} rad/s; \
                     a longer run or another `wheel_weight` may need less"
                );
            }
        };
        let violates = match maneuver.constraints.get(number) {
            Some(constraint) => {
                let (kind, amount) = (constraint.name(), amount(scene, constraint, by));
                format!("violates {kind} (maneuver.constraints[{number}]) by {amount}")
            }
            None => {
                let actuator = maneuver.commands().name().trim_end_matches('s');
                format!("violates the limit of a {actuator} by {:.2} %", 100.0 * by)
            }
        };
        match what {
            What::Given => format!(
                "infeasible: the start or the target fixes the state at step {step}, which {violates}"
            ),
            What::Closest => {
                format!("no feasible plan was found; the closest one {violates} at step {step}")
            }
            What::Between => format!(
                "no feasible plan was found; the closest one {violates} between the ends of step {step}; shorter steps may help"
            ),
        }
    }
}

fn amount(scene: &Scene, constraint: &Constraint, by: f64) -> String {
    let cone = constraint.in_frame::<KeepOutCone>().is_some();
    if cone || constraint.in_frame::<LineOfSight>().is_some() {
        return format!("{:.3}°", by.to_degrees());
    }
    if let Some(sphere) = constraint.in_frame::<KeepOutSphere>() {
        let radius = sphere.constraint.radius();
        return format!("{:.3e} m", by * radius * scene.units.length);
    }
    let of = match constraint {
        Constraint::State(state) if state.coordinates() == Coordinates::Position => "its length",
        _ => "its limit",
    };
    format!("{:.3} % of {of}", 100.0 * by)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(scene: &str, from: &str, to: &str) -> String {
        assert!(scene.contains(from));
        let scene = Scene::parse("test", &scene.replace(from, to)).unwrap();
        crate::plan(&scene, &mut |_| true).unwrap_err().to_string()
    }

    #[test]
    fn a_violated_constraint_has_its_kind_and_a_unit() {
        let slew = include_str!("../../../../scenes/slew_keep_out.toml");
        let text = refused(slew, "[0.5, 0.8660254, 0.1]", "[1.0, 0.1, 0.0]");
        let expected = "violates keep_out_cone (maneuver.constraints[0]) by ";
        assert!(text.contains(expected) && text.contains('°'), "{text}");

        let docking = include_str!("../../../../scenes/docking_corridor.toml");
        let text = refused(docking, "limit = 2.5", "limit = 0.5");
        let expected = "violates force_norm (maneuver.constraints[1]) by ";
        assert!(
            text.contains(expected) && text.contains(" % of its limit"),
            "{text}"
        );
    }
}
