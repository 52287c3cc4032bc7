//! Loads that act beside the accepted sequences.

use lgvi_dynamics::Load;

/// Loads with their ends.
#[derive(Default)]
pub(crate) struct Pushes(Vec<Push>);

struct Push {
    body: usize,
    load: Load,
    /// The step before which it ends.
    end: u64,
}

impl Pushes {
    /// Adds a load that acts from the present step to before another.
    pub(crate) fn add(&mut self, body: usize, load: Load, [step, end]: [u64; 2]) {
        self.0.retain(|push| push.end > step);
        self.0.push(Push { body, load, end });
    }

    /// Adds what acts in a step to the loads of the bodies.
    pub(crate) fn act(&self, step: u64, loads: &mut [Load]) {
        for push in self.0.iter().filter(|push| step < push.end) {
            if let Some(load) = loads.get_mut(push.body) {
                *load += push.load;
            }
        }
    }

    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }
}
