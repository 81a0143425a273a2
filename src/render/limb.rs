//! What grows where round a crown's outline, so that it holds still (ours; She §3.3 draws new random numbers).
//!
//! Twigs are placed once, on the ellipsoid of a crown, in object space. Seen from anywhere, those near the limb (the ellipsoid's outline)
//! stick out over it, each by `1 − (s / reach)²` of its length when it leans by `s` towards or from the viewer: as the view turns, a twig
//! rises, stands for a while and sinks, as real ones do. The result is a table of lengths and screen directions round the limb, by which
//! the root pixels of this view grow. It depends on the crown and the view, never on pixels or the frame's number.
//!
//! Twigs are used in order of a low-discrepancy sequence, as many as the picture's scale has room for; the last half of them fades in,
//! so that nothing pops with distance (the idea of hashed alpha testing: Wyman & McGuire 2017, two scales blended).

use glam::{Mat3, Vec3};

use crate::Seed;
use crate::model::{Growth, GrowthProfile};

/// One twig, or one tuft of leaves.
#[derive(Debug, Clone, Copy)]
struct Twig {
    /// Where on the unit sphere.
    at: Vec3,
    /// Length, 0..1.
    length: f32,
    /// Leans aside, −1..1.
    lean: f32,
}

/// All twigs there may be on a crown.
#[derive(Debug)]
pub struct Twigs(Vec<Twig>);

/// How a crown is seen.
#[derive(Debug, Clone, Copy)]
pub struct LimbView {
    /// Half axes of its ellipsoid, metres.
    pub half_axes: Vec3,
    /// From its centre to the eye, object space, unit length.
    pub toward_eye: Vec3,
    /// Right and up in the picture, object space, unit length.
    pub screen: [Vec3; 2],
    /// Pixels per metre of object space.
    pub px_per_m: f32,
    /// How its twigs are turned about its centre, object space: no two crowns have the same outline.
    pub turn: Mat3,
}

/// The plane in which the outline of a crown lies, half axes made 1.
#[derive(Debug, Clone, Copy)]
pub struct LimbPlane {
    /// To the right: unit, in the space where the half axes are 1.
    pub x: Vec3,
    /// Upward.
    pub y: Vec3,
    /// Towards the viewer.
    pub z: Vec3,
}

/// Coarsest and finest table of a limb, entries.
const COUNTS: (f32, f32) = (64.0, 4096.0);
/// Nothing grows closer than so many pixels apart.
const APART_PX: f32 = 3.5;
/// Leaves are so much closer together than twigs.
const LEAVES_PER_TWIG: f32 = 5.0;

impl Twigs {
    /// The twigs of a seed.
    pub fn new(seed: Seed) -> Self {
        // R2 of Roberts: the plastic number's powers.
        let (a, b) = (0.754_877_666_246_692_7_f64, 0.569_840_290_998_053_3_f64);
        let twig = |i: u64| {
            let mut draws = seed.keyed("twigs", i);
            let (u, v) = ((0.5 + a * (i + 1) as f64).fract(), (0.5 + b * (i + 1) as f64).fract());
            let (z, turn) = ((1.0 - 2.0 * u) as f32, (std::f64::consts::TAU * v) as f32);
            let ring = (1.0 - z * z).max(0.0).sqrt();
            Twig {
                at: Vec3::new(ring * turn.cos(), z, ring * turn.sin()),
                length: draws.unit() as f32,
                lean: draws.signed() as f32,
            }
        };
        Self((0..8192).map(twig).collect())
    }
}

impl LimbView {
    /// The plane of the limb.
    pub fn plane(&self) -> LimbPlane {
        let z = (self.toward_eye / self.half_axes).normalize_or(Vec3::Z);
        let up = self.screen[1] / self.half_axes;
        let y = (up - z * up.dot(z)).normalize_or(z.any_orthonormal_vector());
        LimbPlane { x: y.cross(z), y, z }
    }

