//! Tests of [`super`]: files written here, and the development corpus where it lies beside the repository.

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, IntegerBounds, Layer, LayerAttributes,
    Vec2, WritableImage,
};
use glam::DVec3;

use super::*;

/// A file that is gone at the end of the test.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str, contents: &[u8]) -> Self {
        let folder = std::env::temp_dir();
        let path = folder.join(format!("raytree-environment-{}-{name}", std::process::id()));
        std::fs::write(&path, contents).unwrap();
        Self(path)
    }

    fn load(&self) -> Result<LoadedMap, EnvironmentError> {
        load_environment(&self.0)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // A file left behind in the temporary folder does no harm.
        let _ = std::fs::remove_file(&self.0);
    }
}

fn assert_radiance(map: &EquirectMap, name: &str) {
    let channels = map.texels.as_flattened();
    let good = channels
        .iter()
        .all(|value| value.is_finite() && *value >= 0.0);
    assert!(good, "{name} has texels that are no radiance");
}

/// An EXR layer of 4 x 2 with these channels, each of one value.
fn exr_bytes(
    channels: &[(&str, f32)],
    data_at: (i32, i32),
    display: Option<IntegerBounds>,
) -> Vec<u8> {
    let list = channels
        .iter()
        .map(|&(name, value)| AnyChannel::new(name, FlatSamples::F32(vec![value; 8])));
    let layer = Layer::new(
        (4, 2),
        LayerAttributes {
            layer_position: Vec2(data_at.0, data_at.1),
            ..LayerAttributes::default()
        },
        Encoding::UNCOMPRESSED,
        AnyChannels::sort(list.collect()),
    );
    let mut image = Image::from_layer(layer);
    if let Some(display) = display {
        image.attributes.display_window = display;
    }
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

const RGB: [(&str, f32); 3] = [("R", 1.0), ("G", 2.0), ("B", 3.0)];

fn hdr_bytes(size: &str, texels: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = format!("#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes();
    bytes.extend(texels.as_flattened());
    bytes
}

#[test]
fn radiance_hdr() {
    let texels = [[128, 64, 32, 129], [0, 0, 0, 0]];
    let file = Scratch::new("two.hdr", &hdr_bytes("-Y 1 +X 2", &texels));
    let loaded = file.load().unwrap();
    assert_eq!(loaded.map.texels, [[1.0, 0.5, 0.25], [0.0; 3]]);
    assert!(loaded.warnings.is_empty());
}

#[test]
fn png_is_decoded_from_srgb() {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_raw(1, 1, vec![0, 188, 255])
        .unwrap()
        .write_to(&mut bytes, image::ImageFormat::Png)
        .unwrap();
    let file = Scratch::new("one.png", bytes.get_ref());
    let [r, g, b] = file.load().unwrap().map.texels[0];
    assert_eq!((r, b), (0.0, 1.0));
    assert!((g - 0.5029).abs() < 1e-4, "{g}");
}

#[test]
fn exr_rgb_and_grey() {
    let with_alpha = [RGB[0], RGB[1], RGB[2], ("A", 0.5)];
    let rgb = exr_bytes(&with_alpha, (0, 0), None);
    let map = Scratch::new("rgb.exr", &rgb).load().unwrap().map;
    assert_eq!((map.width, map.height), (4, 2));
    assert_eq!(map.texels, [[1.0, 2.0, 3.0]; 8]);
    let grey = exr_bytes(&[("Y", 0.25)], (0, 0), None);
    let map = Scratch::new("grey.exr", &grey).load().unwrap().map;
    assert_eq!(map.texels, [[0.25; 3]; 8]);
}

#[test]
fn exr_is_its_display_window() {
    let display = IntegerBounds {
        position: Vec2(-1, 5),
        size: Vec2(4, 3),
    };
    let rgb = exr_bytes(&RGB, (1, 6), Some(display));
    let map = Scratch::new("window.exr", &rgb).load().unwrap().map;
    assert_eq!((map.width, map.height), (4, 3));
    let (out, lit) = ([0.0; 3], [1.0, 2.0, 3.0]);
    let expected = [[out; 4], [out, out, lit, lit], [out, out, lit, lit]];
    assert_eq!(map.texels, expected.as_flattened());
}

#[test]
fn texels_that_are_no_radiance_are_mended_and_counted() {
    let (nan, infinity) = (f32::NAN, f32::INFINITY);
    let mut channels = [
        [nan, 1.0, 2.0],
        [infinity, infinity, 3.0],
        [-1.0, -infinity, 0.5],
        [1.0, 1.0, 1.0],
    ];
    let mended = mend(channels.as_flattened_mut());
    let expected = Mended {
        not_a_number: 1,
        infinite: 1,
        negative: 1,
    };
    assert_eq!(mended, expected);
    assert_eq!(
        channels,
        [[0.0, 1.0, 2.0], [3.0; 3], [0.0, 0.0, 0.5], [1.0; 3]]
    );
    assert_eq!(mend(channels.as_flattened_mut()), Mended::default());
    let mut only_infinite = [infinity; 3];
    mend(&mut only_infinite);
    assert_eq!(only_infinite, [LARGEST_HALF; 3]);
}

#[test]
fn large_maps_are_averaged_down() {
    let pixels = Pixels {
        width: 8192,
        height: 2,
        channels: [1.0, 2.0, 3.0, 3.0, 2.0, 1.0].repeat(8192),
    };
    let loaded = pixels.into_map(Path::new("wide.hdr"));
    assert_eq!((loaded.map.width, loaded.map.height), (4096, 1));
    assert!(loaded.map.texels.iter().all(|&texel| texel == [2.0; 3]));
    let warning = loaded.warnings[0].to_string();
    assert!(warning.contains("wide.hdr: 8192 x 2"), "{warning}");
    assert_eq!(size_within((10_000, 5000), 4096), (4096, 2048));
    assert_eq!(size_within((4096, 2048), 4096), (4096, 2048));
    assert_eq!(size_within((100_000, 1), 4096), (4096, 1));
}

#[test]
fn refusals_name_the_file_the_problem_and_the_remedy() {
    use EnvironmentProblem::{Damaged, Io, Size, Unsupported};
    let refusal = |name: &str, contents: &[u8]| {
        let error = Scratch::new(name, contents).load().unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
        error.problem
    };
    for (name, contents) in [
        ("text.hdr", b"no picture".to_vec()),
        ("empty.exr", Vec::new()),
        ("depth.exr", exr_bytes(&[("Z", 1.0)], (0, 0), None)),
        ("turned.hdr", hdr_bytes("+X 1 -Y 1", &[[1, 2, 3, 4]])),
    ] {
        let problem = refusal(name, &contents);
        assert!(matches!(problem, Unsupported { .. }), "{name}: {problem}");
    }
    let short = refusal("short.hdr", &hdr_bytes("-Y 2 +X 2", &[[1, 2, 3, 4]]));
    assert!(matches!(short, Damaged(_)), "{short}");
    let none = refusal("none.hdr", &hdr_bytes("-Y 0 +X 0", &[]));
    assert!(matches!(none, Size { .. }), "{none}");
    let missing = load_environment(Path::new("/no/such.exr"))
        .unwrap_err()
        .problem;
    assert!(matches!(missing, Io(_)), "{missing}");
}

#[test]
fn channels_that_are_there_are_named() {
    let depth = exr_bytes(&[("Y", 1.0), ("RY", 1.0), ("BY", 1.0)], (0, 0), None);
    let error = Scratch::new("chroma.exr", &depth).load().unwrap_err();
    assert!(
        error.to_string().contains("there are: BY, RY, Y"),
        "{error}"
    );
}

#[test]
fn claimed_sizes_are_refused_before_anything_is_allocated() {
    let huge_window = IntegerBounds {
        position: Vec2(0, 0),
        size: Vec2(1 << 20, 1 << 20),
    };
    for (name, contents) in [
        ("huge.hdr", hdr_bytes("-Y 30000 +X 30000", &[])),
        ("huge.exr", exr_bytes(&RGB, (0, 0), Some(huge_window))),
    ] {
        let error = Scratch::new(name, &contents).load().unwrap_err();
        let as_expected = matches!(error.problem, EnvironmentProblem::Size { .. });
        assert!(as_expected, "{error}");
    }
}

#[test]
fn texels_that_the_bytes_cannot_hold_are_refused() {
    let window = IntegerBounds {
        position: Vec2(0, 0),
        size: Vec2(8192, 4096),
    };
    for (name, contents) in [
        ("hollow.hdr", hdr_bytes("-Y 4096 +X 8192", &[])),
        ("hollow.exr", exr_bytes(&RGB, (0, 0), Some(window))),
    ] {
        let error = Scratch::new(name, &contents).load().unwrap_err();
        assert!(
            error.to_string().contains("8192 x 4096 texels in"),
            "{error}"
        );
    }
}

/// Whatever is cut off or overwritten: a map or an error, never a panic.
#[test]
fn damaged_files_are_errors_or_maps() {
    let hdr = hdr_bytes("-Y 1 +X 2", &[[128, 64, 32, 129], [1, 1, 1, 0]]);
    let exr = exr_bytes(&RGB, (0, 0), None);
    for (name, intact) in [("damaged.hdr", hdr), ("damaged.exr", exr)] {
        for at in 0..intact.len() {
            let mut overwritten = intact.clone();
            overwritten[at] ^= 0xff;
            for contents in [&intact[..at], &overwritten] {
                if let Ok(loaded) = Scratch::new(name, contents).load() {
                    assert_radiance(&loaded.map, name);
                }
            }
        }
    }
}

/// Run lengths whose factor overflows: image 0.25.10 panics on them where overflow is checked.
#[test]
fn decoders_that_panic_are_caught() {
    let mut texels = vec![[9, 9, 9, 9]];
    texels.resize(12, [1, 1, 1, 0]);
    let contents = hdr_bytes("-Y 1 +X 8", &texels);
    let error = Scratch::new("runs.hdr", &contents).load().unwrap_err();
    let damaged = matches!(error.problem, EnvironmentProblem::Damaged(_));
    assert!(damaged, "{error}");
}

/// A counter in a block's header by which exr 1.74.2 would allocate 2^60 bytes, which ends the process.
#[test]
fn impossible_sizes_inside_a_dwa_block_are_refused() {
    let Some(path) = corpus("studio.exr") else {
        return;
    };
    let mut contents = std::fs::read(path).unwrap();
    // 256 rows are one block, so the table has one entry, and what it points to follows: y, size, version and counters.
    let position = contents
        .array_windows::<8>()
        .enumerate()
        .find(|&(at, word)| u64::from_le_bytes(*word) == at as u64 + 8);
    let (at, _) = position.expect("an offset that points behind itself");
    let dc_count = at + 8 + 8 + 9 * 8;
    contents[dc_count..dc_count + 8].copy_from_slice(&(1u64 << 60).to_le_bytes());
    let error = Scratch::new("dwa.exr", &contents).load().unwrap_err();
    assert!(error.to_string().contains("impossible sizes"), "{error}");
}

/// A file of the development corpus, if that lies beside the repository.
fn corpus(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/env");
    let path = folder.join(name);
    let found = path.exists().then_some(path);
    if found.is_none() {
        skipped(name);
    }
    found
}

#[expect(
    clippy::print_stderr,
    reason = "a test that checks nothing has to say so"
)]
fn skipped(name: &str) {
    eprintln!("skipped: shared/env/{name} is not there");
}

