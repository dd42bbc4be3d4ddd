//! Which adapter renders, and what can go wrong with it.

use std::{
    collections::HashSet,
    sync::{Arc, Mutex},
};

use wgpu::{
    Adapter, AdapterInfo, Backends, DeviceDescriptor, DeviceType, Features, Instance,
    InstanceDescriptor, InstanceFlags, PollError, PollType, SubmissionIndex,
};

use crate::{ahead::CreatedAhead, program::ProgramFeatures};

/// Storage buffers that the largest program binds (`shaders/bindings.wgsl`). WebGPU guarantees 8, SwiftShader has 10, other Vulkan
/// drivers that we know have many more.
const STORAGE_BUFFERS: u32 = 10;

/// Tables that the largest program binds, likewise.
const TABLES: u32 = 10;

/// A device to render on, with what it is called. A clone is the same device.
#[derive(Clone, Debug)]
pub struct Device {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    info: DeviceInfo,
    /// What was compiled ahead (`crate::ahead`).
    pub(crate) compiled: Arc<Mutex<HashSet<ProgramFeatures>>>,
    /// Pipelines and state that are being made ahead, for who renders next.
    pub(crate) created: Arc<Mutex<Vec<CreatedAhead>>>,
    /// The first error that wgpu reported outside of a call's own result.
    uncaptured: Arc<Mutex<Option<String>>>,
}

/// What an adapter calls itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceInfo {
    /// "llvmpipe (LLVM 19.1.4, 256 bits)", "NVIDIA H100 80GB HBM3".
    pub name: String,
    /// Driver and its version: "llvmpipe Mesa 25.0.7-2 (LLVM 19.1.4)".
    pub driver: String,
    /// Whether it is the CPU that does the work.
    pub cpu: bool,
}

/// Which adapter to use.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The CPU's (lavapipe, SwiftShader): the same picture everywhere. If there is none, any.
    #[default]
    Cpu,
    /// A GPU's. If there is none, an error.
    Gpu,
    /// The adapter of this position in the list of [`list_devices`].
    Index(usize),
    /// The first adapter whose name or driver contains this, whatever the case.
    Name(String),
}

/// No device, or none any more.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// There is no Vulkan driver at all.
    #[error(
        "no Vulkan driver was found; run ./setup.sh, or install a Vulkan loader and Mesa's lavapipe (on Debian: apt-get install libvulkan1 mesa-vulkan-drivers)"
    )]
    NoDriver,
    /// There are adapters, but not the one asked for.
    #[error("no device matches {wanted}; there are: {}", found.join(", "))]
    NoMatch {
        /// What was asked for.
        wanted: String,
        /// The names of those that are there.
        found: Vec<String>,
    },
    /// The adapter can't give what the program needs.
    #[error(
        "device '{name}' can't be used: {reason}; choose another with --device (raytree devices lists them)"
    )]
    Refused {
        /// The adapter.
        name: String,
        /// What it said.
        reason: String,
    },
    /// The device went away, hung, or reported an error while rendering.
    #[error(
        "device '{name}' failed while rendering: {reason}; try again, or another device (raytree devices lists them)"
    )]
    Lost {
        /// The adapter.
        name: String,
        /// What is known.
        reason: String,
    },
}

/// The longest that what is submitted at once may take: it is bounded work, so anything beyond this is a hang.
const DISPATCH_TIMEOUT: std::time::Duration = std::time::Duration::from_secs(120);

/// Every Vulkan adapter that the system has, in the loader's order.
#[must_use]
pub fn list_devices() -> Vec<DeviceInfo> {
    adapters()
        .iter()
        .map(|adapter| DeviceInfo::of(&adapter.get_info()))
        .collect()
}

fn adapters() -> Vec<Adapter> {
    let descriptor = InstanceDescriptor {
        backends: Backends::VULKAN,
        // No validation layers: they are a developer's tool, and change what is fast. WGPU_VALIDATION=1 turns them on.
        flags: InstanceFlags::empty().with_env(),
        ..InstanceDescriptor::new_without_display_handle()
    };
    pollster::block_on(Instance::new(descriptor).enumerate_adapters(Backends::VULKAN))
}

impl DeviceInfo {
    fn of(info: &AdapterInfo) -> Self {
        Self {
            name: info.name.clone(),
            driver: format!("{} {}", info.driver, info.driver_info)
                .trim()
                .to_owned(),
            cpu: info.device_type == DeviceType::Cpu,
        }
    }
}

impl From<&str> for DeviceChoice {
    /// `cpu`, `gpu`, a number in the list of [`list_devices`], or part of a name.
    fn from(text: &str) -> Self {
        match text {
            "cpu" => Self::Cpu,
            "gpu" => Self::Gpu,
            _ => text
                .parse()
                .map_or_else(|_| Self::Name(text.to_owned()), Self::Index),
        }
    }
}

