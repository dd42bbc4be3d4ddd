//! OpenEXR: linear radiance and all layers as channels of one flat part, which every reader of plain RGBA files takes.

use std::io::{BufRead, Cursor, Seek};

use ::exr::block::chunk::CompressedBlock;
use ::exr::block::reader::{ChunksReader, Reader};
use ::exr::image::read::specific_channels::{ReadSpecificChannel, ReadZeroChannels};
use ::exr::meta::attribute::ChannelList;
use ::exr::meta::header::Header;
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, Error, FlatSamples, Image,
    ImageAttributes, IntegerBounds, Layer, LayerAttributes, LineOrder, ReadChannels, ReadLayers,
    SmallVec, Text, Vec2, WritableImage,
};

use crate::error::Fault;
use crate::film::{Aovs, Estimates, Film};
use crate::read::{Budget, Picture, Rect};

/// The film as an EXR file's bytes: `R G B A` and, if it has AOVs, `Z` (depth) and the layers `Position`, `Ng` (geometric normal), `N`
/// (shading normal), `albedo`, and the integer channels `MaterialId`, `NodeId` and `rays`; of a picture that was
/// rendered to a tolerance also `error.dropped`, `error.sampling` and the integers `samples`. ZIP: no loss.
pub(crate) fn encode_film(film: &Film) -> Result<Vec<u8>, String> {
    encode_image(&film_as_image(film), true)
}

type Channels = SmallVec<[AnyChannel<FlatSamples>; 4]>;
type FilmImage = Image<Layer<AnyChannels<FlatSamples>>>;

fn encode_image(image: &FilmImage, parallel: bool) -> Result<Vec<u8>, String> {
    let mut file = Cursor::new(Vec::new());
    let write = image.write();
    let write = if parallel {
        write
    } else {
        write.non_parallel()
    };
    write
        .to_buffered(&mut file)
        .map_err(|error| error.to_string())?;
    Ok(file.into_inner())
}

fn film_as_image(film: &Film) -> FilmImage {
    let mut list: Channels = SmallVec::new();
    push_vectors(&mut list, ["R", "G", "B"], &film.radiance);
    list.push(AnyChannel::new("A", FlatSamples::F32(film.alpha.clone())));
    if let Some(aovs) = &film.aovs {
        push_aovs(&mut list, aovs);
    }
    if let Some(estimates) = &film.estimates {
        push_estimates(&mut list, estimates);
    }
    let window = film.window;
    let position = Vec2(window.x as i32, window.y as i32);
    // Only attributes of fixed place: `other` is a hash map, whose order would differ from run to run.
    let attributes = LayerAttributes {
        software_name: Some(concat!("raytree ", env!("CARGO_PKG_VERSION")).into()),
        ..LayerAttributes::default()
    };
    Image {
        attributes: ImageAttributes::with_size((
            window.full_width as usize,
            window.full_height as usize,
        )),
        layer_data: Layer {
            channel_data: AnyChannels::sort(list),
            attributes: attributes.with_position(position),
            size: Vec2(film.width as usize, film.height as usize),
            encoding: Encoding {
                compression: Compression::ZIP16,
                blocks: Blocks::ScanLines,
                line_order: LineOrder::Increasing,
            },
        },
    }
}

fn push_aovs(list: &mut Channels, aovs: &Aovs) {
    list.push(AnyChannel::new("Z", FlatSamples::F32(aovs.depth.clone())));
    push_vectors(
        list,
        ["Position.X", "Position.Y", "Position.Z"],
        &aovs.position,
    );
    push_vectors(list, ["Ng.X", "Ng.Y", "Ng.Z"], &aovs.geometric_normal);
    push_vectors(list, ["N.X", "N.Y", "N.Z"], &aovs.shading_normal);
    push_vectors(list, ["albedo.R", "albedo.G", "albedo.B"], &aovs.albedo);
    // 32-bit integers are OpenEXR's type for ids, and its library turns them into floats for whoever asks for floats.
    for (name, ids) in [
        ("MaterialId", &aovs.material_id),
        ("NodeId", &aovs.node_id),
        ("rays", &aovs.rays),
    ] {
        list.push(AnyChannel::new(name, FlatSamples::U32(ids.clone())));
    }
}

