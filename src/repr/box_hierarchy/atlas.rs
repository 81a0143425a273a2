//! The pictures of all boxes of one level in one: a grid of squares, each with an empty rim, so that neighbours stay apart in smaller
//! sizes too.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use image::{RgbaImage, imageops};
use rayon::prelude::*;

use super::planes::Plane;
use crate::Result;
use crate::geom::Bounds;
use crate::model::Part;
use crate::raster::{self, View};
use crate::repr::Capture;
use crate::repr::card::{cut_out, tangent_normals};

/// Texels of a picture's rim, on every side.
pub const RIM_PX: u32 = 2;

/// Texels of a box taken at a time: some 50 bytes each while they are, and several boxes are taken at once.
const BATCH_TEXELS: u32 = 1 << 21;

/// Colour with alpha, and normals in tangent space, of a level's pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct Atlas {
    /// sRGB, unlit, straight alpha.
    pub color: Arc<RgbaImage>,
    /// 0.5 + 0.5 n; `None` where they have not come yet.
    pub normals: Option<Arc<RgbaImage>>,
}

/// A picture and where it stands.
#[derive(Debug, Clone)]
pub struct Taken {
    /// With its rim.
    pub color: RgbaImage,
    /// Of the same size.
    pub normals: RgbaImage,
    /// Which of the box's planes.
    pub plane: usize,
}

/// The pictures of `parts` on those planes, `side_px` texels a side with the rim; those that show nothing are left out.
///
/// # Errors
/// Those of [`Capture::take`].
pub fn take(capture: &dyn Capture, parts: &[&Part], planes: &[Plane], side_px: u32) -> Result<Vec<Taken>> {
    let mut pictures = vec![];
    let batch = (BATCH_TEXELS / side_px.pow(2)).max(1) as usize;
    for first in (0..planes.len()).step_by(batch) {
        let planes = &planes[first..planes.len().min(first + batch)];
        let views: Vec<View> = planes.iter().map(|plane| view(plane, side_px)).collect();
        let taken = capture.take(parts, &views)?;
        let picture = |(own, taken): (usize, &raster::Capture)| {
            Some(Taken { color: cut_out(taken)?, normals: tangent_normals(taken, planes[own].axes), plane: first + own })
        };
        pictures.par_extend(taken.par_iter().enumerate().filter_map(picture));
    }
    Ok(pictures)
}

/// The plane's window, grown across by the rim.
pub fn rimmed(window: Bounds, side_px: u32) -> Bounds {
    let rim = window.size() * RIM_PX as f32 / (side_px - 2 * RIM_PX) as f32 * Vec3::new(1.0, 1.0, 0.0);
    Bounds { min: window.min - rim, max: window.max + rim }
}

fn view(plane: &Plane, side_px: u32) -> View {
    View::of_window(plane.axes, rimmed(plane.window, side_px), side_px, side_px)
}

/// Columns and rows of a grid of so many pictures: as square as it gets with a power of two of columns.
pub fn cells(count: u32) -> [u32; 2] {
    let square = f64::from(count).sqrt().ceil() as u32;
    let columns = square.next_power_of_two().max(2).min(count.next_power_of_two());
    [columns, count.div_ceil(columns)]
}

/// Puts pictures of `side_px` into a grid; where each stands comes with it, as texture coordinates of its top left and bottom right.
/// `None` without any.
pub fn packed<'a>(pictures: impl ExactSizeIterator<Item = &'a Taken>, side_px: u32) -> Option<(Atlas, Vec<[Vec2; 2]>)> {
    let count = pictures.len() as u32;
    if count == 0 {
        return None;
    }
    let [columns, rows] = cells(count);
    let mut color = RgbaImage::new(columns * side_px, rows * side_px);
    let mut normals = RgbaImage::from_pixel(columns * side_px, rows * side_px, image::Rgba([128, 128, 255, 255]));
    let size = Vec2::new(columns as f32, rows as f32);
    let mut places = vec![];
    for (number, picture) in (0..count).zip(pictures) {
        let (column, row) = (number % columns, number / columns);
        let at = [column, row].map(|cell| i64::from(cell * side_px));
        imageops::replace(&mut color, &picture.color, at[0], at[1]);
        imageops::replace(&mut normals, &picture.normals, at[0], at[1]);
        let low = Vec2::new(column as f32, row as f32);
        places.push([low / size, (low + 1.0) / size]);
    }
    Some((Atlas { color: Arc::new(color), normals: Some(Arc::new(normals)) }, places))
}
