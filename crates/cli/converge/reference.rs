//! What pictures are held against: made of two that know nothing of each other, given, or kept from an earlier run.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context;
use raytree::{CompareOptions, Picture, compare};
use raytree_converge::{Bvh, Errors, MadeBy, Model, OracleCheck, Reference, Setting};

use crate::converge::args::OracleChoice;
use crate::converge::cache;
use crate::converge::lab::Lab;
use crate::converge::oracle::{Judge, Verdict};
use crate::failure::Usage;

/// A reference needs so many times the samples of the pictures that it judges: its error, falling as N^-0.75 and halved by the mean
/// of two, is then a quarter of theirs.
const SAMPLES: f64 = 3.5;

/// Error of a sample a pixel where edges are all over, about.
const EDGES: f64 = 0.15;

/// What both may take. Trees of glass among mirrors grow without end: there the reference goes no deeper than the sweep, and what that
/// leaves out is in its error.
const AFFORDABLE: Duration = Duration::from_secs(75);

/// What the picture that tells what deeper trees would change may take.
const TRUNCATION: Duration = Duration::from_secs(10);

/// Samples a pixel of the pictures that tell what deeper trees would change.
const TRUNCATION_SPP: u32 = 4;

/// How a reference is to be made: beyond all that the sweep asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Two different numbers, each the square of a whole one, whose patterns are the best (crates/film/sampling.rs).
    samples: [u32; 2],
    /// The sweep's.
    depth: u32,
    /// The sweep's.
    min_weight: f64,
    oracle: OracleChoice,
}

/// How far the rays of a reference are followed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Reach {
    depth: u32,
    min_weight: f64,
    shading: Model,
}

impl Reach {
    fn setting(&self, spp: u32) -> Setting {
        Setting {
            depth: self.depth,
            min_weight: self.min_weight,
            spp,
            tolerance: None,
            bvh: Bvh::Balanced,
            shading: self.shading,
        }
    }

    fn scaled(&self, depth: u32, weight: f64) -> Self {
        Self {
            depth: (depth * self.depth).min(1024),
            min_weight: weight * self.min_weight,
            ..*self
        }
    }
}

impl Plan {
    pub fn beyond(settings: &[Setting], least_spp: Option<u32>, oracle: OracleChoice) -> Self {
        let most = settings.iter().map(samples_alike).max().unwrap_or(1);
        let least = least_spp.map_or(SAMPLES * f64::from(most), f64::from);
        // 8192 samples are the most that can be had: 89 and 90 squared.
        let root = (least.sqrt().ceil() as u32).clamp(2, 89);
        // A tolerance decides them by itself.
        let fixed = || settings.iter().filter(|s| s.tolerance.is_none());
        let depth = fixed()
            .map(|s| s.depth)
            .max()
            .unwrap_or(2 * Setting::default().depth);
        let weights = fixed().map(|s| s.min_weight);
        let least_weight = weights
            .reduce(f64::min)
            .unwrap_or(Setting::default().min_weight);
        Self {
            samples: [root * root, (root + 1) * (root + 1)],
            depth: depth.max(4),
            min_weight: least_weight,
            oracle,
        }
    }

    /// What it says, for the names of what is kept.
    pub fn key(&self) -> String {
        format!("{self:?}")
    }

    /// How many samples a pixel have to be rendered.
    pub fn samples(&self) -> u32 {
        self.samples.iter().sum()
    }

    /// The farthest that is affordable; twice as deep as the sweep and down to half its least weight if that is.
    fn reach(&self, lab: &mut Lab<'_>, shading: Model) -> anyhow::Result<Reach> {
        let sweeps = Reach {
            depth: self.depth,
            min_weight: self.min_weight,
            shading,
        };
        for (depth, weight) in [(2, 0.5), (2, 1.0), (1, 0.5)] {
            let reach = sweeps.scaled(depth, weight);
            let limit = AFFORDABLE / self.samples();
            if lab.picture_within(&reach.setting(1), limit)?.is_some() {
                return Ok(reach);
            }
        }
        Ok(sweeps)
    }
}

/// Samples a pixel; of a tolerance, as many as its error is to be had with where edges are all over.
fn samples_alike(setting: &Setting) -> u32 {
    match setting.tolerance {
        Some(error) => (EDGES / error).powf(4.0 / 3.0).clamp(1.0, 512.0) as u32,
        None => setting.spp,
    }
}

/// A reference and its picture.
pub struct Truth {
    pub reference: Reference,
    pub picture: Picture,
}

/// From the cache, or made and kept; `warn` is told of a cache that does not work.
pub fn kept_or_made(
    lab: &mut Lab<'_>,
    plan: &Plan,
    shading: Model,
    key: &str,
    warn: &dyn Fn(&str),
) -> anyhow::Result<(Truth, bool)> {
    let key = format!("{key}; {} {shading}", plan.key());
    let region = lab.base.visible_region();
    match cache::load(&key) {
        Ok(Some((reference, picture)))
            if (picture.width, picture.height) == (region.width, region.height) =>
        {
            return Ok((Truth { reference, picture }, true));
        }
        Ok(_) => {}
        Err(problem) => warn(&format!(
            "warning: the kept reference is made again: {problem}"
        )),
    }
    let truth = make(lab, plan, shading)?;
    if let Err(problem) = cache::store(&key, &truth.reference, &truth.picture) {
        warn(&format!("warning: the reference is not kept: {problem}"));
    }
    Ok((truth, false))
}

