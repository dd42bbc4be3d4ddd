//! Which camera, which size, which part: the command line's wishes and the scene's offers.

use glam::DVec3;
use raytree::{
    Camera, Region, RenderSettings, Scene, default_camera, default_size, framing_camera, look_at,
};

use crate::args::ViewArgs;
use crate::failure::Usage;
use crate::values::{CameraChoice, Size};

/// Vertical field of view of a camera from the command line, degrees.
const FOV: f64 = 40.0;

/// Width over height where nothing says otherwise.
const ASPECT: f64 = 4.0 / 3.0;

/// Settings with camera, size and region chosen, all else at its default.
pub fn choose(args: &ViewArgs, scene: &Scene) -> anyhow::Result<RenderSettings> {
    let camera = choose_camera(args, scene)?;
    let (width, height) = args
        .size
        .map_or_else(|| default_size(&camera), |size| (size.width, size.height));
    if let Some(region) = args.region {
        check_region(region, width, height)?;
    }
    Ok(RenderSettings {
        region: args.region,
        ..RenderSettings::new(width, height, camera)
    })
}

fn choose_camera(args: &ViewArgs, scene: &Scene) -> anyhow::Result<Camera> {
    let aspect = args.size.map_or(ASPECT, aspect);
    Ok(match &args.camera {
        _ if args.has_own_camera() => own_camera(args, scene, aspect)?,
        Some(CameraChoice::Auto) => framing_camera(scene, aspect),
        Some(CameraChoice::Named(name)) => named_camera(name, scene)?,
        None if scene.cameras.is_empty() => framing_camera(scene, aspect),
        None => default_camera(scene),
    })
}

fn aspect(size: Size) -> f64 {
    f64::from(size.width) / f64::from(size.height)
}

/// A camera from the command line, which speaks of world space.
fn own_camera(args: &ViewArgs, scene: &Scene, aspect: f64) -> anyhow::Result<Camera> {
    let to_scene = |world: DVec3| scene.frame.to_scene(world);
    let eye = args
        .eye
        .map_or_else(|| framing_camera(scene, aspect).position, to_scene);
    let target = args.target.map_or_else(|| middle(scene), to_scene);
    let yfov = args.fov.unwrap_or(FOV).to_radians();
    Ok(look_at(eye, target, args.up, yfov, "command line")?)
}

/// Of the scene's bounding box, scene space.
fn middle(scene: &Scene) -> DVec3 {
    let (min, max) = scene.bounds().unwrap_or_default();
    0.5 * (min + max)
}

/// By name first, so that a camera called "1" can be had.
fn named_camera(wanted: &str, scene: &Scene) -> Result<Camera, Usage> {
    let by_name = scene.cameras.iter().find(|camera| camera.name == wanted);
    let by_number = || {
        wanted
            .parse()
            .ok()
            .and_then(|index: usize| scene.cameras.get(index))
    };
    by_name
        .or_else(by_number)
        .cloned()
        .ok_or_else(|| no_camera(wanted, scene))
}

fn no_camera(wanted: &str, scene: &Scene) -> Usage {
    let offers: Vec<String> = (0..)
        .zip(&scene.cameras)
        .map(|(index, camera): (usize, _)| format!("{index} '{}'", camera.name))
        .collect();
    let offers = if offers.is_empty() {
        "it has none; use --camera auto, or --eye".to_owned()
    } else {
        format!("it has {}", offers.join(", "))
    };
    Usage(format!("the scene has no camera '{wanted}': {offers}"))
}

fn check_region(region: Region, width: u32, height: u32) -> Result<(), Usage> {
    let Region {
        x,
        y,
        width: w,
        height: h,
    } = region;
    // Sums of numbers up to 65536.
    if x + w <= width && y + h <= height {
        return Ok(());
    }
    Err(Usage(format!(
        "the region {x},{y},{w},{h} reaches beyond the picture, which is {width}x{height}"
    )))
}
