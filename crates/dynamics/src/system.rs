use crate::gravity::{CloseApproach, Form, Gravity, Interaction, Kept};
use crate::skip::Levels;
use crate::{BodyState, Load, Mobility, RigidBody};

/// Bodies and the gravity that acts on them.
pub struct System {
    bodies: Vec<RigidBody>,
    gravity: Vec<Box<dyn Gravity>>,
    /// Whether anything has an extent that another could enter.
    extents: bool,
    selection: Selection,
    /// Where what is left out depends on distances.
    levels: Option<Levels>,
}

/// What is computed of a system.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Selection {
    /// Whether that is not everything; what follows is of no account where it is.
    pub(crate) is_partial: bool,
    /// What is kept of each gravity; all of it where it cannot be taken apart.
    pub(crate) kept: Vec<Option<Vec<Kept>>>,
    /// The bodies on which gravity has no moment.
    pub(crate) coasting: Vec<bool>,
}

impl System {
    /// Bodies under the sum of the given gravities; none means free bodies.
    pub fn new(bodies: Vec<RigidBody>, gravity: Vec<Box<dyn Gravity>>) -> Self {
        let mut clearances = gravity.iter().filter_map(|gravity| gravity.clearance());
        let extents = clearances.any(|clearance| clearance.has_extents(&bodies));
        Self {
            bodies,
            gravity,
            extents,
            selection: Selection::default(),
            levels: None,
        }
    }

    /// The bodies, in the order of their states.
    pub fn bodies(&self) -> &[RigidBody] {
        &self.bodies
    }

    /// Sets `loads` (one a body) to what gravity exerts in `states`.
    pub fn loads(&mut self, states: &[BodyState], loads: &mut [Load]) {
        for load in loads.iter_mut() {
            *load = Load::default();
        }
        if let Some(levels) = &mut self.levels {
            levels.check_states(states);
        }
        if !self.selection.is_partial {
            for gravity in &mut self.gravity {
                gravity.add_loads(&self.bodies, states, loads);
            }
            return;
        }
        for (gravity, kept) in self.gravity.iter_mut().zip(&self.selection.kept) {
            match (kept, gravity.separable()) {
                (Some(kept), Some(separable)) => {
                    separable.add_kept_loads(&self.bodies, states, loads, kept);
                }
                _ => gravity.add_loads(&self.bodies, states, loads),
            }
        }
    }

    /// The interactions of each gravity; none of one that cannot be taken apart.
    pub(crate) fn interactions(&mut self) -> Vec<Option<Vec<Interaction>>> {
        let each = self.gravity.iter_mut().map(|gravity| {
            let separable = gravity.separable()?;
            Some(separable.interactions(&self.bodies))
        });
        each.collect()
    }

    /// Computes interactions at these levels from now on; everything in full where there are none.
    pub(crate) fn set_levels(&mut self, levels: Option<Levels>) {
        self.selection.is_partial = false;
        self.levels = levels;
        self.select();
        self.levels = self.levels.take().filter(Levels::varies);
        if self.levels.is_some() {
            let each = self.gravity.iter_mut();
            for separable in each.filter_map(|gravity| gravity.separable()) {
                separable.prepare(&self.bodies);
            }
        }
    }

    /// Computes interactions at their present levels.
    pub(crate) fn select(&mut self) {
        if let Some(levels) = &self.levels {
            levels.select(&self.bodies, &mut self.selection);
        }
    }

    /// The levels of interactions, where they change with distances.
    pub(crate) fn levels(&mut self) -> Option<&mut Levels> {
        self.levels.as_mut()
    }

    /// Changes of level so far.
    pub(crate) fn switches(&self) -> u64 {
        self.levels.as_ref().map_or(0, Levels::switches)
    }

    /// Whether levels change with distances.
    pub(crate) fn switches_levels(&self) -> bool {
        self.levels.is_some()
    }

    /// Checks the levels along a step of length `h`, made as one.
    #[inline]
    pub(crate) fn check_step(&mut self, from: &[BodyState], to: &[BodyState], h: f64) {
        if let Some(levels) = &mut self.levels {
            levels.check_step(&self.bodies, [from, to], h);
        }
    }

    /// Whether gravity has no moment on a body, one a body; empty where that is not known.
    pub(crate) fn coasting(&self) -> &[bool] {
        if self.selection.is_partial {
            &self.selection.coasting
        } else {
            &[]
        }
    }

    /// The potential `U` of all gravity in `states`.
    pub fn potential(&self, states: &[BodyState]) -> f64 {
        self.gravity
            .iter()
            .map(|gravity| gravity.potential(&self.bodies, states))
            .sum()
    }

    /// Whether the bodies are outside each other's radii.
    pub fn check_clearance(&self, states: &[BodyState]) -> Result<(), CloseApproach> {
        if self.extents {
            for clearance in self
                .gravity
                .iter()
                .filter_map(|gravity| gravity.clearance())
            {
                clearance.check(&self.bodies, states)?;
            }
        }
        Ok(())
    }

    /// What acts, in numbers, in the order in which it is summed; none where something has no such form.
    pub fn forms(&self) -> Option<Vec<Form>> {
        self.gravity.iter().map(|gravity| gravity.form()).collect()
    }

    /// What [`System::loads`] costs if everything is computed, in multiples of a point of mass in a central field, roughly.
    pub fn cost(&self) -> f64 {
        let gravity = self.gravity.iter();
        gravity.map(|gravity| gravity.cost(&self.bodies)).sum()
    }

    /// Whether gravity acts at all.
    pub fn is_free(&self) -> bool {
        self.gravity.is_empty()
    }

    /// Puts the bodies that are held or driven on their way: their momenta in `states` are those of their motion.
    pub fn constrain(&self, states: &mut [BodyState]) {
        for (body, state) in self.bodies.iter().zip(states) {
            match body.mobility() {
                Mobility::Free => {}
                Mobility::Pivoted => state.linear_momentum.fill(0.0),
                Mobility::Fixed => {
                    state.linear_momentum.fill(0.0);
                    state.angular_momentum.fill(0.0);
                }
                Mobility::Driven(drive) => {
                    *state = drive.state(body, state.position, state.attitude);
                }
            }
        }
    }
}
