/// Solutions that a guess is extrapolated from.
const KNOWN: usize = 6;

/// Length of the strip that solutions are written to; the longer, the more rarely they are moved.
const STRIP: usize = 32;

/// What tells the last solutions of the bodies' implicit equations, a number each (the correction of `s` to its leading
/// term), from which the next are extrapolated.
///
/// Each body has a strip for each of its turns in a step that is written to from end to front: what is in it never moves, but for every 26th step.
pub(super) struct Turns {
    /// Turn after turn, in each body after body.
    strips: Vec<Strip>,
    bodies: usize,
    /// Where in each strip the solution of the present step goes; before those of the last steps, newest first.
    present: usize,
    /// Whether there has been no step yet.
    fresh: bool,
}

/// One body's solutions.
struct Strip([f64; STRIP]);

/// What is known of one body in the present step.
pub(super) struct Known<'a> {
    strip: &'a mut Strip,
    present: usize,
}

impl Known<'_> {
    /// The quintic through the last solutions, one step on.
    #[inline(always)]
    pub(super) fn guess(&self) -> f64 {
        match &self.strip.0[self.present + 1..] {
            [a, b, c, d, e, f, ..] => 6.0 * a + ((20.0 * c - 15.0 * b) + (6.0 * e - 15.0 * d) - f),
            _ => 0.0,
        }
    }

    /// Notes the solution of the present step.
    #[inline(always)]
    pub(super) fn note(&mut self, s: f64) {
        self.strip.0[self.present] = s;
    }
}

impl Turns {
    /// Of nothing, for a number of bodies that turn so many times in a step.
    pub(super) fn new(times: usize, bodies: usize) -> Self {
        Self {
            strips: (0..times * bodies).map(|_| Strip([0.0; STRIP])).collect(),
            bodies,
            present: STRIP - 1 - KNOWN,
            fresh: true,
        }
    }

    /// Forgets the trajectory so far.
    pub(super) fn forget(&mut self) {
        self.strips.iter_mut().for_each(|strip| strip.0.fill(0.0));
        self.fresh = true;
    }

    /// What is known of each body for one of its turns in a step.
    #[inline(always)]
    pub(super) fn known(&mut self, time: usize) -> impl Iterator<Item = Known<'_>> {
        let present = self.present;
        let strips = self.strips[time * self.bodies..][..self.bodies].iter_mut();
        strips.map(move |strip| Known { strip, present })
    }

    /// Takes the present step as made.
    #[inline(always)]
    pub(super) fn accept(&mut self) {
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