impl DeviceChoice {
    fn position(&self, found: &[DeviceInfo]) -> Option<usize> {
        match self {
            Self::Cpu => found
                .iter()
                .position(|info| info.cpu)
                .or((!found.is_empty()).then_some(0)),
            Self::Gpu => found.iter().position(|info| !info.cpu),
            Self::Index(index) => (*index < found.len()).then_some(*index),
            Self::Name(name) => {
                let wanted = name.to_lowercase();
                found.iter().position(|info| {
                    format!("{} {}", info.name, info.driver)
                        .to_lowercase()
                        .contains(&wanted)
                })
            }
        }
    }
}

impl std::fmt::Display for DeviceChoice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Cpu => f.write_str("'cpu'"),
            Self::Gpu => f.write_str("'gpu'"),
            Self::Index(index) => write!(f, "number {index}"),
            Self::Name(name) => write!(f, "'{name}'"),
        }
    }
}

impl Device {
    /// Opens the chosen adapter.
    ///
    /// # Errors
    /// [`DeviceError`] if there is none, or it can't give what the programs need.
    pub fn open(choice: &DeviceChoice) -> Result<Self, DeviceError> {
        let adapters = adapters();
        let found: Vec<_> = adapters
            .iter()
            .map(|adapter| DeviceInfo::of(&adapter.get_info()))
            .collect();
        if found.is_empty() {
            return Err(DeviceError::NoDriver);
        }
        let Some(position) = choice.position(&found) else {
            let found = found.into_iter().map(|info| info.name).collect();
            return Err(DeviceError::NoMatch {
                wanted: choice.to_string(),
                found,
            });
        };
        Self::on(adapters[position].clone(), found[position].clone())
    }

    /// A device of the same name, with nothing in common with others: a queue, and on the CPU a compiler, of its own. When it is
    /// dropped, the driver has written to its cache what it compiled.
    pub(crate) fn like(info: &DeviceInfo) -> Result<Self, DeviceError> {
        let same = |adapter: &Adapter| DeviceInfo::of(&adapter.get_info()) == *info;
        let adapter = adapters().into_iter().find(same);
        Self::on(adapter.ok_or(DeviceError::NoDriver)?, info.clone())
    }

    fn on(adapter: Adapter, info: DeviceInfo) -> Result<Self, DeviceError> {
        let refused = |reason: String| DeviceError::Refused {
            name: info.name.clone(),
            reason,
        };

        // Asked for one by one, so that a larger device never hides a dependence.
        let offered = adapter.limits();
        let required_limits = wgpu::Limits {
            max_storage_buffers_per_shader_stage: STORAGE_BUFFERS,
            max_storage_textures_per_shader_stage: TABLES,
            max_storage_buffer_binding_size: offered.max_storage_buffer_binding_size,
            max_texture_dimension_2d: offered.max_texture_dimension_2d,
            max_buffer_size: offered.max_buffer_size,
            ..wgpu::Limits::default()
        };

        let descriptor = DeviceDescriptor {
            label: Some("raytree"),
            required_limits,
            // Tables are storage textures that are read; WebGPU has them, wgpu asks for this.
            required_features: Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES,
            ..DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|error| refused(error.to_string()))?;

        let uncaptured = Arc::new(Mutex::new(None));
        let first = Arc::clone(&uncaptured);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            if let Ok(mut slot) = first.lock() {
                slot.get_or_insert_with(|| error.to_string());
            }
        }));
        tracing::debug!(name = info.name, driver = info.driver, "device opened");
        Ok(Self {
            device,
            queue,
            info,
            compiled: Arc::default(),
            created: Arc::default(),
            uncaptured,
        })
    }

    /// What it calls itself.
    #[must_use]
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// The largest buffer that a program can bind, bytes.
    #[must_use]
    pub fn largest_binding(&self) -> u64 {
        self.device.limits().max_storage_buffer_binding_size
    }

    /// Rows of the highest texture.
    pub(crate) fn highest_texture(&self) -> u32 {
        self.device.limits().max_texture_dimension_2d
    }

    /// Waits until everything submitted is done.
    pub(crate) fn wait(&self) -> Result<(), DeviceError> {
        self.wait_until(None)
    }

    /// Waits until a submission is done, and those before it.
    pub(crate) fn wait_for(&self, index: &SubmissionIndex) -> Result<(), DeviceError> {
        self.wait_until(Some(index.clone()))
    }

    fn wait_until(&self, submission_index: Option<SubmissionIndex>) -> Result<(), DeviceError> {
        let waited = self.device.poll(PollType::Wait {
            submission_index,
            timeout: Some(DISPATCH_TIMEOUT),
        });
        self.check()?;
        match waited {
            Ok(_) => Ok(()),
            Err(PollError::Timeout) => {
                Err(self.lost("its work did not end in two minutes".to_owned()))
            }
            Err(error) => Err(self.lost(error.to_string())),
        }
    }

    /// Has wgpu reported an error?
    pub(crate) fn check(&self) -> Result<(), DeviceError> {
        let reported = self.uncaptured.lock().ok().and_then(|mut slot| slot.take());
        reported.map_or(Ok(()), |reason| Err(self.lost(reason)))
    }

    pub(crate) fn lost(&self, reason: String) -> DeviceError {
        DeviceError::Lost {
            name: self.info.name.clone(),
            reason,
        }
    }
}
