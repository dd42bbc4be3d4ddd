//! What a renderer fills in: radiance and alpha of each pixel, and auxiliary layers (AOVs) where they were asked for.

/// [`Aovs::depth`] of a pixel whose ray hit nothing: large and finite, as Blender writes it, since infinity upsets filters.
pub const MISS_DEPTH: f32 = 1e10;

/// [`Aovs::material_id`] and [`Aovs::node_id`] of a pixel whose ray hit nothing.
pub const NO_ID: u32 = u32::MAX;

/// Where a rendered window lies in the whole picture, in pixels from the whole picture's top left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Pixels across the whole picture.
    pub full_width: u32,
    /// Pixels down the whole picture.
    pub full_height: u32,
    /// The window's leftmost column.
    pub x: u32,
    /// The window's topmost row.
    pub y: u32,
}

/// A rendered picture, or a window of one. Every list has `width * height` entries, row after row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Pixels across the rendered window.
    pub width: u32,
    /// Pixels down the rendered window.
    pub height: u32,
    /// Where the rendered window lies in the whole picture.
    pub window: Window,
    /// Linear Rec. 709 radiance, multiplied by alpha already (what is seen over black).
    pub radiance: Vec<[f32; 3]>,
    /// How much of the pixel is covered, 0 (background alone) to 1.
    pub alpha: Vec<f32>,
    /// Auxiliary layers, if they were rendered.
    pub aovs: Option<Aovs>,
    /// How far each pixel is said to be off, if it was rendered to a tolerance.
    pub estimates: Option<Estimates>,
}

impl Film {
    /// A black, transparent film for the whole of a picture, without auxiliary layers.
    pub fn new(width: u32, height: u32) -> Self {
        let window = Window {
            full_width: width,
            full_height: height,
            x: 0,
            y: 0,
        };
        Self::windowed(width, height, window)
    }

    /// A black, transparent film of `width` x `height` pixels that lies in a larger picture as `window` says.
    pub fn windowed(width: u32, height: u32, window: Window) -> Self {
        let pixels = width as usize * height as usize;
        Self {
            width,
            height,
            window,
            radiance: vec![[0.0; 3]; pixels],
            alpha: vec![0.0; pixels],
            aovs: None,
            estimates: None,
        }
    }

    /// How many pixels the rendered window has.
    pub fn pixel_count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Whoever fills a film fills all of it: anything else is a bug of the caller's.
    pub(crate) fn assert_filled(&self) {
        let pixels = self.pixel_count();
        let whole = self.radiance.len() == pixels
            && self.alpha.len() == pixels
            && self.aovs.as_ref().is_none_or(|aovs| aovs.is_filled(pixels))
            && self
                .estimates
                .as_ref()
                .is_none_or(|estimates| estimates.is_filled(pixels));
        assert!(
            whole,
            "a layer of the film has not {} x {} entries",
            self.width, self.height
        );
    }
}

/// Auxiliary layers (arbitrary output variables): what the camera ray through the middle of each pixel hit. They are never
/// averaged over samples, which would make positions and ids that exist nowhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Aovs {
    /// Distance from the camera along its forward axis (not along the ray), world units (metres); [`MISS_DEPTH`] on a miss.
    pub depth: Vec<f32>,
    /// Hit point, world space; zero on a miss.
    pub position: Vec<[f32; 3]>,
    /// Unit geometric normal on the ray's side, world space; zero on a miss.
    pub geometric_normal: Vec<[f32; 3]>,
    /// Unit shading normal, world space; zero on a miss.
    pub shading_normal: Vec<[f32; 3]>,
    /// Base colour at the hit, linear; zero on a miss.
    pub albedo: Vec<[f32; 3]>,
    /// Index of the material in the scene; [`NO_ID`] on a miss.
    pub material_id: Vec<u32>,
    /// Index of the node in the scene; [`NO_ID`] on a miss.
    pub node_id: Vec<u32>,
    /// Rays of every kind that all samples of the pixel took together.
    pub rays: Vec<u32>,
}

impl Aovs {
    /// The layers of `pixels` pixels that all missed.
    pub fn missed(pixels: usize) -> Self {
        Self {
            depth: vec![MISS_DEPTH; pixels],
            position: vec![[0.0; 3]; pixels],
            geometric_normal: vec![[0.0; 3]; pixels],
            shading_normal: vec![[0.0; 3]; pixels],
            albedo: vec![[0.0; 3]; pixels],
            material_id: vec![NO_ID; pixels],
            node_id: vec![NO_ID; pixels],
            rays: vec![0; pixels],
        }
    }

    fn is_filled(&self, pixels: usize) -> bool {
        let vectors = [
            &self.position,
            &self.geometric_normal,
            &self.shading_normal,
            &self.albedo,
        ];
        let integers = [&self.material_id, &self.node_id, &self.rays];
        self.depth.len() == pixels
            && vectors.iter().all(|layer| layer.len() == pixels)
            && integers.iter().all(|layer| layer.len() == pixels)
    }
}

/// How far each pixel is said to be off: linear radiance, root mean square over its channels, or alpha before a transparent background
/// where that is off by more. The squares of both parts add up.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimates {
    /// What branches of its ray trees would have added which were left out or cut off.
    pub dropped: Vec<f32>,
    /// What lies between its samples: standard error of the mean.
    pub sampling: Vec<f32>,
    /// Samples that the pixel took.
    pub samples: Vec<u32>,
}

impl Estimates {
    fn is_filled(&self, pixels: usize) -> bool {
        [self.dropped.len(), self.sampling.len(), self.samples.len()] == [pixels; 3]
    }
}
