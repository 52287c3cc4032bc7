use std::collections::VecDeque;

/// A valve with the pulses that it has been told to make.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Valve {
    /// When it opens and closes, in steps from the beginning of the present step on, in order.
    pulses: VecDeque<[f64; 2]>,
}

impl Clone for Valve {
    fn clone(&self) -> Self {
        Self {
            pulses: self.pulses.clone(),
        }
    }

    fn clone_from(&mut self, from: &Self) {
        self.pulses.clone_from(&from.pulses);
    }
}

impl Valve {
    /// Opens the valve after `delay` for a time; both in steps.
    pub(super) fn pulse(&mut self, delay: f64, open: f64) {
        if open > 0.0 {
            self.pulses.push_back([delay, delay + open]);
        }
    }

    /// The share of the present step in which the valve is open. Goes on to the next step.
    pub(super) fn pass(&mut self) -> f64 {
        let mut share = 0.0;
        for pulse in &mut self.pulses {
            let [opens, closes] = *pulse;
            share += (closes.min(1.0) - opens.max(0.0)).max(0.0);
            *pulse = [opens - 1.0, closes - 1.0];
        }
        while self
            .pulses
            .front()
            .is_some_and(|[_, closes]| *closes <= 0.0)
        {
            self.pulses.pop_front();
        }
        share.min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shares(valve: &mut Valve, steps: usize) -> Vec<f64> {
        (0..steps).map(|_| valve.pass()).collect()
    }

    #[test]
    fn a_pulse_takes_its_share_of_the_steps() {
        let mut valve = Valve::default();
        valve.pulse(0.0, 2.25);
        assert_eq!(shares(&mut valve, 5), [1.0, 1.0, 0.25, 0.0, 0.0]);
        valve.pulse(1.5, 2.25);
        assert_eq!(shares(&mut valve, 5), [0.0, 0.5, 1.0, 0.75, 0.0]);
        assert_eq!(valve, Valve::default());
    }

    #[test]
    fn pulses_wait_for_each_other() {
        let mut valve = Valve::default();
        valve.pulse(2.5, 0.5);
        assert_eq!(shares(&mut valve, 1), [0.0]);
        valve.pulse(2.5, 0.25);
        assert_eq!(shares(&mut valve, 4), [0.0, 0.5, 0.25, 0.0]);
    }
}
