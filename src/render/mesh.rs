//! The drawer of surfaces: crowns, trunks, branches, leaves.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::Zeroable;
use glam::Vec3;
use image::{Rgba, RgbaImage};

use super::targets::{COLOR, ID, Targets, color_attachment, depth_attachment, nearer};
use crate::Result;
use crate::geom::Bounds;
use crate::gpu::{Gpu, KeptBuffer, Shader, Target, layout, upload_buffer, upload_mips};
use crate::model::{Growth, GrowthProfile, Material, Part, Wrap, bounds};
use crate::raster::mip_chain;

/// A tree on the device.
#[derive(Debug)]
pub struct Tree {
    parts: Vec<DrawnPart>,
    bounds: Option<Bounds>,
    triangles: usize,
    crowns: Vec<CrownShape>,
    growth: Growth,
}

/// What growth has to know of a crown; object space, metres.
#[derive(Debug, Clone, Copy)]
pub struct CrownShape {
    /// From where all of it is seen.
    pub center: Vec3,
    /// Half axes of the ellipsoid that is like it.
    pub half_axes: Vec3,
    /// The box around it.
    pub bounds: Bounds,
}

impl CrownShape {
    fn of(part: &Part) -> Option<Self> {
        let (center, bounds) = (part.crown_center?, part.surface.mesh.bounds()?);
        let half_axes = (0.5 * bounds.size()).max(Vec3::splat(1e-4));
        Some(Self { center, half_axes, bounds })
    }
}

impl Tree {
    /// The same tree, whose outlines grow so.
    pub fn growing(self, growth: Growth) -> Self {
        Self { growth, ..self }
    }

    /// How its outlines grow.
    pub fn growth(&self) -> Growth {
        self.growth
    }

    /// Its sphere-board crowns.
    pub fn crowns(&self) -> &[CrownShape] {
        &self.crowns
    }

    /// The box around it, object space; `None` for a tree of nothing.
    pub fn bounds(&self) -> Option<Bounds> {
        self.bounds
    }

    /// Triangles of one instance.
    pub fn triangles(&self) -> usize {
        self.triangles
    }
}

/// One part on the device.
#[derive(Debug)]
struct DrawnPart {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    count: u32,
    material: wgpu::BindGroup,
    two_sided: bool,
    cut_out: bool,
}

/// Instances on the device: bytes of the buffer that holds those of the whole frame.
#[derive(Debug)]
pub struct Placed(Range<u64>);

/// All instances of a frame, for one buffer.
#[derive(Debug, Default)]
pub struct Instances(Vec<layout::Instance>);

impl Instances {
    /// Adds those of one tree.
    pub fn place(&mut self, instances: impl Iterator<Item = layout::Instance>) -> Placed {
        let bytes = |instances: &[_]| size_of_val(instances) as u64;
        let begin = bytes(&self.0);
        self.0.extend(instances);
        Placed(begin..bytes(&self.0))
    }
}

/// Draws surfaces, into the temporary buffers and as the sun sees them.
#[derive(Debug)]
pub struct MeshDrawer {
    /// One-sided, two-sided.
    seen: [wgpu::RenderPipeline; 2],
    /// The same as lines, where the adapter can.
    wires: Option<[wgpu::RenderPipeline; 2]>,
    /// For the sun: solid (one-sided, two-sided), cut out (one-sided, two-sided).
    cast: [[wgpu::RenderPipeline; 2]; 2],
    material_layout: wgpu::BindGroupLayout,
    /// Clamped (solid, cut out), repeated (solid, cut out).
    samplers: [[wgpu::Sampler; 2]; 2],
    instances: KeptBuffer,
}

/// Texels along the longer side of a pixel's footprint on solid surfaces: bark is seen aslant, and beyond four nothing more shows. Cut-out
/// ones do without: averages of alpha along the footprint would pass the test less often than the surface does.
const ANISOTROPY: u16 = 4;

