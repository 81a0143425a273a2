//! What grows in a picture (She §3.3, fig. 13): which crowns are near enough, and the tables that they grow by.

use std::cell::Cell;

use glam::{Mat3, Mat4, Quat, Vec3};

use super::drawer::PassKind;
use super::limb::{LimbView, Twigs};
use super::scene::Viewer;
use super::tiles::{Tiles, screen_rect};
use super::tree::{CrownShape, Tree};
use super::wind::Sway;
use super::{Camera, Projection, Shot, Stage, Stand};
use crate::Seed;
use crate::geom::Bounds;
use crate::gpu::layout::{self, LENGTH_BITS};
use crate::model::{Growth, GrowthProfile};

crate::choices! {
    /// How outlines grow.
    pub enum GrowthChoice {
        /// As the model says.
        Auto = "auto",
        /// Narrow twigs of unlike length: conifers.
        Needle = "needle",
        /// Rounded tufts: broadleaved trees.
        Broadleaf = "broadleaf",
        /// Not at all.
        None = "none",
    }
}

crate::choices! {
    /// What the lengths and directions of growth are keyed by.
    pub enum GrowthKeys {
        /// By the place on the crown: a still camera gives identical frames.
        Steady = "steady",
        /// By pixel and frame, as in the paper: flickers.
        Random = "random",
    }
}

crate::choices! {
    /// Which pixels of an outline grow.
    pub enum GrowthRoots {
        /// Those with exactly one background neighbour, as in the paper.
        Sides = "sides",
        /// And those with two beside each other, between them.
        Corners = "corners",
    }
}

crate::choices! {
    /// Which outlines grow.
    pub enum GrowthEdges {
        /// Those before deeper trees and lobes too.
        All = "all",
        /// Those before nothing at all, as in the paper.
        Outer = "outer",
    }
}

crate::params! {
    /// How the outlines of crowns grow.
    pub struct GrowthParams {
        /// What grows out of the outline of a crown.
        growth: GrowthChoice = GrowthChoice::Auto, unit "", source "ours: species differ (She §4)";
        /// Longest growth on the crown, Qmax; 0 takes the model's. In the picture nothing grows by more than 255 pixels.
        growth_max_m: f64 = 0.0, in 0.0..=10.0, unit "m", source "ours: measured on the photograph's outline";
        /// Shortest growth on the crown, Qmin; it is never more than the longest, and 0 takes the model's.
        growth_min_m: f64 = 0.0, in 0.0..=10.0, unit "m", source "ours: measured on the photograph's outline";
        /// Which outlines grow.
        growth_edges: GrowthEdges = GrowthEdges::All, unit "", source "ours: lobes are reshaped too (She §4 leaves it open)";
        /// Which pixels of an outline are roots.
        growth_roots: GrowthRoots = GrowthRoots::Corners, unit "", source "ours: slanted outlines would grow combs (She fig. 13b: sides)";
        /// What the growth is keyed by.
        growth_keys: GrowthKeys = GrowthKeys::Steady, unit "", source "ours: no flicker";
    }
}

impl GrowthParams {
    /// The growth of a tree of which `own` is known.
    fn of(&self, own: Growth) -> Option<Growth> {
        let profile = match self.growth {
            GrowthChoice::None => return None,
            GrowthChoice::Auto => own.profile,
            GrowthChoice::Needle => GrowthProfile::Needle,
            GrowthChoice::Broadleaf => GrowthProfile::Broadleaf,
        };
        let given = |value: f64, own: f64| if value > 0.0 { value } else { own };
        let max_m = given(self.growth_max_m, own.max_m);
        Some(Growth { profile, max_m, min_m: given(self.growth_min_m, own.min_m).min(max_m), ..own })
    }
}

