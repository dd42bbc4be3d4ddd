//! References for pictures to a tolerance: made of much larger pictures without any, so that nothing of how samples are ordered, placed and
//! added up there is in them.
//!
//! The larger picture has `scale` pixels to each of the small one's, along both sides, each with a few samples; the small one's pixels
//! are its sums by the reconstruction filter's density: tens of thousands of samples each, which neighbours share. What the larger
//! one's own filter blurs is taken from the density's width.

use std::{
    fs,
    path::{Path, PathBuf},
};

use raytree::{
    Camera, CompareOptions, Device, Picture, Preset, RenderSettings, Scene, WriteOptions, compare,
    model::Projection, render,
};
use raytree_film::{FILTER_RADIUS, Film, ReconstructionFilter};
use serde::{Deserialize, Serialize};

/// Pixels around the picture which its filter reaches.
const BORDER: u32 = 2;

/// Two larger pictures: pixels to a pixel along each side, and their samples.
const LARGER: [(u32, u32); 2] = [(24, 9), (19, 16)];

/// They have more samples, 4 times and 16 times as many, until they differ by no more than twice this. So have those of farther trees.
const ENOUGH: f64 = 1.8e-4;

/// What of ray trees is followed, and farther: what that changes is looked for in pictures of few samples, and added.
const TREES: [Trees; 2] = [
    Trees {
        depth: 64,
        weight: 2e-4,
        rays: 1 << 10,
    },
    Trees {
        depth: 128,
        weight: 2e-5,
        rays: 1 << 13,
    },
];

/// Samples of those.
const TREE_SAMPLES: [u32; 2] = [16, 25];

/// Of what following trees farther has changed, what is left to change by following them farther still.
const LEFT: f64 = 0.1;

#[derive(Clone, Copy)]
struct Trees {
    depth: u32,
    weight: f32,
    rays: u32,
}

/// A picture that others are held against.
pub struct Reference {
    pub picture: Picture,
    pub error: Uncertainty,
}

/// What a reference is off by: root mean square, linear radiance.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
pub struct Uncertainty {
    /// Half of what its two halves differ by.
    pub sampling: f64,
    /// What is not known of what trees bring that are followed farther.
    pub trees: f64,
}

impl Uncertainty {
    pub fn total(self) -> f64 {
        self.sampling.hypot(self.trees)
    }
}

impl Reference {
    /// As kept in a folder: NAME.exr and NAME.json.
    pub fn read(folder: &Path, name: &str) -> Option<Self> {
        let [picture, error] = files(folder, name);
        let error = serde_json::from_slice(&fs::read(error).ok()?);
        Some(Self {
            picture: Picture::read(&picture).ok()?,
            error: error.unwrap_or_else(|error| panic!("{name}: {error}")),
        })
    }

    /// Makes it anew: some minutes. Of a scene and settings without a tolerance, for a picture of their size.
    pub fn make(device: &Device, scene: &Scene, settings: &RenderSettings) -> Self {
        let halves_of = |more: u32| {
            LARGER.map(|(scale, samples)| reduced(device, scene, settings, scale, more * samples))
        };
        let halves = alike(halves_of);
        let changes_of = |more: u32| {
            TREE_SAMPLES.map(|samples| {
                let [near, far] = TREES.map(|trees| {
                    let settings = with_trees(settings, trees, more * samples);
                    Picture::from(&rendered(device, scene, &settings))
                });
                combined(&far, &near, |far, near| far - near)
            })
        };
        let [change, other] = &alike(changes_of);
        let nothing = combined(change, change, |_, _| 0.0);
        let error = Uncertainty {
            sampling: 0.5 * rmse(&halves[0], &halves[1]),
            trees: (0.5 * rmse(change, other)).hypot(LEFT * rmse(change, &nothing)),
        };
        let mean = |a: &Picture, b: &Picture| combined(a, b, |a, b| 0.5 * (a + b));
        let picture = mean(&halves[0], &halves[1]);
        let change = mean(change, other);
        Self {
            picture: combined(&picture, &change, |value, change| value + change),
            error,
        }
    }

    /// It is good enough for errors of this size: at most a third of what is found, as squares, is its own.
    pub fn tells(&self, error: f64) -> bool {
        3.0 * self.error.total().powi(2) <= error.powi(2)
    }

