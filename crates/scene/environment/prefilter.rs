//! What surfaces that are not mirrors gather from an environment: convolutions of the map over the sphere.
//!
//! - A rough lobe: GGX with normal = view = reflected direction, light weighted by `n.l` (Karis 2013, "Real Shading in
//!   Unreal Engine 4"). With `mu = n.l` the half vector has `(n.h)^2 = (1 + mu) / 2`, and `D(h)` times `n.l` over the
//!   constant density of directions leaves a rational function of `mu` alone.
//! - Irradiance over pi: the cosine.
//!
//! Both are averages with weights that add up to 1, so a constant map stays what it is. A weight depends on two rows and
//! the difference of two columns only: it is computed once for each pair of rows and used for a whole row of texels.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

use super::{EquirectMap, ROUGH_LEVELS, resample};

/// What is integrated: the map in this size, energy kept. A texel is 2.8 degrees wide; the sharpest lobe falls to a
/// quarter at 7.2 degrees.
const SOURCE: (u32, u32) = (128, 64);

/// Sizes of the levels of roughness 1/4, 2/4, 3/4 and 1; the wider the lobe, the fewer texels describe it. Their widths
/// divide that of the source.
const ROUGH: [(u32, u32); ROUGH_LEVELS] = [(128, 64), (64, 32), (32, 16), (32, 16)];

/// Size of the irradiance map.
const IRRADIANCE: (u32, u32) = (32, 16);

/// The map from which all levels are computed.
pub(super) fn source(radiance: &EquirectMap) -> EquirectMap {
    resample::fit(radiance, SOURCE.0, SOURCE.1)
}

/// Level `level` of [`super::Environment::rough`].
pub(super) fn rough_level(source: &EquirectMap, level: usize) -> EquirectMap {
    let roughness = (level + 1) as f32 / ROUGH_LEVELS as f32;
    convolve(source, ROUGH[level], ggx_lobe(roughness))
}

/// [`super::Environment::irradiance`].
pub(super) fn irradiance(source: &EquirectMap) -> EquirectMap {
    convolve(source, IRRADIANCE, cosine_lobe)
}

/// Weight of light at the cosine `mu` from the lobe's axis, up to a constant factor.
fn ggx_lobe(roughness: f32) -> impl Fn(f32) -> f32 + Sync {
    let alpha_squared = roughness.powi(4);
    move |mu: f32| {
        let denominator = 1.0 - (1.0 - alpha_squared) * 0.5 * (1.0 + mu);
        mu.max(0.0) * (alpha_squared / denominator).powi(2)
    }
}

fn cosine_lobe(mu: f32) -> f32 {
    mu.max(0.0)
}

/// For each texel of a map of `size`, the average of `source` weighted by `lobe(cosine of the angle between)` and solid
/// angle. The width of `source` is a multiple of the result's, and the height of the result is even.
fn convolve(
    source: &EquirectMap,
    size: (u32, u32),
    lobe: impl Fn(f32) -> f32 + Sync,
) -> EquirectMap {
    let (width, height) = (size.0 as usize, size.1 as usize);
    let phases = Phases::new(source, width);
    let columns = ColumnCosines::new(source.width as usize, width);
    let mut texels = vec![[0.0f32; 3]; width * height];
    // A row and its mirror image in the other hemisphere share their weights, upside down.
    let (north, south) = texels.split_at_mut(width * height / 2);
    let rows = north
        .par_chunks_mut(width)
        .zip(south.par_rchunks_mut(width))
        .enumerate();
    rows.for_each(|(y, (north, south))| {
        let v = (y as f64 + 0.5) / height as f64;
        let weights = row_weights(v, source.height as usize, &columns, &lobe);
        let weights = weights.chunks(source.width as usize);
        gather_row(north.as_flattened_mut(), weights.clone(), &phases);
        gather_row(south.as_flattened_mut(), weights.rev(), &phases);
    });
    EquirectMap {
        width: size.0,
        height: size.1,
        texels,
    }
}

/// Offsets within a source texel, in texels, at which the lobe is evaluated along each axis: it is averaged over the texel,
/// not taken at its centre.
const SUB_SAMPLES: [f64; 2] = [-0.25, 0.25];

/// Cosines of the difference in longitude between a result texel's centre and the sub-samples of the source texels: that
/// of source column `ratio * i - m` from result column `i` depends on `m` alone. A list over `m` for each sub-sample.
struct ColumnCosines([Vec<f32>; SUB_SAMPLES.len()]);

