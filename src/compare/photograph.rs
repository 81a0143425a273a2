//! A photograph as the truth: the tree cut out of it, held against stand-ins that are drawn from where the photographer stood, in parallel
//! projection (in which the crown's outline was traced) and without light (which the photograph has already). From elsewhere nobody knows
//! the truth: there stand-ins are held against the model's own geometry, which tells how far they agree.

use std::path::Path;

use glam::{DVec2, Vec3, Vec4};
use image::{Rgba, RgbaImage};

use crate::model::pipeline::{self, ModelParams, View};
use crate::photo::{DecodeParams, Hints, decode};
use crate::raster::{Mask, to_linear, to_srgb};
use crate::repr::TreeSource;
use crate::{Error, Result, Seed, Warning};

use super::staging::Stage;

/// The tree of a photograph.
#[derive(Debug)]
pub struct Photograph {
    /// The photograph, opaque where the tree is.
    cut_out: RgbaImage,
    /// Where the tree stands in it, pixels.
    foot_px: DVec2,
    /// Its scale.
    metres_per_px: f64,
}

/// Whether a file is a picture, by its first bytes.
pub fn is_picture(bytes: &[u8]) -> bool {
    image::guess_format(bytes).is_ok()
}

/// The model of a photograph as `sphereboard model` makes it with its defaults, and the photograph as its truth.
///
/// # Errors
/// Those of decoding and of [`pipeline::run`].
pub fn open(path: &Path, seed: Seed) -> Result<(TreeSource, Photograph, Vec<Warning>)> {
    let inside = |cause| Error::InFile { path: path.to_owned(), cause: Box::new(cause) };
    let photo = decode::decode(path, &DecodeParams::default())?;
    let name = path.file_stem().map_or_else(|| "tree".to_owned(), |stem| stem.to_string_lossy().into_owned());
    let view = View { photo, hints: Hints::default(), azimuth_rad: 0.0 };
    let request = pipeline::Request {
        views: std::slice::from_ref(&view),
        params: &ModelParams::default(),
        height_is_given: false,
        seed,
        sources: vec![name.clone()],
    };
    let run = pipeline::run(&request, &|_| ()).map_err(inside)?;
    let products = &run.views[0];
    let seen = products.segmentation.tree.zip(&products.segmentation.gaps, |tree, gap| tree && !gap);
    let photograph =
        Photograph { cut_out: cut_out(&view.photo.image, &seen), foot_px: products.foot_px, metres_per_px: products.metres_per_px };
    Ok((TreeSource::model(name, run.model), photograph, run.warnings))
}

fn cut_out(photo: &image::RgbImage, seen: &Mask) -> RgbaImage {
    RgbaImage::from_fn(photo.width(), photo.height(), |x, y| {
        let [r, g, b] = photo.get_pixel(x, y).0;
        Rgba([r, g, b, if seen.get(i64::from(x), i64::from(y)) { 255 } else { 0 }])
    })
}

impl Photograph {
    /// The tree as high as asked, in the window of [`Stage::photo_shot`]: each pixel the mean of those of the photograph that it covers.
    pub fn seen(&self, stage: &Stage, height_px: f32) -> RgbaImage {
        let side_px = stage.photo_shot(height_px, None).size_px[0];
        let m_per_px = f64::from(stage.height_m()) / f64::from(height_px);
        let middle = stage.bounds.center().as_dvec3();
        let corner = DVec2::new(middle.x, middle.y) + 0.5 * f64::from(side_px) * m_per_px * DVec2::new(-1.0, 1.0);
        let step = m_per_px / self.metres_per_px;
        let first = self.foot_px + DVec2::new(corner.x, -corner.y) / self.metres_per_px;
        RgbaImage::from_fn(side_px, side_px, |x, y| {
            let at = first + step * DVec2::new(f64::from(x), f64::from(y));
            self.mean(at, step)
        })
    }

    /// The mean of a square: colours of what is there, weighted by how much is.
    fn mean(&self, corner: DVec2, side: f64) -> Rgba<u8> {
        let range = |from: f64, size: u32| {
            let low = from.floor().clamp(0.0, f64::from(size)) as u32;
            low..((from + side).ceil().clamp(0.0, f64::from(size)) as u32)
        };
        let share = |pixel: u32, from: f64| (f64::from(pixel + 1).min(from + side) - f64::from(pixel).max(from)).max(0.0);
        let mut sum = Vec4::ZERO;
        for y in range(corner.y, self.cut_out.height()) {
            for x in range(corner.x, self.cut_out.width()) {
                let [r, g, b, a] = self.cut_out.get_pixel(x, y).0;
                if a > 0 {
                    let weight = (share(x, corner.x) * share(y, corner.y)) as f32;
                    sum += weight * Vec3::from([r, g, b].map(to_linear)).extend(1.0);
                }
            }
        }
        let [r, g, b] = (sum.truncate() / sum.w.max(1e-6)).to_array().map(to_srgb);
        let cover = f64::from(sum.w) / (side * side).max(1e-12);
        Rgba([r, g, b, (255.0 * cover.min(1.0)).round() as u8])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Bounds;

    #[test]
    fn the_tree_of_a_photograph_stands_in_the_window_where_the_model_stands() {
        // A tree of 2 m by 4 m, 50 pixels a metre, its foot at (150, 250).
        let cut_out = RgbaImage::from_fn(300, 300, |x, y| {
            if (100..200).contains(&x) && (50..250).contains(&y) { Rgba([90, 120, 60, 255]) } else { Rgba([0; 4]) }
        });
        let photograph = Photograph { cut_out, foot_px: DVec2::new(150.0, 250.0), metres_per_px: 0.02 };
        let stage = Stage { bounds: Bounds { min: Vec3::new(-1.0, 0.0, -1.0), max: Vec3::new(1.0, 4.0, 1.0) } };
        for height_px in [100.0, 33.0] {
            let seen = photograph.seen(&stage, height_px);
            let covered: f64 = seen.pixels().map(|p| f64::from(p.0[3]) / 255.0).sum();
            let expected = f64::from(height_px * height_px) / 2.0;
            assert!((covered / expected - 1.0).abs() < 0.01, "{covered} {expected}");
            let middle = seen.get_pixel(seen.width() / 2, seen.height() / 2).0;
            assert_eq!(middle, [90, 120, 60, 255]);
            let row = |y: u32| (0..seen.width()).map(|x| u32::from(seen.get_pixel(x, y).0[3])).sum::<u32>();
            let (first, last) =
                ((0..seen.height()).find(|&y| row(y) > 0).unwrap(), (0..seen.height()).rfind(|&y| row(y) > 0).unwrap());
            assert!((first + last + 1).abs_diff(seen.height()) <= 1, "in the middle: {first} to {last} of {}", seen.height());
        }
    }

    #[test]
    fn pictures_are_told_from_models() {
        assert!(
            is_picture(b"\x89PNG\r\n\x1a\n0000")
                && is_picture(b"\xff\xd8\xff\xe0")
                && !is_picture(b"glTF\x02\0\0\0")
                && !is_picture(b"")
        );
    }
}
