//! Buffers and buffer views (glTF 2.0, 3.6.1): where the bytes are.

use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;

use super::document::Document;
use super::error::{Fault, Outcome};
use super::uri;

/// The bytes of all buffers, cut into checked views.
pub(super) struct Buffers<'a> {
    buffers: Vec<Cow<'a, [u8]>>,
    views: Vec<View>,
}

struct View {
    buffer: usize,
    range: Range<usize>,
    stride: Option<usize>,
}

impl<'a> Buffers<'a> {
    /// Reads every buffer; `binary` is the GLB's own. At most `max_bytes` in all.
    pub(super) fn load(
        document: &Document,
        binary: Option<&'a [u8]>,
        folder: &Path,
        max_bytes: u64,
    ) -> Outcome<Self> {
        let mut buffers = Vec::with_capacity(document.buffers.len());
        let mut total = 0_u64;
        for index in 0..document.buffers.len() {
            let bytes = load_buffer(document, index, binary, folder)?;
            total += bytes.len() as u64;
            if total > max_bytes {
                let problem = format!(
                    "the buffers hold more than {max_bytes} bytes; split the scene into several files"
                );
                return Err(Fault::limit(format!("buffers[{index}]"), problem));
            }
            buffers.push(bytes);
        }
        let views = (0..document.buffer_views.len())
            .map(|index| check_view(document, index, &buffers))
            .collect::<Outcome<_>>()?;
        Ok(Self { buffers, views })
    }

    /// The bytes of a view.
    pub(super) fn view(&self, index: usize) -> &[u8] {
        let View { buffer, range, .. } = &self.views[index];
        &self.buffers[*buffer][range.clone()]
    }

    /// Bytes from one element to the next, if the view says.
    pub(super) fn stride(&self, index: usize) -> Option<usize> {
        self.views[index].stride
    }

    /// All bytes there are.
    pub(super) fn total(&self) -> usize {
        self.buffers.iter().map(|buffer| buffer.len()).sum()
    }
}

fn load_buffer<'a>(
    document: &Document,
    index: usize,
    binary: Option<&'a [u8]>,
    folder: &Path,
) -> Outcome<Cow<'a, [u8]>> {
    let place = format!("buffers[{index}]");
    let buffer = &document.buffers[index];
    let mut bytes = match (&buffer.uri, binary) {
        (Some(uri), _) => Cow::Owned(uri::read(uri, &place, folder)?),
        (None, Some(binary)) if index == 0 => Cow::Borrowed(binary),
        (None, _) => {
            return Err(Fault::invalid(
                place,
                "has no uri, and is not the binary chunk of a GLB file",
            ));
        }
    };
    let (there, announced) = (bytes.len() as u64, buffer.byte_length.0);
    if there < announced {
        return Err(Fault::invalid(
            place,
            format!("cut short: {there} bytes there, {announced} announced"),
        ));
    }
    // What follows is padding and belongs to no view.
    match &mut bytes {
        Cow::Borrowed(bytes) => *bytes = &bytes[..announced as usize],
        Cow::Owned(bytes) => bytes.truncate(announced as usize),
    }
    Ok(bytes)
}

fn check_view(document: &Document, index: usize, buffers: &[Cow<'_, [u8]>]) -> Outcome<View> {
    let view = &document.buffer_views[index];
    let buffer = view.buffer.value();
    let available = buffers[buffer].len() as u64;
    let start = view.byte_offset.map_or(0, |offset| offset.0);
    match start.checked_add(view.byte_length.0) {
        Some(end) if end <= available => Ok(View {
            buffer,
            range: start as usize..end as usize,
            stride: view.byte_stride.map(|stride| stride.0),
        }),
        _ => {
            let length = view.byte_length.0;
            let problem = format!(
                "{length} bytes from {start} on reach past the {available} bytes of buffers[{buffer}]"
            );
            Err(Fault::invalid(format!("bufferViews[{index}]"), problem))
        }
    }
}
