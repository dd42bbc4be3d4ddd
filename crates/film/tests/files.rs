//! Pictures to files and back: our own, other programs' (from the folder `shared` beside the repository, where there is
//! one), and damaged ones.
#![allow(
    clippy::print_stderr,
    reason = "a test without its pictures has to say so"
)]

use std::fs;
use std::path::{Path, PathBuf};

use exr::prelude as exr;
use raytree_film::{
    Aovs, BitDepth, CompareOptions, Film, FilmError, Format, Limits, NO_ID, Picture, Rect, ToneMap,
    Window, WriteOptions, compare, quantise_u8, srgb_decode, srgb_encode,
};

/// A film with a different value in every entry of every layer.
fn film(width: u32, height: u32) -> Film {
    let mut film = Film::new(width, height);
    let n = film.pixel_count();
    let vectors = |seed: f32| -> Vec<[f32; 3]> {
        (0..n)
            .map(|i| [i as f32 + seed, -(i as f32) * seed, 0.1 * i as f32 * seed])
            .collect()
    };
    let ids = |seed: u32| (0..n as u32).map(|i| i.wrapping_mul(seed)).collect();
    film.radiance = (0..n)
        .map(|i| {
            [
                i as f32 / n as f32,
                (i % 7) as f32 / 6.0,
                3.0 / (1.0 + i as f32),
            ]
        })
        .collect();
    film.alpha = (0..n).map(|i| (i % 5) as f32 / 4.0).collect();
    film.aovs = Some(Aovs {
        depth: (0..n).map(|i| 1.0 + i as f32).collect(),
        position: vectors(2.0),
        geometric_normal: vectors(3.0),
        shading_normal: vectors(4.0),
        albedo: vectors(5.0),
        material_id: ids(2),
        node_id: ids(16_777_217), // beyond what a float holds exactly
        rays: ids(3),
    });
    film
}

fn linear(alpha: bool, png_bits: BitDepth) -> WriteOptions {
    WriteOptions {
        tone: ToneMap::None,
        exposure: 0.0,
        png_bits,
        alpha,
    }
}

/// A file of the folder `shared`, unless it is missing, which is said.
fn shared(file: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared")
        .join(file);
    if !path.exists() {
        eprintln!("skipped: there is no {}", path.display());
        return None;
    }
    Some(path)
}

#[test]
fn exr_keeps_every_bit_of_the_radiance() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.EXR");
    let mut film = film(37, 41);
    film.radiance[5] = [1e30, 1e-40, -7.5];
    film.write(&path, &WriteOptions::default()).unwrap();
    assert_eq!(Picture::read(&path).unwrap(), Picture::from(&film));
}

#[test]
fn exr_keeps_every_layer_under_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut film = film(9, 20);
    let aovs = film.aovs.as_mut().unwrap();
    aovs.material_id[3] = NO_ID;
    film.write(&path, &WriteOptions::default()).unwrap();

    let image = exr::read_first_flat_layer_from_file(&path).unwrap();
    let channels = &image.layer_data.channel_data.list;
    let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
    let expected = "A B G MaterialId N.X N.Y N.Z Ng.X Ng.Y Ng.Z NodeId Position.X Position.Y Position.Z R Z \
                    albedo.B albedo.G albedo.R rays";
    assert_eq!(names.join(" "), expected);
    let samples = |name: &str| {
        let index = names.iter().position(|n| n == name).unwrap();
        &channels[index].sample_data
    };
    let aovs = film.aovs.as_ref().unwrap();
    let floats = |name: &str, expected: Vec<f32>| {
        assert_eq!(samples(name), &exr::FlatSamples::F32(expected), "{name}");
    };
    floats("A", film.alpha.clone());
    floats("Z", aovs.depth.clone());
    for (axis, name) in ["R", "G", "B"].into_iter().enumerate() {
        floats(name, film.radiance.iter().map(|v| v[axis]).collect());
        floats(
            &format!("albedo.{name}"),
            aovs.albedo.iter().map(|v| v[axis]).collect(),
        );
    }
    for (axis, name) in ["X", "Y", "Z"].into_iter().enumerate() {
        floats(
            &format!("Position.{name}"),
            aovs.position.iter().map(|v| v[axis]).collect(),
        );
        floats(
            &format!("Ng.{name}"),
            aovs.geometric_normal.iter().map(|v| v[axis]).collect(),
        );
        floats(
            &format!("N.{name}"),
            aovs.shading_normal.iter().map(|v| v[axis]).collect(),
        );
    }
    for (name, ids) in [
        ("MaterialId", &aovs.material_id),
        ("NodeId", &aovs.node_id),
        ("rays", &aovs.rays),
    ] {
        assert_eq!(samples(name), &exr::FlatSamples::U32(ids.clone()), "{name}");
    }
    assert_eq!(
        image.layer_data.encoding.compression,
        exr::Compression::ZIP16
    );
    let software = image.layer_data.attributes.software_name.unwrap();
    assert_eq!(
        software.to_string(),
        format!("raytree {}", env!("CARGO_PKG_VERSION"))
    );
}

