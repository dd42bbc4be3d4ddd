//! The f64 oracle as the second witness: it makes a whole reference where it is quick enough, else it looks at some rows.

use std::time::{Duration, Instant};

use raytree::{Picture, RenderSettings, Scene, sample_pattern};
use raytree_converge::Setting;
use raytree_oracle::{Oracle, Settings};
use raytree_stress::judge::oracle_settings;

use crate::cancel;
use crate::converge::args::OracleChoice;
use crate::converge::lab::Lab;
use crate::converge::settings::render_settings;

/// It makes the whole picture if that takes no longer.
const WHOLE: Duration = Duration::from_secs(10);

/// Else it looks at as many rows as it can in this time.
const CHECK: Duration = Duration::from_secs(5);

/// Its tree takes minutes to build over more triangles.
const MOST_TRIANGLES: usize = 200_000;

/// Rows at a time: it gives every other one to another thread.
const BLOCK: u32 = 2;

/// Blocks by which its speed is estimated.
const PROBES: u32 = 4;

/// What it says.
pub enum Verdict {
    /// A whole picture.
    Picture(Picture),
    /// Share of the pixels looked at, RMSE in them.
    Check((f64, f64)),
    /// It is left out.
    NotAsked,
}

/// The oracle, its settings, and what it is asked.
pub struct Judge<'a> {
    scene: &'a Scene,
    settings: RenderSettings,
    choice: OracleChoice,
}

impl<'a> Judge<'a> {
    /// For pictures like that of `setting`.
    pub fn new(lab: &Lab<'a>, setting: &Setting, choice: OracleChoice) -> Self {
        Self {
            scene: lab.scene,
            settings: render_settings(lab.base, setting),
            choice,
        }
    }

    /// Looks at our picture, or makes one of `samples` samples a pixel.
    pub fn judge(&self, ours: &Picture, samples: u32) -> anyhow::Result<Verdict> {
        let too_large = self.scene.geometry.triangles.len() > MOST_TRIANGLES;
        let asked = match self.choice {
            OracleChoice::Never => false,
            OracleChoice::Auto => !too_large,
            OracleChoice::Always => true,
        };
        if !asked {
            return Ok(Verdict::NotAsked);
        }
        let settings = &self.settings;
        let oracle = Oracle::new(self.scene);
        let block = block_time(&oracle, settings)?;
        let blocks = ours.height.div_ceil(BLOCK);
        let whole = block * blocks * samples;
        if self.choice == OracleChoice::Always || whole <= WHOLE {
            let settings = RenderSettings {
                samples,
                ..settings.clone()
            };
            return Ok(Verdict::Picture(picture(&oracle, &settings)?));
        }
        let one = block * settings.samples;
        let affordable = CHECK.as_secs_f64() / one.as_secs_f64().max(1e-9);
        let count = (affordable as u32).clamp(1, blocks);
        Ok(Verdict::Check(check(&oracle, settings, ours, count)?))
    }
}

/// What a block of one sample a pixel takes, in the mean of a few.
fn block_time(oracle: &Oracle<'_>, settings: &RenderSettings) -> anyhow::Result<Duration> {
    let single = RenderSettings {
        samples: 1,
        ..settings.clone()
    };
    let height = settings.visible_region().height;
    let started = Instant::now();
    for top in evenly(height, PROBES) {
        rows(oracle, &single, top)?;
    }
    Ok(started.elapsed() / PROBES.min(height.div_ceil(BLOCK)))
}

/// First rows of `count` blocks, spread over the picture.
fn evenly(height: u32, count: u32) -> impl Iterator<Item = u32> {
    let blocks = height.div_ceil(BLOCK);
    let count = count.clamp(1, blocks);
    (0..count).map(move |i| {
        let middle = (2 * u64::from(i) + 1) * u64::from(blocks) / (2 * u64::from(count));
        BLOCK * middle as u32
    })
}

/// A block's pixels; `top` counts from the window's top.
fn rows(
    oracle: &Oracle<'_>,
    settings: &RenderSettings,
    top: u32,
) -> anyhow::Result<raytree_oracle::Picture> {
    cancel::check()?;
    let region = settings.visible_region();
    let height = BLOCK.min(region.height - top);
    let settings_of_oracle = Settings {
        samples: sample_pattern(settings.samples),
        window: (region.x, region.y + top, region.width, height),
        ..oracle_settings(settings)
    };
    Ok(oracle.render(&settings.camera, &settings_of_oracle))
}

fn picture(oracle: &Oracle<'_>, settings: &RenderSettings) -> anyhow::Result<Picture> {
    let region = settings.visible_region();
    let mut film = raytree::Film::new(region.width, region.height);
    film.radiance.clear();
    film.alpha.clear();
    for top in (0..region.height).step_by(BLOCK as usize) {
        let block = rows(oracle, settings, top)?;
        let radiance = block.radiance.iter().map(|rgb| rgb.map(|c| c as f32));
        film.radiance.extend(radiance);
        film.alpha
            .extend(block.alpha.iter().map(|alpha| *alpha as f32));
    }
    Ok(Picture::from(&film))
}

/// Our picture against the oracle's in some blocks.
fn check(
    oracle: &Oracle<'_>,
    settings: &RenderSettings,
    ours: &Picture,
    count: u32,
) -> anyhow::Result<(f64, f64)> {
    let (mut squares, mut pixels) = (0.0, 0);
    for top in evenly(ours.height, count) {
        let block = rows(oracle, settings, top)?;
        let first = top as usize * ours.width as usize;
        for (theirs, ours) in block.radiance.iter().zip(&ours.rgb[first..]) {
            pixels += 1;
            squares += (0..3)
                .map(|c| (theirs[c] - f64::from(ours[c])).powi(2))
                .sum::<f64>();
        }
    }
    let share = f64::from(pixels) / ours.rgb.len().max(1) as f64;
    Ok((share, (squares / (3.0 * f64::from(pixels.max(1)))).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_spread_and_within_the_picture() {
        let tops = |height, count| evenly(height, count).collect::<Vec<u32>>();
        assert_eq!(tops(120, 4), [14, 44, 74, 104]);
        assert_eq!(tops(3, 10), [0, 2]);
        assert_eq!(tops(1, 1), [0]);
        for count in 1..=60 {
            let mut tops = tops(120, count);
            tops.dedup();
            assert_eq!(tops.len() as u32, count);
            assert!(tops.iter().all(|top| *top < 120));
        }
    }
}
