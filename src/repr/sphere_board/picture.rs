//! Photographs of foliage without light, of which every pixel is known: leaf, gap between leaves, or neither.

use glam::{DVec2, Vec2, Vec3};
use image::{GrayImage, Luma, RgbImage};
use imageproc::distance_transform::Norm;
use imageproc::morphology::close;
use rayon::prelude::*;

use crate::crown::Outline;
use crate::geom::Bounds;
use crate::model::Part;
use crate::photo::{Photo, SilhouetteParams, TrunkCues, silhouette, trunk};
use crate::raster::{self, Mask, View};
use crate::repr::card::window_around;
use crate::repr::{Capture, Scope, TreeSource};
use crate::texture::Front;
use crate::{Error, Result};

/// How wide a space between leaves belongs to the crown all the same, of the tree's longest side.
const CLOSING: f32 = 0.012;
/// Covered part of a pixel from which it counts as leaf while the crown is looked for.
const COVERED: u8 = 64;

/// What a side may have more than whole pixels without getting another: rounding would decide.
const WHOLE: f32 = 1e-2;

/// One photograph.
#[derive(Debug, Clone)]
pub(in crate::repr) struct Picture {
    pub photo: Photo,
    /// Leaves and the spaces between them, without holes.
    pub crown: Mask,
    /// The spaces: as many pixels of the crown as its leaves leave open.
    pub gaps: Mask,
    stand: Stand,
    view: View,
    /// Row by row: metres towards the viewer from the view's middle, and unit normals; negative infinity and zero where nothing is.
    depth_m: Vec<f32>,
    normal: Vec<Vec3>,
    axes: [Vec3; 3],
    pub metres_per_px: f64,
    /// Where the origin of object space lies, pixels.
    pub foot_px: DVec2,
}

/// From where a photograph is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::repr) struct Stand {
    pub azimuth_rad: f32,
    pub elevation_rad: f32,
}

impl Stand {
    pub const ABOVE: Self = Self { azimuth_rad: 0.0, elevation_rad: std::f32::consts::FRAC_PI_2 };

    pub(in crate::repr) const fn round(azimuth_rad: f32) -> Self {
        Self { azimuth_rad, elevation_rad: 0.0 }
    }
}

/// Takes `parts` from each stand at one scale; `None` where nothing is seen of them.
pub(in crate::repr) fn taken(
    capture: &dyn Capture,
    parts: &[Part],
    stands: &[Stand],
    scale: Scale,
) -> Result<Vec<Option<Picture>>> {
    let parts: Vec<&Part> = parts.iter().collect();
    let corners = || parts.iter().flat_map(|part| used_corners(part));
    let mut views = Vec::new();
    for stand in stands {
        let axes = View::axes_from(stand.azimuth_rad, stand.elevation_rad);
        let Some(window) = window_around(corners(), axes) else { return Ok(vec![None; stands.len()]) };
        views.push(scale.view(axes, window));
    }
    let captures = capture.take(&parts, &views)?;
    let picture = |((stand, view), taken)| Picture::of(stand, view, taken, scale);
    Ok(stands.par_iter().zip(&views).zip(&captures).map(picture).collect())
}

/// Corners that polygons use.
fn used_corners(part: &Part) -> impl Iterator<Item = Vec3> + '_ {
    let mesh = &part.surface.mesh;
    mesh.polygons().flatten().map(|&v| mesh.positions[v as usize])
}

/// How large a tree appears in its pictures.
#[derive(Debug, Clone, Copy)]
pub(in crate::repr) struct Scale {
    pub metres_per_px: f32,
    /// Of the tree's longest side.
    pub longest_px: u32,
}

impl Scale {
    /// The view along `axes` that shows `window` and some way round it.
    fn view(self, axes: [Vec3; 3], window: Bounds) -> View {
        let margin_px = 2 * u32::from(self.closing_px()) + 4;
        let px = |metres: f32| ((metres / self.metres_per_px - WHOLE).ceil() as u32).min(4 * self.longest_px) + margin_px;
        let middle = window.center();
        let (width_px, height_px) = (px(window.size().x), px(window.size().y));
        View {
            axes,
            center: axes[0] * middle.x + axes[1] * middle.y + axes[2] * middle.z,
            half_size_m: 0.5 * self.metres_per_px * Vec2::new(width_px as f32, height_px as f32),
            slab_m: View::ALL,
            width_px,
            height_px,
        }
    }

    fn closing_px(self) -> u8 {
        (CLOSING * self.longest_px as f32).round().clamp(1.0, 60.0) as u8
    }
}

impl Picture {
    fn of(stand: &Stand, view: &View, taken: &raster::Capture, scale: Scale) -> Option<Self> {
        let crown = Mask::from_gray(&close(&leaves_of(taken), Norm::L2, scale.closing_px())).without_holes();
        if crown.count() == 0 {
            return None;
        }
        let (middle, metres_per_px) = (view.center, f64::from(scale.metres_per_px));
        let foot = DVec2::new(-f64::from(middle.dot(view.axes[0])), f64::from(middle.dot(view.axes[1]))) / metres_per_px;
        Some(Self {
            gaps: open(&crown, taken.coverage.as_raw()),
            crown,
            photo: Photo { image: opaque(taken), opaque: None },
            stand: *stand,
            view: *view,
            depth_m: taken.depth_m.clone(),
            normal: taken.normal.clone(),
            axes: view.axes,
            metres_per_px,
            foot_px: foot + 0.5 * DVec2::new(f64::from(view.width_px), f64::from(view.height_px)),
        })
    }

