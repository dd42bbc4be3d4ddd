//! The scene's data as textures: `shaders/tables.wgsl` says why, and reads them.

use std::{borrow::Cow, fmt, ops::Range};

use bytemuck::cast_slice;
use rayon::prelude::*;
use wgpu::{
    Extent3d, Origin3d, TexelCopyBufferLayout, TexelCopyTextureInfo, Texture, TextureAspect,
    TextureDescriptor, TextureDimension, TextureFormat, TextureUsages,
};

use crate::{device::Device, error::RenderError};

/// Texels of a row; of the same name in `shaders/tables.wgsl`. Every device has textures of that width.
pub const TABLE_WIDTH: u32 = 8192;

/// What is copied at once: the driver keeps a copy of it until it is there.
const COPIED_AT_ONCE: u64 = 4 << 20;

/// Entries that a thread makes at least: below, handing them over takes longer than making them.
const MADE_AT_ONCE: usize = 1 << 12;

/// A list of entries of one or more texels each, as it is uploaded. Large ones are made part by part while they are copied, so that
/// the host never has all of one.
pub struct Table<'a> {
    words: Words<'a>,
    /// 32-bit words of an entry.
    entry_words: usize,
    /// 32-bit words of a texel: 1 or 4.
    texel_words: u32,
}

/// What is in a table.
enum Words<'a> {
    /// All of it.
    There(&'a [u32]),
    /// So many entries, made when they are asked for.
    Made(usize, Make<'a>),
}

/// Makes the entries from a number on.
type Make<'a> = Box<dyn Fn(usize, &mut [u32]) + 'a>;

impl fmt::Debug for Table<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            entry_words,
            texel_words,
            ..
        } = self;
        let words = self.words();
        write!(
            f,
            "Table({words} words, {entry_words} an entry, {texel_words} a texel)"
        )
    }
}

impl<'a> Table<'a> {
    /// Texels of four words each.
    pub(crate) fn wide(words: &'a [u32]) -> Self {
        Self {
            words: Words::There(words),
            entry_words: 4,
            texel_words: 4,
        }
    }

    /// Texels of one word each.
    pub(crate) fn narrow(words: &'a [u32]) -> Self {
        Self {
            words: Words::There(words),
            entry_words: 1,
            texel_words: 1,
        }
    }

    /// Entries of texels of four words each; `entry` makes one.
    pub(crate) fn wide_of<const N: usize>(
        entries: usize,
        entry: impl Fn(usize) -> [u32; N] + Sync + 'a,
    ) -> Self {
        Self::made(entries, 4, entry)
    }

    /// Entries of a texel of one word each; `entry` makes one.
    pub(crate) fn narrow_of(entries: usize, entry: impl Fn(usize) -> u32 + Sync + 'a) -> Self {
        Self::made(entries, 1, move |index| [entry(index)])
    }

    fn made<const N: usize>(
        entries: usize,
        texel_words: u32,
        entry: impl Fn(usize) -> [u32; N] + Sync + 'a,
    ) -> Self {
        let fill = move |first: usize, words: &mut [u32]| {
            let places = words.as_chunks_mut::<N>().0.par_iter_mut();
            let numbered = places.with_min_len(MADE_AT_ONCE).enumerate();
            numbered.for_each(|(k, place)| *place = entry(first + k));
        };
        Self {
            words: Words::Made(entries, Box::new(fill)),
            entry_words: N,
            texel_words,
        }
    }

    /// How many words it has.
    fn words(&self) -> usize {
        match &self.words {
            Words::There(words) => words.len(),
            Words::Made(entries, _) => entries * self.entry_words,
        }
    }

