//! A part on the device: vertices, textures, what it is made of and when it is seen. The same for every drawer.

use std::sync::Arc;

use bytemuck::Zeroable;
use glam::Vec3;
use image::{Rgba, RgbaImage};

use super::pipelines::PartTraits;
use crate::geom::Bounds;
use crate::gpu::{Gpu, layout, upload_buffer, upload_mips};
use crate::model::{Material, Part, Wrap};
use crate::raster::mip_chain;
use crate::repr::{Drawn, Facing, Fade, Seen};

/// One part on the device.
#[derive(Debug)]
pub struct DevicePart {
    /// [`layout::Vertex`] each.
    pub vertices: wgpu::Buffer,
    /// Three to a triangle.
    pub indices: wgpu::Buffer,
    /// How many.
    pub count: u32,
    /// Group 1 of every drawer: see `shaders/shared/part.wgsl`.
    pub material: wgpu::BindGroup,
    /// Backs are drawn too.
    pub two_sided: bool,
    /// What its shaders are made for.
    pub traits: PartTraits,
    /// It has holes, or fades: its fragments have to be asked whether they are there.
    pub pierced: bool,
    /// Which of the tree's groups it belongs to.
    pub group: usize,
}

impl DevicePart {
    /// Binds what it consists of, so that it can be drawn.
    pub fn bind(&self, pass: &mut wgpu::RenderPass) {
        pass.set_bind_group(1, &self.material, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
    }

    /// Draws it at `count` instances whose buffer is set.
    pub fn draw(&self, pass: &mut wgpu::RenderPass, count: u32) {
        self.bind(pass);
        pass.draw_indexed(0..self.count, 0, 0..count);
    }
}

/// What a part is in its tree.
#[derive(Debug, Clone, Copy)]
pub struct PlaceInTree {
    /// Of the whole tree.
    pub bounds: Bounds,
    /// Number of its crown, from 1; 0 where it is none.
    pub crown: u32,
    /// See [`DevicePart::group`].
    pub group: usize,
}

/// Puts parts onto the device.
#[derive(Debug)]
pub struct PartStore {
    /// Of group 1.
    pub layout: wgpu::BindGroupLayout,
    /// Clamped (solid, cut out), repeated (solid, cut out).
    samplers: [[wgpu::Sampler; 2]; 2],
}

/// Texels along the longer side of a pixel's footprint on solid surfaces: bark is seen aslant, and beyond four nothing more shows. Cut-out
/// ones do without: averages of alpha along the footprint would pass the test less often than the surface does. So do software drivers: they
/// walk every texel under the footprint, and that of one triangle seen edge-on took Mesa 22.3 fourteen seconds.
const ANISOTROPY: u16 = 4;

impl PartStore {
    /// Its samplers and layout.
    pub fn new(gpu: &Gpu) -> Self {
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
        let aslant = if gpu.info.device_type == wgpu::DeviceType::Cpu { 1 } else { ANISOTROPY };
        Self {
            layout: material_layout(gpu),
            samplers: [("part.clamp", wgpu::AddressMode::ClampToEdge), ("part.repeat", wgpu::AddressMode::Repeat)]
                .map(|(label, mode)| [aslant, 1].map(|texels| sampler(label, mode, texels))),
        }
    }