fn make(lab: &mut Lab<'_>, plan: &Plan, shading: Model) -> anyhow::Result<Truth> {
    let [few, many] = plan.samples;
    let reach = plan.reach(lab, shading)?;
    let first = lab.picture(&reach.setting(few))?;
    let judge = Judge::new(lab, &reach.setting(few), plan.oracle);
    let verdict = judge.judge(&first, many)?;
    let (second, made_by, oracle) = match verdict {
        Verdict::Picture(picture) => (picture, MadeBy::OracleAndOurselves, None),
        Verdict::Check((share, rmse)) => {
            let check = OracleCheck { share, rmse };
            let ours = lab.picture(&reach.setting(many))?;
            (ours, MadeBy::Ourselves, Some(check))
        }
        Verdict::NotAsked => (lab.picture(&reach.setting(many))?, MadeBy::Ourselves, None),
    };
    Ok(Truth {
        reference: Reference {
            shading,
            made_by,
            samples: vec![few, many],
            depth: reach.depth,
            min_weight: reach.min_weight,
            agreement: Some(errors(&first, &second)?),
            truncation: truncation(lab, &reach)?,
            oracle,
        },
        picture: mean(&first, &second),
    })
}

/// By how much twice the depth and a tenth of the least weight change the same samples; half of the latter where that takes too
/// long. `None`: that does too.
fn truncation(lab: &mut Lab<'_>, reach: &Reach) -> anyhow::Result<Option<Errors>> {
    for weight in [0.1, 0.5] {
        let deeper = reach.scaled(2, weight).setting(TRUNCATION_SPP);
        if let Some(deep) = lab.picture_within(&deeper, TRUNCATION)? {
            let shallow = lab.picture(&reach.setting(TRUNCATION_SPP))?;
            return errors(&deep, &shallow).map(Some);
        }
    }
    Ok(None)
}

/// Pictures of two files, or of one whose error nobody knows.
pub fn given(files: &[PathBuf], shading: Model, size: (u32, u32)) -> anyhow::Result<Truth> {
    let (first, others) = files.split_first().context("no reference is given")?;
    let picture = read(first, size)?;
    let reference = |agreement| Reference {
        shading,
        made_by: MadeBy::Given,
        samples: Vec::new(),
        depth: 0,
        min_weight: 0.0,
        agreement,
        truncation: None,
        oracle: None,
    };
    match others {
        [] => Ok(Truth {
            reference: reference(None),
            picture,
        }),
        [second] => {
            let second = read(second, size)?;
            Ok(Truth {
                reference: reference(Some(errors(&picture, &second)?)),
                picture: mean(&picture, &second),
            })
        }
        _ => Err(Usage("--reference can be given once or twice".to_owned()).into()),
    }
}

fn read(path: &Path, size: (u32, u32)) -> anyhow::Result<Picture> {
    let picture = Picture::read(path)?;
    if (picture.width, picture.height) != size {
        return Err(Usage(format!(
            "{}: the reference is {}x{}, but {}x{} is rendered; give --size {}x{}",
            path.display(),
            picture.width,
            picture.height,
            size.0,
            size.1,
            picture.width,
            picture.height,
        ))
        .into());
    }
    Ok(picture)
}

/// Against the truth, nothing clipped, FLIP included.
pub fn errors(truth: &Picture, picture: &Picture) -> anyhow::Result<Errors> {
    let options = CompareOptions {
        clip: false,
        thresholds: Vec::new(),
        flip: true,
    };
    let comparison = compare(truth, picture, &options)?;
    if comparison.non_finite > 0 {
        anyhow::bail!(
            "{} pixels are not finite: no error can be told of such a picture",
            comparison.non_finite
        );
    }
    Ok(Errors::from(&comparison))
}

/// Of pictures of one size.
fn mean(a: &Picture, b: &Picture) -> Picture {
    let middle = |a: f32, b: f32| (0.5 * (f64::from(a) + f64::from(b))) as f32;
    let rgb = a.rgb.iter().zip(&b.rgb);
    let alpha = a.alpha.iter().zip(&b.alpha);
    Picture {
        rgb: rgb
            .map(|(a, b)| [0, 1, 2].map(|c| middle(a[c], b[c])))
            .collect(),
        alpha: alpha
            .map(|(a, b)| a.iter().zip(b).map(|(a, b)| middle(*a, *b)).collect())
            .next(),
        ..a.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reference_goes_beyond_the_sweep() {
        let setting = Setting {
            spp: 32,
            depth: 16,
            ..Setting::default()
        };
        let plan = Plan::beyond(&[Setting::default(), setting], None, OracleChoice::Auto);
        assert_eq!(plan.samples, [121, 144]);
        assert_eq!((plan.depth, plan.min_weight), (16, 1.0 / 256.0));
        let reach = Reach {
            depth: 700,
            min_weight: 1e-3,
            shading: Model::Pbr,
        };
        let deeper = reach.scaled(2, 0.5).setting(4);
        assert_eq!((deeper.depth, deeper.min_weight), (1024, 5e-4));
        let least = Plan::beyond(&[setting], Some(4), OracleChoice::Auto);
        assert_eq!(least.samples, [4, 9]);
        let most = Setting {
            spp: 8192,
            depth: 1024,
            min_weight: 0.0,
            ..setting
        };
        let plan = Plan::beyond(&[most], None, OracleChoice::Never);
        assert!(plan.samples[1] <= 8192);
        assert_eq!((plan.depth, plan.min_weight), (1024, 0.0));
    }
}
