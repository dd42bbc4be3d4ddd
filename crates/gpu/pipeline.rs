//! A program on a device: its pipeline, and the buffers that it binds - those that its module still names, no others.

use std::{borrow::Cow, collections::BTreeMap};

use naga::{
    AddressSpace, Handle, ImageClass, Module, StorageAccess, StorageFormat, Type, TypeInner,
};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBindingType,
    BufferDescriptor, BufferSlice, BufferUsages, CommandEncoderDescriptor, ComputePass,
    ComputePassDescriptor, ComputePipeline, ComputePipelineDescriptor, PipelineLayoutDescriptor,
    ShaderModule, ShaderModuleDescriptor, ShaderRuntimeChecks, ShaderSource, ShaderStages,
    StorageTextureAccess, SubmissionIndex, TextureFormat, TextureView, TextureViewDescriptor,
    TextureViewDimension,
};

use crate::{
    device::{Device, DeviceError},
    error::RenderError,
    program::Kernel,
    table::Table,
};

/// A binding that a program has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    /// Its name in `shaders/bindings.wgsl`.
    pub name: String,
    group: u32,
    index: u32,
    kind: BindingKind,
}

impl Binding {
    /// Group, and index in it.
    pub(crate) fn place(&self) -> (u32, u32) {
        (self.group, self.index)
    }
}

/// What is bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum BindingKind {
    Buffer(BufferBindingType),
    Table(TextureFormat),
}

/// The bindings that a specialised module still has.
#[must_use]
pub fn bindings_of(module: &Module) -> Vec<Binding> {
    let mut bindings: Vec<Binding> = module
        .global_variables
        .iter()
        .filter_map(|(_, variable)| {
            let place = variable.binding?;
            let kind = match variable.space {
                AddressSpace::Uniform => BindingKind::Buffer(BufferBindingType::Uniform),
                AddressSpace::Storage { access } => {
                    BindingKind::Buffer(BufferBindingType::Storage {
                        read_only: !access.contains(StorageAccess::STORE),
                    })
                }
                AddressSpace::Handle => BindingKind::Table(table_format(module, variable.ty)?),
                _ => return None,
            };
            let name = variable.name.clone().unwrap_or_default();
            Some(Binding {
                name,
                group: place.group,
                index: place.binding,
                kind,
            })
        })
        .collect();
    bindings.sort_by_key(|binding| (binding.group, binding.index));
    bindings
}

/// The format of a table's texels.
fn table_format(module: &Module, ty: Handle<Type>) -> Option<TextureFormat> {
    match module.types[ty].inner {
        TypeInner::Image {
            class: ImageClass::Storage { format, .. },
            ..
        } => match format {
            StorageFormat::R32Uint => Some(TextureFormat::R32Uint),
            StorageFormat::Rgba32Uint => Some(TextureFormat::Rgba32Uint),
            _ => None,
        },
        _ => None,
    }
}

/// A pipeline with what it binds.
#[derive(Debug)]
pub(crate) struct Pipeline {
    pipeline: ComputePipeline,
    bindings: Vec<Binding>,
    layouts: Vec<BindGroupLayout>,
}

impl Pipeline {
    /// Creates the pipeline. On lavapipe this does not compile: the first dispatch does.
    pub(crate) fn new(
        device: &Device,
        kernel: Kernel,
        module: Module,
    ) -> Result<Self, DeviceError> {
        let bindings = bindings_of(&module);
        let shader = shader_module(device, kernel, module);
        let groups = bindings
            .iter()
            .map(|binding| binding.group + 1)
            .max()
            .unwrap_or(0);
        let layouts: Vec<BindGroupLayout> = (0..groups)
            .map(|group| group_layout(device, &bindings, group))
            .collect();
        let references: Vec<_> = layouts.iter().map(Some).collect();
        let layout = device
            .device
            .create_pipeline_layout(&PipelineLayoutDescriptor {
                label: Some(kernel.name()),
                bind_group_layouts: &references,
                immediate_size: 0,
            });
        let pipeline = device
            .device
            .create_compute_pipeline(&ComputePipelineDescriptor {
                label: Some(kernel.name()),
                layout: Some(&layout),
                module: &shader,
                entry_point: Some(kernel.name()),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            });
        device.check()?;
        Ok(Self {
            pipeline,
            bindings,
            layouts,
        })
    }

    pub(crate) fn bindings(&self) -> &[Binding] {
        &self.bindings
    }