/// What a frame's growth is computed from, beside the pictures; the CPU twin takes the same.
#[derive(Debug, Clone)]
pub struct GrowthInput {
    /// Sizes, scales and switches.
    pub frame: layout::GrowthFrame,
    /// Crowns by slot; the first stands for none.
    pub crowns: Vec<layout::GrowingCrown>,
    /// The tables round their limbs.
    pub limbs: Vec<u32>,
    /// Where to look for outlines.
    pub tiles: Vec<u32>,
    /// Every tile that a tree or its growth touches.
    pub tree_tiles: Vec<u32>,
    /// First slot of each instance of each stand; 0 where it does not grow.
    pub slots: Vec<Vec<u32>>,
}

/// Slots that the id target can tell apart, the empty one among them.
pub const SLOTS: usize = 4096;
/// Longest growth, pixels.
const LONGEST_PX: f32 = ((1 << LENGTH_BITS) - 1) as f32;
/// What lies deeper by so many times the longest growth is background: what grows is then seen to stand before it.
const GAP: f32 = 2.0;

/// An instance that may grow.
struct Candidate {
    stand: usize,
    place: usize,
    growth: Growth,
    /// The longest growth of its crowns in the picture.
    longest_px: f32,
    /// Its crowns.
    seen: Vec<Option<Seen>>,
}

impl GrowthInput {
    /// What grows in a picture; in the rectangles `others` are trees too, of which nothing grows.
    pub fn new(shot: &Shot, stands: &[Stand], others: &[[f32; 4]], twigs: &Twigs) -> Self {
        let mut input = Self {
            frame: frame_of(shot),
            crowns: vec![bytemuck::Zeroable::zeroed()],
            limbs: vec![0],
            tiles: vec![],
            tree_tiles: vec![],
            slots: stands.iter().map(|stand| vec![0; stand.instances.len()]).collect(),
        };
        let seer = Seer::new(shot);
        let (mut tiles, mut tree_tiles) = (Tiles::none(shot.size_px), Tiles::none(shot.size_px));
        // Smooth outlines reach a pixel farther.
        others.iter().for_each(|rect| tree_tiles.add(grown_by(*rect, 1.0)));
        for stand in stands {
            for instance in stand.instances {
                seer.rect(stand.tree, stand.tree.reach(), instance)
                    .into_iter()
                    .for_each(|rect| tree_tiles.add(grown_by(rect, 1.0)));
            }
        }
        if shot.stage == Stage::Unshaped {
            input.tree_tiles = tree_tiles.list();
            return input;
        }
        for Candidate { stand, place, growth, seen, .. } in seer.candidates(shot, stands) {
            if input.crowns.len() + seen.len() > SLOTS {
                continue; // one with fewer crowns may fit yet
            }
            input.slots[stand][place] = input.crowns.len() as u32;
            let (crowns, instance) = (stands[stand].tree.crowns(), &stands[stand].instances[place]);
            for (crown, seen) in crowns.iter().zip(seen) {
                match seen {
                    Some(seen) => input.add(crown, seen, instance.scale, &growth, twigs, &mut tiles),
                    // In its slot nothing grows.
                    None => input.crowns.push(bytemuck::Zeroable::zeroed()),
                }
            }
        }
        input.frame.alike = seer.alike(&input.crowns);
        tree_tiles.merge(&tiles);
        (input.tiles, input.tree_tiles) = (tiles.list(), tree_tiles.list());
        input
    }

    /// Adds a crown in the next slot.
    fn add(&mut self, crown: &CrownShape, seen: Seen, scale: f32, growth: &Growth, twigs: &Twigs, tiles: &mut Tiles) {
        let Seen { view, rect, longest_px } = seen;
        tiles.add(grown_by(rect, longest_px.min(LONGEST_PX) + 2.0));
        let plane = view.plane();
        let table = view.table(twigs, growth);
        // Sixteenths of a pixel from 1/256 pixel per metre.
        let units = |metres: f64| metres as f32 * scale / 16.0;
        self.crowns.push(layout::GrowingCrown {
            limb_x: (plane.x / crown.half_axes).to_array(),
            min_units: units(growth.min_m),
            limb_y: (plane.y / crown.half_axes).to_array(),
            max_units: units(growth.max_m),
            gap_m: GAP * growth.max_m as f32 * scale,
            first: self.limbs.len() as u32,
            count: table.len() as u32,
            pad: 0,
        });
        self.limbs.extend(table);
    }
}

