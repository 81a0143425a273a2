//! Mip chains whose alpha survives: ours, after Castaño 2010, "Computing alpha mipmaps".
//!
//! Averaged alpha falls below the cutoff wherever foliage is thinner than half a texel, so that plain mips make distant crowns bald (or,
//! where gaps are the rare thing, close them). Here every level opens as large a share of its texels as the finest one does: those of the
//! least alpha. Colours are averaged in linear light, weighted by alpha, over a finest level whose gaps took the colour of their rims.

use glam::{Vec3, Vec4};
use image::{Rgba, RgbaImage};

use super::{Layer, to_linear, to_srgb};

/// What a gap's own colour counts in an average: enough that a level of nothing but gaps has one, too little to be seen.
const GAP_WEIGHT: f32 = 1e-4;

/// All levels of an sRGB picture with straight alpha, from itself down to one texel; each side is half the one before, rounded down.
///
/// With a `cutoff` (0..=1: texels of less alpha are not there) the share of texels that are there stays the same on every level, to one
/// texel, and gaps take colours from around them; texels that are there keep theirs to the byte on the finest level. Without one, alpha
/// is averaged as the colours are. A picture without texels gives no level.
pub fn mip_chain(picture: &RgbaImage, cutoff: Option<f32>) -> Vec<RgbaImage> {
    let (width, height) = picture.dimensions();
    if width == 0 || height == 0 {
        return Vec::new();
    }
    let least = cutoff.map_or(0, |cutoff| (cutoff.clamp(0.0, 1.0) * 255.0).ceil() as u8);
    let mut finest = Layer::from_fn(width as usize, height as usize, |x, y| linear(picture.get_pixel(x as u32, y as u32)));
    let there = picture.pixels().filter(|p| p.0[3] >= least).count() as f64 / picture.pixels().len() as f64;
    let mut first = picture.clone();
    if least > 0 {
        bleed(&mut finest, f32::from(least) / 255.0);
        for (pixel, texel) in first.pixels_mut().zip(&finest.texels).filter(|(p, _)| p.0[3] < least) {
            *pixel = encoded(*texel, pixel.0[3]);
        }
    }
    let mut levels = vec![first];
    let mut level = finest;
    while level.texels.len() > 1 {
        level = halved(&level);
        let alphas = if least > 0 { opened(&level, there, least) } else { level.texels.iter().map(|t| byte(t.w)).collect() };
        let texel = |x: u32, y: u32| {
            let i = y as usize * level.width + x as usize;
            encoded(level.texels[i], alphas[i])
        };
        levels.push(RgbaImage::from_fn(level.width as u32, level.height as u32, texel));
    }
    levels
}

fn linear(pixel: &Rgba<u8>) -> Vec4 {
    let [r, g, b, a] = pixel.0;
    Vec3::from([r, g, b].map(to_linear)).extend(f32::from(a) / 255.0)
}

fn encoded(texel: Vec4, alpha: u8) -> Rgba<u8> {
    let [r, g, b] = texel.truncate().to_array().map(to_srgb);
    Rgba([r, g, b, alpha])
}

fn byte(alpha: f32) -> u8 {
    (255.0 * alpha).round() as u8
}

/// Gaps take their surroundings' colours; texels of alpha `least` and more keep their own.
fn bleed(layer: &mut Layer, least: f32) {
    let mut colors = layer.clone();
    colors.texels.iter_mut().for_each(|t| t.w = (t.w / least).min(1.0));
    colors.bleed();
    layer.texels.iter_mut().zip(&colors.texels).filter(|(t, _)| t.w < least).for_each(|(t, c)| *t = c.truncate().extend(t.w));
}

/// The next level: area averages, colours weighted by alpha.
fn halved(fine: &Layer) -> Layer {
    let (width, height) = ((fine.width / 2).max(1), (fine.height / 2).max(1));
    let (across, down) = (spans(fine.width, width), spans(fine.height, height));
    Layer::from_fn(width, height, |x, y| {
        let (mut color, mut alpha, mut weight, mut area) = (Vec3::ZERO, 0.0, 0.0, 0.0);
        for &(row, tall) in &down[y] {
            for &(column, wide) in &across[x] {
                let (texel, part) = (fine.texels[row * fine.width + column], tall * wide);
                let counts = part * (texel.w + GAP_WEIGHT);
                color += counts * texel.truncate();
                weight += counts;
                alpha += part * texel.w;
                area += part;
            }
        }
        (color / weight).extend(alpha / area)
    })
}

/// The texels of a row of `fine` that each texel of a row of `coarse` covers, with how much of each.
fn spans(fine: usize, coarse: usize) -> Vec<Vec<(usize, f32)>> {
    let step = fine as f64 / coarse as f64;
    let span = |i: usize| {
        let (from, to) = (i as f64 * step, (i + 1) as f64 * step);
        let texels = from.floor() as usize..(to.ceil() as usize).min(fine);
        texels.map(|t| (t, (to.min(t as f64 + 1.0) - from.max(t as f64)) as f32)).collect()
    };
    (0..coarse).map(span).collect()
}

