//! OpenEXR files: the first layer with channels R, G, B, or Y alone as grey.
//!
//! Read block by block, not by the library's one-call readers: these leave no room for [`check_dwa_sizes`], and their
//! parallel decompression runs on threads where a panic would end the process.

use std::fs::File;
use std::io::BufReader;
use std::ops::Range;

use exr::block::chunk::{Chunk, CompressedBlock};
use exr::block::lines::LineRef;
use exr::block::{UncompressedBlock, reader::Reader};
use exr::meta::header::Header;
use exr::prelude::{Compression, Error as ExrError, SampleType, Vec2, f16};

use super::load::{EnvironmentProblem, Pixels, check_size};

/// The library allocates a decompressed block (a tile, or some rows) at a time; none of ours needs to be larger.
const MAX_BLOCK_BYTES: usize = 1 << 30;

/// Decodes the file, which has this many bytes.
pub(super) fn decode(file: BufReader<File>, bytes: u64) -> Result<Pixels, EnvironmentProblem> {
    let reader = exr::block::read(file, false)?;
    let layer = Layer::choose(reader.headers())?;
    let mut canvas = Canvas::new(&layer, bytes)?;
    for_each_block(reader, &layer, |block| {
        for line in block.lines(&layer.header.channels) {
            let channel = &layer.header.channels.list[line.location.channel];
            canvas.draw(&line, channel.sample_type, layer.components(&channel.name))?;
        }
        Ok(())
    })?;
    Ok(canvas.pixels)
}

/// Decompresses all blocks of the layer's full resolution.
fn for_each_block(
    reader: Reader<BufReader<File>>,
    layer: &Layer,
    mut visit: impl FnMut(UncompressedBlock) -> Result<(), EnvironmentProblem>,
) -> Result<(), EnvironmentProblem> {
    let meta_data = reader.meta_data().clone();
    let chunks = reader.filter_chunks(false, |_, tile, block| {
        block.layer == layer.index && tile.is_largest_resolution_level()
    })?;
    for chunk in chunks {
        let chunk = chunk?;
        // A damaged table of offsets may lead to any block of the file.
        let elsewhere = || EnvironmentProblem::Damaged("its table of blocks is wrong".into());
        if chunk.layer_index != layer.index {
            return Err(elsewhere());
        }
        check_dwa_sizes(&chunk, &layer.header)?;
        let block = UncompressedBlock::decompress_chunk(chunk, &meta_data, false)?;
        if block.index.level != Vec2(0, 0) {
            return Err(elsewhere());
        }
        visit(block)?;
    }
    Ok(())
}

/// Refuses DWA blocks whose leading counters exceed what a block can hold: exr 1.74.2 allocates by them unchecked, and a
/// failed allocation ends the process.
fn check_dwa_sizes(chunk: &Chunk, header: &Header) -> Result<(), EnvironmentProblem> {
    /// Sizes and counts of the block's sections, after the version: eight bytes each, little-endian.
    const COUNTERS: Range<usize> = 1..10;
    if !matches!(
        header.compression,
        Compression::DWAA(_) | Compression::DWAB(_)
    ) {
        return Ok(());
    }
    let data = match &chunk.compressed_block {
        CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
        CompressedBlock::Tile(block) => &block.compressed_pixels_le,
        _ => return Ok(()),
    };
    let place = header.get_block_data_indices(&chunk.compressed_block)?;
    let size = header.get_absolute_block_pixel_coordinates(place)?.size;
    // The library takes a block of just this length for uncompressed.
    if data.len() == size.area() * header.channels.bytes_per_pixel {
        return Ok(());
    }
    // Twice the samples, in bytes, after filling up to whole 8 x 8 blocks: run lengths may add to what they encode.
    let filled = (size.width() + 8) * (size.height() + 8);
    let limit = (8 * filled * header.channels.list.len()) as u64;
    let (words, _) = data.as_chunks::<8>();
    let counters = words.iter().take(COUNTERS.end).skip(COUNTERS.start);
    if counters
        .map(|word| u64::from_le_bytes(*word))
        .any(|counter| counter > limit)
    {
        return Err(EnvironmentProblem::Damaged(
            "a block claims impossible sizes".into(),
        ));
    }
    Ok(())
}

/// The layer that is read.
struct Layer {
    index: usize,
    header: Header,
    grey: bool,
}

