//! What is kept of a pixel's samples: their sum, and the sums of a few groups of them that are alike but for chance.
//!
//! Samples come in the order of [`progressive_pattern`](raytree_film::progressive_pattern): the middle, then pairs that mirror each other. A
//! pixel has 1, 5, 9, 17, 33, ... of them: the middle and `m` pairs, `m` a power of two from 2 on. The pairs make four groups of equal
//! size, each a run of the sequence and spread over the filter as all of them are: the inner half of the pairs and the outer half, and
//! of each half the samples on the one side and on the other. What is said by one group can be compared with the others. (Not whole
//! pairs: to an edge through the middle all of them say the same.)

/// What a renderer says of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sampled {
    /// Linear radiance and alpha.
    pub radiance: [f32; 4],
    /// What branches that were left out may have added, root mean square over the channels.
    pub lost: f32,
    /// Rays that it took.
    pub rays: u32,
}

/// Groups that are compared.
pub(crate) const GROUPS: usize = 4;

/// Samples of a pixel after as many doublings, from none.
pub(crate) fn samples_at(level: u32) -> u32 {
    match level {
        0 => 1,
        level => 1 + (2 << level),
    }
}

/// The level of a pixel with as many samples, or the highest that has no more.
pub(crate) fn level_of(count: u32) -> u32 {
    level_after(count).saturating_sub(1)
}

/// The level after that.
pub(crate) fn level_after(count: u32) -> u32 {
    (0..29)
        .find(|&level| samples_at(level) > count)
        .unwrap_or(29)
}

/// Samples of which a group consists, at a level from 1 on.
fn group_size(level: u32) -> u32 {
    (2 << level) / GROUPS as u32
}

/// A pixel's samples so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pixel {
    sum: [f64; 4],
    lost: f64,
    pub(crate) rays: u32,
    /// Samples: 0, or those of a level.
    pub(crate) count: u32,
    /// Which of the refined pixels it is, from level 1 on.
    pub(crate) refined: Option<u32>,
    /// How often its only sample was taken again.
    pub(crate) retakes: u8,
}

impl Pixel {
    /// Mean radiance and alpha; 0 without samples.
    pub(crate) fn mean(&self) -> [f32; 4] {
        let share = f64::from(self.count.max(1)).recip();
        self.sum.map(|sum| (sum * share) as f32)
    }

    /// Its first three.
    pub(crate) fn radiance(&self) -> [f32; 3] {
        let [r, g, b, _] = self.mean();
        [r, g, b]
    }

    /// What was left out may have added as much to the mean.
    pub(crate) fn lost(&self) -> f32 {
        (self.lost / f64::from(self.count.max(1))) as f32
    }

    /// Where losses are weighed anew.
    pub(crate) fn scale_loss(&mut self, factor: f32) {
        self.lost *= f64::from(factor);
    }

    /// Puts another sample in the place of the only one.
    pub(crate) fn retake(&mut self, brought: &Brought) {
        *self = Self {
            rays: self.rays,
            retakes: self.retakes + 1,
            ..Self::default()
        };
        self.add(brought);
    }

    /// Takes its first sample.
    pub(crate) fn add_sample(&mut self, sampled: Sampled) {
        self.sum = sampled.radiance.map(f64::from);
        self.lost = f64::from(sampled.lost);
        self.rays = sampled.rays;
        self.count = 1;
    }

    /// Adds what a round has brought.
    pub(crate) fn add(&mut self, brought: &Brought) {
        for (sum, more) in self.sum.iter_mut().zip(brought.sum) {
            *sum += more;
        }
        self.lost += brought.lost;
        self.rays = self.rays.saturating_add(brought.rays);
        self.count += brought.count;
    }
}

/// The groups of a pixel that has more than one sample: the inner pairs' first and second samples, and the outer pairs'.
#[derive(Clone, Debug, Default)]
pub(crate) struct Groups {
    sums: [[f64; 3]; GROUPS],
    /// Of the mean, averaged over the channels: what the groups say of each other.
    pub(crate) variance: f32,
}

/// What a round brings to a pixel that goes from one level to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct Brought {
    sum: [f64; 4],
    lost: f64,
    rays: u32,
    count: u32,
    groups: [[f64; 3]; GROUPS],
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
    pub(crate) fn add(&mut self, level: u32, brought: &Brought) {
        if level > 1 {
            // The inner groups are now what was inner and outer before.
            let [a, b, c, d] = self.sums;
            self.sums = [sum(a, c), sum(b, d), [0.0; 3], [0.0; 3]];
        }
        for (group, more) in self.sums.iter_mut().zip(brought.groups) {
            *group = sum(*group, more);
        }
        self.variance = self.variance_of_mean(level) as f32;
    }

    /// As if the groups were drawn independently of each other.
    fn variance_of_mean(&self, level: u32) -> f64 {
        let size = f64::from(group_size(level));
        let groups = GROUPS as f64;
        let of_channel = |channel: usize| {
            let values = self.sums.map(|sum| sum[channel] / size);
            let mean = values.iter().sum::<f64>() / groups;
            let spread: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
            spread / (groups * (groups - 1.0))
        };
        (0..3).map(of_channel).sum::<f64>() / 3.0
    }
}

fn sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}
