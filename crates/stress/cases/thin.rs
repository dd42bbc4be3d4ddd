//! Thin things and things in one place: slabs of 1e-6 of the extent, two faces in one plane, a pile of a hundred panes.

use glam::{DMat3, DVec3, EulerRot, Vec3};
use raytree_gpu::{RenderSettings, Rendered, Shading};
use raytree_scene::model::{LightKind, Material, WhittedCoefficients};

use crate::{
    judge::judge_picture,
    report::Limit,
    scenes::{Build, clear_glass, matte, parallel, pinhole},
    stage::{Stage, StressError},
};

/// Of radiance, against the oracle.
const TOLERANCE: f64 = 1e-3;

/// Of the scene's extent.
const THINNESS: f64 = 1e-6;

/// In the pile.
const PANES: u32 = 100;

pub(crate) fn run(stage: &mut Stage<'_>) -> Result<(), StressError> {
    opaque_slabs(stage)?;
    glass_slabs(stage)?;
    faces_in_one_place(stage)?;
    piles(stage)
}

/// How the slabs lie: along no axis.
fn tilted() -> DMat3 {
    DMat3::from_euler(EulerRot::YXZ, 0.5, 0.3, 0.2)
}

/// From above and below, steeply and at a flat angle.
fn eyes() -> [(&'static str, Vec3); 4] {
    let from = |y: f64, z: f64| (tilted() * DVec3::new(0.1, y, z)).as_vec3();
    [
        ("from above", from(2.0, 0.3)),
        ("from above, flat", from(0.1, 2.0)),
        ("from below", from(-2.0, 0.3)),
        ("from below, flat", from(-0.1, 2.0)),
    ]
}

fn view(eye: Vec3) -> RenderSettings {
    RenderSettings::new(80, 60, pinhole(eye, Vec3::ZERO, 0.7))
}

/// A square of half side 1 at this height above the tilted plane, its front up or down.
fn sheet(build: &mut Build, height: f64, up: bool, material: u32) {
    let corners = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
    let corners = corners.map(|(x, z)| (tilted() * DVec3::new(x, height, z)).as_vec3());
    let [a, b, c, d] = corners;
    build.quad(if up { corners } else { [d, c, b, a] }, material);
}

/// Its colour and nothing else, in grey light too.
fn plain(base: [f32; 3]) -> Material {
    Material {
        specular: 0.0,
        ..matte(base)
    }
}

/// Red above, blue below, lit from above: what is blue is dark, and nothing blue shows from above nor red from below.
fn opaque_slabs(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let mut build = Build::before([0.0; 3]);
    build.0.surroundings.ambient = Vec3::splat(0.1);
    let red = build.material(plain([1.0, 0.0, 0.0]));
    let blue = build.material(plain([0.0, 0.0, 1.0]));
    sheet(&mut build, 0.0, true, red);
    sheet(&mut build, -2.0 * THINNESS, false, blue);
    let light = LightKind::Point {
        position: tilted() * DVec3::new(0.3, 1.5, -0.4),
        range: f64::INFINITY,
    };
    build.light(light, 3.0);
    for (name, eye) in eyes() {
        let settings = view(eye);
        let film = stage.render(&build.0, &settings)?.film;
        let hidden = if name.contains("above") { 2 } else { 0 };
        let leaks = film.radiance.iter().filter(|c| c[hidden] != 0.0).count();
        let judged = judge_picture(&build.0, &settings, &film, TOLERANCE);
        stage.record(
            format!("opaque slab {name}: pixels that show the far side"),
            leaks as f64,
            Limit::AtMost(0.0),
        );
        stage.record(
            format!("opaque slab {name}: light and shadow against the oracle"),
            judged.worst,
            Limit::AtMost(TOLERANCE),
        );
    }
    Ok(())
}

/// A pane of glass over a coloured floor.
fn glass_slabs(stage: &mut Stage<'_>) -> Result<(), StressError> {
    let mut build = Build::before([0.9, 0.8, 0.7]);
    build.0.surroundings.ambient = Vec3::splat(0.5);
    let clear = build.material(clear_glass(1.5));
    let floor = build.material(matte([0.2, 0.5, 0.8]));
    sheet(&mut build, 0.0, true, clear);
    sheet(&mut build, -2.0 * THINNESS, false, clear);
    sheet(&mut build, -0.3, true, floor);
    sheet(&mut build, -0.3, false, floor);
    for (name, eye) in eyes() {
        let settings = view(eye);
        let film = stage.render(&build.0, &settings)?.film;
        let judged = judge_picture(&build.0, &settings, &film, TOLERANCE);
        stage.record(
            format!("glass slab {name}: against the oracle"),
            judged.worst,
            Limit::AtMost(TOLERANCE),
        );
    }
    Ok(())
}

/// Two squares in one plane, the first red, the second green: the first one wins, wherever one looks from.
fn faces_in_one_place(stage: &mut Stage<'_>) -> Result<(), StressError> {
    for (name, turned, size) in [
        ("the same triangles", 0, 1.0),
        ("the other diagonal", 1, 1.0),
        ("another size", 1, 1.37),
    ] {
        let mut build = Build::before([0.0; 3]);
        build.0.surroundings.ambient = Vec3::ONE;
        let red = build.material(plain([1.0, 0.0, 0.0]));
        let green = build.material(plain([0.0, 1.0, 0.0]));
        let mut corners = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)]
            .map(|(x, z): (f32, f32)| Vec3::new(x, 0.25, z));
        build.quad(corners, red);
        let first = build.clone();
        corners.rotate_left(turned);
        build.quad(
            corners.map(|corner| Vec3::new(size, 1.0, size) * corner),
            green,
        );
        let mut others = 0;
        let mut holes = 0;
        for (_, eye) in &eyes()[..2] {
            let alone = stage.render(&first.0, &view(*eye))?.film;
            let film = stage.render(&build.0, &view(*eye))?.film;
            let pixels = film.radiance.iter().zip(&alone.radiance);
            others += pixels
                .filter(|(c, alone)| alone[0] > 0.0 && c[1] > 0.0)
                .count();
            holes += film
                .radiance
                .iter()
                .filter(|&&[r, g, _]| r + g != 0.0 && r + g != 1.0)
                .count();
        }
        stage.record(
            format!("two faces in one place, {name}: pixels of the second"),
            others as f64,
            Limit::AtMost(0.0),
        );
        stage.record(
            format!("two faces in one place, {name}: pixels of neither"),
            holes as f64,
            Limit::AtMost(0.0),
        );
    }
    Ok(())
}

