//! Leaves and twigs: pictures with alpha, painted from polygons. Ours: none is photographed, so that every one may be passed on.
//!
//! A picture holds [`CELLS`]² different twigs, one of which each leaf quad shows, its foot in the middle of the lower edge.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use image::{RgbaImage, imageops};

use super::leaves::Sheet;
use super::paint::Canvas;
use crate::seed::Draws;
use crate::{Seed, choices};

choices! {
    /// What one leaf quad of a grown tree shows.
    pub enum LeafKind {
        /// A twig of seven heart-shaped leaves: lime.
        Heart = "heart",
        /// A twig end of eight lobed leaves: oak.
        Lobed = "lobed",
        /// A twig of eleven small toothed leaves: birch.
        Birch = "birch",
        /// A hanging shoot of narrow leaves: willow.
        Narrow = "narrow",
        /// A twice-feathered leaf: acacia.
        Feather = "feather",
        /// A tuft of long needles: pine.
        Tuft = "tuft",
        /// A flat spray of short needles: spruce.
        Spray = "spray",
        /// A flat twig of soft dark needles: yew.
        Yew = "yew",
        /// A plume of tiny pointed scales: juniper.
        Scale = "scale",
        /// A twig of nine pointed oval leaves: cherry, olive, poplar and most others.
        Oval = "oval",
    }
}

/// Rows and columns of different twigs in a picture.
pub const CELLS: u32 = 2;

/// How the picture is divided: the upper row holds leaves of the sun, the lower row those of the shade, which are darker.
pub const SHEET: Sheet = Sheet { columns: CELLS, by_light: true };

/// Brightness of the leaves in a row.
const ROW_LIGHT: [f32; CELLS as usize] = [1.1, 0.66];

/// Side of one twig's picture.
const CELL_PX: u32 = 256;

/// The picture of [`CELLS`]² twigs of that kind.
pub fn picture(kind: LeafKind, seed: Seed) -> RgbaImage {
    let mut picture = RgbaImage::new(CELLS * CELL_PX, CELLS * CELL_PX);
    for cell in 0..CELLS * CELLS {
        let light = ROW_LIGHT[(cell / CELLS) as usize];
        let mut twig = Twig { canvas: Canvas::new(CELL_PX), draws: seed.keyed("foliage", u64::from(cell)), light };
        twig.paint(kind);
        let (x, y) = (cell % CELLS * CELL_PX, cell / CELLS * CELL_PX);
        imageops::replace(&mut picture, &twig.canvas.finish(), i64::from(x), i64::from(y));
    }
    picture
}

/// One twig in the making. Coordinates: x right, −0.5..0.5, y from the foot, 0, to the tip, 1.
struct Twig {
    canvas: Canvas,
    draws: Draws,
    /// Brightness of its leaves.
    light: f32,
}

/// The outline of a blade: half its width, in lengths, at a fraction of its length.
type Outline = fn(f32) -> f32;

impl Twig {
    fn paint(&mut self, kind: LeafKind) {
        const WOOD: Vec3 = Vec3::new(96.0, 78.0, 56.0);
        const GREEN_WOOD: Vec3 = Vec3::new(104.0, 112.0, 58.0);
        match kind {
            LeafKind::Heart => self.alternate(7, (0.40, 0.34), (1.0, 0.45), heart, Vec3::new(98.0, 136.0, 48.0), WOOD),
            LeafKind::Oval => self.alternate(9, (0.34, 0.3), (1.0, 0.4), oval, Vec3::new(84.0, 122.0, 50.0), WOOD),
            LeafKind::Birch => self.alternate(11, (0.25, 0.21), (1.05, 0.6), birch, Vec3::new(116.0, 146.0, 56.0), WOOD),
            LeafKind::Lobed => self.rosette(8, 0.48, lobed, Vec3::new(86.0, 118.0, 44.0), WOOD),
            LeafKind::Narrow => self.alternate(17, (0.27, 0.2), (0.55, 0.3), narrow, Vec3::new(132.0, 156.0, 76.0), GREEN_WOOD),
            LeafKind::Feather => self.feather(Vec3::new(112.0, 138.0, 62.0), GREEN_WOOD),
            LeafKind::Tuft => self.tuft(Vec3::new(76.0, 112.0, 66.0), WOOD),
            LeafKind::Spray => self.spray(&SPRUCE, Vec3::new(56.0, 92.0, 58.0), WOOD),
            LeafKind::Yew => self.spray(&YEW, Vec3::new(50.0, 84.0, 40.0), GREEN_WOOD),
            LeafKind::Scale => self.spray(&JUNIPER, Vec3::new(88.0, 118.0, 86.0), WOOD),
        }
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.draws.unit() as f32
    }

    /// A colour a little lighter, darker, yellower or bluer.
    fn tinted(&mut self, color: Vec3, amount: f32) -> Vec3 {
        let light = self.light * (1.0 + amount * self.between(-1.0, 1.0));
        let warm = amount * self.between(-0.5, 0.5);
        color * light * Vec3::new(1.0 + warm, 1.0, 1.0 - warm)
    }

