//! Times at an asked error, and their ratios repetition by repetition.

use super::cases::Setting;
use super::measure::{Measured, Point};
use crate::spread::Spread;

/// What an error costs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Times {
    /// Of each repetition (s).
    pub seconds: Vec<f64>,
    /// Whether a coarser flight, which was not timed, might do: the coarsest of all is fine enough.
    pub at_most: bool,
}

/// The times from which on the error is at most `target`, interpolated on a logarithmic scale: a chance dip of a coarser
/// flight does not count. None where the error is not reached.
pub(super) fn times_at(measured: &Measured, setting: &Setting, target: f64) -> Option<Times> {
    let mut points: Vec<_> = measured.points.iter().collect();
    points.sort_by(|a, b| median(a).total_cmp(&median(b)));
    let error = |point: &Point| {
        let last = point.errors.last();
        last.map_or(f64::INFINITY, |errors| setting.error(errors))
    };
    let fine = match points.iter().rposition(|point| error(point) > target) {
        None => {
            return points.first().map(|point| Times {
                seconds: point.seconds.clone(),
                at_most: measured.tuning.is_some(),
            });
        }
        Some(coarse) => coarse + 1,
    };
    let (before, after) = (points[fine - 1], points.get(fine)?);
    let (e0, e1) = (error(before), error(after).max(f64::MIN_POSITIVE));
    let part = (e0 / target).ln() / (e0 / e1).ln();
    let between = before.seconds.iter().zip(&after.seconds);
    Some(Times {
        seconds: between.map(|(t0, t1)| t0 * (t1 / t0).powf(part)).collect(),
        at_most: false,
    })
}

pub(super) fn median(point: &Point) -> f64 {
    Spread::of(point.seconds.iter().copied()).map_or(f64::NAN, |spread| spread.median)
}

#[cfg(test)]
mod tests {
    use super::super::cases::{ErrorsAt, Setting};
    use super::{Measured, Point, Times, times_at};
    use crate::peer::Tuning;

    fn measured(points: &[(f64, f64)]) -> Measured {
        let point = |&(error, seconds): &(f64, f64)| Point {
            setting: 1.0,
            errors: vec![ErrorsAt {
                t: 1.0,
                position: error,
                velocity: 0.0,
                attitude: error,
                angular_velocity: 0.0,
                energy: 0.0,
                angular_momentum: 0.0,
            }],
            seconds: vec![seconds, 2.0 * seconds],
        };
        Measured {
            method: String::new(),
            peer: false,
            tuning: Some(Tuning::Tolerance),
            points: points.iter().map(point).collect(),
        }
    }

    #[test]
    fn times_are_interpolated_from_where_on_the_error_stays_below() {
        let setting = Setting::named("a1_two_dumbbells_regular").unwrap();
        let dipping = measured(&[(1e-2, 1.0), (1e-7, 2.0), (1e-4, 4.0), (1e-8, 16.0)]);
        let Times { seconds, at_most } = times_at(&dipping, setting, 1e-6).unwrap();
        assert!((seconds[0] - 8.0).abs() < 1e-12 && (seconds[1] - 16.0).abs() < 1e-12);
        assert!(!at_most);
        assert_eq!(times_at(&dipping, setting, 1e-9), None);
        let coarsest = |at_most| Times {
            seconds: vec![1.0, 2.0],
            at_most,
        };
        assert_eq!(times_at(&dipping, setting, 1e-1), Some(coarsest(true)));
        let exact = Measured {
            tuning: None,
            ..measured(&[(1e-14, 1.0)])
        };
        assert_eq!(times_at(&exact, setting, 1e-6), Some(coarsest(false)));
    }
}
