use super::Frame;
use super::center::Place;
use crate::System;
use crate::gravity::{Form, Interaction, Level, SourceShape};

/// What gravity does to the bodies of a system, whatever their states.
pub(super) struct Kinds {
    /// True if Kepler's motion is all of it: points of mass about a point, without other forces.
    pub(super) solved: bool,
    /// True for each body on which it exerts no moment.
    pub(super) coasting: Vec<bool>,
}

impl Kinds {
    pub(super) fn of(system: &mut System, frame: &Frame) -> Self {
        let models = system.interactions();
        let separable = models.iter().all(Option::is_some);
        let all: Vec<_> = models.into_iter().flatten().flatten().collect();
        let mut coasting = vec![separable; system.bodies().len()];
        for one in &all {
            let [first, second] = one.moments;
            coasting[one.body] &= !first;
            if let Some(other) = one.other() {
                coasting[other] &= !second;
            }
        }
        Self {
            solved: separable && solved(system, frame, &all),
            coasting,
        }
    }
}

/// Returns true if all interactions are those of points with their center.
fn solved(system: &System, frame: &Frame, all: &[Interaction]) -> bool {
    let forms = system.forms().unwrap_or_default();
    let [form] = forms.as_slice() else {
        return false;
    };
    let point = match form {
        Form::Attractor { shape, .. } => matches!(shape, SourceShape::Point { .. }),
        Form::Mutual { .. } => true,
        Form::Uniform { .. } => false,
    };
    let mut moving = all.iter().filter(|one| one.exact != Level::Dropped);
    let mut whole = system.bodies().iter();
    point
        && whole.all(|body| body.attracted_mass() == body.mass())
        && match frame {
            Frame::Center(center) => moving.all(|one| {
                let central = match center.place {
                    Place::At(_) => one.other().is_none(),
                    Place::Body(index) => one.body == index || one.other() == Some(index),
                };
                central && one.exact == Level::Monopole
            }),
            // Two bodies, and no fixed one.
            Frame::Jacobi(_) => {
                let pair = moving.next();
                pair.is_some_and(|pair| pair.exact == Level::Monopole) && moving.next().is_none()
            }
        }
}