    /// A blade: two halves in unlike light, with a midrib.
    fn blade(&mut self, foot: Vec2, direction: f32, length: f32, outline: Outline, color: Vec3) {
        const STEPS: usize = 24;
        let along = Vec2::from_angle(direction);
        let across = along.perp();
        let bend = self.between(-0.12, 0.12);
        let spine = |t: f32| foot + length * (t * along + bend * t * t * across);
        for (side, light) in [(-1.0, 0.9), (1.0, 1.08)] {
            let edge = (0..=STEPS).map(|i| i as f32 / STEPS as f32).map(|t| spine(t) + side * length * outline(t) * across);
            let back = (0..=STEPS).rev().map(|i| spine(i as f32 / STEPS as f32));
            let corners: Vec<Vec2> = edge.chain(back).map(to_canvas).collect();
            self.canvas.polygon(&corners, light * color);
        }
        let rib = 1.22 * color + Vec3::new(12.0, 10.0, 4.0);
        for (a, b) in [(0.0, 0.5), (0.5, 0.93)] {
            self.line(spine(a), spine(b), (0.016 * length * (1.2 - a), 0.016 * length * (1.2 - b)), rib);
        }
    }

    fn line(&mut self, from: Vec2, to: Vec2, width: (f32, f32), color: Vec3) {
        self.canvas.stroke(to_canvas(from), to_canvas(to), width, color);
    }

    /// A stem that curves a little; returns the places along it.
    fn stem(&mut self, height: f32, width: f32, color: Vec3) -> impl Fn(f32) -> Vec2 + use<> {
        let bend = self.between(-0.12, 0.12);
        let at = move |t: f32| Vec2::new(bend * (PI * t).sin(), height * t);
        for i in 0..8 {
            let (a, b) = (i as f32 / 8.0, (i + 1) as f32 / 8.0);
            self.line(at(a), at(b), (width * (1.0 - 0.6 * a), width * (1.0 - 0.6 * b)), color);
        }
        at
    }

    /// Leaves in turn left and right of a stem and one at its end; sizes and angles go from the first to the last.
    fn alternate(&mut self, count: u32, size: (f32, f32), angle: (f32, f32), outline: Outline, color: Vec3, wood: Vec3) {
        let stem = self.stem(1.0 - 0.9 * size.1, 0.014, wood);
        // From the end back to the foot: lower leaves lie in front, and those behind are darker.
        for i in (0..count).rev() {
            let t = i as f32 / (count - 1) as f32;
            let side = if i + 1 == count {
                0.0
            } else if i % 2 == 0 {
                1.0
            } else {
                -1.0
            };
            let turn = side * (angle.0 + t * (angle.1 - angle.0)) + self.between(-0.2, 0.2);
            let length = (size.0 + t * (size.1 - size.0)) * self.between(0.85, 1.08);
            let shade = self.between(0.78, 1.1);
            let color = self.tinted(shade * color, 0.1);
            let place = stem(0.12 + 0.88 * t);
            let petiole = place + 0.16 * length * Vec2::from_angle(PI / 2.0 + turn);
            self.line(place, petiole, (0.01, 0.008), wood.lerp(color, 0.5));
            self.blade(petiole, PI / 2.0 + turn, 0.84 * length, outline, color);
        }
    }

    /// Leaves all round the end of a short stem.
    fn rosette(&mut self, count: u32, size: f32, outline: Outline, color: Vec3, wood: Vec3) {
        let stem = self.stem(0.5, 0.018, wood);
        for i in 0..count {
            // The outer ones first, the middle one last and on top.
            let spread = 1.0 - i as f32 / (count - 1) as f32;
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let turn = side * 1.9 * spread + self.between(-0.15, 0.15);
            let length = size * (1.0 - 0.18 * spread) * self.between(0.9, 1.05);
            let color = self.tinted((1.08 - 0.3 * spread) * color, 0.1);
            let place = stem(0.72 + 0.28 * (1.0 - spread));
            self.blade(place, PI / 2.0 + turn, length, outline, color);
        }
    }

    /// A leaf of feathers of leaflets.
    fn feather(&mut self, color: Vec3, wood: Vec3) {
        let stem = self.stem(0.76, 0.014, wood);
        for pair in 0..7 {
            let t = pair as f32 / 6.0;
            for side in [-1.0, 1.0] {
                let turn = PI / 2.0 + side * (1.15 - 0.75 * t) + self.between(-0.1, 0.1);
                let length = (0.42 - 0.14 * (2.0 * t - 0.8).abs()) * self.between(0.9, 1.05);
                let foot = stem(0.2 + 0.8 * t);
                let along = Vec2::from_angle(turn);
                self.line(foot, foot + length * along, (0.010, 0.006), wood);
                for leaflet in 0..11 {
                    let place = foot + length * (0.12 + 0.88 * leaflet as f32 / 10.0) * along;
                    for lean in [-1.15, 1.15] {
                        let color = self.tinted(color, 0.16);
                        self.blade(place, turn + lean, 0.075, leaflet_outline, color);
                    }
                }
            }
        }
    }

