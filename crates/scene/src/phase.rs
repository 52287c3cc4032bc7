use lgvi_control::Constraint;

use crate::{Maneuver, Scene};

/// A leg of a maneuver, with constraints of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Phase {
    /// Its name.
    pub name: String,
    /// The least number of steps that it lasts.
    pub min_steps: u64,
    /// The largest number of steps that it lasts.
    pub max_steps: u64,
    /// Constraints that hold in it, beside those of the maneuver.
    pub constraints: Vec<Constraint>,
    /// Indices of the commands that are off in it.
    pub off: Vec<usize>,
}

/// A constraint of a maneuver or of one of its phases.
#[derive(Clone, Debug)]
pub struct Stated<'m> {
    /// Its key in the scene, such as `maneuver.phases[1].constraints[0]`.
    pub key: String,
    /// The phase in which it holds, if it is that of a phase.
    pub phase: Option<&'m Phase>,
    /// The constraint, in the steps of its phase.
    pub constraint: Constraint,
}

impl Maneuver {
    /// Returns true if the length of a phase is to be found.
    pub fn has_free_phases(&self) -> bool {
        let mut phases = self.phases.iter();
        phases.any(|phase| phase.min_steps < phase.max_steps)
    }

    /// Returns all constraints, those of the phases after those of the maneuver.
    pub fn all_constraints(&self) -> impl Iterator<Item = &Constraint> {
        let phases = self.phases.iter();
        let own = phases.flat_map(|phase| &phase.constraints);
        self.constraints.iter().chain(own)
    }

    /// Returns the steps at which the phases after the first begin, if each lasts as long as it must and a share of what its range leaves,
    /// in a maneuver of `steps` steps.
    pub fn proportional_switches(&self, steps: u64) -> Vec<u64> {
        let least: u64 = self.phases.iter().map(|phase| phase.min_steps).sum();
        let room = |phase: &Phase| phase.max_steps - phase.min_steps;
        let rooms: u64 = self.phases.iter().map(room).sum();
        let rest = u128::from(steps.saturating_sub(least));
        let (mut begun, mut shared) = (0, 0);
        let ends = self.phases.iter().map(|phase| {
            begun += phase.min_steps;
            shared += room(phase);
            let share = rest * u128::from(shared) / u128::from(rooms.max(1));
            begun + u64::try_from(share).unwrap_or(u64::MAX)
        });
        let ends: Vec<_> = ends.collect();
        ends.split_last()
            .map_or(Vec::new(), |(_, others)| others.to_vec())
    }

    /// Returns each phase with its first step and the step after its last, in a maneuver of `steps` steps whose phases after the first
    /// begin at `switches`.
    pub fn schedule(
        &self,
        switches: &[u64],
        steps: u64,
    ) -> impl Iterator<Item = (&Phase, [u64; 2])> {
        let begins = std::iter::once(0).chain(switches.iter().copied());
        let ends = switches.iter().copied().chain([steps]);
        let bounds: Vec<_> = begins.zip(ends).map(|(begin, end)| [begin, end]).collect();
        self.phases.iter().zip(bounds)
    }
}

impl Scene {
    /// Returns the constraints of the rest of a maneuver from `first_step` on, in the steps of the phases that begin at `switches`, without
    /// those of phases that are over. Those of actuators are not among them.
    pub fn constraints_from<'m>(
        &self,
        maneuver: &'m Maneuver,
        first_step: u64,
        switches: &[u64],
    ) -> Vec<Stated<'m>> {
        let (first, h) = (first_step as usize, self.h());
        let all = maneuver.constraints.iter().enumerate();
        let all = all.filter_map(|(index, constraint)| {
            Some(Stated {
                key: format!("maneuver.constraints[{index}]"),
                phase: None,
                constraint: constraint.later(first, h)?,
            })
        });
        let schedule = maneuver.schedule(switches, self.steps).enumerate();
        let own = schedule.flat_map(|(number, (phase, [begin, end]))| {
            let each = phase.constraints.iter().enumerate();
            each.filter_map(move |(index, constraint)| {
                let during = constraint.clone().during(begin as usize..end as usize);
                Some(Stated {
                    key: format!("maneuver.phases[{number}].constraints[{index}]"),
                    phase: Some(phase),
                    constraint: during.ok()?.later(first, h)?,
                })
            })
        });
        all.chain(own).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lasting(ranges: &[[u64; 2]]) -> Maneuver {
        let text = include_str!("../../../scenes/inclination_change.toml");
        let mut maneuver = Scene::parse("test", text).unwrap().maneuver.unwrap();
        let phases = ranges.iter().map(|[min_steps, max_steps]| Phase {
            name: "a".into(),
            min_steps: *min_steps,
            max_steps: *max_steps,
            constraints: Vec::new(),
            off: Vec::new(),
        });
        maneuver.phases = phases.collect();
        maneuver
    }

    #[test]
    fn phases_begin_where_their_ranges_let_them() {
        for (ranges, steps, expected) in [
            (&[[10, 10], [20, 20], [70, 70]][..], 100, &[10, 30][..]),
            (&[[10, 30], [20, 20], [10, 90]], 100, &[22, 42]),
            (&[[1, 1], [1, 99], [1, 99]], 100, &[1, 50]),
            (&[[3, 8]], 8, &[]),
        ] {
            let maneuver = lasting(ranges);
            let found = maneuver.proportional_switches(steps);
            assert_eq!(found, expected);
            for (phase, [begin, end]) in maneuver.schedule(&found, steps) {
                assert!((phase.min_steps..=phase.max_steps).contains(&(end - begin)));
            }
        }
        assert!(lasting(&[]).proportional_switches(9).is_empty());
    }
}
