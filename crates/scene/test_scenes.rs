//! Small scenes for the unit tests of what can show.

use glam::{Vec2, Vec3, Vec4};

use crate::model::{Filter, Image, Material, Scene, Texture, TextureRef, Triangle, Volume, Wrap};

/// A triangle for each material, with all attributes but colours.
pub(crate) fn triangles(materials: impl IntoIterator<Item = Material>) -> Scene {
    let mut scene = Scene::default();
    scene.geometry.uv_sets.push(Vec::new());
    for (material, number) in materials.into_iter().zip(0_u32..) {
        let geometry = &mut scene.geometry;
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p + Vec3::Z * number as f32);
        geometry.positions.extend(corners);
        geometry.normals.extend([Vec3::Z; 3]);
        geometry.tangents.extend([Vec4::new(1.0, 0.0, 0.0, 1.0); 3]);
        geometry.uv_sets[0].extend([Vec2::ZERO, Vec2::X, Vec2::Y]);
        geometry.triangles.push(Triangle {
            vertices: [0, 1, 2].map(|corner| 3 * number + corner),
            material: number,
            node: 0,
        });
        scene.materials.push(material);
    }
    scene
}

/// Another image of the scene, a texel high, and a texture of it, not sRGB-encoded and not filtered.
pub(crate) fn texture(scene: &mut Scene, texels: &[[u8; 4]]) -> TextureRef {
    scene.images.push(Image {
        name: format!("image {}", scene.images.len()),
        width: texels.len() as u32,
        height: 1,
        texels: texels.to_vec(),
    });
    scene.textures.push(Texture {
        image: scene.images.len() as u32 - 1,
        wrap_u: Wrap::Repeat,
        wrap_v: Wrap::Repeat,
        filter: Filter::Nearest,
        srgb: false,
    });
    TextureRef {
        texture: scene.textures.len() as u32 - 1,
        uv_set: 0,
        transform: TextureRef::IDENTITY,
    }
}

/// Smooth, and what transmits shows no metal.
pub(crate) fn dielectric() -> Material {
    Material {
        metallic: 0.0,
        roughness: 0.0,
        ..Material::default()
    }
}

pub(crate) fn pane() -> Material {
    Material {
        transmission: 1.0,
        ..dielectric()
    }
}

pub(crate) fn glass() -> Material {
    Material {
        volume: Some(Volume {
            attenuation_color: Vec3::ONE,
            attenuation_distance: f64::INFINITY,
        }),
        ..pane()
    }
}
