//! The shaders without a device: do all programs assemble and validate, do host and shaders mean the same by every struct and
//! number that they share, and is what a scene does not need really gone from its program? Judged by naga's reflection.

mod support;

#[path = "shaders/cases.rs"]
mod cases;
#[path = "shaders/constants.rs"]
mod constants;
#[path = "shaders/layouts.rs"]
mod layouts;
#[path = "shaders/marks.rs"]
mod marks;
#[path = "shaders/module.rs"]
mod module;

use std::{
    collections::{BTreeSet, HashSet},
    fs,
    path::Path,
};

use naga::Module;
use raytree::{
    Feature, ImportError, ProgramFeatures, RenderSettings, Scene, SceneFeatures, Shading,
};
use raytree_gpu::{
    Kernel, Piece, ProgramError, assemble, bindings_of,
    source::{self, Limits, SOURCE_FILES},
    specialise,
};

use marks::{MARKS, Marks, SHARED};
use module::{call_sites, constant_branches, copies, names, parts, size};

/// Every entry point.
fn kernels() -> impl Iterator<Item = Kernel> {
    let pieces = Piece::ALL.iter().map(|&piece| Kernel::Piece(piece));
    Kernel::PICTURE
        .into_iter()
        .chain([Kernel::Aov, Kernel::Probe, Kernel::Secondary])
        .chain(pieces)
}

/// The programs that a picture takes, what `of` says of each put together.
fn of_picture<T: Ord>(features: ProgramFeatures, of: fn(&Module) -> BTreeSet<T>) -> BTreeSet<T> {
    Kernel::PICTURE
        .iter()
        .flat_map(|&kernel| of(&program(kernel, features)))
        .collect()
}

fn program(kernel: Kernel, features: ProgramFeatures) -> Module {
    assemble(kernel, features, Limits::for_depth(32))
        .unwrap_or_else(|error| panic!("{features:?}: {error}"))
}

fn everything_but(left_out: &[Feature]) -> ProgramFeatures {
    left_out
        .iter()
        .fold(ProgramFeatures::everything(), |set, &feature| {
            set.with(feature, false)
        })
}

fn bindings(module: &Module) -> Vec<String> {
    bindings_of(module)
        .into_iter()
        .map(|binding| binding.name)
        .collect()
}

fn shader_files(folder: &Path, found: &mut BTreeSet<String>) {
    for entry in fs::read_dir(folder).expect("shaders/ is part of the project") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            shader_files(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "wgsl") {
            let below = path
                .strip_prefix(support::root().join("shaders"))
                .expect("it lies below shaders/");
            found.insert(below.to_string_lossy().into_owned());
        }
    }
}

#[test]
fn every_shader_file_is_compiled_in() {
    let mut found = BTreeSet::new();
    shader_files(&support::root().join("shaders"), &mut found);
    // Its constants are replaced for each program.
    assert!(found.remove("limits.wgsl"));
    let listed: BTreeSet<String> = SOURCE_FILES
        .iter()
        .map(|file| file.path.to_owned())
        .collect();
    assert_eq!(listed.len(), SOURCE_FILES.len(), "a file is listed twice");
    assert_eq!(found, listed);
}

/// What an editor sees in `limits.wgsl` is what the host replaces, no more and no less.
#[test]
fn limits_are_those_that_the_host_sets() {
    let text = fs::read_to_string(support::root().join("shaders/limits.wgsl"))
        .expect("shaders/ is part of the project");
    let constants = |module: &Module| {
        module
            .constants
            .iter()
            .filter_map(|(_, c)| c.name.clone())
            .collect::<BTreeSet<_>>()
    };
    let alone = naga::front::wgsl::parse_str(&text).expect("limits.wgsl parses alone");
    let files: String = SOURCE_FILES.iter().map(|file| file.text).collect();
    let with_defaults =
        naga::front::wgsl::parse_str(&format!("{text}{files}")).expect("the defaults parse too");
    let as_assembled = source::parse(Limits::for_depth(32)).expect("the shaders parse");
    assert_eq!(constants(&with_defaults), constants(&as_assembled));
    assert!(!constants(&alone).is_empty());
}