#[test]
fn a_plain_rgba_reader_takes_an_exr_with_all_layers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let film = film(9, 20);
    film.write(&path, &WriteOptions::default()).unwrap();
    let image = exr::read_first_rgba_layer_from_file(
        &path,
        |size, _| vec![[0f32; 4]; size.area()],
        |pixels, at, (r, g, b, a): (f32, f32, f32, f32)| pixels[at.y() * 9 + at.x()] = [r, g, b, a],
    )
    .unwrap();
    for (i, [r, g, b, a]) in image.layer_data.channel_data.pixels.into_iter().enumerate() {
        assert_eq!((film.radiance[i], film.alpha[i]), ([r, g, b], a));
    }
}

#[test]
fn a_window_lies_where_it_belongs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut part = film(6, 4);
    part.window = Window {
        full_width: 30,
        full_height: 20,
        x: 21,
        y: 13,
    };
    part.write(&path, &WriteOptions::default()).unwrap();
    let picture = Picture::read(&path).unwrap();
    let data = Rect {
        x: 21,
        y: 13,
        width: 6,
        height: 4,
    };
    assert_eq!(
        (picture.width, picture.height, picture.data),
        (30, 20, data)
    );
    assert_eq!(picture.crop(data).unwrap(), Picture::from(&part));
    assert_eq!(picture.rgb[0], [0.0; 3]);
    assert_eq!(picture.crop(Rect { x: 25, ..data }), None);

    let shifted = picture
        .crop(Rect {
            x: 20,
            y: 10,
            width: 4,
            height: 9,
        })
        .unwrap();
    assert_eq!(
        shifted.data,
        Rect {
            x: 1,
            y: 3,
            width: 3,
            height: 4
        }
    );
    assert_eq!(shifted.rgb[3 * 4 + 1], part.radiance[0]);

    let png = folder.path().join("a.png");
    part.write(&png, &linear(false, BitDepth::Eight)).unwrap();
    let picture = Picture::read(&png).unwrap();
    assert_eq!((picture.width, picture.height), (6, 4));
}

#[test]
fn the_same_film_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let film = film(130, 70);
    for ending in ["png", "exr"] {
        let bytes = |name: &str| {
            let path = folder.path().join(name).with_extension(ending);
            film.write(&path, &WriteOptions::default()).unwrap();
            fs::read(path).unwrap()
        };
        let first = bytes("a");
        assert!((0..5).all(|_| bytes("b") == first), "{ending}");
    }
}

#[test]
fn png_holds_the_tone_mapped_picture_at_both_depths() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let film = film(8, 9);
    for (bits, steps) in [(BitDepth::Eight, 255.0), (BitDepth::Sixteen, 65535.0)] {
        for tone in [ToneMap::None, ToneMap::Neutral, ToneMap::Agx, ToneMap::Aces] {
            let options = WriteOptions {
                tone,
                exposure: 1.5,
                png_bits: bits,
                alpha: false,
            };
            film.write(&path, &options).unwrap();
            let picture = Picture::read(&path).unwrap();
            assert_eq!(picture.alpha, None);
            for (radiance, read) in film.radiance.iter().zip(&picture.rgb) {
                let shown = tone.apply(radiance.map(|c| c * 1.5f32.exp2()));
                for (expected, read) in shown.iter().zip(read) {
                    let error = (srgb_encode(*expected) - srgb_encode(*read)).abs() * steps;
                    assert!(error <= 0.51, "{tone:?} {bits:?}: {expected} {read}");
                }
            }
        }
    }
}

