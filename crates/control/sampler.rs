//! Orders samples until the tolerance is kept.

use std::cell::LazyCell;

use raytree_film::Estimates;

use crate::allocation::{Candidate, threshold};
use crate::calibration::{Calibration, LEVELS, Losses};
use crate::estimate::{Picture, difference, factor_of, over_channels};
use crate::finished::{Finished, show_neighbours};
use crate::grid::Grid;
use crate::negligible::{FIRST_GUESS, Negligible, correction};
use crate::pixel::{Lists, Pixels, Sampled, Singles, level_after, level_of};
use crate::report::Totals;
use crate::round::{Order, Refinement, Round};
use crate::standing::{Standing, root_mean_square};
use crate::tolerance::{LOSS_SHARE, Tolerance};

/// What pictures may be off by at first where they come near the tolerance in steps, linear radiance.
const FIRST_GOAL: f32 = 0.25;

/// Of what was negligible at first, what is negligible when that is judged.
const PROBE: f32 = 1.0 / 8.0;

/// Of the goal, what may be lost before single samples are taken again, and how often each may be.
const MOST_LOSS: f32 = 0.8;
const MOST_RETAKES: u8 = 4;

/// Of what camera rays bring, the least that is said of branches.
const LEAST_BROUGHT: f32 = 0.25;

/// Of what was negligible for first samples, the least that is later.
const LEAST_NEGLIGIBLE: f32 = 1.0 / 64.0;

/// What pixels show as long as nothing is known: a dark grey.
const ASSUMED_RADIANCE: f32 = 0.1;

/// Of the square of what samples may be off by, what is aimed at, so that the last round is not one too few.
const MARGIN: f64 = 0.95;

/// What is known of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Nothing: a few pixels get a sample, and the same again with less left out of it, to see what branches bring.
    Pilot,
    /// What is negligible: each pixel gets one, which counts.
    First,
    /// Where it is off.
    Refining,
}

/// The order in which pixels are gone through, each once: made when it is first needed, since pictures that one sample of each pixel is
/// good enough for need none.
type Sequence = LazyCell<Vec<u32>, Box<dyn FnOnce() -> Vec<u32>>>;

/// Decides sample by sample, for a picture and a tolerance.
#[derive(Debug)]
pub struct Sampler {
    grid: Grid,
    tolerance: Tolerance,
    /// The highest level of a pixel.
    most: u32,
    /// All pixels in the order in which they are ordered.
    sequence: Sequence,
    pixels: Pixels,
    stage: Stage,
    round: Round,
    /// All pixels come near the tolerance together.
    is_stepwise: bool,
    is_done: bool,
    /// Standard error of each pixel, as of the last round.
    errors: Vec<f32>,
    /// What calibration has multiplied them by, at each level.
    factors: [f32; LEVELS],
    /// As of the last round.
    totals: Totals,
    calibration: Calibration,
    losses: Losses,
    /// What the picture may be off by for now, in tolerances: root mean square over its pixels.
    goal: f32,
    /// What may be left out of samples, in tolerances.
    negligible: f32,
    /// The least that is to be negligible.
    least_negligible: f32,
    /// The most that any branch of a ray tree could bring, root mean square over the channels, linear radiance.
    branch_bound: f32,
    /// What branches bring, of that.
    branch_scale: f32,
    /// .. in the mean.
    branch_mean: f32,
    /// What pixels show that have no sample yet: for tolerances that depend on it.
    assumed: f32,
}

impl Sampler {
    /// For a picture of `width` x `height` pixels that takes at most `most_samples` (at least 1) of any. `branch_bound`: the most that any
    /// branch of a ray tree could bring, root mean square over the channels, linear radiance. `alpha_counts`: who looks at the picture sees
    /// its alpha. `sequence`: the order in which pixels are gone through, each once.
    #[must_use]
    pub fn new(
        (width, height): (u32, u32),
        tolerance: Tolerance,
        most_samples: u32,
        branch_bound: f32,
        alpha_counts: bool,
        sequence: impl FnOnce() -> Vec<u32> + 'static,
    ) -> Self {
        let count = width as usize * height as usize;
        let mut sampler = Self {
            grid: Grid {
                width: width as usize,
                height: height as usize,
            },
            tolerance,
            most: level_of(most_samples),
            sequence: Sequence::new(Box::new(sequence)),
            pixels: Pixels::new(count, alpha_counts),
            stage: if branch_bound > 0.0 {
                Stage::Pilot
            } else {
                Stage::First
            },
            round: Round::default(),
            is_stepwise: false,
            is_done: false,
            errors: vec![0.0; count],
            factors: [1.0; LEVELS],
            totals: Totals::default(),
            calibration: Calibration::default(),
            losses: Losses::default(),
            goal: 1.0,
            negligible: FIRST_GUESS,
            least_negligible: 0.0,
            branch_bound,
            assumed: ASSUMED_RADIANCE,
            // A guess: what branches bring is what screens show.
            branch_scale: 1.0 / branch_bound.max(1.0),
            branch_mean: 0.0,
        };
        sampler.begin_round();
        sampler
    }

