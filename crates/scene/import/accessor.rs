//! Accessors (glTF 2.0, 3.6.2): what the bytes of a view mean. Strided, sparse, normalised, or all zero without a view.

use std::array;

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked::Valid;

use super::buffers::Buffers;
use super::document::Document;
use super::error::{Fault, Outcome};
use crate::parallel::mapped;

/// What a vertex attribute (or the index list) may look like: glTF 2.0, 3.7.2, and KHR_mesh_quantization.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Usage {
    Indices,
    Position,
    Normal,
    Tangent,
    TexCoord,
    Color,
}

/// One accessor whose elements are known to lie inside their views.
pub(super) struct Accessor<'a> {
    index: usize,
    pub(super) count: usize,
    /// How many components an element has.
    pub(super) components: usize,
    kind: Type,
    component: ComponentType,
    normalized: bool,
    /// From the first element on; `None`: all zero.
    bytes: Option<&'a [u8]>,
    stride: usize,
    sparse: Option<Sparse<'a>>,
}

/// Elements that replace those of the view.
struct Sparse<'a> {
    count: usize,
    component: ComponentType,
    /// Strictly increasing element indices.
    indices: &'a [u8],
    values: &'a [u8],
}

/// Checks every accessor of the file, also those that nothing uses.
pub(super) fn check_all(document: &Document, buffers: &Buffers<'_>) -> Outcome<()> {
    (0..document.accessors.len())
        .try_for_each(|index| Accessor::new(document, buffers, index).map(drop))
}

impl<'a> Accessor<'a> {
    pub(super) fn new(
        document: &Document,
        buffers: &'a Buffers<'_>,
        index: usize,
    ) -> Outcome<Self> {
        let invalid = |problem: String| Fault::invalid(format!("accessors[{index}]"), problem);
        let json = &document.accessors[index];
        let (Valid(component), Valid(kind)) = (json.component_type, json.type_) else {
            return Err(invalid(
                "its componentType or its type is not one of glTF 2.0".to_owned(),
            ));
        };
        let (component, components) = (component.0, kind.multiplicity());
        let size = element_size(kind, component);
        // What fits in memory is checked below; what does not fit in 32 bits can't be indexed.
        let count = u32::try_from(json.count.0)
            .map_err(|_| invalid(format!("count {} is too large", json.count.0)))?
            as usize;

        let mut stride = size;
        let bytes = match json.buffer_view {
            Some(view) => {
                let bytes = buffers.view(view.value());
                stride = buffers.stride(view.value()).unwrap_or(size);
                if stride < size {
                    let problem = format!(
                        "bufferViews[{}] has byteStride {stride}, an element {size} bytes",
                        view.value()
                    );
                    return Err(invalid(problem));
                }
                let offset = json.byte_offset.map_or(0, |offset| offset.0);
                Some(
                    slice_elements(bytes, offset, count, stride, size).ok_or_else(|| {
                        let view = view.value();
                        invalid(format!(
                            "{count} elements of {size} bytes reach past bufferViews[{view}]"
                        ))
                    })?,
                )
            }
            // Nothing else bounds such a list by what the file holds.
            None if count > buffers.total() => {
                return Err(invalid(format!(
                    "has no bufferView and count {count}, more than the file has bytes"
                )));
            }
            None => None,
        };
        let sparse = json
            .sparse
            .as_ref()
            .map(|sparse| Sparse::new(sparse, buffers, count, size))
            .transpose();
        let sparse = sparse.map_err(|problem| invalid(format!("sparse: {problem}")))?;
        Ok(Self {
            index,
            count,
            components,
            kind,
            component,
            normalized: json.normalized,
            bytes,
            stride,
            sparse,
        })
    }

    fn invalid(&self, problem: impl std::fmt::Display) -> Fault {
        Fault::invalid(format!("accessors[{}]", self.index), problem)
    }

