use crate::lane::Lane;

/// Number of solutions used for extrapolation.
const KNOWN: usize = 6;

/// Length of the strip that stores solutions. Longer strips are moved less often.
const STRIP: usize = 32;

/// Initial guesses for the bodies' discrete rotations, extrapolated from the last solutions. A solution is one number,
/// the correction of `s` to its leading term.
///
/// Each body has one strip for each of its rotations in a step, filled from back to front. Its contents move only every
/// 26th step.
pub(crate) struct WarmStart<T> {
    /// Strips, ordered by rotation, then by body.
    strips: Vec<Strip<T>>,
    zero: T,
    bodies: usize,
    /// Index in each strip of the solution of the current step. It is followed by those of the last steps, newest
    /// first.
    present: usize,
    /// True if no step has been made yet.
    fresh: bool,
}

/// The solutions of one body.
struct Strip<T>([T; STRIP]);

/// The solutions of one rotation of a body, with the position of the current step.
pub(crate) struct Solutions<'a, T> {
    strip: &'a mut Strip<T>,
    present: usize,
}

impl<T: Lane> Solutions<'_, T> {
    /// Extrapolates the last six solutions by a quintic polynomial to the current step.
    #[inline(always)]
    pub(crate) fn extrapolate(&self) -> T {
        match self.strip.0[self.present + 1..] {
            [a, b, c, d, e, f, ..] => a * 6.0 + ((c * 20.0 - b * 15.0) + (e * 6.0 - d * 15.0) - f),
            _ => self.strip.0[self.present],
        }
    }

    /// Stores the solution of the current step.
    #[inline(always)]
    pub(crate) fn note(&mut self, s: T) {
        self.strip.0[self.present] = s;
    }
}

impl<T: Lane> WarmStart<T> {
    /// Creates an empty history for `bodies` that each rotate `times` times in a step.
    pub(crate) fn new(zero: T, times: usize, bodies: usize) -> Self {
        Self {
            strips: (0..times * bodies).map(|_| Strip([zero; STRIP])).collect(),
            zero,
            bodies,
            present: STRIP - 1 - KNOWN,
            fresh: true,
        }
    }

    /// Discards the history of the trajectory.
    pub(crate) fn forget(&mut self) {
        let zero = self.zero;
        self.strips.iter_mut().for_each(|strip| strip.0.fill(zero));
        self.fresh = true;
    }

    /// The solutions of all bodies for one rotation in a step.
    #[inline(always)]
    pub(crate) fn of_stage(&mut self, stage: usize) -> impl Iterator<Item = Solutions<'_, T>> {
        let present = self.present;
        let strips = self.strips[stage * self.bodies..][..self.bodies].iter_mut();
        strips.map(move |strip| Solutions { strip, present })
    }

    /// Accepts the current step.
    #[inline(always)]
    pub(crate) fn accept(&mut self) {
        if self.fresh || self.present == 0 {
            self.wind();
        } else {
            self.present -= 1;
        }
    }

    /// Moves the last solutions to the ends of the strips. The first solution of a trajectory also fills the places of
    /// the earlier ones.
    #[cold]
    fn wind(&mut self) {
        let end = STRIP - KNOWN;
        for Strip(strip) in &mut self.strips {
            if self.fresh {
                let first = strip[self.present];
                strip.fill(first);
            } else {
                strip.copy_within(self.present..self.present + KNOWN, end);
            }
        }
        self.present = end - 1;
        self.fresh = false;
    }
}
