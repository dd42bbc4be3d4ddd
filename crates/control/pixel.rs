//! What is known of a picture's pixels. Each has 1, 5, 9, 17, 33, ... samples (`groups.rs`).

use crate::groups::{Brought, Groups};
use crate::tolerance::Tolerance;

/// What a renderer says of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sampled {
    /// Linear radiance, and alpha from 0 to 1.
    pub radiance: [f32; 4],
    /// What branches that were left out may have added, root mean square over the channels.
    pub lost: f32,
    /// Rays that it took.
    pub rays: u32,
}

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
    match count {
        0 => 0,
        1 => 1,
        count => (count - 1).ilog2().clamp(1, 29),
    }
}

/// What is known of a picture's pixels, one list for each property: most pixels of most pictures never have more than one sample,
/// and of lists that nothing is written to no memory is touched.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pixels {
    /// Mean of the samples; 0 without any.
    radiance: Vec<[f32; 3]>,
    alpha: Vec<f32>,
    /// Who looks at the picture sees alpha.
    alpha_counts: bool,
    /// What was left out may have added as much to the mean. Empty as long as nothing was lost anywhere.
    lost: Vec<f32>,
    /// Of the samples that the mean is of.
    rays: Vec<u32>,
    /// Samples: 0, or those of a level.
    counts: Vec<u32>,
    /// From level 1 on: one more than the pixel's place in `refined`. Empty as long as that is.
    places: Vec<u32>,
    refined: Vec<Refined>,
    /// How often the only sample was taken again. Empty as long as none was.
    retakes: Vec<u8>,
}

/// A pixel with more than one sample.
#[derive(Clone, Debug, Default)]
struct Refined {
    sum: [f64; 4],
    lost: f64,
    groups: Groups,
}

impl Pixels {
    pub(crate) fn new(count: usize, alpha_counts: bool) -> Self {
        Self {
            radiance: vec![[0.0; 3]; count],
            alpha: vec![0.0; count],
            alpha_counts,
            lost: Vec::new(),
            rays: vec![0; count],
            counts: vec![0; count],
            places: Vec::new(),
            refined: Vec::new(),
            retakes: Vec::new(),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.counts.len()
    }

    /// Mean radiance of each; 0 without samples.
    pub(crate) fn radiance(&self) -> &[[f32; 3]] {
        &self.radiance
    }

    /// Alpha of each, if it counts.
    pub(crate) fn alpha(&self) -> Option<&[f32]> {
        self.alpha_counts.then_some(&self.alpha)
    }

    /// What is judged: radiance, and alpha if it counts.
    pub(crate) fn judged(&self, index: usize) -> [f32; 4] {
        let [r, g, b] = self.radiance[index];
        let alpha = if self.alpha_counts {
            self.alpha[index]
        } else {
            1.0
        };
        [r, g, b, alpha]
    }

    /// The unit of a pixel's tolerance: of its radiance, or of its alpha where that counts and is more.
    pub(crate) fn allowed(&self, index: usize, tolerance: Tolerance) -> f32 {
        let [r, g, b] = self.radiance[index];
        let alpha = self.alpha().map_or(0.0, |alpha| alpha[index]);
        tolerance.allowed(r.max(g).max(b).max(alpha))
    }

    /// What was left out may have added as much to the mean.
    pub(crate) fn lost(&self, index: usize) -> f32 {
        of_sparse(&self.lost, index)
    }

    /// That of each pixel; `None` if nothing was lost anywhere.
    pub(crate) fn losses(&self) -> Option<&[f32]> {
        (!self.lost.is_empty()).then_some(&self.lost)
    }

    /// Samples of each.
    pub(crate) fn counts(&self) -> &[u32] {
        &self.counts
    }

    /// Samples: 0, or those of a level.
    pub(crate) fn count(&self, index: usize) -> u32 {
        self.counts[index]
    }

    pub(crate) fn rays(&self, index: usize) -> u32 {
        self.rays[index]
    }

    /// How often its only sample was taken again.
    pub(crate) fn retakes(&self, index: usize) -> u8 {
        of_sparse(&self.retakes, index)
    }

    /// Any has more than one sample.
    pub(crate) fn any_refined(&self) -> bool {
        !self.refined.is_empty()
    }

    /// Of its mean, from what its groups say; `None` below level 1.
    pub(crate) fn variance(&self, index: usize) -> Option<f32> {
        let place = of_sparse(&self.places, index).checked_sub(1)?;
        Some(self.refined[place as usize].groups.variance)
    }

    /// Takes a pixel's first sample.
    pub(crate) fn add_sample(&mut self, index: usize, sampled: Sampled) {
        self.singles().add(index, sampled);
        self.counts[index] = 1;
    }

    /// [`Self::singles`] were given to all pixels.
    pub(crate) fn have_one_each(&mut self) {
        self.counts.fill(1);
    }

    /// Lists of what first samples bring.
    pub(crate) fn singles(&mut self) -> Singles<'_> {
        // One length for all, so that one check is enough for each pixel.
        let count = self.counts.len();
        Singles {
            radiance: &mut self.radiance[..count],
            alpha: &mut self.alpha[..count],
            lost: &mut self.lost,
            rays: &mut self.rays[..count],
        }
    }