impl MeshDrawer {
    /// Compiles its pipelines.
    pub fn new(gpu: &Gpu, frame: &wgpu::BindGroupLayout, sun: &wgpu::BindGroupLayout) -> Self {
        let material_layout = material_layout(gpu);
        let layout = |label, groups: &[Option<&wgpu::BindGroupLayout>]| {
            let descriptor = wgpu::PipelineLayoutDescriptor { label: Some(label), bind_group_layouts: groups, immediate_size: 0 };
            gpu.device.create_pipeline_layout(&descriptor)
        };
        let (mesh, cast) = (Shader::load(gpu, "mesh"), Shader::load(gpu, "cast"));
        let mesh_layout = layout("mesh.layout", &[Some(frame), Some(&material_layout), Some(sun)]);
        let cast_layout = layout("cast.layout", &[Some(frame), Some(&material_layout)]);
        let targets = [Some(COLOR.into()), Some(ID.into())];
        let sides = [Some(wgpu::Face::Back), None];
        let fill = wgpu::PolygonMode::Fill;
        let solid = |cull| pipeline(gpu, "cast.solid", &cast_layout, &cast, None, cull, fill);
        let cut_out = |cull| pipeline(gpu, "cast.cut_out", &cast_layout, &cast, Some(&[]), cull, fill);
        let sampler = |label, mode, anisotropy_clamp| {
            gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some(label),
                address_mode_u: mode,
                address_mode_v: mode,
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                mipmap_filter: wgpu::MipmapFilterMode::Linear,
                anisotropy_clamp,
                ..Default::default()
            })
        };
        let seen = |mode| sides.map(|cull| pipeline(gpu, "mesh.pipeline", &mesh_layout, &mesh, Some(&targets), cull, mode));
        let has_lines = gpu.device.features().contains(wgpu::Features::POLYGON_MODE_LINE);
        Self {
            seen: seen(fill),
            wires: has_lines.then(|| seen(wgpu::PolygonMode::Line)),
            cast: [sides.map(solid), sides.map(cut_out)],
            samplers: [("mesh.clamp", wgpu::AddressMode::ClampToEdge), ("mesh.repeat", wgpu::AddressMode::Repeat)]
                .map(|(label, mode)| [ANISOTROPY, 1].map(|texels| sampler(label, mode, texels))),
            material_layout,
            instances: KeptBuffer::new(gpu, "mesh.instances", wgpu::BufferUsages::VERTEX),
        }
    }

    /// Puts a tree onto the device. Parts that share a picture share its texture.
    pub fn upload(&self, gpu: &Gpu, parts: &[Part]) -> Tree {
        let bounds = bounds(parts);
        let height_m = bounds.map_or(1.0, |b| b.max.y.max(1e-3));
        let drawable = parts.iter().filter(|part| part.surface.mesh.polygon_count() > 0);
        let mut textures = Textures::default();
        let mut crowns = vec![];
        let mut drawn = vec![];
        for part in drawable {
            let crown = CrownShape::of(part);
            crowns.extend(crown);
            let number = if crown.is_some() { crowns.len() as u32 } else { 0 };
            drawn.push(self.upload_part(gpu, part, number, height_m, &mut textures));
        }
        Tree {
            parts: drawn,
            bounds,
            crowns,
            growth: Growth::likely(GrowthProfile::Broadleaf, f64::from(height_m)),
            triangles: parts.iter().map(|part| part.surface.mesh.triangulated().count()).sum(),
        }
    }

    fn upload_part(&self, gpu: &Gpu, part: &Part, crown: u32, tree_height_m: f32, textures: &mut Textures) -> DrawnPart {
        let surface = &part.surface;
        let vertex = |i: usize| layout::Vertex {
            position: surface.mesh.positions[i].to_array(),
            normal: surface.normals.get(i).map_or([0.0, 1.0, 0.0], |n| n.to_array()),
            uv: surface.uvs.get(i).map_or([0.0; 2], |uv| uv.to_array()),
        };
        let vertices: Vec<_> = (0..surface.mesh.positions.len()).map(vertex).collect();
        let indices: Vec<u32> = surface.mesh.triangulated().flatten().collect();
        let buffer = |label, contents, usage| upload_buffer(gpu, label, contents, usage);
        DrawnPart {
            vertices: buffer("mesh.vertices", bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX),
            indices: buffer("mesh.indices", bytemuck::cast_slice(&indices), wgpu::BufferUsages::INDEX),
            count: indices.len() as u32,
            material: self.upload_material(gpu, part, crown, tree_height_m, textures),
            two_sided: part.material.two_sided,
            cut_out: part.material.alpha_cutoff.is_some(),
        }
    }

    /// `number` is that of the crown within its tree, from 1.
    fn upload_material(&self, gpu: &Gpu, part: &Part, number: u32, tree_height_m: f32, textures: &mut Textures) -> wgpu::BindGroup {
        let Material { factor, wrap, alpha_cutoff, two_sided, .. } = &part.material;
        let crown = part.crown_center.and_then(|_| Bounds::of(part.surface.mesh.positions.iter().copied()));
        let half = crown.map_or(Vec3::ONE, |crown| (0.5 * crown.size()).max(Vec3::splat(1e-3)));
        let values = layout::Material {
            factor: *factor,
            crown_center: part.crown_center.unwrap_or_default().to_array(),
            alpha_cutoff: alpha_cutoff.unwrap_or(0.0),
            grows: number,
            two_sided: u32::from(*two_sided),
            crown_reach: [half.x.max(half.z), half.y],
            tree_height_m,
            // Only leaves are cut out of what they are painted on.
            foliage: f32::from(u8::from(alpha_cutoff.is_some())),
            ..layout::Material::zeroed()
        };
        let buffer = upload_buffer(gpu, "mesh.material", bytemuck::bytes_of(&values), wgpu::BufferUsages::STORAGE);
        let view = textures.view(gpu, &part.material);
        let sampler = &self.samplers[usize::from(*wrap == Wrap::Repeat)][usize::from(alpha_cutoff.is_some())];
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("mesh.material"),
            layout: &self.material_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&view) },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Sampler(sampler) },
            ],
        })
    }

    /// Puts the instances of a frame onto the device.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) when memory runs out.
    pub fn fill(&mut self, gpu: &Gpu, instances: &Instances) -> Result<()> {
        self.instances.fill(gpu, bytemuck::cast_slice(&instances.0)).map(|_| ())
    }

    /// Draws trees into the temporary colour, depth and id buffers, lit through the map of `sun`.
    pub fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &wgpu::BindGroup,
        sun: &wgpu::BindGroup,
        targets: &Targets,
        trees: &[(&Tree, Placed)],
        wireframe: bool,
    ) {
        let pipelines = self.wires.as_ref().filter(|_| wireframe).unwrap_or(&self.seen);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("trees"),
            color_attachments: &[
                color_attachment(&targets.tree_color, Some(wgpu::Color::TRANSPARENT)),
                color_attachment(&targets.tree_id, Some(wgpu::Color::TRANSPARENT)),
            ],
            depth_stencil_attachment: Some(depth_attachment(&targets.tree_depth, true)),
            ..Default::default()
        });
        pass.set_bind_group(0, frame, &[]);
        pass.set_bind_group(2, sun, &[]);
        draw_parts(&mut pass, self.instances.get(), trees, |part| &pipelines[usize::from(part.two_sided)]);
    }

    /// Draws trees into the sun's map.
    pub fn cast(&self, encoder: &mut wgpu::CommandEncoder, frame: &wgpu::BindGroup, map: &Target, trees: &[(&Tree, Placed)]) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow"),
            depth_stencil_attachment: Some(depth_attachment(map, true)),
            ..Default::default()
        });
        pass.set_bind_group(0, frame, &[]);
        draw_parts(&mut pass, self.instances.get(), trees, |part| {
            &self.cast[usize::from(part.cut_out)][usize::from(part.two_sided)]
        });
    }
}

