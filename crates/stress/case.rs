//! Which cases there are, and running them.

use raytree_gpu::Device;

use crate::{
    cases,
    report::{Report, Row},
    stage::{Stage, StressError},
};

/// One stiff or extreme case: a family of scenes or rays, and what has to come out.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// What `--only` calls it.
    pub name: &'static str,
    /// What it tries, in one line.
    pub about: &'static str,
    /// Measures, and records rows.
    pub(crate) run: fn(&mut Stage<'_>) -> Result<(), StressError>,
}

macro_rules! cases {
    ($($name:ident $about:literal,)*) => {
        /// Every case, in the order in which they run.
        pub const CASES: &[Case] = &[$(
            Case { name: stringify!($name), about: $about, run: cases::$name::run },
        )*];
    };
}

cases! {
    fresnel "reflection and refraction at indices from 1/1000 to 1000, to within 1e-6 rad of grazing and critical angles",
    thin "slabs of 1e-6 of the extent, faces in one place, a pile of a hundred panes",
    shading "exponents, roughness, tangents, texture coordinates and sizes at their extremes",
    scale "our own scenes from 10^-12 to 10^12 times their size",
    watertight "no ray escapes from inside a closed mesh",
    self_hits "rays that leave a surface hit neither it nor miss its neighbours",
    media "glass in water, bubbles, faces that coincide, overlaps, cameras inside solids, open meshes",
    trees "mirrors a thousand deep, and trees of 2^64 rays",
    geometry "triangles without area, infinite, NaN, inside out, twice, of aspect 10^7",
    lights "intensities of 10^-30 to 10^30, lights on surfaces and in solids, 10,000 of them, infinities",
}

/// Which cases to run.
#[derive(Clone, Debug, Default)]
pub struct Selection(Vec<&'static str>);

/// There is no case of that name.
#[derive(Debug, thiserror::Error)]
#[error("there is no stress case \"{name}\"; the cases are {}", names())]
pub struct UnknownCase {
    name: String,
}

fn names() -> String {
    let names: Vec<&str> = CASES.iter().map(|case| case.name).collect();
    names.join(", ")
}

impl Selection {
    /// The whole suite.
    #[must_use]
    pub fn all() -> Self {
        Self(CASES.iter().map(|case| case.name).collect())
    }

    /// The cases of these names, in the suite's own order.
    ///
    /// # Errors
    /// [`UnknownCase`].
    pub fn only<'a>(names: impl IntoIterator<Item = &'a str>) -> Result<Self, UnknownCase> {
        let known = |name: &str| {
            let case = CASES.iter().find(|case| case.name == name);
            case.map(|case| case.name).ok_or_else(|| UnknownCase {
                name: name.to_owned(),
            })
        };
        names
            .into_iter()
            .map(known)
            .collect::<Result<_, _>>()
            .map(Self)
    }

    fn contains(&self, case: &Case) -> bool {
        self.0.contains(&case.name)
    }
}

/// Runs the selected cases one after another. `observer` hears of each row as soon as it is measured.
pub fn run(device: &Device, selection: &Selection, observer: &mut dyn FnMut(&Row)) -> Report {
    let mut rows = Vec::new();
    for case in CASES.iter().filter(|case| selection.contains(case)) {
        let mut stage = Stage::new(device, case.name, observer);
        if let Err(error) = (case.run)(&mut stage) {
            stage.fail("the case itself", error.to_string());
        }
        rows.extend(stage.into_rows());
    }
    Report {
        device: device.info().clone(),
        rows,
    }
}