#[test]
fn png_has_straight_alpha() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let mut film = Film::new(3, 1);
    film.radiance = vec![[0.25, 0.1, 0.0], [0.5, 0.5, 0.5], [0.7, 0.2, 0.1]];
    film.alpha = vec![0.5, 1.0, 0.0];
    film.write(&path, &linear(true, BitDepth::Eight)).unwrap();

    let raw = image::open(&path).unwrap().into_rgba8();
    let encoded = |c: f32| quantise_u8(srgb_encode(c));
    assert_eq!(raw.get_pixel(0, 0).0, [encoded(0.5), encoded(0.2), 0, 128]);
    assert_eq!(raw.get_pixel(1, 0).0, [188, 188, 188, 255]);
    assert_eq!(raw.get_pixel(2, 0).0, [0, 0, 0, 0]);

    let read = Picture::read(&path).unwrap();
    assert!((read.rgb[0][0] - 0.25).abs() < 0.003);
    assert_eq!(read.alpha.unwrap()[1..], [1.0, 0.0]);
}

#[test]
fn any_kind_of_png_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let grey = srgb_decode(100.0 / 255.0);
    let pictures: [(image::DynamicImage, bool); 6] = [
        (
            image::GrayImage::from_pixel(2, 3, image::Luma([100])).into(),
            false,
        ),
        (
            image::GrayAlphaImage::from_pixel(2, 3, image::LumaA([100, 255])).into(),
            true,
        ),
        (
            image::RgbImage::from_pixel(2, 3, image::Rgb([100; 3])).into(),
            false,
        ),
        (
            image::RgbaImage::from_pixel(2, 3, image::Rgba([100, 100, 100, 255])).into(),
            true,
        ),
        (
            image::ImageBuffer::from_pixel(2, 3, image::Luma([100u16 * 257])).into(),
            false,
        ),
        (
            image::ImageBuffer::from_pixel(2, 3, image::Rgb([100u16 * 257; 3])).into(),
            false,
        ),
    ];
    for (picture, has_alpha) in pictures {
        picture.save(&path).unwrap();
        let read = Picture::read(&path).unwrap();
        assert_eq!((read.width, read.height, read.rgb.len()), (2, 3, 6));
        assert_eq!(read.alpha.is_some(), has_alpha);
        let close = read.rgb.iter().flatten().all(|c| (c - grey).abs() < 1e-6);
        assert!(close, "{:?}: {:?}", picture.color(), read.rgb[0]);
    }
}

/// 2 x 1 pixels, one bit each: red and blue from a palette, red half transparent. Made by hand after the specification.
const PALETTE_PNG: [&[u8]; 6] = [
    b"\x89PNG\x0d\x0a\x1a\x0a",
    b"\x00\x00\x00\x0dIHDR\x00\x00\x00\x02\x00\x00\x00\x01\x01\x03\x00\x00\x00\xce\xec\xed\xc9",
    b"\x00\x00\x00\x06PLTE\xff\x00\x00\x00\x00\xffl\xa1\xfd\x8e",
    b"\x00\x00\x00\x01tRNS\x80\xad^[F",
    b"\x00\x00\x00\x0aIDATx\x9ccp\x00\x00\x00B\x00A)7\xf4\xef",
    b"\x00\x00\x00\x00IEND\xaeB`\x82",
];