#[test]
fn an_error_names_file_and_line() {
    // As many as lie in variables, so that none are left for the array.
    let Err(error) = source::parse(Limits { traversal_stack: 4 }) else {
        panic!("an array without elements parses")
    };
    let file = SOURCE_FILES
        .iter()
        .find(|file| file.path == error.file)
        .unwrap_or_else(|| panic!("{error}"));
    let line = file
        .text
        .lines()
        .nth(error.line as usize - 1)
        .unwrap_or_else(|| panic!("{error}"));
    assert!(line.contains("TRAVERSAL_STACK"), "{error}: {line}");
}

#[test]
fn features_are_the_overrides() {
    let module = source::parse(Limits::for_depth(32)).expect("the shaders parse");
    let declared: Vec<&str> = module
        .overrides
        .iter()
        .filter_map(|(_, feature)| feature.name.as_deref())
        .collect();
    let known: Vec<&str> = Feature::ALL
        .iter()
        .map(|feature| feature.override_name())
        .collect();
    assert_eq!(declared, known);
    let labels: BTreeSet<&str> = Feature::ALL.iter().map(|feature| feature.label()).collect();
    assert_eq!(
        labels.len(),
        Feature::ALL.len(),
        "two features have one label"
    );
}

/// Nothing, everything, each feature alone, each feature left out.
#[test]
fn every_program_assembles_and_is_folded() {
    let mut sets = vec![ProgramFeatures::default(), ProgramFeatures::everything()];
    for &feature in Feature::ALL {
        sets.push(ProgramFeatures::default().with(feature, true));
        sets.push(everything_but(&[feature]));
    }
    for kernel in kernels() {
        for &features in &sets {
            let module = program(kernel, features);
            assert_eq!(module.entry_points.len(), 1);
            assert_eq!(module.entry_points[0].name, kernel.name());
            assert_eq!(module.entry_points[0].workgroup_size, [64, 1, 1]);
            assert!(module.overrides.is_empty(), "{features:?}");
            assert_eq!(constant_branches(&module), 0, "{features:?}");
        }
    }
}

/// The check for folding has to be able to fail: before specialisation there are branches on overrides.
#[test]
fn an_unfolded_module_is_noticed() {
    let text = "const ON: bool = true; var<private> x: u32; @compute @workgroup_size(1) fn k() { if (ON) { x = 1u; } }";
    let module = naga::front::wgsl::parse_str(text).expect("it parses");
    assert_eq!(constant_branches(&module), 1);
    let folded = specialise::specialise(&module, "k", &naga::back::PipelineConstants::default())
        .expect("it is valid");
    assert_eq!(constant_branches(&folded), 0);
}

#[test]
fn what_comes_after_a_folded_return_is_gone() {
    let text = "const ON: bool = true; var<private> x: u32; fn after() { x = 2u; }
        @compute @workgroup_size(1) fn k() { if (ON) { x = 1u; return; } after(); }";
    let module = naga::front::wgsl::parse_str(text).expect("it parses");
    let folded = specialise::specialise(&module, "k", &naga::back::PipelineConstants::default())
        .expect("it is valid");
    assert!(names(&module).contains("after") && !names(&folded).contains("after"));
}

/// What of a feature's marks is not as the table says, in the parts of a program without it and of one with it.
fn mark_faults(marks: &Marks, without: &BTreeSet<String>, with: &BTreeSet<String>) -> Vec<String> {
    let present = marks.present.iter().map(|part| (part, with, without));
    let instead = marks.instead.iter().map(|part| (part, without, with));
    let mut faults = Vec::new();
    for (part, has, lacks) in present.chain(instead) {
        for (program, wrong, what) in [(has, false, "has no"), (lacks, true, "still has")] {
            if program.contains(*part) == wrong {
                let which = if std::ptr::eq(program, with) {
                    "with"
                } else {
                    "without"
                };
                faults.push(format!(
                    "a program {which} {:?} {what} `{part}`",
                    marks.feature
                ));
            }
        }
    }
    faults
}