impl ColumnCosines {
    fn new(source_width: usize, width: usize) -> Self {
        let ratio = (source_width / width) as f64;
        let cosine = |m: usize, sub: f64| {
            let columns = m as f64 + 0.5 * (ratio - 1.0) - sub;
            (TAU * columns / source_width as f64).cos() as f32
        };
        Self(SUB_SAMPLES.map(|sub| (0..source_width).map(|m| cosine(m, sub)).collect()))
    }
}

/// The weights of all source texels for a result row at `v`: for each source row, one for each difference `m` of columns
/// ([`ColumnCosines`]). They add up to 1. In f32, whose rounding the sharpest lobe makes an error of 1e-4 at most: so the
/// inner loop runs four or more lanes wide.
fn row_weights(
    v: f64,
    source_height: usize,
    columns: &ColumnCosines,
    lobe: impl Fn(f32) -> f32,
) -> Vec<f32> {
    let (sin_v, cos_v) = (PI * v).sin_cos();
    let source_width = columns.0[0].len();
    let mut weights = vec![0.0; source_width * source_height];
    for (y, weights) in weights.chunks_mut(source_width).enumerate() {
        for sub in SUB_SAMPLES {
            let (sin, cos) = (PI * (y as f64 + 0.5 + sub) / source_height as f64).sin_cos();
            let (constant, factor) = ((cos_v * cos) as f32, (sin_v * sin) as f32);
            let solid_angle = sin as f32;
            for cosines in &columns.0 {
                for (weight, cosine) in weights.iter_mut().zip(cosines) {
                    *weight += solid_angle * lobe(constant + factor * cosine);
                }
            }
        }
    }
    let total: f64 = weights.iter().copied().map(f64::from).sum();
    let scale = (1.0 / total) as f32;
    weights.iter_mut().for_each(|weight| *weight *= scale);
    weights
}

/// The source's rows as the inner loop of [`gather_row`] wants them. Result column `i` reads source columns
/// `ratio * i - m`; sorted by phase (column modulo ratio) these lie side by side for successive `i`. Each phase is stored
/// twice in a row, so that no index wraps.
struct Phases {
    /// Texels of a phase, which is the width of the result.
    width: usize,
    ratio: usize,
    /// `[row][phase][2 * width][3]`.
    channels: Vec<f32>,
}

impl Phases {
    fn new(source: &EquirectMap, width: usize) -> Self {
        let ratio = source.width as usize / width;
        let channels = source
            .texels
            .chunks(source.width as usize)
            .flat_map(|row| (0..ratio).map(move |phase| (row, phase)))
            .flat_map(|(row, phase)| {
                let once = row.iter().skip(phase).step_by(ratio);
                once.clone().chain(once).flatten().copied()
            })
            .collect();
        Self {
            width,
            ratio,
            channels,
        }
    }

    /// Source columns `ratio * i - m` of row `y`, for all `i`.
    fn shifted(&self, y: usize, m: usize) -> &[f32] {
        // -m = phase - ratio * shift
        let shift = m.div_ceil(self.ratio);
        let phase = shift * self.ratio - m;
        let start = (y * self.ratio + phase) * 2 * self.width + (self.width - shift);
        &self.channels[3 * start..3 * (start + self.width)]
    }
}

/// Columns that [`gather_row`] takes at a time, so that a sum is loaded and stored once for all of them. Divides the width
/// of the source.
const BLOCK: usize = 8;

