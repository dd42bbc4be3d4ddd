//! The GLB container (glTF 2.0, chapter 4): JSON and one binary chunk in a file. A `.gltf` file is the JSON alone.
//! Told apart by content, not by the file's name.

use super::error::{Fault, Outcome, Warnings};

const MAGIC: &[u8] = b"glTF";
const HEADER_LENGTH: usize = 12;
const CHUNK_JSON: u32 = 0x4E4F_534A;
const CHUNK_BIN: u32 = 0x004E_4942;
const PLACE: &str = "GLB container";

/// The parts of a scene file.
pub(super) struct Container<'a> {
    pub(super) json: &'a [u8],
    /// The content of the first buffer, if that names no file.
    pub(super) binary: Option<&'a [u8]>,
}

pub(super) fn split<'a>(file: &'a [u8], warnings: &mut Warnings) -> Outcome<Container<'a>> {
    if file.starts_with(MAGIC) {
        split_glb(file, warnings)
    } else {
        Ok(Container {
            json: file,
            binary: None,
        })
    }
}

fn split_glb<'a>(file: &'a [u8], warnings: &mut Warnings) -> Outcome<Container<'a>> {
    let mut header = file.get(4..).unwrap_or_default();
    let (Some(version), Some(length)) = (take_u32(&mut header), take_u32(&mut header)) else {
        return Err(Fault::invalid(PLACE, "cut short in its header"));
    };
    if version != 2 {
        return Err(Fault::unsupported(
            PLACE,
            format!("version {version}, only 2 is read; export it as glTF 2.0"),
        ));
    }
    let length = length as usize;
    if length > file.len() {
        let problem = format!("cut short: {} bytes there, {length} announced", file.len());
        return Err(Fault::invalid(PLACE, problem));
    }
    let Some(mut rest) = file.get(HEADER_LENGTH..length) else {
        return Err(Fault::invalid(
            PLACE,
            format!("announces a length of {length} bytes, less than its own header"),
        ));
    };
    if length < file.len() {
        warnings.push(
            PLACE,
            format!(
                "{} bytes after its announced end are ignored",
                file.len() - length
            ),
        );
    }

    let json = match take_chunk(&mut rest)? {
        Some((CHUNK_JSON, json)) => json,
        _ => return Err(Fault::invalid(PLACE, "its first chunk is not JSON")),
    };
    // Only the second chunk may be BIN; others belong to extensions and are to be skipped.
    let binary = match take_chunk(&mut rest)? {
        Some((CHUNK_BIN, binary)) => Some(binary),
        _ => None,
    };
    while take_chunk(&mut rest)?.is_some() {}
    Ok(Container { json, binary })
}

fn take_chunk<'a>(rest: &mut &'a [u8]) -> Outcome<Option<(u32, &'a [u8])>> {
    if rest.is_empty() {
        return Ok(None);
    }
    let (Some(length), Some(kind)) = (take_u32(rest), take_u32(rest)) else {
        return Err(Fault::invalid(PLACE, "cut short in a chunk's header"));
    };
    match rest.split_at_checked(length as usize) {
        Some((chunk, after)) => {
            *rest = after;
            Ok(Some((kind, chunk)))
        }
        None => Err(Fault::invalid(
            PLACE,
            format!("a chunk of {length} bytes has only {}", rest.len()),
        )),
    }
}

fn take_u32(bytes: &mut &[u8]) -> Option<u32> {
    let (head, rest) = bytes.split_first_chunk()?;
    *bytes = rest;
    Some(u32::from_le_bytes(*head))
}
