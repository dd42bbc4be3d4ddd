//! Cameras for scenes that bring none: a three-quarter view that shows the whole scene, or one from an eye and a target.

use std::f64::consts::PI;

use glam::DVec3;

use crate::model::{Camera, Geometry, Projection};

/// Vertical field of view of [`frame_scene`], radians.
const YFOV: f64 = 40.0 * PI / 180.0;

/// Share of the picture's half width and height that [`frame_scene`] leaves free on every side.
pub const MARGIN: f64 = 0.08;

/// A side shorter than this share of the longest makes a scene flat.
const FLAT: f64 = 0.01;

/// Texels of the default picture, about: 960 x 720.
const DEFAULT_AREA: f64 = 960.0 * 720.0;

/// Width over height of a picture, and its inverse, are bounded by this by default.
const WIDEST: f64 = 4.0;

/// Why there is no such view.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// A coordinate or angle that is infinite or not a number.
    #[error("the camera's {0} is not finite; give ordinary numbers")]
    NotFinite(&'static str),
    /// No direction of view.
    #[error("the camera's eye and target are the same point; move one of them")]
    SamePoint,
    /// The up vector does not say how the camera is turned.
    #[error(
        "the camera's up vector is zero or parallel to its direction of view; give another, or none"
    )]
    UpParallel,
    /// Not an angle of view.
    #[error(
        "the camera's vertical field of view, {0} degrees, must lie between 0 and 180, both excluded"
    )]
    FieldOfView(f64),
}

/// A camera that shows the whole box, for pictures of width over height `aspect`: from above, 30 degrees to the right of
/// the front (+Z; glTF models face it). Flat scenes are seen nearly frontally, floors (flat in Y) from higher up. The box's
/// corners stay [`MARGIN`] inside the frame, and touch that margin on two opposite sides.
///
/// Any box will do: points and boxes that are empty or not finite give a view of a unit cube there or around the origin.
/// An `aspect` that is no positive number counts as 4:3.
#[must_use]
pub fn frame_scene(bounds_min: DVec3, bounds_max: DVec3, aspect: f64) -> Camera {
    let (centre, half) = sane_box(bounds_min, bounds_max);
    let aspect = if aspect.is_finite() && aspect > 0.0 {
        aspect
    } else {
        4.0 / 3.0
    };
    let (yaw, pitch) = viewing_angles(half);
    let backward = DVec3::new(
        yaw.sin() * pitch.cos(),
        pitch.sin(),
        yaw.cos() * pitch.cos(),
    );
    let right = DVec3::Y.cross(backward).normalize();
    let up = backward.cross(right);

    // A corner at (x, y) and depth z from the box's centre is in the frame of a camera at (a, b) and depth -d if
    //     |x - a| <= kx (z + d)   and   |y - b| <= ky (z + d).
    // For x alone, the two signs bound a from both sides; they leave room for it from the d on that makes the bounds meet.
    // The same goes for y; the larger d serves both.
    let ky = (1.0 - MARGIN) * (0.5 * YFOV).tan();
    let fit_x = AxisFit::new(half, right, backward, ky * aspect);
    let fit_y = AxisFit::new(half, up, backward, ky);
    let distance = fit_x.distance.max(fit_y.distance);
    Camera {
        name: "default view".to_owned(),
        position: centre + right * fit_x.offset + up * fit_y.offset + backward * distance,
        right,
        up,
        forward: -backward,
        projection: Projection::Perspective {
            yfov: YFOV,
            aspect: Some(aspect),
        },
    }
}

/// How a box fits in the frame along one of the picture's axes.
struct AxisFit {
    /// The smallest distance of the camera from the box's centre at which it fits.
    distance: f64,
    /// Where the camera then is along the axis.
    offset: f64,
}

impl AxisFit {
    /// `slope`: half of the frame's size at unit distance.
    fn new(half: DVec3, axis: DVec3, backward: DVec3, slope: f64) -> Self {
        // The largest of x - k z over a box around the origin: that of each side is its half size times |its share|.
        // By symmetry, that of -x - k z has the same kind of form.
        let reach = |axis: DVec3| half.dot((axis + slope * backward).abs());
        let (upper, lower) = (reach(axis), reach(-axis));
        Self {
            distance: 0.5 * (upper + lower) / slope,
            offset: 0.5 * (upper - lower),
        }
    }
}

