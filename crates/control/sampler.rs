//! Orders samples until the tolerance is kept.

use raytree_film::Estimates;

use crate::allocation::threshold;
use crate::calibration::{Calibration, Losses};
use crate::estimate::{Picture, over_channels};
use crate::negligible::{FIRST_GUESS, Negligible, correction};
use crate::pixel::{Groups, Pixel, Sampled, level_after, level_of};
use crate::report::ErrorReport;
use crate::round::{Order, Refinement, Round};
use crate::standing::{LEAST_ALLOWED, Standing, root_mean_square};
use crate::tolerance::{LOSS_SHARE, Tolerance};

/// What pictures may be off by at first where they come near the tolerance in steps, linear radiance.
const FIRST_GOAL: f32 = 0.25;

/// Pixels from one pilot to the next, along rows and columns; half of it in pictures with fewer pixels than these.
const PILOT_STEP: usize = 8;
const SMALL_PICTURE: usize = 1 << 16;

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
    /// What is negligible: all others get theirs.
    First,
    /// Where it is off.
    Refining,
}

/// Decides sample by sample, for a picture and a tolerance.
#[derive(Debug)]
pub struct Sampler {
    width: usize,
    height: usize,
    tolerance: Tolerance,
    /// The highest level of a pixel.
    most: u32,
    /// All pixels in the order in which they are ordered.
    sequence: Vec<u32>,
    pixels: Vec<Pixel>,
    groups: Vec<Groups>,
    stage: Stage,
    round: Round,
    is_done: bool,
    /// Standard error of each pixel, as of the last round, as it is before and after calibration.
    raw_errors: Vec<f32>,
    errors: Vec<f32>,
    /// Of each pixel, as of the last round.
    standings: Vec<Standing>,
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
    /// What pixels show that have no sample yet: for tolerances that depend on it.
    assumed: f32,
}

impl Sampler {
    /// For a picture of `width` x `height` pixels that takes at most `most_samples` (at least 1) of any. `branch_bound`: the most that any
    /// branch of a ray tree could bring, root mean square over the channels, linear radiance. `sequence`: the order in which pixels are
    /// gone through, each once.
    #[must_use]
    pub fn new(
        (width, height): (u32, u32),
        tolerance: Tolerance,
        most_samples: u32,
        branch_bound: f32,
        sequence: Vec<u32>,
    ) -> Self {
        let count = width as usize * height as usize;
        let mut sampler = Self {
            width: width as usize,
            height: height as usize,
            tolerance,
            most: level_of(most_samples),
            sequence,
            pixels: vec![Pixel::default(); count],
            groups: Vec::new(),
            stage: if branch_bound > 0.0 {
                Stage::Pilot
            } else {
                Stage::First
            },
            round: Round::default(),
            is_done: false,
            raw_errors: vec![0.0; count],
            errors: vec![0.0; count],
            standings: Vec::new(),
            calibration: Calibration::default(),
            losses: Losses::default(),
            goal: 1.0,
            negligible: FIRST_GUESS,
            least_negligible: 0.0,
            branch_bound,
            assumed: ASSUMED_RADIANCE,
            // A guess: what branches bring is what screens show.
            branch_scale: 1.0 / branch_bound.max(1.0),
        };
        sampler.begin_round();
        sampler
    }

    /// All pixels come near the tolerance together, in steps that each halve their error, and each step begins with pixels all over
    /// the picture: for who may have to end before it is kept.
    #[must_use]
    pub fn stepwise(mut self) -> Self {
        self.goal = (FIRST_GOAL / self.first_allowed()).max(1.0);
        self.negligible *= self.goal;
        let width = self.width;
        let class = |index: u32| {
            let (x, y) = (index as usize % width, index as usize / width);
            [4, 2]
                .iter()
                .filter(|&step| x % step != 0 || y % step != 0)
                .count()
        };
        // Stable, so that neighbours of a class still come together.
        self.sequence.sort_by_key(|&index| class(index));
        self.begin_round();
        self
    }

