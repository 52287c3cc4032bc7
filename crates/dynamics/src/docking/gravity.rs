use std::cell::{RefCell, RefMut};

use super::assembly::Assembly;
use crate::gravity::{Clearance, CloseApproach, Gravity, Monopole};
use crate::{BodyState, Load, RigidBody, System};

/// Gravity on wholes, which is that on their parts. Parts of the same whole do not attract each other.
pub(super) struct OnParts {
    assembly: Assembly,
    system: System,
    /// Buffers for the parts.
    states: RefCell<Vec<BodyState>>,
    loads: Vec<Load>,
}

impl OnParts {
    /// The gravity of the parts of `assembly`. Momenta of `states`, one per part, are not used.
    pub(super) fn new(
        assembly: Assembly,
        gravity: Vec<Box<dyn Gravity>>,
        states: Vec<BodyState>,
    ) -> Self {
        let mut system = System::new(assembly.parts().to_vec(), gravity);
        system.keep_apart(|body, other| assembly.whole(body) != assembly.whole(other));
        Self {
            loads: vec![Load::default(); states.len()],
            assembly,
            system,
            states: RefCell::new(states),
        }
    }

    /// The parts in the wholes.
    fn placed(&self, wholes: &[BodyState]) -> RefMut<'_, Vec<BodyState>> {
        let mut states = self.states.borrow_mut();
        self.assembly.place(wholes, &mut states);
        states
    }
}

impl Gravity for OnParts {
    fn add_loads(&mut self, _: &[RigidBody], wholes: &[BodyState], loads: &mut [Load]) {
        let states = self.states.get_mut();
        self.assembly.place(wholes, states);
        self.system.loads(states, &mut self.loads);
        self.assembly.gather(wholes, &self.loads, loads);
    }

    /// Includes the potential between the parts of a whole, which is constant.
    fn potential(&self, _: &[RigidBody], wholes: &[BodyState]) -> f64 {
        self.system.potential(&self.placed(wholes))
    }

    fn clearance(&self) -> Option<&dyn Clearance> {
        Some(self)
    }

    fn center(&self) -> Option<Monopole> {
        self.system.center()
    }

    fn constant(&self) -> Option<f64> {
        self.system.constant()
    }

    fn cost(&self, _: &[RigidBody]) -> f64 {
        self.system.cost()
    }
}

/// Errors name the parts.
impl Clearance for OnParts {
    fn has_extents(&self, _: &[RigidBody]) -> bool {
        self.system.has_extents()
    }

    fn check(&self, _: &[RigidBody], wholes: &[BodyState]) -> Result<(), CloseApproach> {
        let whole = |part| self.assembly.whole(part);
        let apart = |body, other| whole(body) != whole(other);
        self.system
            .check_clearance_apart(&self.placed(wholes), &apart)
    }
}