/// What a pile of panes is made of.
#[derive(Clone, Copy, Debug)]
enum Pane {
    /// One surface, straight through.
    Wall,
    /// Two surfaces with glass between.
    Solid,
}

impl Pane {
    fn surfaces(self) -> u32 {
        match self {
            Self::Wall => PANES,
            Self::Solid => 2 * PANES,
        }
    }
}

/// A hundred panes before a lamp of radiance 1, seen at normal incidence: what is seen is their transmittance.
fn pile(pane: Pane, material: Material) -> Build {
    let mut build = Build::before([0.0; 3]);
    let material = build.material(material);
    let lamp = build.material(Material {
        emissive: Vec3::ONE,
        specular: 0.0,
        ..matte([0.0; 3])
    });
    let depth = |k: u32| -0.5 + k as f32 / PANES as f32;
    for k in 0..PANES {
        build.square(Vec3::new(0.0, 0.0, depth(k)), Vec3::Z, 0.5, material);
        if let Pane::Solid = pane {
            let back = depth(k) - 0.3 / PANES as f32;
            build.square(Vec3::new(0.0, 0.0, back), Vec3::NEG_Z, 0.5, material);
        }
    }
    build.square(Vec3::new(0.0, 0.0, -0.8), Vec3::Z, 0.5, lamp);
    build
}

/// Transmittance of a pile of `surfaces` that each reflect `r` and transmit the rest, all orders of reflection (Stokes 1862).
fn stokes(surfaces: u32, r: f64) -> f64 {
    (1.0 - r) / (1.0 + (f64::from(surfaces) - 1.0) * r)
}

