//! Textures, samplers and images (glTF 2.0, 3.8) and KHR_texture_transform.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

use gltf::json;
use gltf::json::texture::{Info, MagFilter, WrappingMode};
use gltf::json::validation::Checked::{self, Valid};
use image::{ImageFormat, ImageReader};
use rayon::prelude::*;
use serde::Deserialize;
use serde_json::Value;

use super::buffers::Buffers;
use super::document::Document;
use super::error::{Fault, Outcome, Warnings};
use super::uri;
use crate::model::{Filter, Image, Texture, TextureRef, Wrap};

/// The textures that materials read, each once, and the images behind them, each once, in the order of first use.
#[derive(Default)]
pub(super) struct TextureTable {
    pub(super) textures: Vec<Texture>,
    /// Indices into the file's images.
    images: Vec<usize>,
    known_textures: BTreeMap<Texture, u32>,
    known_images: BTreeMap<usize, u32>,
}

impl TextureTable {
    /// A material's use of a texture, from its JSON (glTF's textureInfo). `uv_set` is still the file's number. `None` with a
    /// warning where the texture has no image that we can read.
    pub(super) fn texture_ref(
        &mut self,
        document: &Document,
        json: &Value,
        srgb: bool,
        place: &str,
        warnings: &mut Warnings,
    ) -> Outcome<Option<TextureRef>> {
        let info = Info::deserialize(json).map_err(|error| Fault::invalid(place, error))?;
        let source = &document.textures[info.index.value()];
        if source.source.value() >= document.images.len() {
            let texture = document.place("textures", info.index.value());
            warnings.push(
                place,
                format!("{texture} has no PNG or JPEG image and is left out"),
            );
            return Ok(None);
        }
        let sampler = source
            .sampler
            .map(|sampler| &document.samplers[sampler.value()]);
        let texture = self
            .texture(source.source.value(), sampler, srgb)
            .ok_or_else(|| {
                let place = document.place("textures", info.index.value());
                Fault::invalid(
                    place,
                    "the wrap or filter mode of its sampler is not one of glTF 2.0",
                )
            })?;

        let transform = info
            .extensions
            .as_ref()
            .and_then(|extensions| extensions.texture_transform.as_ref());
        let uv_set = transform
            .and_then(|transform| transform.tex_coord)
            .unwrap_or(info.tex_coord);
        let transform = transform.map_or(TextureRef::IDENTITY, affine_transform);
        if !transform.iter().all(|x| x.is_finite()) {
            return Err(Fault::invalid(place, "its KHR_texture_transform overflows"));
        }
        Ok(Some(TextureRef {
            texture,
            uv_set,
            transform,
        }))
    }

    /// `None` if the sampler is broken.
    fn texture(
        &mut self,
        image: usize,
        sampler: Option<&json::texture::Sampler>,
        srgb: bool,
    ) -> Option<u32> {
        let (wrap_u, wrap_v, filter) = match sampler {
            None => Default::default(),
            Some(sampler) => (
                wrap(sampler.wrap_s)?,
                wrap(sampler.wrap_t)?,
                filter(sampler.mag_filter)?,
            ),
        };
        let image = *self.known_images.entry(image).or_insert_with(|| {
            self.images.push(image);
            self.images.len() as u32 - 1
        });
        let texture = Texture {
            image,
            wrap_u,
            wrap_v,
            filter,
            srgb,
        };
        Some(*self.known_textures.entry(texture).or_insert_with(|| {
            self.textures.push(texture);
            self.textures.len() as u32 - 1
        }))
    }

    /// Decodes the images, on all cores. At most `max_texels` in all.
    pub(super) fn decode_images(
        &self,
        document: &Document,
        buffers: &Buffers<'_>,
        folder: &Path,
        max_texels: u64,
    ) -> Outcome<Vec<Image>> {
        let mut encoded = Vec::with_capacity(self.images.len());
        let mut total = 0_u64;
        for &index in &self.images {
            let image = EncodedImage::read(document, buffers, index, folder)?;
            total = total.saturating_add(u64::from(image.width) * u64::from(image.height));
            if total > max_texels {
                let problem =
                    format!("the images hold more than {max_texels} texels; make them smaller");
                return Err(Fault::limit(image.place, problem));
            }
            encoded.push(image);
        }
        decode_all(&encoded)
    }
}

