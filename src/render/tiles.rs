//! Which parts of the picture trees touch: work on outlines is done there only. Tiles are of [`TILE_PX`] × [`TILE_PX`] pixels.

use glam::{Mat4, Vec3};

use crate::geom::Bounds;
use crate::gpu::layout::TILE_PX;

/// A set of tiles of one picture.
#[derive(Debug, Clone)]
pub struct Tiles {
    across: u32,
    down: u32,
    taken: Vec<bool>,
}

impl Tiles {
    /// None of the tiles of a picture.
    pub fn none([width, height]: [u32; 2]) -> Self {
        let (across, down) = (width.div_ceil(TILE_PX), height.div_ceil(TILE_PX));
        Self { across, down, taken: vec![false; across as usize * down as usize] }
    }

    /// Adds every tile that a rectangle touches: left, top, right, bottom in pixels, of which any part may lie outside.
    pub fn add(&mut self, [left, top, right, bottom]: [f32; 4]) {
        let tile = |px: f32, count: u32| (px.max(0.0) as u32 / TILE_PX).min(count);
        let (x0, x1) = (tile(left, self.across), tile(right, self.across.saturating_sub(1)));
        let (y0, y1) = (tile(top, self.down), tile(bottom, self.down.saturating_sub(1)));
        if right < 0.0 || bottom < 0.0 || x0 > x1 || y0 > y1 {
            return;
        }
        for y in y0..=y1 {
            let row = (y * self.across) as usize;
            self.taken[row + x0 as usize..=row + x1 as usize].fill(true);
        }
    }

    /// Adds the tiles of another set of the same picture.
    pub fn merge(&mut self, other: &Self) {
        self.taken.iter_mut().zip(&other.taken).for_each(|(taken, other)| *taken |= other);
    }

    /// Column | row << 16 of every tile in the set, row by row.
    pub fn list(&self) -> Vec<u32> {
        let taken = self.taken.iter().enumerate().filter(|(_, taken)| **taken);
        taken.map(|(i, _)| (i as u32 % self.across) | ((i as u32 / self.across) << 16)).collect()
    }
}

/// The rectangle of the picture that a box is seen in: left, top, right, bottom in pixels; the whole picture when the box reaches behind
/// the viewer, `None` when it lies outside.
pub fn screen_rect(clip_from_object: &Mat4, bounds: Bounds, [width, height]: [u32; 2]) -> Option<[f32; 4]> {
    let (width, height) = (width as f32, height as f32);
    let mut rect = [f32::MAX, f32::MAX, f32::MIN, f32::MIN];
    let (mut behind, mut before) = (false, false);
    for corner in 0..8 {
        let pick = |bit: u32, low: f32, high: f32| if corner & bit == 0 { low } else { high };
        let (a, b) = (bounds.min, bounds.max);
        let clip = *clip_from_object * Vec3::new(pick(1, a.x, b.x), pick(2, a.y, b.y), pick(4, a.z, b.z)).extend(1.0);
        if clip.w <= 0.0 || clip.z > clip.w {
            behind = true;
            continue;
        }
        before = true;
        let (x, y) = ((0.5 + 0.5 * clip.x / clip.w) * width, (0.5 - 0.5 * clip.y / clip.w) * height);
        rect = [rect[0].min(x), rect[1].min(y), rect[2].max(x), rect[3].max(y)];
    }
    if behind {
        return before.then_some([0.0, 0.0, width, height]);
    }
    let seen = rect[2] >= 0.0 && rect[3] >= 0.0 && rect[0] < width && rect[1] < height;
    seen.then_some(rect)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rectangle_touches_the_tiles_under_it_once() {
        let mut tiles = Tiles::none([40, 20]);
        tiles.add([15.0, 3.0, 16.0, 3.5]);
        tiles.add([16.0, 0.0, 20.0, 15.9]);
        assert_eq!(tiles.list(), [0, 1]);
        tiles.add([-100.0, -100.0, 1e9, 1e9]);
        assert_eq!(tiles.list(), [0, 1, 2, 1 << 16, 1 | 1 << 16, 2 | 1 << 16]);
    }

    #[test]
    fn what_lies_outside_touches_nothing() {
        let mut tiles = Tiles::none([33, 17]);
        for rect in [[-9.0, 0.0, -1.0, 5.0], [0.0, -9.0, 5.0, -0.5], [48.0, 0.0, 60.0, 5.0], [0.0, 32.0, 5.0, 90.0]] {
            tiles.add(rect);
        }
        assert!(tiles.list().is_empty());
    }

    #[test]
    fn a_box_is_seen_where_it_is() {
        let clip = Mat4::from_scale(Vec3::new(0.5, 0.5, 0.1));
        let bounds = Bounds { min: Vec3::new(-1.0, 0.0, 1.0), max: Vec3::new(1.0, 1.0, 2.0) };
        assert_eq!(screen_rect(&clip, bounds, [100, 100]), Some([25.0, 25.0, 75.0, 50.0]));
        let outside = Bounds { min: Vec3::new(3.0, 0.0, 1.0), max: Vec3::new(4.0, 1.0, 2.0) };
        assert_eq!(screen_rect(&clip, outside, [100, 100]), None);
        let behind = Bounds { min: Vec3::new(-1.0, 0.0, 1.0), max: Vec3::new(1.0, 1.0, 20.0) };
        assert_eq!(screen_rect(&clip, behind, [100, 100]), Some([0.0, 0.0, 100.0, 100.0]));
    }
}
