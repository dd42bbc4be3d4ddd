//! The surface where a ray hits: "The surface at a hit" in `shaders/README.md`.

use raytree_scene::model::{AlphaMode, Material, Scene, TextureRef, Triangle};

use crate::fresnel::{Dielectric, Interface};
use crate::intersect::{Hit, Ray};
use crate::media::{Full, Media, Medium};
use crate::render::Shading;
use crate::vec::{Rgb, Vec3};
use crate::{Oracle, material, texture};

/// How far a spawned ray starts from the surface, times the triangle's largest coordinate: some 4000 roundings.
pub(crate) const SPAWN_OFFSET: f64 = 1e-12;

/// Everything about a hit that shading asks for, textures applied.
pub(crate) struct Surface<'s> {
    pub material: &'s Material,
    pub position: Vec3,
    /// Unit, towards where the ray came from.
    pub wo: Vec3,
    /// Unit geometric normal, on the side of `wo`.
    pub ng: Vec3,
    /// Unit shading normal, on the side of `wo`.
    pub ns: Vec3,
    pub base: Rgb,
    pub alpha: f64,
    pub metallic: f64,
    pub roughness: f64,
    pub transmission: f64,
    pub specular: f64,
    pub specular_color: Rgb,
    pub occlusion: f64,
    pub emission: Rgb,
    /// What fills the solid that it bounds.
    pub medium: Option<Medium>,
    /// The material's own index of refraction.
    pub index: f64,
    triangle: usize,
    /// How far from the surface rays start.
    pub spawn_offset: f64,
}

/// What a pixel's first sample sees first, for pictures of single quantities. Scene space.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstHit {
    /// The hit itself.
    pub hit: Hit,
    /// Where it is.
    pub position: [f64; 3],
    /// Unit geometric normal, towards the camera.
    pub geometric_normal: [f64; 3],
    /// Unit shading normal, towards the camera.
    pub shading_normal: [f64; 3],
    /// Base colour: factor, vertex colour and texture.
    pub base: [f64; 3],
    /// Coverage.
    pub alpha: f64,
    /// Index of the material.
    pub material: usize,
    /// Index of the node.
    pub node: usize,
}

impl Oracle<'_> {
    pub(crate) fn triangle(&self, hit: &Hit) -> &Triangle {
        &self.scene.geometry.triangles[hit.triangle]
    }

    pub(crate) fn material(&self, hit: &Hit) -> &Material {
        &self.scene.materials[self.triangle(hit).material as usize]
    }

    /// The material is a MASK, and cut out there.
    pub(crate) fn is_cut_out(&self, hit: &Hit) -> bool {
        let material = self.material(hit);
        match material.alpha_mode {
            AlphaMode::Mask { cutoff } => {
                base_and_alpha(material, &Place::new(&self.scene, self.triangle(hit), hit)).1
                    < f64::from(cutoff)
            }
            AlphaMode::Opaque | AlphaMode::Blend => false,
        }
    }

    pub(crate) fn surface(&self, ray: &Ray, hit: &Hit, shading: Shading) -> Surface<'_> {
        let material = self.material(hit);
        let place = Place::new(&self.scene, self.triangle(hit), hit);
        let wo = -ray.direction.normalized();
        let front = place.geometric_normal();
        let towards_wo = |normal: Vec3| if hit.back { -normal } else { normal };
        let ng = towards_wo(front);
        let ns = towards_wo(place.shading_normal(material, front));

        let (base, alpha) = base_and_alpha(material, &place);
        let [_, rough, metal, _] = place.sample(&material.metallic_roughness_texture);
        let [transmission, ..] = place.sample(&material.transmission_texture);
        let [.., specular] = place.sample(&material.specular_texture);
        let [occlusion, ..] = place.sample(&material.occlusion_texture);
        let rgb = |[r, g, b, _]: [f64; 4]| Rgb::new(r, g, b);
        let unit = |factor: f32, texel: f64| (f64::from(factor) * texel).clamp(0.0, 1.0);
        Surface {
            material,
            position: place.position(),
            wo,
            ng,
            ns: if ns.dot(wo) > 0.0 { ns } else { ng },
            base,
            alpha: if material.alpha_mode == AlphaMode::Blend {
                alpha
            } else {
                1.0
            },
            metallic: unit(material.metallic, metal),
            roughness: unit(material.roughness, rough),
            transmission: unit(material.transmission, transmission),
            specular: unit(material.specular, specular),
            specular_color: Rgb::from(material.specular_color.to_array())
                * rgb(place.sample(&material.specular_color_texture)),
            occlusion: 1.0 + f64::from(material.occlusion_strength) * (occlusion - 1.0),
            emission: Rgb::from(material.emissive.to_array())
                * rgb(place.sample(&material.emissive_texture)),
            medium: material::medium(material, shading),
            index: material::index(material, shading),
            triangle: hit.triangle,
            spawn_offset: place.spawn_offset(),
        }
    }

    /// As [`Self::closest_hit`], but past triangle `from`, which the ray has just left.
    #[must_use]
    pub fn closest_hit_leaving(
        &self,
        from: usize,
        origin: [f64; 3],
        direction: [f64; 3],
        shading: Shading,
    ) -> Option<Hit> {
        let ray = Ray {
            origin: origin.into(),
            direction: direction.into(),
            leaving: Some(from),
        };
        self.closest(&ray, shading)
    }

    pub(crate) fn first_hit_of(&self, ray: &Ray, shading: Shading) -> Option<FirstHit> {
        let hit = self.closest(ray, shading)?;
        let surface = self.surface(ray, &hit, shading);
        Some(FirstHit {
            hit,
            position: surface.position.to_array(),
            geometric_normal: surface.ng.to_array(),
            shading_normal: surface.ns.to_array(),
            base: surface.base.to_array(),
            alpha: surface.alpha,
            material: self.triangle(&hit).material as usize,
            node: self.triangle(&hit).node as usize,
        })
    }
}