/// A rectangle with a margin.
fn grown_by([left, top, right, bottom]: [f32; 4], margin: f32) -> [f32; 4] {
    [left - margin, top - margin, right + margin, bottom + margin]
}

fn frame_of(shot: &Shot) -> layout::GrowthFrame {
    let whole = 16_777_216.0;
    let (depth_units, orthographic) = match shot.camera.projection {
        Projection::Perspective { near_m, .. } => (near_m * whole, 0),
        Projection::Orthographic { near_m, far_m, .. } => (far_m - near_m, 1),
    };
    layout::GrowthFrame {
        size_px: shot.size_px,
        px_per_m: shot.camera.px_per_m(shot.size_px[1]),
        depth_units,
        orthographic,
        tips: u32::from(matches!(shot.stage, Stage::Antialiased | Stage::Lit)),
        inner: u32::from(shot.growth.growth_edges == GrowthEdges::All),
        random: u32::from(shot.growth.growth_keys == GrowthKeys::Random),
        frame: shot.frame,
        corners: u32::from(shot.growth.growth_roots == GrowthRoots::Corners),
        tile_count: 0,
        alike: [0.0, 0.0],
    }
}

/// The viewer, and what it needs to see crowns.
struct Seer<'a> {
    camera: &'a Camera,
    viewer: Viewer,
    clip_from_world: Mat4,
    size_px: [u32; 2],
    px_per_m: [f32; 2],
    sway: Sway,
    /// Of the far sides of all crowns seen so far.
    farthest_m: Cell<f32>,
}

/// A crown as seen.
struct Seen {
    view: LimbView,
    rect: [f32; 4],
    /// As long as it would be without [`LONGEST_PX`].
    longest_px: f32,
}

impl<'a> Seer<'a> {
    fn new(shot: &'a Shot) -> Self {
        let [width, height] = shot.size_px;
        Self {
            camera: &shot.camera,
            viewer: Viewer::of(shot),
            clip_from_world: shot.camera.clip_from_world(width as f32 / height as f32),
            size_px: shot.size_px,
            px_per_m: shot.camera.px_per_m(height),
            sway: Sway::of(&shot.wind),
            farthest_m: Cell::new(0.0),
        }
    }

    /// [`layout::GrowthFrame::alike`] for these crowns: half of the smallest gap, as seen at the farthest crown.
    fn alike(&self, crowns: &[layout::GrowingCrown]) -> [f32; 2] {
        let gap_m = crowns.iter().map(|crown| crown.gap_m).filter(|gap| *gap > 0.0).fold(f32::MAX, f32::min);
        match self.camera.projection {
            _ if gap_m == f32::MAX => [0.0, 0.0],
            // z / (z + gap) of the farthest pixel that a crown near enough to grow can have.
            Projection::Perspective { .. } => [1.0 - 0.5 * gap_m / (self.farthest_m.get() + gap_m), 0.0],
            Projection::Orthographic { near_m, far_m, .. } => [1.0, 0.5 * gap_m / (far_m - near_m)],
        }
    }

    /// Where a box of an instance of a tree may be seen, wherever the wind pushes it.
    fn rect(&self, tree: &Tree, bounds: Option<Bounds>, instance: &layout::Instance) -> Option<[f32; 4]> {
        let (world_from_object, _) = placed(instance);
        let bounds = bounds?;
        let reach = Vec3::splat(self.sway.reach_m(bounds.max.y - tree.foot_y()));
        let swayed = Bounds { min: bounds.min - reach, max: bounds.max + reach };
        screen_rect(&(self.clip_from_world * world_from_object), swayed, self.size_px)
    }

