//! The sRGB curve (IEC 61966-2-1), for everything that is averaged or lit in linear light.

use std::sync::LazyLock;

use glam::Vec3;
use palette::color_difference::Ciede2000 as _;
use palette::{FromColor as _, Lab, Srgb};

/// 8-bit sRGB to linear light (IEC 61966-2-1).
pub fn to_linear(value: u8) -> f32 {
    static TABLE: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| decoded(i as f32 / 255.0)));
    TABLE[usize::from(value)]
}

/// sRGB from 0 to 1 to linear light (IEC 61966-2-1): for values between the bytes, as means are.
pub fn decoded(value: f32) -> f32 {
    if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// Linear light to 8-bit sRGB, clamped (IEC 61966-2-1).
pub fn to_srgb(value: f32) -> u8 {
    (255.0 * encoded(value)).round() as u8
}

/// Linear light to sRGB from 0 to 1, clamped (IEC 61966-2-1): the inverse of [`decoded`].
pub fn encoded(value: f32) -> f32 {
    let v = value.clamp(0.0, 1.0);
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

/// CIEDE2000 between two colours in encoded sRGB, 0..=255.
pub fn color_difference(a: Vec3, b: Vec3) -> f64 {
    let lab = |c: Vec3| Lab::from_color(Srgb::from((c / 255.0).to_array()));
    f64::from(lab(a).difference(lab(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_linear_light() {
        assert!((0..=255).all(|v| to_srgb(to_linear(v)) == v));
        assert!((to_linear(188) - 0.5029).abs() < 1e-4);
    }
}