/// A scene without it has a program without its functions, bindings and members of structs, a scene with it one with them.
#[test]
fn each_feature_is_in_the_program_of_a_scene_that_needs_it() {
    let listed: Vec<Feature> = MARKS.iter().map(|marks| marks.feature).collect();
    assert_eq!(listed, Feature::ALL);
    let mut faults = Vec::new();
    for marks in MARKS {
        let feature = marks.feature;
        assert!(
            marks.present.len() + marks.instead.len() > 0,
            "{feature:?} has no marks"
        );
        let pair = cases::pair(feature);
        let has = [0, 1].map(|k| pair[k].features().has(feature));
        assert_eq!(has, [false, true], "{feature:?} of the scenes");
        let [without, with] = pair.map(|case| of_picture(case.features(), parts));
        faults.extend(mark_faults(marks, &without, &with));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The check has to be able to fail: of each row, by a part that every program has, and by one that none has.
#[test]
fn a_wrong_mark_is_noticed() {
    for marks in MARKS {
        let [without, with] =
            cases::pair(marks.feature).map(|case| of_picture(case.features(), parts));
        for wrong in ["trace", "no_such_function", "Frame.no_such_member"] {
            let listed: &'static [&'static str] = match wrong {
                "trace" => &["trace"],
                "no_such_function" => &["no_such_function"],
                _ => &["Frame.no_such_member"],
            };
            let present = Marks {
                feature: marks.feature,
                present: listed,
                instead: &[],
            };
            let instead = Marks {
                present: &[],
                instead: listed,
                ..present
            };
            for row in [present, instead] {
                let faults = mark_faults(&row, &without, &with);
                assert_eq!(faults.len(), 1, "{faults:?}");
                assert!(faults[0].contains(wrong), "{faults:?}");
            }
        }
        // The right row for the wrong programs: nothing is as it says.
        let parts = marks.present.len() + marks.instead.len();
        assert_eq!(mark_faults(marks, &with, &without).len(), 2 * parts);
    }
}

/// `extras.whitted.kt` alone makes a solid that absorbs, under the book's model.
#[test]
fn solids_of_the_book_absorb() {
    let [pbr, book] = cases::book_glass();
    for feature in [Feature::Solids, Feature::Absorption, Feature::Transmission] {
        assert!(!pbr.features().has(feature), "{feature:?}");
        assert!(book.features().has(feature), "{feature:?}");
    }
    assert!(of_picture(book.features(), names).contains("medium_transmittance"));
}

#[test]
fn what_features_share_is_gone_without_all_of_them() {
    let everything = of_picture(ProgramFeatures::everything(), names);
    for (features, gone) in SHARED {
        let without = of_picture(everything_but(features), names);
        for name in *gone {
            assert!(
                everything.contains(*name),
                "a program with everything has no `{name}`"
            );
            assert!(
                !without.contains(*name),
                "a program without {features:?} still has `{name}`"
            );
        }
    }
}

/// Naming of parts: what is there is found, under its name and no other.
#[test]
fn parts_are_what_the_source_says() {
    let text = "struct Inner { flags: u32, unused: u32 } struct Outer { inner: Inner, size: vec3f }
        @group(0) @binding(0) var<storage> given: array<Outer>;
        var<private> sum: f32;
        fn leaf(value: Inner) -> u32 { return value.flags & 12u; }
        @compute @workgroup_size(1) fn k() { let whole = given[1]; if (leaf(whole.inner) != 0u) { sum = abs(whole.size.x); } }";
    let module = naga::front::wgsl::parse_str(text).expect("it parses");
    let found: Vec<String> = parts(&module).into_iter().collect();
    assert_eq!(
        found,
        [
            "& 0xc",
            "Inner.flags",
            "Inner.flags & 0xc",
            "Outer.inner",
            "Outer.size",
            "given",
            "k",
            "k -> leaf",
            "k: Abs",
            "leaf",
            "sum",
        ]
    );
}

#[test]
fn a_program_has_one_shading_model() {
    let has = |features, name: &str| of_picture(features, names).contains(name);
    for (features, present, absent) in [
        (everything_but(&[]), "whitted", "pbr"),
        (everything_but(&[Feature::Whitted]), "pbr", "whitted"),
    ] {
        for part in ["shading", "direct"] {
            assert!(has(features, &format!("{present}_{part}")));
            assert!(!has(features, &format!("{absent}_{part}")));
        }
    }
}

/// What pictures are made by has all that is done against rounding, and no fixed tolerance.
#[test]
fn pictures_have_no_tolerance() {
    let scene = Scene::default();
    let settings = RenderSettings::new(8, 8, raytree::default_camera(&scene));
    let own = ProgramFeatures::of(&SceneFeatures::of(&scene), &settings);
    let names = of_picture(own, names);
    assert!(names.contains("intersect_triangle") && names.contains("point_at"));
    assert!(!names.contains("moeller_trumbore"));
    let book = RenderSettings {
        numerics: raytree::Numerics::book(1e-4),
        ..settings
    };
    let book = ProgramFeatures::of(&SceneFeatures::of(&scene), &book);
    let parts = [
        Feature::Watertight,
        Feature::PaddedBoxes,
        Feature::ErrorBounds,
    ];
    assert_eq!(
        parts.map(|part| (own.has(part), book.has(part))),
        [(true, false); 3]
    );
}

/// Also of the features that are no more than a branch something goes. (The shading models replace each other, and so do the
/// triangle tests and the projections.)
#[test]
fn every_feature_costs_code() {
    const REPLACE_OTHERS: [Feature; 3] =
        [Feature::Orthographic, Feature::Whitted, Feature::Watertight];
    let everything = everything_but(&[Feature::Whitted]);
    let size_of = |features| -> usize {
        let kernels = Kernel::PICTURE.iter();
        kernels
            .map(|&kernel| size(&program(kernel, features)))
            .sum()
    };
    let whole = size_of(everything);
    for &feature in Feature::ALL
        .iter()
        .filter(|feature| !REPLACE_OTHERS.contains(feature))
    {
        let without = size_of(everything.with(feature, false));
        assert!(without < whole, "{feature:?}: {without} of {whole}");
    }
}

/// A program binds what it needs and no more.
#[test]
fn the_least_programs_bind_the_least() {
    let nothing = ProgramFeatures::default();
    let traversal = ["frame", "nodes", "leaf_vertices", "leaf_triangles"];
    let probe = bindings(&program(Kernel::Probe, nothing));
    assert_eq!(
        probe,
        [traversal.as_slice(), &["probe_rays", "probe_hits"]].concat()
    );
    let aov = bindings(&program(Kernel::Aov, nothing));
    let surface = ["leaf_materials", "attributes", "materials"];
    let layers = [
        "leaf_materials",
        "leaf_nodes",
        "attributes",
        "materials",
        "aovs",
    ];
    assert_eq!(aov, [traversal.as_slice(), &layers].concat());
    let camera = bindings(&program(Kernel::CameraRays, nothing));
    assert_eq!(camera, ["frame", "list_out", "queue_out"]);
    let traced = bindings(&program(Kernel::TraceRays, nothing));
    let lists = ["list_in", "queue_in"];
    let others = ["state", "counters"];
    assert_eq!(traced, [traversal.as_slice(), &others, &lists].concat());
    let shaded = bindings(&program(Kernel::ShadeHits, nothing));
    let tables = ["frame", "leaf_vertices", "leaf_triangles"];
    let lists = ["state", "list_in", "queue_in", "list_out", "queue_out"];
    assert_eq!(shaded, [tables.as_slice(), &surface, &lists].concat());
}

/// Devices are asked for 10 storage buffers and 10 tables (`crates/gpu/device.rs`).
#[test]
fn the_largest_program_can_be_bound() {
    for kernel in kernels() {
        let module = program(kernel, ProgramFeatures::everything());
        let bound = |which: fn(naga::AddressSpace) -> bool| {
            let variables = module.global_variables.iter();
            variables
                .filter(|(_, variable)| which(variable.space))
                .count()
        };
        let buffers = bound(|space| matches!(space, naga::AddressSpace::Storage { .. }));
        assert!(buffers <= 10, "{kernel:?} binds {buffers} storage buffers");
        let tables = bound(|space| space == naga::AddressSpace::Handle);
        assert!(tables <= 10, "{kernel:?} binds {tables} tables");
    }
}

/// lavapipe inlines every call, so what is called twice is compiled twice.
#[test]
fn large_functions_are_there_once() {
    for features in [everything_but(&[]), everything_but(&[Feature::Whitted])] {
        for kernel in [Kernel::TraceRays, Kernel::Aov, Kernel::Secondary] {
            assert_eq!(
                copies(&program(kernel, features), "trace"),
                Some(1),
                "{kernel:?}"
            );
        }
        for kernel in [Kernel::ShadeHits, Kernel::Aov, Kernel::Secondary] {
            let module = program(kernel, features);
            for name in ["surface_at", "sample_texture"] {
                assert_eq!(copies(&module, name), Some(1), "{kernel:?} {name}");
            }
        }
        let shaded = program(Kernel::ShadeHits, features);
        assert_eq!(copies(&shaded, "trace"), None);
        for name in [
            "shade",
            "crossing_at",
            "begin_contact",
            "join_contact",
            "interface_at",
            "next_shadow_ray",
            "straight_on",
            "spawn",
            "store_item",
        ] {
            assert_eq!(copies(&shaded, name), Some(1), "{name}");
        }
    }
}

/// The count has to be able to fail: calls, and calls by callers that are there more than once.
#[test]
fn copies_are_counted_through_callers() {
    let text = "var<private> x: u32;
        fn leaf() { x += 1u; }
        fn middle() { loop { leaf(); if (x > 9u) { break; } else { leaf(); } } }
        @compute @workgroup_size(1) fn k() { middle(); middle(); switch x { case 1u: { leaf(); } default: {} } }";
    let module = naga::front::wgsl::parse_str(text).expect("it parses");
    assert_eq!(
        (call_sites(&module, "middle"), copies(&module, "middle")),
        (Some(2), Some(2))
    );
    assert_eq!(
        (call_sites(&module, "leaf"), copies(&module, "leaf")),
        (Some(3), Some(5))
    );
    assert_eq!(copies(&module, "nonsense"), None);
}

/// A scene's own program: what its materials and lights don't need is not there.
#[test]
fn scenes_get_the_program_that_they_need() {
    let of = |scene: &Scene, shading| {
        let mut settings = RenderSettings::new(8, 8, raytree::default_camera(scene));
        settings.shading = shading;
        of_picture(
            ProgramFeatures::of(&SceneFeatures::of(scene), &settings),
            names,
        )
    };
    let own = |name: &str| support::import(&support::root().join("assets").join(name));
    let unneeded = |found: &BTreeSet<String>, absent: &[&str]| {
        absent
            .iter()
            .filter(|name| found.contains(**name))
            .map(|name| (*name).to_owned())
            .collect::<Vec<_>>()
    };
    let none: [String; 0] = [];

    let empty = of(&Scene::default(), Shading::Pbr);
    let absent = ["lights", "media", "texels", "spawn", "tally"];
    assert_eq!(unneeded(&empty, &absent), none);
    let mirrors = of(&own("facing-mirrors.glb"), Shading::Pbr);
    assert!(mirrors.contains("spawn"));
    let absent = [
        "refracted_direction",
        "leave_medium",
        "straight_on",
        "media",
        "normal_from_map",
        "whitted_direct",
    ];
    assert_eq!(unneeded(&mirrors, &absent), none);
    let glass = of(&own("glass-in-water.glb"), Shading::Pbr);
    assert!(
        glass.contains("refracted_direction")
            && glass.contains("leave_medium")
            && glass.contains("media")
    );
    let cards = of(&own("cards.gltf"), Shading::Pbr);
    assert!(cards.contains("sample_texture") && cards.contains("texels"));
    assert!(of(&own("facing-mirrors.glb"), Shading::Whitted).contains("whitted_shading"));
}

/// The combinations of features that pictures of a scene can have: both shading models, with and without counters, from the default
/// camera and from each of the file's own.
fn reachable(scene: &Scene, found: &mut HashSet<ProgramFeatures>) {
    let scene_features = SceneFeatures::of(scene);
    let cameras = [raytree::default_camera(scene)];
    for camera in cameras.iter().chain(&scene.cameras) {
        for shading in [Shading::Pbr, Shading::Whitted] {
            for counters in [false, true] {
                for max_depth in [0, 8] {
                    let settings = RenderSettings {
                        shading,
                        counters,
                        max_depth,
                        ..RenderSettings::new(8, 8, camera.clone())
                    };
                    found.insert(ProgramFeatures::of(&scene_features, &settings));
                }
            }
        }
    }
}

/// As a file says it, without what can't show, and of that lit by the studio where it is dark.
fn reachable_of_file(path: &Path, found: &mut HashSet<ProgramFeatures>) -> Result<(), ImportError> {
    let mut scene = raytree::import_unsimplified(path)?;
    reachable(&scene, found);
    raytree::simplify(&mut scene);
    reachable(&scene, found);
    if raytree::light_if_dark(&mut scene) {
        reachable(&scene, found);
    }
    Ok(())
}

/// What is wrong with a program: it does not assemble or validate, or is not folded.
fn program_fault(assembled: Result<Module, ProgramError>) -> Option<String> {
    match assembled {
        Err(error) => Some(error.to_string()),
        Ok(module) if !module.overrides.is_empty() || constant_branches(&module) > 0 => {
            Some("it is not folded".to_owned())
        }
        Ok(_) => None,
    }
}

fn assert_all_assemble(found: &HashSet<ProgramFeatures>) {
    let mut faults = Vec::new();
    for &features in found {
        for kernel in Kernel::PICTURE.into_iter().chain([Kernel::Aov]) {
            let fault = program_fault(assemble(kernel, features, Limits::for_depth(32)));
            faults.extend(fault.map(|fault| format!("{kernel:?} {features:?}: {fault}")));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn every_combination_of_the_own_scenes_assembles() {
    let mut found = HashSet::new();
    for path in support::own_scenes() {
        reachable_of_file(&path, &mut found).unwrap_or_else(|error| panic!("{error}"));
    }
    // Two models, with counters and without, and at least two scenes that differ.
    assert!(found.len() > 8, "{} combinations", found.len());
    assert_all_assemble(&found);
}

/// Of scenes that nobody here wrote.
#[test]
fn every_combination_of_the_corpus_assembles() {
    let Some(folder) = support::shared("gltf") else {
        return;
    };
    let mut scenes = Vec::new();
    support::scenes_below(&folder, &mut scenes);
    assert!(scenes.len() > 100, "{} scenes", scenes.len());
    let (mut found, mut refused) = (HashSet::new(), Vec::new());
    for path in &scenes {
        if reachable_of_file(path, &mut found).is_err() {
            refused.push(path);
        }
    }
    // One requires what we do not support (tests/corpus.rs).
    assert!(refused.len() <= 1, "{refused:?}");
    assert!(found.len() > 40, "{} combinations", found.len());
    assert_all_assemble(&found);
}

/// The check has to be able to fail: of a module as it is before it is specialised, and of one that is no module.
#[test]
fn a_program_that_is_not_folded_is_a_fault() {
    let unfolded = source::parse(Limits::for_depth(32)).expect("the shaders parse");
    assert!(program_fault(Ok(unfolded)).is_some());
    let everything = ProgramFeatures::everything();
    let none = Limits { traversal_stack: 0 };
    assert!(program_fault(assemble(Kernel::TraceRays, everything, none)).is_some());
    let folded = program(Kernel::ShadeHits, everything);
    assert_eq!(program_fault(Ok(folded)), None);
}
