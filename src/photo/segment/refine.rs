//! From the reduced photograph's crown back to full size: in the band along the outline each pixel joins the side whose colours, just
//! here, are nearer to its own.

use image::RgbImage;

use super::bits::Bits;
use super::small::{Plane, Small};

/// Half side, in reduced pixels, of the window in which the two sides' colours are taken.
const REACH: usize = 5;
/// How much colour may move the outline, in reduced pixels.
const TRUST_PX: f32 = 1.5;

/// The crown at the photograph's size: one component, holes filled, within `allowed`.
pub fn refine(image: &RgbImage, small: &Small, crown: &[bool], allowed: Option<&Bits>) -> Bits {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let soft = signed(small, crown);
    let [inner, outer] = [true, false].map(|side| local_colour(small, crown, side));
    let (sx, sy) = (small.width as f32 / width as f32, small.height as f32 / height as f32);
    let raw = image.as_raw();
    let bits = Bits::from_rows(width, height, |y, row| {
        let pixels = &raw[3 * y * width..3 * (y + 1) * width];
        let (y0, y1, ty) = between((y as f32 + 0.5) * sy, small.height);
        for (x, p) in pixels.chunks_exact(3).enumerate() {
            let (x0, x1, tx) = between((x as f32 + 0.5) * sx, small.width);
            let (a, b, c, d) = (y0 * small.width + x0, y0 * small.width + x1, y1 * small.width + x0, y1 * small.width + x1);
            let level = (soft[a] * (1.0 - tx) + soft[b] * tx) * (1.0 - ty) + (soft[c] * (1.0 - tx) + soft[d] * tx) * ty;
            let inside = if level.abs() >= TRUST_PX {
                level > 0.0
            } else {
                let cell = if ty < 0.5 { y0 } else { y1 } * small.width + if tx < 0.5 { x0 } else { x1 };
                level + TRUST_PX * side([p[0], p[1], p[2]], &inner[cell], &outer[cell]) > 0.0
            };
            row[x / 64] |= u64::from(inside) << (x % 64);
        }
    });
    // Colour decides pixel by pixel; a third of a reduced pixel is noise.
    let radius = (0.35 / sx) as u32;
    let clean = bits.close(radius).open(radius);
    let clean = allowed.map_or_else(|| clean.clone(), |a| clean.and(a));
    clean.largest_component().fill_holes()
}

/// Two neighbouring cells around a coordinate, and how far it is to the second.
fn between(v: f32, n: usize) -> (usize, usize, f32) {
    let v = (v - 0.5).clamp(0.0, (n - 1) as f32);
    let i = v as usize;
    (i, (i + 1).min(n - 1), v.fract())
}

/// Distance to the crown's border in reduced pixels, positive inside, smoothed; exact only near the border, which is all that is asked.
fn signed(small: &Small, crown: &[bool]) -> Plane {
    let plane: Plane = crown.iter().map(|&c| if c { 1.0 } else { -1.0 }).collect();
    // The mean over a window of 2r+1 pixels falls from 1 to -1 over that length.
    small.mean(&small.mean(&plane, 1), 1).iter().map(|v| 2.5 * v).collect()
}

/// Mean colour of one side around each pixel; `None` where the window has nothing of that side.
fn local_colour(small: &Small, crown: &[bool], side: bool) -> Vec<Option<[f32; 3]>> {
    let weight: Plane = crown.iter().map(|&c| f32::from(u8::from(c == side))).collect();
    let share = small.mean(&weight, REACH);
    let channel = |c: usize| small.mean(&small.rgb.iter().zip(&weight).map(|(p, w)| p[c] * w).collect::<Plane>(), REACH);
    let channels = [channel(0), channel(1), channel(2)];
    (0..small.count()).map(|i| (share[i] > 0.05).then(|| [0, 1, 2].map(|c: usize| channels[c][i] / share[i]))).collect()
}

/// Which colour a pixel is nearer to: 1 the inner, -1 the outer, 0 when the two say nothing.
fn side(p: [u8; 3], inner: &Option<[f32; 3]>, outer: &Option<[f32; 3]>) -> f32 {
    let (Some(inner), Some(outer)) = (inner, outer) else { return 0.0 };
    let to = |c: &[f32; 3]| (0..3).map(|i| (f32::from(p[i]) - c[i]).powi(2)).sum::<f32>();
    let apart: f32 = (0..3).map(|i| (inner[i] - outer[i]).powi(2)).sum();
    ((to(outer) - to(inner)) / (apart + 400.0)).clamp(-1.0, 1.0)
}