/// One surface of index `ior` at normal incidence.
fn normal_reflectance(ior: f32) -> f64 {
    let ior = f64::from(ior);
    ((ior - 1.0) / (ior + 1.0)).powi(2)
}

fn piles(stage: &mut Stage<'_>) -> Result<(), StressError> {
    const IOR: f32 = 1.05;
    let r = normal_reflectance(IOR);
    let book = |r: f64| Material {
        whitted: Some(WhittedCoefficients {
            ka: Some(0.0),
            kd: Some(0.0),
            ks: Some(Vec3::splat(r as f32)),
            n: None,
            kt: Some(Vec3::splat(1.0 - r as f32)),
            ior: Some(IOR),
        }),
        ..Material::default()
    };
    let wall = Material {
        volume: None,
        double_sided: true,
        ..clear_glass(IOR)
    };
    for (name, pane, material, shading) in [
        ("thin panes, pbr", Pane::Wall, wall, Shading::Pbr),
        (
            "solid panes, pbr",
            Pane::Solid,
            clear_glass(IOR),
            Shading::Pbr,
        ),
        (
            "solid panes, whitted",
            Pane::Solid,
            book(r),
            Shading::Whitted,
        ),
    ] {
        let build = pile(pane, material);
        let settings = |max_depth, min_weight| RenderSettings {
            shading,
            max_depth,
            min_weight,
            // The whole tree is wanted: more than the default budget, which would say that it dropped some of it.
            max_rays: 1 << 24,
            ..pixel()
        };
        let expected = stokes(pane.surfaces(), r);
        // Two reflections weigh 3.5e-7: with them, and without those of four.
        if let Pane::Wall = pane {
            let seen = transmitted(&stage.render(&build.0, &settings(600, 1e-8))?);
            stage.record(
                format!("{PANES} {name}: against Stokes' formula"),
                (seen - expected).abs(),
                Limit::AtMost(1e-5),
            );
        }
        let coarse = settings(600, 1e-3);
        let rendered = stage.render(&build.0, &coarse)?;
        let missing = expected - transmitted(&rendered);
        let said = dropped(&rendered) * f64::from(coarse.min_weight);
        stage.record_with(
            format!("{PANES} {name}: missing light, of what is said to be dropped"),
            missing / said,
            Limit::AtMost(1.0),
            format!(
                "{missing:.2e} is missing; the branches that ended by weight bound it by {said:.2e}"
            ),
        );
        let judged = judge_picture(&build.0, &coarse, &rendered.film, 1e-5);
        stage.record(
            format!("{PANES} {name}: against the oracle"),
            judged.worst,
            Limit::AtMost(1e-5),
        );
        let shallow = stage.render(&build.0, &settings(8, 1e-3))?;
        let ended = shallow.counters.map_or(0, |counters| counters.ended.depth);
        stage.record(
            format!("{PANES} {name}, depth 8: branches said to end by depth"),
            ended as f64,
            Limit::AtLeast(1.0),
        );
    }
    Ok(())
}

/// One ray through the middles of all panes.
fn pixel() -> RenderSettings {
    let from = Vec3::new(0.1, 0.05, 2.0);
    RenderSettings::new(1, 1, parallel(from, from - 4.0 * Vec3::Z, 1e-6))
}

fn transmitted(rendered: &Rendered) -> f64 {
    f64::from(rendered.film.radiance[0][0])
}

/// Branches that were not followed because of their weight.
fn dropped(rendered: &Rendered) -> f64 {
    let counters = rendered.counters.as_ref();
    counters.map_or(0.0, |counters| counters.ended.weight as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pile_of_plates_by_adding_one_at_a_time() {
        // R and T of a plate added to a pile: T' = T t/(1 - R r).
        let r = 0.04;
        let (mut reflected, mut transmitted): (f64, f64) = (r, 1.0 - r);
        for surfaces in 2..=200 {
            let between = 1.0 - reflected * r;
            reflected += transmitted * transmitted * r / between;
            transmitted *= (1.0 - r) / between;
            assert!((stokes(surfaces, r) - transmitted).abs() < 1e-12);
            assert!((reflected + transmitted - 1.0).abs() < 1e-12);
        }
    }
}
