//! Words that neither cover each other nor what is drawn.

use crate::chart::canvas::At;

/// A rectangle that is taken, points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taken {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

impl Taken {
    pub fn new(from: At, to: At) -> Self {
        Self {
            left: from.0,
            top: from.1,
            right: to.0,
            bottom: to.1,
        }
    }

    pub fn about(at: At, reach: f64) -> Self {
        Self::new((at.0 - reach, at.1 - reach), (at.0 + reach, at.1 + reach))
    }

    /// Of words that begin at `at`, the left end of their line.
    fn of_words(at: At, length: f64, size: f64) -> Self {
        Self::new(
            (at.0 - 1.0, at.1 - 0.78 * size),
            (at.0 + length + 1.0, at.1 + 0.22 * size),
        )
    }

    fn overlap(&self, other: &Self) -> f64 {
        let across = self.right.min(other.right) - self.left.max(other.left);
        let down = self.bottom.min(other.bottom) - self.top.max(other.top);
        across.max(0.0) * down.max(0.0)
    }

    fn is_within(&self, frame: &Self) -> bool {
        self.left >= frame.left
            && self.right <= frame.right
            && self.top >= frame.top
            && self.bottom <= frame.bottom
    }
}

/// All that is taken of a frame.
#[derive(Clone, Debug)]
pub struct Page {
    frame: Taken,
    taken: Vec<Taken>,
}

impl Page {
    pub fn new(frame: Taken) -> Self {
        Self {
            frame,
            taken: Vec::new(),
        }
    }

    pub fn take(&mut self, taken: Taken) {
        self.taken.push(taken);
    }

    /// Takes a line as wide as a pen.
    pub fn take_line(&mut self, from: At, to: At) {
        const STEP: f64 = 5.0;
        let steps = ((to.0 - from.0).hypot(to.1 - from.1) / STEP)
            .ceil()
            .min(1000.0);
        for step in 0..=steps as u32 {
            let share = f64::from(step) / steps.max(1.0);
            let at = (
                from.0 + share * (to.0 - from.0),
                from.1 + share * (to.1 - from.1),
            );
            self.take(Taken::about(at, 1.5));
        }
    }

    /// The first of the places (left ends of lines) at which words cover nothing, taken from now on.
    pub fn find(&mut self, places: &[At], length: f64, size: f64) -> Option<At> {
        let free = places
            .iter()
            .map(|at| (*at, Taken::of_words(*at, length, size)))
            .find(|(_, words)| words.is_within(&self.frame) && self.covered(words) == 0.0);
        free.map(|(at, words)| {
            self.take(words);
            at
        })
    }

    /// As [`Self::find`], but the place at which least is covered if there is no better one.
    pub fn find_best(&mut self, places: &[At], length: f64, size: f64) -> Option<At> {
        self.find(places, length, size).or_else(|| {
            let within = places
                .iter()
                .map(|at| (*at, Taken::of_words(*at, length, size)))
                .filter(|(_, words)| words.is_within(&self.frame));
            let (at, words) =
                within.min_by(|a, b| self.covered(&a.1).total_cmp(&self.covered(&b.1)))?;
            self.take(words);
            Some(at)
        })
    }

    fn covered(&self, words: &Taken) -> f64 {
        self.taken.iter().map(|taken| taken.overlap(words)).sum()
    }
}

/// Places for words about a mark: to its right, above, below, to its left, and between these.
pub fn about(at: At, distance: f64, length: f64, size: f64) -> Vec<At> {
    let middle = 0.36 * size;
    let (left, right) = (-distance - length, distance);
    let (above, below) = (-distance, distance + 0.72 * size);
    let centre = -0.5 * length;
    [
        (right, above + 3.0),
        (right, middle),
        (centre, above),
        (right, below - 3.0),
        (centre, below),
        (left, below - 3.0),
        (left, middle),
        (left, above + 3.0),
    ]
    .map(|(x, y)| (at.0 + x, at.1 + y))
    .to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_give_way_to_each_other_and_stay_on_the_page() {
        let mut page = Page::new(Taken::new((0.0, 0.0), (100.0, 100.0)));
        let places = about((50.0, 50.0), 5.0, 20.0, 10.0);
        let mut found = Vec::new();
        while let Some(at) = page.find(&places, 20.0, 10.0) {
            assert!(!found.contains(&at));
            found.push(at);
        }
        assert!((3..=8).contains(&found.len()), "{found:?}");
        let corner = about((98.0, 2.0), 5.0, 20.0, 10.0);
        let at = page.find(&corner, 20.0, 10.0).unwrap();
        assert!(at.0 < 80.0 && at.1 > 7.0, "{at:?}");
    }

    #[test]
    fn where_all_is_taken_the_least_covered_place_is_best() {
        let mut page = Page::new(Taken::new((0.0, 0.0), (100.0, 100.0)));
        page.take(Taken::new((0.0, 0.0), (60.0, 100.0)));
        page.take_line((60.0, 50.0), (100.0, 50.0));
        let places = [(10.0, 50.0), (70.0, 52.0)];
        assert_eq!(page.find(&places, 20.0, 10.0), None);
        assert_eq!(page.find_best(&places, 20.0, 10.0), Some((70.0, 52.0)));
        assert_eq!(page.find_best(&[(95.0, 50.0)], 20.0, 10.0), None);
    }
}
