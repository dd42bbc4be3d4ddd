//! From linear radiance to what a screen shows: exposure, tone curve, transfer function, rounding.

/// Radiance above this is white under every curve to within 1/65535, and no curve overflows below it.
const BRIGHTEST: f32 = 1e6;

/// Fits radiance of any size into the [0, 1] that a screen shows. All curves take and give linear Rec. 709.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ToneMap {
    /// Clips to [0, 1]: right values below white, no detail above.
    None,
    /// Khronos PBR Neutral: base colours come out as authored, highlights roll off and lose their colour.
    #[default]
    Neutral,
    /// AgX (Troy Sobotka), in Benjamin Wrensch's fit of its curve: soft, film-like, hues run to white.
    Agx,
    /// ACES, in Stephen Hill's fit: strong contrast, saturated.
    Aces,
}

impl ToneMap {
    /// Maps radiance, exposure applied already, to [0, 1]. NaN counts as 0, infinity as very bright.
    pub fn apply(self, radiance: [f32; 3]) -> [f32; 3] {
        // Not `clamp`, which would keep a NaN.
        let color = radiance.map(|c| if c > 0.0 { c.min(BRIGHTEST) } else { 0.0 });
        let mapped = match self {
            Self::None => color,
            Self::Neutral => neutral(color),
            Self::Agx => agx(color),
            Self::Aces => aces(color),
        };
        mapped.map(|c| c.clamp(0.0, 1.0))
    }
}

/// Khronos PBR Neutral tone mapper specification, KhronosGroup/ToneMapping (2024).
fn neutral(mut color: [f32; 3]) -> [f32; 3] {
    const START: f32 = 0.8 - 0.04; // where compression starts
    const DESATURATION: f32 = 0.15;
    const ROOM: f32 = 1.0 - START;

    let least = color[0].min(color[1]).min(color[2]);
    // Takes away the Fresnel reflection of a dielectric, so that base colours come out as authored.
    let offset = if least < 0.08 {
        least - 6.25 * least * least
    } else {
        0.04
    };
    color = color.map(|c| c - offset);
    let peak = color[0].max(color[1]).max(color[2]);
    if peak < START {
        return color;
    }
    let new_peak = 1.0 - ROOM * ROOM / (peak + ROOM - START);
    let grey = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    color.map(|c| c * (new_peak / peak) * (1.0 - grey) + new_peak * grey)
}

type Matrix = [[f32; 3]; 3]; // rows

fn transform(m: Matrix, v: [f32; 3]) -> [f32; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// AgX as in three.js (`AgXToneMapping`, r162 and later) and Filament: Rec. 2020 working space, Blender's inset and outset
/// matrices, Wrensch's polynomial ("Minimal AgX Implementation", iolite-engine.com) for the curve.
fn agx(color: [f32; 3]) -> [f32; 3] {
    const TO_REC2020: Matrix = [
        [0.6274, 0.3293, 0.0433],
        [0.0691, 0.9195, 0.0113],
        [0.0164, 0.0880, 0.8956],
    ];
    const FROM_REC2020: Matrix = [
        [1.6605, -0.5876, -0.0728],
        [-0.1246, 1.1329, -0.0083],
        [-0.0182, -0.1006, 1.1187],
    ];
    const INSET: Matrix = [
        [0.856_627_15, 0.095_121_24, 0.048_251_607],
        [0.137_318_97, 0.761_242, 0.101_439_04],
        [0.111_898_21, 0.076_799_42, 0.811_302_36],
    ];
    const OUTSET: Matrix = [
        [1.127_100_6, -0.110_606_64, -0.016_493_939],
        [-0.141_329_76, 1.157_823_7, -0.016_493_939],
        [-0.141_329_76, -0.110_606_64, 1.251_936_4],
    ];
    const MIN_EV: f32 = -12.47393; // middle grey (0.18) less 10 stops
    const MAX_EV: f32 = 4.026069; // and plus 6.5

    let logarithmic = transform(INSET, transform(TO_REC2020, color)).map(|c| {
        let stops = c.max(1e-10).log2();
        ((stops - MIN_EV) / (MAX_EV - MIN_EV)).clamp(0.0, 1.0)
    });
    let curved = logarithmic.map(|x| {
        let (x2, x4) = (x * x, x * x * x * x);
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x
            - 0.00232
    });
    let display = transform(OUTSET, curved).map(|c| c.max(0.0).powf(2.2));
    transform(FROM_REC2020, display)
}

/// Stephen Hill's fit of the ACES reference and output transforms (selfshadow/ltc_code, `ltc_blit.fs`), with three.js'
/// (`ACESFilmicToneMapping`) scaling by 1/0.6 for bright surroundings.
fn aces(color: [f32; 3]) -> [f32; 3] {
    // sRGB to AP1 with the reference transform's saturation, and back with the output transform's.
    const INPUT: Matrix = [
        [0.59719, 0.35458, 0.04823],
        [0.07600, 0.90834, 0.01566],
        [0.02840, 0.13383, 0.83777],
    ];
    const OUTPUT: Matrix = [
        [1.60475, -0.53108, -0.07367],
        [-0.10208, 1.10813, -0.00605],
        [-0.00327, -0.07276, 1.07602],
    ];
    let fitted = transform(INPUT, color.map(|c| c / 0.6))
        .map(|v| (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432951) + 0.238081));
    transform(OUTPUT, fitted)
}

