//! What decides a scene's pictures and times, in words: measurements and references are kept by it.

use std::fs;
use std::path::Path;

use raytree::{DeviceInfo, RenderSettings, Scene};

use crate::args::LightingArgs;

/// Fowler, Noll and Vo's hash of 64 bits (FNV-1a): the same on every machine and of every toolchain.
#[derive(Clone, Copy, Debug)]
pub struct Hash(u64);

impl Default for Hash {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Hash {
    pub fn of(bytes: &[u8]) -> u64 {
        let mut hash = Self::default();
        hash.add(bytes);
        hash.value()
    }

    pub fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    pub fn value(self) -> u64 {
        self.0
    }
}

/// All that a sweep does not vary: the program, the device, every file that is read, camera, size and light.
pub fn subject(
    scene_file: &Path,
    scene: &Scene,
    base: &RenderSettings,
    lighting: &LightingArgs,
    device: &DeviceInfo,
) -> anyhow::Result<String> {
    let mut files = Hash::default();
    let read = [Some(scene_file), lighting.env.as_deref()];
    let beside = scene.files.iter().map(|path| path.as_path());
    for path in read.into_iter().flatten().chain(beside) {
        // What can't be read any more has been read by the importer: gone meanwhile, it is another scene the next time.
        let bytes = fs::read(path).unwrap_or_default();
        files.add(&(bytes.len() as u64).to_le_bytes());
        files.add(&bytes);
    }
    let region = base.visible_region();
    Ok(format!(
        "{}; {} ({}); files {:016x}; {}x{} of {region:?}; {:?}; {} rays a sample; ambient {:?}, environment {} {} {}, background {:?}, studio {} {}",
        program(),
        device.name,
        device.driver,
        files.value(),
        base.width,
        base.height,
        base.camera,
        base.max_rays,
        lighting.ambient,
        lighting.env.is_some(),
        lighting.env_rotation,
        lighting.env_strength,
        lighting.background,
        lighting.studio,
        lighting.no_studio,
    ))
}

/// The version, and the moment at which this program was built: no reference outlives a change of the renderer.
fn program() -> String {
    let built = std::env::current_exe().and_then(fs::metadata);
    let stamp = built.and_then(|data| Ok((data.len(), data.modified()?)));
    let stamp = stamp.map_or_else(
        |_| String::new(),
        |(length, time)| {
            let since = time
                .duration_since(std::time::UNIX_EPOCH)
                .unwrap_or_default();
            format!(" of {length} bytes, {}", since.as_nanos())
        },
    );
    format!("raytree {}{stamp}", env!("CARGO_PKG_VERSION"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From the authors' page: http://www.isthe.com/chongo/tech/comp/fnv/
    #[test]
    fn the_hash_is_fnv_1a() {
        assert_eq!(Hash::of(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(Hash::of(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(Hash::of(b"foobar"), 0x8594_4171_f739_67e8);
    }
}
