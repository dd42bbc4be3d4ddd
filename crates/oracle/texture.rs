//! Texture look-ups: "Textures" in `shaders/README.md`.

use std::sync::LazyLock;

use raytree_scene::model::{Filter, Image, Scene, Texture, TextureRef, Wrap};

/// The texture's RGBA at `uv`, before the ref's affine map.
pub(crate) fn sample(scene: &Scene, reference: &TextureRef, uv: [f64; 2]) -> [f64; 4] {
    let texture = &scene.textures[reference.texture as usize];
    let image = &scene.images[texture.image as usize];
    let [u, v] = transformed(reference, uv);
    let (x, y) = (u * f64::from(image.width), v * f64::from(image.height));
    match texture.filter {
        Filter::Nearest => texel(texture, image, x.floor() as i64, y.floor() as i64),
        Filter::Linear => bilinear(x - 0.5, y - 0.5, |i, j| texel(texture, image, i, j)),
    }
}

/// Between the four values around `(x, y)`, of a grid with values at whole numbers.
pub(crate) fn bilinear<const N: usize>(
    x: f64,
    y: f64,
    value: impl Fn(i64, i64) -> [f64; N],
) -> [f64; N] {
    let (i, j) = (x.floor() as i64, y.floor() as i64);
    let (s, t) = (x - x.floor(), y - y.floor());
    let above = lerp(value(i, j), value(i + 1, j), s);
    let below = lerp(value(i, j + 1), value(i + 1, j + 1), s);
    lerp(above, below, t)
}

/// `a` at 0, `b` at 1.
pub(crate) fn lerp<const N: usize>(a: [f64; N], b: [f64; N], t: f64) -> [f64; N] {
    std::array::from_fn(|k| a[k] * (1.0 - t) + b[k] * t)
}

fn transformed(reference: &TextureRef, [u, v]: [f64; 2]) -> [f64; 2] {
    let m = reference.transform.map(f64::from);
    [m[0] * u + m[1] * v + m[2], m[3] * u + m[4] * v + m[5]]
}

fn texel(texture: &Texture, image: &Image, x: i64, y: i64) -> [f64; 4] {
    let i = wrapped(texture.wrap_u, x, image.width);
    let j = wrapped(texture.wrap_v, y, image.height);
    let [r, g, b, a] = image.texels[j * image.width as usize + i];
    let decoded = |byte: u8| {
        if texture.srgb {
            SRGB[usize::from(byte)]
        } else {
            unit(byte)
        }
    };
    [decoded(r), decoded(g), decoded(b), unit(a)]
}

fn wrapped(wrap: Wrap, coordinate: i64, size: u32) -> usize {
    let n = i64::from(size);
    let index = match wrap {
        Wrap::Repeat => coordinate.rem_euclid(n),
        Wrap::MirroredRepeat => {
            let there_and_back = coordinate.rem_euclid(2 * n);
            there_and_back.min(2 * n - 1 - there_and_back)
        }
        Wrap::ClampToEdge => coordinate.clamp(0, n - 1),
    };
    index as usize
}

fn unit(byte: u8) -> f64 {
    f64::from(byte) / 255.0
}

/// Linear value of each sRGB-encoded byte (IEC 61966-2-1).
static SRGB: LazyLock<[f64; 256]> = LazyLock::new(|| {
    std::array::from_fn(|byte| {
        let encoded = byte as f64 / 255.0;
        if encoded <= 0.04045 {
            encoded / 12.92
        } else {
            ((encoded + 0.055) / 1.055).powf(2.4)
        }
    })
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapping_folds_whole_texels() {
        let row = |wrap| (-4..8).map(|i| wrapped(wrap, i, 3)).collect::<Vec<_>>();
        assert_eq!(row(Wrap::Repeat), [2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1]);
        assert_eq!(
            row(Wrap::MirroredRepeat),
            [2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0, 1]
        );
        assert_eq!(row(Wrap::ClampToEdge), [0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2, 2]);
    }

    #[test]
    fn srgb_is_the_piecewise_curve() {
        assert_eq!(SRGB[0], 0.0);
        assert_eq!(SRGB[255], 1.0);
        // The straight part: 10/255 = 0.0392 is below 0.04045.
        assert!((SRGB[10] - 10.0 / 255.0 / 12.92).abs() < 1e-15);
        assert!((SRGB[128] - 0.215_860_5).abs() < 1e-7);
    }
}
