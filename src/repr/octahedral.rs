//! Octahedral impostor (Brucks 2018, what engines use today): the tree from all over the upper half sphere in one atlas of colour and
//! coverage, and one of normals and depth, shown on a card that faces the viewer. What they hold: [`Octahedral`]. Metres.
//!
//! Each frame is cut out and bled by itself, and a gutter round the tree keeps what is filtered across frames transparent.

use glam::{Vec2, Vec3};
use image::{RgbaImage, imageops};
use rayon::prelude::*;

use super::billboard::nothing_seen;
use super::card;
use super::{BuiltPart, BuiltTree, Drawn, Job, Octahedral, Representation, Seen, SourceKind, TreeSource};
use crate::Result;
use crate::geom::{PolyMesh, Surface};
use crate::model::{Material, Part, Wrap};
use crate::params::{ParamSet, ParamSpec, PowerOfTwo};
use crate::raster::{ALPHA_CUTOFF, Capture, Layer, View};

crate::params! {
    /// How an octahedral impostor is made.
    pub struct OctahedralParams {
        /// Views along each side of the atlas.
        grid: u32 = 8, in 4..=16, unit "", source "Brucks 2018: 8 to 16";
        /// Texels along each side of one view.
        frame_px: PowerOfTwo = PowerOfTwo(256), in 32..=512, unit "px", source "Brucks 2018: atlases of 2048 texels";
    }
}

/// A gutter is one texel for so many along a frame.
const TEXELS_PER_GUTTER: u32 = 64;

/// An atlas of views.
pub struct OctahedralImpostor;

impl Representation for OctahedralImpostor {
    fn id(&self) -> &'static str {
        "octahedral"
    }

    fn name(&self) -> &'static str {
        "Octahedral impostor"
    }

    fn citation(&self) -> &'static str {
        "Brucks 2018, Octahedral Impostors; engines of today"
    }

    fn accepts(&self) -> &'static [SourceKind] {
        SourceKind::ALL
    }

    fn specs(&self) -> Vec<ParamSpec> {
        OctahedralParams::specs()
    }

    fn refuses(&self, source: &TreeSource) -> Option<String> {
        source.without_extent()
    }

    fn build(&self, job: &Job) -> Result<BuiltTree> {
        let params: OctahedralParams = job.settings.read()?;
        let bounds = job.source.box_of_all()?;
        let impostor = around(job.source, job, &params)?;
        let Some(part) = atlas(job, impostor, params.frame_px.0)? else { return Err(nothing_seen(self, job.source)) };
        let seen = Seen { anchor: impostor.center, ..Seen::default() };
        Ok(BuiltTree::new(bounds, vec![BuiltPart { part, drawn: Drawn::Octahedral(impostor), seen }]))
    }
}

/// The sphere round the middle of the tree, grown by the gutter.
fn around(source: &TreeSource, job: &Job, params: &OctahedralParams) -> Result<Octahedral> {
    let center = source.box_of_all()?.center();
    let reach = source.points(job.scope).map(|p| p.distance_squared(center)).fold(0.0, f32::max).sqrt();
    let gutter = (params.frame_px.0 / TEXELS_PER_GUTTER).max(1) as f32;
    let radius_m = (reach / (1.0 - 2.0 * gutter / params.frame_px.0 as f32)).max(1e-6);
    Ok(Octahedral { grid: params.grid, center, radius_m })
}

/// The view of frame (i, j).
fn view(impostor: &Octahedral, i: u32, j: u32, frame_px: u32) -> View {
    let toward = impostor.direction(i, j);
    View {
        axes: View::axes_from(toward.x.atan2(toward.z), toward.y.clamp(-1.0, 1.0).asin()),
        center: impostor.center,
        half_size_m: Vec2::splat(impostor.radius_m),
        slab_m: View::ALL,
        width_px: frame_px,
        height_px: frame_px,
    }
}

/// Both atlases on their card; `None` where no frame shows anything.
fn atlas(job: &Job, impostor: Octahedral, frame_px: u32) -> Result<Option<Part>> {
    let side = impostor.grid * frame_px;
    let (mut colors, mut normals) = (RgbaImage::new(side, side), RgbaImage::new(side, side));
    let parts = job.source.parts(job.scope);
    let mut seen = false;
    // Row by row: all frames at once would take gigabytes.
    for j in 0..impostor.grid {
        let views: Vec<View> = (0..impostor.grid).map(|i| view(&impostor, i, j, frame_px)).collect();
        let taken = job.capture.take(&parts, &views)?;
        let frames: Vec<_> = taken
            .par_iter()
            .map(|taken| card::cut_out(taken).map(|color| (color, normals_and_depth(taken, impostor.radius_m))))
            .collect();
        for (i, frame) in frames.iter().enumerate() {
            let (x, y) = (i64::from(frame_px) * i as i64, i64::from(frame_px * j));
            if let Some((color, normal)) = frame {
                imageops::replace(&mut colors, color, x, y);
                imageops::replace(&mut normals, normal, x, y);
                seen = true;
            }
        }
    }
    Ok(seen.then(|| Part {
        name: "impostor".to_owned(),
        surface: square(&impostor),
        material: Material {
            name: "impostor".to_owned(),
            texture: Some(colors.into()),
            normal_texture: Some(normals.into()),
            wrap: Wrap::Clamp,
            alpha_cutoff: Some(ALPHA_CUTOFF),
            two_sided: true,
            ..Material::default()
        },
        crown_center: None,
    }))
}

/// Object-space normals, and in alpha the depth; both go on where nothing is.
fn normals_and_depth(taken: &Capture, radius_m: f32) -> RgbaImage {
    let mut picture = card::tangent_normals(taken, Vec3::AXES);
    let (width, height) = taken.color.dimensions();
    let mut depth = Layer::from_fn(width as usize, height as usize, |x, y| {
        let m = taken.depth_m[y * width as usize + x];
        if m.is_finite() { Vec3::splat(m / radius_m).extend(1.0) } else { glam::Vec4::ZERO }
    });
    depth.bleed();
    for (pixel, depth) in picture.pixels_mut().zip(&depth.texels) {
        pixel[3] = (255.0 * (0.5 + 0.5 * depth.x)).round() as u8;
    }
    picture
}

/// The card as it faces +Z, all of the atlas on it.
fn square(impostor: &Octahedral) -> Surface {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let positions = corners.map(|(x, y)| impostor.center + impostor.radius_m * Vec3::new(x, y, 0.0)).to_vec();
    Surface {
        mesh: PolyMesh { positions, triangles: vec![], quads: vec![[0, 1, 2, 3]] },
        normals: vec![Vec3::Z; 4],
        uvs: corners.map(|(x, y)| 0.5 * Vec2::new(x + 1.0, 1.0 - y)).to_vec(),
        ..Surface::default()
    }
}
