//! Drawing trees with wgpu (She §2.3, §3.3–3.5). One frame, as fig. 14 has it:
//!
//! ```text
//! backdrop ─▶ frame colour + depth ◀──composite by depth── temporary colour + depth + id ◀── trees
//!                      │                                              ▲
//!                      ▼                                       growth of outlines
//!                 anti-alias ─▶ picture
//! ```
//!
//! Everything that is drawn comes as a [`BuiltTree`], or as plain [`Part`]s that are always seen; uploaded once as a [`Tree`], it is placed
//! any number of times. Each kind of part has its `drawer`.

mod backdrop;
mod bound;
mod camera;
mod capture;
mod cast;
mod composite;
pub mod crowd;
mod drawer;
mod forest;
#[cfg(test)]
mod forest_tests;
mod growth;
mod growth_pass;
#[cfg(test)]
mod growth_twin;
mod impostor;
mod light;
mod limb;
mod mesh;
mod part;
mod pipelines;
mod placing;
mod present;
mod scene;
mod screen;
mod shadow;
mod shot;
mod smoothing;
mod targets;
mod terrain;
mod tiles;
mod tree;
mod wind;
mod world;

use std::time::Instant;

use glam::{Mat4, Vec3};
use image::RgbaImage;

use crate::geom::HeightField;
use crate::gpu::{Gpu, PassClock, Target, layout, read_texture};
use crate::model::Part;
use crate::repr::BuiltTree;
use crate::{Error, Result};

pub use camera::{Camera, FOV_Y_RAD, Projection};
pub use capture::GpuCapture;
pub use crowd::{Batch, Counted, Crowd, CullParams, Culling};
pub use growth::{GrowthChoice, GrowthEdges, GrowthInput, GrowthKeys, GrowthParams, GrowthRoots};
pub use light::LightParams;
pub use present::Window;
pub use shot::{Background, LevelViewer, Shot, Show, Stage};
pub use terrain::Terrain;
pub use tree::{CrownShape, Tree};
pub use wind::WindParams;
pub use world::{Stand, World};

use backdrop::Backdrop;
use cast::Cast;
use composite::Composite;
use drawer::{Drawer, PASSES, PassKind};
use forest::ForestDrawer;
use growth_pass::GrowthPass;
use impostor::ImpostorDrawer;
use light::Light;
use mesh::MeshDrawer;
use part::PartStore;
use placing::Groups;
use scene::Instances;
use shadow::{SunMap, SunView};
use targets::{Targets, color_attachment, depth_attachment};
use wind::Sway;
use world::Placed;

/// A picture taken.
#[derive(Debug, Clone)]
pub struct Picture {
    /// sRGB, straight alpha.
    pub color: RgbaImage,
    /// Distance from the viewer's plane, metres, row by row from the top left; infinity where nothing is.
    pub depth_m: Vec<f32>,
}

/// Most pixels of a picture: its targets and the buffers of growth and smoothing take about 65 bytes a pixel, and reading it back 8.
const MAX_PIXELS: u64 = 16 << 20;