/// Alphas of a level of which the share `there` has `least` and more: scaled so that the cutoff falls where that share ends.
fn opened(level: &Layer, there: f64, least: u8) -> Vec<u8> {
    let alpha = |i: usize| level.texels[i].w;
    let wanted = (there * level.texels.len() as f64).round() as usize;
    let mut order: Vec<usize> = (0..level.texels.len()).collect();
    // Most alpha first. Equals are told apart by a sequence that spreads them evenly, so that even a level of one grey keeps its share.
    let rank = |i: usize| spread(i % level.width, i / level.width);
    order.sort_unstable_by(|&a, &b| alpha(b).total_cmp(&alpha(a)).then(rank(a).total_cmp(&rank(b))).then(a.cmp(&b)));
    let edge = match (wanted.checked_sub(1).map(|last| alpha(order[last])), order.get(wanted).map(|&next| alpha(next))) {
        (Some(last), Some(next)) => 0.5 * (last + next),
        (last, next) => last.or(next).unwrap_or(1.0),
    };
    let scale = f32::from(least) / 255.0 / edge.max(1e-3);
    let mut alphas = vec![0; level.texels.len()];
    for (place, &i) in order.iter().enumerate() {
        let scaled = byte((alpha(i) * scale).min(1.0));
        alphas[i] = if place < wanted { scaled.max(least) } else { scaled.min(least - 1) };
    }
    alphas
}

/// A number in 0..1 per texel whose small values lie evenly over the picture (Roberts 2018, the R2 sequence).
fn spread(x: usize, y: usize) -> f64 {
    (0.754_877_666_246_693 * x as f64 + 0.569_840_290_998_053 * y as f64).fract()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn share(picture: &RgbaImage, least: u8) -> f64 {
        picture.pixels().filter(|p| p.0[3] >= least).count() as f64 / picture.pixels().len() as f64
    }

    fn picture(width: u32, height: u32, bytes: &[u8]) -> RgbaImage {
        RgbaImage::from_fn(width, height, |x, y| {
            let at = |k: u32| bytes[(4 * (y * width + x) + k) as usize % bytes.len()];
            Rgba([at(0), at(1), at(2), at(3)])
        })
    }

    proptest! {
        #[test]
        fn every_level_has_the_share_of_the_finest(
            (width, height) in (1u32..40, 1u32..40), bytes in prop::collection::vec(any::<u8>(), 1..400), cutoff in 0.01f32..1.0,
        ) {
            let picture = picture(width, height, &bytes);
            let least = (cutoff * 255.0).ceil() as u8;
            let levels = mip_chain(&picture, Some(cutoff));
            let (mut w, mut h) = (width, height);
            for level in &levels {
                prop_assert_eq!(level.dimensions(), (w, h));
                prop_assert!((share(level, least) - share(&picture, least)).abs() <= 0.5 / f64::from(w * h) + 1e-9);
                (w, h) = ((w / 2).max(1), (h / 2).max(1));
            }
            prop_assert_eq!(levels.last().unwrap().dimensions(), (1, 1));
            for (own, first) in picture.pixels().zip(levels[0].pixels()) {
                prop_assert_eq!(own.0[3], first.0[3]);
                prop_assert!(own.0[3] < least || own == first, "what is there keeps its colour");
            }
        }

        #[test]
        fn opaque_pictures_keep_their_mean(side in 1u32..6, bytes in prop::collection::vec(any::<u8>(), 1..400)) {
            let mut picture = picture(1 << side, 1 << side, &bytes);
            picture.pixels_mut().for_each(|p| p.0[3] = 255);
            let mean = |p: &RgbaImage| p.pixels().map(|p| to_linear(p.0[1])).sum::<f32>() / p.pixels().len() as f32;
            let levels = mip_chain(&picture, None);
            prop_assert!((to_srgb(mean(&picture)) as i32 - levels[side as usize].get_pixel(0, 0).0[1] as i32).abs() <= 1);
            prop_assert!(levels.iter().all(|level| level.pixels().all(|p| p.0[3] == 255)));
        }
    }

    #[test]
    fn gaps_take_the_colour_of_their_rims_and_never_show_their_own() {
        let leaf = |x: u32, y: u32| (x / 3 + y / 3) % 2 == 0;
        let picture = RgbaImage::from_fn(48, 48, |x, y| if leaf(x, y) { Rgba([60, 120, 30, 255]) } else { Rgba([255, 0, 255, 0]) });
        for level in mip_chain(&picture, Some(0.5)) {
            assert!(level.pixels().all(|p| p.0[0].abs_diff(60) <= 1 && p.0[1].abs_diff(120) <= 1 && p.0[2].abs_diff(30) <= 1));
        }
    }

    #[test]
    fn an_even_grey_is_opened_evenly() {
        let picture = RgbaImage::from_fn(64, 64, |x, y| Rgba([50, 90, 40, if (x + y) % 2 == 0 { 255 } else { 0 }]));
        let level = &mip_chain(&picture, Some(0.5))[1];
        for (x, y) in [(0, 0), (16, 0), (0, 16), (16, 16)] {
            let quarter = image::imageops::crop_imm(level, x, y, 16, 16).to_image();
            assert!((share(&quarter, 128) - 0.5).abs() < 0.05, "{x} {y}: {}", share(&quarter, 128));
        }
    }

    #[test]
    fn nothing_and_all_gaps_have_their_levels() {
        assert!(mip_chain(&RgbaImage::new(0, 3), Some(0.5)).is_empty());
        assert!(mip_chain(&RgbaImage::new(5, 3), Some(0.5)).iter().all(|level| level.pixels().all(|p| p.0[3] < 128)));
    }
}
