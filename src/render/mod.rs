//! Drawing trees with wgpu (She §2.3, §3.3–3.5). One frame, as fig. 14 has it:
//!
//! ```text
//! backdrop ─▶ frame colour + depth ◀──composite by depth── temporary colour + depth + id ◀── trees
//!                      │                                              ▲
//!                      ▼                                       growth of outlines
//!                 anti-alias ─▶ picture
//! ```
//!
//! Everything that is drawn comes as [`crate::model::Part`]s; uploaded once as a [`Tree`], it is placed any number of times.

mod backdrop;
mod camera;
mod composite;
mod growth;
mod limb;
mod mesh;
mod targets;
mod tiles;

use glam::{Mat4, Vec3};
use image::RgbaImage;

use crate::geom::Bounds;
use crate::gpu::{Gpu, layout, read_texture};
use crate::model::Part;
use crate::{Error, Result};

pub use camera::{Camera, FOV_Y_RAD, Projection};
pub use growth::{GrowthChoice, GrowthEdges, GrowthInput, GrowthKeys, GrowthParams, GrowthRoots};
pub use mesh::{CrownShape, Tree};

use backdrop::Backdrop;
use composite::Composite;
use growth::GrowthPass;
use mesh::MeshDrawer;
use targets::Targets;

crate::choices! {
    /// How far the picture is taken: She fig. 15 b to e.
    pub enum Stage {
        /// The surfaces as they are.
        Unshaped = "unshaped",
        /// With grown outlines.
        Reshaped = "reshaped",
        /// And smoothed edges.
        Antialiased = "antialiased",
        /// And light: sun, sky and shadows.
        Lit = "lit",
    }
}

crate::choices! {
    /// What stands behind the trees.
    pub enum Background {
        /// Sky above level ground.
        Sky = "sky",
        /// Nothing, black.
        Black = "black",
        /// Nothing, white.
        White = "white",
        /// Nothing at all: the picture is transparent there.
        Alpha = "alpha",
    }
}

/// One picture to be taken.
#[derive(Debug, Clone)]
pub struct Shot {
    /// From where.
    pub camera: Camera,
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// How far it is taken.
    pub stage: Stage,
    /// What stands behind the trees.
    pub background: Background,
    /// Towards the sun, any length but zero.
    pub toward_sun: Vec3,
    /// How outlines grow.
    pub growth: GrowthParams,
    /// Number of the frame: only [`GrowthKeys::Random`] asks for it.
    pub frame: u32,
}

/// A tree and where it stands, as often as it stands there.
#[derive(Debug)]
pub struct Stand<'a> {
    /// What is drawn.
    pub tree: &'a Tree,
    /// Where.
    pub instances: &'a [layout::Instance],
}

/// A picture taken.
#[derive(Debug, Clone)]
pub struct Picture {
    /// sRGB, straight alpha.
    pub color: RgbaImage,
    /// Distance from the viewer's plane, metres, row by row from the top left; infinity where nothing is.
    pub depth_m: Vec<f32>,
}

/// Draws frames. Owns the device and every pipeline.
#[derive(Debug)]
pub struct Renderer {
    /// The device.
    pub gpu: Gpu,
    frame: wgpu::Buffer,
    frame_group: wgpu::BindGroup,
    backdrop: Backdrop,
    meshes: MeshDrawer,
    composite: Composite,
    growth: GrowthPass,
    crowns: wgpu::Buffer,
    targets: Option<Targets>,
}

