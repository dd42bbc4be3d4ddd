//! Which cases there are, and running them.

use raytree_gpu::{Device, Numerics};

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
    place "our own scenes moved by up to 10^9 times their extent, and a small thing anywhere on a large plane",
    cameras "extreme fields of view, and cameras far away, on a vertex, on an edge, inside a wall",
    watertight "no ray escapes from inside a closed mesh",
    terminator "shading normals far off the facet: no light through the back, no reflected ray into it",
    self_hits "rays that leave a surface hit neither it nor miss its neighbours",
    boxes "100,000 triangles in one place, slivers across the scene, one triangle, none",
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

/// The tolerance, in scene units, that serves a tracer best that has nothing else: of 1e-3, 1e-4, 1e-5 and 1e-6 the one with the
/// fewest false hits, missed neighbours and escaped rays of the cases `self_hits` and `watertight` together.
pub const BOOK_TOLERANCE: f32 = 1e-4;

/// Runs the selected cases one after another. `observer` hears of each row as soon as it is measured.
pub fn run(device: &Device, selection: &Selection, observer: &mut dyn FnMut(&Row)) -> Report {
    let rows = selected(selection)
        .flat_map(|case| rows_of(device, case, Numerics::default(), observer))
        .collect();
    Report {
        device: device.info().clone(),
        rows,
    }
}

/// As [`run`], and each case a second time as the book has it (Foley et al., 14.7): rays start in the computed hit point, hits
/// nearer than `tolerance` (scene units) are ignored, and nothing else is done against rounding. [`Row::book`] has its figures.
pub fn run_beside_book(
    device: &Device,
    selection: &Selection,
    tolerance: f32,
    observer: &mut dyn FnMut(&Row),
) -> Report {
    let mut rows = Vec::new();
    for case in selected(selection) {
        let mut ours = rows_of(device, case, Numerics::default(), observer);
        let book = rows_of(device, case, Numerics::book(tolerance), &mut |_| {});
        set_beside(&mut ours, &book);
        rows.extend(ours);
    }
    Report {
        device: device.info().clone(),
        rows,
    }
}

fn selected(selection: &Selection) -> impl Iterator<Item = &'static Case> {
    CASES.iter().filter(|case| selection.contains(case))
}

fn rows_of(
    device: &Device,
    case: &Case,
    numerics: Numerics,
    observer: &mut dyn FnMut(&Row),
) -> Vec<Row> {
    let mut stage = Stage::new(device, case.name, numerics, observer);
    if let Err(error) = (case.run)(&mut stage) {
        stage.fail("the case itself", error.to_string());
    }
    stage.into_rows()
}

/// The figures of the book's run beside those of the same name; of rows that share one, in the order in which they came.
fn set_beside(ours: &mut [Row], book: &[Row]) {
    let mut left: Vec<&Row> = book.iter().collect();
    for row in ours {
        if let Some(index) = left
            .iter()
            .position(|other| other.parameter == row.parameter)
        {
            row.book = Some(left.remove(index).measured);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Limit;

    fn row(parameter: &str, measured: f64) -> Row {
        Row {
            case: "scale",
            parameter: parameter.to_owned(),
            measured,
            book: None,
            limit: Limit::AtMost(0.0),
            rays: 0,
            seconds: 0.0,
            note: None,
        }
    }

    #[test]
    fn the_book_s_figures_go_to_the_rows_of_the_same_name() {
        let mut ours = [row("a", 1.0), row("b", 2.0), row("a", 3.0), row("c", 4.0)];
        set_beside(&mut ours, &[row("a", 10.0), row("b", 20.0), row("a", 30.0)]);
        let book = ours.map(|row| row.book);
        assert_eq!(book, [Some(10.0), Some(20.0), Some(30.0), None]);
    }
}