    /// Length of the outline, metres: Ramanujan's approximation for the ellipse.
    fn perimeter_m(&self, plane: &LimbPlane) -> f32 {
        let [a, b] = [plane.x, plane.y].map(|axis| (axis * self.half_axes).length());
        std::f32::consts::PI * (3.0 * (a + b) - ((3.0 * a + b) * (a + 3.0 * b)).sqrt())
    }

    /// The table round the limb, counter-clockwise from the right at equal steps of the L1 angle: length as a part of Qmax in 16 bits,
    /// then the direction in the picture in 8 bits, counter-clockwise from the right. As many entries as a power of two.
    pub fn table(&self, twigs: &Twigs, growth: &Growth) -> Vec<u32> {
        let plane = self.plane();
        let perimeter_m = self.perimeter_m(&plane);
        let count = (perimeter_m * self.px_per_m).clamp(COUNTS.0, COUNTS.1) as usize;
        let count = count.next_power_of_two().min(COUNTS.1 as usize);
        let radius_m = perimeter_m / std::f32::consts::TAU;
        let layer = |spacing_m: f32, length_m: f32| Layer {
            spacing_m: spacing_m.max(APART_PX / self.px_per_m),
            reach: (2.0 * length_m / radius_m).sqrt().clamp(0.12, 0.5),
            perimeter_m,
        };
        let (spacing_m, max_m) = (growth.spacing_m as f32, growth.max_m as f32);
        let rules = Rules::of(growth.profile);
        let mut long = vec![Entry::default(); count];
        let mut fine = vec![Entry::default(); count];
        self.raise(&mut long, twigs, &plane, &layer(spacing_m, max_m), &rules, 0.0);
        self.raise(&mut fine, twigs, &plane, &layer(spacing_m / LEAVES_PER_TWIG, max_m * rules.leaf), &rules, 1.0);
        long.iter().zip(&fine).map(|(a, b)| a.with(b, rules.leaf)).collect()
    }

    /// Raises the twigs of one size over the limb.
    fn raise(&self, entries: &mut [Entry], twigs: &Twigs, plane: &LimbPlane, layer: &Layer, rules: &Rules, size: f32) {
        let wanted = layer.perimeter_m / layer.spacing_m / layer.reach;
        let count = entries.len() as f32;
        // At most once round.
        let half_width = (rules.width * layer.spacing_m / layer.perimeter_m * count).clamp(0.5, 0.5 * count);
        for (i, twig) in twigs.0.iter().take(wanted.ceil() as usize).enumerate() {
            // A finer size uses the same sequence, mirrored, so that leaves do not sit on twigs.
            let at = self.turn * if size > 0.0 { Vec3::new(-twig.at.z, twig.at.y, twig.at.x) } else { twig.at };
            let s = at.dot(plane.z) / layer.reach;
            let faded = (2.0 - 2.0 * i as f32 / wanted).clamp(0.0, 1.0);
            let height = (1.0 - s * s) * faded * rules.length(twig.length);
            if height <= 0.0 {
                continue;
            }
            let center = l1_turn(at.dot(plane.x), at.dot(plane.y)) * count;
            let direction = self.direction(at, twig.lean, rules);
            let (from, to) = ((center - half_width).ceil() as i64, (center + half_width).floor() as i64);
            for entry in from..=to {
                let off = (entry as f32 - center).abs() / half_width;
                let here = &mut entries[entry.rem_euclid(count as i64) as usize];
                here.raise(height * rules.shape(off), direction);
            }
        }
    }

    /// Where a twig points in the picture: 8 bits of a turn, counter-clockwise from the right.
    fn direction(&self, at: Vec3, lean: f32, rules: &Rules) -> u32 {
        let outward = (at / self.half_axes).normalize_or(Vec3::Y) + rules.upward * Vec3::Y;
        let [right, up] = self.screen.map(|axis| axis.dot(outward));
        let turn = up.atan2(right) / std::f32::consts::TAU + 0.125 * rules.lean * lean;
        (turn * 256.0).round() as i32 as u32 & 255
    }
}

