//! Driving through a grove: a scene on the device, and frame after frame along its path, each timed until the device has finished it.

use glam::Vec3;

use super::path::Look;
use super::scene::Scene;
use super::stock::Stock;
use super::trail::Trail;
use crate::Result;
use crate::gpu::layout::Placed;
use crate::render::{
    Background, Camera, Counted, Crowd, CullParams, LevelViewer, LightParams, Picture, Renderer, Shot, Terrain, Tree, WindParams,
    World,
};
use crate::repr::{Level, Seen};

/// A scene on the device.
#[derive(Debug)]
pub struct Grove {
    crowd: Crowd,
    ground: Terrain,
    /// Levels of each species, and which of its groups are seen wholly at each.
    levels: Vec<Vec<(Level, Vec<usize>)>>,
}

impl Grove {
    /// Puts a scene onto the device: its ground, `stock` once for each species, and where each tree stands.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) when it does not fit.
    pub fn plant(renderer: &Renderer, scene: &Scene, stock: &[Stock]) -> Result<Self> {
        let trees = stock.iter().map(|stock| renderer.upload_built(&stock.built)).collect::<Result<Vec<_>>>()?;
        let levels = trees.iter().zip(stock).map(|(tree, stock)| levels_of(tree, &stock.built.levels)).collect();
        let place =
            |planted: &super::Planted| (planted.species, Placed::new(planted.position.to_array(), planted.yaw_rad, planted.scale));
        let placed: Vec<_> = scene.planted.iter().map(place).collect();
        Ok(Self { crowd: renderer.plant(trees, &placed)?, ground: renderer.upload_ground(&scene.ground)?, levels })
    }

    /// All trees.
    pub fn crowd(&self) -> &Crowd {
        &self.crowd
    }

    /// Asks the device what the last frame showed, where it has culled.
    ///
    /// # Errors
    /// Those of [`Renderer::tally`].
    pub fn tally(&mut self, renderer: &mut Renderer) -> Result<()> {
        renderer.tally(&mut self.crowd)
    }

    /// How many trees the last frame showed at each level of each species: those in the group of it of which most are seen.
    pub fn shown(&self) -> Vec<Vec<usize>> {
        let of_species = |(species, levels): (usize, &Vec<(Level, Vec<usize>)>)| {
            let shown = self.crowd.shown(species);
            levels.iter().map(|(_, groups)| groups.iter().map(|group| shown[*group]).max().unwrap_or(0)).collect()
        };
        self.levels.iter().enumerate().map(of_species).collect()
    }

    /// Names of the levels of each species.
    pub fn levels(&self) -> Vec<Vec<&str>> {
        self.levels.iter().map(|levels| levels.iter().map(|(level, _)| level.name.as_str()).collect()).collect()
    }

    /// What a frame draws.
    pub fn world<'a>(&'a mut self, cull: &CullParams, frozen: Option<Camera>) -> World<'a> {
        World { stands: &[], crowd: Some(&mut self.crowd), ground: Some(&self.ground), cull: cull.clone(), frozen }
    }
}

/// The groups of a tree by which each of its levels is known: those seen wholly there that the fewest other levels show too, since a trunk
/// may be seen at all of them.
fn levels_of(tree: &Tree, levels: &[Level]) -> Vec<(Level, Vec<usize>)> {
    let there = |seen: &Seen, level: &Level| seen.share_at(level.distance) >= 1.0;
    let in_levels: Vec<usize> = tree.groups().iter().map(|seen| levels.iter().filter(|level| there(seen, level)).count()).collect();
    let of_level = |level: &Level| {
        let groups: Vec<usize> = (0..in_levels.len()).filter(|group| there(&tree.groups()[*group], level)).collect();
        let fewest = groups.iter().map(|group| in_levels[*group]).min();
        (level.clone(), groups.into_iter().filter(|group| Some(in_levels[*group]) == fewest).collect())
    };
    levels.iter().map(of_level).collect()
}

/// One frame that was drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// On the path, seconds.
    pub time_s: f32,
    /// Until the device had finished it, milliseconds.
    pub ms: f64,
    /// Of those, before anything was given to the device: culling and growth's tables.
    pub cpu_ms: f64,
    /// Milliseconds of each pass.
    pub passes: Vec<(&'static str, f64)>,
    /// Of trees.
    pub counted: Counted,
    /// Trees in the picture.
    pub trees: usize,
    /// Of them, those whose outlines grow or whose foliage is drawn by itself.
    pub near: usize,
    /// At each level of each species.
    pub shown: Vec<Vec<usize>>,
    /// Sent to the device.
    pub uploaded_bytes: u64,
}