/// Adds up one row of the result; `weights`: those of each row of the source ([`row_weights`]).
fn gather_row<'w>(result: &mut [f32], weights: impl Iterator<Item = &'w [f32]>, phases: &Phases) {
    for (y, weights) in weights.enumerate() {
        for (block, weights) in weights.as_chunks::<BLOCK>().0.iter().enumerate() {
            // Half of the sphere is below the horizon of the lobe.
            if *weights == [0.0; BLOCK] {
                continue;
            }
            let columns: [&[f32]; BLOCK] =
                std::array::from_fn(|i| &phases.shifted(y, block * BLOCK + i)[..result.len()]);
            for (i, sum) in result.iter_mut().enumerate() {
                *sum += (0..BLOCK).map(|m| weights[m] * columns[m][i]).sum::<f32>();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::environment::Environment;
    use crate::environment::resample::mean;

    fn levels(environment: &Environment) -> impl Iterator<Item = (String, &EquirectMap)> {
        let rough = environment.rough.iter().enumerate();
        let rough = rough.map(|(k, level)| (format!("rough[{k}]"), level));
        rough.chain([("irradiance".to_owned(), &environment.irradiance)])
    }

    /// The lobe of level `name`, written down afresh: GGX as a distribution of half vectors (Walter et al. 2007).
    fn textbook_lobe(name: &str, axis: DVec3, light: DVec3) -> f64 {
        let cosine = axis.dot(light);
        if cosine <= 0.0 {
            return 0.0;
        }
        if name == "irradiance" {
            return cosine;
        }
        let level: f64 = name[6..7].parse().unwrap();
        let alpha = ((level + 1.0) / 4.0).powi(2);
        let half = (axis + light).normalize();
        let tangent_squared = half.cross(axis).length_squared() / half.dot(axis).powi(2);
        let d = alpha.powi(2)
            / (PI * half.dot(axis).powi(4) * (alpha.powi(2) + tangent_squared).powi(2));
        d * cosine
    }

    /// A lobe integrated over the hemisphere, by the midpoint rule.
    fn lobe_integral(name: &str) -> f64 {
        const STEPS: usize = 200_000;
        let ring = |i: usize| {
            let cosine = (i as f64 + 0.5) / STEPS as f64;
            let light = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            textbook_lobe(name, DVec3::Z, light)
        };
        TAU * (0..STEPS).map(ring).sum::<f64>() / STEPS as f64
    }

    /// A map of one bright texel in an even sky.
    struct Sun {
        map: EquirectMap,
        column: u32,
        row: u32,
    }

    const SKY: f64 = 0.3;

    impl Sun {
        fn new((width, height): (u32, u32), column: u32, row: u32, radiance: f32) -> Self {
            let mut map = EquirectMap::from_directions(width, height, |_| DVec3::splat(SKY));
            map.texels[(row * width + column) as usize] = [radiance; 3];
            Self { map, column, row }
        }

        /// Directions of `grid` x `grid` points in the cell of a map of `cells` that the sun lies in, each with its share
        /// of the cell's solid angle, in steradians.
        fn directions(&self, cells: (u32, u32), grid: u32) -> impl Iterator<Item = (DVec3, f64)> {
            let column = self.column * cells.0 / self.map.width;
            let row = self.row * cells.1 / self.map.height;
            let (points_across, points_down) =
                (f64::from(cells.0 * grid), f64::from(cells.1 * grid));
            (0..grid * grid).map(move |i| {
                let phi = TAU * (0.5 - (f64::from(column * grid + i % grid) + 0.5) / points_across);
                let theta = PI * (f64::from(row * grid + i / grid) + 0.5) / points_down;
                let (sin, cos) = theta.sin_cos();
                let direction = DVec3::new(sin * phi.sin(), cos, sin * phi.cos());
                (direction, TAU / points_across * PI / points_down * sin)
            })
        }
    }

    /// Directions of some texel centres of a level, with what the level says there.
    fn probes(level: &EquirectMap) -> impl Iterator<Item = (DVec3, f64)> {
        let centres =
            EquirectMap::from_directions(level.width, level.height, |direction| direction);
        let step = centres.texels.len() / 23;
        let chosen = (0..centres.texels.len()).step_by(step);
        chosen.map(move |i| {
            let direction = glam::Vec3::from_array(centres.texels[i])
                .as_dvec3()
                .normalize();
            (direction, f64::from(level.texels[i][0]))
        })
    }

    #[test]
    fn constant_map_stays_constant() {
        for (width, height) in [(1, 1), (16, 8), (300, 150)] {
            let texels = vec![[0.25, 1.0, 3e4]; (width * height) as usize];
            let environment = Environment::new(
                EquirectMap {
                    width,
                    height,
                    texels,
                },
                0.0,
            );
            for (name, level) in levels(&environment) {
                for [r, g, b] in &level.texels {
                    for (value, expected) in [(r, 0.25), (g, 1.0), (b, 3e4)] {
                        let error = (value / expected - 1.0f32).abs();
                        assert!(error < 1e-5, "{name}: {value} for {expected}");
                    }
                }
            }
        }
    }

    /// A sun that is a texel of the source itself: only the discretisation of the lobe is left as an error.
    #[test]
    fn bright_texel_matches_the_integral() {
        for (column, row) in [(30, 20), (127, 32), (64, 1), (5, 63)] {
            let radiance = 5000.0;
            let sun = Sun::new(SOURCE, column, row, radiance);
            let environment = Environment::new(sun.map.clone(), 0.0);
            for (name, level) in levels(&environment) {
                let norm = lobe_integral(&name);
                for (direction, value) in probes(level) {
                    let share: f64 = sun
                        .directions(SOURCE, 32)
                        .map(|(light, angle)| angle * textbook_lobe(&name, direction, light))
                        .sum();
                    let expected = SKY + (f64::from(radiance) - SKY) * share / norm;
                    let error = (value / expected - 1.0).abs();
                    // Measured: 0.3 %, and 1 % beside the poles, where texels are slivers.
                    let limit = if (8..56).contains(&row) { 0.005 } else { 0.015 };
                    let place = format!("{name} at {direction}, sun at {column}, {row}");
                    assert!(error < limit, "{place}: {value} for {expected}");
                }
            }
        }
    }

    /// A sun far smaller than the source's texels keeps its energy; its place is known to such a texel.
    #[test]
    fn small_sun_shines_from_its_place() {
        let size = (1024, 512);
        for (column, row) in [(333, 150), (1023, 256), (700, 490)] {
            let radiance = 4e5;
            let sun = Sun::new(size, column, row, radiance);
            let environment = Environment::new(sun.map.clone(), 0.0);
            let flux =
                f64::from(radiance) * sun.directions(size, 8).map(|(_, angle)| angle).sum::<f64>();
            for (name, level) in levels(&environment) {
                let norm = lobe_integral(&name);
                for (direction, value) in probes(level) {
                    let (least, most) = sun
                        .directions(SOURCE, 16)
                        .map(|(light, _)| {
                            SKY + flux * textbook_lobe(&name, direction, light) / norm
                        })
                        .fold((f64::MAX, f64::MIN), |(least, most), x| {
                            (least.min(x), most.max(x))
                        });
                    // The grid of directions does not reach the very edge of the cell.
                    assert!(
                        (0.99 * least..1.01 * most).contains(&value),
                        "{name} at {direction}, sun at {column}, {row}: {value} not in {least}..{most}"
                    );
                }
            }
        }
    }

    #[test]
    fn mean_radiance_is_kept() {
        let mut map = EquirectMap::from_directions(512, 256, |d| {
            DVec3::splat(1.0 + d.y + 2.0 * (d.x * 5.0).sin().max(0.0))
        });
        map.texels[100 * 512 + 37] = [2e4; 3];
        let environment = Environment::new(map, 0.0);
        let expected = mean(&environment.radiance).x;
        for (name, level) in levels(&environment) {
            let error = (mean(level).x / expected - 1.0).abs();
            assert!(error < 5e-4, "{name}: the mean is off by {error}");
        }
    }

    #[test]
    fn rougher_levels_are_more_even() {
        let mut map = EquirectMap::from_directions(256, 128, |d| DVec3::splat(0.5 + 0.4 * d.y));
        map.texels[40 * 256 + 200] = [3000.0; 3];
        let environment = Environment::new(map, 0.0);
        let maxima: Vec<f32> = std::iter::once(&environment.radiance)
            .chain(&environment.rough)
            .map(|level| {
                level
                    .texels
                    .iter()
                    .fold(0.0, |max, texel| texel[0].max(max))
            })
            .collect();
        assert!(maxima.is_sorted_by(|a, b| a > b), "{maxima:?}");
    }

    #[test]
    fn turning_the_map_turns_the_levels() {
        let paint = |d: DVec3| DVec3::splat(1.0 + d.x + (4.0 * d.z).exp());
        let map = EquirectMap::from_directions(256, 128, paint);
        // A quarter of each level's width is a whole number of texels.
        let mut turned = map.clone();
        for row in turned.texels.chunks_mut(256) {
            row.rotate_left(64);
        }
        let (map, turned) = (Environment::new(map, 0.0), Environment::new(turned, 0.0));
        for ((name, level), (_, turned)) in levels(&map).zip(levels(&turned)) {
            let mut expected = level.texels.clone();
            let width = level.width as usize;
            expected
                .chunks_mut(width)
                .for_each(|row| row.rotate_left(width / 4));
            let furthest = expected
                .as_flattened()
                .iter()
                .zip(turned.texels.as_flattened())
                .map(|(a, b)| (a / b - 1.0).abs())
                .fold(0.0, f32::max);
            assert!(furthest < 1e-5, "{name}: {furthest}");
        }
    }
}