fn push_estimates(list: &mut Channels, estimates: &Estimates) {
    for (name, error) in [
        ("error.dropped", &estimates.dropped),
        ("error.sampling", &estimates.sampling),
    ] {
        list.push(AnyChannel::new(name, FlatSamples::F32(error.clone())));
    }
    let samples = FlatSamples::U32(estimates.samples.clone());
    list.push(AnyChannel::new("samples", samples));
}

fn push_vectors(list: &mut Channels, names: [&str; 3], vectors: &[[f32; 3]]) {
    for (axis, name) in names.into_iter().enumerate() {
        let plane = vectors.iter().map(|v| v[axis]).collect();
        list.push(AnyChannel::new(name, FlatSamples::F32(plane)));
    }
}

/// Names that programs give to the layer that is the picture, in lower case.
const PICTURE_LAYERS: [&str; 5] = ["combined", "beauty", "rgba", "color", "image"];

/// Which channels make up the picture: `R G B` or `Y` (grey), and `A`, all behind the layer's `prefix`.
#[derive(Clone, Debug, PartialEq)]
struct Selection {
    prefix: Vec<u8>,
    grey: bool,
}

impl Selection {
    fn channel(&self, name: &str) -> Text {
        Text::from_slice_unchecked(&[&self.prefix, name.as_bytes()].concat())
    }

    fn has(&self, channels: &ChannelList, name: &str) -> bool {
        channels
            .find_index_of_channel(&self.channel(name))
            .is_some()
    }

    fn is_in(&self, channels: &ChannelList) -> bool {
        let names: &[&str] = if self.grey { &["Y"] } else { &["R", "G", "B"] };
        names.iter().all(|name| self.has(channels, name))
    }
}

/// Reads the picture in an EXR file into its display window.
pub(crate) fn decode(mut file: impl BufRead + Seek, budget: Budget) -> Result<Picture, Fault> {
    let reader = Reader::read_from_buffered(&mut file, false)?;
    check_claims(reader.headers(), budget)?;
    if reader.headers().iter().any(is_dwa) {
        check_dwa_claims(reader)?;
    }
    file.rewind().map_err(Fault::Io)?;
    let reader = Reader::read_from_buffered(file, false)?;
    let (header, selection) = select(reader.headers())?;
    let frame = Frame::of(header, &selection, budget)?;
    let color = |name| selection.channel(name);
    let channels = ReadZeroChannels {};
    let picture = if selection.grey {
        channels
            .required(color("Y"))
            .optional(color("A"), 1.0)
            .collect_pixels(
                |_, _| frame.blank(),
                move |picture, at, (y, a): (f32, f32)| frame.set(picture, at, [y; 3], a),
            )
            .first_valid_layer()
            .all_attributes()
            .from_chunks(reader)?
            .layer_data
            .channel_data
            .pixels
    } else {
        channels
            .required(color("R"))
            .required(color("G"))
            .required(color("B"))
            .optional(color("A"), 1.0)
            .collect_pixels(
                |_, _| frame.blank(),
                move |picture, at, (r, g, b, a): (f32, f32, f32, f32)| {
                    frame.set(picture, at, [r, g, b], a);
                },
            )
            .first_valid_layer()
            .all_attributes()
            .from_chunks(reader)?
            .layer_data
            .channel_data
            .pixels
    };
    Ok(picture)
}

/// Refuses what a file of its length can't hold before anything as large as claimed is allocated or counted through.
fn check_claims(headers: &[Header], budget: Budget) -> Result<(), Fault> {
    // Each block of pixels has an offset of 8 bytes in the file.
    let blocks = headers.iter().fold(0u64, |sum, header| {
        sum.saturating_add(header.chunk_count as u64)
    });
    if blocks > budget.file_bytes() / 8 {
        let message = format!("its {blocks} blocks of pixels don't fit into the file");
        return Err(Fault::Damaged(message));
    }
    headers.iter().try_for_each(|header| {
        let Vec2(width, height) = header.layer_size;
        budget.check(width, height, header.channels.bytes_per_pixel)
    })
}

fn is_dwa(header: &Header) -> bool {
    matches!(
        header.compression,
        Compression::DWAA(_) | Compression::DWAB(_)
    )
}

