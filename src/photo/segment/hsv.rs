//! The paper's segmentation: a fixed hue range, opening, closing, the largest component, holes filled (She §3.1, fig. 7).

use image::RgbImage;

use super::bits::Bits;

/// She §3.1: "Usually, the color of tree's crown is green and its H value is between 90–150°."
pub const HUE_OF_SHE_DEG: (f64, f64) = (90.0, 150.0);

/// The steps of fig. 7 b–e, and the crown.
pub struct Steps {
    /// Pixels in the hue range (7b).
    pub threshold: Bits,
    /// After the opening (7c).
    pub opened: Bits,
    /// After the closing (7d).
    pub closed: Bits,
    /// Largest component, holes filled (7e is its outline).
    pub crown: Bits,
}

/// Runs the paper's steps; radii in pixels of the photograph. Only `allowed` pixels can belong to the crown.
pub fn segment(image: &RgbImage, hue_deg: (f64, f64), opening_px: u32, closing_px: u32, allowed: Option<&Bits>) -> Steps {
    let threshold = in_hue_range(image, hue_deg);
    let threshold = allowed.map_or_else(|| threshold.clone(), |a| threshold.and(a));
    let opened = threshold.open(opening_px);
    let closed = opened.close(closing_px);
    let crown = closed.largest_component().fill_holes();
    Steps { threshold, opened, closed, crown }
}

/// The crown that points choose among the components of the closed set: those that hold an `include` point together, or the largest
/// without an `exclude` point. Where one holds both, a disc of `finger_px` around the excluded point goes.
///
/// # Errors
/// The first included point that no component holds.
pub fn chosen(closed: &Bits, include: &[(u32, u32)], exclude: &[(u32, u32)], finger_px: u32) -> Result<Bits, (u32, u32)> {
    let mut left = closed.fill_holes();
    for &(x, y) in exclude {
        let Some(component) = left.component_at(x as usize, y as usize) else { continue };
        let holds = |&(x, y): &(u32, u32)| component.component_at(x as usize, y as usize).is_some();
        left = left.and(&if include.iter().any(holds) { left.disc(x, y, finger_px).not() } else { component.not() });
    }
    if include.is_empty() {
        return Ok(left.largest_component());
    }
    let mut crown = left.and(&left.not());
    for &(x, y) in include {
        crown = crown.or(&left.component_at(x as usize, y as usize).ok_or((x, y))?);
    }
    Ok(crown)
}

/// Whether a hue lies in the range, both ends included. Hues are angles: -20..20 holds 350.
pub fn in_range(hue_deg: f64, (low, high): (f64, f64)) -> bool {
    (hue_deg - low).rem_euclid(360.0) <= high - low
}

/// The pixels whose hue lies in the range: [`in_range`] of each, without a division.
fn in_hue_range(image: &RgbImage, (low, high): (f64, f64)) -> Bits {
    let (width, raw) = (image.width() as usize, image.as_raw());
    let (low, span) = (low.rem_euclid(360.0) as f32, (high - low) as f32);
    Bits::from_rows(width, image.height() as usize, |y, row| {
        let pixels = &raw[3 * y * width..3 * (y + 1) * width];
        for (word, pixels) in row.iter_mut().zip(pixels.chunks(3 * 64)) {
            let mut inside = [0u8; 64];
            for (flag, p) in inside.iter_mut().zip(pixels.chunks_exact(3)) {
                let (scaled, chroma) = scaled_hue([p[0], p[1], p[2]]);
                // A grey has hue 0 by OpenCV's convention, and 0 ≤ 0 must not let every range take it.
                let chroma = if chroma == 0.0 { 1.0 } else { chroma };
                let above = scaled - low * chroma;
                let above = if above < 0.0 { above + 360.0 * chroma } else { above };
                *flag = u8::from(above <= span * chroma);
            }
            *word = inside.iter().enumerate().fold(0, |w, (i, &v)| w | u64::from(v) << i);
        }
    })
}

