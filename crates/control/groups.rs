//! What is kept of a pixel's samples: their sum, and the sums of a few groups of them that are alike but for chance.
//!
//! Samples come in the order of [`progressive_pattern`](raytree_film::progressive_pattern): the middle, then pairs that mirror each other. A
//! pixel has 1, 5, 9, 17, 33, ... of them: the middle and `m` pairs, `m` a power of two from 2 on. The pairs make four groups of equal
//! size, each a run of the sequence and spread over the filter as all of them are: the inner half of the pairs and the outer half, and
//! of each half the samples on the one side and on the other. What is said by one group can be compared with the others. (Not whole
//! pairs: to an edge through the middle all of them say the same.)

use crate::pixel::{Sampled, samples_at};

/// Groups that are compared.
pub(crate) const GROUPS: usize = 4;

/// Samples of which a group consists, at a level from 1 on.
fn group_size(level: u32) -> u32 {
    (2 << level) / GROUPS as u32
}

/// The groups of a pixel that has more than one sample: the inner pairs' first and second samples, and the outer pairs'.
#[derive(Clone, Debug, Default)]
pub(crate) struct Groups {
    sums: [[f64; 4]; GROUPS],
    /// Of the mean, averaged over the colour channels, or alpha's where that counts and is more: what the groups say of each other.
    pub(crate) variance: f32,
}

/// What a round brings to a pixel that goes from one level to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct Brought {
    pub(crate) sum: [f64; 4],
    pub(crate) lost: f64,
    pub(crate) rays: u32,
    pub(crate) count: u32,
    groups: [[f64; 4]; GROUPS],
}

impl Brought {
    /// Takes sample `sample` of a pixel on its way to `level`.
    pub(crate) fn take(&mut self, level: u32, sample: u32, sampled: Sampled) {
        let radiance = sampled.radiance.map(f64::from);
        for (sum, value) in self.sum.iter_mut().zip(radiance) {
            *sum += value;
        }
        self.lost += f64::from(sampled.lost);
        self.rays = self.rays.saturating_add(sampled.rays);
        self.count += 1;
        if let Some(paired) = sample.checked_sub(1) {
            let (pair, side) = (paired / 2, paired % 2);
            let is_outer = pair >= group_size(level);
            let group = 2 * usize::from(is_outer) + side as usize;
            for (sum, value) in self.groups[group].iter_mut().zip(radiance) {
                *sum += value;
            }
        }
    }

    /// It has all that takes a pixel from `count` samples to `level`.
    pub(crate) fn is_complete(&self, count: u32, level: u32) -> bool {
        count + self.count == samples_at(level)
    }
}

impl Groups {
    /// Adds what has brought the pixel to `level`, from 1 on.
    pub(crate) fn add(&mut self, level: u32, brought: &Brought, alpha_counts: bool) {
        if level > 1 {
            // The inner groups are now what was inner and outer before.
            let [a, b, c, d] = self.sums;
            self.sums = [sum(a, c), sum(b, d), [0.0; 4], [0.0; 4]];
        }
        for (group, more) in self.sums.iter_mut().zip(brought.groups) {
            *group = sum(*group, more);
        }
        self.variance = self.variance_of_mean(level, alpha_counts) as f32;
    }

    /// As if the groups were drawn independently of each other.
    fn variance_of_mean(&self, level: u32, alpha_counts: bool) -> f64 {
        let size = f64::from(group_size(level));
        let groups = GROUPS as f64;
        let of_channel = |channel: usize| {
            let values = self.sums.map(|sum| sum[channel] / size);
            let mean = values.iter().sum::<f64>() / groups;
            let spread: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
            spread / (groups * (groups - 1.0))
        };
        let color = (0..3).map(of_channel).sum::<f64>() / 3.0;
        if alpha_counts {
            color.max(of_channel(3))
        } else {
            color
        }
    }
}

fn sum(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [0, 1, 2, 3].map(|channel| a[channel] + b[channel])
}
