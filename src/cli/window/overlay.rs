//! Over the picture: white letters on a dark panel, from a bitmap font, and lines.

use font8x8::UnicodeFonts;
use glam::Vec2;
use image::{Rgba, RgbaImage};
use imageproc::drawing::draw_line_segment_mut;

const PANEL: Rgba<u8> = Rgba([0, 0, 0, 150]);
const LETTER: Rgba<u8> = Rgba([255, 255, 255, 255]);
const STROKE: Rgba<u8> = Rgba([255, 214, 64, 255]);
/// Between the panel's border and the letters, pixels of the font.
const MARGIN: u32 = 4;
/// From line to line, pixels of the font.
const LINE: u32 = 10;

/// The lines as a picture, each pixel of the font `scale` pixels wide. Letters that the font lacks are left blank.
pub fn panel(lines: &[String], scale: u32) -> RgbaImage {
    let columns = lines.iter().map(|line| line.chars().count() as u32).max().unwrap_or(0);
    let (width, height) = (8 * columns + 2 * MARGIN, LINE * lines.len() as u32 + 2 * MARGIN);
    let mut small = RgbaImage::from_pixel(width, height, PANEL);
    for (row, line) in lines.iter().enumerate() {
        for (column, letter) in line.chars().enumerate() {
            let bits = font8x8::BASIC_FONTS.get(letter).or_else(|| font8x8::LATIN_FONTS.get(letter)).unwrap_or_default();
            let (left, top) = (MARGIN + 8 * column as u32, MARGIN + LINE * row as u32);
            for (y, bits) in bits.into_iter().enumerate() {
                (0..8).filter(|x| bits >> x & 1 == 1).for_each(|x| small.put_pixel(left + x, top + y as u32, LETTER));
            }
        }
    }
    image::imageops::resize(&small, width * scale, height * scale, image::imageops::FilterType::Nearest)
}

/// The panel with lines under it across a picture of that size, pixels from its top left corner; both may be missing.
pub fn stroked(panel: Option<RgbaImage>, strokes: &[[Vec2; 2]], [width, height]: [u32; 2]) -> Option<RgbaImage> {
    if strokes.is_empty() {
        return panel;
    }
    let mut over = RgbaImage::new(width, height);
    for [from, to] in strokes {
        // Two pixels wide, whichever way it runs.
        for aside in [Vec2::ZERO, Vec2::X, Vec2::Y] {
            draw_line_segment_mut(&mut over, (*from + aside).into(), (*to + aside).into(), STROKE);
        }
    }
    if let Some(panel) = panel {
        image::imageops::replace(&mut over, &panel, 0, 0);
    }
    Some(over)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_run_under_the_text_and_out_of_the_picture() {
        let text = panel(&["L".to_owned()], 1);
        let stroke = [Vec2::new(0.0, 18.0), Vec2::new(300.0, 18.0)];
        assert_eq!(stroked(None, &[], [64, 48]), None);
        assert_eq!(stroked(Some(text.clone()), &[], [64, 48]), Some(text.clone()));
        let over = stroked(Some(text.clone()), &[stroke, [Vec2::ZERO, Vec2::new(9.0, 9.0)]], [64, 48]).unwrap();
        assert_eq!(over.dimensions(), (64, 48));
        assert_eq!(over.get_pixel(63, 18), &STROKE);
        assert_eq!(over.get_pixel(63, 30).0[3], 0, "the picture is seen where there is nothing");
        assert_eq!(over.get_pixel(0, 0), &PANEL);
    }

    #[test]
    fn letters_are_drawn_upright_and_from_left_to_right() {
        let image = panel(&["L ".to_owned()], 1);
        let lit = |x: u32, y: u32| *image.get_pixel(MARGIN + x, MARGIN + y) == LETTER;
        let in_row = |y| (0..8).filter(|&x| lit(x, y)).count();
        assert!(in_row(6) > in_row(0), "an L has its foot below");
        assert!(!(8..16).any(|x| (0..8).any(|y| lit(x, y))), "a space is blank");
    }
}