/// Hue in degrees times chroma, and chroma (both exact: whole numbers), by OpenCV's definition for floating point RGB: red wins ties
/// for the largest component, then green; greys have hue 0.
#[inline(always)]
fn scaled_hue([r, g, b]: [u8; 3]) -> (f32, f32) {
    let max = r.max(g).max(b);
    let chroma = f32::from(max - r.min(g).min(b));
    let (r8, g8, max8) = (r, g, max);
    let (r, g, b) = (f32::from(r), f32::from(g), f32::from(b));
    let red = 60.0 * (g - b) + if g < b { 360.0 * chroma } else { 0.0 };
    let green = 60.0 * (b - r) + 120.0 * chroma;
    let blue = 60.0 * (r - g) + 240.0 * chroma;
    (
        if r8 == max8 {
            red
        } else if g8 == max8 {
            green
        } else {
            blue
        },
        chroma,
    )
}

/// Hue in degrees, 0 for greys.
pub fn hue_deg(rgb: [u8; 3]) -> f64 {
    let (scaled, chroma) = scaled_hue(rgb);
    if chroma == 0.0 { 0.0 } else { f64::from(scaled) / f64::from(chroma) }
}

/// What people call a hue.
pub fn hue_name(hue_deg: f64) -> &'static str {
    const NAMES: [(f64, &str); 9] = [
        (15.0, "red"),
        (42.0, "orange or brown"),
        (68.0, "yellow"),
        (90.0, "yellow-green"),
        (160.0, "green"),
        (200.0, "cyan"),
        (255.0, "blue"),
        (290.0, "violet"),
        (345.0, "purple or pink"),
    ];
    NAMES.iter().find(|(end, _)| hue_deg < *end).map_or("red", |(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hues_are_opencvs() {
        for (rgb, hue) in [
            ([255, 0, 0], 0.0),
            ([0, 255, 0], 120.0),
            ([0, 0, 255], 240.0),
            ([10, 10, 10], 0.0),
            ([255, 0, 128], 329.882),
            ([30, 60, 0], 90.0),
        ] {
            assert!((hue_deg(rgb) - hue).abs() < 1e-3, "{rgb:?}: {} instead of {hue}", hue_deg(rgb));
        }
    }

    #[test]
    fn both_ends_of_the_range_belong_to_it_and_greys_do_not() {
        let colours = [[30, 60, 0], [0, 60, 30], [31, 60, 0], [0, 60, 31], [60, 60, 60]];
        let image = RgbImage::from_fn(5, 1, |x, _| image::Rgb(colours[x as usize]));
        let inside = in_hue_range(&image, HUE_OF_SHE_DEG).to_mask();
        assert_eq!(inside.as_raw(), [255, 255, 0, 0, 0]);
    }

    #[test]
    fn a_range_across_red_holds_both_its_sides() {
        // Hues 0, 20, 340, 21, 339 and 180.
        let colours = [[90, 0, 0], [60, 20, 0], [60, 0, 20], [60, 21, 0], [60, 0, 21], [0, 60, 60]];
        let image = RgbImage::from_fn(6, 1, |x, _| image::Rgb(colours[x as usize]));
        for (range, expected) in [
            ((-20.0, 20.0), [255, 255, 255, 0, 0, 0]),
            ((340.0, 360.0), [255, 0, 255, 0, 0, 0]),
            ((-180.0, -180.0), [0, 0, 0, 0, 0, 255]),
            ((0.0, 360.0), [255; 6]),
        ] {
            assert_eq!(in_hue_range(&image, range).to_mask().as_raw(), &expected, "{range:?}");
            for (colour, flag) in colours.iter().zip(expected) {
                assert_eq!(in_range(hue_deg(*colour), range), flag == 255, "{colour:?} in {range:?}");
            }
        }
    }
}
