//! References that were made before, in the user's cache folder: a picture and what is known of it. Nothing here is needed: what
//! can't be read is made again, what can't be written is not kept.

use std::fs;
use std::path::{Path, PathBuf};

use raytree::{Film, Picture, WriteOptions};
use raytree_converge::Reference;
use serde::{Deserialize, Serialize};

use crate::converge::key::Hash;
use crate::shader_cache::own_cache_folder;

/// What lies beside a picture; written last, so that a picture with it is whole.
#[derive(Serialize, Deserialize)]
struct Entry {
    /// In full: names are hashes.
    key: String,
    /// Of the picture's file.
    picture: u64,
    reference: Reference,
}

/// A reference that was kept; an error says what is wrong with it.
pub fn load(key: &str) -> Result<Option<(Reference, Picture)>, String> {
    let Some((picture_file, entry_file)) = files(key) else {
        return Ok(None);
    };
    let Ok(text) = fs::read(&entry_file) else {
        return Ok(None);
    };
    let damaged = |problem: &str| format!("{}: {problem}", entry_file.display());
    let entry: Entry = serde_json::from_slice(&text).map_err(|_| damaged("is damaged"))?;
    // Another's hash happens to be the same.
    if entry.key != key {
        return Ok(None);
    }
    let bytes = fs::read(&picture_file).map_err(|_| damaged("has lost its picture"))?;
    if Hash::of(&bytes) != entry.picture {
        return Err(damaged("has another picture"));
    }
    let picture = Picture::read(&picture_file).map_err(|error| error.to_string())?;
    Ok(Some((entry.reference, picture)))
}

/// Keeps a reference; an error says why it is not kept.
pub fn store(key: &str, reference: &Reference, picture: &Picture) -> Result<(), String> {
    let Some((picture_file, entry_file)) = files(key) else {
        return Ok(());
    };
    let failed =
        |path: &Path, error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    if let Some(folder) = entry_file.parent() {
        fs::create_dir_all(folder).map_err(|error| failed(folder, &error))?;
    }
    let film = film_of(picture);
    film.write(&picture_file, &WriteOptions::default())
        .map_err(|error| error.to_string())?;
    let bytes = fs::read(&picture_file).map_err(|error| failed(&picture_file, &error))?;
    let entry = Entry {
        key: key.to_owned(),
        picture: Hash::of(&bytes),
        reference: reference.clone(),
    };
    let text = serde_json::to_vec(&entry).map_err(|error| failed(&entry_file, &error))?;
    raytree::write_whole(&entry_file, |file| file.write_all(&text))
        .map_err(|error| failed(&entry_file, &error))
}

/// Where there is no cache folder, nothing is kept.
fn files(key: &str) -> Option<(PathBuf, PathBuf)> {
    let folder = own_cache_folder()?.join("references");
    let name = format!("{:016x}", Hash::of(key.as_bytes()));
    Some((
        folder.join(format!("{name}.exr")),
        folder.join(format!("{name}.json")),
    ))
}

fn film_of(picture: &Picture) -> Film {
    let mut film = Film::new(picture.width, picture.height);
    film.radiance.clone_from(&picture.rgb);
    match &picture.alpha {
        Some(alpha) => film.alpha.clone_from(alpha),
        None => film.alpha.fill(1.0),
    }
    film
}