/// Draws frames. Owns the device and every pipeline.
#[derive(Debug)]
pub struct Renderer {
    /// The device.
    pub gpu: Gpu,
    frame: wgpu::Buffer,
    frame_group: wgpu::BindGroup,
    backdrop: Backdrop,
    parts: PartStore,
    groups: Groups,
    instances: Instances,
    meshes: MeshDrawer,
    leaves: ForestDrawer,
    impostors: ImpostorDrawer,
    /// What changes of level have sent for the last frame.
    sent_bytes: u64,
    sun: SunMap,
    composite: Composite,
    growth: GrowthPass,
    crowns: wgpu::Buffer,
    targets: Option<Targets>,
    uploaded_bytes: u64,
    /// Culls crowds on the device, once that was asked for.
    culler: Option<crowd::Culler>,
    /// What the sun's map shows, where that is known.
    cast: Option<Cast>,
    /// Whether the map of trees one by one stays, too, while it shows the same: where nothing is measured.
    keeps_map: bool,
    /// Of all trees, and of those that are no crowd's.
    counted: Counted,
    counted_alone: Counted,
    /// The last frame drew the sun's map.
    map_drawn: bool,
    prepared_ms: f64,
    frame_ms: f64,
    /// Running while a frame is timed.
    clock: Option<PassClock>,
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
                buffer_entry(0, wgpu::BufferBindingType::Storage { read_only: true }),
                buffer_entry(8, wgpu::BufferBindingType::Storage { read_only: true }),
            ],
        });
        let frame = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame.values"),
            size: size_of::<layout::Frame>() as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
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
        let sun = SunMap::new(&gpu, 1);
        let parts = PartStore::new(&gpu);
        let crowd = crowd::group_layout(&gpu);
        let groups = Groups { frame: frame_layout, part: parts.layout.clone(), sun: sun.layout.clone(), crowd };
        let backdrop = Backdrop::new(&gpu, &groups);
        let instances = Instances::new(&gpu);
        let meshes = MeshDrawer::new(&gpu, &groups);
        let leaves = ForestDrawer::new(&gpu, &groups);
        let impostors = ImpostorDrawer::new(&gpu, &groups);
        let composite = Composite::new(&gpu, &groups.frame);
        let growth = GrowthPass::new(&gpu);
        gpu.check()?;
        Ok(Self {
            gpu,
            frame,
            frame_group,
            backdrop,
            parts,
            groups,
            instances,
            meshes,
            leaves,
            impostors,
            sent_bytes: 0,
            sun,
            composite,
            growth,
            crowns,
            targets: None,
            uploaded_bytes: 0,
            culler: None,
            cast: None,
            keeps_map: false,
            counted: Counted::default(),
            counted_alone: Counted::default(),
            map_drawn: false,
            prepared_ms: 0.0,
            frame_ms: 0.0,
            clock: None,
        })
    }

    /// Puts parts onto the device that are always seen.
    ///
    /// # Errors
    /// [`Error::Device`] when they do not fit.
    pub fn upload(&self, parts: &[Part]) -> Result<Tree> {
        self.upload_built(&tree::always_seen(parts))
    }

    /// Puts a tree onto the device as a method has built it.
    ///
    /// # Errors
    /// [`Error::Device`] when it does not fit.
    pub fn upload_built(&self, built: &BuiltTree) -> Result<Tree> {
        let tree = self.gpu.guarded(|| Tree::upload(&self.gpu, &self.parts, built))?;
        self.gpu.queue.submit([]); // sent off, so that what it took to send comes back even if nothing is ever drawn
        Ok(tree)
    }

    /// Plants many trees: each of a species, by its number, and where it stands. Whatever the species hold is shared by all.
    ///
    /// # Errors
    /// [`Error::Device`] when they do not fit, [`Error::NoSuchSpecies`] for a number that no species has.
    pub fn plant(&self, species: Vec<Tree>, trees: &[crowd::Standing]) -> Result<Crowd> {
        let crowd = Crowd::new(&self.gpu, &self.groups.crowd, species, trees)?;
        self.gpu.queue.submit([]);
        Ok(crowd)
    }

    /// Puts ground onto the device.
    ///
    /// # Errors
    /// [`Error::Device`] when it does not fit.
    pub fn upload_ground(&self, ground: &HeightField) -> Result<Terrain> {
        let terrain = self.gpu.guarded(|| Terrain::upload(&self.gpu, ground))?;
        self.gpu.queue.submit([]);
        Ok(terrain)
    }

    /// Takes a picture and reads it back.
    ///
    /// # Errors
    /// [`Error::PictureSize`] for one without extent or beyond the device's limit, [`Error::Device`] when the device fails.
    pub fn picture<'a>(&mut self, shot: &Shot, world: impl Into<World<'a>>) -> Result<Picture> {
        self.keeps_map = true;
        let drawn = self.draw(shot, world.into());
        self.keeps_map = false;
        drawn?;
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

    /// Draws a frame and waits until the device has done it, for measurements.
    ///
    /// # Errors
    /// As [`Renderer::picture`].
    pub fn frame<'a>(&mut self, shot: &Shot, world: impl Into<World<'a>>) -> Result<()> {
        self.draw(shot, world.into())?;
        self.gpu.wait()
    }

    /// Draws a frame and gives the milliseconds of each pass in order, by the device's own clock where it has one, else by the clock on
    /// the wall with a wait after every pass.
    ///
    /// # Errors
    /// As [`Renderer::picture`].
    pub fn timed<'a>(&mut self, shot: &Shot, world: impl Into<World<'a>>) -> Result<Vec<(&'static str, f64)>> {
        self.clock = Some(PassClock::new(&self.gpu));
        let begun = Instant::now();
        let drawn = self.draw(shot, world.into()).and_then(|()| self.gpu.wait());
        self.frame_ms = begun.elapsed().as_secs_f64() * 1e3;
        let clock = self.clock.take().expect("just set");
        drawn?;
        clock.read(&self.gpu)
    }

    /// Milliseconds until the device knows what a frame shows of a crowd and what casts shadows on it; nothing is drawn.
    ///
    /// # Errors
    /// As [`Renderer::picture`].
    pub fn cull_ms<'a>(&mut self, shot: &Shot, world: impl Into<World<'a>>) -> Result<f64> {
        let world = world.into();
        let begun = Instant::now();
        let sun = self.sun_view(shot, &world)?;
        let World { crowd: Some(crowd), ground, cull, frozen, .. } = world else { return Ok(0.0) };
        let culler = culler_for(&mut self.culler, &self.gpu, &self.frame, &cull);
        crowd.see(&self.gpu, shot, frozen, sun, (&cull, culler))?;
        let placed = Placed { stands: &[], casters: 0, crowd: Some(crowd), ground };
        let frame = frame_of(shot, Sway::of(&shot.wind), sun.map(|(view, _)| view), &placed);
        self.gpu.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&frame));
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("culling") });
        if let Some(culler) = &self.culler {
            placed.crowd.map(|crowd| crowd.cull(&mut encoder, culler));
        }
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.wait()?;
        Ok(begun.elapsed().as_secs_f64() * 1e3)
    }

    /// What was sent to the device for the last frame because of what it shows of trees: changes of level of foliage.
    pub fn sent_bytes(&self) -> u64 {
        self.sent_bytes
    }

    /// Leaves of foliage in levels of detail that the last frame showed.
    pub fn leaves_shown(&self) -> usize {
        self.leaves.leaves_shown()
    }

    /// Bytes of instances, and of what drawers keep of them, that the last frame sent to the device; 0 when nothing had changed.
    pub fn uploaded_bytes(&self) -> u64 {
        self.uploaded_bytes
    }

    /// Milliseconds from the beginning of the last frame that was timed until the device had finished it.
    pub fn frame_ms(&self) -> f64 {
        self.frame_ms
    }

    /// Milliseconds that the last frame took before anything was drawn: which trees are seen, what grows.
    pub fn prepared_ms(&self) -> f64 {
        self.prepared_ms
    }

    /// Draw calls and triangles of trees of the last frame, those for the sun's map among them.
    pub fn counted(&self) -> Counted {
        self.counted
    }

    /// Asks the device how many trees of a crowd the last frame showed, where it has culled them: [`Renderer::counted`] and the crowd's own
    /// numbers are at most so many before. Waits for it, after the frame.
    ///
    /// # Errors
    /// [`Error::Device`] when the device fails.
    pub fn tally(&mut self, crowd: &mut Crowd) -> Result<()> {
        crowd.tally(&self.gpu)?;
        self.counted = self.counted_alone + crowd.counted_of(self.map_drawn);
        Ok(())
    }

    /// The picture that [`Renderer::draw`] made last.
    ///
    /// # Panics
    /// Before the first.
    fn drawn(&self) -> &Target {
        &self.targets.as_ref().expect("draw makes them").frame_color
    }

    /// Draws a frame into the targets.
    fn draw(&mut self, shot: &Shot, world: World) -> Result<()> {
        self.resize(shot.size_px)?; // before anything is reckoned for a size that cannot be drawn
        let begun = Instant::now();
        let sun = self.sun_view(shot, &world)?;
        let World { stands, crowd, ground, cull, frozen } = world;
        let casters = stands.len();
        let (mut sent, mut crowd_of_frame, mut near) = (0, None, vec![]);
        if let Some(crowd) = crowd {
            let culler = culler_for(&mut self.culler, &self.gpu, &self.frame, &cull);
            sent = crowd.see(&self.gpu, shot, frozen, sun, (&cull, culler))?;
            near = crowd.near();
            crowd_of_frame = Some(&*crowd);
        }
        let near =
            near.iter().filter_map(|(species, instances)| Some(Stand { tree: &crowd_of_frame?.species()[*species], instances }));
        let stands: Vec<Stand> = stands.iter().copied().chain(near).collect();
        let rects = crowd_of_frame.map_or(&[][..], |crowd| &crowd.seen().rects);
        let growing = GrowthInput::new(shot, &stands, rects, &self.growth.twigs);
        let placed = Placed { stands: &stands, casters, crowd: crowd_of_frame, ground };
        self.prepared_ms = begun.elapsed().as_secs_f64() * 1e3;
        self.draw_growing(shot, &placed, &growing, sun)?;
        self.uploaded_bytes += sent;
        Ok(())
    }

    /// What the sun sees of the world, and the side of its map in texels; `None` where nothing casts shadows.
    fn sun_view(&mut self, shot: &Shot, world: &World) -> Result<Option<(SunView, u32)>> {
        if shot.stage != Stage::Lit {
            return Ok(None);
        }
        let Some(casters) = world.bounds(Tree::reach, Sway::of(&shot.wind)) else { return Ok(None) };
        self.sun.resize(&self.gpu, shot.light.shadow_map_px.0)?;
        let (toward_sun, range_m) = (shot.toward_sun.normalize_or(Vec3::Y), shot.light.shadow_range_m as f32);
        Ok(Some((SunView::fit(toward_sun, casters, &shot.camera, range_m, self.sun.size_px), self.sun.size_px)))
    }

    /// Draws a frame into the targets, in which `growing` grows.
    fn draw_growing(&mut self, shot: &Shot, placed: &Placed, growing: &GrowthInput, sun_map: Option<(SunView, u32)>) -> Result<()> {
        self.resize(shot.size_px)?;
        let targets = self.targets.as_ref().expect("just made");
        let (sway, view) = (Sway::of(&shot.wind), sun_map.map(|(view, _)| view));
        self.gpu.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&frame_of(shot, sway, view, placed)));
        self.gpu.queue.write_buffer(&self.crowns, 0, bytemuck::cast_slice(&growing.crowns));
        let (scene, mut uploaded_bytes) = self.instances.scene(&self.gpu, shot, placed, growing, sun_map)?;
        // A map stays while the sun sees the same.
        let cast = sun_map.and_then(|sun| Cast::of(shot, placed, sun, self.keeps_map));
        let map_stays = cast.is_some() && self.cast == cast;
        self.cast = cast;
        self.map_drawn = view.is_some() && !map_stays;
        let gpu = &self.gpu;
        self.sent_bytes = self.leaves.prepare(gpu, &scene)?;
        let passes = PASSES.iter().filter(|kind| self.map_drawn || **kind == PassKind::Temporary);
        let of_leaves = passes.fold(Counted::default(), |sum, kind| sum + self.leaves.counted(&scene, *kind));
        self.counted_alone = scene.counted(self.map_drawn) + of_leaves;
        self.counted = self.counted_alone + placed.crowd.map_or(Counted::default(), |crowd| crowd.counted_of(self.map_drawn));
        uploaded_bytes += self.sent_bytes + self.meshes.prepare(gpu, &scene)? + self.impostors.prepare(gpu, &scene)?;
        self.uploaded_bytes = uploaded_bytes;
        let drawers: [&dyn Drawer; 3] = [&self.meshes, &self.leaves, &self.impostors];
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
        let mut passed = |encoder: &mut _, pass| self.clock.as_mut().map_or(Ok(()), |clock| clock.passed(gpu, encoder, pass));
        passed(&mut encoder, "begin")?;
        if let (Some(culler), Some(crowd)) = (&self.culler, placed.crowd)
            && crowd.cull(&mut encoder, culler)
        {
            passed(&mut encoder, "culling")?;
        }
        if self.map_drawn {
            let mut pass = begin_shadow(&mut encoder, &self.frame_group, &self.sun);
            drawers.iter().for_each(|drawer| drawer.draw(&mut pass, &scene, PassKind::Shadow));
            drop(pass);
        }
        if view.is_some() {
            passed(&mut encoder, "shadow map")?;
        }
        self.backdrop.draw(&mut encoder, &self.frame_group, &self.sun.group, targets, shot.background, placed.ground);
        passed(&mut encoder, "backdrop")?;
        let kind = PassKind::Temporary;
        let mut pass = begin_temporary(&mut encoder, &self.frame_group, &self.sun, targets);
        drawers.iter().for_each(|drawer| drawer.draw(&mut pass, &scene, kind));
        drop(pass);
        passed(&mut encoder, "trees")?;
        self.growth.draw(gpu, &mut encoder, targets, growing, &self.crowns)?;
        passed(&mut encoder, "growth")?;
        let smooth = matches!(shot.stage, Stage::Antialiased | Stage::Lit);
        self.composite.draw(gpu, &mut encoder, &self.frame_group, targets, &growing.tree_tiles, smooth)?;
        passed(&mut encoder, "composite")?;
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.check()
    }

    /// Whether a picture of that size can be taken.
    pub fn takes(&self, size_px: [u32; 2]) -> bool {
        let limit = self.gpu.device.limits().max_texture_dimension_2d;
        let pixels = size_px.iter().map(|&side| u64::from(side)).product::<u64>();
        size_px.iter().all(|side| (1..=limit).contains(side)) && pixels <= MAX_PIXELS
    }

    fn resize(&mut self, size_px: [u32; 2]) -> Result<()> {
        if !self.takes(size_px) {
            let limit = self.gpu.device.limits().max_texture_dimension_2d;
            return Err(Error::PictureSize { found: size_px, limit, megapixels: MAX_PIXELS >> 20 });
        }
        if self.targets.as_ref().is_none_or(|targets| targets.size_px != size_px) {
            // The old ones go before the new ones come.
            self.growth.forget_targets();
            self.composite.forget_targets();
            self.targets = None;
            self.targets = Some(self.gpu.guarded(|| Targets::new(&self.gpu, size_px))?);
        }
        Ok(())
    }
}