/// Centre and half sizes of the box; those of a unit cube if it has none.
fn sane_box(min: DVec3, max: DVec3) -> (DVec3, DVec3) {
    let unit = DVec3::splat(0.5);
    let (centre, half) = (0.5 * min + 0.5 * max, 0.5 * max - 0.5 * min);
    if !(centre.is_finite() && half.is_finite() && half.min_element() >= 0.0) {
        (DVec3::ZERO, unit)
    } else if half.max_element() == 0.0 {
        (centre, unit)
    } else {
        (centre, half)
    }
}

/// Yaw (from +Z towards +X) and pitch (upwards) of the direction from a box to its camera, radians.
fn viewing_angles(half: DVec3) -> (f64, f64) {
    let flat = |side: f64| side < FLAT * half.max_element();
    let (yaw, pitch): (f64, f64) = if flat(half.z) {
        (15.0, 10.0)
    } else if flat(half.x) {
        (75.0, 10.0)
    } else if flat(half.y) {
        (30.0, 35.0)
    } else {
        (30.0, 20.0)
    };
    (yaw.to_radians(), pitch.to_radians())
}

/// A perspective camera at `eye` that looks at `target`. All in scene space; `yfov` in radians; `aspect` is left open.
/// Without `up`, +Y is up, or -Z where the camera looks straight down and +Z where it looks straight up.
///
/// # Errors
/// [`ViewError`]: numbers that are not finite, no direction, no way to tell what is up, a field of view outside (0, pi).
pub fn look_at(
    eye: DVec3,
    target: DVec3,
    up: Option<DVec3>,
    yfov: f64,
    name: &str,
) -> Result<Camera, ViewError> {
    for (what, vector) in [
        ("eye", eye),
        ("target", target),
        ("up vector", up.unwrap_or(DVec3::Y)),
    ] {
        if !vector.is_finite() {
            return Err(ViewError::NotFinite(what));
        }
    }
    if !yfov.is_finite() {
        return Err(ViewError::NotFinite("field of view"));
    }
    if yfov <= 0.0 || yfov >= PI {
        return Err(ViewError::FieldOfView(yfov.to_degrees()));
    }
    let forward = (target - eye).try_normalize().ok_or(ViewError::SamePoint)?;
    let right = match up {
        Some(up) => right_of(forward, up),
        None => {
            right_of(forward, DVec3::Y).or_else(|| right_of(forward, DVec3::Z * forward.y.signum()))
        }
    }
    .ok_or(ViewError::UpParallel)?;
    Ok(Camera {
        name: name.to_owned(),
        position: eye,
        right,
        up: right.cross(forward),
        forward,
        projection: Projection::Perspective { yfov, aspect: None },
    })
}

/// The camera's right hand, if `up` and `forward` (unit) are far enough from parallel to tell.
fn right_of(forward: DVec3, up: DVec3) -> Option<DVec3> {
    // Below this sine the rounding of the inputs would turn the camera at will.
    const SMALLEST_SINE: f64 = 1e-6;
    let across = forward.cross(up.try_normalize()?);
    (across.length() > SMALLEST_SINE).then(|| across.normalize())
}

/// Width and height in pixels of a picture for `camera`: its own aspect (4:3 if it names none, and never beyond 4:1 or
/// 1:4) and about as many pixels as 960 x 720.
#[must_use]
pub fn default_size(camera: &Camera) -> (u32, u32) {
    let aspect = match camera.projection {
        Projection::Perspective { aspect, .. } => aspect.unwrap_or(4.0 / 3.0),
        Projection::Orthographic { xmag, ymag } => xmag / ymag,
    };
    let aspect = if aspect > 0.0 {
        aspect.clamp(1.0 / WIDEST, WIDEST)
    } else {
        4.0 / 3.0
    };
    let height = (DEFAULT_AREA / aspect).sqrt();
    ((height * aspect).round() as u32, height.round() as u32)
}

