//! Whether two programs give the same picture. On a CPU's drivers to the last bit. Those of GPUs fuse products into sums, in each program
//! in their own way: there a last bit may be another one, and a ray that meets an edge may take its other side.

use raytree::{Counters, Device, Film};

/// Numbers that are equal but for rounding differ by less, of themselves or of 1.
const ROUNDING: f32 = 1e-4;

/// Share of words that may be other ones (rays at edges), and of counters; a few whatever their number.
const OTHER_SHARE: f64 = 0.001;
const FEW: f64 = 8.0;

/// All that is in a picture.
pub struct Words {
    floats: Vec<f32>,
    whole: Vec<u32>,
}

impl Words {
    pub fn of(film: &Film) -> Self {
        let mut floats = vec![film.radiance.as_flattened(), &film.alpha];
        let mut whole: Vec<&[u32]> = Vec::new();
        if let Some(layers) = &film.aovs {
            floats.extend([
                &layers.depth[..],
                layers.position.as_flattened(),
                layers.geometric_normal.as_flattened(),
                layers.shading_normal.as_flattened(),
                layers.albedo.as_flattened(),
            ]);
            whole.extend([&layers.material_id[..], &layers.node_id, &layers.rays]);
        }
        if let Some(estimates) = &film.estimates {
            floats.extend([&estimates.dropped[..], &estimates.sampling]);
            whole.push(&estimates.samples);
        }
        Self {
            floats: floats.concat(),
            whole: whole.concat(),
        }
    }
}

/// How alike two programs' pictures have to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alike {
    /// To the last bit.
    Equal,
    /// But for rounding.
    Rounded,
}

impl Alike {
    pub fn on(device: &Device) -> Self {
        if device.info().cpu {
            Self::Equal
        } else {
            Self::Rounded
        }
    }

    /// In how many words pictures are not alike, if in too many.
    pub fn difference(self, expected: &Words, actual: &Words) -> Option<String> {
        assert_eq!(expected.floats.len(), actual.floats.len());
        assert_eq!(expected.whole.len(), actual.whole.len());
        let floats = expected.floats.iter().zip(&actual.floats);
        let whole = expected.whole.iter().zip(&actual.whole);
        let differing = floats.filter(|(a, b)| !self.is_near(**a, **b)).count()
            + whole.filter(|(a, b)| a != b).count();
        let count = expected.floats.len() + expected.whole.len();
        (!self.is_few(differing as f64, count as f64))
            .then(|| format!("{differing} of {count} words differ"))
    }

    /// What was counted differently, if it is too different. How a tree is walked may depend on the program.
    pub fn counted(self, expected: Option<Counters>, actual: Option<Counters>) -> Option<String> {
        let (expected, actual) = (numbers(expected?), numbers(actual?));
        let few = expected
            .iter()
            .zip(&actual)
            .all(|(a, b)| self.is_few(a.abs_diff(*b) as f64, *a as f64));
        (!few).then(|| format!("counted {expected:?}, not {actual:?}"))
    }

    fn is_near(self, a: f32, b: f32) -> bool {
        match self {
            Self::Equal => a.to_bits() == b.to_bits(),
            Self::Rounded => {
                a.to_bits() == b.to_bits()
                    || (a - b).abs() <= ROUNDING * a.abs().max(b.abs()).max(1.0)
            }
        }
    }

    fn is_few(self, differing: f64, count: f64) -> bool {
        match self {
            Self::Equal => differing == 0.0,
            Self::Rounded => differing <= OTHER_SHARE * count + FEW,
        }
    }
}

/// Rays by kind, and why branches ended.
fn numbers(Counters { rays, ended, .. }: Counters) -> [u64; 10] {
    [
        rays.primary,
        rays.shadow,
        rays.reflection,
        rays.refraction,
        ended.miss,
        ended.depth,
        ended.weight,
        ended.tolerance,
        ended.storage,
        ended.budget,
    ]
}