    /// All pixels come near the tolerance together, in steps that each halve their error, and each step begins with pixels all over
    /// the picture: for who may have to end before it is kept.
    #[must_use]
    pub fn stepwise(mut self) -> Self {
        self.is_stepwise = true;
        self.goal = (FIRST_GOAL / self.first_allowed()).max(1.0);
        self.negligible *= self.goal;
        // Stable, so that neighbours of a class still come together.
        let mut sequence = self.sequence.clone();
        sequence.sort_by_key(|&index| self.grid.class(index as usize));
        self.sequence = Sequence::new(Box::new(|| sequence));
        self.begin_round();
        self
    }

    /// Up to `most` samples to take next. None: all that were ordered have to come back first, or [`Self::takes_all`] asks for others; if
    /// neither, the picture is done.
    pub fn next_orders(&mut self, most: usize) -> Vec<Order> {
        self.decide();
        self.round.next_orders(most)
    }

    /// Decides what is taken next, if all that was ordered has come back: some time's work for large pictures, which
    /// [`Self::next_orders`] else does.
    pub fn decide(&mut self) {
        while self.round.is_over() && !self.is_done {
            self.end_round();
            self.learn();
            self.begin_round();
            while self.is_settled() && self.goal > 1.0 {
                self.goal = f32::max(0.5 * self.goal, 1.0);
                self.begin_round();
            }
            self.is_done = self.is_settled();
        }
    }

    /// All pixels have a sample, and none needs more for the goal.
    fn is_settled(&self) -> bool {
        self.stage == Stage::Refining && self.round.is_empty()
    }

    /// Takes what has come of an order. Those of a pixel have to come back in their order.
    pub fn take(&mut self, order: &Order, sampled: Sampled) {
        if let Some(only) = self.round.take(order, sampled) {
            self.pixels.add_sample(order.pixel as usize, only);
        }
    }

    /// Instead of orders: each pixel is to take its first sample, and this may be left out of them. `None` as soon as
    /// [`Self::first_samples`] has had all of them.
    #[must_use]
    pub fn takes_all(&self) -> Option<Negligible> {
        self.round.of_all_with()
    }