    /// Up to `most` samples to take next. None: all that were ordered have to come back first, and if they have, the picture is done.
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
            self.pixels[order.pixel as usize].add_sample(only);
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

    /// Lights may be left out of these orders too. Not while it is tried what branches bring.
    #[must_use]
    pub fn may_leave_out_lights(&self) -> bool {
        self.stage != Stage::Pilot
    }

    fn allowed(&self, radiance: [f32; 3]) -> f32 {
        self.tolerance.allowed(radiance).max(LEAST_ALLOWED)
    }

    fn standing(&self, index: usize, pixel: &Pixel) -> Standing {
        let allowed = self.allowed(pixel.radiance());
        Standing {
            error: self.errors[index] / allowed,
            lost: pixel.lost() / allowed,
            samples: pixel.count,
            rays: pixel.rays.max(1),
            allowed,
        }
    }

    fn stand(&self) -> Vec<Standing> {
        let pixels = self.pixels.iter().enumerate();
        pixels
            .map(|(index, pixel)| self.standing(index, pixel))
            .collect()
    }

    /// Chooses the pixels that are refined next.
    fn begin_round(&mut self) {
        self.round = match self.stage {
            Stage::Pilot => Round::new(self.pilots()),
            Stage::First => self.all_others(),
            Stage::Refining => Round::new(self.refinements()),
        };
    }

    fn pixel(&self, index: u32) -> &Pixel {
        &self.pixels[index as usize]
    }

    /// A few pixels all over the picture, which say how much samples lose.
    fn is_pilot(&self, index: u32) -> bool {
        let (x, y) = (index as usize % self.width, index as usize / self.width);
        let step = if self.pixels.len() < SMALL_PICTURE {
            PILOT_STEP / 2
        } else {
            PILOT_STEP
        };
        let place = |size: usize| (step / 2).min(size - 1);
        (x % step, y % step) == (place(self.width), place(self.height))
    }

    /// A sample of each pilot, and the same again with less left out, which counts.
    fn pilots(&self) -> Vec<Refinement> {
        let allowed = self.negligible * self.first_allowed();
        let each = [1.0, PROBE].map(|share| Negligible::below(share * allowed));
        let pilots = self.sequence.iter().filter(|&&index| self.is_pilot(index));
        let samples = |&index: &u32| each.map(|negligible| Refinement::first(index, negligible));
        pilots.flat_map(samples).collect()
    }

    /// A sample of each pixel that has none.
    fn all_others(&self) -> Round {
        let negligible = Negligible::below(self.negligible * self.first_allowed());
        let without = |index: &u32| self.pixel(*index).count == 0;
        Round::of_singles(
            self.sequence.iter().copied().filter(without).collect(),
            negligible,
        )
    }

