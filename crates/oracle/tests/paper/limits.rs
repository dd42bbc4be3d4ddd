//! Where branches end, and what is counted.

use raytree_oracle::{Counts, Ended, Rays, Settings, Shading};
use raytree_scene::model::AlphaMode;

use crate::build::*;

fn counted(build: &Build, settings: &Settings) -> Counts {
    let picture = build
        .oracle()
        .render(&looking([0.1, 3.0, 0.2], DOWN), settings);
    Counts {
        rays: picture.rays,
        ended: picture.ended,
    }
}

#[test]
fn an_empty_scene_is_all_misses() {
    let settings = Settings {
        width: 3,
        height: 2,
        window: (0, 0, 3, 2),
        ..one_ray()
    };
    let picture = Build::before([0.5; 3])
        .oracle()
        .render(&looking([0.0; 3], DOWN), &settings);
    assert_eq!(picture.radiance, [[0.5; 3]; 6]);
    assert_eq!(picture.alpha, [0.0; 6]);
    assert_eq!((picture.rays.primary, picture.ended.miss), (6, 6));
}

#[test]
fn a_pane_in_numbers() {
    let mut build = Build::before([0.5; 3]);
    let material = build.material(pane([1.0; 3]));
    build.floor(0.0, 1.0, material);
    let rays = Rays {
        primary: 1,
        shadow: 0,
        reflection: 1,
        refraction: 1,
    };
    let all = Counts {
        rays,
        ended: Ended {
            miss: 2,
            ..Ended::default()
        },
    };
    assert_eq!(counted(&build, &one_ray()), all);
    // The reflected 4 % are too little.
    let settings = Settings {
        min_weight: 0.05,
        ..one_ray()
    };
    let rays = Rays {
        primary: 1,
        shadow: 0,
        reflection: 0,
        refraction: 1,
    };
    let ended = Ended {
        miss: 1,
        weight: 1,
        ..Ended::default()
    };
    assert_eq!(counted(&build, &settings), Counts { rays, ended });
    // Weight is looked at before depth.
    let settings = Settings {
        min_weight: 0.05,
        max_depth: 0,
        ..one_ray()
    };
    let rays = Rays {
        primary: 1,
        ..Rays::default()
    };
    let ended = Ended {
        weight: 1,
        depth: 1,
        ..Ended::default()
    };
    assert_eq!(counted(&build, &settings), Counts { rays, ended });
}

#[test]
fn absorption_counts_towards_the_weight() {
    let mut build = Build::before([1.0; 3]);
    let material = build.material(glass(1.5, [1.0 / 1024.0; 3], 1.0));
    build.cuboid([-1.0; 3], [1.0, 0.0, 1.0], material);
    let settings = Settings {
        min_weight: 1e-3,
        ..one_ray()
    };
    // Of 0.96 in, 0.96/1024 arrive at the bottom: neither ray there is worth it.
    let counts = counted(&build, &settings);
    assert_eq!((counts.rays.refraction, counts.ended.weight), (1, 2));
}

#[test]
fn coverage_counts_towards_the_weight() {
    let mut build = Build::before([1.0; 3]);
    let mut veil = mirror([1.0; 3]);
    veil.alpha_mode = AlphaMode::Blend;
    veil.base_color.w = 0.25;
    let material = build.material(veil);
    build.floor(0.0, 1.0, material);
    let rays = |min_weight| {
        counted(
            &build,
            &Settings {
                min_weight,
                ..one_ray()
            },
        )
        .rays
    };
    assert_eq!((rays(0.2).reflection, rays(0.2).refraction), (1, 1));
    assert_eq!((rays(0.3).reflection, rays(0.3).refraction), (0, 1));
    assert_eq!((rays(0.8).reflection, rays(0.8).refraction), (0, 0));
}

#[test]
fn eight_solids_fit_into_each_other() {
    let nested = |count: usize| {
        let mut build = Build::before([0.5; 3]);
        for k in 0..count {
            let size = 1.0 - 0.05 * k as f32;
            // All of one index: each surface passes everything on.
            let material = build.material(clear(1.0));
            build.cuboid([-size; 3], [size; 3], material);
        }
        build
    };
    assert_eq!(
        counted(&nested(8), &one_ray()).ended,
        Ended {
            miss: 1,
            ..Ended::default()
        }
    );
    assert_eq!(
        counted(&nested(9), &one_ray()).ended,
        Ended {
            storage: 1,
            ..Ended::default()
        }
    );
    // A shadow ray that can't go on brings no light.
    let visible = |count: usize| {
        let build = nested(count);
        build
            .oracle()
            .visibility_along([0.05, 2.0, 0.02], DOWN, 4.0, Shading::Pbr)
    };
    assert_grey(visible(8), 1.0);
    assert_grey(visible(9), 0.0);
}