    /// Binds to each binding the resource called `named` of its name.
    pub(crate) fn bind(
        &self,
        device: &Device,
        resources: &Resources,
        named: impl Fn(&str) -> String,
    ) -> Vec<BindGroup> {
        let groups = self.layouts.iter().zip(0_u32..);
        groups
            .map(|(layout, group)| {
                let entries: Vec<BindGroupEntry<'_>> = self
                    .bindings
                    .iter()
                    .filter(|binding| binding.group == group)
                    .map(|binding| BindGroupEntry {
                        binding: binding.index,
                        resource: resources.binding(&named(&binding.name)),
                    })
                    .collect();
                device.device.create_bind_group(&BindGroupDescriptor {
                    label: None,
                    layout,
                    entries: &entries,
                })
            })
            .collect()
    }

    /// Records a dispatch.
    pub(crate) fn dispatch(
        &self,
        pass: &mut ComputePass<'_>,
        groups: &[BindGroup],
        workgroups: Workgroups<'_>,
    ) {
        pass.set_pipeline(&self.pipeline);
        for (group, index) in groups.iter().zip(0_u32..) {
            pass.set_bind_group(index, group, &[]);
        }
        match workgroups {
            Workgroups::Count(count) => pass.dispatch_workgroups(count, 1, 1),
            Workgroups::Listed(arguments) => pass.dispatch_workgroups_indirect(arguments, 0),
        }
    }
}

/// Hands the module to wgpu, which checks every index as ever but counts no turns of loops: that costs 4 % of traversal
/// (benches/README.md).
fn shader_module(device: &Device, kernel: Kernel, module: Module) -> ShaderModule {
    let descriptor = ShaderModuleDescriptor {
        label: Some(kernel.name()),
        source: ShaderSource::Naga(Cow::Owned(module)),
    };
    let checks = ShaderRuntimeChecks {
        force_loop_bounding: false,
        ..ShaderRuntimeChecks::checked()
    };
    #[allow(unsafe_code, reason = "wgpu offers it in no other way")]
    // SAFETY: what has to hold is that no loop is without end. Modules come from `shaders/` alone, whose loops go through a tree that
    // `GpuScene::new` has made sure is finite, along a ray's hits in their strict order, through the bits of a word, or up to a count.
    unsafe {
        device
            .device
            .create_shader_module_trusted(descriptor, checks)
    }
}