    /// Some of its words.
    fn part(&self, range: Range<usize>) -> Cow<'_, [u32]> {
        match &self.words {
            Words::There(words) => Cow::Borrowed(&words[range]),
            Words::Made(_, fill) => {
                // Whole entries: the range may begin and end within one.
                let first = range.start / self.entry_words;
                let end = range.end.div_ceil(self.entry_words);
                let mut words = vec![0; (end - first) * self.entry_words];
                fill(first, &mut words);
                let before = first * self.entry_words;
                words.truncate(range.end - before);
                words.drain(..range.start - before);
                Cow::Owned(words)
            }
        }
    }

    /// All of it, as it is uploaded.
    #[must_use]
    pub fn contents(&self) -> Cow<'_, [u32]> {
        self.part(0..self.words())
    }

    fn texel_bytes(&self) -> u64 {
        4 * u64::from(self.texel_words)
    }

    fn row_bytes(&self) -> u64 {
        self.texel_bytes() * u64::from(TABLE_WIDTH)
    }

    /// Width and height, in texels, of the texture that holds it. An empty one still has a texel.
    fn size(&self) -> (u32, u64) {
        let texels = (self.words() as u64)
            .div_ceil(u64::from(self.texel_words))
            .max(1);
        let width = texels.min(u64::from(TABLE_WIDTH)) as u32;
        (width, texels.div_ceil(u64::from(TABLE_WIDTH)))
    }

    /// What it takes on the device, the last row's end included.
    #[must_use]
    pub fn device_bytes(&self) -> u64 {
        let (width, height) = self.size();
        u64::from(width) * height * self.texel_bytes()
    }

    /// Is there a texture of at most `highest` rows that holds it? `name` is for the message.
    ///
    /// # Errors
    /// [`RenderError::TooLarge`] if not.
    pub(crate) fn check(&self, name: &str, highest: u32) -> Result<(), RenderError> {
        let highest = u64::from(highest);
        if self.size().1 <= highest {
            return Ok(());
        }
        Err(RenderError::TooLarge {
            buffer: name.to_owned(),
            bytes: self.device_bytes(),
            limit: highest * self.row_bytes(),
        })
    }

    /// Uploads it.
    ///
    /// # Errors
    /// [`RenderError::TooLarge`] if the device has no texture as high.
    pub(crate) fn upload(&self, device: &Device, name: &str) -> Result<Texture, RenderError> {
        self.check(name, device.highest_texture())?;
        let texture = self.reserve(device, name);
        let row = (TABLE_WIDTH * self.texel_words) as usize;
        let words = self.words();
        let whole_rows = words / row;
        let mut y = 0;
        while y < whole_rows {
            let rows = self.rows_at_once().min(whole_rows - y);
            let part = self.part(y * row..(y + rows) * row);
            let size = (TABLE_WIDTH, rows as u32);
            self.copy(device, &texture, cast_slice(&part), y as u32, size);
            // Hands it to the device, so that copies don't pile up.
            device.queue.submit([]);
            y += rows;
        }
        let rest = self.part(whole_rows * row..words);
        if !rest.is_empty() {
            let size = (rest.len() as u32 / self.texel_words, 1);
            self.copy(device, &texture, cast_slice(&rest), y as u32, size);
        }
        Ok(texture)
    }

    /// Rows of whole entries, and of as many bytes as are copied at once or a little less.
    fn rows_at_once(&self) -> usize {
        let texels = self.entry_words.div_ceil(self.texel_words as usize);
        ((COPIED_AT_ONCE / self.row_bytes()) as usize / texels).max(1) * texels
    }

    fn reserve(&self, device: &Device, name: &str) -> Texture {
        let (width, height) = self.size();
        device.device.create_texture(&TextureDescriptor {
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
        })
    }

    fn copy(&self, device: &Device, texture: &Texture, bytes: &[u8], y: u32, size: (u32, u32)) {
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
            assert_eq!(Table::narrow_of(texels, |_| 0).size(), size);
        }
    }

    #[test]
    fn parts_are_whole_entries() {
        let table = Table::wide_of(3 * 8192, |index| [index as u32; 12]);
        let row = 4 * TABLE_WIDTH as usize;
        let rows = table.rows_at_once();
        assert!(rows > 0 && (rows * row).is_multiple_of(12));
        assert!((rows * row * 4) as u64 <= COPIED_AT_ONCE);
    }

    #[test]
    fn a_part_is_what_lies_there_wherever_it_begins() {
        let table = Table::wide_of(1000, |index| {
            std::array::from_fn::<_, 12, _>(|k| (12 * index + k) as u32)
        });
        let all = table.contents();
        assert!(all.iter().copied().eq(0..12_000));
        for range in [
            0..12,
            24..36,
            0..8,
            4..20,
            11_000..12_000,
            8192..12_000,
            0..0,
        ] {
            assert_eq!(*table.part(range.clone()), all[range]);
        }
    }

    #[test]
    fn a_table_that_is_too_high_is_refused() {
        let row = TABLE_WIDTH as usize;
        let table = Table::wide_of(2 * row, |_| [0; 4]);
        assert!(table.check("nodes", 2).is_ok());
        let error = table.check("nodes", 1).unwrap_err();
        assert!(matches!(
            error,
            RenderError::TooLarge { buffer, bytes, limit }
                if buffer == "nodes" && bytes == 32 * row as u64 && limit == 16 * row as u64
        ));
    }
}