/// Who culls on the device, where that is asked for; made when it first is.
fn culler_for<'a>(
    kept: &'a mut Option<crowd::Culler>,
    gpu: &Gpu,
    frame: &wgpu::Buffer,
    cull: &CullParams,
) -> Option<&'a crowd::Culler> {
    cull.on_device().then(|| &*kept.get_or_insert_with(|| crowd::Culler::new(gpu, frame)))
}

/// Begins the pass into the sun's map.
fn begin_shadow<'a>(encoder: &'a mut wgpu::CommandEncoder, frame: &wgpu::BindGroup, sun: &SunMap) -> wgpu::RenderPass<'a> {
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("shadow"),
        depth_stencil_attachment: Some(depth_attachment(&sun.depth, true)),
        ..Default::default()
    });
    pass.set_bind_group(0, frame, &[]);
    pass
}

/// Begins the pass into the temporary colour, depth and id buffers, lit through the sun's map.
fn begin_temporary<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    frame: &wgpu::BindGroup,
    sun: &SunMap,
    targets: &Targets,
) -> wgpu::RenderPass<'a> {
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
    pass.set_bind_group(2, &sun.group, &[]);
    pass
}

fn buffer_entry(binding: u32, ty: wgpu::BufferBindingType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    }
}

fn frame_of(shot: &Shot, sway: Sway, sun: Option<SunView>, placed: &Placed) -> layout::Frame {
    let (ground_m, crowded) = (placed.ground_m(), placed.crowd.is_some());
    let [width, height] = shot.size_px;
    let clip_from_world = shot.camera.clip_from_world(width as f32 / height as f32);
    let toward_sun = shot.toward_sun.normalize_or(Vec3::Y);
    let light = Light::of(toward_sun, shot.light.exposure as f32);
    layout::Frame {
        clip_from_world: clip_from_world.to_cols_array_2d(),
        world_from_clip: clip_from_world.inverse().to_cols_array_2d(),
        sun_clip_from_world: sun.map_or(Mat4::IDENTITY, |sun| sun.clip_from_world).to_cols_array_2d(),
        eye: shot.camera.eye.to_array(),
        time_s: shot.wind.time as f32,
        toward_sun: toward_sun.to_array(),
        shading: shot.shading(),
        sun_color: light.sun.to_array(),
        shadow_texel_m: sun.map_or(0.0, |sun| sun.texel_m),
        sky_color: light.sky.to_array(),
        ground_m,
        ground_color: light.ground.to_array(),
        background: shot.background as u32,
        size_px: [width as f32, height as f32],
        px_per_m: shot.camera.px_per_m(height),
        lean: sway.lean.to_array(),
        flutter_m: sway.flutter_m,
        sun_depth_m: sun.map_or(1.0, |sun| sun.depth_m),
        backward: shot.camera.axes[2].to_array(),
        layer: shot.camera.projection.layer(),
        heights: shot.heights(),
        haze: [shot.light.haze_m as f32, shot.light.haze_most as f32],
        level_eye: shot.level_eye().to_array(),
        sun_level_m: sun.filter(|_| crowded).map_or(0.0, |sun| sun.level_m()),
    }
}