#[test]
fn a_palette_png_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("palette.png");
    fs::write(&path, PALETTE_PNG.concat()).unwrap();
    let read = Picture::read(&path).unwrap();
    assert_eq!(read.rgb, [[128.0 / 255.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_eq!(read.alpha, Some(vec![128.0 / 255.0, 1.0]));
}

#[test]
fn names_decide_the_format() {
    let film = film(2, 2);
    for name in ["picture", "picture.jpg", "a.exr.bak", "png"] {
        let error = film
            .write(Path::new(name), &WriteOptions::default())
            .unwrap_err();
        assert!(matches!(error, FilmError::UnknownEnding { .. }));
        let message = error.to_string();
        assert!(
            [name, ".png", ".exr"]
                .iter()
                .all(|part| message.contains(part)),
            "{message}"
        );
    }
    assert_eq!(Format::of_path(Path::new("x/y.PNG")).unwrap(), Format::Png);
    assert_eq!(Format::of_path(Path::new("x/y.exr")).unwrap(), Format::Exr);
}

#[cfg(unix)]
#[test]
fn the_null_device_takes_a_picture() {
    film(2, 2)
        .write(Path::new("/dev/null"), &WriteOptions::default())
        .unwrap();
}

#[test]
fn what_cannot_be_written_says_where_and_what_to_do() {
    let error = film(2, 2)
        .write(Path::new("/no/such/folder/a.png"), &WriteOptions::default())
        .unwrap_err();
    let message = error.to_string();
    assert!(matches!(error, FilmError::Write { .. }));
    assert!(
        message.contains("/no/such/folder/a.png") && message.contains("folder exists"),
        "{message}"
    );

    let folder = tempfile::tempdir().unwrap();
    for name in ["empty.png", "empty.exr"] {
        let path = folder.path().join(name);
        let error = Film::new(0, 0)
            .write(&path, &WriteOptions::default())
            .unwrap_err();
        assert!(matches!(error, FilmError::Encode { .. }), "{error}");
        assert!(!path.exists());
    }
}

#[test]
fn what_is_no_picture_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    for contents in [&b""[..], b"P6 1 1 255", b"\x89PNG"] {
        fs::write(&path, contents).unwrap();
        assert!(matches!(
            Picture::read(&path),
            Err(FilmError::UnknownFormat { .. })
        ));
    }
    assert!(matches!(
        Picture::read(&folder.path().join("none")),
        Err(FilmError::Read { .. })
    ));
    assert!(matches!(
        Picture::read(folder.path()),
        Err(FilmError::Read { .. })
    ));
}

/// Cuts off a sound file everywhere and changes single bytes: whatever comes out, it is no panic, and the cut ones are errors.
#[test]
fn damaged_files_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let mut film = film(20, 40);
    film.aovs = None;
    for name in ["a.png", "a.exr"] {
        let path = folder.path().join(name);
        film.write(&path, &linear(true, BitDepth::Eight)).unwrap();
        let sound = fs::read(&path).unwrap();
        for length in (0..sound.len() - 20).step_by(13) {
            fs::write(&path, &sound[..length]).unwrap();
            assert!(
                Picture::read(&path).is_err(),
                "{name} cut to {length} bytes"
            );
        }
        for position in (0..sound.len().min(1500)).step_by(4) {
            for value in [0, 0xff, sound[position] ^ 0x80] {
                let mut damaged = sound.clone();
                damaged[position] = value;
                fs::write(&path, &damaged).unwrap();
                let _: Result<Picture, FilmError> = Picture::read(&path);
            }
        }
    }
}

#[test]
fn a_few_bytes_cannot_claim_a_giant_picture() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    film(4, 4).write(&path, &WriteOptions::default()).unwrap();
    let sound = fs::read(&path).unwrap();
    let start =
        |name: &[u8]| sound.windows(name.len()).position(|w| w == name).unwrap() + name.len();
    // After the attribute's name: its type's name, a length, and the window's corners.
    for window in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let far_corner = start(window) + 4 + 8;
        let mut huge = sound.clone();
        huge[far_corner..far_corner + 8]
            .copy_from_slice(&[0xff, 0xff, 0xff, 0x1f, 0xff, 0xff, 0xff, 0x1f]);
        fs::write(&path, &huge).unwrap();
        let error = Picture::read(&path).unwrap_err();
        let refused = matches!(
            error,
            FilmError::TooLarge { .. } | FilmError::Damaged { .. }
        );
        assert!(refused, "{error}");
    }

    // A PNG of 100,000 x 100,000 pixels whose data breaks off at once.
    let path = folder.path().join("a.png");
    fs::write(&path, HUGE_PNG.concat()).unwrap();
    let error = Picture::read(&path).unwrap_err();
    assert!(matches!(error, FilmError::TooLarge { .. }), "{error}");
}

/// Only the head is there.
const HUGE_PNG: [&[u8]; 3] = [
    b"\x89PNG\x0d\x0a\x1a\x0a",
    b"\x00\x00\x00\x0dIHDR\x00\x01\x86\xa0\x00\x01\x86\xa0\x08\x02\x00\x00\x00'0\x9c\x9f",
    b"\x00\x00\x00\x0cIDATx\x9cc`\xa0\x0c\x00\x00\x00@\x00\x01\xb74|\xef",
];