    /// Puts a sample in the place of the only one, or of none.
    pub(crate) fn replace(&mut self, index: usize, brought: &Brought) {
        self.show(index, brought.sum.map(|value| value as f32));
        self.set_lost(index, brought.lost as f32);
        self.rays[index] = brought.rays;
        self.counts[index] = 1;
    }

    /// .. because that has lost too much.
    pub(crate) fn retake(&mut self, index: usize, brought: &Brought) {
        let retakes = self.retakes(index) + 1;
        set_sparse(&mut self.retakes, self.counts.len(), index, retakes);
        self.replace(index, brought);
    }

    /// Adds what has brought a pixel to `level`, from 1 on.
    pub(crate) fn refine(&mut self, index: usize, level: u32, brought: &Brought) {
        if of_sparse(&self.places, index) == 0 {
            let [r, g, b] = self.radiance[index].map(f64::from);
            self.refined.push(Refined {
                sum: [r, g, b, self.alpha[index].into()],
                lost: self.lost(index).into(),
                groups: Groups::default(),
            });
            let place = self.refined.len() as u32;
            set_sparse(&mut self.places, self.counts.len(), index, place);
        }
        let refined = &mut self.refined[self.places[index] as usize - 1];
        for (sum, more) in refined.sum.iter_mut().zip(brought.sum) {
            *sum += more;
        }
        refined.lost += brought.lost;
        refined.groups.add(level, brought, self.alpha_counts);
        self.counts[index] += brought.count;
        self.rays[index] = self.rays[index].saturating_add(brought.rays);
        let share = f64::from(self.counts[index]).recip();
        let (mean, lost) = (refined.sum.map(|sum| (sum * share) as f32), refined.lost);
        self.show(index, mean);
        self.set_lost(index, (lost * share) as f32);
    }

    /// Shows as much: radiance and alpha.
    pub(crate) fn show(&mut self, index: usize, [r, g, b, alpha]: [f32; 4]) {
        self.radiance[index] = [r, g, b];
        self.alpha[index] = alpha;
    }

    /// What it shows.
    pub(crate) fn mean(&self, index: usize) -> [f32; 4] {
        let [r, g, b] = self.radiance[index];
        [r, g, b, self.alpha[index]]
    }

    fn set_lost(&mut self, index: usize, lost: f32) {
        set_sparse(&mut self.lost, self.counts.len(), index, lost);
    }

    /// Where losses are weighed anew, of pixels that have a single sample at most.
    pub(crate) fn scale_losses(&mut self, factor: f32) {
        self.lost.iter_mut().for_each(|lost| *lost *= factor);
    }

    pub(crate) fn into_lists(mut self) -> Lists {
        self.lost.resize(self.counts.len(), 0.0);
        Lists {
            radiance: self.radiance,
            alpha: self.alpha,
            lost: self.lost,
            rays: self.rays,
            counts: self.counts,
        }
    }
}

/// Of a list that is empty as long as all of it is 0.
fn of_sparse<T: Copy + Default>(list: &[T], index: usize) -> T {
    list.get(index).copied().unwrap_or_default()
}

fn set_sparse<T: Copy + Default + PartialEq>(
    list: &mut Vec<T>,
    count: usize,
    index: usize,
    value: T,
) {
    if list.is_empty() && value != T::default() {
        list.resize(count, T::default());
    }
    if let Some(entry) = list.get_mut(index) {
        *entry = value;
    }
}

/// Where the first samples of pixels go, but for their number.
pub(crate) struct Singles<'p> {
    radiance: &'p mut [[f32; 3]],
    alpha: &'p mut [f32],
    lost: &'p mut Vec<f32>,
    rays: &'p mut [u32],
}

impl Singles<'_> {
    #[inline]
    pub(crate) fn add(&mut self, index: usize, sampled: Sampled) {
        let [r, g, b, alpha] = sampled.radiance;
        self.radiance[index] = [r, g, b];
        self.alpha[index] = alpha;
        self.rays[index] = sampled.rays;
        set_sparse(self.lost, self.rays.len(), index, sampled.lost);
    }
}

/// What remains of pixels when all is done.
pub(crate) struct Lists {
    pub(crate) radiance: Vec<[f32; 3]>,
    pub(crate) alpha: Vec<f32>,
    pub(crate) lost: Vec<f32>,
    pub(crate) rays: Vec<u32>,
    pub(crate) counts: Vec<u32>,
}
