//! Comparing pictures: the numbers against another program's (numpy 2.4, NVIDIA's flip-evaluator 1.x), and that every
//! limit can be broken.

use raytree_film::{
    CompareError, CompareOptions, Comparison, Film, Limits, Picture, Rect, compare,
    difference_picture,
};

fn picture(width: u32, height: u32, rgb: Vec<[f32; 3]>) -> Picture {
    Picture {
        width,
        height,
        rgb,
        alpha: None,
        data: Rect {
            x: 0,
            y: 0,
            width,
            height,
        },
    }
}

fn constant(value: f32) -> Picture {
    picture(32, 32, vec![[value; 3]; 32 * 32])
}

/// Two pictures of 40 x 30 pixels that differ by up to 0.02, and by 2.94 in one channel of one pixel.
fn pair() -> [Picture; 2] {
    let channel = |i: usize| (i * 37 % 101) as f32 / 100.0;
    let other = |i: usize| channel(i) + ((i * 53 % 17) as f32 - 8.0) / 400.0;
    let all =
        |f: &dyn Fn(usize) -> f32| (0..1200).map(|p| [0, 1, 2].map(|c| f(3 * p + c))).collect();
    let (a, mut b): (Vec<[f32; 3]>, Vec<[f32; 3]>) = (all(&channel), all(&other));
    b[7][1] = 3.0;
    [picture(40, 30, a), picture(40, 30, b)]
}

fn measured(clip: bool) -> Comparison {
    let options = CompareOptions {
        clip,
        thresholds: vec![0.015, 0.5],
        flip: true,
    };
    let [a, b] = pair();
    compare(&a, &b, &options).unwrap()
}

fn assert_close(actual: f64, expected: f64) {
    assert!((actual - expected).abs() < 1e-6, "{actual}, not {expected}");
}

#[test]
fn the_numbers_are_what_numpy_computes() {
    for (clip, rmse, mean, max, outliers) in [
        (false, 0.050507561, 0.011404161, 2.94, 0.495),
        (true, 0.019826282, 0.010711800, 0.94, 0.489166667),
    ] {
        let c = measured(clip);
        assert_eq!((c.pixels, c.non_finite, c.max_alpha), (1200, 0, 0.0));
        assert_close(c.rmse, rmse);
        assert_close(c.mean_abs, mean);
        assert_close(c.max_abs, max);
        assert_close(c.p99_abs, 0.020000011);
        assert_eq!((c.outliers[0].0, c.outliers[1].0), (0.015, 0.5));
        assert_close(c.outliers[0].1, outliers);
        assert_close(c.outliers[1].1, 1.0 / 1200.0);
    }
}

// The tolerance is for a table of colours that the two implementations round differently.
#[test]
fn flip_is_what_its_authors_program_computes() {
    let flip = measured(true).flip_mean.unwrap();
    assert!((flip - 0.021804117).abs() < 1e-4, "{flip}");
    let flip = compare(&constant(0.0), &constant(1.0), &CompareOptions::default())
        .unwrap()
        .flip_mean
        .unwrap();
    assert!((flip - 0.967395127).abs() < 1e-4, "{flip}");
}

#[test]
fn a_picture_does_not_differ_from_itself() {
    let [a, _] = pair();
    let c = compare(&a, &a, &CompareOptions::default()).unwrap();
    assert_eq!(
        [c.rmse, c.mean_abs, c.max_abs, c.p99_abs, c.max_alpha],
        [0.0; 5]
    );
    assert_eq!(
        (c.flip_mean, c.outliers, c.non_finite),
        (Some(0.0), vec![(0.02, 0.0)], 0)
    );
}

#[test]
fn clipping_hides_what_no_screen_shows() {
    let compared = |clip| {
        let options = CompareOptions {
            clip,
            ..CompareOptions::default()
        };
        compare(&constant(2.0), &constant(50.0), &options)
            .unwrap()
            .max_abs
    };
    assert_eq!((compared(true), compared(false)), (0.0, 48.0));
}