/// The picture of a scene from a place on its path.
pub fn shot(scene: &Scene, look: Look, time_s: f32, viewer: LevelViewer, number: u32) -> Shot {
    let (stage, camera) = (&scene.file.stage, &scene.file.camera);
    let fov_y_rad = (camera.camera_angle_deg as f32).to_radians();
    let (azimuth, elevation) = (stage.sun_azimuth_deg.to_radians() as f32, stage.sun_elevation_deg.to_radians() as f32);
    let (level, up) = (elevation.cos(), elevation.sin());
    let clear = LightParams::default();
    // Half is taken where the exponent is ln 2.
    let fog =
        |half_m: f64| LightParams { haze_m: half_m / std::f64::consts::LN_2.powf(2.0 / 3.0), haze_most: 1.0, ..clear.clone() };
    Shot {
        stage: stage.stage,
        background: Background::Sky,
        toward_sun: Vec3::new(level * azimuth.sin(), up, level * azimuth.cos()),
        light: if stage.fog_half_m > 0.0 { fog(stage.fog_half_m) } else { clear.clone() },
        wind: WindParams { wind: stage.wind_m_s, time: f64::from(time_s), ..WindParams::default() },
        level_viewer: Some(viewer),
        frame: number,
        ..Shot::new(Camera::looking(look.eye, look.target, fov_y_rad), scene.file.size_px)
    }
}

/// Frames that are drawn before the first that counts: pipelines are made, buffers grow.
const WARM_UP: u32 = 3;

/// Drives along the whole path in the scene's number of frames; `told` hears of each, and says whether to go on.
///
/// # Errors
/// Those of [`Renderer::frame`]; frames before stay with whom they were told.
pub fn drive(renderer: &mut Renderer, grove: &mut Grove, scene: &Scene, told: &mut dyn FnMut(u32, Frame) -> bool) -> Result<()> {
    let frames = scene.file.frames;
    let step_s = scene.path.length_s() / frames.saturating_sub(1).max(1) as f32;
    let mut trail = Trail::default();
    for number in 0..frames + WARM_UP {
        let at = number.saturating_sub(WARM_UP);
        let time_s = at as f32 * step_s;
        let look = scene.path.at(time_s);
        let shot = shot(scene, look, time_s, trail.follow(look.eye, time_s, &scene.file.levels), at);
        let passes = renderer.timed(&shot, grove.world(&scene.file.culling, None))?;
        grove.tally(renderer)?;
        let frame = Frame {
            time_s,
            ms: renderer.frame_ms(),
            cpu_ms: renderer.prepared_ms(),
            passes,
            counted: renderer.counted(),
            trees: grove.crowd.trees_seen(),
            near: grove.crowd.trees_near(),
            shown: grove.shown(),
            uploaded_bytes: renderer.uploaded_bytes(),
        };
        if number >= WARM_UP && !told(at, frame) {
            break;
        }
    }
    Ok(())
}

/// The picture of one frame of the path.
///
/// # Errors
/// Those of [`Renderer::picture`].
pub fn picture(renderer: &mut Renderer, grove: &mut Grove, scene: &Scene, number: u32) -> Result<Picture> {
    renderer.picture(&shot_of(scene, number), grove.world(&scene.file.culling, None))
}

/// The same without trees.
///
/// # Errors
/// Those of [`Renderer::picture`].
pub fn bare(renderer: &mut Renderer, grove: &mut Grove, scene: &Scene, number: u32) -> Result<Picture> {
    renderer.picture(&shot_of(scene, number), World { crowd: None, ..grove.world(&scene.file.culling, None) })
}

/// What a frame of the path shows.
fn shot_of(scene: &Scene, number: u32) -> Shot {
    let step_s = scene.path.length_s() / scene.file.frames.saturating_sub(1).max(1) as f32;
    let mut trail = Trail::default();
    let mut viewer = LevelViewer { eye: Vec3::ZERO, farther: 1.0 };
    // Where the trail is depends on the whole way.
    for at in 0..=number {
        viewer = trail.follow(scene.path.at(at as f32 * step_s).eye, at as f32 * step_s, &scene.file.levels);
    }
    let time_s = number as f32 * step_s;
    shot(scene, scene.path.at(time_s), time_s, viewer, number)
}