/// The sRGB transfer function (IEC 61966-2-1), from linear [0, 1] to encoded [0, 1].
pub fn srgb_encode(linear: f32) -> f32 {
    if linear <= 0.0031308 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// The inverse of [`srgb_encode`].
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// The nearest of 256 steps to a value in [0, 1], halves up; what lies outside is clipped, NaN gives 0.
pub fn quantise_u8(x: f32) -> u8 {
    (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// The nearest of 65536 steps to a value in [0, 1], halves up; what lies outside is clipped, NaN gives 0.
pub fn quantise_u16(x: f32) -> u16 {
    (x.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVES: [ToneMap; 4] = [ToneMap::None, ToneMap::Neutral, ToneMap::Agx, ToneMap::Aces];

    fn assert_maps(tone: ToneMap, cases: &[([f32; 3], [f32; 3])]) {
        for (input, expected) in cases {
            let output = tone.apply(*input);
            let close = output
                .iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() < 2e-5);
            assert!(close, "{tone:?} of {input:?}: {output:?}, not {expected:?}");
        }
    }

    // All three: the published formulas worked through in f64 by another program (Python).
    #[test]
    fn neutral_is_the_published_curve() {
        assert_maps(
            ToneMap::Neutral,
            &[
                ([0.0; 3], [0.0; 3]),
                ([0.18; 3], [0.14; 3]), // by hand: 0.18 - 0.04
                ([0.05, 0.2, 0.6], [0.015625, 0.165625, 0.565625]), // less 0.05 - 6.25 * 0.05^2
                ([1.0; 3], [0.869091; 3]), // by hand: 1 - 0.0576 / 0.44
                ([4.0, 1.0, 0.25], [0.983256, 0.468299, 0.339560]),
                ([100.0; 3], [0.999421; 3]),
            ],
        );
    }

    #[test]
    fn agx_is_the_published_curve() {
        assert_maps(
            ToneMap::Agx,
            &[
                ([0.0; 3], [0.0; 3]),
                ([0.18; 3], [0.214549, 0.214502, 0.214499]),
                ([0.05, 0.2, 0.6], [0.105267, 0.267632, 0.505611]),
                ([1.0; 3], [0.590229, 0.590136, 0.590102]),
                ([4.0, 1.0, 0.25], [0.936480, 0.623567, 0.437369]),
            ],
        );
    }

    #[test]
    fn aces_is_the_published_curve() {
        assert_maps(
            ToneMap::Aces,
            &[
                ([0.0; 3], [0.0; 3]),
                ([0.18; 3], [0.213105, 0.213105, 0.213103]),
                ([0.05, 0.2, 0.6], [0.053398, 0.242851, 0.604650]),
                ([1.0; 3], [0.763397, 0.763397, 0.763390]),
                ([4.0, 1.0, 0.25], [1.0, 0.796086, 0.504095]),
                ([100.0; 3], [1.0; 3]),
            ],
        );
    }

    #[test]
    fn no_curve_clips() {
        assert_eq!(ToneMap::None.apply([-1.0, 0.3, 7.0]), [0.0, 0.3, 1.0]);
    }

    #[test]
    fn every_curve_takes_everything_and_rises() {
        for tone in CURVES {
            for extreme in [
                f32::NAN,
                f32::INFINITY,
                f32::NEG_INFINITY,
                f32::MAX,
                f32::MIN,
                1e-40,
            ] {
                for color in [[extreme; 3], [extreme, 0.5, 0.0], [0.0, 0.1, extreme]] {
                    let mapped = tone.apply(color);
                    assert!(
                        mapped.iter().all(|c| (0.0..=1.0).contains(c)),
                        "{tone:?} {color:?} {mapped:?}"
                    );
                }
            }
            assert_eq!(tone.apply([f32::NAN; 3]), tone.apply([0.0; 3]));
            let greys: Vec<f32> = (0..400)
                .map(|i| tone.apply([1.03f32.powi(i) * 1e-3; 3])[1])
                .collect();
            assert!(
                greys.windows(2).all(|pair| pair[0] <= pair[1] + 1e-6),
                "{tone:?}"
            );
            assert!(greys[399] > 0.9 && greys[0] < 0.01, "{tone:?}");
        }
    }

    // Values of IEC 61966-2-1: both ends, both sides of the kink, and the encoding of 1/2 worked out by hand.
    #[test]
    fn srgb_is_the_exact_curve() {
        let cases = [
            (0.0, 0.0),
            (0.001, 0.01292),
            (0.0031308, 0.04045),
            (0.01, 0.099_852_8),
            (0.214_041_14, 0.5),
            (0.5, 0.735_357),
            (1.0, 1.0),
        ];
        for (linear, encoded) in cases {
            assert!((srgb_encode(linear) - encoded).abs() < 1e-6, "{linear}");
            assert!((srgb_decode(encoded) - linear).abs() < 1e-6, "{encoded}");
        }
    }

    #[test]
    fn every_step_survives_decoding_and_encoding() {
        for step in 0..=u8::MAX {
            let decoded = srgb_decode(f32::from(step) / 255.0);
            assert_eq!(quantise_u8(srgb_encode(decoded)), step);
        }
        for step in 0..=u16::MAX {
            let decoded = srgb_decode(f32::from(step) / 65535.0);
            assert_eq!(quantise_u16(srgb_encode(decoded)), step);
        }
    }

    #[test]
    fn rounding_goes_to_the_nearest_step_and_halves_up() {
        let cases = [
            (0.4999 / 255.0, 0),
            (0.5 / 255.0, 1),
            (1.4999 / 255.0, 1),
            (0.5, 128),
        ];
        for (x, step) in cases {
            assert_eq!(quantise_u8(x), step, "{x}");
        }
        for (x, low, high) in [
            (f32::NAN, 0, 0),
            (-1.0, 0, 0),
            (2.0, 255, 65535),
            (f32::INFINITY, 255, 65535),
        ] {
            assert_eq!((quantise_u8(x), quantise_u16(x)), (low, high));
        }
        assert_eq!(quantise_u16(0.5), 32768);
    }
}
