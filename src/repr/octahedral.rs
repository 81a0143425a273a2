//! Octahedral impostor (Brucks 2018, what engines use today): the tree from all over the upper half sphere in one atlas of colour and
//! coverage, and one of normals and depth, shown on a card that faces the viewer. What they hold: [`Octahedral`]. Metres.
//!
//! Each frame is cut out and bled by itself, and a gutter round the tree keeps what is filtered across frames transparent.

use glam::{Vec2, Vec3};
use image::{Rgba, RgbaImage, imageops};
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
        let leaves = card::leaves(job.capture, &parts, &views, &taken)?;
        let frames: Vec<_> = taken
            .par_iter()
            .zip(views.par_iter().zip(&leaves))
            .map(|(taken, (view, leaves))| {
                card::cut_out(taken).map(|color| (color, surface(taken, view.axes, leaves, impostor.radius_m)))
            })
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

/// What [`Octahedral`] tells of the surface of a frame; all goes on where nothing is.
fn surface(taken: &Capture, axes: [Vec3; 3], leaves: &[u8], radius_m: f32) -> RgbaImage {
    let (width, height) = taken.color.dimensions();
    let bled = |texel: &(dyn Fn(usize) -> Vec3 + Sync)| {
        let mut layer = Layer::from_fn(width as usize, height as usize, |x, y| {
            let at = y * width as usize + x;
            if taken.depth_m[at].is_finite() { texel(at).extend(1.0) } else { glam::Vec4::ZERO }
        });
        layer.bleed();
        layer.texels
    };
    let normals = bled(&|at| Vec3::from(axes.map(|axis| axis.dot(taken.normal[at]))));
    let others = bled(&|at| Vec3::new(f32::from(leaves[at]) / 255.0, taken.depth_m[at] / radius_m, 0.0));
    let signed = |v: f32| (255.0 * (0.5 + 0.5 * v)).round() as u8;
    RgbaImage::from_fn(width, height, |x, y| {
        let at = (y * width + x) as usize;
        let n = normals[at].truncate().normalize_or(Vec3::Z);
        // Stereographic; what is seen faces the viewer, give or take what a leaf's shading makes of it.
        let place = (n.truncate() / (1.0 + n.z.max(0.0))).clamp_length_max(1.0);
        Rgba([signed(place.x), signed(place.y), (255.0 * others[at].x).round() as u8, signed(others[at].y)])
    })
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repr::trial::{self, built, mask, overlap};
    use crate::repr::{BuiltTree as Tree, Scope};

    fn opened(tree: &Tree) -> (Octahedral, &RgbaImage, &RgbaImage) {
        let Drawn::Octahedral(impostor) = tree.parts[0].drawn else { panic!("not an impostor") };
        let material = &tree.parts[0].part.material;
        (impostor, material.texture.as_ref().unwrap(), material.normal_texture.as_ref().unwrap())
    }

    fn there(alpha: u8) -> bool {
        f32::from(alpha) >= 255.0 * ALPHA_CUTOFF
    }

    #[test]
    fn each_frame_has_the_outline_of_the_tree_from_its_direction() {
        let source = trial::tree();
        let tree = built("octahedral", &["grid=5", "frame_px=64"], &source).unwrap();
        let (impostor, colors, _) = opened(&tree);
        assert_eq!(colors.dimensions(), (320, 320));
        // Front, right, back and left at the corners, from above in the middle, and one in between.
        for (i, j, azimuth_deg, elevation_deg) in [
            (0, 4, 0.0f32, 0.0f32),
            (4, 4, 90.0, 0.0),
            (4, 0, 180.0, 0.0),
            (0, 0, 270.0, 0.0),
            (2, 2, 0.0, 90.0),
            (1, 3, 0.0, 45.0),
        ] {
            let view = View {
                axes: View::axes_from(azimuth_deg.to_radians(), elevation_deg.to_radians()),
                center: impostor.center,
                half_size_m: Vec2::splat(impostor.radius_m),
                slab_m: View::ALL,
                width_px: 64,
                height_px: 64,
            };
            let frame = imageops::crop_imm(colors, 64 * i, 64 * j, 64, 64).to_image();
            let frame: Vec<bool> = frame.pixels().map(|p| there(p[3])).collect();
            let same = overlap(&frame, &mask(source.parts(Scope::Tree), &view));
            assert!(same > 0.93, "frame {i}, {j}: {same}");
        }
    }

    #[test]
    fn depth_and_normals_of_a_block_are_its_own() {
        let source = trial::block();
        let tree = built("octahedral", &["grid=5", "frame_px=64"], &source).unwrap();
        let (impostor, colors, normals) = opened(&tree);
        assert_eq!(impostor.center, Vec3::new(0.0, 1.5, 0.0));
        // Frames by what they see in their middle: its normal and how far it lies before the block's own middle.
        for (i, j, normal, depth_m) in [(2, 2, Vec3::Y, 1.5), (0, 4, Vec3::Z, 0.5), (4, 4, Vec3::X, 1.0), (4, 0, -Vec3::Z, 0.5)] {
            let (x, y) = (64 * i + 32, 64 * j + 32);
            assert!(there(colors.get_pixel(x, y)[3]));
            let [r, g, leaf, a] = normals.get_pixel(x, y).0.map(|v| f32::from(v) / 127.5 - 1.0);
            let [right, up, toward] = view(&impostor, i, j, 64).axes;
            let square = r * r + g * g;
            let seen = (2.0 * r * right + 2.0 * g * up + (1.0 - square) * toward) / (1.0 + square);
            assert!((seen - normal).length() < 0.02, "frame {i}, {j}: {r} {g}");
            assert_eq!(leaf, 1.0, "nothing to tell it from");
            assert!((a * impostor.radius_m - depth_m).abs() < impostor.radius_m / 100.0, "frame {i}, {j}: {a}");
        }
    }

    #[test]
    fn frames_do_not_touch_and_colour_goes_on_under_what_is_not_there() {
        // The trunk fills its frames from top to bottom.
        for source in [trial::block(), trial::bare()] {
            let tree = built("octahedral", &["grid=4", "frame_px=64"], &source).unwrap();
            let (_, colors, _) = opened(&tree);
            let color = colors.get_pixel(32, 32).0;
            for (x, y, texel) in colors.enumerate_pixels() {
                if [x % 64, y % 64].iter().any(|k| *k == 0 || *k == 63) {
                    assert_eq!(texel[3], 0, "{x}, {y}");
                }
                assert!(texel.0[..3].iter().zip(color).all(|(a, b)| a.abs_diff(b) <= 1), "{x}, {y}");
            }
        }
    }

    #[test]
    fn a_bare_tree_and_one_leaf_stand_and_a_point_is_refused() {
        for source in [trial::bare(), trial::one_leaf()] {
            built("octahedral", &["grid=4", "frame_px=32"], &source).unwrap();
        }
        assert!(built("octahedral", &[], &trial::point()).is_err());
    }
}
