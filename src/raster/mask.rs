//! A mask: one yes or no per pixel, row by row from the top left.

use image::{GrayImage, Luma};
use imageproc::region_labelling::{Connectivity, connected_components};

/// A rectangle of pixels: `x, y` is its top left corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Rect {
    /// Left column.
    pub x: u32,
    /// Top row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// A set of pixels. Stored as one byte per pixel, 0 or 255, so that it is a grey image without conversion.
#[derive(Clone, PartialEq, Eq)]
pub struct Mask {
    width: u32,
    height: u32,
    data: Vec<u8>,
}

impl std::fmt::Debug for Mask {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Mask {}×{}, {} set", self.width, self.height, self.count())
    }
}

impl Mask {
    /// An empty mask.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, data: vec![0; width as usize * height as usize] }
    }

    /// The mask of the pixels for which `inside(x, y)` holds.
    pub fn from_fn(width: u32, height: u32, mut inside: impl FnMut(u32, u32) -> bool) -> Self {
        let mut mask = Self::new(width, height);
        for (i, value) in mask.data.iter_mut().enumerate() {
            *value = 255 * u8::from(inside(i as u32 % width, i as u32 / width));
        }
        mask
    }

    /// The pixels of a grey image that are at least 128.
    pub fn from_gray(image: &GrayImage) -> Self {
        let data = image.as_raw().iter().map(|&v| if v >= 128 { 255 } else { 0 }).collect();
        Self { width: image.width(), height: image.height(), data }
    }

    /// The mask as a picture: 255 inside, 0 outside.
    pub fn to_gray(&self) -> GrayImage {
        GrayImage::from_raw(self.width, self.height, self.data.clone()).expect("the buffer has width × height bytes")
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// One byte per pixel, 0 or 255, row by row.
    pub fn as_raw(&self) -> &[u8] {
        &self.data
    }

    /// Mutable access to the bytes; keep them 0 or 255.
    pub fn as_raw_mut(&mut self) -> &mut [u8] {
        &mut self.data
    }

    /// Whether the pixel is in the set; `false` outside the image.
    pub fn get(&self, x: i64, y: i64) -> bool {
        (0..i64::from(self.width)).contains(&x)
            && (0..i64::from(self.height)).contains(&y)
            && self.data[y as usize * self.width as usize + x as usize] != 0
    }

    /// Puts a pixel in or out of the set.
    ///
    /// # Panics
    /// When the pixel lies outside the image.
    pub fn set(&mut self, x: u32, y: u32, inside: bool) {
        assert!(x < self.width && y < self.height, "pixel {x},{y} lies outside {}×{}", self.width, self.height);
        self.data[y as usize * self.width as usize + x as usize] = 255 * u8::from(inside);
    }

    /// Pixels in the set.
    pub fn count(&self) -> usize {
        self.data.iter().filter(|&&v| v != 0).count()
    }

    /// The smallest rectangle around the set, `None` when it is empty.
    pub fn bounds(&self) -> Option<Rect> {
        let row = |y: usize| &self.data[y * self.width as usize..(y + 1) * self.width as usize];
        let filled: Vec<usize> = (0..self.height as usize).filter(|&y| row(y).iter().any(|&v| v != 0)).collect();
        let (top, bottom) = (*filled.first()?, *filled.last()?);
        let left = filled.iter().filter_map(|&y| row(y).iter().position(|&v| v != 0)).min()?;
        let right = filled.iter().filter_map(|&y| row(y).iter().rposition(|&v| v != 0)).max()?;
        Some(Rect { x: left as u32, y: top as u32, width: (right - left + 1) as u32, height: (bottom - top + 1) as u32 })
    }

    /// Combines two masks of the same size pixel by pixel.
    ///
    /// # Panics
    /// When the sizes differ.
    pub fn zip(&self, other: &Self, combine: impl Fn(bool, bool) -> bool) -> Self {
        assert_eq!((self.width, self.height), (other.width, other.height), "masks of one size");
        let data = self.data.iter().zip(&other.data).map(|(&a, &b)| 255 * u8::from(combine(a != 0, b != 0))).collect();
        Self { width: self.width, height: self.height, data }
    }

    /// The mask with every hole filled: what does not reach the border from outside is inside.
    pub fn without_holes(&self) -> Self {
        // A rim of one pixel joins everything outside.
        let outside = GrayImage::from_fn(self.width + 2, self.height + 2, |x, y| {
            Luma([u8::from(!self.get(i64::from(x) - 1, i64::from(y) - 1))])
        });
        let labels = connected_components(&outside, Connectivity::Four, Luma([0]));
        let rim = *labels.get_pixel(0, 0);
        Self::from_fn(self.width, self.height, |x, y| *labels.get_pixel(x + 1, y + 1) != rim)
    }

    /// The largest of its pieces, of equal ones the first from the top left; pixels that touch at a corner are of one piece.
    pub fn largest_piece(&self) -> Self {
        let labels = connected_components(&self.to_gray(), Connectivity::Eight, Luma([0]));
        let mut sizes = vec![0usize; labels.iter().max().map_or(0, |&last| last as usize) + 1];
        labels.iter().filter(|&&label| label != 0).for_each(|&label| sizes[label as usize] += 1);
        let largest = (1..sizes.len()).min_by_key(|&label| std::cmp::Reverse(sizes[label]));
        Self::from_fn(self.width, self.height, |x, y| Some(labels.get_pixel(x, y)[0] as usize) == largest)
    }

    /// Its pieces of at least `least` of the largest's size; pixels that touch at a corner are of one piece.
    pub fn without_crumbs(&self, least: f64) -> Self {
        let labels = connected_components(&self.to_gray(), Connectivity::Eight, Luma([0]));
        let mut sizes = vec![0usize; labels.iter().max().map_or(0, |&last| last as usize) + 1];
        labels.iter().filter(|&&label| label != 0).for_each(|&label| sizes[label as usize] += 1);
        let enough = (least * sizes.iter().max().copied().unwrap_or(0) as f64).max(1.0);
        Self::from_fn(self.width, self.height, |x, y| sizes[labels.get_pixel(x, y)[0] as usize] as f64 >= enough)
    }

    /// Intersection over union with a mask of the same size; 1 when both are empty.
    pub fn iou(&self, other: &Self) -> f64 {
        assert_eq!((self.width, self.height), (other.width, other.height), "masks of one size");
        let (mut both, mut either) = (0usize, 0usize);
        for (&a, &b) in self.data.iter().zip(&other.data) {
            both += usize::from(a & b != 0);
            either += usize::from(a | b != 0);
        }
        if either == 0 { 1.0 } else { both as f64 / either as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(rows: &[&str]) -> Mask {
        Mask::from_fn(rows[0].len() as u32, rows.len() as u32, |x, y| rows[y as usize].as_bytes()[x as usize] == b'#')
    }

    #[test]
    fn holes_are_filled_and_bays_are_not() {
        let found = drawn(&["####.", "#..#.", "#.##.", "##.##", "###.#"]).without_holes();
        // The hole in the middle is shut in; the notch below reaches the border by a side, not a corner.
        assert_eq!(found, drawn(&["####.", "####.", "####.", "##.##", "###.#"]).zip(&found, |a, b| a || b));
        assert!(found.get(1, 1) && found.get(2, 1) && found.get(1, 2) && !found.get(3, 4) && !found.get(4, 0));
        assert_eq!(Mask::new(0, 0).without_holes().count() + Mask::new(3, 2).without_holes().count(), 0);
    }

    #[test]
    fn the_largest_piece_stays() {
        let found = drawn(&["##..#", "....#", ".#.#.", "#...."]).largest_piece();
        assert_eq!(found, drawn(&["....#", "....#", "...#.", "....."]));
        assert_eq!(Mask::new(3, 2).largest_piece().count(), 0);
    }
}
