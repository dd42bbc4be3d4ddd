//! Cameras, windows, samples, and the spread of a pixel.

use std::f64::consts::FRAC_PI_2;

use raytree_oracle::Settings;
use raytree_scene::model::{Camera, Projection};

use crate::build::*;

/// A floor that shows where on it a ray arrives: radiance is `(x/8 + 1/2, 0, z/8 + 1/2)`.
fn chart() -> Build {
    let mut build = Build::before([0.0, 1.0, 0.0]);
    let white = build.material(unlit([1.0; 3]));
    build.floor(0.0, 4.0, white);
    let geometry = &mut build.scene.geometry;
    for (color, position) in geometry.colors.iter_mut().zip(&geometry.positions) {
        *color = [position.x / 8.0 + 0.5, 0.0, position.z / 8.0 + 0.5, 1.0].into();
    }
    build
}

/// From 1 above the origin straight down, +x to the right, -z up in the picture.
fn from_above(projection: Projection) -> Camera {
    Camera {
        name: String::new(),
        position: [0.0, 1.0, 0.0].into(),
        right: [1.0, 0.0, 0.0].into(),
        up: [0.0, 0.0, -1.0].into(),
        forward: DOWN.into(),
        projection,
    }
}

fn arrival([red, _, blue]: [f64; 3]) -> [f64; 3] {
    [(red - 0.5) * 8.0, 0.0, (blue - 0.5) * 8.0]
}

const WIDE: Projection = Projection::Perspective {
    yfov: FRAC_PI_2,
    aspect: Some(1.0),
};

#[test]
fn perspective_rays() {
    let build = chart();
    let at = |x, y| {
        let settings = Settings::new(4, 2);
        arrival(build.oracle().radiance(&from_above(WIDE), &settings, x, y))
    };
    // tan(45 degrees) = 1: half the height is 1, half the width 2 (the picture's aspect, not the author's).
    assert_rgb(at(0, 0), [-1.5, 0.0, -0.5]);
    assert_rgb(at(3, 0), [1.5, 0.0, -0.5]);
    assert_rgb(at(2, 1), [0.5, 0.0, 0.5]);
}

#[test]
fn orthographic_rays_show_the_whole_authored_view() {
    let build = chart();
    let at = |xmag, ymag, x, y| {
        let camera = from_above(Projection::Orthographic { xmag, ymag });
        arrival(build.oracle().radiance(&camera, &Settings::new(4, 2), x, y))
    };
    // Limited by its height, and by its width.
    assert_rgb(at(0.5, 1.0, 3, 0), [1.5, 0.0, -0.5]);
    assert_rgb(at(2.0, 0.5, 3, 0), [1.5, 0.0, -0.5]);
    assert_rgb(at(4.0, 0.5, 3, 0), [3.0, 0.0, -1.0]);
}

#[test]
fn samples_are_offsets_to_the_right_and_down_and_averaged() {
    let build = chart();
    let seen = |samples: &[[f32; 2]]| {
        let settings = Settings {
            samples: samples.to_vec(),
            ..Settings::new(4, 2)
        };
        arrival(build.oracle().radiance(&from_above(WIDE), &settings, 2, 1))
    };
    assert_rgb(seen(&[[0.25, -0.5]]), [0.75, 0.0, 0.0]);
    assert_rgb(seen(&[[0.25, -0.5], [0.0, 0.0]]), [0.625, 0.0, 0.25]);
}

#[test]
fn a_window_is_a_part_of_the_same_picture() {
    let build = chart();
    let camera = from_above(Projection::Perspective {
        yfov: 2.8,
        aspect: None,
    });
    let samples = vec![[0.25, 0.25], [-0.25, -0.25]];
    let whole = Settings {
        samples,
        ..Settings::new(11, 7)
    };
    let part = Settings {
        window: (3, 2, 5, 3),
        ..whole.clone()
    };
    let (whole, part) = (
        build.oracle().render(&camera, &whole),
        build.oracle().render(&camera, &part),
    );
    assert_eq!((part.width, part.height, part.rays.primary), (5, 3, 30));
    for y in 0..3 {
        for x in 0..5 {
            assert_eq!(part.at(x, y), whole.at(x + 3, y + 2));
        }
    }
    // Some see the floor, some the background: alpha tells.
    for (radiance, alpha) in whole.radiance.iter().zip(&whole.alpha) {
        assert!((radiance[1] - (1.0 - alpha)).abs() < 1e-12);
    }
    assert!(whole.alpha.contains(&0.0) && whole.alpha.contains(&1.0));
}

#[test]
fn rendering_twice_gives_the_same_picture() {
    let build = chart();
    let render = || {
        build
            .oracle()
            .render(&from_above(WIDE), &Settings::new(16, 9))
    };
    assert_eq!(render(), render());
}

#[test]
fn spread_is_wide_at_edges_and_narrow_elsewhere() {
    let mut build = Build::before([0.0; 3]);
    let white = build.material(unlit([1.0; 3]));
    build.floor(0.0, 0.5, white);
    // 4 by 4 pixels of half a unit: the floor's edge at x = 0.5 runs through the middle of none, but between two.
    let camera = from_above(Projection::Orthographic {
        xmag: 1.0,
        ymag: 1.0,
    });
    let spread = |sample: f32| {
        let settings = Settings {
            samples: vec![[sample, 0.0]],
            ..Settings::new(4, 4)
        };
        build.oracle().spread(&camera, &settings, 2, 2, 1e-3)
    };
    assert_eq!((spread(0.0).min, spread(0.0).width()), ([1.0; 3], 0.0));
    let edge = spread(0.4995);
    assert_eq!(
        (edge.min, edge.max, edge.width()),
        ([0.0; 3], [1.0; 3], 1.0)
    );
    assert!(edge.contains([0.5, 0.0, 1.0], 0.0));
    assert!(!edge.contains([0.5, 0.0, 1.1], 0.05));
    assert!(!spread(0.0).contains([0.9; 3], 0.05));
}
