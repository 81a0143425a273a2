//! Mip chains whose alpha survives: ours, after Castaño 2010, "Computing alpha mipmaps".
//!
//! Averaged alpha falls below the cutoff wherever foliage is thinner than half a texel, so that plain mips make distant crowns bald (or,
//! where gaps are the rare thing, close them). Here alpha is spread about the cutoff anew on every level, so that the share of the surface
//! that passes it stays: the surface, not the texels, since a renderer tests alpha between texels. Colours are averaged in linear light,
//! weighted by alpha, over a finest level whose gaps took the colour of their rims.

use glam::{Vec3, Vec4};
use image::{Rgba, RgbaImage};

use super::{Layer, to_linear, to_srgb};

/// What a gap's own colour counts in an average: enough that a level of nothing but gaps has one, too little to be seen.
const GAP_WEIGHT: f32 = 1e-4;

/// Alpha deviates from its mean by this at least once it is tested: what was averaged to an even grey must survive 8 bits.
const CONTRAST: f32 = 0.15;

/// How often the spread of a level's alpha is corrected at most.
const CORRECTIONS: usize = 5;

/// How far equal texels are told apart, in alpha: so little that everything else comes first.
const DITHER: f32 = 0.01;

/// All levels of an sRGB picture with straight alpha, from itself down to one texel; each side is half the one before, rounded down.
///
/// With a `cutoff` (0..=1: what has less alpha is not there) the share of the surface that is there stays the same on every level, and gaps
/// take colours from around them; texels that are there keep theirs to the byte on the finest level. Without one, alpha is averaged as the
/// colours are. A picture without texels gives no level.
pub fn mip_chain(picture: &RgbaImage, cutoff: Option<f32>) -> Vec<RgbaImage> {
    let (width, height) = picture.dimensions();
    if width == 0 || height == 0 {
        return Vec::new();
    }
    let least = cutoff.map_or(0, |cutoff| (cutoff.clamp(0.0, 1.0) * 255.0).ceil() as u8);
    let mut finest = Layer::from_fn(width as usize, height as usize, |x, y| linear(picture.get_pixel(x as u32, y as u32)));
    let alphas = between(&finest);
    let there = alphas.iter().filter(|a| **a * 255.0 >= f32::from(least)).count() as f64 / alphas.len() as f64;
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

/// Alpha between texels, where a renderer tests it: four samples a texel.
fn between(level: &Layer) -> Vec<f32> {
    let half = |i: usize| 0.5 * i as f32 + 0.25;
    let fine = Layer::from_fn(2 * level.width, 2 * level.height, |x, y| level.bilinear(half(x), half(y)));
    fine.texels.iter().map(|t| t.w).collect()
}

/// Alphas of a level, spread about the cutoff `least` so that the share `there` of the surface passes.
fn opened(level: &Layer, there: f64, least: u8) -> Vec<u8> {
    let mut dithered = level.clone();
    for (i, t) in dithered.texels.iter_mut().enumerate() {
        t.w += DITHER * (spread(i % level.width, i / level.width) as f32 - 0.5);
    }
    let mut samples = between(&dithered);
    let (count, wanted) = (samples.len() as f32, (there * samples.len() as f64).round() as usize);
    let mean = samples.iter().sum::<f32>() / count;
    let deviation = (samples.iter().map(|a| (a - mean).powi(2)).sum::<f32>() / count).sqrt();
    samples.sort_unstable_by(|a, b| b.total_cmp(a));
    let cutoff = (f32::from(least) - 0.5) / 255.0;
    if deviation < 1e-6 || wanted == 0 || wanted == samples.len() {
        // All or nothing; a single grey texel is what most of the surface is.
        let limit = |t: &Vec4| if there >= 0.5 { byte(t.w).max(least) } else { byte(t.w).min(least.saturating_sub(1)) };
        return level.texels.iter().map(limit).collect();
    }
    let mut place = wanted;
    let mut alphas = vec![];
    for _ in 0..CORRECTIONS {
        let edge = 0.5 * (samples[place - 1] + samples[place]);
        let gain = (cutoff / edge.max(1e-3)).max(CONTRAST / deviation);
        alphas = dithered.texels.iter().map(|t| byte((cutoff + gain * (t.w - edge)).clamp(0.0, 1.0))).collect();
        // Alpha ends at 0 and 1, so that spreading it moves what lies between texels: as many places as are missing are aimed at in addition.
        let spread = Layer { texels: alphas.iter().map(|a| Vec4::splat(f32::from(*a) / 255.0)).collect(), ..*level };
        let found = between(&spread).iter().filter(|a| **a >= cutoff).count();
        if found.abs_diff(wanted) <= samples.len() / 200 {
            break;
        }
        place = (place + wanted).saturating_sub(found).clamp(1, samples.len() - 1);
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

    /// The share of the surface that is there, looked at more closely than the code does.
    fn share(picture: &RgbaImage, least: u8) -> f64 {
        let layer = Layer::from_fn(picture.width() as usize, picture.height() as usize, |x, y| {
            linear(picture.get_pixel(x as u32, y as u32))
        });
        let samples = Layer::from_fn(5 * layer.width, 5 * layer.height, |x, y| {
            layer.bilinear((x as f32 + 0.5) / 5.0, (y as f32 + 0.5) / 5.0)
        });
        samples.texels.iter().filter(|t| t.w * 255.0 >= f32::from(least) - 0.5).count() as f64 / samples.texels.len() as f64
    }

    /// Noise that does not repeat: a short period leaves a level only a few different alphas, which cannot be opened in fine steps.
    fn picture(width: u32, height: u32, seed: u64) -> RgbaImage {
        RgbaImage::from_fn(width, height, |x, y| {
            let mut bits = seed.wrapping_add(u64::from(y * width + x)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            bits = (bits ^ (bits >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
            let [.., r, g, b, a] = (bits ^ (bits >> 32)).to_le_bytes();
            Rgba([r, g, b, a])
        })
    }

    proptest! {
        #[test]
        fn every_level_has_the_share_of_the_finest(
            (width, height) in (1u32..60, 1u32..60), seed in any::<u64>(), cutoff in 0.1f32..0.9,
        ) {
            let picture = picture(width, height, seed);
            let least = (cutoff * 255.0).ceil() as u8;
            let levels = mip_chain(&picture, Some(cutoff));
            let (mut w, mut h) = (width, height);
            for level in &levels {
                prop_assert_eq!(level.dimensions(), (w, h));
                // Few texels cannot be opened in fine steps.
                let off = (share(level, least) - share(&picture, least)).abs();
                prop_assert!(off <= 0.02 + 1.0 / f64::from(w.min(h)), "{off} at {w}×{h}");
                (w, h) = ((w / 2).max(1), (h / 2).max(1));
            }
            prop_assert_eq!(levels.last().unwrap().dimensions(), (1, 1));
            for (own, first) in picture.pixels().zip(levels[0].pixels()) {
                prop_assert_eq!(own.0[3], first.0[3]);
                prop_assert!(own.0[3] < least || own == first, "what is there keeps its colour");
            }
        }

        #[test]
        fn opaque_pictures_keep_their_mean(side in 1u32..6, seed in any::<u64>()) {
            let mut picture = picture(1 << side, 1 << side, seed);
            picture.pixels_mut().for_each(|p| p.0[3] = 255);
            let mean = |p: &RgbaImage| p.pixels().map(|p| to_linear(p.0[1])).sum::<f32>() / p.pixels().len() as f32;
            let levels = mip_chain(&picture, None);
            prop_assert!((to_srgb(mean(&picture)) as i32 - levels[side as usize].get_pixel(0, 0).0[1] as i32).abs() <= 1);
            prop_assert!(levels.iter().all(|level| level.pixels().all(|p| p.0[3] == 255)));
        }
    }

    #[test]
    fn gaps_take_the_colour_of_their_rims_and_never_show_their_own() {
        let leaf = |x: u32, y: u32| (x / 3 + y / 3).is_multiple_of(2);
        let picture = RgbaImage::from_fn(48, 48, |x, y| if leaf(x, y) { Rgba([60, 120, 30, 255]) } else { Rgba([255, 0, 255, 0]) });
        for level in mip_chain(&picture, Some(0.5)) {
            assert!(level.pixels().all(|p| p.0[0].abs_diff(60) <= 1 && p.0[1].abs_diff(120) <= 1 && p.0[2].abs_diff(30) <= 1));
        }
    }

    #[test]
    fn an_even_grey_is_opened_evenly() {
        let picture = RgbaImage::from_fn(64, 64, |x, y| Rgba([50, 90, 40, if (x + y).is_multiple_of(2) { 255 } else { 0 }]));
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
