mod actuators;

pub use actuators::ActuatorStates;

use crate::gravity::{CloseApproach, Form, Gravity, Interaction, Kept, Level, Monopole};
use crate::skip::Levels;
use crate::{BodyState, Load, Mobility, RigidBody};

/// Bodies and the gravity that acts on them.
pub struct System {
    bodies: Vec<RigidBody>,
    gravity: Vec<Box<dyn Gravity>>,
    /// True if a body or source has an extent that another could enter.
    extents: bool,
    selection: Selection,
    /// The levels of interactions, if they change with distances.
    levels: Option<Levels>,
}

/// The parts of a system that are computed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Selection {
    /// True if something is omitted. If false, the other fields are ignored.
    pub(crate) is_partial: bool,
    /// The kept interactions of each gravity model, or `None` if it cannot be decomposed and is computed in full.
    pub(crate) kept: Vec<Option<Vec<Kept>>>,
    /// True for each body on which gravity exerts no moment.
    pub(crate) coasting: Vec<bool>,
}

impl System {
    /// Creates a system of bodies under the sum of the given gravity models. Without any, the bodies are free.
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

    /// The same, to set the states and commands of their actuators.
    pub fn bodies_mut(&mut self) -> &mut [RigidBody] {
        &mut self.bodies
    }

    /// Sets `loads` (one per body) to the gravity in `states`.
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

    /// The interactions of each gravity model, or `None` for a model that cannot be decomposed.
    pub(crate) fn interactions(&mut self) -> Vec<Option<Vec<Interaction>>> {
        let each = self.gravity.iter_mut().map(|gravity| {
            let separable = gravity.separable()?;
            Some(separable.interactions(&self.bodies))
        });
        each.collect()
    }

    /// The parts that are computed.
    pub(crate) fn selection(&self) -> &Selection {
        &self.selection
    }

    /// The kept interactions of the gravity model with this index, or `None` if it is computed in full.
    pub(crate) fn kept(&self, gravity: usize) -> Option<&[Kept]> {
        let kept = self.selection.kept.get(gravity)?.as_deref();
        kept.filter(|_| self.selection.is_partial)
    }

    /// Leaves out the interactions of two bodies that are not `apart`, given their indices. The others are computed in
    /// full.
    pub(crate) fn keep_apart(&mut self, apart: impl Fn(usize, usize) -> bool) {
        let interactions = self.interactions();
        let bodies = &self.bodies;
        let matters = |one: &Interaction| {
            let joined = one.other().is_some_and(|other| !apart(one.body, other));
            one.exact > Level::Dropped && !joined
        };
        let kept = |one: Interaction| Kept {
            body: one.body,
            other: one.other().unwrap_or(one.body),
            level: Level::Full,
            masses: one.masses(bodies),
        };
        self.selection = Selection {
            is_partial: true,
            kept: interactions
                .into_iter()
                .map(|all| Some(all?.into_iter().filter(matters).map(kept).collect()))
                .collect(),
            coasting: vec![false; self.bodies.len()],
        };
    }

    /// Sets the levels of interactions. `None` computes everything in full.
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

    /// Applies the current levels of the interactions.
    pub(crate) fn select(&mut self) {
        if let Some(levels) = &self.levels {
            levels.select(&self.bodies, &mut self.selection);
        }
    }

    /// The levels of interactions, if they change with distances.
    pub(crate) fn levels(&mut self) -> Option<&mut Levels> {
        self.levels.as_mut()
    }

    /// The number of changes of level so far.
    pub(crate) fn switches(&self) -> u64 {
        self.levels.as_ref().map_or(0, Levels::switches)
    }

    /// Returns true if levels change with distances.
    pub(crate) fn switches_levels(&self) -> bool {
        self.levels.is_some()
    }

    /// Checks the levels along a step of length `h`, made in one piece.
    #[inline]
    pub(crate) fn check_step(&mut self, from: &[BodyState], to: &[BodyState], h: f64) {
        if let Some(levels) = &mut self.levels {
            levels.check_step(&self.bodies, [from, to], h);
        }
    }

    /// True for each body on which gravity exerts no moment, one per body, or empty if this is not known.
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

    /// Checks that the bodies are outside the radii of each other and of the sources.
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

    /// As [`check_clearance`](Self::check_clearance), but of two bodies only those that are `apart`, given their indices.
    pub(crate) fn check_clearance_apart(
        &self,
        states: &[BodyState],
        apart: &dyn Fn(usize, usize) -> bool,
    ) -> Result<(), CloseApproach> {
        let clearances = self
            .gravity
            .iter()
            .filter_map(|gravity| gravity.clearance());
        let mut clearances = clearances.map(|one| one.check_apart(&self.bodies, states, apart));
        clearances.try_for_each(|checked| checked)
    }

    /// Returns true if a body or source has an extent that another could enter.
    pub(crate) fn has_extents(&self) -> bool {
        self.extents
    }

    /// The parameters of the gravity models in the order of summation, or `None` if a model has no such form.
    pub fn forms(&self) -> Option<Vec<Form>> {
        self.gravity.iter().map(|gravity| gravity.form()).collect()
    }

    /// The strongest fixed source as a monopole, or `None` if there is none.
    pub(crate) fn center(&self) -> Option<Monopole> {
        let all = self.gravity.iter().filter_map(|gravity| gravity.center());
        all.max_by(|one, other| one.gm.total_cmp(&other.gm))
    }

    /// The gravitational constant, if all bodies attract each other.
    pub(crate) fn constant(&self) -> Option<f64> {
        self.gravity.iter().find_map(|gravity| gravity.constant())
    }

    /// Approximate cost of [`System::loads`] without omissions, in multiples of a point mass in a central field.
    pub fn cost(&self) -> f64 {
        let gravity = self.gravity.iter();
        gravity.map(|gravity| gravity.cost(&self.bodies)).sum()
    }

    /// Returns true if no gravity acts.
    pub fn is_free(&self) -> bool {
        self.gravity.is_empty()
    }

    /// Returns true if a body has drag.
    pub(crate) fn has_drag(&self) -> bool {
        self.bodies.iter().any(|body| body.drag().is_some())
    }

    /// Makes the momenta of pivoted, fixed and driven bodies in `states` consistent with their mobility.
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