    /// The crown's outline.
    ///
    /// # Errors
    /// [`Error::CrownTooSmall`].
    pub(in crate::repr) fn outline(&self) -> Result<Outline> {
        let traced = silhouette::trace(&self.crown, &self.crown, &SilhouetteParams::default())?;
        let Stand { azimuth_rad, elevation_rad } = self.stand;
        let seen = Outline::from_silhouette(&traced, self.foot_px, self.metres_per_px, f64::from(azimuth_rad));
        Ok(Outline { elevation_rad: f64::from(elevation_rad), ..seen })
    }

    /// Towards whoever took it.
    pub(in crate::repr) fn toward(&self) -> Vec3 {
        self.axes[2]
    }

    /// Places that it shows and their normals, at every so manieth pixel along both axes.
    pub(in crate::repr) fn places(&self, step: u32) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
        let View { width_px, height_px, half_size_m, center, axes: [right, up, toward], .. } = self.view;
        let pixels =
            (0..height_px).step_by(step as usize).flat_map(move |y| (0..width_px).step_by(step as usize).map(move |x| (x, y)));
        pixels.filter_map(move |(x, y)| {
            let at = (y * width_px + x) as usize;
            let part = |i: u32, n: u32| 2.0 * (i as f32 + 0.5) / n as f32 - 1.0;
            let aside = part(x, width_px) * half_size_m.x * right - part(y, height_px) * half_size_m.y * up;
            (self.normal[at] != Vec3::ZERO).then(|| (center + aside + self.depth_m[at] * toward, self.normal[at]))
        })
    }

    /// Whether nothing stands before a place, give or take some pixels.
    pub(in crate::repr) fn sees(&self, place: Vec3, slack_px: f32) -> bool {
        let View { width_px, height_px, half_size_m, center, axes: [right, up, toward], .. } = self.view;
        let d = place - center;
        let index =
            |along: f32, half: f32, n: u32| ((0.5 + 0.5 * along / half) * n as f32).floor().clamp(0.0, n as f32 - 1.0) as usize;
        let (x, y) = (index(d.dot(right), half_size_m.x, width_px), index(-d.dot(up), half_size_m.y, height_px));
        self.depth_m[y * width_px as usize + x] <= d.dot(toward) + slack_px * self.metres_per_px as f32
    }

    /// As a source of texture.
    pub(in crate::repr) fn front(&self) -> Front<'_> {
        Front {
            image: &self.photo.image,
            crown: &self.crown,
            gaps: &self.gaps,
            metres_per_px: self.metres_per_px,
            foot_px: self.foot_px,
            axes: self.axes,
            mean: None,
            delight: 0.0,
        }
    }
}

/// The crown's pixels that are covered least, as many as are open in all: what a pixel or two of leaf leaves open counts, too.
fn open(crown: &Mask, coverage: &[u8]) -> Mask {
    let mut of_level = [0usize; 256];
    let mut open = 0.0;
    for (&inside, &covered) in crown.as_raw().iter().zip(coverage).filter(|(inside, _)| **inside != 0) {
        debug_assert!(inside == 255);
        of_level[usize::from(covered)] += 1;
        open += 1.0 - f64::from(covered) / 255.0;
    }
    let (mut limit, mut count) = (0, 0);
    while limit < 255 && ((count + of_level[limit]) as f64) <= open {
        count += of_level[limit];
        limit += 1;
    }
    let width = crown.width() as usize;
    Mask::from_fn(crown.width(), crown.height(), |x, y| {
        let at = y as usize * width + x as usize;
        crown.as_raw()[at] != 0 && usize::from(coverage[at]) < limit
    })
}

/// A place that shows nothing.
pub(in crate::repr) fn nothing_seen() -> Error {
    Error::CrownTooSmall { needed: 9, found: 0 }
}

/// The trunk below the crown as it is seen from `azimuth_rad`, and the size of a pixel; `None` where leaves hide it.
pub(in crate::repr) fn trunk_seen(
    capture: &dyn Capture,
    source: &TreeSource,
    azimuth_rad: f32,
    scale: Scale,
) -> Result<Option<(TrunkCues, f64)>> {
    let axes = View::axes_from(azimuth_rad, 0.0);
    let Some(window) = window_around(source.points(Scope::Tree), axes) else { return Ok(None) };
    let view = scale.view(axes, window);
    let mut covered = Vec::new();
    for scope in [Scope::Wood, Scope::Foliage] {
        let mut taken = capture.take(&source.parts(scope), &[view])?;
        let Some(taken) = taken.pop() else { return Ok(None) };
        covered.push(taken);
    }
    let crown = Mask::from_gray(&close(&leaves_of(&covered[1]), Norm::L2, scale.closing_px())).without_holes();
    let tree = Mask::from_gray(&covered[0].coverage).zip(&crown, |wood, crown| wood || crown);
    Ok(trunk::find(&opaque(&covered[0]), &crown, &tree).map(|cues| (cues, f64::from(scale.metres_per_px))))
}

/// Where there is leaf.
fn leaves_of(taken: &raster::Capture) -> GrayImage {
    let (width, height) = taken.coverage.dimensions();
    GrayImage::from_fn(width, height, |x, y| Luma([255 * u8::from(taken.coverage.get_pixel(x, y).0[0] >= COVERED)]))
}

fn opaque(taken: &raster::Capture) -> RgbImage {
    let (width, height) = taken.color.dimensions();
    RgbImage::from_fn(width, height, |x, y| {
        let [r, g, b, _] = taken.color.get_pixel(x, y).0;
        image::Rgb([r, g, b])
    })
}
