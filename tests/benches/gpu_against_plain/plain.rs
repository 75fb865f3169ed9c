//! The plain passes of `plain.wgsl` on one adapter, each submitted and waited for on its own.

use anyhow::Context as _;
use foreframe_engine::{KeyFrame, MonoSpan};
use foreframed::clock;
use wgpu::util::{BufferInitDescriptor, DeviceExt as _};

const PASSES: [&str; 3] = ["gather", "scatter_depth", "scatter_source"];

/// Times of one round.
#[derive(Clone, Copy)]
pub(crate) struct Plain {
    /// The planes of a key to the device.
    pub(crate) upload: MonoSpan,
    /// [`PASSES`].
    pub(crate) passes: [MonoSpan; 3],
}

/// The passes on one device, for one key.
pub(crate) struct PlainPasses {
    device: wgpu::Device,
    queue: wgpu::Queue,
    /// What is sent up, and where to.
    planes: Vec<(wgpu::Buffer, Vec<u8>)>,
    /// Cleared before each round.
    targets: [wgpu::Buffer; 2],
    group: wgpu::BindGroup,
    pipelines: Vec<wgpu::ComputePipeline>,
    /// Workgroups of each pass.
    groups: [[u32; 2]; 3],
}

impl PlainPasses {
    /// On the adapter of this name, at half of `key`'s motion span.
    pub(crate) fn open(name: &str, key: &KeyFrame) -> anyhow::Result<Self> {
        let descriptor = wgpu::InstanceDescriptor {
            backends: wgpu::Backends::VULKAN,
            flags: wgpu::InstanceFlags::empty(),
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        };
        let instance = wgpu::Instance::new(descriptor);
        let found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
        let adapter = found.into_iter().find(|adapter| adapter.get_info().name == name);
        let adapter = adapter.context("the adapter is no longer there")?;
        let limits = wgpu::Limits {
            max_storage_buffers_per_shader_stage: 6,
            ..wgpu::Limits::downlevel_defaults()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
                required_limits: limits,
                ..Default::default()
            }))?;
        let module = device.create_shader_module(wgpu::include_wgsl!("plain.wgsl"));

        let velocity = key.velocity.data().iter().flat_map(|v| [v.x, v.y]);
        let planes = [
            key.color.as_bytes().to_vec(),
            velocity.flat_map(i16::to_le_bytes).collect(),
            key.depth.data().iter().copied().flat_map(u32::to_le_bytes).collect(),
        ];
        let buffer = |size: usize| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: size as u64,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let [color_bytes, field_bytes, _] = [0, 1, 2].map(|i: usize| planes[i].len());
        let planes = planes.map(|bytes: Vec<u8>| (buffer(bytes.len()), bytes));
        let targets = [buffer(field_bytes), buffer(field_bytes)];
        let out = buffer(color_bytes);

        let size = [key.color.width(), key.color.height()];
        let cells = [key.velocity.width(), key.velocity.height()];
        let params = [size[0], size[1], cells[0], cells[1], 4096 / 2, 0];
        let params = device.create_buffer_init(&BufferInitDescriptor {
            label: None,
            contents: params.map(u32::to_le_bytes).as_flattened(),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let layout = layout(&device);
        let bound = std::iter::once(&params)
            .chain(planes.iter().map(|(buffer, _)| buffer))
            .chain(&targets)
            .chain([&out]);
        let entries: Vec<_> = (0..)
            .zip(bound)
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &entries,
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipelines = PASSES.map(|entry| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                cache: None,
            })
        });
        let tiles = |[width, height]: [u32; 2]| [width.div_ceil(16), height.div_ceil(16)];
        let groups = [tiles(size), tiles(cells), tiles(cells)];
        let (planes, pipelines) = (planes.into(), pipelines.into());
        Ok(Self { device, queue, planes, targets, group, pipelines, groups })
    }

    /// Runs everything once.
    pub(crate) fn round(&self) -> anyhow::Result<Plain> {
        let upload = self.timed(|_| {
            for (buffer, bytes) in &self.planes {
                self.queue.write_buffer(buffer, 0, bytes);
            }
        })?;
        let mut passes = [MonoSpan::ZERO; PASSES.len()];
        for (pass, time) in passes.iter_mut().enumerate() {
            *time = self.timed(|commands| {
                // A scatter needs an empty target.
                if pass > 0 {
                    commands.clear_buffer(&self.targets[pass - 1], 0, None);
                }
                let mut compute = commands.begin_compute_pass(&Default::default());
                compute.set_bind_group(0, &self.group, &[]);
                compute.set_pipeline(&self.pipelines[pass]);
                let [columns, rows] = self.groups[pass];
                compute.dispatch_workgroups(columns, rows, 1);
            })?;
        }
        Ok(Plain { upload, passes })
    }

    /// From the first call to the device's last step.
    fn timed(&self, record: impl FnOnce(&mut wgpu::CommandEncoder)) -> anyhow::Result<MonoSpan> {
        let started_at = clock::now();
        let mut commands = self.device.create_command_encoder(&Default::default());
        record(&mut commands);
        let submission = self.queue.submit([commands.finish()]);
        self.device
            .poll(wgpu::PollType::Wait { submission_index: Some(submission), timeout: None })?;
        Ok(clock::now() - started_at)
    }
}

fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let storage = |read_only| wgpu::BufferBindingType::Storage { read_only };
    let types = [
        wgpu::BufferBindingType::Uniform,
        storage(true),
        storage(true),
        storage(true),
        storage(false),
        storage(false),
        storage(false),
    ];
    let entries: Vec<_> = (0..)
        .zip(types)
        .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &entries,
    })
}