fn draw_parts<'a>(
    pass: &mut wgpu::RenderPass,
    instances: &wgpu::Buffer,
    trees: &'a [(&Tree, Placed)],
    pipeline: impl Fn(&'a DrawnPart) -> &'a wgpu::RenderPipeline,
) {
    for (tree, Placed(bytes)) in trees.iter().filter(|(_, placed)| !placed.0.is_empty()) {
        let count = (bytes.end - bytes.start) / size_of::<layout::Instance>() as u64;
        pass.set_vertex_buffer(1, instances.slice(bytes.clone()));
        for part in &tree.parts {
            pass.set_pipeline(pipeline(part));
            pass.set_bind_group(1, &part.material, &[]);
            pass.set_vertex_buffer(0, part.vertices.slice(..));
            pass.set_index_buffer(part.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..part.count, 0, 0..count as u32);
        }
    }
}

/// The textures of a tree's parts, each uploaded once for each share of alpha that its smaller sizes keep.
#[derive(Default)]
struct Textures(Vec<(Arc<RgbaImage>, Option<f32>, wgpu::TextureView)>);

impl Textures {
    fn view(&mut self, gpu: &Gpu, material: &Material) -> wgpu::TextureView {
        let Some(picture) = &material.texture else {
            return upload_mips(gpu, "mesh.plain", &[RgbaImage::from_pixel(1, 1, Rgba([255; 4]))]);
        };
        // The cutoff tests the product of texture and factor.
        let cutoff = material.alpha_cutoff.map(|cutoff| cutoff / material.factor[3].max(1e-3));
        if let Some((_, _, view)) = self.0.iter().find(|(known, its, _)| Arc::ptr_eq(known, picture) && *its == cutoff) {
            return view.clone();
        }
        let view = upload_mips(gpu, "mesh.texture", &mip_chain(picture, cutoff));
        self.0.push((picture.clone(), cutoff, view.clone()));
        view
    }
}

/// A pipeline that keeps what is nearer; without targets it has no fragment stage and draws depth alone.
fn pipeline(
    gpu: &Gpu,
    label: &'static str,
    layout: &wgpu::PipelineLayout,
    shader: &Shader,
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
            buffers: &[Some(layout::Vertex::LAYOUT), Some(layout::Instance::LAYOUT)],
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

fn material_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let values = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only: true },
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("mesh.material"),
        entries: &[
            entry(0, wgpu::ShaderStages::VERTEX_FRAGMENT, values),
            entry(1, wgpu::ShaderStages::FRAGMENT, texture),
            entry(2, wgpu::ShaderStages::FRAGMENT, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
        ],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::testing::software_gpu;

    #[test]
    fn parts_share_a_texture_only_where_its_smaller_sizes_keep_the_same_alpha() {
        let Some(gpu) = software_gpu() else { return };
        let picture = Arc::new(RgbaImage::from_fn(8, 8, |x, _| Rgba([90, 120, 30, 30 * x as u8])));
        let cut_out = Material { texture: Some(picture), alpha_cutoff: Some(0.3), ..Material::default() };
        let paler = Material { factor: [1.0, 1.0, 1.0, 0.5], ..cut_out.clone() };
        let mut textures = Textures::default();
        let views = [&cut_out, &paler, &cut_out].map(|material| textures.view(&gpu, material));
        assert!(views[0] == views[2] && views[0] != views[1]);
    }
}
