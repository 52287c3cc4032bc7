//! The metrics of augmentation and damping.

use nalgebra::{SMatrix, SVector};

use crate::Transfer;
use crate::problem::{Off, Vector12};

/// The stiffness of each coordinate at the end: that of a rest-to-rest motion of a free body in the duration.
pub(super) fn stiffness(transfer: &Transfer) -> Vector12 {
    with_exchange(transfer, of_motion(transfer))
}

/// The same of positions, whatever is in their place.
fn of_motion(transfer: &Transfer) -> Vector12 {
    let duration = transfer.h * transfer.intervals as f64;
    let actuation = &transfer.actuation;
    let mut compliance = compliance(transfer);
    if actuation.is_fixed_to_body() {
        // On the average over attitudes.
        let mean = compliance.fixed_rows::<3>(0).mean();
        compliance.fixed_rows_mut::<3>(0).fill(mean);
    }
    let half = |which: usize| compliance.fixed_rows::<3>(3 * which).mean();
    let floors =
        [half(0), half(1)].map(|mean| 1e-6 * if mean > 0.0 { mean } else { compliance.mean() });
    SVector::from_fn(|i, _| {
        let (which, axis) = (i / 3, i % 3);
        let inertia = if which < 2 {
            transfer.body.mass()
        } else {
            transfer.body.inertia().matrix()[(axis, axis)]
        };
        let weight = compliance[3 * (which / 2) + axis]
            .max(floors[which / 2])
            .recip();
        if which % 2 == 0 {
            12.0 * weight * inertia * inertia / (duration * duration * duration)
        } else {
            4.0 * weight / duration
        }
    })
}

/// What is known of each coordinate, where exchanged momenta in the place of positions are as those that wheels store.
fn with_exchange(transfer: &Transfer, mut of_coordinates: Vector12) -> Vector12 {
    if transfer.exchange.is_some() {
        let stored = of_coordinates.fixed_rows::<3>(3).into_owned();
        of_coordinates.fixed_rows_mut::<3>(0).copy_from(&stored);
    }
    of_coordinates
}

/// The diagonal of `B W⁻¹ Bᵀ` of the commands that act, on the average over the steps.
fn compliance(transfer: &Transfer) -> SVector<f64, 6> {
    let (matrix, weight) = (transfer.actuation.matrix(), transfer.actuation.weight());
    let without = |off: Off| {
        let mut weight = *weight;
        off.decouple(&mut weight, |_| 1.0);
        let mut inverse = weight.try_inverse().unwrap_or_else(SMatrix::identity);
        off.decouple(&mut inverse, |_| 0.0);
        (matrix * inverse * matrix.transpose()).diagonal()
    };
    let shares = transfer.off_shares().into_iter();
    shares.map(|(off, share)| share * without(off)).sum()
}

/// The weight of each coordinate along the way, per unit of time. Displacements weigh as much as the stiffness of the
/// stiffest axis, momenta as the displacement that they cause in the duration. Slender axes count as much as others,
/// because a step is limited by the angle of a turn and not by its cost.
pub(super) fn metric(transfer: &Transfer) -> Vector12 {
    let duration = transfer.h * transfer.intervals as f64;
    let stiffness = of_motion(transfer);
    let [translation, rotation] = [0, 6].map(|first| stiffness.fixed_rows::<3>(first).max());
    let metric = Vector12::from_fn(|i, _| {
        let axis = i % 3;
        let per_time = |inertia: f64| (duration / inertia) * (duration / inertia);
        let weight = match i / 3 {
            0 => translation,
            1 => translation * per_time(transfer.body.mass()),
            2 => rotation,
            _ => rotation * per_time(transfer.body.inertia().matrix()[(axis, axis)]),
        };
        weight / duration
    });
    with_exchange(transfer, metric)
}