/// All limits, each just above what [`pair`] measures.
fn generous() -> Limits {
    let c = measured(false);
    Limits {
        max_rmse: Some(c.rmse * 1.001),
        max_mean: Some(c.mean_abs * 1.001),
        max_abs: Some(c.max_abs * 1.001),
        max_p99: Some(c.p99_abs * 1.001),
        max_alpha: Some(0.001),
        max_flip: Some(c.flip_mean.unwrap() * 1.001),
        max_outliers: c
            .outliers
            .iter()
            .map(|(t, share)| (*t, share * 1.001))
            .collect(),
    }
}

#[test]
fn every_limit_can_be_broken_alone() {
    let mut c = measured(false);
    assert_eq!(generous().check(&c), []);
    c.max_alpha = 0.002;
    type Change = fn(&mut Limits);
    let tighten: [(&str, Change); 8] = [
        ("root mean square", |l| {
            l.max_rmse = l.max_rmse.map(|x| x * 0.99)
        }),
        ("mean absolute", |l| {
            l.max_mean = l.max_mean.map(|x| x * 0.99)
        }),
        ("largest difference", |l| {
            l.max_abs = l.max_abs.map(|x| x * 0.99)
        }),
        ("99th", |l| l.max_p99 = l.max_p99.map(|x| x * 0.99)),
        ("alpha", |l| l.max_alpha = Some(0.001)),
        ("FLIP", |l| l.max_flip = l.max_flip.map(|x| x * 0.99)),
        ("more than 0.015", |l| l.max_outliers[0].1 *= 0.99),
        ("more than 0.5", |l| l.max_outliers[1].1 *= 0.99),
    ];
    for (name, tighten) in tighten {
        let mut limits = generous();
        limits.max_alpha = Some(0.003);
        tighten(&mut limits);
        let broken = limits.check(&c);
        assert_eq!(broken.len(), 1, "{name}: {broken:?}");
        let message = broken[0].to_string();
        assert!(
            message.contains(name) && message.contains("above"),
            "{message}"
        );
        assert!(broken[0].value > broken[0].limit);
    }
}

#[test]
fn different_pictures_break_all_limits() {
    let tight = Limits {
        max_rmse: Some(0.01),
        max_mean: Some(0.01),
        max_abs: Some(0.1),
        max_p99: Some(0.1),
        max_alpha: None,
        max_flip: Some(0.1),
        max_outliers: vec![(0.02, 0.001)],
    };
    let c = compare(&constant(0.1), &constant(0.6), &tight.options(true)).unwrap();
    assert_eq!(tight.check(&c).len(), 6);
    let same = compare(&constant(0.1), &constant(0.1), &tight.options(true)).unwrap();
    assert_eq!(tight.check(&same), []);
}

#[test]
fn a_limit_on_what_was_not_measured_is_broken() {
    let limits = Limits {
        max_flip: Some(1.0),
        max_outliers: vec![(0.02, 1.0)],
        ..Limits::default()
    };
    let options = CompareOptions {
        clip: true,
        thresholds: vec![0.03],
        flip: false,
    };
    let c = compare(&constant(0.5), &constant(0.5), &options).unwrap();
    assert_eq!(c.flip_mean, None);
    let broken = limits.check(&c);
    assert_eq!(broken.len(), 2);
    assert!(
        broken
            .iter()
            .all(|b| b.to_string().contains("not measured"))
    );
}

#[test]
fn non_finite_pixels_are_outliers_and_never_allowed() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for channel in 0..3 {
            let sound = constant(0.5);
            let mut other = constant(0.5);
            other.rgb[17][channel] = bad;
            // Even in both pictures at once, and even if clipping would make it finite.
            for (a, b) in [(&sound, &other), (&other, &sound), (&other, &other)] {
                let c = compare(a, b, &CompareOptions::default()).unwrap();
                assert_eq!((c.non_finite, c.max_abs), (1, 0.0));
                assert_eq!(c.outliers, [(0.02, 1.0 / 1024.0)]);
                assert_eq!(Limits::default().check(&c).len(), 1);
            }
        }
    }
    let all = compare(
        &constant(f32::NAN),
        &constant(0.0),
        &CompareOptions::default(),
    )
    .unwrap();
    assert_eq!(
        (all.non_finite, all.rmse, all.outliers[0].1),
        (1024, 0.0, 1.0)
    );
}

