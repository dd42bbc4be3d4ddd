//! By what each feature is known in a program. The one place to edit when the shaders change: names are those of
//! `shaders/*.wgsl`, forms are those of [`super::module::parts`].

use raytree::Feature;

/// What a feature brings to the program of a scene that needs it.
pub struct Marks {
    pub feature: Feature,
    /// A program with it has all of these, one without it none.
    pub present: &'static [&'static str],
    /// .. and the other way round: what is there in its place.
    pub instead: &'static [&'static str],
}

const fn marks(feature: Feature, present: &'static [&'static str]) -> Marks {
    Marks {
        feature,
        present,
        instead: &[],
    }
}

/// For each feature, in the order of [`Feature::ALL`]. Programs are those of [`super::cases::pair`].
pub const MARKS: &[Marks] = &[
    // A camera with parallel rays computes less.
    Marks {
        feature: Feature::Orthographic,
        present: &[],
        instead: &[
            "camera_ray: Normalize",
            "Frame.camera_right",
            "Frame.camera_up",
        ],
    },
    // LEAF_CULLED.
    marks(Feature::Culling, &["& 0x80000000"]),
    // MATERIAL_MASK.
    marks(
        Feature::Mask,
        &["cut_out", "Material.alpha_cutoff", "Surface.flags & 0x1"],
    ),
    // MATERIAL_BLEND.
    marks(Feature::Blend, &["Surface.flags & 0x2"]),
    // MATERIAL_UNLIT.
    marks(Feature::Unlit, &["Surface.flags & 0x4"]),
    marks(
        Feature::Textures,
        &[
            "sample_material",
            "sample_texture",
            "texel",
            "texels",
            "texture_place",
            "uv_at",
            "Frame.uv_word",
            "Frame.texture_kinds",
            "texture_uses",
            "decoded_srgb",
            "TextureUse.offset",
            "TextureUse.row_u",
            "TextureUse.uv_set",
        ],
    ),
    marks(
        Feature::NormalMaps,
        &[
            "normal_from_map",
            "Frame.tangent_word",
            "Material.normal_scale",
        ],
    ),
    marks(
        Feature::VertexColors,
        &["interpolated_attribute", "Frame.color_word"],
    ),
    marks(
        Feature::Branches,
        &[
            "spawn",
            "Branch.weight",
            "Frame.max_depth",
            "Frame.min_weight",
        ],
    ),
    marks(Feature::Reflection, &["pbr_shading -> metal_reflectance"]),
    marks(
        Feature::Transmission,
        &["Crossing.full", "Gathered.transmitted"],
    ),
    marks(
        Feature::Solids,
        &[
            "media",
            "refracted_direction",
            "refracted",
            "precise_angle",
            "cross_face",
            "enter_medium",
            "leave_medium",
            "medium_ior",
            "Frame.camera_media",
            "Material.medium",
            "Medium.ior",
        ],
    ),
    marks(
        Feature::Absorption,
        &["medium_transmittance", "Medium.absorption"],
    ),
    marks(Feature::Priorities, &["insert_medium", "Medium.priority"]),
    marks(
        Feature::Contact,
        &[
            "contact",
            "begin_contact",
            "join_contact",
            "cross_contact",
            "Contact.reach",
        ],
    ),
    marks(Feature::StraightOn, &["straight_on", "Crossing.hidden"]),
    marks(Feature::TransparentShadows, &["shadow_share", "pbr_shadow"]),
    marks(
        Feature::Lights,
        &[
            "lights",
            "next_shadow_ray",
            "sample_light",
            "pbr_direct",
            "ggx_lobe",
            "Frame.light_count",
            "Light.intensity",
        ],
    ),
    // What is left of the lights is kept for later.
    marks(Feature::ManyLights, &["item_below"]),
    marks(
        Feature::Environment,
        &[
            "environment",
            "environment_level",
            "environment_uv",
            "arc_tangent",
            "Frame.environment",
            "Frame.rotation_cos",
            "EnvironmentLevel.offset",
        ],
    ),
    Marks {
        feature: Feature::Whitted,
        present: &[
            "whitted_shading",
            "whitted_coefficients",
            "Material.whitted_ka",
            "Material.whitted_kd",
            "Material.whitted_ks",
            "Material.whitted_n",
            "Material.whitted_kt",
        ],
        instead: &["pbr_shading", "environment_brdf", "mirror_share"],
    },
    marks(
        Feature::Instances,
        &[
            "instances",
            "load_placement",
            "placed",
            "ray_within",
            "placement",
            "met",
            "within",
            "box_pad",
        ],
    ),
    // What lies below the variables of a traversal's stack is in storage then.
    Marks {
        feature: Feature::LongRays,
        present: &[
            "pair_word",
            "suspend",
            "resume",
            "suspended",
            "left_traversal",
            "Frame.step_budget",
            "traversal_slot",
        ],
        instead: &["below"],
    },
    // Where a sample lies its order says.
    Marks {
        feature: Feature::Tolerance,
        present: &[
            "has_orders",
            "order_of",
            "take_counts",
            "packed_counts",
            "lost",
            "negligible",
            "Frame.order_count",
            "Frame.negligible",
        ],
        instead: &["Frame.sample", "Frame.sample_offset"],
    },
    marks(Feature::Counters, &["tally"]),
    Marks {
        feature: Feature::Watertight,
        present: &["view_along", "intersect_triangle"],
        instead: &["moeller_trumbore"],
    },
    // Its bound is of absolute values.
    marks(Feature::PaddedBoxes, &["intersect_node: Abs"]),
    Marks {
        feature: Feature::ErrorBounds,
        present: &[
            "point_at",
            "edges_at",
            "place_along_ray",
            "Surface.position_error",
            "Surface.edge_error",
        ],
        instead: &["Frame.tolerance"],
    },
];

/// What several features share: a program without any of them has none of these functions and global variables, one with
/// everything has all.
pub const SHARED: &[(&[Feature], &[&str])] = &[
    (
        &[Feature::Textures, Feature::Environment],
        &["tap_weight", "wrap_texel"],
    ),
    (
        &[Feature::NormalMaps, Feature::VertexColors],
        &["interpolated_attribute"],
    ),
    (
        &[Feature::Solids, Feature::Absorption, Feature::Contact],
        &["media", "innermost_medium"],
    ),
    (&[Feature::Priorities, Feature::Contact], &["insert_medium"]),
    (
        &[Feature::Tolerance],
        &["leave_out", "most_brought", "show_mean", "heaviest_first"],
    ),
    (
        &[Feature::Lights, Feature::TransparentShadows],
        &[
            "next_shadow_ray",
            "sample_light",
            "whitted_direct",
            "lights",
        ],
    ),
    (
        &[
            Feature::Branches,
            Feature::StraightOn,
            Feature::Lights,
            Feature::TransparentShadows,
        ],
        &["spawn_origin"],
    ),
];