    /// Puts a part onto the device, placed and seen like that.
    pub fn upload(
        &self,
        gpu: &Gpu,
        part: &Part,
        (drawn, seen): (&Drawn, &Seen),
        place: PlaceInTree,
        textures: &mut Textures,
    ) -> DevicePart {
        let surface = &part.surface;
        let vertex = |i: usize| layout::Vertex {
            position: surface.mesh.positions[i].to_array(),
            normal: surface.normals.get(i).map_or([0.0, 1.0, 0.0], |n| n.to_array()),
            uv: surface.uvs.get(i).map_or([0.0; 2], |uv| uv.to_array()),
        };
        let vertices: Vec<_> = (0..surface.mesh.positions.len()).map(vertex).collect();
        let indices: Vec<u32> = surface.mesh.triangulated().flatten().collect();
        let buffer = |label, contents, usage| upload_buffer(gpu, label, contents, usage);
        DevicePart {
            vertices: buffer(
                "part.vertices",
                bytemuck::cast_slice(&vertices),
                wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_SRC,
            ),
            indices: buffer(
                "part.indices",
                bytemuck::cast_slice(&indices),
                wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_SRC,
            ),
            count: indices.len() as u32,
            material: self.bind(gpu, part, material_of(part, place), presence_of(drawn, seen), textures),
            two_sided: part.material.two_sided,
            traits: traits_of(part, (drawn, seen), place),
            pierced: part.material.alpha_cutoff.is_some() || !seen.is_always(),
            group: place.group,
        }
    }

    fn bind(
        &self,
        gpu: &Gpu,
        part: &Part,
        material: layout::Material,
        presence: layout::Presence,
        textures: &mut Textures,
    ) -> wgpu::BindGroup {
        let Material { wrap, alpha_cutoff, .. } = &part.material;
        let storage = |label, contents| upload_buffer(gpu, label, contents, wgpu::BufferUsages::STORAGE);
        let material = storage("part.material", bytemuck::bytes_of(&material));
        let presence = storage("part.presence", bytemuck::bytes_of(&presence));
        let (color, normal) = (textures.color(gpu, &part.material), textures.normal(gpu, &part.material));
        let sampler = &self.samplers[usize::from(*wrap == Wrap::Repeat)][usize::from(alpha_cutoff.is_some())];
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("part.material"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: material.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&color) },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Sampler(sampler) },
                wgpu::BindGroupEntry { binding: 3, resource: wgpu::BindingResource::TextureView(&normal) },
                wgpu::BindGroupEntry { binding: 4, resource: presence.as_entire_binding() },
            ],
        })
    }
}

fn material_of(part: &Part, PlaceInTree { bounds: tree, crown, .. }: PlaceInTree) -> layout::Material {
    let Material { factor, alpha_cutoff, .. } = &part.material;
    let box_of_crown = part.crown_center.and_then(|_| part.surface.mesh.bounds());
    let half = box_of_crown.map_or(Vec3::ONE, |crown| (0.5 * crown.size()).max(Vec3::splat(1e-3)));
    layout::Material {
        factor: *factor,
        crown_center: part.crown_center.unwrap_or_default().to_array(),
        alpha_cutoff: alpha_cutoff.unwrap_or(0.0),
        grows: crown,
        crown_reach: [half.x.max(half.z), half.y],
        tree_height_m: tree.height_m(),
        tree_foot_m: tree.foot_y(),
        tree_center: tree.center().to_array(),
        tree_half: (0.5 * tree.size()).max(Vec3::splat(1e-3)).to_array(),
        ..layout::Material::zeroed()
    }
}

fn traits_of(part: &Part, (drawn, seen): (&Drawn, &Seen), place: PlaceInTree) -> PartTraits {
    let Material { alpha_cutoff, normal_texture, .. } = &part.material;
    PartTraits {
        fade: match seen.fade {
            _ if seen.is_always() => layout::Presence::FADE_NEVER,
            // What has no cutoff to raise is thinned out.
            Fade::Alpha if alpha_cutoff.is_some() => layout::Presence::FADE_ALPHA,
            Fade::Alpha | Fade::Hashed => layout::Presence::FADE_HASHED,
        },
        facing: facing_bits(seen),
        turned: match drawn {
            Drawn::Still | Drawn::Forest(_) => 0,
            Drawn::Turned { upright: true, .. } => layout::Presence::TURNED_UPRIGHT,
            Drawn::Turned { upright: false, .. } | Drawn::Octahedral(_) => layout::Presence::TURNED_WHOLLY,
        },
        // Only leaves are cut out of what they are painted on.
        foliage: alpha_cutoff.is_some(),
        crown: place.crown != 0,
        normal_mapped: normal_texture.is_some(),
        stand_in: is_stand_in(part, place.bounds),
    }
}

