use crate::lane::Lane;

/// Solutions that a guess is extrapolated from.
const KNOWN: usize = 6;

/// Length of the strip that solutions are written to; the longer, the more rarely they are moved.
const STRIP: usize = 32;

/// Guesses for the bodies' discrete rotations: the last solutions, a number each (the correction of `s` to its leading
/// term), from which the next is extrapolated.
///
/// Each body has a strip for each of its rotations in a step that is written to from end to front: what is in it never
/// moves, but for every 26th step.
pub(crate) struct WarmStart<T> {
    /// Rotation after rotation, in each body after body.
    strips: Vec<Strip<T>>,
    zero: T,
    bodies: usize,
    /// Where in each strip the solution of the present step goes; before those of the last steps, newest first.
    present: usize,
    /// Whether there has been no step yet.
    fresh: bool,
}

/// One body's solutions.
struct Strip<T>([T; STRIP]);

/// The solutions of one body's rotation in the present step.
pub(crate) struct Solutions<'a, T> {
    strip: &'a mut Strip<T>,
    present: usize,
}

impl<T: Lane> Solutions<'_, T> {
    /// The quintic through the last solutions, one step on.
    #[inline(always)]
    pub(crate) fn extrapolate(&self) -> T {
        match self.strip.0[self.present + 1..] {
            [a, b, c, d, e, f, ..] => a * 6.0 + ((c * 20.0 - b * 15.0) + (e * 6.0 - d * 15.0) - f),
            _ => self.strip.0[self.present],
        }
    }

    /// Notes the solution of the present step.
    #[inline(always)]
    pub(crate) fn note(&mut self, s: T) {
        self.strip.0[self.present] = s;
    }
}

impl<T: Lane> WarmStart<T> {
    /// Of nothing, for a number of bodies that turn so many times in a step.
    pub(crate) fn new(zero: T, times: usize, bodies: usize) -> Self {
        Self {
            strips: (0..times * bodies).map(|_| Strip([zero; STRIP])).collect(),
            zero,
            bodies,
            present: STRIP - 1 - KNOWN,
            fresh: true,
        }
    }

    /// Forgets the trajectory so far.
    pub(crate) fn forget(&mut self) {
        let zero = self.zero;
        self.strips.iter_mut().for_each(|strip| strip.0.fill(zero));
        self.fresh = true;
    }

    /// Those of each body for one of its rotations in a step.
    #[inline(always)]
    pub(crate) fn of_stage(&mut self, stage: usize) -> impl Iterator<Item = Solutions<'_, T>> {
        let present = self.present;
        let strips = self.strips[stage * self.bodies..][..self.bodies].iter_mut();
        strips.map(move |strip| Solutions { strip, present })
    }

    /// Takes the present step as made.
    #[inline(always)]
    pub(crate) fn accept(&mut self) {
        if self.fresh || self.present == 0 {
            self.wind();
        } else {
            self.present -= 1;
        }
    }

    /// Moves the last solutions to the strips' ends; a trajectory's first stands for those before it too.
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