/// The crate `exr` would try to allocate what this block claims, and abort.
#[test]
fn a_dwa_block_cannot_claim_more_than_it_holds() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let color = |exr::Vec2(x, y): exr::Vec2<usize>| ((x * y % 7) as f32, x as f32 / 9.0, y as f32);
    let mut image = exr::Image::from_channels((40, 30), exr::SpecificChannels::rgb(color));
    image.layer_data.encoding = exr::Encoding {
        compression: exr::Compression::DWAA(None),
        blocks: exr::Blocks::ScanLines,
        line_order: exr::LineOrder::Increasing,
    };
    exr::WritableImage::write(&image).to_file(&path).unwrap();
    assert_eq!(Picture::read(&path).unwrap().rgb.len(), 1200);

    // Its one block follows the table with its one offset, which therefore holds its own place plus 8.
    let sound = fs::read(&path).unwrap();
    let is_table = |at: &usize| sound[*at..*at + 8] == (*at as u64 + 8).to_le_bytes();
    let table = (0..sound.len() - 8).find(is_table).unwrap();
    let counters = table + 16;
    for counter in [1, 6, 7, 8, 9] {
        let mut damaged = sound.clone();
        let at = counters + 8 * counter;
        damaged[at..at + 8].copy_from_slice(&(1u64 << 48).to_le_bytes());
        fs::write(&path, &damaged).unwrap();
        let error = Picture::read(&path).unwrap_err();
        assert!(matches!(error, FilmError::Damaged { .. }), "{error}");
    }
}

#[test]
fn the_reference_pictures_are_read() {
    let (Some(exr), Some(png)) = (
        shared("reference/spheres/povray.exr"),
        shared("reference/spheres/povray.png"),
    ) else {
        return;
    };
    let (exr, png) = (Picture::read(&exr).unwrap(), Picture::read(&png).unwrap());
    assert_eq!(
        (exr.width, exr.height, png.width, png.height),
        (640, 480, 640, 480)
    );
    // The PNG is the EXR rounded to 8 bits: half a step, where the sRGB curve is steepest.
    let comparison = compare(&exr, &png, &CompareOptions::default()).unwrap();
    let limits = Limits {
        max_abs: Some(0.0045),
        max_mean: Some(0.001),
        max_flip: Some(0.01),
        ..Limits::default()
    };
    assert_eq!(limits.check(&comparison), []);
}

#[test]
fn other_programs_exr_files_are_read() {
    // What OpenEXR's own library says: the display window's size, whether there is alpha, where in it the data lies.
    let rect = |x, y, width, height| Rect {
        x,
        y,
        width,
        height,
    };
    let files = [
        ("env/studio.exr", 512, 256, false, rect(0, 0, 512, 256)),
        (
            "env/OrientationLatLong.exr",
            1024,
            512,
            true,
            rect(0, 0, 1024, 512),
        ),
        (
            "env/exr-reading/stripes.exr",
            100,
            50,
            true,
            rect(0, 0, 100, 50),
        ),
        (
            "env/exr-reading/t01.exr",
            400,
            300,
            false,
            rect(0, 0, 400, 300),
        ),
        (
            "env/exr-reading/t08.exr",
            501,
            401,
            false,
            rect(30, 40, 400, 300),
        ),
        (
            "env/exr-reading/BrightRingsNanInf.exr",
            800,
            800,
            false,
            rect(0, 0, 800, 800),
        ),
        (
            "env/exr-reading/GrayRampsHorizontal.exr",
            800,
            800,
            false,
            rect(0, 0, 800, 800),
        ),
    ];
    for (file, width, height, has_alpha, data) in files {
        let Some(path) = shared(file) else { continue };
        let picture = Picture::read(&path).unwrap();
        assert_eq!((picture.width, picture.height), (width, height), "{file}");
        assert_eq!(
            (picture.alpha.is_some(), picture.data),
            (has_alpha, data),
            "{file}"
        );
        assert!(picture.rgb.iter().flatten().any(|c| *c > 0.0), "{file}");
    }
}

#[test]
fn non_finite_pixels_are_kept() {
    let Some(path) = shared("env/exr-reading/BrightRingsNanInf.exr") else {
        return;
    };
    let picture = Picture::read(&path).unwrap();
    assert!(picture.rgb.iter().flatten().any(|c| !c.is_finite()));
}

#[test]
fn what_is_not_read_says_so() {
    if let Some(path) = shared("env/exr-reading/Rec709_YC.exr") {
        let error = Picture::read(&path).unwrap_err();
        assert!(matches!(error, FilmError::Unsupported { .. }), "{error}");
    }
    if let Some(path) = shared("env/exr-damaged/asan_heap-oob_7fb97d097381_293_78e73b649.exr") {
        let error = Picture::read(&path).unwrap_err();
        assert!(matches!(error, FilmError::Damaged { .. }), "{error}");
    }
}