/// Offset after rotation after scale. The angle is counter-clockwise in an image whose v runs down, hence the signs.
fn affine_transform(transform: &json::extensions::texture::TextureTransform) -> [f32; 6] {
    let [[du, dv], [su, sv]] = [transform.offset.0, transform.scale.0];
    let (sin, cos) = f64::from(transform.rotation.0).sin_cos();
    let (su, sv) = (f64::from(su), f64::from(sv));
    [
        (cos * su) as f32,
        (sin * sv) as f32,
        du,
        (-sin * su) as f32,
        (cos * sv) as f32,
        dv,
    ]
}

fn wrap(mode: Checked<WrappingMode>) -> Option<Wrap> {
    match mode {
        Valid(WrappingMode::Repeat) => Some(Wrap::Repeat),
        Valid(WrappingMode::MirroredRepeat) => Some(Wrap::MirroredRepeat),
        Valid(WrappingMode::ClampToEdge) => Some(Wrap::ClampToEdge),
        Checked::Invalid => None,
    }
}

fn filter(mode: Option<Checked<MagFilter>>) -> Option<Filter> {
    match mode {
        None | Some(Valid(MagFilter::Linear)) => Some(Filter::Linear),
        Some(Valid(MagFilter::Nearest)) => Some(Filter::Nearest),
        Some(Checked::Invalid) => None,
    }
}

/// A file's image, its header read.
struct EncodedImage<'a> {
    place: String,
    name: String,
    bytes: Cow<'a, [u8]>,
    format: ImageFormat,
    width: u32,
    height: u32,
}

impl<'a> EncodedImage<'a> {
    fn read(
        document: &Document,
        buffers: &'a Buffers<'_>,
        index: usize,
        folder: &Path,
    ) -> Outcome<Self> {
        let json = &document.images[index];
        let mut place = document.place("images", index);
        let mut name = document.name("images", index).map(str::to_owned);
        let bytes = match (json.buffer_view, &json.uri) {
            (Some(view), _) => Cow::Borrowed(buffers.view(view.value())),
            (None, Some(uri)) => {
                if uri::data(uri).is_none() && name.is_none() {
                    place = format!("{place} '{uri}'");
                    name = Some(uri.clone());
                }
                Cow::Owned(uri::read(uri, &place, folder)?)
            }
            (None, None) => return Err(missing_source(document, index)),
        };
        let format = match image::guess_format(&bytes) {
            Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg)) => format,
            _ => {
                return Err(Fault::unsupported(
                    place,
                    "neither PNG nor JPEG; save it as one of them",
                ));
            }
        };
        let dimensions = ImageReader::with_format(Cursor::new(&bytes), format).into_dimensions();
        let (width, height) = dimensions.map_err(|error| Fault::invalid(&place, error))?;
        let name = name.unwrap_or_else(|| document.number("images", index));
        Ok(Self {
            place,
            name,
            bytes,
            format,
            width,
            height,
        })
    }

    fn decode(&self) -> Outcome<Image> {
        let mut reader = ImageReader::with_format(Cursor::new(&self.bytes), self.format);
        // Eight bytes a texel are the most that PNG and JPEG take (16-bit RGBA); the texels have been counted.
        let mut limits = image::Limits::no_limits();
        limits.max_alloc = Some(u64::from(self.width) * u64::from(self.height) * 8 + (64 << 20));
        reader.limits(limits);
        let decoded = reader
            .decode()
            .map_err(|error| Fault::invalid(&self.place, error))?
            .into_rgba8();
        let (width, height) = decoded.dimensions();
        let texels = decoded.pixels().map(|pixel| pixel.0).collect();
        Ok(Image {
            name: self.name.clone(),
            width,
            height,
            texels,
        })
    }
}

/// Every image must say where it is, also one that nothing uses.
pub(super) fn check_sources(document: &Document) -> Outcome<()> {
    let nowhere = |image: &json::Image| image.buffer_view.is_none() && image.uri.is_none();
    document
        .images
        .iter()
        .position(nowhere)
        .map_or(Ok(()), |index| Err(missing_source(document, index)))
}

fn missing_source(document: &Document, index: usize) -> Fault {
    Fault::invalid(
        document.place("images", index),
        "has neither a uri nor a bufferView",
    )
}

/// Decoding PNGs is most of the time that textured scenes take to import, so all cores share it.
fn decode_all(encoded: &[EncodedImage<'_>]) -> Outcome<Vec<Image>> {
    let decoded: Vec<Outcome<Image>> = encoded.par_iter().map(EncodedImage::decode).collect();
    // The first error of them, whichever came first.
    decoded.into_iter().collect()
}