impl Layer {
    fn choose(headers: &[Header]) -> Result<Self, EnvironmentProblem> {
        let has =
            |header: &Header, name: &str| header.channels.list.iter().any(|c| c.name.eq(name));
        let find = |names: &[&str]| {
            headers
                .iter()
                .position(|header| names.iter().all(|name| has(header, name)))
        };
        let rgb = find(&["R", "G", "B"]);
        // With RY and BY beside it, Y is one third of a luminance-chroma image.
        let grey = || find(&["Y"]).filter(|&index| !has(&headers[index], "RY"));
        let Some(index) = rgb.or_else(grey) else {
            let names = headers.iter().flat_map(|header| &header.channels.list);
            let names: Vec<String> = names.map(|channel| channel.name.to_string()).collect();
            return Err(EnvironmentProblem::Unsupported {
                what: format!(
                    "no layer has the channels R, G and B (there are: {})",
                    names.join(", ")
                ),
                remedy: "save it as plain RGB",
            });
        };
        Ok(Self {
            index,
            header: headers[index].clone(),
            grey: rgb.is_none(),
        })
    }

    /// Which of red, green and blue a channel sets.
    fn components(&self, channel: &exr::prelude::Text) -> Range<usize> {
        let names = [("R", 0..1), ("G", 1..2), ("B", 2..3)];
        if self.grey {
            return if channel.eq("Y") { 0..3 } else { 0..0 };
        }
        let found = names.into_iter().find(|(name, _)| channel.eq(name));
        found.map_or(0..0, |(_, components)| components)
    }
}

/// The display window, black where nothing was drawn.
struct Canvas {
    pixels: Pixels,
    /// Left upper corner of the data window, from that of the display window.
    offset: [i64; 2],
}

impl Canvas {
    /// Checks all sizes that anything is allocated by.
    fn new(layer: &Layer, bytes: u64) -> Result<Self, EnvironmentProblem> {
        let checked =
            |size: Vec2<usize>| check_size(size.width() as u64, size.height() as u64, bytes);
        let display = layer.header.shared_attributes.display_window;
        let data = layer.header.own_attributes.layer_position;
        checked(layer.header.layer_size)?;
        let (width, height) = checked(display.size)?;
        let header = &layer.header;
        let block_texels = header.max_block_pixel_size().min(header.layer_size).area();
        if block_texels.saturating_mul(layer.header.channels.bytes_per_pixel) > MAX_BLOCK_BYTES {
            return Err(EnvironmentProblem::Unsupported {
                what: "its tiles are larger than 1 GiB".into(),
                remedy: "save it as scan lines, with the channels R, G and B alone",
            });
        }
        let channels = vec![0.0; 3 * width as usize * height as usize];
        Ok(Self {
            pixels: Pixels {
                width,
                height,
                channels,
            },
            offset: [
                i64::from(data.x()) - i64::from(display.position.x()),
                i64::from(data.y()) - i64::from(display.position.y()),
            ],
        })
    }

    /// Draws the part of a line of samples that the display window shows.
    fn draw(
        &mut self,
        line: &LineRef<'_>,
        sample_type: SampleType,
        components: Range<usize>,
    ) -> Result<(), EnvironmentProblem> {
        let Some(y) = shown(
            line.location.position.y(),
            self.offset[1],
            self.pixels.height,
        ) else {
            return Ok(());
        };
        let (width, offset) = (self.pixels.width, self.offset[0]);
        let row = 3 * y * width as usize..3 * (y + 1) * width as usize;
        let (row, _) = self.pixels.channels[row].as_chunks_mut::<3>();
        let mut set = |i: usize, value: f32| {
            if let Some(x) = shown(line.location.position.x() + i, offset, width) {
                row[x][components.clone()].fill(value);
            }
        };
        match sample_type {
            SampleType::F16 => {
                for (i, sample) in line.read_samples::<f16>().enumerate() {
                    set(i, sample?.to_f32());
                }
            }
            SampleType::F32 => {
                for (i, sample) in line.read_samples::<f32>().enumerate() {
                    set(i, sample?);
                }
            }
            SampleType::U32 => {
                for (i, sample) in line.read_samples::<u32>().enumerate() {
                    set(i, sample? as f32);
                }
            }
        }
        Ok(())
    }
}

/// A coordinate of the data window as one of the display window, if that shows it.
fn shown(position: usize, offset: i64, size: u32) -> Option<usize> {
    let moved = i64::try_from(position).ok()?.checked_add(offset)?;
    usize::try_from(moved).ok().filter(|&i| i < size as usize)
}

impl From<ExrError> for EnvironmentProblem {
    fn from(error: ExrError) -> Self {
        match error {
            ExrError::NotSupported(what) => Self::Unsupported {
                what: format!("an OpenEXR feature that we can't read: {what}"),
                remedy: "save it as plain RGB, not deep, no luminance-chroma",
            },
            ExrError::Io(error) => Self::Io(error),
            ExrError::Invalid(reason) => Self::Damaged(reason.into_owned()),
            ExrError::Aborted => Self::Damaged("reading was aborted".into()),
        }
    }
}