/// The crate `exr` 1.74.2 allocates what the head of a DWA block says that the block unpacks to, and aborts the program if
/// that is too much. So the heads are looked at before any block is unpacked.
fn check_dwa_claims(reader: Reader<impl BufRead + Seek>) -> Result<(), Fault> {
    let mut chunks = reader.filter_chunks(false, |_, _, _| true)?;
    let headers = chunks.meta_data().headers.clone();
    for chunk in &mut chunks {
        let chunk = chunk?;
        let bytes = match &chunk.compressed_block {
            CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
            CompressedBlock::Tile(block) => &block.compressed_pixels_le,
            _ => continue, // deep blocks, which are not unpacked
        };
        let header = headers.get(chunk.layer_index);
        if header.is_some_and(|header| is_dwa(header) && claims_too_much(header, bytes)) {
            let message = "a DWA block claims more than it can hold";
            return Err(Fault::Damaged(message.into()));
        }
    }
    Ok(())
}

fn claims_too_much(header: &Header, dwa_block: &[u8]) -> bool {
    // Of the head's eleven 64-bit numbers: the unpacked sizes of its sections, in bytes or in 16-bit numbers.
    const UNPACKED: [usize; 5] = [1, 6, 7, 8, 9];

    // The transform works on whole squares of 8 x 8 pixels, no section takes more than 4 bytes for a sample, and run lengths
    // may double that.
    let pixels = header.max_block_pixel_size();
    let squares = pixels.0.next_multiple_of(8) * pixels.1.next_multiple_of(8);
    let most = (8 * squares * header.channels.list.len()) as u64;
    let (numbers, _) = dwa_block.as_chunks();
    let claimed = UNPACKED.iter().filter_map(|index| numbers.get(*index));
    claimed
        .map(|number| u64::from_le_bytes(*number))
        .any(|size| size > most)
}

/// The part and the channels that are the picture: colour before grey, unnamed layers before named ones, well-known names
/// before others, and else the first.
fn select(headers: &[Header]) -> Result<(&Header, Selection), Fault> {
    let mut prefixes: Vec<Vec<u8>> = vec![Vec::new()];
    for channel in headers.iter().flat_map(|header| &header.channels.list) {
        let name = channel.name.as_slice();
        if let Some(dot) = name.iter().rposition(|byte| *byte == b'.') {
            prefixes.push(name[..=dot].to_vec());
        }
    }
    prefixes.sort_by_key(|prefix| !prefix.is_empty() as usize + !is_picture_layer(prefix) as usize);
    let candidates = [false, true].into_iter().flat_map(|grey| {
        prefixes.iter().map(move |prefix| Selection {
            prefix: prefix.clone(),
            grey,
        })
    });
    for selection in candidates {
        if let Some(header) = headers
            .iter()
            .find(|header| selection.is_in(&header.channels))
        {
            if selection.grey && selection.has(&header.channels, "RY") {
                let what = "luminance and chroma channels (Y, RY, BY) are not read";
                return Err(Fault::Unsupported(what.into()));
            }
            return Ok((header, selection));
        }
    }
    let names: Vec<String> = headers
        .iter()
        .flat_map(|header| {
            header
                .channels
                .list
                .iter()
                .map(|channel| channel.name.to_string())
        })
        .collect();
    Err(Fault::Unsupported(format!(
        "no channels R, G, B and no Y among its channels ({})",
        names.join(", ")
    )))
}

/// Whether the innermost layer of `prefix` (`View.Combined.`) has one of the well-known names; so has the unnamed layer.
fn is_picture_layer(prefix: &[u8]) -> bool {
    let innermost = prefix.split(|byte| *byte == b'.').rev().nth(1);
    innermost.is_none_or(|layer| {
        PICTURE_LAYERS
            .iter()
            .any(|name| layer.eq_ignore_ascii_case(name.as_bytes()))
    })
}

/// How the file's data lies in the picture, which is the file's display window.
#[derive(Clone, Copy)]
struct Frame {
    width: u32,
    height: u32,
    has_alpha: bool,
    /// The data's corner, seen from the picture's.
    corner: [i64; 2],
    data: Rect,
}

