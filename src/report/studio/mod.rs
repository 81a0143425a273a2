//! A photograph of a reference tree: drawn on a lawn before a hedge and a sky with clouds, developed as a camera would, with the exact
//! masks that a real photograph never has. So a model can be held against the tree that its photograph showed. All of it is ours.

mod film;
mod framing;
mod hedge;
mod sky;

use glam::Vec3;
use image::RgbImage;

use crate::geom::Bounds;
use crate::gpu::layout::Instance;
use crate::model::Growth;
use crate::model::reference::ReferenceTree;
use crate::params::PowerOfTwo;
use crate::raster::Mask;
use crate::render::{Background, Camera, LightParams, Picture, Renderer, Shot, Stage, Stand, Tree};
use crate::{Result, Seed};

crate::params! {
    /// The camera and the surroundings of a photograph.
    pub struct StudioParams {
        /// Focal length, as on film of 36×24 mm: the same share of the picture's diagonal.
        lens_mm: f64 = 70.0, in 10.0..=1200.0, unit "mm", source "ours: trees are photographed from some way off, so that they fit";
        /// How much of the picture the tree fills, in height or width, whichever is more.
        fill: f64 = 0.84, in 0.05..=1.0, unit "", source "ours: some lawn below, some sky above";
        /// Height of the camera above the ground; --elevation-deg says otherwise.
        eye_m: f64 = 1.6, in 0.1..=100.0, unit "m", source "ours: a standing person's";
        /// Share of the sky that clouds cover, roughly.
        clouds: f64 = 0.45, in 0.0..=1.0, unit "", source "ours: fair weather";
        /// Height of the hedge behind the tree; 0 for none.
        hedge_m: f64 = 2.0, in 0.0..=8.0, unit "m", source "ours: hides the horizon from a standing person";
        /// Rows and columns of samples in a pixel.
        supersampling: u32 = 3, in 1..=4, unit "", source "ours: leaves are a few pixels wide";
        /// Noise in the middle tones, levels of 255.
        grain: f64 = 1.6, in 0.0..=20.0, unit "", source "ours: a small camera by day";
    }
}

/// What is asked of one photograph.
#[derive(Debug, Clone)]
pub struct Sitting {
    /// From where round the tree, radians: 0 is +Z, π/2 is +X.
    pub azimuth_rad: f32,
    /// How far above the horizon the camera stands, as the middle of the tree sees it; `None` stands on the ground.
    pub elevation_rad: Option<f32>,
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// Towards the sun, any length but zero.
    pub toward_sun: Vec3,
    /// Brightness, and how sharp shadows are.
    pub light: LightParams,
    /// Clouds, hedge and grain.
    pub seed: Seed,
    /// Everything else.
    pub params: StudioParams,
}

impl Default for Sitting {
    /// From the front, the sun over the photographer's right shoulder.
    fn default() -> Self {
        Self {
            azimuth_rad: 0.0,
            elevation_rad: None,
            size_px: [1000, 1300],
            toward_sun: Vec3::new(0.4545, std::f32::consts::FRAC_1_SQRT_2, 0.5417),
            light: LightParams { shadow_map_px: PowerOfTwo(4096), ..LightParams::default() },
            seed: Seed(1),
            params: StudioParams::default(),
        }
    }
}

/// A photograph and the truth about it.
#[derive(Debug, Clone)]
pub struct Photograph {
    /// What the camera saw, sRGB.
    pub image: RgbImage,
    /// Pixels of which wood and leaves cover half or more; open where the sky or the hedge shows through.
    pub tree: Mask,
    /// The crown as segmentation should find it: pixels of which leaves cover half or more, whether or not a limb is before them, and
    /// everything that these enclose, be it wood or sky. What of it is not in `tree` are the gaps.
    pub crown: Mask,
    /// Where it was taken from.
    pub camera: Camera,
}