    /// Takes first samples, while [`Self::takes_all`] says so.
    pub fn first_samples(&mut self) -> FirstSamples<'_> {
        FirstSamples {
            pixels: self.pixels.singles(),
            left: self.round.left(),
        }
    }

    /// How many pixels of all are finished, as far as is known: 0 to 1.
    #[must_use]
    pub fn finished(&self) -> f64 {
        let (count, ordered) = self.round.progress();
        let left = count as f64 - 0.5 * ordered as f64;
        match self.stage {
            Stage::Pilot => 0.0,
            Stage::First | Stage::Refining => 1.0 - left / self.pixels.len().max(1) as f64,
        }
    }

    /// What branches bring as far as is known, of the most that any could: orders are to be carried out by that.
    #[must_use]
    pub fn branch_scale(&self) -> f32 {
        self.branch_scale
    }

    /// What they bring in the mean, which is to be shown where one is left out. Of the most that any could; 0 as long as it is not known.
    #[must_use]
    pub fn branch_mean(&self) -> f32 {
        self.branch_mean
    }

    /// What is ordered serves to see what branches bring: no lights are to be left out of it, and it is not shown.
    #[must_use]
    pub fn is_trying(&self) -> bool {
        self.stage == Stage::Pilot
    }

    fn standing(&self, index: usize) -> Standing {
        let allowed = self.pixels.allowed(index, self.tolerance);
        Standing {
            error: self.errors[index] / allowed,
            lost: self.pixels.lost(index) / allowed,
            allowed,
        }
    }

    fn standings(&self) -> impl ExactSizeIterator<Item = Standing> {
        (0..self.pixels.len()).map(|index| self.standing(index))
    }

    /// What refining a pixel would change, and cost.
    fn candidate(&self, index: usize, standing: Standing) -> Candidate {
        Candidate {
            square: standing.error * standing.error,
            rays: self.pixels.rays(index).max(1),
        }
    }

    /// Chooses the pixels that are refined next.
    fn begin_round(&mut self) {
        self.round = match self.stage {
            Stage::Pilot => Round::new(self.pilots()),
            Stage::First => self.all(),
            Stage::Refining => Round::new(self.refinements()),
        };
    }

    /// A sample of each pilot, and the same again with less left out.
    fn pilots(&self) -> Vec<Refinement> {
        let allowed = self.negligible * self.first_allowed();
        let each = [1.0, PROBE].map(|share| Negligible::below(share * allowed));
        let pilots = self
            .sequence
            .iter()
            .filter(|&&index| self.grid.is_pilot(index as usize));
        let samples = |&index: &u32| each.map(|negligible| Refinement::first(index, negligible));
        pilots.flat_map(samples).collect()
    }

    /// A sample of each pixel. Of pilots too: in theirs the mean of what was left out is not shown.
    fn all(&self) -> Round {
        let negligible = Negligible::below(self.negligible * self.first_allowed());
        if self.is_stepwise {
            Round::of_singles(self.sequence.clone(), negligible)
        } else {
            Round::of_all(self.pixels.len(), negligible)
        }
    }

    /// Of pixels that all have a sample, those that need more, if the picture does.
    fn refinements(&self) -> Vec<Refinement> {
        let goal = f64::from(self.goal);
        // With one sample each, pixels have all that they may have.
        let is_final = self.most == 0 && self.totals.lost() <= goal;
        if self.totals.all() <= goal || is_final {
            return Vec::new();
        }
        let lost = self.totals.lost();
        let most_lost = f64::from(MOST_LOSS) * goal;
        let wanted = MARGIN * (goal.powi(2) - lost.min(most_lost).powi(2));
        let candidates = (0..).zip(self.standings()).map(|(index, standing)| {
            let is_final = level_after(self.pixels.count(index)) > self.most;
            (self.candidate(index, standing), is_final)
        });
        let threshold = threshold(candidates, wanted * self.pixels.len() as f64);
        let chosen = |&index: &u32| {
            let standing = self.standing(index as usize);
            let worth = self.candidate(index as usize, standing).worth();
            let is_wanted = threshold.is_some_and(|threshold| worth > threshold);
            let refined = is_wanted
                .then(|| self.next_level(index, standing))
                .flatten();
            let retake = || (lost > most_lost).then(|| self.retake(index, standing));
            refined.or_else(|| retake().flatten())
        };
        self.sequence.iter().filter_map(chosen).collect()
    }

    fn next_level(&self, index: u32, standing: Standing) -> Option<Refinement> {
        let samples = self.pixels.count(index as usize);
        let level = level_after(samples);
        (level <= self.most).then(|| Refinement {
            level,
            kept: samples,
            ..Refinement::first(index, Negligible::below(self.negligible * standing.allowed))
        })
    }

    /// A pixel's only sample once more, if it has lost too much.
    fn retake(&self, index: u32, standing: Standing) -> Option<Refinement> {
        let wanted = LOSS_SHARE * self.goal;
        let pixel = index as usize;
        let may_be = self.pixels.count(pixel) == 1 && self.pixels.retakes(pixel) < MOST_RETAKES;
        if !may_be || standing.lost <= wanted {
            return None;
        }
        let negligible = self.negligible * correction(standing.lost, wanted) * standing.allowed;
        Some(Refinement::first(index, Negligible::below(negligible)))
    }

    /// Goes on after a round: makes more or less negligible, by what was lost.
    fn learn(&mut self) {
        let wanted = LOSS_SHARE * self.goal;
        let lost = match self.stage {
            Stage::Pilot => {
                self.stage = Stage::First;
                self.weigh_branches()
            }
            Stage::First | Stage::Refining => {
                self.stage = Stage::Refining;
                self.totals.lost() as f32
            }
        };
        let negligible = self.negligible * correction(lost, wanted);
        // What trees lose that are cut off does not become less by leaving out less.
        self.negligible = negligible.max(self.least_negligible).min(wanted);
        if self.stage == Stage::First {
            self.least_negligible = LEAST_NEGLIGIBLE * self.negligible;
        }
    }

    /// From what pilots' samples differ by: what branches bring. What the first of them lost by that, in tolerances: root mean square.
    fn weigh_branches(&mut self) -> f32 {
        let before = self.branch_scale;
        self.branch_mean = (before * self.losses.mean()).min(1.0);
        let found = before * self.losses.factor();
        // Branches that weigh much were not left out, so nothing is known of them but what camera rays see.
        let least = LEAST_BROUGHT * self.brought_to_camera() / self.branch_bound;
        let scale = found.max(least).min(1.0);
        self.branch_scale = if scale > 0.0 { scale } else { before };
        let factor = self.branch_scale / before;
        self.negligible *= factor;
        self.pixels.scale_losses(factor);
        let lost = factor * self.losses.said_before() / self.first_allowed();
        self.assumed = self.dark_radiance();
        lost
    }

    /// Radiance of the pixels that have a sample.
    fn taken(&self) -> impl Iterator<Item = [f32; 3]> {
        let all = self.pixels.radiance().iter().enumerate();
        let taken = all.filter(|&(index, _)| self.pixels.count(index) > 0);
        taken.map(|(_, &radiance)| radiance)
    }

    /// What camera rays bring: root mean square over the pixels that have a sample.
    fn brought_to_camera(&self) -> f32 {
        let radiance = self.taken();
        root_mean_square(radiance.map(|[r, g, b]| over_channels([r, g, b, 0.0]))) as f32
    }

    /// A quarter of the pixels that have a sample are darker, largest channel.
    fn dark_radiance(&self) -> f32 {
        let largest = |color: [f32; 3]| color.into_iter().fold(0.0, f32::max);
        let mut found: Vec<f32> = self.taken().map(largest).collect();
        let rank = found.len() / 4;
        match found.len() {
            0 => self.assumed,
            _ => *found.select_nth_unstable_by(rank, f32::total_cmp).1,
        }
    }

    /// What a pixel may be off by of which nothing is known yet.
    fn first_allowed(&self) -> f32 {
        self.tolerance.allowed(self.assumed)
    }

    /// Adds what the round has brought, of pixels that have all of it.
    fn end_round(&mut self) {
        let round = std::mem::take(&mut self.round);
        if round.has_taken_all() {
            self.pixels.have_one_each();
        }
        for refinement in round.into_refinements() {
            if !refinement.is_complete() {
                continue;
            }
            match refinement.level {
                0 => self.retake_sample(&refinement),
                _ => self.refine(&refinement),
            }
        }
        if self.stage != Stage::Pilot {
            self.estimate();
        }
    }

    /// Puts a sample in the place of a pixel's only one, or of none.
    fn retake_sample(&mut self, refinement: &Refinement) {
        let index = refinement.pixel as usize;
        if self.stage != Stage::Pilot {
            self.pixels.retake(index, &refinement.brought);
            return;
        }
        let is_second = self.pixels.count(index) > 0;
        let (before, lost) = (self.pixels.judged(index), self.pixels.lost(index));
        self.pixels.replace(index, &refinement.brought);
        if is_second {
            let after = self.pixels.judged(index);
            let less = lost - self.pixels.lost(index);
            let differences = [0, 1, 2].map(|channel| after[channel] - before[channel]);
            let brought = differences.iter().sum::<f32>() / 3.0;
            self.losses
                .learn(lost, less, difference(before, after), brought);
        }
    }

    fn refine(&mut self, refinement: &Refinement) {
        let index = refinement.pixel as usize;
        let before = self.pixels.judged(index);
        let said = self.errors[index] / self.factors[factor_of(self.pixels.count(index))];
        let level = refinement.level;
        self.pixels.refine(index, level, &refinement.brought);
        let change = difference(before, self.pixels.judged(index));
        self.calibration.learn(level - 1, said, change);
    }

    fn estimate(&mut self) {
        self.factors = self.calibration.factors();
        let picture = Picture {
            grid: self.grid,
            pixels: &self.pixels,
            factors: self.factors,
        };
        picture.standard_errors(&mut self.errors);
        self.totals = Totals::of(&self.errors, &self.pixels, self.tolerance);
    }

    /// Ends sampling, with what there is.
    #[must_use]
    pub fn finish(mut self) -> Finished {
        if !self.is_done {
            self.end_round();
            if self.stage == Stage::Pilot {
                self.estimate();
            }
        }
        if self.totals.unsampled() > 0 {
            show_neighbours(self.grid, &mut self.pixels, &mut self.errors);
            self.totals = Totals::of(&self.errors, &self.pixels, self.tolerance);
        }
        let report = self.totals.report(self.branch_scale);
        let Lists {
            radiance,
            alpha,
            lost,
            rays,
            counts,
        } = self.pixels.into_lists();
        Finished {
            radiance,
            alpha,
            rays,
            estimates: Estimates {
                dropped: lost,
                sampling: self.errors,
                samples: counts,
            },
            report,
        }
    }
}

/// Takes the first samples of pixels, one after the other.
pub struct FirstSamples<'s> {
    pixels: Singles<'s>,
    left: &'s mut u64,
}

impl FirstSamples<'_> {
    /// Takes that of a pixel. Whatever it had is forgotten.
    #[inline]
    pub fn take(&mut self, pixel: usize, sampled: Sampled) {
        *self.left -= 1;
        self.pixels.add(pixel, sampled);
    }
}

#[cfg(test)]
#[path = "sampler_tests.rs"]
mod tests;
