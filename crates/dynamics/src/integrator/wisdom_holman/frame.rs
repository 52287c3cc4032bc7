use super::NAME;
use super::center::{Center, Place};
use super::jacobi::Jacobi;
use crate::{BodyState, Load, MethodError, Mobility, StepError, System};

/// The motion that is solved exactly.
pub(super) enum Frame {
    Center(Center),
    Jacobi(Jacobi),
}

impl Frame {
    /// The motion about the strongest center of a system.
    pub(super) fn of(system: &System) -> Result<Self, MethodError> {
        let bodies = system.bodies();
        let of_kind = |kind: fn(&Mobility) -> bool| {
            let all = bodies.iter().enumerate();
            all.filter(move |(_, body)| kind(body.mobility()))
                .map(|(index, _)| index)
        };
        if let Some(body) = of_kind(|mobility| *mobility == Mobility::Pivoted).next() {
            let expected =
                "free, fixed or driven bodies; use another method such as the Nyström splitting";
            return Err(MethodError::Body {
                method: NAME,
                body,
                expected,
            });
        }
        let constant = system.constant().unwrap_or(0.0);
        let heaviest = |indices: &mut dyn Iterator<Item = usize>| {
            let strengths = indices.map(|index| (constant * bodies[index].attracted_mass(), index));
            strengths.max_by(|one, other| one.0.total_cmp(&other.0).then(other.1.cmp(&one.1)))
        };
        let mut best: Option<Center> = system.center().map(|monopole| Center {
            gm: monopole.gm,
            place: Place::At(monopole.position),
        });
        let stronger =
            |gm: f64, best: &Option<Center>| gm > best.as_ref().map_or(0.0, |center| center.gm);
        if let Some((gm, index)) = heaviest(&mut of_kind(|mobility| *mobility == Mobility::Fixed))
            && stronger(gm, &best)
        {
            let place = Place::Body(index);
            best = Some(Center { gm, place });
        }
        let free: Vec<_> = of_kind(|mobility| *mobility == Mobility::Free).collect();
        if let Some((gm, _)) = heaviest(&mut free.iter().copied())
            && free.len() > 1
            && stronger(gm, &best)
        {
            return Ok(Self::Jacobi(Jacobi::new(constant, bodies, &free)));
        }
        match best {
            Some(center) if center.gm > 0.0 => Ok(Self::Center(center)),
            _ => Err(MethodError::Center { method: NAME }),
        }
    }

    /// Orders the bodies from the inside out, as they are in `states`.
    pub(super) fn order(&mut self, states: &[BodyState]) {
        if let Self::Jacobi(jacobi) = self {
            jacobi.order(states);
        }
    }

    /// Moves the free bodies by `h`.
    #[inline]
    pub(super) fn drift(
        &mut self,
        system: &System,
        states: &mut [BodyState],
        h: f64,
    ) -> Result<(), StepError> {
        match self {
            Self::Center(center) => center.drift(system.bodies(), states, h),
            Self::Jacobi(jacobi) => jacobi.drift(states, h),
        }
    }

    /// Subtracts the attractions that the drift accounts for from the loads.
    #[inline]
    pub(super) fn subtract(&mut self, system: &System, states: &[BodyState], loads: &mut [Load]) {
        match self {
            Self::Center(center) => center.subtract(system.bodies(), states, loads),
            Self::Jacobi(jacobi) => jacobi.subtract(states, loads),
        }
    }
}
