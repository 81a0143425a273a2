//! Leaves: one quad each, cut out by the alpha of its texture (issue "Reference trees"; Rebollo §3 counts the same way), metres.
//!
//! What one quad shows, a leaf or the leaves of a twig, is up to the texture. Leaf `i` is quad `i`, with the vertices `4i..4i + 4`:
//! that is its id, here and in the file.

use glam::{Quat, Vec2, Vec3};

use super::light::Shade;
use crate::geom::{Bounds, Surface};
use crate::plant::{Bone, BoneKind, Skeleton};
use crate::{Seed, params};

params! {
    /// How leaves are placed.
    pub struct LeafParams {
        /// Multiplies the size of every leaf.
        leaf_scale: f64 = 1.0, in 0.05..=20.0, unit "", source "ours: the size that the L-system says";
        /// How much larger or smaller than the middle a leaf may be.
        leaf_size_jitter: f64 = 0.25, in 0.0..=0.9, unit "", source "ours: neighbouring leaves of a twig differ by about that";
        /// How far a leaf may turn off the direction that the L-system gives it, about each axis.
        leaf_turn_jitter_deg: f64 = 25.0, in 0.0..=180.0, unit "°", source "ours: enough to hide rows";
        /// How far normals lean from each leaf's own to that of the crown as a whole, which shades a crown as one body.
        leaf_round: f64 = 0.5, in 0.0..=1.0, unit "", source "ours: half shows both the crown's shape and single leaves";
    }
}

/// Part of a leaf quad that its picture covers, roughly.
const COVERED: f32 = 0.3;

/// Of less than the one part of the sky's light, all leaves are shade leaves; of more than the other, none is.
const DEEP_SHADE: f32 = 0.05;
const FULL_SUN: f32 = 0.6;

/// How a leaf picture is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sheet {
    /// Rows and columns of different twigs.
    pub columns: u32,
    /// The upper half of the rows is for leaves in the sun, the lower half for those in the shade.
    pub by_light: bool,
}

/// All leaves of a plant.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Leaves {
    /// One quad per leaf, four vertices each.
    pub surface: Surface,
    /// The bone that each leaf was, by number.
    pub bones: Vec<u32>,
}

/// The leaves of a skeleton; each takes one of the pictures on the sheet.
pub fn leaves(skeleton: &Skeleton, sheet: Sheet, params: &LeafParams, seed: Seed) -> Leaves {
    let sound = |bone: &Bone| {
        let numbers = [bone.length_m, bone.start_radius_m];
        numbers.iter().all(|n| n.is_finite() && *n > 0.0) && bone.start.is_finite() && bone.orientation.is_finite()
    };
    let all = || skeleton.bones.iter().enumerate().filter(|(_, bone)| bone.kind == BoneKind::Leaf && sound(bone));
    // The crown as one body: normals lean away from a point low in its middle.
    let crown = Bounds::of(all().map(|(_, bone)| bone.start));
    let heart = crown.map_or(Vec3::ZERO, |b| b.center() - Vec3::Y * 0.25 * b.size().y);
    let area = |bone: &Bone| 2.0 * bone.length_m * bone.start_radius_m * (params.leaf_scale * params.leaf_scale) as f32;
    let areas: Vec<(Vec3, f32)> = all().map(|(_, bone)| (bone.start, COVERED * area(bone))).collect();
    let shade = if sheet.by_light { Shade::of(&areas) } else { None };
    let mut leaves = Leaves::default();
    for (number, bone) in all() {
        let mut draws = seed.keyed("leaves", number as u64);
        let mut signed = || draws.signed() as f32;
        let scale = params.leaf_scale as f32 * (1.0 + params.leaf_size_jitter as f32 * signed());
        let turn = (params.leaf_turn_jitter_deg as f32).to_radians();
        let orientation = bone.orientation
            * Quat::from_rotation_y(turn * signed())
            * Quat::from_rotation_x(turn * signed())
            * Quat::from_rotation_z(turn * signed());
        let light = shade.as_ref().map(|shade| shade.light(bone.start));
        let cell = sheet.pick(light, draws.unit() as f32, draws.unit() as f32);
        let quad = Quad { foot: bone.start, orientation, half_width: scale * bone.start_radius_m, length: scale * bone.length_m };
        quad.emit(&mut leaves.surface, cell_corners(cell, sheet.columns), heart, params.leaf_round as f32);
        leaves.bones.push(number as u32);
    }
    leaves
}

impl Sheet {
    /// The picture for a leaf: of its row for as much light, given two draws.
    fn pick(&self, light: Option<f32>, row_draw: f32, column_draw: f32) -> u32 {
        let columns = self.columns.max(1);
        let half = (columns / 2) as f32;
        let row = match light {
            // Neighbouring rows mix where light is between theirs.
            Some(light) if columns > 1 => {
                let dark = 1.0 - ((light - DEEP_SHADE) / (FULL_SUN - DEEP_SHADE)).clamp(0.0, 1.0);
                let sunny = row_draw >= dark;
                if sunny { half * row_draw } else { half + half * row_draw }
            }
            _ => columns as f32 * row_draw,
        };
        let whole = |x: f32| (x as u32).min(columns - 1);
        whole(row) * columns + whole(columns as f32 * column_draw)
    }
}

/// The texture's corners of one of its pictures, in the order of [`Quad::emit`]: foot left, foot right, tip right, tip left.
fn cell_corners(cell: u32, columns: u32) -> [Vec2; 4] {
    let size = 1.0 / columns as f32;
    let low = size * Vec2::new((cell % columns) as f32, (cell / columns) as f32);
    let high = low + size;
    [Vec2::new(low.x, high.y), high, Vec2::new(high.x, low.y), low]
}

struct Quad {
    foot: Vec3,
    orientation: Quat,
    half_width: f32,
    length: f32,
}

impl Quad {
    fn emit(&self, surface: &mut Surface, uvs: [Vec2; 4], heart: Vec3, round: f32) {
        let [x, y, face] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| self.orientation * axis);
        let first = surface.mesh.positions.len() as u32;
        for (across, along) in [(-1.0, 0.0), (1.0, 0.0), (1.0, 1.0), (-1.0, 1.0)] {
            let at = self.foot + across * self.half_width * x + along * self.length * y;
            surface.mesh.positions.push(at);
            surface.normals.push(shading_normal(face, (at - heart).normalize_or(Vec3::Y), round));
        }
        surface.uvs.extend(uvs);
        surface.mesh.quads.push([first, first + 1, first + 2, first + 3]);
    }
}

/// The leaf's own normal leaning towards the crown's; on its own side of the leaf, so that a renderer that turns normals on back faces
/// keeps working.
fn shading_normal(face: Vec3, outward: Vec3, round: f32) -> Vec3 {
    let outward = if outward.dot(face) < 0.0 { -outward } else { outward };
    ((1.0 - round) * face + round * outward).normalize_or(face)
}
