//! Light and background from the command line into the scene.

use raytree::{Environment, Scene, add_studio, light_if_dark, load_environment};

use crate::args::LightingArgs;

/// Lights the scene as asked; whether by the built-in studio. Warnings about an environment map join the scene's.
pub fn apply(args: &LightingArgs, scene: &mut Scene) -> anyhow::Result<bool> {
    if let Some(ambient) = args.ambient {
        scene.surroundings.ambient = ambient;
    }
    scene.surroundings.environment = environment(args, scene)?;
    let studio = if args.studio {
        add_studio(scene);
        true
    } else {
        !args.no_studio && light_if_dark(scene)
    };
    // Last: the studio brings a background of its own.
    if let Some(background) = args.background {
        scene.surroundings.background = background;
    }
    Ok(studio)
}

fn environment(args: &LightingArgs, scene: &mut Scene) -> anyhow::Result<Option<Environment>> {
    let Some(path) = &args.env else {
        return Ok(None);
    };
    let mut loaded = load_environment(path)?;
    scene.warnings.append(&mut loaded.warnings);
    for channel in loaded.map.texels.as_flattened_mut() {
        let scaled = f64::from(*channel) * args.env_strength;
        *channel = scaled.min(f64::from(f32::MAX)) as f32;
    }
    Ok(Some(Environment::new(
        loaded.map,
        args.env_rotation.to_radians(),
    )))
}
