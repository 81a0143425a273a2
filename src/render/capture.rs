//! Pictures for stand-ins taken by the device (DESIGN §4, "Capture"): the same as the software rasteriser's but for how edges are
//! rounded, and quicker. Colour without light, covered parts of pixels, depth and normals of object space, in parallel projection.

use glam::{Mat4, Vec3, Vec4};
use image::{GrayImage, Luma, Rgba, RgbaImage};

use super::mesh::{pipeline_layout, pipeline_of};
use super::part::{DevicePart, PartStore, PlaceInTree, Textures};
use super::screen::ScreenPipeline;
use super::targets::{COLOR, DEPTH, color_attachment, depth_attachment};
use crate::Result;
use crate::geom::Bounds;
use crate::gpu::layout::{self, CAPTURE_SAMPLES};
use crate::gpu::{Gpu, Shader, Target, read_texture, target, upload_buffer};
use crate::model::Part;
use crate::raster::{self, View};
use crate::repr::{Capture, Drawn, Seen};

/// Takes pictures on a device.
#[derive(Debug)]
pub struct GpuCapture<'a> {
    gpu: &'a Gpu,
    store: PartStore,
    view_layout: wgpu::BindGroupLayout,
    /// One-sided, two-sided.
    samples: [wgpu::RenderPipeline; 2],
    resolve: wgpu::RenderPipeline,
}

/// Side of what is drawn at once, pixels: its samples take 40 MB.
const TILE_PX: u32 = 512;
const NORMAL: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
const SURFACE: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

impl<'a> GpuCapture<'a> {
    /// Compiles its pipelines.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) when the driver refuses one.
    pub fn new(gpu: &'a Gpu) -> Result<Self> {
        let store = PartStore::new(gpu);
        let view_layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("capture.view"),
            entries: &[super::buffer_entry(0, wgpu::BufferBindingType::Storage { read_only: true })],
        });
        let layout = pipeline_layout(gpu, "capture.layout", &[&view_layout, &store.layout]);
        let shader = Shader::load(gpu, "capture");
        let (buffers, targets) = ([Some(layout::Vertex::LAYOUT)], [Some(COLOR.into()), Some(NORMAL.into())]);
        let samples = [Some(wgpu::Face::Back), None].map(|cull| {
            let fill = wgpu::PolygonMode::Fill;
            pipeline_of(gpu, "capture.samples", &layout, &shader, &buffers, Some(&targets), cull, fill)
        });
        let (shader, targets) = (Shader::load(gpu, "capture_resolve"), [Some(COLOR.into()), Some(SURFACE.into())]);
        let resolve = ScreenPipeline::new("capture.resolve", &shader, &targets).compiled(gpu);
        gpu.check()?;
        Ok(Self { gpu, store, view_layout, samples, resolve })
    }

    fn upload(&self, parts: &[&Part]) -> Vec<DevicePart> {
        let mut textures = Textures::averaged();
        let place = PlaceInTree { bounds: Bounds { min: Vec3::ZERO, max: Vec3::ONE }, crown: 0, group: 0 };
        let there = parts.iter().filter(|part| part.surface.mesh.polygon_count() > 0);
        let upload = |part| self.store.upload(self.gpu, part, (&Drawn::Still, &Seen::default()), place, &mut textures);
        there.copied().map(upload).collect()
    }

    /// One picture, tile by tile.
    fn picture(&self, targets: &Tile, parts: &[DevicePart], view: &View, deep_m: [f32; 2]) -> Result<raster::Capture> {
        let (width, height) = (view.width_px, view.height_px);
        let count = width as usize * height as usize;
        let mut taken = raster::Capture {
            color: RgbaImage::new(width, height),
            depth_m: vec![f32::NEG_INFINITY; count],
            normal: vec![Vec3::ZERO; count],
            coverage: GrayImage::new(width, height),
        };
        for top in (0..height).step_by(TILE_PX as usize) {
            for left in (0..width).step_by(TILE_PX as usize) {
                self.draw(targets, parts, clip_from_object(view, [left, top], deep_m), deep_m);
                let color = read_texture(self.gpu, &targets.color.texture)?;
                let surface = read_texture(self.gpu, &targets.surface.texture)?;
                for y in 0..TILE_PX.min(height - top) {
                    for x in 0..TILE_PX.min(width - left) {
                        let at = (y * TILE_PX + x) as usize;
                        put(&mut taken, [left + x, top + y], &color[4 * at..][..4], &surface[16 * at..][..16]);
                    }
                }
            }
        }
        Ok(taken)
    }

    fn draw(&self, targets: &Tile, parts: &[DevicePart], clip_from_object: Mat4, [far, near]: [f32; 2]) {
        let values = layout::CaptureView {
            clip_from_object: clip_from_object.to_cols_array_2d(),
            far_m: far,
            deep_m: near - far,
            pad: [0.0; 2],
        };
        let buffer = upload_buffer(self.gpu, "capture.values", bytemuck::bytes_of(&values), wgpu::BufferUsages::STORAGE);
        let group = self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("capture.view"),
            layout: &self.view_layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
        });
        let nothing = Some(wgpu::Color::TRANSPARENT);
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("capture") });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("capture"),
            color_attachments: &[color_attachment(&targets.colors, nothing), color_attachment(&targets.normals, nothing)],
            depth_stencil_attachment: Some(depth_attachment(&targets.depths, true)),
            ..Default::default()
        });
        pass.set_bind_group(0, &group, &[]);
        for part in parts {
            pass.set_pipeline(&self.samples[usize::from(part.two_sided)]);
            part.draw(&mut pass, 1);
        }
        drop(pass);
        let group = self.resolve_group(targets, &buffer);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("capture.resolve"),
            color_attachments: &[color_attachment(&targets.color, nothing), color_attachment(&targets.surface, nothing)],
            ..Default::default()
        });
        pass.set_pipeline(&self.resolve);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        self.gpu.queue.submit([encoder.finish()]);
    }

    fn resolve_group(&self, targets: &Tile, view: &wgpu::Buffer) -> wgpu::BindGroup {
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("capture.samples"),
            layout: &self.resolve.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: view.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&targets.colors.view) },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(&targets.normals.view) },
                wgpu::BindGroupEntry { binding: 3, resource: wgpu::BindingResource::TextureView(&targets.depths.view) },
            ],
        })
    }
}