    /// Of pixels that all have a sample, those that need more, if the picture does.
    fn refinements(&self) -> Vec<Refinement> {
        let standings = &self.standings;
        let goal = f64::from(self.goal);
        if root_mean_square(standings.iter().map(|standing| standing.total())) <= goal {
            return Vec::new();
        }
        let lost = root_mean_square(standings.iter().map(|standing| standing.lost));
        let most_lost = f64::from(MOST_LOSS) * goal;
        let wanted = MARGIN * (goal.powi(2) - lost.min(most_lost).powi(2));
        let candidates = standings.iter().map(|standing| {
            let is_final = level_after(standing.samples) > self.most;
            (standing.candidate(), is_final)
        });
        let threshold = threshold(candidates, wanted * standings.len() as f64);
        let chosen = |&index: &u32| {
            let standing = standings[index as usize];
            let worth = standing.candidate().worth();
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
        let level = level_after(standing.samples);
        (level <= self.most).then(|| Refinement {
            level,
            kept: standing.samples,
            ..Refinement::first(index, Negligible::below(self.negligible * standing.allowed))
        })
    }

    /// A pixel's only sample once more, if it has lost too much.
    fn retake(&self, index: u32, standing: Standing) -> Option<Refinement> {
        let wanted = LOSS_SHARE * self.goal;
        let pixel = self.pixel(index);
        if pixel.count != 1 || pixel.retakes >= MOST_RETAKES || standing.lost <= wanted {
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
                root_mean_square(self.standings.iter().map(|standing| standing.lost)) as f32
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
        let found = before * self.losses.factor();
        // Branches that weigh much were not left out, so nothing is known of them but what camera rays see.
        let least = LEAST_BROUGHT * self.brought_to_camera() / self.branch_bound;
        let scale = found.max(least).min(1.0);
        self.branch_scale = if scale > 0.0 { scale } else { before };
        let factor = self.branch_scale / before;
        self.negligible *= factor;
        self.pixels
            .iter_mut()
            .for_each(|pixel| pixel.scale_loss(factor));
        let lost = factor * self.losses.said_before() / self.first_allowed();
        self.assumed = self.dark_radiance();
        lost
    }

    /// What camera rays bring: root mean square over the pixels that have a sample.
    fn brought_to_camera(&self) -> f32 {
        let taken = self.pixels.iter().filter(|pixel| pixel.count > 0);
        let radiance = taken.map(Pixel::radiance);
        root_mean_square(radiance.map(|color| over_channels(|channel| color[channel]))) as f32
    }

    /// A quarter of the pixels that have a sample are darker, largest channel.
    fn dark_radiance(&self) -> f32 {
        let taken = self.pixels.iter().filter(|pixel| pixel.count > 0);
        let mut found: Vec<f32> = taken
            .map(|pixel| pixel.radiance().into_iter().fold(0.0, f32::max))
            .collect();
        let rank = found.len() / 4;
        match found.len() {
            0 => self.assumed,
            _ => *found.select_nth_unstable_by(rank, f32::total_cmp).1,
        }
    }

    /// What a pixel may be off by of which nothing is known yet.
    fn first_allowed(&self) -> f32 {
        self.allowed([self.assumed; 3])
    }

    /// Adds what the round has brought, of pixels that have all of it.
    fn end_round(&mut self) {
        let round = std::mem::take(&mut self.round);
        for refinement in round.into_refinements() {
            if !refinement.is_complete() {
                continue;
            }
            match (refinement.level, self.pixel(refinement.pixel).count) {
                (0, 0) => self.pixels[refinement.pixel as usize].add(&refinement.brought),
                (0, _) => self.replace(&refinement),
                _ => self.refine(&refinement),
            }
        }
        if self.stage != Stage::Pilot {
            self.estimate();
            self.standings = self.stand();
        }
    }

    /// Puts a sample in the place of a pixel's only one.
    fn replace(&mut self, refinement: &Refinement) {
        let pixel = &mut self.pixels[refinement.pixel as usize];
        let (before, lost) = (pixel.radiance(), pixel.lost());
        pixel.retake(&refinement.brought);
        if self.stage == Stage::Pilot {
            let found = difference(before, pixel.radiance());
            self.losses.learn(lost, lost - pixel.lost(), found);
        }
    }

    fn refine(&mut self, refinement: &Refinement) {
        let pixel = &mut self.pixels[refinement.pixel as usize];
        let (level, brought) = (refinement.level, &refinement.brought);
        let before = pixel.radiance();
        let index = *pixel.refined.get_or_insert_with(|| {
            self.groups.push(Groups::default());
            (self.groups.len() - 1) as u32
        });
        self.groups[index as usize].add(level, brought);
        pixel.add(brought);
        let change = difference(before, pixel.radiance());
        let said = self.raw_errors[refinement.pixel as usize];
        self.calibration.learn(level - 1, said, change);
    }

    fn estimate(&mut self) {
        let means: Vec<_> = self.pixels.iter().map(Pixel::radiance).collect();
        let picture = Picture {
            width: self.width,
            height: self.height,
            pixels: &self.pixels,
            groups: &self.groups,
            means: &means,
        };
        let rows = self.raw_errors.chunks_mut(self.width.max(1));
        rows.enumerate().for_each(|(y, row)| {
            for (x, error) in row.iter_mut().enumerate() {
                *error = picture.standard_error(x, y);
            }
        });
        let factors = self.calibration.factors();
        let pixels = self.raw_errors.iter().zip(&self.pixels);
        let errors = self.errors.iter_mut().zip(pixels);
        errors.for_each(|(error, (raw, pixel))| {
            let level = level_of(pixel.count) as usize;
            *error = raw * factors[level.min(factors.len() - 1)];
        });
    }

    /// Ends sampling, with what there is: mean radiance and alpha of each pixel.
    pub fn finish(&mut self) -> Vec<[f32; 4]> {
        if !self.is_done {
            self.end_round();
        }
        let mut means: Vec<_> = self.pixels.iter().map(Pixel::mean).collect();
        if self.pixels.iter().any(|pixel| pixel.count == 0) {
            self.fill(&mut means);
        }
        means
    }

    /// Gives pixels without a sample what one shows that is near. Of what they are off by nothing is known but how pixels differ.
    fn fill(&mut self, means: &mut [[f32; 4]]) {
        let sampled = |pixel: &Pixel| pixel.count > 0;
        let values = self
            .pixels
            .iter()
            .zip(means.iter())
            .filter(|(pixel, _)| sampled(pixel));
        let average = |channel: usize| {
            let values = values.clone().map(|(_, mean)| f64::from(mean[channel]));
            let (sum, count) =
                values.fold((0.0, 0_u64), |(sum, count), value| (sum + value, count + 1));
            (sum / count.max(1) as f64) as f32
        };
        let middle = [0, 1, 2, 3].map(average);
        let deviations = values
            .clone()
            .map(|(_, mean)| over_channels(|c| mean[c] - middle[c]));
        let spread = match values.clone().next() {
            Some(_) => root_mean_square(deviations) as f32,
            None => 1.0,
        };
        for index in 0..self.pixels.len() {
            if sampled(&self.pixels[index]) {
                continue;
            }
            let (x, y) = (index % self.width, index / self.width);
            // The classes of `stepwise`, and pilots.
            let near = [2, 4, 8].map(|step| (y - y % step) * self.width + x - x % step);
            let pilot = |step: usize| {
                let at = |place: usize, end: usize| (place - place % step + step / 2).min(end - 1);
                at(y, self.height) * self.width + at(x, self.width)
            };
            let near = near
                .into_iter()
                .chain([pilot(PILOT_STEP / 2), pilot(PILOT_STEP)]);
            let found = near.into_iter().find(|&near| sampled(&self.pixels[near]));
            means[index] = found.map_or(middle, |near| means[near]);
            self.errors[index] = spread;
        }
    }

    /// What each pixel is said to be off by, and what it took.
    #[must_use]
    pub fn estimates(&self) -> Estimates {
        Estimates {
            dropped: self.pixels.iter().map(Pixel::lost).collect(),
            sampling: self.errors.clone(),
            samples: self.pixels.iter().map(|pixel| pixel.count).collect(),
        }
    }

    /// Rays of each pixel.
    #[must_use]
    pub fn rays(&self) -> Vec<u32> {
        self.pixels.iter().map(|pixel| pixel.rays).collect()
    }

    /// What was achieved.
    #[must_use]
    pub fn report(&self) -> ErrorReport {
        ErrorReport::of(&self.stand(), self.branch_scale)
    }
}

fn difference(a: [f32; 3], b: [f32; 3]) -> f32 {
    over_channels(|channel| a[channel] - b[channel])
}

#[cfg(test)]
#[path = "sampler_tests.rs"]
mod tests;
