//! Small drawing helpers: tint, lines, dots, panels side by side.

use glam::DVec2;
use image::{Rgb, RgbImage, RgbaImage, imageops};
use imageproc::drawing::{draw_antialiased_line_segment_mut, draw_filled_circle_mut, draw_hollow_rect_mut};
use imageproc::pixelops::interpolate;
use imageproc::rect;

use crate::raster::{Mask, Rect};

/// Colour of the crown's outline.
pub const OUTLINE: Rgb<u8> = Rgb([255, 45, 45]);
/// Colour of left feature points.
pub const LEFT: Rgb<u8> = Rgb([60, 140, 255]);
/// Colour of right feature points.
pub const RIGHT: Rgb<u8> = Rgb([255, 190, 40]);
/// Background of drawn panels.
pub const PAPER: Rgb<u8> = Rgb([250, 250, 247]);

/// The photograph with everything outside the mask faded towards paper and the mask's border drawn.
pub fn over_photo(photo: &RgbImage, mask: &Mask) -> RgbImage {
    RgbImage::from_fn(photo.width(), photo.height(), |x, y| {
        let (i, j) = (i64::from(x), i64::from(y));
        let pixel = *photo.get_pixel(x, y);
        if !mask.get(i, j) {
            return interpolate(pixel, PAPER, 0.35);
        }
        let inner = [(1, 0), (-1, 0), (0, 1), (0, -1)].iter().all(|&(dx, dy)| mask.get(i + dx, j + dy));
        if inner { pixel } else { OUTLINE }
    })
}

/// A line of `points`, closed or open.
pub fn polyline(image: &mut RgbImage, points: &[DVec2], closed: bool, color: Rgb<u8>) {
    let ends = points.iter().skip(1).chain(points.first().filter(|_| closed));
    for (a, b) in points.iter().zip(ends) {
        let pixel = |p: &DVec2| (p.x.round() as i32, p.y.round() as i32);
        draw_antialiased_line_segment_mut(image, pixel(a), pixel(b), color, interpolate);
    }
}

/// A dot at each of `points`.
pub fn dots(image: &mut RgbImage, points: impl IntoIterator<Item = DVec2>, radius_px: i32, color: Rgb<u8>) {
    for p in points {
        draw_filled_circle_mut(image, (p.x.round() as i32, p.y.round() as i32), radius_px, color);
    }
}

/// The border of `area`, two pixels wide.
pub fn frame(image: &mut RgbImage, area: Rect, color: Rgb<u8>) {
    for grow in 0..2 {
        let size = (area.width + 2 * grow, area.height + 2 * grow);
        let border = rect::Rect::at(area.x as i32 - grow as i32, area.y as i32 - grow as i32).of_size(size.0.max(1), size.1.max(1));
        draw_hollow_rect_mut(image, border, color);
    }
}

/// The colours alone.
pub fn opaque(image: &RgbaImage) -> RgbImage {
    RgbImage::from_fn(image.width(), image.height(), |x, y| {
        let [r, g, b, _] = image.get_pixel(x, y).0;
        Rgb([r, g, b])
    })
}

/// `image` scaled to `height`, its shape kept.
pub fn to_height(image: &RgbImage, height: u32) -> RgbImage {
    let width = (f64::from(image.width()) * f64::from(height) / f64::from(image.height())).round().max(1.0) as u32;
    let filter = if height < image.height() { imageops::FilterType::Triangle } else { imageops::FilterType::CatmullRom };
    imageops::resize(image, width, height, filter)
}

/// Panels side by side on paper, tops aligned, `gap` pixels apart.
pub fn side_by_side(panels: &[RgbImage], gap: u32) -> RgbImage {
    let width = panels.iter().map(|p| p.width() + gap).sum::<u32>().saturating_sub(gap).max(1);
    let mut sheet = RgbImage::from_pixel(width, panels.iter().map(RgbImage::height).max().unwrap_or(1), PAPER);
    let mut x = 0;
    for panel in panels {
        imageops::replace(&mut sheet, panel, i64::from(x), 0);
        x += panel.width() + gap;
    }
    sheet
}

/// Rows below each other on paper, left edges aligned, `gap` pixels apart.
pub fn stacked(rows: &[RgbImage], gap: u32) -> RgbImage {
    let height = rows.iter().map(|r| r.height() + gap).sum::<u32>().saturating_sub(gap).max(1);
    let mut sheet = RgbImage::from_pixel(rows.iter().map(RgbImage::width).max().unwrap_or(1), height, PAPER);
    let mut y = 0;
    for row in rows {
        imageops::replace(&mut sheet, row, 0, i64::from(y));
        y += row.height() + gap;
    }
    sheet
}