impl Frame {
    fn of(header: &Header, selection: &Selection, budget: Budget) -> Result<Self, Fault> {
        let IntegerBounds { position, size } = header.shared_attributes.display_window;
        budget.check(size.0, size.1, 0)?;
        // A window's size is below 2^31, or the header would not have been read.
        let (width, height) = (size.0 as u32, size.1 as u32);
        let first = header.own_attributes.layer_position;
        let corner = [
            i64::from(first.0) - i64::from(position.0),
            i64::from(first.1) - i64::from(position.1),
        ];
        let span = |start: i64, length: usize, picture: u32| {
            let low = start.clamp(0, i64::from(picture));
            let high = (start + length as i64).clamp(0, i64::from(picture));
            (low as u32, (high - low) as u32)
        };
        let (x, data_width) = span(corner[0], header.layer_size.0, width);
        let (y, data_height) = span(corner[1], header.layer_size.1, height);
        Ok(Self {
            width,
            height,
            has_alpha: selection.has(&header.channels, "A"),
            corner,
            data: Rect {
                x,
                y,
                width: data_width,
                height: data_height,
            },
        })
    }

    fn blank(&self) -> Picture {
        let pixels = self.width as usize * self.height as usize;
        Picture {
            width: self.width,
            height: self.height,
            rgb: vec![[0.0; 3]; pixels],
            alpha: self.has_alpha.then(|| vec![0.0; pixels]),
            data: self.data,
        }
    }

    /// Sets the picture's pixel for the data's pixel `at`, if it is in the picture.
    fn set(&self, picture: &mut Picture, at: Vec2<usize>, rgb: [f32; 3], alpha: f32) {
        let (x, y) = (at.0 as i64 + self.corner[0], at.1 as i64 + self.corner[1]);
        if x < 0 || y < 0 || x >= i64::from(self.width) || y >= i64::from(self.height) {
            return;
        }
        let index = y as usize * self.width as usize + x as usize;
        picture.rgb[index] = rgb;
        if let Some(alphas) = &mut picture.alpha {
            alphas[index] = alpha;
        }
    }
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        match error {
            Error::Io(io) => Fault::Io(io),
            Error::NotSupported(what) => Fault::Unsupported(what.into_owned()),
            other => Fault::Damaged(other.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(names: &[&str]) -> Header {
        let channels = names.iter().map(|name| {
            ::exr::prelude::ChannelDescription::named(*name, ::exr::prelude::SampleType::F32)
        });
        Header::new("part".into(), (1, 1), channels.collect())
    }

    fn selected(parts: &[&[&str]]) -> Option<(String, bool)> {
        let headers: Vec<Header> = parts.iter().map(|names| header(names)).collect();
        let (_, selection) = select(&headers).ok()?;
        Some((String::from_utf8(selection.prefix).unwrap(), selection.grey))
    }

    #[test]
    fn the_picture_is_found_among_the_channels() {
        let found = |prefix: &str, grey| Some((prefix.to_owned(), grey));
        assert_eq!(selected(&[&["A", "B", "G", "R", "Z"]]), found("", false));
        assert_eq!(
            selected(&[&["B", "G", "R", "Y", "a.B", "a.G", "a.R"]]),
            found("", false)
        );
        assert_eq!(selected(&[&["A", "Y"]]), found("", true));
        assert_eq!(selected(&[&["Z"], &["B", "G", "R"]]), found("", false));
        assert_eq!(
            selected(&[&["left.B", "left.G", "left.R"]]),
            found("left.", false)
        );
        let blender = [
            "V.AO.B",
            "V.AO.G",
            "V.AO.R",
            "V.Combined.B",
            "V.Combined.G",
            "V.Combined.R",
            "V.Depth.Z",
        ];
        assert_eq!(selected(&[&blender]), found("V.Combined.", false));
        assert_eq!(selected(&[&["Depth.Y", "Depth.Z"]]), found("Depth.", true));
        assert_eq!(selected(&[&["B", "G", "Z"]]), None);
        assert_eq!(selected(&[&["BY", "RY", "Y"]]), None);
    }

    #[test]
    fn compression_in_parallel_gives_the_same_bytes_as_without() {
        let mut film = Film::new(61, 143);
        for (i, pixel) in film.radiance.iter_mut().enumerate() {
            *pixel = [i as f32, (i * 7919 % 1000) as f32, 1.0 / (1.0 + i as f32)];
        }
        film.aovs = Some(Aovs::missed(film.pixel_count()));
        let image = film_as_image(&film);
        let alone = encode_image(&image, false).unwrap();
        for _ in 0..5 {
            assert_eq!(encode_image(&image, true).unwrap(), alone);
        }
    }
}
