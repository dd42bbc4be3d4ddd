//! The scene's data as textures: `shaders/tables.wgsl` says why, and reads them.

use bytemuck::cast_slice;
use wgpu::{
    Extent3d, Origin3d, TexelCopyBufferLayout, TexelCopyTextureInfo, Texture, TextureAspect,
    TextureDescriptor, TextureDimension, TextureFormat, TextureUsages,
};

use crate::{device::Device, error::RenderError};

/// Texels of a row; of the same name in `shaders/tables.wgsl`. Every device has textures of that width.
pub const TABLE_WIDTH: u32 = 8192;

/// What is copied at once: the driver keeps a copy of it until it is there.
const COPIED_AT_ONCE: u64 = 16 << 20;

/// A list of entries of one or more texels each, as it is uploaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Table<'a> {
    /// Its texels, one after the other.
    pub bytes: &'a [u8],
    /// 32-bit words of a texel: 1 or 4.
    pub texel_words: u32,
}

impl<'a> Table<'a> {
    /// Texels of four words each.
    pub(crate) fn wide(words: &'a [u32]) -> Self {
        Self {
            bytes: cast_slice(words),
            texel_words: 4,
        }
    }

    /// Texels of one word each.
    pub(crate) fn narrow(words: &'a [u32]) -> Self {
        Self {
            bytes: cast_slice(words),
            texel_words: 1,
        }
    }

    fn texel_bytes(self) -> u64 {
        4 * u64::from(self.texel_words)
    }

    fn row_bytes(self) -> u64 {
        self.texel_bytes() * u64::from(TABLE_WIDTH)
    }

    /// Width and height, in texels, of the texture that holds it. An empty one still has a texel.
    fn size(self) -> (u32, u64) {
        let texels = (self.bytes.len() as u64)
            .div_ceil(self.texel_bytes())
            .max(1);
        let width = texels.min(u64::from(TABLE_WIDTH)) as u32;
        (width, texels.div_ceil(u64::from(TABLE_WIDTH)))
    }

    /// What it takes on the device, the last row's end included.
    #[must_use]
    pub fn device_bytes(self) -> u64 {
        let (width, height) = self.size();
        u64::from(width) * height * self.texel_bytes()
    }

    /// Uploads it.
    ///
    /// # Errors
    /// [`RenderError::TooLarge`] if the device has no texture as high.
    pub(crate) fn upload(self, device: &Device, name: &str) -> Result<Texture, RenderError> {
        let texture = self.reserve(device, name)?;
        let whole_rows = self.bytes.len() as u64 / self.row_bytes() * self.row_bytes();
        let (rows, rest) = self.bytes.split_at(whole_rows as usize);
        let rows_at_once = COPIED_AT_ONCE / self.row_bytes();
        let mut y = 0;
        for part in rows.chunks((rows_at_once * self.row_bytes()) as usize) {
            let height = (part.len() as u64 / self.row_bytes()) as u32;
            self.copy(device, &texture, part, y, (TABLE_WIDTH, height));
            // Hands it to the device, so that copies don't pile up.
            device.queue.submit([]);
            y += height;
        }
        if !rest.is_empty() {
            let width = (rest.len() as u64 / self.texel_bytes()) as u32;
            self.copy(device, &texture, rest, y, (width, 1));
        }
        Ok(texture)
    }

    fn reserve(self, device: &Device, name: &str) -> Result<Texture, RenderError> {
        let (width, height) = self.size();
        let highest = u64::from(device.highest_texture());
        if height > highest {
            return Err(RenderError::TooLarge {
                buffer: name.to_owned(),
                bytes: self.device_bytes(),
                limit: highest * self.row_bytes(),
            });
        }
        Ok(device.device.create_texture(&TextureDescriptor {
            label: Some(name),
            size: Extent3d {
                width,
                height: height as u32,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: if self.texel_words == 1 {
                TextureFormat::R32Uint
            } else {
                TextureFormat::Rgba32Uint
            },
            usage: TextureUsages::STORAGE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        }))
    }

    fn copy(self, device: &Device, texture: &Texture, bytes: &[u8], y: u32, size: (u32, u32)) {
        let target = TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: Origin3d { x: 0, y, z: 0 },
            aspect: TextureAspect::All,
        };
        let layout = TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(size.0 * self.texel_bytes() as u32),
            rows_per_image: None,
        };
        let extent = Extent3d {
            width: size.0,
            height: size.1,
            depth_or_array_layers: 1,
        };
        device.queue.write_texture(target, bytes, layout, extent);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_room_for_all_its_entries() {
        let row = TABLE_WIDTH as usize;
        for (texels, size) in [
            (0, (1, 1)),
            (1, (1, 1)),
            (row, (TABLE_WIDTH, 1)),
            (row + 1, (TABLE_WIDTH, 2)),
            (3 * row, (TABLE_WIDTH, 3)),
        ] {
            let words = vec![0; 4 * texels];
            assert_eq!(Table::wide(&words).size(), size);
            assert_eq!(Table::narrow(&words[..texels]).size(), size);
        }
    }
}