    /// Long needles that spread from the upper part of a short shoot.
    fn tuft(&mut self, color: Vec3, wood: Vec3) {
        let stem = self.stem(0.42, 0.035, wood);
        for i in 0..130 {
            let t = i as f32 / 129.0;
            let turn = self.between(-1.0, 1.0) * (1.75 - 0.7 * t);
            let foot = stem(0.35 + 0.65 * t);
            let length = self.between(0.38, 0.52) * (1.0 - 0.12 * turn.abs());
            let color = self.tinted((0.68 + 0.5 * t) * color, 0.2);
            self.line(foot, foot + length * Vec2::from_angle(PI / 2.0 + turn), (0.017, 0.005), color);
        }
    }

    /// Side twigs in pairs, each with needles along it.
    fn spray(&mut self, form: &SprayForm, color: Vec3, wood: Vec3) {
        let stem = self.stem(0.93, 0.016, wood);
        for pair in 0..form.pairs {
            let t = pair as f32 / form.pairs as f32;
            for side in [-1.0, 1.0] {
                let turn = PI / 2.0 + side * (form.lean + self.between(-0.12, 0.12));
                let length = form.reach * (1.0 - 0.78 * t) * self.between(0.6, 1.1) * (0.55 + 1.8 * t).min(1.0);
                let foot = stem(0.06 + 0.9 * t);
                let tip = foot + length * Vec2::from_angle(turn);
                self.line(foot, tip, (0.010, 0.006), wood);
                self.needles(foot, tip, form, color);
            }
        }
        for i in 0..8 {
            let (a, b) = (stem(i as f32 / 8.0), stem((i + 1) as f32 / 8.0));
            self.needles(a, b, form, color);
        }
    }

    fn needles(&mut self, from: Vec2, to: Vec2, form: &SprayForm, color: Vec3) {
        let count = (from.distance(to) / form.spacing).ceil() as u32;
        let turn = (to - from).to_angle();
        for i in 0..=count {
            let t = i as f32 / count.max(1) as f32;
            for side in [-1.0, 1.0] {
                let lean = side * form.needle_lean * self.between(0.6, 1.15);
                let length = form.needle * self.between(0.75, 1.1);
                let foot = from.lerp(to, t);
                let color = self.tinted((0.8 + 0.3 * t) * color, 0.16);
                self.line(foot, foot + length * Vec2::from_angle(turn + lean), (form.width, 0.4 * form.width), color);
            }
        }
    }
}

/// The proportions of a spray of needles, in heights of its picture.
struct SprayForm {
    /// Pairs of side twigs.
    pairs: u32,
    /// Length of the longest.
    reach: f32,
    /// Their angle to the stem, radians.
    lean: f32,
    /// Length, width, spacing of needles and their angle to the twig.
    needle: f32,
    width: f32,
    spacing: f32,
    needle_lean: f32,
}

const SPRUCE: SprayForm =
    SprayForm { pairs: 7, reach: 0.46, lean: 0.95, needle: 0.062, width: 0.013, spacing: 0.013, needle_lean: 0.8 };
const YEW: SprayForm =
    SprayForm { pairs: 6, reach: 0.40, lean: 0.85, needle: 0.085, width: 0.017, spacing: 0.022, needle_lean: 1.15 };
const JUNIPER: SprayForm =
    SprayForm { pairs: 8, reach: 0.5, lean: 0.62, needle: 0.05, width: 0.016, spacing: 0.016, needle_lean: 0.7 };

/// From a twig's coordinates to a canvas's: reduced, since the last leaf reaches beyond its stem, and with a margin on every side.
fn to_canvas(p: Vec2) -> Vec2 {
    const MARGIN: f32 = 0.015;
    const REDUCED: f32 = 0.9;
    Vec2::new(0.5 + REDUCED * p.x, 1.0 - REDUCED * p.y).clamp(Vec2::splat(MARGIN), Vec2::splat(1.0 - MARGIN))
}

fn heart(t: f32) -> f32 {
    0.46 * (PI * t.powf(0.55)).sin().max(0.0).powf(0.85)
}

fn oval(t: f32) -> f32 {
    0.27 * (PI * t.powf(0.8)).sin().max(0.0)
}

fn birch(t: f32) -> f32 {
    let teeth = 1.0 + 0.14 * (TAU * 7.0 * t).sin();
    0.40 * teeth * (PI * t.powf(0.62)).sin().max(0.0)
}

fn narrow(t: f32) -> f32 {
    0.085 * (PI * t).sin().max(0.0)
}

fn leaflet_outline(t: f32) -> f32 {
    0.24 * (PI * t).sin().max(0.0).sqrt()
}

fn lobed(t: f32) -> f32 {
    let lobes = 1.0 + 0.34 * (TAU * 4.0 * t - 0.6).cos();
    0.27 * lobes * (PI * t.powf(1.25)).sin().max(0.0).powf(0.7)
}
