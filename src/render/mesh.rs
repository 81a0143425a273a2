//! The drawer of surfaces: crowns, trunks, branches, leaves, cards that stand or turn.

use super::drawer::{Drawer, PassKind};
use super::part::DevicePart;
use super::placing::{Groups, Placing};
use super::scene::Scene;
use super::targets::{COLOR, ID, nearer};
use crate::gpu::{Gpu, Shader};

/// Draws surfaces.
#[derive(Debug)]
pub struct MeshDrawer {
    /// Of trees that are placed one by one.
    each: Pipelines,
    /// Of those of a crowd.
    many: Pipelines,
}

/// Pipelines for one way of placing trees.
#[derive(Debug)]
struct Pipelines {
    /// One-sided, two-sided.
    seen: [wgpu::RenderPipeline; 2],
    /// The same as lines, where the adapter can.
    wires: Option<[wgpu::RenderPipeline; 2]>,
    /// For the sun: solid (one-sided, two-sided), pierced (one-sided, two-sided).
    cast: [[wgpu::RenderPipeline; 2]; 2],
}

impl MeshDrawer {
    /// Compiles its pipelines.
    pub fn new(gpu: &Gpu, groups: &Groups) -> Self {
        Self { each: Pipelines::new(gpu, groups, Placing::Each), many: Pipelines::new(gpu, groups, Placing::Many) }
    }
}

impl Pipelines {
    fn new(gpu: &Gpu, groups: &Groups, placing: Placing) -> Self {
        let [mesh, cast] = placing.shaders(gpu, [["mesh", "mesh_of_many"], ["cast", "cast_of_many"]]);
        let mesh_layout = groups.layout(gpu, "mesh.layout", placing, true);
        let cast_layout = groups.layout(gpu, "cast.layout", placing, false);
        let sides = [Some(wgpu::Face::Back), None];
        let fill = wgpu::PolygonMode::Fill;
        let buffers = placing.buffers();
        let solid = |cull| pipeline_of(gpu, "cast.solid", &cast_layout, &cast, &buffers, None, cull, fill);
        let pierced = |cull| pipeline_of(gpu, "cast.pierced", &cast_layout, &cast, &buffers, Some(&[]), cull, fill);
        let seen =
            |mode| sides.map(|cull| pipeline_of(gpu, "mesh.pipeline", &mesh_layout, &mesh, &buffers, Some(&TARGETS), cull, mode));
        let has_lines = gpu.device.features().contains(wgpu::Features::POLYGON_MODE_LINE);
        Self {
            seen: seen(fill),
            wires: has_lines.then(|| seen(wgpu::PolygonMode::Line)),
            cast: [sides.map(solid), sides.map(pierced)],
        }
    }

    fn of(&self, part: &DevicePart, kind: PassKind) -> &wgpu::RenderPipeline {
        let side = usize::from(part.two_sided);
        match kind {
            PassKind::Shadow => &self.cast[usize::from(part.pierced)][side],
            PassKind::Temporary { wireframe } => &self.wires.as_ref().filter(|_| wireframe).unwrap_or(&self.seen)[side],
        }
    }
}

impl Drawer for MeshDrawer {
    fn draw(&self, pass: &mut wgpu::RenderPass, scene: &Scene, kind: PassKind) {
        for placed in scene.trees(kind) {
            for part in placed.tree.meshes() {
                let Some((bytes, count)) = placed.placed(part.group) else { continue };
                pass.set_vertex_buffer(1, scene.instances.slice(bytes));
                pass.set_pipeline(self.each.of(part, kind));
                part.draw(pass, count);
            }
        }
        if let Some(crowd) = scene.crowd {
            crowd.draw(pass, kind, false, |pass, part| pass.set_pipeline(self.many.of(part, kind)));
        }
    }
}

/// What the temporary pass draws into.
pub const TARGETS: [Option<wgpu::ColorTargetState>; 2] = [
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
