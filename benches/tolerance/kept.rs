//! Whether tolerances are kept, and how good the estimate of the error is: small pictures against references that were made in another way
//! (`tests/support/reference.rs`). Of our scenes they are kept in `tests/tolerance/`, of others in the target folder.

use std::path::{Path, PathBuf};

use raytree::{Device, Picture, RenderSettings, Tolerance};

use crate::{
    reference::{Reference, rmse},
    support::{
        self,
        findings::{Bar, Findings},
        frames::Subject,
        summary::Spread,
    },
};

/// That of the references.
pub const SIZE: (u32, u32) = (64, 48);

/// Of the pictures, those with an estimate below the error, and what the estimate is of the error in the mean.
const BELOW_BAR: Bar = Bar::AtMost(0.01);
const MEAN_BAR: Bar = Bar::AtMost(5.0);

/// A picture to a tolerance.
pub struct Kept {
    name: String,
    tolerance: f32,
    error: f64,
    /// Of the reference.
    uncertainty: f64,
    /// By the reference.
    is_told: bool,
    estimated: f64,
    says_so: bool,
    samples: f64,
    rays: f64,
    seconds: f64,
}

impl Kept {
    /// Without what the reference is off by: two errors that know nothing of each other.
    fn own_error(&self) -> f64 {
        let square = self.error.powi(2) - self.uncertainty.powi(2);
        square.max(0.0).sqrt()
    }

    fn is_kept(&self) -> bool {
        self.own_error() <= f64::from(self.tolerance)
    }

    fn effectivity(&self) -> f64 {
        self.estimated / self.own_error()
    }
}

impl std::fmt::Display for Kept {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let told = match (self.is_told, self.is_kept(), self.says_so) {
            (false, ..) => ", the reference is too far off to tell",
            (true, false, false) => ", NOT KEPT, and says so",
            (true, false, true) => ", NOT KEPT",
            (true, true, false) => ", says that it is not kept",
            (true, true, true) => "",
        };
        write!(
            f,
            "{:<28} {:<6} error {:.6} (reference {:.6}), estimated {:.6}: x{:.2}; {:.1} samples a pixel, {:.1} rays each, {:.2} s{told}",
            self.name,
            self.tolerance,
            self.error,
            self.uncertainty,
            self.estimated,
            self.effectivity(),
            self.samples,
            self.rays,
            self.seconds,
        )
    }
}

/// A reference for pictures of that size.
pub fn reference(
    device: &Device,
    subject: &Subject,
    is_ours: bool,
    base: &RenderSettings,
) -> Reference {
    let folder: PathBuf = if is_ours {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tolerance")
    } else {
        support::target().join("tolerance")
    };
    Reference::read(&folder, &subject.name).unwrap_or_else(|| {
        let made = Reference::make(device, &subject.scene, base);
        made.write(&folder, &subject.name);
        made
    })
}

/// A scene's pictures.
pub fn pictures(
    device: &Device,
    subject: &Subject,
    is_ours: bool,
    tolerances: &[f32],
) -> Vec<Kept> {
    let base = RenderSettings {
        width: SIZE.0,
        height: SIZE.1,
        ..subject.settings.clone()
    };
    let reference = reference(device, subject, is_ours, &base);
    let picture = |&tolerance: &f32| {
        let settings = RenderSettings {
            counters: true,
            ..base.clone().to_tolerance(Tolerance::absolute(tolerance))
        };
        let ready = subject.prepared(device, &settings);
        let rendered = ready
            .render(&mut raytree::unobserved)
            .unwrap_or_else(|error| panic!("{error}"));
        let report = rendered.error.expect("a tolerance was asked for");
        let rays = rendered.counters.expect("they were asked for").rays.total();
        let error = rmse(&reference.picture, &Picture::from(&rendered.film));
        let kept = Kept {
            name: subject.name.clone(),
            tolerance,
            error,
            is_told: reference.tells(error),
            uncertainty: reference.error.total(),
            estimated: report.estimated_rmse,
            says_so: report.keeps_tolerance(),
            samples: report.samples as f64 / f64::from(SIZE.0 * SIZE.1),
            rays: rays as f64 / report.samples as f64,
            seconds: rendered.times.render.as_secs_f64(),
        };
        println!("{kept}");
        kept
    };
    tolerances.iter().map(picture).collect()
}

/// Of all pictures.
pub fn tell(pictures: &[Kept], findings: &mut Findings) {
    let told: Vec<&Kept> = pictures.iter().filter(|kept| kept.is_told).collect();
    if told.is_empty() {
        println!("no picture can be told");
        return;
    }
    let share = |of: &dyn Fn(&Kept) -> bool| {
        let count = told.iter().filter(|kept| of(kept)).count();
        count as f64 / told.len().max(1) as f64
    };
    let ratios = Spread::of(told.iter().map(|kept| kept.effectivity()));
    let mean = told.iter().map(|kept| kept.effectivity()).sum::<f64>() / told.len().max(1) as f64;
    println!(
        "{} of {} pictures can be told; estimates are {:.2} to {:.2} times the error",
        told.len(),
        pictures.len(),
        ratios.least,
        ratios.most
    );
    let mut figure = |name: &str, value: f64, bar: Bar| {
        let one = Spread::of([value]);
        findings.figure(name, one, bar, one.record(name, "x", ""));
    };
    let is_broken = |kept: &Kept| !kept.is_kept();
    figure("tolerance/kept/broken", share(&is_broken), Bar::AtMost(0.0));
    let is_below = |kept: &Kept| kept.effectivity() < 1.0;
    figure(
        "tolerance/kept/estimates below",
        share(&is_below),
        BELOW_BAR,
    );
    figure("tolerance/kept/effectivity", mean, MEAN_BAR);
}