/// Side of a polygon in heights of the tree from which on it is a card: a picture of leaves that are elsewhere. Leaves of true trees are
/// far smaller.
const CARD: f32 = 0.04;

/// Whether a part's pictures show leaves that are elsewhere: cut out, with captured normals, of polygons too large for leaves.
fn is_stand_in(part: &Part, tree: Bounds) -> bool {
    let Material { alpha_cutoff, normal_texture, .. } = &part.material;
    let mesh = &part.surface.mesh;
    let area: f32 = mesh
        .triangulated()
        .map(|t| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            0.5 * (b - a).cross(c - a).length()
        })
        .sum();
    let captured = alpha_cutoff.is_some() && normal_texture.is_some() && part.crown_center.is_none();
    captured && area > (CARD * tree.height_m()).powi(2) * mesh.polygon_count() as f32
}

/// From which sides it is seen, as shaders are told: bits.
pub fn facing_bits(seen: &Seen) -> u32 {
    match seen.facing {
        Facing::Any => 0,
        Facing::Sector { .. } => layout::Presence::FACING | layout::Presence::FACING_LEVEL | layout::Presence::FACING_SECTOR,
        Facing::Own { .. } => layout::Presence::FACING | layout::Presence::FACING_OWN | layout::Presence::FACING_BOTH,
        Facing::Toward { level, both_sides, .. } => {
            let bit = |set: bool, bit: u32| if set { bit } else { 0 };
            let level = bit(level, layout::Presence::FACING_LEVEL);
            layout::Presence::FACING | level | bit(both_sides, layout::Presence::FACING_BOTH)
        }
    }
}

/// The same with distances, and how it is drawn.
pub fn presence_of(drawn: &Drawn, seen: &Seen) -> layout::Presence {
    let Seen { anchor, vanish_anchor, appears, vanishes, facing, .. } = *seen;
    let (rises, sinks) = match facing {
        Facing::Sector { rises, sinks, .. } => (rises, sinks),
        _ => ([0.0; 2], [0.0; 2]),
    };
    let (axis, cosines) = match facing {
        Facing::Any => (Vec3::Z, [0.0; 2]),
        Facing::Own { cosines } => (Vec3::Z, cosines),
        Facing::Toward { axis, cosines, .. } | Facing::Sector { axis, cosines, .. } => (axis, cosines),
    };
    let (pivot, grid, radius_m) = match *drawn {
        Drawn::Still | Drawn::Forest(_) => (Vec3::ZERO, 0, 0.0),
        Drawn::Turned { pivot, .. } => (pivot, 0, 0.0),
        Drawn::Octahedral(impostor) => (impostor.center, impostor.grid, impostor.radius_m),
    };
    layout::Presence {
        anchor: anchor.to_array(),
        grid,
        appears,
        vanishes,
        axis: axis.to_array(),
        radius_m,
        pivot: pivot.to_array(),
        pad: 0.0,
        vanish_anchor: vanish_anchor.unwrap_or(anchor).to_array(),
        pad2: 0.0,
        cosines,
        rises,
        sinks,
        pad3: [0.0; 2],
    }
}

/// The textures of a tree's parts, each uploaded once for each share of alpha that its smaller sizes keep.
#[derive(Default)]
pub struct Textures {
    colors: Vec<(Arc<RgbaImage>, Option<f32>, wgpu::TextureView)>,
    normals: Vec<(Arc<RgbaImage>, wgpu::TextureView)>,
    blank: Option<wgpu::TextureView>,
    averaged: bool,
}

