//! The camera as `shaders/camera.wgsl` wants it: vectors to the picture's edges, and where rays start.
//!
//! In f32 a camera a million extents away from the scene is off by a twentieth of an extent, and the directions of two pixels of
//! a field of a thousandth of a degree are the same. But where the whole scene lies before the camera a ray need not start there:
//! its line is as well given by its crossing with a plane through the scene, computed here in f64, where numbers are small, and
//! rounding turns the line about a point that is near what it hits.

use glam::DVec3;
use raytree_scene::model::{Camera, Projection};

use crate::{settings::RenderSettings, types::Frame};

/// Farther than any hit; T_MAX of `shaders/math.wgsl`.
const T_MAX: f32 = 1e30;

/// Half the diagonal, at unit distance, of a field whose rays are equally long for f32: 1 / cos(NARROW) is 1 + 5e-7.
const NARROW: f64 = 1e-3;

/// Where rays start.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Start {
    /// Distance from the camera, along its axis, of the plane that they start on.
    depth: f64,
    /// Where on it rays begin, as t: not before the camera, unless nothing lies behind it.
    begin: f32,
}

impl Start {
    const AT_CAMERA: Self = Self {
        depth: 0.0,
        begin: 0.0,
    };

    /// For a camera whose picture reaches as far as `half_diagonal` from its middle, at unit distance, and a scene with this
    /// box around it. The plane goes through the origin of scene space, which lies in the scene and near to what is seen.
    fn of(camera: &Camera, half_diagonal: f64, bounds: Option<(DVec3, DVec3)>) -> Self {
        let Some((min, max)) = bounds else {
            return Self::AT_CAMERA;
        };
        let (middle, half) = (0.5 * (min + max), 0.5 * (max - min));
        let nearest =
            (middle - camera.position).dot(camera.forward) - half.dot(camera.forward.abs());
        // Among things, rays have to begin at the camera, at the same t for all: so its field has to be narrow.
        let all_ahead = nearest > 0.0;
        if !all_ahead && half_diagonal > NARROW {
            return Self::AT_CAMERA;
        }
        let to_origin = -camera.position.dot(camera.forward);
        // A little before the origin, where often a face of the scene lies: hits at t = 0 are not told from the start of a ray
        // that goes on behind a hole.
        let depth = (to_origin - to_origin.clamp(0.0, 1.0) / 1024.0).max(0.0);
        let start = camera.position + depth * camera.forward;
        // In a wide field the plane's far ends are farther away than the camera is.
        if start.length() + depth * half_diagonal < camera.position.length() {
            let begin = if all_ahead { -T_MAX } else { -depth as f32 };
            Self { depth, begin }
        } else {
            Self::AT_CAMERA
        }
    }
}

/// Writes the camera into the frame. `bounds`: the box around the scene.
pub(crate) fn set_camera(
    frame: &mut Frame,
    camera: &Camera,
    settings: &RenderSettings,
    bounds: Option<(DVec3, DVec3)>,
) {
    let aspect = f64::from(settings.width) / f64::from(settings.height);
    let f32s = |vector: DVec3| vector.as_vec3().to_array();
    let (start, half_width, half_height, starts_spread) = match camera.projection {
        Projection::Perspective { yfov, .. } => {
            let half_height = (0.5 * yfov).tan();
            let half_width = half_height * aspect;
            let start = Start::of(camera, half_width.hypot(half_height), bounds);
            (start, half_width, half_height, start.depth)
        }
        Projection::Orthographic { xmag, ymag } => {
            let half_height = ymag.max(xmag / aspect);
            let start = Start::of(camera, 0.0, bounds);
            (start, half_height * aspect, half_height, 1.0)
        }
    };
    let (right, up) = (camera.right * half_width, camera.up * half_height);
    frame.ray_start = f32s(camera.position + start.depth * camera.forward);
    frame.start_right = f32s(starts_spread * right);
    frame.start_up = f32s(starts_spread * up);
    frame.start_depth = start.depth as f32;
    frame.start_t = start.begin;
    frame.camera_right = f32s(right);
    frame.camera_up = f32s(up);
    frame.camera_forward = f32s(camera.forward);
}

#[cfg(test)]
mod tests {
    use raytree_scene::default_view::look_at;

    use super::*;

    const BOX: Option<(DVec3, DVec3)> = Some((DVec3::splat(-0.5), DVec3::splat(0.5)));

    fn camera(distance: f64, degrees: f64) -> Camera {
        let eye = distance * DVec3::new(0.48, 0.6, 0.64);
        look_at(eye, DVec3::ZERO, None, degrees.to_radians(), "").unwrap()
    }

    fn frame(camera: &Camera) -> Frame {
        let mut frame = Frame::default();
        let settings = RenderSettings::new(40, 30, camera.clone());
        set_camera(&mut frame, camera, &settings, BOX);
        frame
    }

    fn f64s(vector: [f32; 3]) -> DVec3 {
        glam::Vec3::from(vector).as_dvec3()
    }

    #[test]
    fn rays_of_a_camera_far_away_start_in_the_scene() {
        let far = camera(1e6, 1e-4);
        let frame = frame(&far);
        assert_eq!(frame.start_t, -T_MAX);
        assert!(f64s(frame.ray_start).length() < 1e-3);
        // The view is 1e6 tan(5e-5 degrees) high.
        let half_height = 1e6 * 5e-5_f64.to_radians().tan();
        assert!((f64s(frame.start_up).length() / half_height - 1.0).abs() < 1e-6);
        assert!((f64::from(frame.start_depth) / 1e6 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn rays_start_at_a_camera_with_something_beside_or_behind_it() {
        for beside in [camera(0.01, 40.0), camera(0.4, 40.0), camera(0.6, 40.0)] {
            let frame = frame(&beside);
            assert_eq!((frame.start_t, frame.start_depth), (0.0, 0.0));
            assert_eq!(f64s(frame.ray_start), beside.position.as_vec3().as_dvec3());
            assert_eq!((frame.start_right, frame.start_up), ([0.0; 3], [0.0; 3]));
        }
    }

    #[test]
    fn rays_of_a_narrow_field_among_things_begin_at_the_camera() {
        let frame = frame(&camera(0.4, 1e-3));
        assert!(f64s(frame.ray_start).length() < 1e-3);
        assert!((frame.start_t + frame.start_depth).abs() < 1e-9);
        assert!((frame.start_depth - 0.4).abs() < 1e-3);
    }

    #[test]
    fn a_wide_field_does_not_start_far_from_its_camera() {
        assert_eq!(frame(&camera(3.0, 179.9)).start_t, 0.0);
        assert_eq!(frame(&camera(3.0, 40.0)).start_t, -T_MAX);
    }

    #[test]
    fn parallel_rays_are_as_far_apart_wherever_they_start() {
        let projection = Projection::Orthographic {
            xmag: 4.0,
            ymag: 3.0,
        };
        for distance in [0.1, 1e6] {
            let frame = frame(&Camera {
                projection,
                ..camera(distance, 40.0)
            });
            assert!((f64s(frame.start_up).length() - 3.0).abs() < 1e-6);
            assert!((f64s(frame.start_right).length() - 4.0).abs() < 1e-6);
        }
    }
}