    /// Every instance that grows by a pixel or more: the one with the longest growth in the picture first, of equals the first.
    fn candidates(&self, shot: &Shot, stands: &[Stand]) -> Vec<Candidate> {
        let mut all = vec![];
        for (number, stand) in stands.iter().enumerate() {
            let Some(growth) = shot.growth.of(stand.tree.growth()) else { continue };
            for (place, instance) in stand.instances.iter().enumerate() {
                let crowns = stand.tree.crowns().iter().enumerate();
                let seen: Vec<_> = crowns.map(|(i, crown)| self.see(stand.tree, crown, i, instance, &growth)).collect();
                let longest_px = seen.iter().flatten().map(|seen| seen.longest_px).fold(0.0, f32::max);
                if longest_px > 0.0 {
                    all.push(Candidate { stand: number, place, growth, longest_px, seen });
                }
            }
        }
        all.sort_by(|a, b| b.longest_px.total_cmp(&a.longest_px));
        all
    }

    /// The crown of an instance, where it is seen, is in the picture and grows by a pixel or more.
    fn see(&self, tree: &Tree, crown: &CrownShape, number: usize, instance: &layout::Instance, growth: &Growth) -> Option<Seen> {
        if self.viewer.share(tree.height_m(), &crown.seen, instance, PassKind::Temporary { wireframe: false }) <= 0.0 {
            return None;
        }
        let (world_from_object, turn) = placed(instance);
        let rect = self.rect(tree, Some(crown.bounds), instance)?;
        let center = world_from_object.transform_point3(crown.center);
        // Of its nearest point: nothing of the crown grows longer.
        let radius = crown.half_axes.max_element() * instance.scale;
        let to_eye = match self.camera.projection {
            Projection::Perspective { .. } => self.camera.eye - center,
            Projection::Orthographic { .. } => self.camera.axes[2],
        };
        let scale_at = |distance_m: f32| match self.camera.projection {
            Projection::Perspective { near_m, .. } => self.px_per_m[1] * near_m / distance_m.max(near_m),
            Projection::Orthographic { .. } => self.px_per_m[0],
        };
        let distance = (self.camera.eye - center).dot(self.camera.axes[2]);
        let longest_px = growth.max_m as f32 * instance.scale * scale_at(distance - radius);
        if longest_px < 1.0 {
            return None;
        }
        let reach_m = crown.bounds.size().length() * instance.scale + self.sway.reach_m(crown.bounds.max.y - tree.foot_y());
        self.farthest_m.set(self.farthest_m.get().max(distance + reach_m));
        let object = |v: Vec3| turn.inverse() * v;
        let view = LimbView {
            half_axes: crown.half_axes,
            toward_eye: object(to_eye.normalize_or(self.camera.axes[2])),
            screen: [object(self.camera.axes[0]), object(self.camera.axes[1])],
            px_per_m: scale_at(distance) * instance.scale,
            turn: own_turn(instance, number),
        };
        Some(Seen { view, rect, longest_px })
    }
}

/// World from object space, and the turn in it.
fn placed(instance: &layout::Instance) -> (Mat4, Quat) {
    let part = |i: usize| f32::from(instance.rotation[i]) / f32::from(i16::MAX);
    let turn = Quat::from_xyzw(part(0), part(1), part(2), part(3)).normalize();
    (Mat4::from_scale_rotation_translation(Vec3::splat(instance.scale), turn, Vec3::from(instance.position)), turn)
}

/// How the twigs of the crown `number` of an instance are turned, so that neighbours of one kind have outlines of their own: by the tree's
/// number and its place in the world, so that it stays (Shoemake 1992: uniform over all turns).
fn own_turn(instance: &layout::Instance, number: usize) -> Mat3 {
    let place = instance.position.map(|metres| u64::from((metres + 0.0).to_bits()));
    let words = [u64::from(instance.id), number as u64].into_iter().chain(place);
    let key = words.fold(0u64, |key, word| (key ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29));
    let mut draws = Seed(0).keyed("growth.turn", key);
    let share = draws.unit() as f32;
    let mut turn = || (std::f32::consts::TAU * draws.unit() as f32).sin_cos();
    let ((a, b), (c, d)) = (turn(), turn());
    let (p, q) = ((1.0 - share).sqrt(), share.sqrt());
    Mat3::from_quat(Quat::from_xyzw(p * a, p * b, q * c, q * d).normalize())
}