/// Takes a photograph of the tree, whose foot is put onto the ground if it is not there; `growth` says how the outlines of a sphere-board grow. `step` is called after each of [`STEPS`] steps.
///
/// # Errors
/// [`crate::Error::BelowGround`] for a camera under the lawn, [`crate::Error::PictureSize`], and those of the renderer.
pub fn photograph(
    renderer: &mut Renderer,
    tree: &ReferenceTree,
    growth: Option<Growth>,
    sitting: &Sitting,
    step: &dyn Fn(),
) -> Result<Photograph> {
    let params = &sitting.params;
    let lift = onto_the_ground(tree.bounds);
    let bounds = Bounds { min: tree.bounds.min + lift, max: tree.bounds.max + lift };
    let points: Vec<Vec3> = tree.parts().flat_map(|part| &part.surface.mesh.positions).map(|p| *p + lift).collect();
    let camera = framing::camera(&points, bounds, sitting)?;
    let upload = |renderer: &Renderer, parts: &[crate::model::Part]| {
        let tree = renderer.upload(parts)?;
        Ok::<_, crate::Error>(if let Some(growth) = growth { tree.growing(growth) } else { tree })
    };
    let samples = samples_that_fit(renderer, params.supersampling, sitting.size_px);
    let size_px = sitting.size_px.map(|side| side.saturating_mul(samples));
    let shot = Shot { toward_sun: sitting.toward_sun, light: sitting.light.clone(), ..Shot::new(camera, size_px) };

    let whole = upload(renderer, &tree.parts().cloned().collect::<Vec<_>>())?;
    let behind = if params.hedge_m > 0.0 { Some(renderer.upload(&hedge::hedge(bounds, &camera, sitting))?) } else { None };
    let (lifted, here) = ([Instance { position: lift.to_array(), ..Instance::IDENTITY }], [Instance::IDENTITY]);
    let mut stands = vec![Stand { tree: &whole, instances: &lifted }];
    stands.extend(behind.as_ref().map(|tree| Stand { tree, instances: &here }));
    let scene = renderer.picture(&shot, &stands)?;
    step();
    let leaves = upload(renderer, &tree.foliage)?;
    let mut alone = |tree: &Tree| {
        let shot = Shot { stage: Stage::Reshaped, background: Background::Alpha, ..shot.clone() };
        let picture = renderer.picture(&shot, &[Stand { tree, instances: &lifted }])?;
        step();
        Ok::<_, crate::Error>(picture)
    };
    let (bare_tree, bare_leaves) = (alone(&whole)?, alone(&leaves)?);
    let seen = |at: usize| is_there(&bare_tree, at) && bare_tree.depth_m[at] <= scene.depth_m[at] * 1.0001 + 1e-3;
    let tree_mask = half_covered(sitting.size_px, samples, seen);
    // A limb before leaves belongs to the crown, one before the sky does not.
    let leaf_mask = half_covered(sitting.size_px, samples, |at| seen(at) && is_there(&bare_leaves, at));

    let clouds = sky::Clouds::new(params.clouds as f32, sitting.toward_sun, sitting.seed);
    let image = film::develop(&scene, &camera, samples, &clouds, params.grain as f32, sitting.seed);
    step();
    Ok(Photograph { image, tree: tree_mask, crown: leaf_mask.without_holes(), camera })
}

/// How often [`photograph`] calls its `step`.
pub const STEPS: u64 = 4;

/// How far a tree must be lifted to stand on the lawn: not at all when its foot is there, give or take some root.
fn onto_the_ground(tree: Bounds) -> Vec3 {
    let low = tree.min.y;
    if low.abs() > 0.05 * tree.size().y { -low * Vec3::Y } else { Vec3::ZERO }
}

/// As many samples as were asked for, or as many as the device's pictures hold.
fn samples_that_fit(renderer: &Renderer, asked: u32, [width, height]: [u32; 2]) -> u32 {
    let fits = |samples: &u32| renderer.takes([width, height].map(|side| side.saturating_mul(*samples)));
    (1..=asked).rev().find(fits).unwrap_or(1)
}

/// Whether anything was drawn at a sample.
fn is_there(picture: &Picture, at: usize) -> bool {
    picture.color.as_raw()[4 * at + 3] >= 128
}

/// The pixels of which half of the samples or more are `inside`, by number of the sample.
fn half_covered([width, height]: [u32; 2], samples: u32, inside: impl Fn(usize) -> bool) -> Mask {
    let at = |x: u32, y: u32| y as usize * (width * samples) as usize + x as usize;
    Mask::from_fn(width, height, |x, y| {
        let count = (0..samples * samples).filter(|i| inside(at(x * samples + i % samples, y * samples + i / samples))).count();
        2 * count as u32 >= samples * samples
    })
}