impl Textures {
    /// Such whose smaller sizes have the mean alpha, as the software rasteriser's have.
    pub fn averaged() -> Self {
        Self { averaged: true, ..Self::default() }
    }

    fn color(&mut self, gpu: &Gpu, material: &Material) -> wgpu::TextureView {
        let Some(picture) = &material.texture else { return self.blank(gpu) };
        // The cutoff tests the product of texture and factor.
        let cutoff = material.alpha_cutoff.filter(|_| !self.averaged).map(|cutoff| cutoff / material.factor[3].max(1e-3));
        if let Some((_, _, view)) = self.colors.iter().find(|(known, its, _)| Arc::ptr_eq(known, picture) && *its == cutoff) {
            return view.clone();
        }
        let view = upload_mips(gpu, "part.texture", wgpu::TextureFormat::Rgba8UnormSrgb, &mip_chain(picture, cutoff));
        self.colors.push((picture.clone(), cutoff, view.clone()));
        view
    }

    fn normal(&mut self, gpu: &Gpu, material: &Material) -> wgpu::TextureView {
        let Some(picture) = &material.normal_texture else { return self.blank(gpu) };
        if let Some((_, view)) = self.normals.iter().find(|(known, _)| Arc::ptr_eq(known, picture)) {
            return view.clone();
        }
        let view = upload_mips(gpu, "part.normals", wgpu::TextureFormat::Rgba8Unorm, &normal_mips(picture));
        self.normals.push((picture.clone(), view.clone()));
        view
    }

    fn blank(&mut self, gpu: &Gpu) -> wgpu::TextureView {
        let white = RgbaImage::from_pixel(1, 1, Rgba([255; 4]));
        let upload = || upload_mips(gpu, "part.blank", wgpu::TextureFormat::Rgba8UnormSrgb, &[white]);
        self.blank.get_or_insert_with(upload).clone()
    }
}

/// All levels of a picture of numbers, each the average of four texels of the one before. Normals are not made unit length again: where
/// they point everywhere, their mean is short, and the shader takes its direction.
fn normal_mips(picture: &RgbaImage) -> Vec<RgbaImage> {
    let mut levels = vec![picture.clone()];
    loop {
        let fine = &levels[levels.len() - 1];
        let (width, height) = fine.dimensions();
        if width <= 1 && height <= 1 {
            return levels;
        }
        let mean = |x: u32, y: u32| {
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)]
                .map(|(i, j)| fine.get_pixel((2 * x + i).min(width - 1), (2 * y + j).min(height - 1)).0);
            Rgba([0, 1, 2, 3].map(|c| ((four.iter().map(|p| u32::from(p[c])).sum::<u32>() + 2) / 4) as u8))
        };
        levels.push(RgbaImage::from_fn((width / 2).max(1), (height / 2).max(1), mean));
    }
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
        label: Some("part.layout"),
        entries: &[
            entry(0, wgpu::ShaderStages::VERTEX_FRAGMENT, values),
            entry(1, wgpu::ShaderStages::FRAGMENT, texture),
            entry(2, wgpu::ShaderStages::FRAGMENT, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
            entry(3, wgpu::ShaderStages::FRAGMENT, texture),
            entry(4, wgpu::ShaderStages::VERTEX_FRAGMENT, values),
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
        let views = [&cut_out, &paler, &cut_out].map(|material| textures.color(&gpu, material));
        assert!(views[0] == views[2] && views[0] != views[1]);
    }

    #[test]
    fn smaller_normal_maps_are_means() {
        let picture = RgbaImage::from_fn(5, 3, |x, y| Rgba([40 * x as u8, 60 * y as u8, 200, 255]));
        let levels = normal_mips(&picture);
        assert_eq!(levels.iter().map(RgbaImage::dimensions).collect::<Vec<_>>(), [(5, 3), (2, 1), (1, 1)]);
        assert_eq!(levels[1].get_pixel(1, 0).0, [100, 30, 200, 255]);
    }
}