/// Records what `record` records, and submits it.
pub(crate) fn submit(device: &Device, record: impl FnOnce(&mut ComputePass<'_>)) {
    let mut encoder = device
        .device
        .create_command_encoder(&CommandEncoderDescriptor::default());
    record(&mut encoder.begin_compute_pass(&ComputePassDescriptor::default()));
    device.queue.submit([encoder.finish()]);
}

/// How many workgroups a dispatch has.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Workgroups<'a> {
    Count(u32),
    /// As many as the device has left there.
    Listed(&'a Buffer),
}

fn group_layout(device: &Device, bindings: &[Binding], group: u32) -> BindGroupLayout {
    let entries: Vec<BindGroupLayoutEntry> = bindings
        .iter()
        .filter(|binding| binding.group == group)
        .map(|binding| BindGroupLayoutEntry {
            binding: binding.index,
            visibility: ShaderStages::COMPUTE,
            ty: binding.kind.layout(),
            count: None,
        })
        .collect();
    device
        .device
        .create_bind_group_layout(&BindGroupLayoutDescriptor {
            label: None,
            entries: &entries,
        })
}

impl BindingKind {
    fn layout(self) -> BindingType {
        match self {
            Self::Buffer(ty) => BindingType::Buffer {
                ty,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            Self::Table(format) => BindingType::StorageTexture {
                access: StorageTextureAccess::ReadOnly,
                format,
                view_dimension: TextureViewDimension::D2,
            },
        }
    }
}

/// What a program binds, by the names of `shaders/bindings.wgsl`.
#[derive(Debug, Default)]
pub(crate) struct Resources {
    buffers: BTreeMap<String, Buffer>,
    tables: BTreeMap<String, TextureView>,
}

/// No element of a storage buffer is larger: an empty list still binds one.
const LARGEST_ELEMENT: u64 = 1024;

/// What a buffer of `size` bytes takes: as much as the largest element of any.
pub(crate) fn buffer_bytes(size: u64) -> u64 {
    size.max(LARGEST_ELEMENT).next_multiple_of(16)
}

/// A buffer of `size` bytes. Before its first use it is cleared.
///
/// # Errors
/// [`RenderError::TooLarge`] if the device can't bind that much.
pub(crate) fn new_buffer(
    device: &Device,
    name: &str,
    size: u64,
    usage: BufferUsages,
) -> Result<Buffer, RenderError> {
    let limit = device.largest_binding();
    if size > limit {
        return Err(RenderError::TooLarge {
            buffer: name.to_owned(),
            bytes: size,
            limit,
        });
    }
    Ok(device.device.create_buffer(&BufferDescriptor {
        label: Some(name),
        size: buffer_bytes(size),
        usage: usage | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    }))
}

impl Resources {
    pub(crate) fn buffer(&self, name: &str) -> &Buffer {
        &self.buffers[name]
    }

    fn binding(&self, name: &str) -> BindingResource<'_> {
        match self.tables.get(name) {
            Some(view) => BindingResource::TextureView(view),
            None => self.buffer(name).as_entire_binding(),
        }
    }

    /// Uploads a table of the scene.
    ///
    /// # Errors
    /// [`RenderError::TooLarge`] if the device has no room for it.
    pub(crate) fn add_table(
        &mut self,
        device: &Device,
        name: &str,
        table: &Table<'_>,
    ) -> Result<(), RenderError> {
        let view = table
            .upload(device, name)?
            .create_view(&TextureViewDescriptor::default());
        self.tables.insert(name.to_owned(), view);
        Ok(())
    }

    /// Is there anything of that name?
    pub(crate) fn has(&self, name: &str) -> bool {
        self.buffers.contains_key(name) || self.tables.contains_key(name)
    }

    /// Makes a buffer of `size` bytes, all zero.
    ///
    /// # Errors
    /// [`RenderError::TooLarge`] if the device can't bind that much.
    pub(crate) fn reserve(
        &mut self,
        device: &Device,
        name: &str,
        size: u64,
        usage: BufferUsages,
    ) -> Result<(), RenderError> {
        self.add_buffer(name, new_buffer(device, name, size, usage)?);
        Ok(())
    }

    /// Adds a buffer that was made elsewhere.
    pub(crate) fn add_buffer(&mut self, name: &str, buffer: Buffer) {
        self.buffers.insert(name.to_owned(), buffer);
    }

    /// Makes a uniform buffer of `size` bytes that begins with `bytes`.
    ///
    /// # Errors
    /// As [`Self::reserve`].
    pub(crate) fn upload_uniform(
        &mut self,
        device: &Device,
        name: &str,
        bytes: &[u8],
        size: u64,
    ) -> Result<(), RenderError> {
        self.reserve(device, name, size, BufferUsages::UNIFORM)?;
        self.fill(device, name, bytes);
        Ok(())
    }

    fn fill(&self, device: &Device, name: &str, bytes: &[u8]) {
        if !bytes.is_empty() {
            device.queue.write_buffer(self.buffer(name), 0, bytes);
        }
    }
}

/// Bytes on their way to the host.
pub(crate) struct ComingBack {
    staging: Buffer,
    index: SubmissionIndex,
}

impl ComingBack {
    /// Copies the first `size` bytes of a buffer, after everything submitted before.
    pub(crate) fn begin(device: &Device, buffer: &Buffer, size: u64) -> Self {
        let staging = device.device.create_buffer(&BufferDescriptor {
            label: Some("read back"),
            size,
            usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = device
            .device
            .create_command_encoder(&CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, size);
        let index = device.queue.submit([encoder.finish()]);
        Self { staging, index }
    }

    /// Waits until they are there: what `take` makes of them.
    pub(crate) fn wait<R>(
        &self,
        device: &Device,
        take: impl FnOnce(&[u8]) -> R,
    ) -> Result<R, DeviceError> {
        mapped(device, self.staging.slice(..), &self.index, take)
    }
}

/// Copies the first `size` bytes of a buffer back. Waits for everything submitted before.
pub(crate) fn read_back(
    device: &Device,
    buffer: &Buffer,
    size: u64,
) -> Result<Vec<u8>, DeviceError> {
    ComingBack::begin(device, buffer, size).wait(device, <[u8]>::to_vec)
}

/// What `take` makes of a part of a buffer for reading back when a submission is done.
pub(crate) fn mapped<R>(
    device: &Device,
    staging: BufferSlice<'_>,
    index: &SubmissionIndex,
    take: impl FnOnce(&[u8]) -> R,
) -> Result<R, DeviceError> {
    staging.map_async(wgpu::MapMode::Read, |_| {});
    device.wait_for(index)?;
    let view = staging
        .get_mapped_range()
        .map_err(|error| device.lost(error.to_string()))?;
    let made = take(&view);
    drop(view);
    staging.buffer().unmap();
    Ok(made)
}