#[test]
fn alpha_is_compared_and_missing_alpha_is_opaque() {
    let with = |alpha: f32| Picture {
        alpha: Some(vec![alpha; 1024]),
        ..constant(0.5)
    };
    let alpha =
        |a: &Picture, b: &Picture| compare(a, b, &CompareOptions::default()).unwrap().max_alpha;
    assert_eq!(alpha(&with(0.25), &with(0.75)), 0.5);
    assert_eq!(alpha(&with(0.25), &constant(0.5)), 0.75);
    assert_eq!(alpha(&with(1.0), &constant(0.5)), 0.0);
    let mut bad = with(0.5);
    bad.alpha.as_mut().unwrap()[3] = f32::NAN;
    assert!(alpha(&bad, &constant(0.5)).is_nan());
    let limits = Limits {
        max_alpha: Some(1.0),
        ..Limits::default()
    };
    assert_eq!(
        limits
            .check(&compare(&bad, &bad, &limits.options(true)).unwrap())
            .len(),
        1
    );
}

#[test]
fn other_sizes_and_no_pixels_are_errors() {
    let [a, mut b] = pair();
    (b.width, b.height) = (b.height, b.width);
    let error = compare(&a, &b, &CompareOptions::default()).unwrap_err();
    assert_eq!(
        error,
        CompareError::Sizes {
            expected: (40, 30),
            actual: (30, 40)
        }
    );
    assert!(error.to_string().contains("40x30 and 30x40"));
    assert!(difference_picture(&a, &b).is_err());

    let none = picture(0, 5, Vec::new());
    assert_eq!(
        compare(&none, &none, &CompareOptions::default()),
        Err(CompareError::Empty)
    );
}

#[test]
fn the_difference_picture_shows_both_and_where_they_differ() {
    let a = picture(5, 2, vec![[0.5; 3]; 10]);
    let mut b = a.clone();
    b.rgb[0] = [0.5, 0.50005, 0.5]; // below what is shown
    b.rgb[1] = [0.5, 0.501, 0.5];
    b.rgb[2] = [0.5, 0.5, 0.4];
    b.rgb[3] = [0.5, 0.5, f32::NAN];
    let mut black = a.clone();
    black.rgb[4] = [0.0; 3];
    b.rgb[4] = [1.0; 3];
    let shown = difference_picture(&black, &b).unwrap();
    assert_eq!((shown.width, shown.height, shown.pixels.len()), (15, 2, 30));
    assert_eq!(
        shown.pixels[..5],
        [[188; 3], [188; 3], [188; 3], [188; 3], [0; 3]]
    );
    assert_eq!(
        shown.pixels[5..10],
        [[188; 3], [188; 3], [188, 188, 170], [188, 188, 0], [255; 3]]
    );
    assert_eq!(shown.pixels[15..25], [[188; 3]; 10]);

    let difference = &shown.pixels[10..15];
    let brightness = |p: [u8; 3]| p.iter().map(|c| u32::from(*c)).sum::<u32>();
    assert!(brightness(difference[0]) < 10 && shown.pixels[29] == difference[0]);
    assert!(brightness(difference[0]) < brightness(difference[1]));
    assert!(brightness(difference[1]) < brightness(difference[2]));
    assert!(brightness(difference[4]) > 600, "{:?}", difference[4]);
    assert_eq!(difference[3], [0, 255, 0]);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("difference");
    shown.write_png(&path).unwrap();
    assert_eq!(Picture::read(&path).unwrap().width, 15);
}

#[test]
fn a_film_is_compared_as_a_picture() {
    let mut film = Film::new(4, 3);
    film.radiance[5] = [0.25; 3];
    let c = compare(
        &Picture::from(&film),
        &Picture::from(&Film::new(4, 3)),
        &CompareOptions::default(),
    )
    .unwrap();
    assert_eq!((c.pixels, c.max_abs), (12, 0.25));
}