impl Capture for GpuCapture<'_> {
    fn take(&self, parts: &[&Part], views: &[View]) -> Result<Vec<raster::Capture>> {
        views.iter().try_for_each(View::check)?;
        let uploaded = self.gpu.guarded(|| self.upload(parts))?;
        let targets = self.gpu.guarded(|| Tile::new(self.gpu))?;
        let taken = views.iter().map(|view| self.picture(&targets, &uploaded, view, slab(parts, view)));
        let taken = taken.collect::<Result<_>>()?;
        self.gpu.check().map(|()| taken)
    }
}

/// What a tile is drawn into.
#[derive(Debug)]
struct Tile {
    colors: Target,
    normals: Target,
    depths: Target,
    color: Target,
    surface: Target,
}

impl Tile {
    fn new(gpu: &Gpu) -> Self {
        let samples = [TILE_PX * CAPTURE_SAMPLES; 2];
        Self {
            colors: target(gpu, "capture.colors", samples, COLOR),
            normals: target(gpu, "capture.normals", samples, NORMAL),
            depths: target(gpu, "capture.depths", samples, DEPTH),
            color: target(gpu, "capture.color", [TILE_PX; 2], COLOR),
            surface: target(gpu, "capture.surface", [TILE_PX; 2], SURFACE),
        }
    }
}

/// Writes a pixel as the device has it: colour bytes, and four numbers of its surface.
fn put(taken: &mut raster::Capture, [x, y]: [u32; 2], color: &[u8], surface: &[u8]) {
    let &[r, g, b, a] = color else { return };
    if a == 0 {
        return;
    }
    let number = |i: usize| f32::from_le_bytes([surface[4 * i], surface[4 * i + 1], surface[4 * i + 2], surface[4 * i + 3]]);
    let at = (y * taken.color.width() + x) as usize;
    taken.color.put_pixel(x, y, Rgba([r, g, b, a]));
    taken.coverage.put_pixel(x, y, Luma([a]));
    taken.normal[at] = Vec3::new(number(0), number(1), number(2)).normalize_or(Vec3::Y);
    taken.depth_m[at] = number(3);
}

/// Between which distances towards the viewer depth is kept: the view's slab, as far as there is anything in it.
fn slab(parts: &[&Part], view: &View) -> [f32; 2] {
    let along = parts.iter().flat_map(|part| &part.surface.mesh.positions).map(|p| (*p - view.center).dot(view.axes[2]));
    let [low, high] = along.fold([f32::MAX, f32::MIN], |[low, high], d| [low.min(d), high.max(d)]);
    // A little more, so that what lies on the last plane is not taken for nothing.
    let more = 1e-4 * (high - low).max(1e-2);
    let [far, near] = [(low - more).max(view.slab_m[0]), (high + more).min(view.slab_m[1])];
    if far < near { [far, near] } else { [far, far + 1e-3] }
}

/// Object space to the clip space of the tile whose first pixel is `first`.
fn clip_from_object(view: &View, first: [u32; 2], [far, near]: [f32; 2]) -> Mat4 {
    let [right, up, toward] = view.axes;
    let tiles = [view.width_px, view.height_px].map(|side| side as f32 / TILE_PX as f32);
    // Of the tile's middle, in half sizes of the view.
    let middle = |i: usize, side: u32| (2.0 * first[i] as f32 + TILE_PX as f32) / side as f32 - 1.0;
    let (x, y) = (tiles[0] * right / view.half_size_m.x, tiles[1] * up / view.half_size_m.y);
    let z = toward / (near - far);
    let offset = Vec4::new(
        -x.dot(view.center) - tiles[0] * middle(0, view.width_px),
        -y.dot(view.center) + tiles[1] * middle(1, view.height_px),
        -z.dot(view.center) - far / (near - far),
        1.0,
    );
    Mat4::from_cols(Vec4::new(x.x, y.x, z.x, 0.0), Vec4::new(x.y, y.y, z.y, 0.0), Vec4::new(x.z, y.z, z.z, 0.0), offset)
}
