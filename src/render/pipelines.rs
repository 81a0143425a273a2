//! Pipelines for parts, each made when it is first needed, for just the work that its parts and pictures have: software drivers pay for
//! both sides of every branch, so that what a part has not is better not in its shader at all.

use std::collections::HashMap;

use super::drawer::PassKind;
use super::part::DevicePart;
use super::placing::{Groups, Placing};
use super::targets::{COLOR, ID, nearer};
use super::{Background, Shot, Show};
use crate::gpu::{Gpu, Shader};

/// What is known of a part when its pipeline is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PartTraits {
    /// How it fades: [`crate::gpu::layout::Presence::FADE_NEVER`] and so on.
    pub fade: u32,
    /// From which sides it is seen: bits, [`crate::gpu::layout::Presence::FACING`] and so on.
    pub facing: u32,
    /// How it turns: 0, [`crate::gpu::layout::Presence::TURNED_UPRIGHT`], [`crate::gpu::layout::Presence::TURNED_WHOLLY`].
    pub turned: u32,
    /// It is leaves, cut out of what they are painted on.
    pub foliage: bool,
    /// It is a sphere-board crown.
    pub crown: bool,
    /// It has a normal map.
    pub normal_mapped: bool,
    /// It is a picture of foliage that is elsewhere: a card.
    pub stand_in: bool,
}

/// What is known of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct FrameTraits {
    /// What surfaces show: [`crate::gpu::layout::Frame::LIT`] and so on.
    pub shading: u32,
    /// There is air to see through.
    pub air: bool,
    /// The wind blows.
    pub wind: bool,
    /// Only edges of triangles, where the adapter can.
    pub wireframe: bool,
}

impl FrameTraits {
    /// Of a picture.
    pub fn of(shot: &Shot) -> Self {
        Self {
            shading: shot.shading(),
            air: shot.background == Background::Sky,
            wind: shot.wind.wind > 0.0,
            wireframe: shot.show == Show::Wireframe,
        }
    }
}

/// What a pipeline is made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Variant {
    kind: PassKind,
    part: PartTraits,
    frame: FrameTraits,
    two_sided: bool,
    /// Whole triangles cast shadows: no fragment is asked.
    solid: bool,
}

impl Variant {
    fn of(part: &DevicePart, kind: PassKind, frame: FrameTraits) -> Self {
        let (solid, two_sided) = (kind == PassKind::Shadow && !part.pierced, part.two_sided);
        match kind {
            PassKind::Temporary => Self { kind, part: part.traits, frame, two_sided, solid },
            // Shadows know nothing of light.
            PassKind::Shadow => {
                let part = PartTraits { foliage: false, normal_mapped: false, stand_in: false, ..part.traits };
                let frame = FrameTraits { shading: 0, air: false, wireframe: false, ..frame };
                Self { kind, part, frame, two_sided, solid }
            }
        }
    }

    /// The numbers that stand for it in shaders, in the order of [`VARIANTS`](crate::gpu::VARIANTS).
    fn numbers(&self, growing: bool) -> [u32; 11] {
        let Self { part, frame, .. } = self;
        let bit = u32::from;
        let [foliage, crown, normal_mapped, stand_in] = [part.foliage, part.crown, part.normal_mapped, part.stand_in].map(bit);
        let [air, wind, growing] = [frame.air, frame.wind, growing].map(bit);
        [part.fade, part.facing, part.turned, foliage, crown, normal_mapped, stand_in, growing, frame.shading, air, wind]
    }
}

/// A way of drawing parts: its shaders and what they read.
#[derive(Debug, Clone, Copy)]
pub struct Style {
    /// Shader for the picture.
    pub seen: &'static str,
    /// Shader for the sun's map.
    pub cast: &'static str,
    /// Vertex buffers.
    pub buffers: &'static [Option<wgpu::VertexBufferLayout<'static>>],
    /// Solid parts cast shadows as whole triangles.
    pub solid: bool,
    /// Outlines may grow.
    pub grows: bool,
}

/// The pipelines of a style.
#[derive(Debug)]
pub struct Pipelines {
    style: Style,
    /// For the picture, for the sun's map.
    layouts: [wgpu::PipelineLayout; 2],
    has_lines: bool,
    made: HashMap<Variant, wgpu::RenderPipeline>,
}

