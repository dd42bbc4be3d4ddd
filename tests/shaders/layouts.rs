//! Structs that host and shaders share: the compiler's layout of `crates/gpu/types.rs` against naga's of `shaders/types.wgsl`.

use std::{any::type_name, collections::BTreeSet, mem::offset_of};

use naga::{Module, ScalarKind, TypeInner, proc::Layouter};
use raytree_gpu::{source::SOURCE_FILES, types};

#[derive(Clone, Debug, PartialEq)]
struct Layout {
    name: String,
    size: usize,
    fields: Vec<Field>,
}

#[derive(Clone, Debug, PartialEq)]
struct Field {
    name: String,
    offset: usize,
    size: usize,
    /// "u32" or "f32"; empty for structs.
    scalar: &'static str,
}

fn field<S, T>(name: &str, offset: usize, _: fn(&S) -> &T) -> Field {
    let scalar = ["u32", "f32"]
        .into_iter()
        .find(|scalar| type_name::<T>().contains(scalar))
        .unwrap_or_default();
    Field {
        name: name.to_owned(),
        offset,
        size: size_of::<T>(),
        scalar,
    }
}

/// Layouts of the host's structs. The pattern without `..` does not compile if a field is left out.
macro_rules! layouts {
    ($($name:ident { $($field:ident)* })*) => {
        vec![$({
            let _ = |types::$name { $($field: _),* }: types::$name| ();
            Layout {
                name: stringify!($name).to_owned(),
                size: size_of::<types::$name>(),
                fields: vec![$(field(stringify!($field), offset_of!(types::$name, $field), |s: &types::$name| &s.$field)),*],
            }
        }),*]
    };
}

fn on_host() -> Vec<Layout> {
    layouts! {
        EnvironmentLevel { offset width height unused }
        Frame {
            ray_start sample camera_right max_depth camera_up light_count camera_forward min_weight
            start_right start_t start_up start_depth ambient
            unused background background_kind branch_bound order_count
            picture_size sample_offset window_origin window_size tile_columns first_tile
            tile_count tile_stride slot_count stack_capacity step_budget vertex_words uv_word color_word
            tangent_word rotation_cos rotation_sin max_rays camera_media zero tolerance item_words texture_kinds negligible beside_stack_words unused_0 unused_1 branch_mean light_share
            environment
        }
        LeafTriangle { vertices entry }
        TextureUse { row_u offset row_v uv_set width height flags unused }
        Material {
            base_color emissive alpha_cutoff specular_color specular metallic roughness transmission ior normal_scale
            occlusion_strength flags medium whitted_ks whitted_n whitted_kt whitted_ka whitted_kd unused_0 unused_1
            unused_2
        }
        Light {
            position kind direction inverse_range intensity spot_scale spot_cos_outer nearest unused_0 unused_1
        }
        Medium { absorption ior priority unused_0 unused_1 unused_2 }
        Slot { radiance rays common_rays dropped_storage dropped_budget }
        WorkList { workgroups parts workgroups_z zero lengths }
        PartLength { entries padding }
        ProbeRay { origin t_max direction shadow }
        ProbeHit { t u v triangle }
        SecondaryRay { origin leaving direction unused_0 next unused_1 }
        SecondaryHit { position triangle origin t direction next_triangle ng back ns unused }
        Aov { position depth geometric_normal material shading_normal node albedo unused }
    }
}

/// The shaders' struct of this name.
fn on_device(module: &Module, name: &str) -> Option<Layout> {
    let mut layouter = Layouter::default();
    layouter
        .update(module.to_ctx())
        .expect("a module that parses has a layout");
    let (handle, found) = module
        .types
        .iter()
        .find(|(_, found)| found.name.as_deref() == Some(name))?;
    let TypeInner::Struct { members, .. } = &found.inner else {
        return None;
    };
    let fields = members.iter().map(|member| Field {
        name: member.name.clone().unwrap_or_default(),
        offset: member.offset as usize,
        size: layouter[member.ty].size as usize,
        scalar: scalar_of(module, &module.types[member.ty].inner),
    });
    Some(Layout {
        name: name.to_owned(),
        size: layouter[handle].size as usize,
        fields: fields.collect(),
    })
}

fn scalar_of(module: &Module, inner: &TypeInner) -> &'static str {
    match inner {
        TypeInner::Scalar(scalar) | TypeInner::Vector { scalar, .. } => match scalar.kind {
            ScalarKind::Uint => "u32",
            ScalarKind::Float => "f32",
            other => panic!("{other:?} is not shared with the host"),
        },
        TypeInner::Atomic(_) => "u32",
        TypeInner::Array { base, .. } => scalar_of(module, &module.types[*base].inner),
        _ => "",
    }
}

/// How two layouts differ. The host spells out the padding that WGSL implies.
fn difference(host: &Layout, device: &Layout) -> Option<String> {
    let mut host = host.clone();
    host.fields.retain(|field| field.name != "padding");
    (host != *device).then(|| format!("host {host:#?}\nshaders {device:#?}"))
}

fn parsed() -> Module {
    raytree_gpu::source::parse(raytree_gpu::source::Limits::for_depth(32))
        .unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn shared_structs_lie_alike() {
    let module = parsed();
    for host in on_host() {
        let device = on_device(&module, &host.name)
            .unwrap_or_else(|| panic!("shaders/ has no struct {}", host.name));
        assert_eq!(difference(&host, &device), None);
    }
}

/// A struct that is in no list is not compared.
#[test]
fn every_shared_struct_is_compared() {
    let compared: BTreeSet<String> = on_host().into_iter().map(|layout| layout.name).collect();
    let types = SOURCE_FILES
        .iter()
        .find(|file| file.path == "types.wgsl")
        .expect("types.wgsl is a source file");
    let declared = types
        .text
        .lines()
        .filter_map(|line| line.strip_prefix("struct ")?.split_whitespace().next());
    assert_eq!(
        declared.map(str::to_owned).collect::<BTreeSet<_>>(),
        compared
    );
}

/// The comparison has to be able to fail: a field moved, resized, renamed, of another kind, or missing.
#[test]
fn a_different_layout_is_noticed() {
    let module = parsed();
    let host = on_host()
        .into_iter()
        .find(|layout| layout.name == "Light")
        .expect("there is a Light");
    let device = on_device(&module, "Light").expect("there is a Light");
    let changes: [fn(&mut Layout); 6] = [
        |layout| layout.fields[2].offset += 4,
        |layout| layout.fields[2].size += 4,
        |layout| layout.fields[2].name.push('x'),
        |layout| layout.fields[2].scalar = "u32",
        |layout| drop(layout.fields.pop()),
        |layout| layout.size += 16,
    ];
    for change in changes {
        let mut changed = host.clone();
        change(&mut changed);
        assert!(difference(&changed, &device).is_some());
    }
}