#[test]
fn corpus_loads() {
    for (name, width, height) in [
        ("chinese_garden_1k.hdr", 1024, 512),
        ("studio.exr", 512, 256),
        ("exr-reading/stripes.exr", 100, 50),
        ("exr-reading/GrayRampsHorizontal.exr", 800, 800),
        ("exr-reading/BrightRingsNanInf.exr", 800, 800),
        ("exr-reading/t01.exr", 400, 300),
        // Its data window is 400 x 300 of this display window.
        ("exr-reading/t08.exr", 501, 401),
    ] {
        let Some(path) = corpus(name) else { continue };
        let map = load_environment(&path).unwrap().map;
        assert_eq!((map.width, map.height), (width, height), "{name}");
        assert_radiance(&map, name);
        assert!(
            resample::mean(&map).min_element() > 0.0,
            "{name} lacks a colour"
        );
    }
}

#[test]
fn corpus_texels_that_are_no_radiance_are_reported() {
    let Some(path) = corpus("exr-reading/BrightRingsNanInf.exr") else {
        return;
    };
    let warnings = load_environment(&path).unwrap().warnings;
    assert!(
        warnings[0].text.contains("4 not a number"),
        "{}",
        warnings[0]
    );
}

#[test]
fn corpus_refusals() {
    for (name, expected) in [
        ("exr-reading/Rec709_YC.exr", "subsampling"),
        (
            "exr-damaged/asan_heap-oob_7fb97d097381_293_78e73b649.exr",
            "damaged",
        ),
    ] {
        let Some(path) = corpus(name) else { continue };
        let error = load_environment(&path).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

/// The map draws, in each of its four horizontal views, the axes that one would see there: a dark line to the side where
/// +X or +Z lies, none on the other side.
#[test]
fn corpus_orientation_map_agrees_with_our_directions() {
    let Some(path) = corpus("OrientationLatLong.exr") else {
        return;
    };
    let map = load_environment(&path).unwrap().map;
    for (view, axis) in [
        (DVec3::X, DVec3::Z),
        (DVec3::Z, DVec3::X),
        (DVec3::NEG_X, DVec3::Z),
        (DVec3::NEG_Z, DVec3::X),
    ] {
        // Darkest in a short stretch across the horizon, a few degrees beside the middle of the view.
        let darkest = |side: f64| {
            (-20..=20)
                .map(|i| view + 0.15 * side * axis + 0.001 * f64::from(i) * DVec3::Y)
                .map(|direction| map.sample(direction.normalize()).max_element())
                .fold(f64::MAX, f64::min)
        };
        let (with, against) = (darkest(1.0), darkest(-1.0));
        assert!(
            with < 0.5 * against,
            "looking along {view}: {with}, {against}"
        );
    }
}
