//! A violated constraint in words: its kind, and by how much in a unit.

use lgvi_control::constraint::{Coordinates, Region};
use lgvi_control::{Constraint, PlanError};
use lgvi_scene::{Commands, Maneuver, Phase, Scene, Stated};

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
    /// The propellant that there is.
    Propellant { needed: f64, available: f64 },
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
    /// The deviations of the closest plan.
    Deviations,
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
            PlanError::Chance {
                constraint,
                step,
                violation,
                ..
            } => (constraint, step, violation, What::Deviations),
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
            PlanError::Propellant { needed, available } => {
                return Some(Self::Propellant { needed, available });
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

    /// In a transfer of so many intervals, whose phases after the first begin at the steps `switches` of the run.
    pub(super) fn told(
        &self,
        scene: &Scene,
        maneuver: &Maneuver,
        intervals: usize,
        switches: &[u64],
    ) -> String {
        let (number, step, by, what) = match *self {
            Self::Constraint {
                number,
                step,
                by,
                what,
            } => (number, step, by, what),
            Self::Propellant { needed, available } => {
                let [needed, available] = [needed, available].map(|mass| mass * scene.units.mass);
                return format!(
                    "the plan needs {needed:.6} kg of propellant, expected at most {available:.6} kg; a longer run or \
                     `cost = \"fuel\"` may need less"
                );
            }
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
                    "in step {step} the plan takes {name} to {speed:.3} rad/s, expected at most {limit:.3} rad/s; \
                     a longer run or another `wheel_weight` may need less"
                );
            }
        };
        let first_step = scene.steps.saturating_sub(intervals as u64);
        let mut all = scene
            .constraints_from(maneuver, first_step, switches)
            .into_iter();
        let violates = match all.nth(number) {
            Some(Stated {
                key,
                phase,
                constraint,
            }) => {
                let (kind, amount) = (constraint.name(), amount(scene, &constraint, by));
                let of =
                    phase.map_or_else(String::new, |phase| format!(" of phase `{}`", phase.name));
                let off = phase.and_then(|phase| weak(maneuver, phase));
                format!(
                    "violates {kind}{of} ({key}) by {amount}{}",
                    off.unwrap_or_default()
                )
            }
            None => {
                let limit = match maneuver.commands() {
                    Commands::Loads => "the thrust of the engine".to_owned(),
                    actuators => {
                        let actuator = actuators.name().trim_end_matches('s');
                        format!("the limit of a {actuator}")
                    }
                };
                format!("violates {limit} by {:.2} %", 100.0 * by)
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
            What::Deviations => format!(
                "no plan was found that keeps its deviations within the constraints; with them, the closest one {violates} at step {step}"
            ),
        }
    }
}

/// What the commands that are on in a phase leave undone, if some are off.
fn weak(maneuver: &Maneuver, phase: &Phase) -> Option<String> {
    let actuation = &maneuver.actuation;
    let [on, all] = [&phase.off[..], &[]].map(|off| actuation.rank_without(off));
    (on < all).then(|| {
        format!(
            " (the commands that are on in it exert {on} of {all} independent forces and moments)"
        )
    })
}

fn amount(scene: &Scene, constraint: &Constraint, by: f64) -> String {
    let of = match constraint.region() {
        Some(Region::OutsideCone { .. } | Region::InSight { .. }) => {
            return format!("{:.3}°", by.to_degrees());
        }
        Some(Region::OutsideEllipsoid { semi_axes, .. }) if semi_axes.min() == semi_axes.max() => {
            return format!("{:.3e} m", by * semi_axes.x * scene.units.length);
        }
        Some(Region::InsideSphere { radius, .. }) => {
            return format!("{:.3e} m", by * radius * scene.units.length);
        }
        Some(Region::OutsidePlume { .. }) => {
            return format!(
                "{:.3} % of its distance or by {:.3}°",
                100.0 * by,
                by.to_degrees()
            );
        }
        Some(Region::OutsideEllipsoid { .. }) => "its radius",
        _ => match constraint.bare() {
            Constraint::State(state) if state.coordinates() == Coordinates::Position => {
                "its length"
            }
            _ => "its limit",
        },
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
    fn deviations_beyond_a_constraint_are_told_by_its_name() {
        let text = include_str!("../../../../scenes/docking_corridor.toml");
        let scene = Scene::parse("test", text).unwrap();
        let error = PlanError::Chance {
            constraint: 0,
            step: 7,
            violation: 0.25,
            best: None,
        };
        let unsolved = super::super::Unsolved::from(error);
        assert_eq!(unsolved.reason, super::super::Reason::Infeasible);
        let violated = unsolved.violated.unwrap();
        let told = violated.told(&scene, scene.maneuver.as_ref().unwrap(), 240, &[]);
        let expected =
            "violates corridor (maneuver.constraints[0]) by 25.000 % of its length at step 7";
        assert!(told.contains(expected), "{told}");
    }

    #[test]
    fn propellant_that_is_missing_is_told_in_kilograms() {
        let text = include_str!("../../../../scenes/propellant_transfer.toml");
        let told = refused(
            text,
            "propellant = { mass = 25.0 }",
            "propellant = { mass = 5.0 }",
        );
        let expected = "expected at most 5.000000 kg";
        assert!(
            told.contains("the plan needs 13.9") && told.contains(expected),
            "{told}"
        );
    }

    #[test]
    fn a_thrust_that_does_not_suffice_is_that_of_the_engine() {
        let text = include_str!("../../../../scenes/earth_mars.toml");
        let text = text.replace("steps = 400", "steps = 50");
        let told = refused(&text, "thrust = 0.5e-3", "thrust = 0.2e-3");
        let expected = "the closest one violates the thrust of the engine by ";
        assert!(told.contains(expected), "{told}");
    }

    #[test]
    fn a_violated_constraint_has_its_kind_and_a_unit() {
        let slew = include_str!("../../../../scenes/slew_keep_out.toml");
        let text = refused(slew, "[0.5, 0.8660254, 0.1]", "[1.0, 0.1, 0.0]");
        let expected = "violates keep_out_cone (maneuver.constraints[0]) by ";
        assert!(text.contains(expected) && text.contains('°'), "{text}");

        let center = "kind = \"keep_out_ellipsoid\"\ncenter = [-60.0, 12.0, -4.0]\nsemi_axes = [2.0, 3.0, 4.0]";
        let corridor = "kind = \"corridor\"\napex = [0.5, 0.0, 0.0]\naxis = [-1.0, 0.0, 0.0]\nhalf_angle = 0.2617993877991494";
        let docking = include_str!("../../../../scenes/docking_corridor.toml");
        let text = refused(docking, corridor, center);
        let expected = "violates keep_out_ellipsoid (maneuver.constraints[0]) by ";
        assert!(
            text.contains(expected) && text.contains(" % of its radius"),
            "{text}"
        );
        let plume = "kind = \"plume\"\naxis = [1.0, 0.0, 0.0]\npoint = [-55.0, 12.0, -6.0]\nhalf_angle = 0.5\ndistance = 9.0";
        let text = refused(docking, corridor, plume);
        let expected = "violates plume (maneuver.constraints[0]) by ";
        assert!(
            text.contains(expected) && text.contains(" % of its distance or by "),
            "{text}"
        );

        let docking = include_str!("../../../../scenes/docking_corridor.toml");
        let text = refused(docking, "limit = 2.5", "limit = 0.5");
        let expected = "violates force_norm (maneuver.constraints[1]) by ";
        assert!(
            text.contains(expected) && text.contains(" % of its limit"),
            "{text}"
        );
    }
}
