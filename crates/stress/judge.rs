//! A whole picture against the oracle's: every pixel that differs has to lie on an edge, somewhere where the oracle's own
//! picture jumps within a small part of a pixel.

use raytree_film::Film;
use raytree_gpu::{RenderSettings, Shading};
use raytree_oracle::{Oracle, Picture, Settings};
use raytree_scene::model::Scene;

/// How far the oracle looks for the jump that explains a pixel, pixels. f32 has about 1e-7 of the scene's extent, which a
/// curved mirror or a ball of glass magnifies a hundredfold from bounce to bounce.
const EDGE_RADII: [f64; 3] = [1e-3, 1e-2, 5e-2];

/// A pixel that differs from the oracle's by more than the tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlier {
    /// Column.
    pub x: u32,
    /// Row, from the top.
    pub y: u32,
    /// What was rendered.
    pub ours: [f64; 3],
    /// What the oracle says.
    pub theirs: [f64; 3],
}

impl Outlier {
    /// Of the channel that differs most, see [`difference`].
    #[must_use]
    pub fn difference(&self) -> f64 {
        difference(self.ours, self.theirs)
    }
}

/// Of the channel that differs most: absolute up to radiance 1, above it relative. NaN if any is (`f64::max` would pass over
/// it).
#[must_use]
pub fn difference(ours: [f64; 3], theirs: [f64; 3]) -> f64 {
    let channels = [0, 1, 2].map(|k| (ours[k] - theirs[k]).abs() / theirs[k].abs().max(1.0));
    channels.into_iter().fold(0.0, worse)
}

/// [`difference`] of the pixel that differs most; NaN if any is, or if the pictures are not of one size.
#[must_use]
pub fn largest_difference(ours: &Film, theirs: &Film) -> f64 {
    if ours.radiance.len() != theirs.radiance.len() {
        return f64::NAN;
    }
    let pixels = ours.radiance.iter().zip(&theirs.radiance);
    pixels
        .map(|(ours, theirs)| difference(ours.map(f64::from), theirs.map(f64::from)))
        .fold(0.0, worse)
}

/// The larger one; NaN is the worst of all.
#[must_use]
pub fn worse(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}

/// NaN exceeds everything.
fn exceeds(difference: f64, tolerance: f64) -> bool {
    difference > tolerance || difference.is_nan()
}

/// A picture, judged.
#[derive(Clone, Debug)]
pub struct Judged {
    /// The oracle's picture.
    pub theirs: Picture,
    /// Share of the pixels within the tolerance, 0 to 1.
    pub near_share: f64,
    /// Pixels off by more than the tolerance.
    pub outliers: Vec<Outlier>,
    /// Those of them that no edge explains.
    pub unexplained: Vec<Outlier>,
    /// The largest difference that no edge explains, of all pixels.
    pub worst: f64,
}

/// Judges the whole picture `film`, rendered of `scene` with `settings` and one sample a pixel.
#[must_use]
pub fn judge_picture(
    scene: &Scene,
    settings: &RenderSettings,
    film: &Film,
    tolerance: f64,
) -> Judged {
    let oracle = Oracle::new(scene);
    let oracle_settings = oracle_settings(settings);
    let theirs = oracle.render(&settings.camera, &oracle_settings);
    let mut judged = Judged {
        near_share: 1.0,
        outliers: Vec::new(),
        unexplained: Vec::new(),
        worst: 0.0,
        theirs,
    };
    for (index, (ours, theirs)) in (0_u32..).zip(film.radiance.iter().zip(&judged.theirs.radiance))
    {
        let pixel = Outlier {
            x: index % settings.width,
            y: index / settings.width,
            ours: ours.map(f64::from),
            theirs: *theirs,
        };
        let difference = pixel.difference();
        if exceeds(difference, tolerance) {
            judged.outliers.push(pixel);
            if is_explained(&oracle, settings, &oracle_settings, &pixel, tolerance) {
                continue;
            }
            judged.unexplained.push(pixel);
        }
        if !judged.worst.is_nan() && exceeds(difference, judged.worst) {
            judged.worst = difference;
        }
    }
    judged.near_share -= judged.outliers.len() as f64 / film.radiance.len().max(1) as f64;
    judged
}

