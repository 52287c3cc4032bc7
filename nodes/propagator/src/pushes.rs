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
        let mut others = self.0.iter_mut();
        match others.find(|push| (push.body, push.end) == (body, end)) {
            Some(other) => other.load += load,
            None => self.0.push(Push { body, load, end }),
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pushes_of_a_body_that_end_together_are_one() {
        let load = |x| Load {
            force: [x, 0.0, 0.0].into(),
            moment: [0.0, x, 0.0].into(),
        };
        let mut pushes = Pushes::default();
        for _ in 0..1000 {
            pushes.add(0, load(1.0), [3, 10]);
            pushes.add(1, load(2.0), [3, 10]);
            pushes.add(1, load(4.0), [3, 5]);
        }
        assert_eq!(pushes.0.len(), 3);
        for (step, second) in [(4, 6000.0), (9, 2000.0)] {
            let mut loads = [Load::default(); 2];
            pushes.act(step, &mut loads);
            assert_eq!(loads, [load(1000.0), load(second)], "step {step}");
        }
    }
}