impl Geometry {
    /// The box around all triangles, each taken as it lies here: its least and its greatest corner. `None` without triangles.
    /// Of a scene it is [`Scene::bounds`](crate::model::Scene::bounds) that is asked for.
    #[must_use]
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.bounds_of(0..self.triangles.len())
    }

    /// The box around some triangles.
    pub(crate) fn bounds_of(&self, triangles: std::ops::Range<usize>) -> Option<(DVec3, DVec3)> {
        self.triangles[triangles]
            .iter()
            .flat_map(|triangle| triangle.vertices)
            .map(|vertex| self.positions[vertex as usize].as_dvec3())
            .map(|position| (position, position))
            .reduce(|(min, max), (position, _)| (min.min(position), max.max(position)))
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::model::Triangle;

    fn corners(min: DVec3, max: DVec3) -> impl Iterator<Item = DVec3> {
        (0..8).map(move |i| {
            let pick = |bit: u32, low, high| if i >> bit & 1 == 0 { low } else { high };
            DVec3::new(
                pick(0, min.x, max.x),
                pick(1, min.y, max.y),
                pick(2, min.z, max.z),
            )
        })
    }

    /// Position in the picture of the given aspect, each coordinate from -1 to 1; the depth must be positive.
    fn project(camera: &Camera, point: DVec3, aspect: f64) -> (f64, f64) {
        let Projection::Perspective { yfov, .. } = camera.projection else {
            panic!("perspective cameras only");
        };
        let to_point = point - camera.position;
        let depth = to_point.dot(camera.forward);
        assert!(depth > 0.0, "{point} lies behind the camera");
        let half_height = depth * (0.5 * yfov).tan();
        (
            to_point.dot(camera.right) / (half_height * aspect),
            to_point.dot(camera.up) / half_height,
        )
    }

    fn assert_orthonormal(camera: &Camera) {
        let (right, up, forward) = (camera.right, camera.up, camera.forward);
        for vector in [right, up, forward] {
            assert!((vector.length() - 1.0).abs() < 1e-12);
        }
        assert!((right.cross(up) + forward).length() < 1e-12);
    }

    #[test]
    fn any_box_fits_tightly_at_any_aspect() {
        let sides = [0.0, 1e-3, 0.02, 0.5, 1.0, 1.99, 300.0];
        let boxes = (0..sides.len().pow(3)).map(|i| {
            let side = |place: u32| sides[i / sides.len().pow(place) % sides.len()];
            DVec3::new(side(0), side(1), side(2))
        });
        for side in boxes.filter(|side| *side != DVec3::ZERO) {
            for centre in [DVec3::ZERO, DVec3::new(1e3, -50.0, 7.0)] {
                for aspect in [0.3, 1.0, 4.0 / 3.0, 16.0 / 9.0, 5.0] {
                    let (min, max) = (centre - 0.5 * side, centre + 0.5 * side);
                    let camera = frame_scene(min, max, aspect);
                    assert_orthonormal(&camera);
                    let projected: Vec<_> = corners(min, max)
                        .map(|corner| project(&camera, corner, aspect))
                        .collect();
                    let of = |coordinate: fn(&(f64, f64)) -> f64| {
                        let values = projected.iter().map(coordinate);
                        (
                            values.clone().fold(f64::MAX, f64::min),
                            values.fold(f64::MIN, f64::max),
                        )
                    };
                    let (x, y) = (of(|p| p.0), of(|p| p.1));
                    let touches = |(least, greatest): (f64, f64)| {
                        (least + 1.0 - MARGIN).abs() < 1e-9
                            && (greatest - 1.0 + MARGIN).abs() < 1e-9
                    };
                    let inside = |(least, greatest): (f64, f64)| {
                        least > -1.0 + MARGIN - 1e-9 && greatest < 1.0 - MARGIN + 1e-9
                    };
                    let place =
                        format!("box {side} at {centre}, aspect {aspect}: x {x:?}, y {y:?}");
                    assert!(inside(x) && inside(y), "outside: {place}");
                    assert!(touches(x) || touches(y), "not tight: {place}");
                }
            }
        }
    }

    #[test]
    fn looks_from_the_front_right_above() {
        let camera = frame_scene(DVec3::splat(-0.5), DVec3::splat(0.5), 1.0);
        assert!(camera.position.min_element() > 0.0 && camera.position.z > camera.position.x);
        assert!(camera.up.y > 0.9);
    }

    #[test]
    fn flat_scenes_are_seen_from_their_face() {
        let facing =
            |half: DVec3, normal: DVec3| -frame_scene(-half, half, 1.5).forward.dot(normal);
        assert!(facing(DVec3::new(1.0, 0.7, 0.0), DVec3::Z) > 0.94);
        assert!(facing(DVec3::new(0.0, 0.7, 1.0), DVec3::X) > 0.94);
        let from_above = facing(DVec3::new(1.0, 0.0, 1.0), DVec3::Y);
        assert!((from_above.asin().to_degrees() - 35.0).abs() < 1e-9);
    }

    #[test]
    fn boxes_that_are_none_still_give_a_camera() {
        let point = DVec3::new(3.0, 2.0, 1.0);
        let nan = DVec3::splat(f64::NAN);
        let infinite = DVec3::splat(f64::INFINITY);
        for (min, max, middle) in [
            (point, point, point),
            (infinite, -infinite, DVec3::ZERO),
            (DVec3::ONE, -DVec3::ONE, DVec3::ZERO),
            (nan, nan, DVec3::ZERO),
        ] {
            for aspect in [1.5, 0.0, f64::NAN, f64::INFINITY] {
                let camera = frame_scene(min, max, aspect);
                assert_orthonormal(&camera);
                assert!(camera.position.is_finite());
                let (x, y) = project(&camera, middle, 1.0);
                assert!(x.abs() < 1.0 && y.abs() < 1.0, "{x}, {y}");
            }
        }
    }

    #[test]
    fn look_at_aims_and_keeps_up_up() {
        let (eye, target) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 0.5, 0.0));
        let camera = look_at(eye, target, None, 1.0, "here").unwrap();
        assert_orthonormal(&camera);
        assert_eq!((camera.position, camera.name.as_str()), (eye, "here"));
        assert!(project(&camera, target, 1.0).0.abs() < 1e-12);
        assert!(camera.right.y.abs() < 1e-12 && camera.up.y > 0.0);
        let tilted = look_at(eye, target, Some(DVec3::X), 1.0, "tilted").unwrap();
        assert!(tilted.up.dot(DVec3::X) > 0.5);
    }

    #[test]
    fn look_at_straight_down_and_up_has_a_default_up() {
        let down = look_at(DVec3::Y, DVec3::ZERO, None, 1.0, "plan").unwrap();
        assert_orthonormal(&down);
        assert_eq!((down.right, down.up), (DVec3::X, DVec3::NEG_Z));
        let up = look_at(DVec3::ZERO, DVec3::Y, None, 1.0, "ceiling").unwrap();
        assert_orthonormal(&up);
        assert_eq!((up.right, up.up), (DVec3::X, DVec3::Z));
    }

    #[test]
    fn look_at_refuses_what_is_no_view() {
        let view = |eye, target, up, yfov| look_at(eye, target, up, yfov, "").unwrap_err();
        let (zero, y, z) = (DVec3::ZERO, DVec3::Y, DVec3::Z);
        assert_eq!(view(z, z, None, 1.0), ViewError::SamePoint);
        assert_eq!(view(z, zero, Some(z * 5.0), 1.0), ViewError::UpParallel);
        assert_eq!(view(z, zero, Some(zero), 1.0), ViewError::UpParallel);
        assert_eq!(view(y, zero, Some(y), 1.0), ViewError::UpParallel);
        assert_eq!(
            view(z * f64::NAN, zero, None, 1.0),
            ViewError::NotFinite("eye")
        );
        assert_eq!(
            view(z, zero, None, f64::NAN),
            ViewError::NotFinite("field of view")
        );
        for yfov in [0.0, -1.0, PI, 7.0] {
            assert_eq!(
                view(z, zero, None, yfov),
                ViewError::FieldOfView(yfov.to_degrees())
            );
        }
    }

    #[test]
    fn default_size_follows_the_camera() {
        let with = |projection| Camera {
            projection,
            ..frame_scene(-DVec3::ONE, DVec3::ONE, 1.0)
        };
        let perspective =
            |aspect| default_size(&with(Projection::Perspective { yfov: 1.0, aspect }));
        assert_eq!(perspective(None), (960, 720));
        assert_eq!(perspective(Some(1.0)), (831, 831));
        assert_eq!(perspective(Some(16.0 / 9.0)), (1109, 624));
        assert_eq!(perspective(Some(1e9)), perspective(Some(4.0)));
        assert_eq!(perspective(Some(f64::NAN)), (960, 720));
        let parallel = Projection::Orthographic {
            xmag: 2.0,
            ymag: 4.0,
        };
        assert_eq!(default_size(&with(parallel)), (588, 1176));
    }

    #[test]
    fn bounds_are_those_of_the_triangles() {
        assert_eq!(Geometry::default().bounds(), None);
        let geometry = Geometry {
            positions: vec![
                Vec3::ZERO,
                Vec3::new(1.0, -2.0, 0.5),
                Vec3::Y,
                Vec3::splat(99.0),
            ],
            triangles: vec![Triangle {
                vertices: [0, 1, 2],
                material: 0,
                node: 0,
            }],
            ..Geometry::default()
        };
        let expected = (DVec3::new(0.0, -2.0, 0.0), DVec3::new(1.0, 1.0, 0.5));
        assert_eq!(geometry.bounds(), Some(expected));
    }
}