    /// Keeps it in a folder.
    pub fn write(&self, folder: &Path, name: &str) {
        fs::create_dir_all(folder).unwrap_or_else(|error| panic!("{error}"));
        let [picture, error] = files(folder, name);
        let mut film = Film::new(self.picture.width, self.picture.height);
        film.radiance.clone_from(&self.picture.rgb);
        film.alpha.fill(1.0);
        film.write(&picture, &WriteOptions::default())
            .unwrap_or_else(|error| panic!("{error}"));
        let text = serde_json::to_string_pretty(&self.error).expect("numbers");
        fs::write(error, text + "\n").unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Two pictures of the same, with as many samples as it takes for them to be alike.
fn alike(both: impl Fn(u32) -> [Picture; 2]) -> [Picture; 2] {
    let mut found = both(1);
    for more in [4, 16] {
        if rmse(&found[0], &found[1]) > 2.0 * ENOUGH {
            found = both(more);
        }
    }
    found
}

/// Of both, channel by channel.
pub fn combined(a: &Picture, b: &Picture, of: impl Fn(f32, f32) -> f32) -> Picture {
    let pairs = a.rgb.iter().zip(&b.rgb);
    let rgb = pairs
        .map(|(a, b)| [0, 1, 2].map(|channel| of(a[channel], b[channel])))
        .collect();
    Picture { rgb, ..a.clone() }
}

fn files(folder: &Path, name: &str) -> [PathBuf; 2] {
    ["exr", "json"].map(|end| folder.join(format!("{name}.{end}")))
}

/// Root mean square over pixels and channels, nothing clipped.
pub fn rmse(expected: &Picture, actual: &Picture) -> f64 {
    let options = CompareOptions {
        clip: false,
        thresholds: Vec::new(),
        flip: false,
    };
    let compared = compare(expected, actual, &options);
    compared.unwrap_or_else(|error| panic!("{error}")).rmse
}

fn with_trees(settings: &RenderSettings, trees: Trees, samples: u32) -> RenderSettings {
    RenderSettings {
        samples,
        max_depth: trees.depth,
        min_weight: trees.weight,
        max_rays: trees.rays,
        ..settings.clone()
    }
}

fn rendered(device: &Device, scene: &Scene, settings: &RenderSettings) -> Film {
    assert!(settings.tolerance.is_none());
    let rendering = render(
        device,
        scene,
        Preset::default(),
        settings,
        &mut raytree::unobserved,
    );
    rendering.unwrap_or_else(|error| panic!("{error}")).film
}

/// The picture, from one that is `scale` times as large.
fn reduced(
    device: &Device,
    scene: &Scene,
    settings: &RenderSettings,
    scale: u32,
    samples: u32,
) -> Picture {
    let (width, height) = (settings.width, settings.height);
    let larger = RenderSettings {
        width: scale * (width + 2 * BORDER),
        height: scale * (height + 2 * BORDER),
        camera: with_border(&settings.camera, width, height),
        ..with_trees(settings, TREES[0], samples)
    };
    let film = rendered(device, scene, &larger);
    let columns = Weights::new(width, scale);
    let rows = Weights::new(height, scale);
    let wide = larger.width as usize;
    let narrow: Vec<[f64; 3]> = film
        .radiance
        .chunks_exact(wide)
        .flat_map(|row| (0..width).map(|x| columns.sum(x, |place| row[place].map(f64::from))))
        .collect();
    let at = |x: u32, place: usize| narrow[place * width as usize + x as usize];
    let mut small = Film::new(width, height);
    for (pixel, radiance) in small.radiance.iter_mut().enumerate() {
        let (x, y) = (pixel as u32 % width, pixel as u32 / width);
        *radiance = rows.sum(y, |place| at(x, place)).map(|value| value as f32);
    }
    Picture::from(&small)
}

/// The camera of a picture with a border around that of `camera`.
fn with_border(camera: &Camera, width: u32, height: u32) -> Camera {
    let more = |side: u32| f64::from(side + 2 * BORDER) / f64::from(side);
    let aspect = f64::from(width) / f64::from(height);
    let projection = match camera.projection {
        Projection::Perspective { yfov, .. } => Projection::Perspective {
            yfov: 2.0 * ((0.5 * yfov).tan() * more(height)).atan(),
            aspect: None,
        },
        Projection::Orthographic { xmag, ymag } => {
            let half_height = ymag.max(xmag / aspect);
            Projection::Orthographic {
                xmag: half_height * aspect * more(width),
                ymag: half_height * more(height),
            }
        }
    };
    Camera {
        projection,
        ..camera.clone()
    }
}

/// The filter along one side: for each pixel the larger picture's pixels that it reaches, and what they weigh.
struct Weights {
    first: Vec<usize>,
    weights: Vec<Vec<f64>>,
}

impl Weights {
    fn new(pixels: u32, scale: u32) -> Self {
        let scale = f64::from(scale);
        // The larger picture is filtered by the same filter, `scale` times as narrow: its variance is in the sum.
        let width = (1.0 - scale.powi(-2)).sqrt();
        let reach = FILTER_RADIUS * width;
        let (first, weights) = (0..pixels)
            .map(|pixel| {
                let middle = f64::from(pixel) + 0.5 + f64::from(BORDER);
                let first = ((middle - reach) * scale - 0.5).ceil();
                let last = ((middle + reach) * scale - 0.5).floor();
                let count = (last - first) as usize + 1;
                let place = |k: usize| (first + k as f64 + 0.5) / scale - middle;
                let density =
                    |k: usize| ReconstructionFilter::BlackmanHarris.density(place(k) / width);
                let weights: Vec<f64> = (0..count).map(density).collect();
                let sum: f64 = weights.iter().sum();
                let weights = weights.into_iter().map(|weight| weight / sum).collect();
                (first as usize, weights)
            })
            .unzip();
        Self { first, weights }
    }

    fn sum(&self, pixel: u32, value: impl Fn(usize) -> [f64; 3]) -> [f64; 3] {
        let (first, weights) = (self.first[pixel as usize], &self.weights[pixel as usize]);
        let weighted = weights.iter().enumerate();
        weighted.fold([0.0; 3], |sum, (k, weight)| {
            let value = value(first + k);
            [0, 1, 2].map(|c| sum[c] + weight * value[c])
        })
    }
}
