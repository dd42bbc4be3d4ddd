//! Maps of another size that carry the same light.

use std::f64::consts::PI;
use std::ops::Range;

use glam::DVec3;

use super::EquirectMap;

/// The average of `texels` (`width` x `height`) over each texel of a map of `to_width` x `to_height`, neither larger,
/// weighted by solid angle: radiance times solid angle is kept, so a small sun loses no energy.
pub(super) fn shrink(
    texels: &[[f32; 3]],
    (width, height): (u32, u32),
    (to_width, to_height): (u32, u32),
) -> EquirectMap {
    let mut shrunk = Vec::with_capacity(to_width as usize * to_height as usize);
    let mut row = vec![DVec3::ZERO; width as usize];
    for y in 0..to_height {
        let (top, bottom) = span(y, to_height);
        let solid_angle = band(top, bottom);
        row.fill(DVec3::ZERO);
        for (source_y, source_top, source_bottom) in overlaps(top, bottom, height) {
            let weight = band(source_top, source_bottom) / solid_angle;
            let source = &texels[source_y * width as usize..][..width as usize];
            for (sum, &[r, g, b]) in row.iter_mut().zip(source) {
                *sum += DVec3::new(f64::from(r), f64::from(g), f64::from(b)) * weight;
            }
        }
        for x in 0..to_width {
            let (left, right) = span(x, to_width);
            let sum: DVec3 = overlaps(left, right, width)
                .map(|(source_x, from, to)| row[source_x] * (to - from))
                .sum();
            shrunk.push((sum / (right - left)).as_vec3().to_array());
        }
    }
    EquirectMap {
        width: to_width,
        height: to_height,
        texels: shrunk,
    }
}

/// The map in exactly this size: averaged where it has more texels, bilinear where it has fewer.
pub(super) fn fit(map: &EquirectMap, width: u32, height: u32) -> EquirectMap {
    let to = (map.width.min(width), map.height.min(height));
    let shrunk = shrink(&map.texels, (map.width, map.height), to);
    if to == (width, height) {
        shrunk
    } else {
        EquirectMap::from_directions(width, height, |direction| shrunk.sample(direction))
    }
}

/// The mean radiance over all directions.
#[cfg(test)]
pub(super) fn mean(map: &EquirectMap) -> DVec3 {
    shrink(&map.texels, (map.width, map.height), (1, 1)).sample(DVec3::Y)
}

/// What texel `i` of `count` covers of [0, 1].
fn span(i: u32, count: u32) -> (f64, f64) {
    (
        f64::from(i) / f64::from(count),
        f64::from(i + 1) / f64::from(count),
    )
}

/// The texels of `count` that [from, to] meets, each with the part of it that lies inside.
fn overlaps(from: f64, to: f64, count: u32) -> impl Iterator<Item = (usize, f64, f64)> {
    let size = f64::from(count);
    let met: Range<u32> = ((from * size) as u32)..((to * size).ceil() as u32).min(count);
    met.map(move |i| {
        let (start, end) = span(i, count);
        (
            i as usize,
            start.max(from),
            end.min(to).max(start.max(from)),
        )
    })
}

/// Solid angle of the band between two latitudes over 2 pi; `v` from 0 (top) to 1.
fn band(top: f64, bottom: f64) -> f64 {
    (PI * top).cos() - (PI * bottom).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sun(width: u32, height: u32, x: u32, y: u32) -> EquirectMap {
        let mut map = EquirectMap::from_directions(width, height, |_| DVec3::splat(0.1));
        map.texels[(y * width + x) as usize] = [6e4, 5e4, 4e4];
        map
    }

    #[test]
    fn mean_is_weighted_by_solid_angle() {
        // cos^2 of the polar angle averages to 1/3 over the sphere, and to 1/2 over the texels of a map.
        let map = EquirectMap::from_directions(64, 512, |d| DVec3::splat(d.y * d.y));
        assert!((mean(&map).x - 1.0 / 3.0).abs() < 1e-5);
    }

    #[test]
    fn energy_is_kept_also_where_sizes_do_not_divide() {
        for (x, y) in [(0, 0), (517, 255), (1023, 511), (300, 40), (301, 41)] {
            let map = sun(1024, 512, x, y);
            for to in [(128, 64), (1000, 333), (7, 5), (1024, 512)] {
                let shrunk = shrink(&map.texels, (1024, 512), to);
                let error = (mean(&shrunk) / mean(&map) - DVec3::ONE)
                    .abs()
                    .max_element();
                assert!(error < 1e-6, "sun at {x}, {y} shrunk to {to:?}: {error}");
            }
        }
    }

    #[test]
    fn same_size_changes_nothing() {
        let map = sun(37, 19, 5, 6);
        assert_eq!(shrink(&map.texels, (37, 19), (37, 19)), map);
        assert_eq!(fit(&map, 37, 19), map);
    }

    #[test]
    fn small_maps_grow_smoothly() {
        let map = EquirectMap {
            width: 2,
            height: 1,
            texels: vec![[0.0; 3], [1.0; 3]],
        };
        let grown = fit(&map, 128, 64);
        assert_eq!((grown.width, grown.height), (128, 64));
        // The middle of the map is half way between its two texels.
        assert!((grown.sample(DVec3::Z).x - 0.5).abs() < 1e-6);
        assert!((mean(&grown).x - 0.5).abs() < 1e-6);
    }
}
