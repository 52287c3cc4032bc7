use super::lane::Lane;

/// Solutions that a guess is extrapolated from.
const KNOWN: usize = 6;

/// The corrections of s that the bodies' guesses are extrapolated from, of each turn in a step, as
/// `integrator::turn` has them.
pub(super) struct Turns<T> {
    /// Turn after turn, in each body after body; newest first.
    known: Vec<[T; KNOWN]>,
    /// Those of the present step.
    pub(super) present: Vec<T>,
    /// Whether there has been no step yet.
    fresh: bool,
}

impl<T: Lane> Turns<T> {
    pub(super) fn new(token: T::Token, count: usize) -> Self {
        let zero = T::splat(token, 0.0);
        Self {
            known: vec![[zero; KNOWN]; count],
            present: vec![zero; count],
            fresh: true,
        }
    }

    /// The quintic through the last, one step on.
    #[inline(always)]
    pub(super) fn guess(&self, index: usize) -> T {
        let [a, b, c, d, e, f] = self.known[index];
        a * 6.0 + ((c * 20.0 - b * 15.0) + (e * 6.0 - d * 15.0) - f)
    }

    /// Takes the present step as made; a flight's first stands for those before it too.
    #[inline(always)]
    pub(super) fn accept(&mut self) {
        for (known, &present) in self.known.iter_mut().zip(&self.present) {
            let [a, b, c, d, e, _] = *known;
            *known = if self.fresh {
                [present; KNOWN]
            } else {
                [present, a, b, c, d, e]
            };
        }
        self.fresh = false;
    }
}
