//! Is it foliage? The colours of what was found, and the refusals for pictures without a crown.

use image::RgbImage;

use super::features::Scene;
use super::small::Small;
use super::{hsv, small};
use crate::{Error, Result};

/// Chroma (CIE L*a*b*) from which a colour has a hue worth naming.
const COLOURED: f32 = 8.0;
/// Share of leaf-coloured pixels below which a crown is no crown. In leaf, dark conifers and silhouettes at dusk included, it is 0.2 and more.
const FEWEST_LEAVES: f32 = 0.12;
/// Share of dark masses from which a colourless crown has leaves: the bare tree of the shared photographs has 0.20, a dark purple plum
/// 0.43, a painted black crown 0.60.
const LEAST_MASSIVE: f32 = 0.3;

/// Refuses a picture that is all sky, or whose best region has no leaves.
pub fn check(image: &RgbImage, scene: &Scene, crown: &[bool]) -> Result<()> {
    let count = crown.iter().filter(|&&c| c).count();
    let sky = scene.sky.grown.iter().filter(|&&g| g).count();
    if 100 * sky >= 97 * crown.len() {
        return Err(Error::NothingToSee { what: "sky" });
    }
    let chroma = |i: usize| scene.small.lab[i][1].hypot(scene.small.lab[i][2]);
    let all_grey = (0..crown.len()).filter(|&i| chroma(i) > 3.0).count() * 50 < crown.len();
    let leaves = (0..crown.len()).filter(|&i| crown[i] && leafy(scene.small.lab[i])).count();
    if count > 0 && (all_grey || leaves as f32 >= FEWEST_LEAVES * count as f32) {
        return Ok(());
    }
    let coloured = (0..crown.len()).filter(|&i| crown[i] && chroma(i) > COLOURED).count();
    if count > 0 && 2 * coloured < count && sky > 0 {
        let massive = massive_share(image, scene, crown);
        return if massive >= LEAST_MASSIVE { Ok(()) } else { Err(Error::Leafless) };
    }
    Err(none(scene, String::new()))
}

/// The share of the crown that is dark and broad: of the pixels nearer the crown's dark colours than the sky's, those that an opening
/// of a fiftieth of the crown's width leaves. Foliage hangs in masses; twigs are thin, whatever light falls on them.
pub fn massive_share(image: &RgbImage, scene: &Scene, crown: &[bool]) -> f32 {
    let small = Small::with_long_side(image, 512);
    let mut is_crown = vec![false; small.count()];
    let (mut left, mut right) = (small.width, 0);
    for (i, inside) in is_crown.iter_mut().enumerate() {
        let (x, y) = (i % small.width, i / small.width);
        *inside = crown[y * scene.small.height / small.height * scene.small.width + x * scene.small.width / small.width];
        if *inside {
            (left, right) = (left.min(x), right.max(x));
        }
    }
    let mut lights: Vec<f32> = (0..small.count()).filter(|&i| is_crown[i]).map(|i| small.lab[i][0]).collect();
    lights.sort_by(f32::total_cmp);
    let skies: Vec<f32> = (0..crown.len()).filter(|&i| scene.sky.grown[i] && !crown[i]).map(|i| scene.small.lab[i][0]).collect();
    if lights.is_empty() || skies.is_empty() {
        return 1.0;
    }
    let sky = skies.iter().sum::<f32>() / skies.len() as f32;
    let half = 0.5 * (lights[lights.len() / 20] + sky);
    // Opening by counting: a pixel stays if some window that is all dark covers it.
    let radius = ((right - left) / 100).max(1);
    let dark: small::Plane = (0..small.count()).map(|i| f32::from(u8::from(is_crown[i] && small.lab[i][0] < half))).collect();
    let core: small::Plane = small.mean(&dark, radius).iter().map(|m| f32::from(u8::from(*m > 0.999))).collect();
    let opened = small.mean(&core, radius).iter().filter(|m| **m > 0.0001).count();
    opened as f32 / lights.len() as f32
}

/// Leaf colours of all seasons: green, yellow, brown, red, purple; not blue, not grey.
fn leafy([_, a, b]: [f32; 3]) -> bool {
    a.hypot(b) > COLOURED && (b > 3.0 || a > 6.0 && b > -0.6 * a)
}

/// The error that names the dominant hue of what is not sky.
pub fn none(scene: &Scene, within: String) -> Error {
    let mut votes = [0.0f32; 36];
    for (i, rgb) in scene.small.rgb.iter().enumerate().filter(|(i, _)| !scene.sky.grown[*i]) {
        let [_, a, b] = scene.small.lab[i];
        votes[(hsv::hue_deg(rgb.map(|v| v as u8)) / 10.0) as usize % 36] += a.hypot(b);
    }
    let most = (0..36).rev().max_by(|&a, &b| votes[a].total_cmp(&votes[b])).unwrap_or(0);
    let hue_deg = 10.0 * most as f64 + 5.0;
    Error::NoFoliage { within, hue_deg, name: hsv::hue_name(hue_deg) }
}

/// The hues of the coloured, not sky-like pixels of the crown: 5th and 95th percentile. Reds lie around 0°, so the lower end may be
/// negative.
pub fn hue_range(scene: &Scene, crown: &[bool]) -> (f64, f64) {
    let coloured = |i: &usize| {
        let [_, a, b] = scene.small.lab[*i];
        crown[*i] && a.hypot(b) > COLOURED && scene.sky.likeness[*i] < 0.5
    };
    let hues: Vec<f64> = (0..crown.len()).filter(coloured).map(|i| hsv::hue_deg(scene.small.rgb[i].map(|v| v as u8))).collect();
    if hues.is_empty() {
        return hsv::HUE_OF_SHE_DEG;
    }
    let (sin, cos) = hues.iter().fold((0.0, 0.0), |(s, c), h| (s + h.to_radians().sin(), c + h.to_radians().cos()));
    let middle = sin.atan2(cos).to_degrees().rem_euclid(360.0);
    let mut around: Vec<f64> = hues.iter().map(|h| middle + (h - middle + 180.0).rem_euclid(360.0) - 180.0).collect();
    around.sort_by(f64::total_cmp);
    let at = |q: f64| (around[((around.len() - 1) as f64 * q) as usize] * 10.0).round() / 10.0;
    (at(0.05), at(0.95))
}
