//! Which pixels come first.

/// Pixels from one pilot to the next, along rows and columns; half of it in pictures with fewer pixels than these.
const PILOT_STEP: usize = 8;
const SMALL_PICTURE: usize = 1 << 14;

/// Pixels from one to the next of those that come first where time may be up, and of those that come then.
const STEPS: [usize; 2] = [4, 2];

/// A picture's rows and columns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    pub(crate) width: usize,
    pub(crate) height: usize,
}

impl Grid {
    fn place(self, index: usize) -> (usize, usize) {
        (index % self.width, index / self.width)
    }

    /// Its pilots are many of its pixels.
    fn is_small(self) -> bool {
        self.width * self.height < SMALL_PICTURE
    }

    /// A few pixels all over the picture, which say how much samples lose.
    pub(crate) fn is_pilot(self, index: usize) -> bool {
        let step = if self.is_small() {
            PILOT_STEP / 2
        } else {
            PILOT_STEP
        };
        let (x, y) = self.place(index);
        let middle = |size: usize| (step / 2).min(size - 1);
        (x % step, y % step) == (middle(self.width), middle(self.height))
    }

    /// Pixels of class 0 come first where time may be up, then those of 1, then those of 2.
    pub(crate) fn class(self, index: usize) -> usize {
        let (x, y) = self.place(index);
        STEPS
            .into_iter()
            .filter(|&step| x % step != 0 || y % step != 0)
            .count()
    }

    /// Pixels near a pixel that got their first sample early.
    pub(crate) fn near(self, index: usize) -> [usize; 5] {
        let (x, y) = self.place(index);
        let first = |step: usize| (y - y % step) * self.width + x - x % step;
        let pilot = |step: usize| {
            let at = |place: usize, end: usize| (place - place % step + step / 2).min(end - 1);
            at(y, self.height) * self.width + at(x, self.width)
        };
        let [early, late] = STEPS.map(first);
        [
            late,
            early,
            first(8),
            pilot(PILOT_STEP / 2),
            pilot(PILOT_STEP),
        ]
    }
}
