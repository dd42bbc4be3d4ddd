//! The shader files: joined in a fixed order (WGSL allows declarations in any), parsed, and errors led back to file and line.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use naga::Module;

/// A WGSL file as compiled into the program.
#[derive(Clone, Copy, Debug)]
pub struct SourceFile {
    /// Its path below `shaders/`.
    pub path: &'static str,
    /// Its text.
    pub text: &'static str,
}

macro_rules! source_files {
    ($($path:literal),* $(,)?) => {
        &[$(SourceFile {
            path: $path,
            text: include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shaders/", $path)),
        }),*]
    };
}

/// Every file under `shaders/`, each one job. `limits.wgsl` holds the defaults of what [`Limits`] replaces.
pub const SOURCE_FILES: &[SourceFile] = source_files![
    "features.wgsl",
    "types.wgsl",
    "bindings.wgsl",
    "tables.wgsl",
    "math.wgsl",
    "precise.wgsl",
    "counters.wgsl",
    "camera.wgsl",
    "intersect.wgsl",
    "instances.wgsl",
    "traversal_stack.wgsl",
    "traverse.wgsl",
    "texture.wgsl",
    "environment.wgsl",
    "surface.wgsl",
    "media.wgsl",
    "contact.wgsl",
    "fresnel.wgsl",
    "light.wgsl",
    "pbr.wgsl",
    "whitted.wgsl",
    "state.wgsl",
    "ray_stack.wgsl",
    "tolerance.wgsl",
    "ray_tree.wgsl",
    "work_lists.wgsl",
    "kernels/camera_rays.wgsl",
    "kernels/trace_rays.wgsl",
    "kernels/shade_hits.wgsl",
    "kernels/aov.wgsl",
    "kernels/probe.wgsl",
    "kernels/pieces.wgsl",
    "kernels/secondary.wgsl",
];

/// Array sizes that overrides can't set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Limits {
    /// Entries of the traversal stack.
    pub traversal_stack: u32,
}

impl Limits {
    /// Capacities for a tree of `depth` levels, rounded up to few sizes so that few programs differ by it.
    #[must_use]
    pub fn for_depth(depth: u32) -> Self {
        let traversal_stack = [16, 32, 64]
            .into_iter()
            .find(|&size| size >= depth)
            .unwrap_or(depth);
        Self { traversal_stack }
    }

    fn wgsl(self) -> String {
        format!("const TRAVERSAL_STACK: u32 = {}u;\n", self.traversal_stack)
    }
}

/// A shader that does not parse. Only a bug in `shaders/` can cause it.
#[derive(Debug, thiserror::Error)]
#[error("{file}:{line}: {message}")]
pub struct ShaderError {
    /// Path below `shaders/`.
    pub file: String,
    /// Line in it, from 1.
    pub line: u32,
    /// What naga says.
    pub message: String,
}

/// Parses all files as one module.
///
/// # Errors
/// [`ShaderError`] naming file and line.
pub fn parse(limits: Limits) -> Result<Module, ShaderError> {
    let mut text = limits.wgsl();
    let mut starts = vec![("limits.wgsl", 0)];
    for file in SOURCE_FILES {
        starts.push((file.path, text.len()));
        text.push_str(file.text);
    }
    naga::front::wgsl::parse_str(&text).map_err(|error| {
        let offset = error
            .location(&text)
            .map_or(0, |location| location.offset as usize);
        locate(&text, &starts, offset, error.message())
    })
}

/// As [`parse`], but each module once a process: a picture takes several kernels of it.
///
/// # Errors
/// As [`parse`].
pub(crate) fn parsed(limits: Limits) -> Result<Arc<Module>, ShaderError> {
    static PARSED: Mutex<BTreeMap<u32, Arc<Module>>> = Mutex::new(BTreeMap::new());
    let mut parsed = PARSED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(module) = parsed.get(&limits.traversal_stack) {
        return Ok(Arc::clone(module));
    }
    let module = Arc::new(parse(limits)?);
    parsed.insert(limits.traversal_stack, Arc::clone(&module));
    Ok(module)
}

fn locate(text: &str, starts: &[(&str, usize)], offset: usize, message: &str) -> ShaderError {
    let (file, start) = starts
        .iter()
        .rev()
        .find(|(_, start)| *start <= offset)
        .copied()
        .unwrap_or(("", 0));
    let line = 1 + text[start..offset].matches('\n').count() as u32;
    ShaderError {
        file: file.to_owned(),
        line,
        message: message.to_owned(),
    }
}