impl Surface<'_> {
    /// A ray that leaves the surface, from its own side of it.
    pub fn spawn(&self, direction: Vec3) -> Ray {
        let side = if direction.dot(self.ng) < 0.0 {
            -self.ng
        } else {
            self.ng
        };
        Ray {
            origin: self.position + self.spawn_offset * side,
            direction,
            leaving: Some(self.triangle),
        }
    }

    /// The boundary that a ray in `media` meets, where it is in `beyond` when it has gone through.
    pub fn interface(&self, media: &Media, beyond: &Result<Media, Full>) -> Interface {
        let index = match (self.medium, beyond) {
            (Some(_), Ok(beyond)) => beyond.index(),
            _ => self.index,
        };
        Interface::new(media.index(), index)
    }

    /// The boundary as it reflects.
    pub fn dielectric(&self, interface: Interface) -> Dielectric {
        Dielectric::new(interface, self.specular, self.specular_color)
    }
}

/// A point of a triangle: reads vertex attributes and textures there.
struct Place<'s> {
    scene: &'s Scene,
    vertices: [usize; 3],
    weights: [f64; 3],
}

impl<'s> Place<'s> {
    fn new(scene: &'s Scene, triangle: &Triangle, hit: &Hit) -> Self {
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        Self {
            scene,
            vertices: triangle.vertices.map(|vertex| vertex as usize),
            weights,
        }
    }

    fn interpolated<const N: usize>(&self, attribute: impl Fn(usize) -> [f32; N]) -> [f64; N] {
        let corners = self.vertices.map(attribute);
        std::array::from_fn(|k| {
            (0..3)
                .map(|corner| self.weights[corner] * f64::from(corners[corner][k]))
                .sum()
        })
    }

    fn corners(&self) -> [Vec3; 3] {
        self.vertices
            .map(|vertex| self.scene.geometry.positions[vertex].to_array().into())
    }

    fn position(&self) -> Vec3 {
        self.interpolated(|vertex| self.scene.geometry.positions[vertex].to_array())
            .into()
    }

    fn spawn_offset(&self) -> f64 {
        let [a, b, c] = self.corners().map(|corner| corner.map(f64::abs));
        SPAWN_OFFSET * a.max(b).max(c).largest()
    }

    /// Unit, out of the front.
    fn geometric_normal(&self) -> Vec3 {
        let [a, b, c] = self.corners();
        (b - a).cross(c - a).normalized()
    }

    /// Unit, on the front's side of things: interpolated, and bent by the normal map if there is one.
    fn shading_normal(&self, material: &Material, geometric: Vec3) -> Vec3 {
        let normals = &self.scene.geometry.normals;
        let interpolated = Vec3::from(self.interpolated(|vertex| normals[vertex].to_array()));
        let normal = interpolated.try_normalized().unwrap_or(geometric);
        self.mapped_normal(material, normal).unwrap_or(normal)
    }

    /// `None` without a normal map, or where it tells no direction.
    fn mapped_normal(&self, material: &Material, normal: Vec3) -> Option<Vec3> {
        let map = material.normal_texture.as_ref()?;
        let tangents = &self.scene.geometry.tangents;
        let [x, y, z, _] = self.interpolated(|vertex| tangents[vertex].to_array());
        let along = Vec3::new(x, y, z);
        let tangent = (along - along.dot(normal) * normal).try_normalized()?;
        let handedness = f64::from(tangents[self.vertices[0]].w);
        let bitangent = handedness * normal.cross(tangent);
        let scale = f64::from(material.normal_scale);
        let [r, g, b, _] = self.sample_ref(map);
        let m = Vec3::new(
            (2.0 * r - 1.0) * scale,
            (2.0 * g - 1.0) * scale,
            2.0 * b - 1.0,
        );
        (m.x * tangent + m.y * bitangent + m.z * normal).try_normalized()
    }

    /// White without a texture.
    fn sample(&self, reference: &Option<TextureRef>) -> [f64; 4] {
        reference
            .as_ref()
            .map_or([1.0; 4], |reference| self.sample_ref(reference))
    }

    fn sample_ref(&self, reference: &TextureRef) -> [f64; 4] {
        let uvs = &self.scene.geometry.uv_sets[reference.uv_set as usize];
        let uv = self.interpolated(|vertex| uvs[vertex].to_array());
        texture::sample(self.scene, reference, uv)
    }

    fn vertex_color(&self) -> [f64; 4] {
        let colors = &self.scene.geometry.colors;
        if colors.is_empty() {
            return [1.0; 4];
        }
        self.interpolated(|vertex| colors[vertex].to_array())
    }
}

fn base_and_alpha(material: &Material, place: &Place) -> (Rgb, f64) {
    let factor = material.base_color.to_array().map(f64::from);
    let (vertex, texel) = (
        place.vertex_color(),
        place.sample(&material.base_color_texture),
    );
    let [r, g, b, a] = std::array::from_fn(|k| factor[k] * vertex[k] * texel[k]);
    (Rgb::new(r, g, b), a.clamp(0.0, 1.0))
}