impl Renderer {
    /// Compiles all pipelines.
    ///
    /// # Errors
    /// [`Error::Device`] when the driver refuses one.
    pub fn new(gpu: Gpu) -> Result<Self> {
        let frame_layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("frame.layout"),
            entries: &[
                buffer_entry(0, wgpu::BufferBindingType::Uniform),
                buffer_entry(8, wgpu::BufferBindingType::Storage { read_only: true }),
            ],
        });
        let frame = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame.uniform"),
            size: size_of::<layout::Frame>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let crowns = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame.crowns"),
            size: (growth::SLOTS * size_of::<layout::GrowingCrown>()) as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let frame_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("frame.group"),
            layout: &frame_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: frame.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 8, resource: crowns.as_entire_binding() },
            ],
        });
        let backdrop = Backdrop::new(&gpu, &frame_layout);
        let meshes = MeshDrawer::new(&gpu, &frame_layout);
        let composite = Composite::new(&gpu);
        let growth = GrowthPass::new(&gpu);
        gpu.check()?;
        Ok(Self { gpu, frame, frame_group, backdrop, meshes, composite, growth, crowns, targets: None })
    }

    /// Puts the parts of a tree onto the device.
    ///
    /// # Errors
    /// [`Error::Device`] when they do not fit.
    pub fn upload(&self, parts: &[Part]) -> Result<Tree> {
        let tree = self.meshes.upload(&self.gpu, parts);
        self.gpu.check()?;
        Ok(tree)
    }

    /// Takes a picture and reads it back.
    ///
    /// # Errors
    /// [`Error::PictureSize`] for one without extent or beyond the device's limit, [`Error::Device`] when the device fails.
    pub fn picture(&mut self, shot: &Shot, stands: &[Stand]) -> Result<Picture> {
        self.draw(shot, stands)?;
        let targets = self.targets.as_ref().expect("draw makes them");
        let mut color = read_texture(&self.gpu, &targets.frame_color.texture)?;
        if shot.background == Background::Alpha {
            composite::make_straight(&mut color);
        }
        let depth = read_texture(&self.gpu, &targets.frame_depth.texture)?;
        let [width, height] = shot.size_px;
        let depth_m = depth.chunks_exact(4).map(|b| shot.camera.distance_m(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))).collect();
        let color = RgbaImage::from_raw(width, height, color).expect("as many bytes as the target has pixels");
        Ok(Picture { color, depth_m })
    }

    /// Draws a frame into the targets.
    fn draw(&mut self, shot: &Shot, stands: &[Stand]) -> Result<()> {
        self.resize(shot.size_px)?;
        let targets = self.targets.as_ref().expect("just made");
        let bounds = scene_bounds(stands);
        self.gpu.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&frame_of(shot, bounds)));
        let growing = GrowthInput::new(shot, stands, &self.growth.twigs);
        self.gpu.queue.write_buffer(&self.crowns, 0, bytemuck::cast_slice(&growing.crowns));
        let placed = |(stand, slots): (&Stand, &Vec<u32>)| {
            let placed: Vec<_> =
                stand.instances.iter().zip(slots).map(|(place, slot)| layout::Instance { extra: *slot, ..*place }).collect();
            self.meshes.place(&self.gpu, &placed)
        };
        let drawn: Vec<_> = stands.iter().zip(&growing.slots).map(|pair| (pair.0.tree, placed(pair))).collect();
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
        self.backdrop.draw(&mut encoder, &self.frame_group, targets, shot.background);
        self.meshes.draw(&mut encoder, &self.frame_group, targets, &drawn);
        self.growth.draw(&self.gpu, &mut encoder, targets, &growing, &self.crowns)?;
        let smooth = matches!(shot.stage, Stage::Antialiased | Stage::Lit);
        self.composite.draw(&self.gpu, &mut encoder, targets, &growing.tree_tiles, smooth);
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.check()
    }

    fn resize(&mut self, size_px: [u32; 2]) -> Result<()> {
        let limit = self.gpu.device.limits().max_texture_dimension_2d;
        if !size_px.iter().all(|side| (1..=limit).contains(side)) {
            return Err(Error::PictureSize { found: size_px, limit });
        }
        if self.targets.as_ref().is_none_or(|targets| targets.size_px != size_px) {
            self.targets = None; // the old ones go before the new ones come
            self.targets = Some(Targets::new(&self.gpu, size_px));
            self.gpu.check()?;
        }
        Ok(())
    }
}

fn buffer_entry(binding: u32, ty: wgpu::BufferBindingType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    }
}

/// The box around everything placed.
fn scene_bounds(stands: &[Stand]) -> Option<Bounds> {
    let corners =
        stands.iter().filter_map(|stand| Some((stand.tree.bounds()?, stand.instances))).flat_map(|(bounds, instances)| {
            let radius = bounds.min.abs().max(bounds.max.abs()).length();
            instances.iter().flat_map(move |i| {
                let (at, reach) = (Vec3::from(i.position), Vec3::splat(radius * i.scale));
                [at - reach, at + reach]
            })
        });
    Bounds::of(corners)
}

fn frame_of(shot: &Shot, bounds: Option<Bounds>) -> layout::Frame {
    let [width, height] = shot.size_px;
    let clip_from_world = shot.camera.clip_from_world(width as f32 / height as f32);
    layout::Frame {
        clip_from_world: clip_from_world.to_cols_array_2d(),
        world_from_clip: clip_from_world.inverse().to_cols_array_2d(),
        sun_clip_from_world: Mat4::IDENTITY.to_cols_array_2d(),
        eye: shot.camera.eye.to_array(),
        time_s: 0.0,
        toward_sun: shot.toward_sun.normalize_or(Vec3::Y).to_array(),
        lit: if shot.stage == Stage::Lit { 1.0 } else { 0.0 },
        sun_color: [0.9, 0.85, 0.75],
        wind_m_per_s: 0.0,
        sky_color: [0.5, 0.55, 0.65],
        ground_m: bounds.map_or(0.0, |_| 0.0),
        ground_color: [0.2, 0.2, 0.15],
        background: shot.background as u32,
        size_px: [width as f32, height as f32],
        px_per_m: shot.camera.px_per_m(height),
    }
}
