use std::sync::Arc;

use lgvi_dynamics::Load;

use super::Command;

/// What changes from step to step of a transfer and is known when it is solved, one of each for each step.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ByStep {
    /// Factors of the limits of commands: `g(w/ℓ) ≤ 0`.
    pub(crate) limits: Vec<f64>,
    /// `r`, where commands cost `r · w` per unit of time in addition to their own cost.
    pub(crate) costs: Vec<Command>,
    /// Forces, inertial frame, and moments, body frame, beside those of the commands at the beginning and the end of a step.
    pub(crate) loads: Vec<[Load; 2]>,
}

impl ByStep {
    /// The same over so many intervals of the same time: the means over the steps that they touch.
    pub(crate) fn in_intervals(self: &Arc<Self>, intervals: usize) -> Arc<Self> {
        let steps = self.limits.len();
        if steps == intervals {
            return Arc::clone(self);
        }
        let touched = |interval: usize| {
            let first = (interval * steps / intervals).min(steps - 1);
            first..((interval + 1) * steps).div_ceil(intervals).max(first + 1)
        };
        let all = (0..intervals).map(touched);
        Arc::new(Self {
            limits: all
                .clone()
                .map(|steps| {
                    let limits = &self.limits[steps];
                    limits.iter().sum::<f64>() / limits.len() as f64
                })
                .collect(),
            costs: all
                .clone()
                .map(|steps| {
                    let costs = &self.costs[steps];
                    costs.iter().sum::<Command>() / costs.len() as f64
                })
                .collect(),
            loads: all
                .map(|steps| {
                    let loads = &self.loads[steps];
                    let sum = loads
                        .iter()
                        .flatten()
                        .copied()
                        .fold(Load::default(), |a, b| a + b);
                    [scaled(&sum, 0.5 / loads.len() as f64, 0.5 / loads.len() as f64); 2]
                })
                .collect(),
        })
    }

    /// The same with these factors of costs by command, of forces and of moments.
    pub(crate) fn scaled(&self, costs: &Command, [force, moment]: [f64; 2]) -> Self {
        Self {
            limits: self.limits.clone(),
            costs: self
                .costs
                .iter()
                .map(|cost| cost.component_mul(costs))
                .collect(),
            loads: self
                .loads
                .iter()
                .map(|ends| ends.map(|load| scaled(&load, force, moment)))
                .collect(),
        }
    }
}

fn scaled(load: &Load, force: f64, moment: f64) -> Load {
    Load {
        force: force * load.force,
        moment: moment * load.moment,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn fewer_intervals_have_the_means_of_their_steps() {
        let load = |x: f64| Load {
            force: x * Vector3::x(),
            moment: -x * Vector3::y(),
        };
        let number = |k: usize| k as f64;
        let all = Arc::new(ByStep {
            limits: (0..6).map(number).collect(),
            costs: (0..6).map(|k| Command::repeat(number(k))).collect(),
            loads: (0..6)
                .map(|k| [load(number(k)), load(number(k) + 1.0)])
                .collect(),
        });
        assert!(Arc::ptr_eq(&all.in_intervals(6), &all));
        let three = all.in_intervals(3);
        assert_eq!(three.limits, [0.5, 2.5, 4.5]);
        assert_eq!(three.costs[1], Command::repeat(2.5));
        assert_eq!(three.loads[2], [load(5.0); 2]);
        let four = all.in_intervals(4);
        assert_eq!(four.limits, [0.5, 1.5, 3.5, 4.5]);
        assert_eq!(all.in_intervals(12).limits[..4], [0.0, 0.0, 1.0, 1.0]);
    }
}
