//! The file's glTF version and its extensions (glTF 2.0, 3.2 and 3.12): what we read, what we leave out, what we refuse.

use std::collections::BTreeSet;

use serde_json::Value;

use super::document::Document;
use super::error::{Fault, Outcome, Warnings};

/// What the importer implements.
const SUPPORTED: &[&str] = &[
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Data about the file, without any influence on the picture.
const METADATA: &[&str] = &["KHR_xmp", "KHR_xmp_json_ld"];

/// What a picture lacks without the extension, and how to do without it.
fn consequence(extension: &str) -> (&'static str, &'static str) {
    match extension {
        "KHR_draco_mesh_compression" | "EXT_meshopt_compression" | "KHR_meshopt_compression" => (
            "compressed meshes are not read",
            "export without mesh compression",
        ),
        "KHR_texture_basisu" | "EXT_texture_webp" | "EXT_texture_avif" | "MSFT_texture_dds" => (
            "textures in this format are not read",
            "export textures as PNG or JPEG",
        ),
        "EXT_mesh_gpu_instancing" => (
            "only one of the instances is drawn",
            "export each instance as a node",
        ),
        "KHR_materials_variants" => ("the default variant is drawn", "export the wanted variant"),
        "KHR_materials_pbrSpecularGlossiness" => (
            "the metallic-roughness values are used instead",
            "export metallic-roughness materials",
        ),
        "KHR_materials_clearcoat" => ("coats are left out", "export without clear coats"),
        "KHR_materials_sheen" => ("sheen is left out", "export without sheen"),
        "KHR_materials_iridescence" => ("thin films are left out", "export without iridescence"),
        "KHR_materials_dispersion" => (
            "all colours are refracted alike",
            "export without dispersion",
        ),
        "KHR_materials_anisotropy" => ("highlights are round", "export without anisotropy"),
        _ => ("it is left out", "export without it"),
    }
}

/// Refuses files of another version and files that require what we do not have; warns of what we leave out.
pub(super) fn check(document: &Document, warnings: &mut Warnings) -> Outcome<()> {
    check_version(document)?;
    let required = names(document, "extensionsRequired")?;
    if let Some(extension) = required
        .iter()
        .find(|name| !SUPPORTED.contains(name) && !METADATA.contains(name))
    {
        let (lacking, remedy) = consequence(extension);
        let problem =
            format!("the file requires it, but it is not supported ({lacking}); {remedy}");
        return Err(Fault::unsupported(
            format!("extension {extension}"),
            problem,
        ));
    }
    let mut told = BTreeSet::new();
    for extension in names(document, "extensionsUsed")? {
        let known = SUPPORTED.contains(&extension) || METADATA.contains(&extension);
        if !known && told.insert(extension) {
            warnings.push(
                format!("extension {extension}"),
                format!("not supported: {}", consequence(extension).0),
            );
        }
    }
    Ok(())
}

/// Whether the file declares that it uses `extension`.
pub(super) fn is_used(document: &Document, extension: &str) -> bool {
    ["extensionsUsed", "extensionsRequired"]
        .iter()
        .any(|list| names(document, list).is_ok_and(|names| names.contains(&extension)))
}

fn names<'a>(document: &'a Document, list: &str) -> Outcome<Vec<&'a str>> {
    let Some(json) = document.json().get(list) else {
        return Ok(Vec::new());
    };
    json.as_array()
        .and_then(|names| names.iter().map(Value::as_str).collect())
        .ok_or_else(|| Fault::invalid(list, "not a list of names"))
}

fn check_version(document: &Document) -> Outcome<()> {
    let version = |field: &str| match document.json().pointer(&format!("/asset/{field}")) {
        None => Ok(None),
        Some(json) => json
            .as_str()
            .and_then(parse_version)
            .map(Some)
            .ok_or_else(|| {
                Fault::invalid(format!("asset.{field}"), "not a version such as \"2.0\"")
            }),
    };
    let refuse = |field: &str, (major, minor): (u32, u32)| {
        let problem =
            format!("glTF {major}.{minor} is not supported, only 2.0; export the file as glTF 2.0");
        Err(Fault::unsupported(format!("asset.{field}"), problem))
    };
    match (version("version")?, version("minVersion")?) {
        (None, _) => Err(Fault::invalid("asset.version", "missing")),
        (_, Some(minimum)) if minimum > (2, 0) => refuse("minVersion", minimum),
        (Some(version), _) if version.0 != 2 => refuse("version", version),
        _ => Ok(()),
    }
}

fn parse_version(text: &str) -> Option<(u32, u32)> {
    let (major, minor) = text.split_once('.')?;
    Some((major.parse().ok()?, minor.parse().ok()?))
}