/// The oracle's settings for the same picture.
#[must_use]
pub fn oracle_settings(settings: &RenderSettings) -> Settings {
    Settings {
        max_depth: settings.max_depth,
        min_weight: f64::from(settings.min_weight),
        shading: match settings.shading {
            Shading::Pbr => raytree_oracle::Shading::Pbr,
            Shading::Whitted => raytree_oracle::Shading::Whitted,
        },
        ..Settings::new(settings.width, settings.height)
    }
}

/// Is there a small neighbourhood in which the oracle's picture takes our value too?
fn is_explained(
    oracle: &Oracle<'_>,
    settings: &RenderSettings,
    oracle_settings: &Settings,
    pixel: &Outlier,
    tolerance: f64,
) -> bool {
    EDGE_RADII.into_iter().any(|radius| {
        let spread = oracle.spread(&settings.camera, oracle_settings, pixel.x, pixel.y, radius);
        // A jump is wider than the tolerance, and reaches at least half way to our value.
        spread.width() > tolerance
            && spread.contains(pixel.ours, 0.5 * pixel.difference().max(tolerance))
    })
}

#[cfg(test)]
mod tests {
    use raytree_scene::default_view::frame_scene;

    use super::*;

    /// The comparison has to be able to fail.
    #[test]
    fn a_difference_is_relative_above_one_and_never_lost() {
        assert!(difference([0.5, 0.5009, 0.5], [0.5; 3]) < 1e-3);
        assert!(difference([0.5, 0.5011, 0.5], [0.5; 3]) > 1e-3);
        assert!(difference([10.009, 1.0, 0.0], [10.0, 1.0, 0.0]) < 1e-3);
        assert!(difference([10.02, 1.0, 0.0], [10.0, 1.0, 0.0]) > 1e-3);
        assert!(difference([f64::NAN, 0.5, 0.5], [0.5; 3]).is_nan());
        assert_eq!(
            difference([f64::INFINITY, 0.5, 0.5], [0.5; 3]),
            f64::INFINITY
        );
    }

    #[test]
    fn a_wrong_pixel_that_lies_on_no_edge_is_not_explained() {
        let scene = Scene::default();
        let camera = frame_scene(glam::DVec3::NEG_ONE, glam::DVec3::ONE, 1.0);
        let settings = RenderSettings::new(4, 4, camera);
        let mut film = Film::new(4, 4);
        let judged = judge_picture(&scene, &settings, &film, 1e-3);
        assert!(judged.outliers.is_empty() && judged.near_share == 1.0 && judged.worst == 0.0);
        film.radiance[6] = [0.5, 0.0, 0.0];
        film.radiance[7] = [f32::NAN, 0.0, 0.0];
        film.radiance[8] = [0.25, 0.0, 0.0];
        let judged = judge_picture(&scene, &settings, &film, 1e-3);
        assert_eq!(judged.unexplained.len(), 3);
        assert_eq!((judged.unexplained[0].x, judged.unexplained[0].y), (2, 1));
        assert!(judged.worst.is_nan());
        assert_eq!(judged.near_share, 1.0 - 3.0 / 16.0);
    }

    #[test]
    fn a_different_pixel_is_noticed() {
        let black = Film::new(2, 2);
        let mut other = black.clone();
        assert_eq!(largest_difference(&black, &other), 0.0);
        other.radiance[3][1] = 2e-6;
        assert!(largest_difference(&black, &other) > 1e-6);
        other.radiance[0][0] = f32::NAN;
        assert!(largest_difference(&black, &other).is_nan());
    }
}
