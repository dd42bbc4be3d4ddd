//! URIs (glTF 2.0, 2.8): data inside the URI, or a file beside the scene.

use std::borrow::Cow;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::DecodePaddingMode;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

use super::document::Document;
use super::error::{Fault, Outcome};

/// Standard alphabet; exporters disagree about the padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The bytes that `uri` stands for; `place` is what names it, `folder` where the scene file lies.
pub(super) fn read(uri: &str, place: &str, folder: &Path) -> Outcome<Vec<u8>> {
    if let Some(data) = data(uri) {
        return decode_data(data)
            .map_err(|problem| Fault::invalid(place, format!("its data URI {problem}")));
    }
    let path =
        folder.join(relative_path(uri).map_err(|problem| Fault::unsupported(place, problem))?);
    read_regular_file(&path)
        .map_err(|error| Fault::io(format!("{place}, file {}", path.display()), error))
}

/// The files that the document's buffers and images name.
pub(super) fn files_beside(document: &Document, folder: &Path) -> Vec<PathBuf> {
    let elements = ["buffers", "images"]
        .into_iter()
        .flat_map(|array| document.elements(array));
    let uris = elements.filter_map(|element| element.get("uri")?.as_str());
    uris.filter(|uri| data(uri).is_none())
        .filter_map(|uri| relative_path(uri).ok())
        .map(|path| folder.join(path))
        .collect()
}

/// What follows the scheme of a URI that carries its data.
pub(super) fn data(uri: &str) -> Option<&str> {
    const SCHEME: &str = "data:";
    let (head, rest) = uri.split_at_checked(SCHEME.len())?;
    head.eq_ignore_ascii_case(SCHEME).then_some(rest)
}

/// RFC 2397: `[media type][;base64],data`.
fn decode_data(data: &str) -> Result<Vec<u8>, String> {
    let (media, content) = data.split_once(',').ok_or("has no comma before its data")?;
    if media.to_ascii_lowercase().ends_with(";base64") {
        BASE64
            .decode(content)
            .map_err(|error| format!("is not base64: {error}"))
    } else {
        Ok(percent_decode_str(content).collect())
    }
}

fn relative_path(uri: &str) -> Result<PathBuf, String> {
    const REMEDY: &str = "put the file beside the scene and name it by a relative path";
    let before_slash = uri.split('/').next().unwrap_or_default();
    if before_slash.contains(':') {
        return Err(format!(
            "'{}' is not a file beside the scene; {REMEDY}",
            shortened(uri)
        ));
    }
    let decoded: Cow<'_, [u8]> = percent_decode_str(uri).into();
    let text =
        String::from_utf8(decoded.into_owned()).map_err(|_| "its URI is not UTF-8".to_owned())?;
    let path = PathBuf::from(text);
    if path.as_os_str().is_empty() || path.has_root() {
        return Err(format!(
            "'{}' is not a relative path; {REMEDY}",
            shortened(uri)
        ));
    }
    Ok(path)
}

/// A scene must not make us wait on a pipe or read a device without end.
fn read_regular_file(path: &Path) -> io::Result<Vec<u8>> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "not a regular file",
        ));
    }
    fs::read(path)
}

fn shortened(uri: &str) -> String {
    uri.chars().take(80).collect()
}
