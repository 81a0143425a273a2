//! Textures as the rasteriser samples them: in linear light, with their box-filtered halvings, trilinear.

use glam::{Vec2, Vec4};
use image::{Rgba, RgbaImage};

use super::layer::floor;
use super::{Wrap, to_linear};

/// A texture as the rasteriser samples it, with its smaller sizes. Made once, it serves any number of pictures. Colours are averaged
/// weighted by alpha, so that hidden ones do not bleed in.
#[derive(Debug)]
pub struct Texture {
    levels: Vec<Level>,
}

#[derive(Debug)]
struct Level {
    width: usize,
    height: usize,
    texels: Vec<Vec4>,
}

impl Texture {
    /// `None` for a picture without texels.
    pub fn of(picture: &RgbaImage) -> Option<Self> {
        if picture.width() == 0 || picture.height() == 0 {
            return None;
        }
        let texel = |p: &Rgba<u8>| Vec4::new(to_linear(p[0]), to_linear(p[1]), to_linear(p[2]), f32::from(p[3]) / 255.0);
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let mut levels = vec![Level { width, height, texels: picture.pixels().map(texel).collect() }];
        while let Some(next) = levels.last().and_then(Level::halved) {
            levels.push(next);
        }
        Some(Self { levels })
    }

    /// Columns and rows of the finest level.
    pub(super) fn size(&self) -> Vec2 {
        Vec2::new(self.levels[0].width as f32, self.levels[0].height as f32)
    }

    /// Bilinear in each of the two nearest levels, linear between them.
    pub(super) fn sample(&self, uv: Vec2, level: f32, wrap: Wrap) -> Vec4 {
        let level = level.clamp(0.0, (self.levels.len() - 1) as f32);
        let fine = level as usize;
        let part = level - fine as f32;
        let near = self.levels[fine].sample(uv, wrap);
        if part == 0.0 { near } else { near.lerp(self.levels[fine + 1].sample(uv, wrap), part) }
    }
}

impl Level {
    fn halved(&self) -> Option<Self> {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        if (width, height) == (self.width, self.height) {
            return None;
        }
        let texel = |i: usize| {
            let (x, y) = (2 * (i % width), 2 * (i / width));
            let (x1, y1) = ((x + 1).min(self.width - 1), (y + 1).min(self.height - 1));
            let four = [(x, y), (x1, y), (x, y1), (x1, y1)].map(|(x, y)| self.texels[y * self.width + x]);
            let alpha: f32 = four.iter().map(|t| t.w).sum();
            let weight = |t: &Vec4| if alpha > 0.0 { t.w / alpha } else { 0.25 };
            four.iter().map(|t| weight(t) * t.truncate()).sum::<glam::Vec3>().extend(0.25 * alpha)
        };
        Some(Self { width, height, texels: (0..width * height).map(texel).collect() })
    }

    fn sample(&self, uv: Vec2, wrap: Wrap) -> Vec4 {
        let (x, y) = (uv.x * self.width as f32 - 0.5, uv.y * self.height as f32 - 0.5);
        if !(x.is_finite() && y.is_finite()) {
            return Vec4::ZERO;
        }
        // From 2²³ on every number is whole.
        let whole = |v: f32| if v.abs() < 8_388_608.0 { floor(v) } else { v };
        let (x0, y0) = (whole(x), whole(y));
        let columns = [x0, x0 + 1.0].map(|i| texel(i, self.width, wrap));
        let rows = [y0, y0 + 1.0].map(|i| &self.texels[texel(i, self.height, wrap) * self.width..]);
        let across = |row: &[Vec4]| row[columns[0]].lerp(row[columns[1]], x - x0);
        across(rows[0]).lerp(across(rows[1]), y - y0)
    }
}

/// Which of `n` texels in a line a whole number means.
fn texel(i: f32, n: usize, wrap: Wrap) -> usize {
    if i >= 0.0 && i < n as f32 {
        return i as u32 as usize;
    }
    match wrap {
        Wrap::Clamp => (i.max(0.0) as usize).min(n - 1),
        Wrap::Repeat => (i.rem_euclid(n as f32) as usize).min(n - 1),
    }
}
