//! A scene without what can't show: textures that have one value everywhere become part of the factor that they multiply; images,
//! UV sets, tangents, vertex colours and lights that then make no difference are dropped. What the renderer leaves out of its
//! program and its buffers is decided by what is left ([`crate::features`]).
//!
//! The picture stays the same, to the last bit but for this: filtering between texels of one value `c` by weights that add up to 1
//! gives `c` but for the rounding of their sum, and a normal map scaled by zero leaves a normal that has been normalised once
//! more. What remains here is what is meant: `c` itself, the normal itself. (A driver that does not round divisions
//! correctly decodes texels less exactly than this does, too.)
//!
//! An occlusion of one value other than 1 has no factor to go into and stays. So does a normal map of one value: no code of 8 bits is
//! 1/2, so that each bends normals, (128, 128, 255) by 0.3 degrees.

use glam::{Vec3, Vec4, Vec4Swizzles};

use crate::environment::LARGEST_RADIANCE;
use crate::features::{may_bound_solid, transmits};
use crate::model::{AlphaMode, Material, Scene, TextureRef};
use crate::shown::{
    MaterialUse, bends_normals, colors_show, constant, is_never_seen_through, material_uses,
    shown_channels,
};

/// Leaves out of `scene` what can't show; see the module. Materials, nodes and triangles keep their numbers.
///
/// Whoever asks whether the scene has lights gets the same answer before and after: of lights that all are dark, one stays.
pub fn simplify(scene: &mut Scene) {
    let uses = material_uses(scene);
    let used = || scene.materials.iter().zip(&uses);
    let has_solids = used().any(|(material, used)| used.used && may_bound_solid(material));
    let materials = used()
        .map(|(material, used)| simplified(scene, material, *used, has_solids))
        .collect();
    scene.materials = materials;
    drop_unread_attributes(scene, &uses);
    drop_unread_images(scene);
    drop_dark_lights(scene);
}

fn simplified(scene: &Scene, source: &Material, used: MaterialUse, has_solids: bool) -> Material {
    let mut material = source.clone();
    if !used.used {
        for slot in material.texture_slots_mut() {
            *slot = None;
        }
        return material;
    }
    // What lies on the face of a solid belongs to it if it is opaque and not if it could be seen through (shaders/README.md,
    // "Contact"): there a material stays what the file says it is.
    if !has_solids && is_never_seen_through(scene, source, used) {
        material.alpha_mode = AlphaMode::Opaque;
    }
    let mut folded = fold_constants(scene, &material);
    if transmits(source) && !transmits(&folded) {
        if has_solids {
            return material;
        }
        // Backs of what transmits are seen.
        folded.double_sided = true;
    }
    folded
}

/// The material with the textures that have one value, as far as it shows, multiplied into its factors.
fn fold_constants(scene: &Scene, source: &Material) -> Material {
    let slots = source.texture_slots();
    let shown = shown_channels(source);
    let [
        base,
        metal,
        _,
        occlusion,
        emissive,
        transmission,
        specular,
        tint,
    ] = std::array::from_fn(|k| slots[k].and_then(|texture| constant(scene, texture, shown[k])));
    let mut m = source.clone();
    fold(&mut m.base_color_texture, base, |v| m.base_color *= v);
    fold(&mut m.metallic_roughness_texture, metal, |v| {
        m.roughness *= v.y;
        m.metallic *= v.z;
    });
    let white = occlusion.filter(|value| value.x == 1.0);
    fold(&mut m.occlusion_texture, white, |_| {});
    fold(&mut m.emissive_texture, emissive, |v| {
        // The factor is brought down first, as it is where there is a texture.
        m.emissive = m.emissive.min(Vec3::splat(LARGEST_RADIANCE)) * v.xyz();
    });
    fold(&mut m.transmission_texture, transmission, |v| {
        m.transmission *= v.x;
    });
    fold(&mut m.specular_texture, specular, |v| m.specular *= v.w);
    fold(&mut m.specular_color_texture, tint, |v| {
        m.specular_color *= v.xyz();
    });
    if !bends_normals(scene, source) {
        m.normal_texture = None;
    }
    m
}

fn fold(slot: &mut Option<TextureRef>, value: Option<Vec4>, apply: impl FnOnce(Vec4)) {
    if let Some(value) = value {
        *slot = None;
        apply(value);
    }
}

/// `uses`: of the scene's materials. Vertex colours show as they did before textures were folded, or less.
fn drop_unread_attributes(scene: &mut Scene, uses: &[MaterialUse]) {
    let mut read: Vec<u32> = textures_read(scene).map(|texture| texture.uv_set).collect();
    keep_read(&mut scene.geometry.uv_sets, &mut read);
    for texture in textures_read_mut(&mut scene.materials) {
        texture.uv_set = renumbered(&read, texture.uv_set);
    }
    if scene.materials.iter().all(|m| m.normal_texture.is_none()) {
        scene.geometry.tangents = Vec::new();
    }
    let mut materials = scene.materials.iter().zip(uses);
    if !materials.any(|(material, used)| colors_show(material, *used)) {
        scene.geometry.colors = Vec::new();
    }
}

fn drop_unread_images(scene: &mut Scene) {
    let mut read: Vec<u32> = textures_read(scene)
        .map(|texture| texture.texture)
        .collect();
    keep_read(&mut scene.textures, &mut read);
    for texture in textures_read_mut(&mut scene.materials) {
        texture.texture = renumbered(&read, texture.texture);
    }
    let mut read: Vec<u32> = scene.textures.iter().map(|texture| texture.image).collect();
    keep_read(&mut scene.images, &mut read);
    for texture in &mut scene.textures {
        texture.image = renumbered(&read, texture.image);
    }
}

fn textures_read(scene: &Scene) -> impl Iterator<Item = &TextureRef> {
    scene.materials.iter().flat_map(Material::texture_refs)
}

fn textures_read_mut(materials: &mut [Material]) -> impl Iterator<Item = &mut TextureRef> {
    let slots = materials.iter_mut().flat_map(Material::texture_slots_mut);
    slots.flatten()
}

/// Keeps the elements that `read` names; what is left of `read` are their old numbers, in order.
fn keep_read<T>(list: &mut Vec<T>, read: &mut Vec<u32>) {
    read.sort_unstable();
    read.dedup();
    let mut number = 0;
    list.retain(|_| {
        number += 1;
        read.binary_search(&(number - 1)).is_ok()
    });
}

/// The new number of what was `old`.
fn renumbered(read: &[u32], old: u32) -> u32 {
    read.partition_point(|&number| number < old) as u32
}

fn drop_dark_lights(scene: &mut Scene) {
    if scene.lights.iter().any(|light| light.shines()) {
        scene.lights.retain(|light| light.shines());
    } else {
        scene.lights.truncate(1);
    }
}

#[cfg(test)]
#[path = "simplify_tests.rs"]
mod tests;