impl Pipelines {
    /// None yet.
    pub fn new(gpu: &Gpu, style: Style, groups: &Groups, last: Option<&wgpu::BindGroupLayout>) -> Self {
        Self {
            style,
            layouts: [true, false].map(|lit| groups.layout(gpu, style.seen, lit, last)),
            has_lines: gpu.device.features().contains(wgpu::Features::POLYGON_MODE_LINE),
            made: HashMap::new(),
        }
    }

    /// Those of parts with vertices of their own.
    pub fn of_parts(gpu: &Gpu, groups: &Groups, placing: Placing, [seen, cast]: [&'static str; 2], solid: bool) -> Self {
        let style = Style { seen, cast, buffers: placing.buffers(), solid, grows: placing == Placing::Each };
        Self::new(gpu, style, groups, (placing != Placing::Each).then_some(&groups.crowd))
    }

    /// Makes the one for a part, unless there is one.
    pub fn ready(&mut self, gpu: &Gpu, part: &DevicePart, kind: PassKind, frame: FrameTraits) {
        let variant = Variant::of(part, kind, frame);
        if !self.made.contains_key(&variant) {
            let pipeline = self.make(gpu, &variant);
            self.made.insert(variant, pipeline);
        }
    }

    /// The one for a part that was made ready.
    pub fn of(&self, part: &DevicePart, kind: PassKind, frame: FrameTraits) -> &wgpu::RenderPipeline {
        self.made.get(&Variant::of(part, kind, frame)).expect("prepare made it ready")
    }

    fn make(&self, gpu: &Gpu, variant: &Variant) -> wgpu::RenderPipeline {
        let Style { seen, cast, buffers, solid, grows } = self.style;
        let (name, layout, targets) = match variant.kind {
            PassKind::Temporary => (seen, &self.layouts[0], Some(&TARGETS[..])),
            PassKind::Shadow if variant.solid && solid => (cast, &self.layouts[1], None),
            PassKind::Shadow => (cast, &self.layouts[1], Some(&[][..])),
        };
        let shader = Shader::load_for(gpu, name, &variant.numbers(grows));
        let lines = variant.frame.wireframe && self.has_lines;
        let mode = if lines { wgpu::PolygonMode::Line } else { wgpu::PolygonMode::Fill };
        let cull_mode = if variant.two_sided { None } else { Some(wgpu::Face::Back) };
        pipeline_of(gpu, name, layout, &shader, buffers, targets, cull_mode, mode)
    }
}

/// What the temporary pass draws into.
const TARGETS: [Option<wgpu::ColorTargetState>; 2] = [
    Some(wgpu::ColorTargetState { format: COLOR, blend: None, write_mask: wgpu::ColorWrites::ALL }),
    Some(wgpu::ColorTargetState { format: ID, blend: None, write_mask: wgpu::ColorWrites::ALL }),
];

/// A layout of these groups.
pub fn pipeline_layout(gpu: &Gpu, label: &'static str, groups: &[&wgpu::BindGroupLayout]) -> wgpu::PipelineLayout {
    let groups: Vec<_> = groups.iter().copied().map(Some).collect();
    let descriptor = wgpu::PipelineLayoutDescriptor { label: Some(label), bind_group_layouts: &groups, immediate_size: 0 };
    gpu.device.create_pipeline_layout(&descriptor)
}

/// A pipeline that keeps what is nearer; without targets it has no fragment stage and draws depth alone.
#[expect(clippy::too_many_arguments)]
pub fn pipeline_of(
    gpu: &Gpu,
    label: &'static str,
    layout: &wgpu::PipelineLayout,
    shader: &Shader,
    buffers: &[Option<wgpu::VertexBufferLayout>],
    targets: Option<&[Option<wgpu::ColorTargetState>]>,
    cull_mode: Option<wgpu::Face>,
    polygon_mode: wgpu::PolygonMode,
) -> wgpu::RenderPipeline {
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module: &shader.0,
            entry_point: Some("vs_main"),
            compilation_options: Default::default(),
            buffers,
        },
        primitive: wgpu::PrimitiveState { cull_mode, polygon_mode, ..Default::default() },
        depth_stencil: Some(nearer()),
        multisample: wgpu::MultisampleState::default(),
        fragment: targets.map(|targets| wgpu::FragmentState {
            module: &shader.0,
            entry_point: Some("fs_main"),
            compilation_options: Default::default(),
            targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
