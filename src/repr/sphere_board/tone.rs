//! How dark foliage is beside a smooth surface of its colour: leaves stand in each other's shade, which a sphere-board's skin does not.
//! Ours; without it a sphere-board is a quarter too bright.

use glam::Vec3;

use super::picture::Picture;

/// What a face that is turned to the sun, to the sky or to the ground gets: about a clear day.
pub(super) const SUN: f32 = 1.3;
pub(super) const SKY: f32 = 0.54;
pub(super) const GROUND: f32 = 0.2;
/// How far sunlight wraps round foliage, and what comes through it: as shaders/shared/light.wgsl has them.
pub(super) const WRAP: f32 = 0.35;
pub(super) const THROUGH: f32 = 0.04;
/// Every so manieth pixel is looked at, along both axes.
const STEP: u32 = 3;
/// How far a leaf may lie behind what the sun sees and be lit all the same, pixels.
const SLACK_PX: f32 = 2.5;
/// What the tone stays within, whatever the pictures say.
const WITHIN: (f32, f32) = (0.5, 1.0);

/// The light that leaves get over the light that an ellipsoid in their place would get, each picture's viewer seeing them under suns that
/// stand where the others were taken from.
pub(super) fn tone(pictures: &[&Picture], middle: Vec3, half: Vec3) -> f32 {
    let (mut leaves, mut smooth) = (0.0, 0.0);
    for seen in pictures {
        for sun in pictures.iter().filter(|sun| sun.toward().dot(seen.toward()).abs() < 0.95) {
            let toward_sun = sun.toward();
            let light = |n: Vec3, lit: bool| {
                let ambient = GROUND + (SKY - GROUND) * (0.5 + 0.5 * n.y);
                ambient + if lit { SUN * (((n.dot(toward_sun) + WRAP) / (1.0 + WRAP)).max(0.0) + THROUGH) } else { 0.0 }
            };
            for (place, normal) in seen.places(STEP) {
                let round = ((place - middle) / (half * half).max(Vec3::splat(1e-6))).normalize_or(seen.toward());
                leaves += light(normal, sun.sees(place, SLACK_PX));
                smooth += light(round, true);
            }
        }
    }
    if smooth > 0.0 { (leaves / smooth).clamp(WITHIN.0, WITHIN.1) } else { 1.0 }
}
