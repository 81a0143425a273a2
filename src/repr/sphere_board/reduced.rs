//! Pictures taken finer than they are kept: leaves narrower than a pixel are thinned by the smaller sizes of their own picture, and a heap
//! of them would be bare.

use glam::{Vec3, Vec4};
use image::{GrayImage, Luma, Rgba, RgbaImage};

use crate::raster::{Capture, to_linear, to_srgb};

/// Each pixel the mean of `by` × `by` of what is there, and so whether it shows foliage, 0 to 255.
pub(super) fn reduced(taken: &Capture, leaves: &[u8], by: u32) -> (Capture, Vec<u8>) {
    let (width, height) = (taken.color.width() / by, taken.color.height() / by);
    let pixels = (width * height) as usize;
    let mut small = Capture {
        color: RgbaImage::new(width, height),
        depth_m: vec![f32::NEG_INFINITY; pixels],
        normal: vec![Vec3::ZERO; pixels],
        coverage: GrayImage::new(width, height),
    };
    let mut kinds = vec![0; pixels];
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let at = (y * width + x) as usize;
        let (mut color, mut normal, mut depth_m, mut kind) = (Vec4::ZERO, Vec3::ZERO, 0.0, 0.0);
        for (i, j) in (0..by * by).map(|k| (by * x + k % by, by * y + k / by)) {
            let from = (j * taken.color.width() + i) as usize;
            let covered = f32::from(taken.coverage.as_raw()[from]) / 255.0;
            if covered > 0.0 && taken.depth_m[from].is_finite() {
                let [r, g, b, _] = taken.color.get_pixel(i, j).0;
                color += covered * Vec3::from([r, g, b].map(to_linear)).extend(1.0);
                normal += covered * taken.normal[from];
                depth_m += covered * taken.depth_m[from];
                kind += covered * f32::from(leaves[from]);
            }
        }
        if color.w > 0.0 {
            let coverage = (255.0 * color.w / (by * by) as f32).round() as u8;
            let [r, g, b] = (color.truncate() / color.w).to_array().map(to_srgb);
            small.color.put_pixel(x, y, Rgba([r, g, b, coverage]));
            small.coverage.put_pixel(x, y, Luma([coverage]));
            (small.depth_m[at], small.normal[at]) = (depth_m / color.w, normal.normalize_or(Vec3::Y));
            kinds[at] = (kind / color.w).round() as u8;
        }
    }
    (small, kinds)
}
