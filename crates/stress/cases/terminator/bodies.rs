//! Convex closed bodies around the origin whose shading normals are far from those of their facets.

use std::f64::consts::FRAC_PI_4;

use glam::{DVec3, Vec2, Vec3};
use raytree_scene::model::{Filter, Image, Material, Scene, Texture, TextureRef, Wrap};

use crate::{
    meshes::{Mesh, ellipsoid, terrain_box},
    random::Random,
};

/// The steepest shading normal, from the facet's own, radians.
const STEEPEST: f64 = 89.9 / 180.0 * std::f64::consts::PI;

/// Those whose normals are 45 degrees off reflect a look straight down along their facets.
pub(super) fn bodies() -> [Mesh; 6] {
    [
        plain(ellipsoid("a smooth ball", Vec3::ZERO, Vec3::ONE, 1)),
        plain(ellipsoid("a smooth ball", Vec3::ZERO, Vec3::ONE, 3)),
        plain(tilted(
            ellipsoid("normals up to 89.9 degrees off", Vec3::ZERO, Vec3::ONE, 4),
            |random| STEEPEST * random.unit().sqrt(),
        )),
        plain(tilted(
            terrain_box("a box with normals 45 degrees off", 1, 0.0),
            |_| FRAC_PI_4,
        )),
        plain(tilted(
            ellipsoid(
                "a ball with normals 45 degrees off",
                Vec3::ZERO,
                Vec3::ONE,
                24,
            ),
            |_| FRAC_PI_4,
        )),
        mapped(plain(ellipsoid("a normal map", Vec3::ZERO, Vec3::ONE, 3))),
    ]
}

/// Of a white diffuse material: what arrives is what is seen.
fn plain(mut mesh: Mesh) -> Mesh {
    mesh.scene.materials = vec![Material {
        double_sided: true,
        ..crate::scenes::matte([1.0; 3])
    }];
    mesh
}

/// Each triangle with normals of its own, each corner's turned away from the facet's by `angle`, to anywhere.
fn tilted(mut mesh: Mesh, angle: impl Fn(&mut Random) -> f64) -> Mesh {
    let mut random = Random::new(47);
    let geometry = &mut mesh.scene.geometry;
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    for triangle in &mut geometry.triangles {
        let corners = triangle
            .vertices
            .map(|vertex| geometry.positions[vertex as usize]);
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let facet = (b - a).cross(c - a).normalize();
        // The same for all three: interpolated ones would lie less far off.
        let aside = facet.cross(random.direction().as_dvec3()).normalize();
        let (sin, cos) = angle(&mut random).sin_cos();
        triangle.vertices = [0, 1, 2].map(|k| positions.len() as u32 + k);
        positions.extend(corners);
        normals.extend([(cos * facet + sin * aside).as_vec3(); 3]);
    }
    geometry.positions = positions;
    geometry.normals = normals;
    mesh
}

/// With a map of normals that point anywhere, also inwards.
fn mapped(mut mesh: Mesh) -> Mesh {
    const SIZE: u32 = 16;
    let mut random = Random::new(53);
    let scene: &mut Scene = &mut mesh.scene;
    let texels = (0..SIZE * SIZE).map(|_| {
        let [x, y, z] = random
            .direction()
            .to_array()
            .map(|n| (127.5 + 127.5 * n) as u8);
        [x, y, z, 255]
    });
    scene.images.push(Image {
        name: "normals".to_owned(),
        width: SIZE,
        height: SIZE,
        texels: texels.collect(),
    });
    scene.textures.push(Texture {
        image: 0,
        wrap_u: Wrap::Repeat,
        wrap_v: Wrap::Repeat,
        filter: Filter::Nearest,
        srgb: false,
    });
    scene.materials[0].normal_texture = Some(TextureRef {
        texture: 0,
        uv_set: 0,
        transform: TextureRef::IDENTITY,
    });
    let geometry = &mut scene.geometry;
    let uv = |normal: &Vec3| Vec2::new(normal.x + 0.3 * normal.z, normal.y);
    geometry.uv_sets = vec![geometry.normals.iter().map(uv).collect()];
    let tangent = |normal: &Vec3| {
        let aside = normal
            .as_dvec3()
            .cross(DVec3::new(0.3, 0.4, 0.5))
            .normalize();
        aside.as_vec3().extend(1.0)
    };
    geometry.tangents = geometry.normals.iter().map(tangent).collect();
    mesh
}