/// Twigs of one size on one crown.
struct Layer {
    spacing_m: f32,
    /// Sine of the angle from the limb at which a twig no longer sticks out.
    reach: f32,
    perimeter_m: f32,
}

/// What a profile means.
struct Rules {
    /// Half width of a twig or tuft, in spacings.
    width: f32,
    /// How much of the length fine leaves make.
    leaf: f32,
    /// How strongly twigs turn upward.
    upward: f32,
    /// How far they lean aside, eighths of a turn.
    lean: f32,
    needle: bool,
}

impl Rules {
    fn of(profile: GrowthProfile) -> Self {
        match profile {
            GrowthProfile::Needle => Self { width: 0.4, leaf: 0.35, upward: 0.35, lean: 0.5, needle: true },
            GrowthProfile::Broadleaf => Self { width: 0.6, leaf: 0.5, upward: 0.1, lean: 0.8, needle: false },
        }
    }

    /// Length of a twig from a uniform number: few needle twigs are long, most tufts are.
    fn length(&self, u: f32) -> f32 {
        if self.needle { 0.25 + 0.75 * u * u } else { 0.45 + 0.55 * u }
    }

    /// Height across a twig, `off` from its middle in half widths.
    fn shape(&self, off: f32) -> f32 {
        if self.needle { 1.0 - off } else { 1.0 - off * off }
    }
}

/// What the limb has grown to at one place.
#[derive(Clone, Copy, Default)]
struct Entry {
    height: f32,
    direction: u32,
}

impl Entry {
    fn raise(&mut self, height: f32, direction: u32) {
        if height > self.height {
            *self = Self { height, direction };
        }
    }

    fn with(&self, leaf: &Self, part: f32) -> u32 {
        let height = (1.0 - part) * self.height + part * leaf.height;
        let direction = if part * leaf.height > (1.0 - part) * self.height { leaf.direction } else { self.direction };
        (height.clamp(0.0, 1.0) * 65535.0) as u32 | (direction << 16)
    }
}

/// The angle of a point in the L1 norm, 0..1 counter-clockwise from the right; `limb_place` of the shader.
fn l1_turn(x: f32, y: f32) -> f32 {
    let t = y / (x.abs() + y.abs()).max(1e-20);
    0.25 * match (x >= 0.0, y >= 0.0) {
        (true, true) => t,
        (true, false) => 4.0 + t,
        (false, _) => 2.0 - t,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen() -> LimbView {
        LimbView {
            half_axes: Vec3::new(2.0, 3.0, 2.0),
            toward_eye: Vec3::Z,
            screen: [Vec3::X, Vec3::Y],
            px_per_m: 100.0,
            turn: Mat3::IDENTITY,
        }
    }

    #[test]
    fn twigs_wider_than_the_crown_go_round_it_once() {
        let twigs = Twigs::new(Seed(0));
        let begun = std::time::Instant::now();
        for spacing_m in [100.0, 1e8, 1e30] {
            let growth = Growth { spacing_m, ..Growth::likely(GrowthProfile::Broadleaf, 10.0) };
            assert!(seen().table(&twigs, &growth).len().is_power_of_two());
        }
        assert!(begun.elapsed().as_secs() < 5);
    }

    #[test]
    fn turned_twigs_are_others_as_long_and_as_many() {
        let (twigs, growth) = (Twigs::new(Seed(0)), Growth::likely(GrowthProfile::Needle, 10.0));
        let [one, other] =
            [Mat3::IDENTITY, Mat3::from_rotation_x(1.0)].map(|turn| LimbView { turn, ..seen() }.table(&twigs, &growth));
        let mean = |table: &[u32]| table.iter().map(|entry| f64::from(entry & 0xffff)).sum::<f64>() / table.len() as f64;
        assert_ne!(one, other);
        assert!((mean(&one) / mean(&other) - 1.0).abs() < 0.15, "{} and {}", mean(&one), mean(&other));
    }
}
