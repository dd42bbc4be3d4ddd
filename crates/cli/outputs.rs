//! Where pictures go: decided and tried before anything is rendered, so that no long render is lost to a mistyped folder.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::anyhow;
use raytree::{Background, Film, Format, WriteOptions};

use crate::args::{OutputArgs, RenderArgs};
use crate::cancel;
use crate::failure::Usage;

/// What a pixel takes to be written.
const PNG_NANOSECONDS: u64 = 60;
const EXR_NANOSECONDS: u64 = 600;

/// The files to write, all of whose names and folders are good.
#[derive(Debug)]
pub struct Outputs(Vec<PathBuf>);

impl Outputs {
    /// Those asked for, else the scene's name with .png in the current folder.
    pub fn plan(args: &RenderArgs) -> anyhow::Result<Self> {
        let mut paths = args.output.output.clone();
        if paths.is_empty() {
            paths.push(default_output(&args.scene)?);
        }
        let inputs = || {
            [Some(&args.scene), args.lighting.env.as_ref()]
                .into_iter()
                .flatten()
        };
        for (index, path) in paths.iter().enumerate() {
            Format::of_path(path)?;
            check_writable(path)?;
            if inputs().any(|input| is_same_file(input, path)) {
                let problem =
                    "is read by this render, and would be overwritten; choose another --output";
                return Err(Usage(format!("{}: {problem}", path.display())).into());
            }
            if paths[..index].contains(path) {
                return Err(Usage(format!("{}: named twice as --output", path.display())).into());
            }
        }
        Ok(Self(paths))
    }

    /// Refuses to overwrite a file that the scene was read from: a texture may well have the scene's own name.
    pub fn spare(&self, read: &[PathBuf]) -> Result<(), Usage> {
        let clash = self
            .0
            .iter()
            .find(|path| read.iter().any(|file| is_same_file(file, path)));
        clash.map_or(Ok(()), |path| {
            let problem = "is one of the scene's own files, and would be overwritten; choose another --output";
            Err(Usage(format!("{}: {problem}", path.display())))
        })
    }

    pub fn paths(&self) -> &[PathBuf] {
        &self.0
    }

    /// Does one of them hold layers beside the picture?
    pub fn want_layers(&self) -> bool {
        self.0
            .iter()
            .any(|path| matches!(Format::of_path(path), Ok(Format::Exr)))
    }

    /// What writing them is likely to take, so that a time budget has room for it: measured, of pictures that compress badly.
    pub fn time_to_write(&self, width: u32, height: u32) -> Duration {
        let nanoseconds = |path: &PathBuf| match Format::of_path(path) {
            Ok(Format::Exr) => EXR_NANOSECONDS,
            _ => PNG_NANOSECONDS,
        };
        let each: u64 = self.0.iter().map(nanoseconds).sum();
        Duration::from_nanos(each * u64::from(width) * u64::from(height))
    }

    /// Writes them all, each whole or not at all.
    pub fn write(&self, film: &Film, options: &WriteOptions) -> anyhow::Result<()> {
        for path in &self.0 {
            cancel::while_writing(|| Ok(film.write(path, options)?))?;
        }
        Ok(())
    }
}

/// How the film becomes a PNG.
pub fn write_options(args: &OutputArgs, background: Background) -> WriteOptions {
    WriteOptions {
        tone: args.tonemap.into(),
        exposure: args.exposure as f32,
        png_bits: args.png_bits.into(),
        alpha: background == Background::Transparent,
    }
}

fn default_output(scene: &Path) -> Result<PathBuf, Usage> {
    let name = scene.file_name().map(PathBuf::from);
    name.map(|name| name.with_extension("png"))
        .ok_or_else(|| Usage(format!("{}: not the name of a scene file", scene.display())))
}

/// Refuses what could not be written: a folder, a read-only file, into a folder that is missing or may not be written to.
pub fn check_writable(path: &Path) -> anyhow::Result<()> {
    try_writing(path).map_err(|problem| {
        let remedy = "check that its folder exists and may be written to";
        anyhow!("{}: can't be written: {problem}; {remedy}", path.display())
    })
}

fn try_writing(path: &Path) -> io::Result<()> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    match fs::metadata(&target) {
        Ok(there) if there.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        // A special file such as /dev/null is written into, whatever its folder.
        Ok(there) if !there.is_file() => return Ok(()),
        Ok(there) if there.permissions().readonly() => {
            return Err(io::Error::other("the file that is there is read-only"));
        }
        _ => {}
    }
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    // For the system's own reason where there is no such folder.
    fs::metadata(folder)?;
    // tempfile's own message would name a file that means nothing to the user.
    let probe = tempfile::Builder::new()
        .prefix(".raytree-")
        .tempfile_in(folder);
    probe.map(drop).map_err(|error| error.kind().into())
}

fn is_same_file(a: &Path, b: &Path) -> bool {
    matches!((fs::canonicalize(a), fs::canonicalize(b)), (Ok(a), Ok(b)) if a == b)
}