    /// Refuses element types that glTF does not allow for `usage`.
    pub(super) fn check_usage(&self, usage: Usage, quantized: bool) -> Outcome<()> {
        use ComponentType::{F32, I8, I16, U8, U16, U32};
        use Type::{Scalar, Vec2, Vec3, Vec4};
        let kind_fits = match usage {
            Usage::Indices => self.kind == Scalar,
            Usage::Position | Usage::Normal => self.kind == Vec3,
            Usage::Tangent => self.kind == Vec4,
            Usage::TexCoord => self.kind == Vec2,
            Usage::Color => matches!(self.kind, Vec3 | Vec4),
        };
        let component_fits = match (usage, self.component, self.normalized) {
            (Usage::Indices, U8 | U16 | U32, normalized) => !normalized,
            (Usage::Indices, ..) => false,
            (_, F32, _) | (Usage::TexCoord | Usage::Color, U8 | U16, true) => true,
            (Usage::Position | Usage::TexCoord, I8 | U8 | I16 | U16, _) => quantized,
            (Usage::Normal | Usage::Tangent, I8 | I16, true) => quantized,
            _ => false,
        };
        if kind_fits && component_fits {
            return Ok(());
        }
        let normalized = if self.normalized { "normalized " } else { "" };
        let extension = if quantized {
            ""
        } else {
            " without KHR_mesh_quantization"
        };
        let problem = format!(
            "{:?} of {normalized}{:?} can't be a {usage:?}{extension}",
            self.kind, self.component
        );
        Err(self.invalid(problem))
    }

    /// All elements of an index list.
    pub(super) fn indices(&self) -> Outcome<Vec<u32>> {
        let sparse = self.sparse_indices()?;
        let read = |element| unsigned(self.component, self.element(element, &sparse));
        Ok((0..self.count).map(read).collect())
    }

    /// The index that would restart a strip in other APIs; glTF forbids it.
    pub(super) fn restart_index(&self) -> u32 {
        match self.component {
            ComponentType::U8 => u32::from(u8::MAX),
            ComponentType::U16 => u32::from(u16::MAX),
            _ => u32::MAX,
        }
    }

    /// The first `N` components of the elements `which`, all below `count`. In f64, so that normalised integers lose nothing. As
    /// the file has them: glTF forbids what is infinite or not a number (3.6.2.2), and such is there all the same.
    pub(super) fn gather<const N: usize>(&self, which: &[u32]) -> Outcome<Vec<[f64; N]>> {
        let normalized = self.normalized;
        let ratio = |value: f64, largest: f64| {
            if normalized {
                (value / largest).max(-1.0)
            } else {
                value
            }
        };
        match self.component {
            ComponentType::F32 => {
                self.gather_as(which, |bytes| f64::from(f32::from_le_bytes(bytes)))
            }
            ComponentType::I8 => self.gather_as(which, |bytes| {
                ratio(i8::from_le_bytes(bytes).into(), i8::MAX.into())
            }),
            ComponentType::U8 => self.gather_as(which, |bytes| {
                ratio(u8::from_le_bytes(bytes).into(), u8::MAX.into())
            }),
            ComponentType::I16 => self.gather_as(which, |bytes| {
                ratio(i16::from_le_bytes(bytes).into(), i16::MAX.into())
            }),
            ComponentType::U16 => self.gather_as(which, |bytes| {
                ratio(u16::from_le_bytes(bytes).into(), u16::MAX.into())
            }),
            ComponentType::U32 => self.gather_as(which, |bytes| {
                ratio(u32::from_le_bytes(bytes).into(), u32::MAX.into())
            }),
        }
    }

    fn gather_as<const N: usize, const SIZE: usize>(
        &self,
        which: &[u32],
        decode: impl Fn([u8; SIZE]) -> f64 + Send + Sync,
    ) -> Outcome<Vec<[f64; N]>> {
        let sparse = self.sparse_indices()?;
        let element = |&element: &u32| {
            let (components, _) = self.element(element as usize, &sparse).as_chunks::<SIZE>();
            array::from_fn(|component| decode(components[component]))
        };
        Ok(mapped(which, element))
    }

