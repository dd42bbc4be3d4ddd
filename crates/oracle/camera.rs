//! Camera rays: "Rays" in `shaders/README.md`.

use raytree_scene::model::{Camera, Projection};

use crate::intersect::Ray;
use crate::vec::Vec3;

/// The ray through the point `(px, py)` of a picture of `size` pixels, from its upper left corner.
pub(crate) fn ray(camera: &Camera, size: (u32, u32), px: f64, py: f64) -> Ray {
    let (width, height) = (f64::from(size.0), f64::from(size.1));
    let x = 2.0 * px / width - 1.0;
    let y = 1.0 - 2.0 * py / height;
    let [position, right, up, forward]: [Vec3; 4] =
        [camera.position, camera.right, camera.up, camera.forward].map(|v| v.to_array().into());
    match camera.projection {
        Projection::Perspective { yfov, .. } => {
            let half_height = (0.5 * yfov).tan();
            let half_width = half_height * width / height;
            let direction = forward + x * half_width * right + y * half_height * up;
            Ray::new(position, direction.normalized())
        }
        Projection::Orthographic { xmag, ymag } => {
            let half_height = ymag.max(xmag * height / width);
            let half_width = half_height * width / height;
            let origin = position + x * half_width * right + y * half_height * up;
            Ray::new(origin, forward.normalized())
        }
    }
}