    /// The bytes of one element; `sparse` from [`Self::sparse_indices`].
    fn element(&self, element: usize, sparse: &[u32]) -> &[u8] {
        // No element of a vector or scalar is larger.
        const ZERO: [u8; 16] = [0; 16];
        let size = self.components * self.component.size();
        if let (Some(replaced), Ok(at)) = (&self.sparse, sparse.binary_search(&(element as u32))) {
            return &replaced.values[at * size..][..size];
        }
        self.bytes.map_or(&ZERO[..size], |bytes| {
            &bytes[element * self.stride..][..size]
        })
    }

    /// Which elements are replaced, in increasing order.
    fn sparse_indices(&self) -> Outcome<Vec<u32>> {
        let Some(sparse) = &self.sparse else {
            return Ok(Vec::new());
        };
        let size = sparse.component.size();
        let indices: Vec<u32> = sparse
            .indices
            .chunks_exact(size)
            .take(sparse.count)
            .map(|bytes| unsigned(sparse.component, bytes))
            .collect();
        if !indices.is_sorted_by(|a, b| a < b) {
            return Err(self.invalid("sparse: the indices do not increase"));
        }
        match indices.last() {
            Some(&last) if last as usize >= self.count => {
                Err(self.invalid(format!("sparse: index {last}, but count is {}", self.count)))
            }
            _ => Ok(indices),
        }
    }
}

impl<'a> Sparse<'a> {
    fn new(
        json: &gltf::json::accessor::sparse::Sparse,
        buffers: &'a Buffers<'_>,
        accessor_count: usize,
        element_size: usize,
    ) -> Result<Self, String> {
        let Valid(component) = json.indices.component_type else {
            return Err("its indices are not unsigned integers".to_owned());
        };
        let count = json.count.0;
        if count > accessor_count as u64 {
            return Err(format!(
                "count {count} is more than the accessor's {accessor_count}"
            ));
        }
        let count = count as usize;
        let packed = |view: usize, offset: u64, size: usize| {
            slice_elements(buffers.view(view), offset, count, size, size).ok_or_else(|| {
                format!("{count} elements of {size} bytes reach past bufferViews[{view}]")
            })
        };
        Ok(Self {
            count,
            component: component.0,
            indices: packed(
                json.indices.buffer_view.value(),
                json.indices.byte_offset.0,
                component.0.size(),
            )?,
            values: packed(
                json.values.buffer_view.value(),
                json.values.byte_offset.0,
                element_size,
            )?,
        })
    }
}

/// The bytes from `offset` on, if `count` elements fit there.
fn slice_elements(
    bytes: &[u8],
    offset: u64,
    count: usize,
    stride: usize,
    size: usize,
) -> Option<&[u8]> {
    let bytes = bytes.get(usize::try_from(offset).ok()?..)?;
    let needed = match count {
        0 => 0,
        _ => (count - 1).checked_mul(stride)?.checked_add(size)?,
    };
    (needed <= bytes.len()).then_some(bytes)
}

/// Bytes of an element. Columns of matrices start at multiples of four (glTF 2.0, 3.6.2.4).
fn element_size(kind: Type, component: ComponentType) -> usize {
    let columns = match kind {
        Type::Mat2 => 2,
        Type::Mat3 => 3,
        Type::Mat4 => 4,
        _ => return kind.multiplicity() * component.size(),
    };
    columns * (columns * component.size()).next_multiple_of(4)
}

/// A little-endian unsigned integer; only such components get here.
fn unsigned(component: ComponentType, bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .take(component.size())
        .rev()
        .fold(0, |value, &byte| value << 8 | u32::from(byte))
}
