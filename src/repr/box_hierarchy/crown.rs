//! A crown as boxes with pictures, and as parts that a renderer draws (Lluch04 §4, fig. 4, 5, 8).
//!
//! A box shows its pictures from its own distance on, and in front of it what it is divided into: smaller boxes, or in the end the
//! leaves. What a box is divided into vanishes where the box appears, by the same distance from the same place; so of every leaf just one
//! box shows, wherever the viewer stands, but for the bands in which two fade into each other.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::atlas::Atlas;
use super::planes::Arrangement;
use crate::geom::{Bounds, PolyMesh, Surface};
use crate::model::{Material, Part, Wrap};
use crate::raster::ALPHA_CUTOFF;
use crate::repr::{BuiltPart, Facing, Level, Seen};

/// A crown in boxes.
#[derive(Debug, Clone, PartialEq)]
pub struct Crown {
    /// Of the tree, metres: what distances are measured in.
    pub height_m: f32,
    /// Over which share of its distance a box fades.
    pub band: f32,
    /// How the pictures of a box are arranged.
    pub arrangement: Arrangement,
    /// Parents before their children; number 0 is the whole crown.
    pub boxes: Vec<LeafBox>,
    /// The pictures of the boxes of every depth, from 0; those that are missing behind the first have not come yet.
    pub atlases: Vec<Atlas>,
    /// The leaves of boxes that are not divided further, by the number of the box; none where they have not come yet.
    pub leaves: Vec<(u32, Part)>,
}

/// One box.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeafBox {
    /// The box that it lies in.
    pub parent: Option<u32>,
    /// How many it lies in.
    pub depth: u32,
    /// Smallest and largest corner, metres.
    pub corners: [Vec3; 2],
    /// How many leaves it holds.
    pub leaves: u32,
    /// Whether other boxes hold them too.
    pub divided: bool,
    /// From how far its pictures do, in heights of the tree from its middle.
    pub distance: f32,
    /// Its pictures; none where nothing was to be seen.
    pub cards: Vec<BoxCard>,
}

/// One picture of a box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxCard {
    /// Its rectangle, counter-clockwise from the lower left corner, metres.
    pub corners: [Vec3; 4],
    /// Top left and bottom right of its picture in the atlas.
    pub uvs: [Vec2; 2],
}

impl LeafBox {
    /// Its extent.
    pub fn bounds(&self) -> Bounds {
        Bounds { min: self.corners[0], max: self.corners[1] }
    }

    /// From where distances are measured.
    pub fn anchor(&self) -> Vec3 {
        self.bounds().center()
    }
}

/// A place and a distance from it, in heights of the tree.
type From = (Vec3, f32);

impl Crown {
    /// Makes the balls in which boxes are divided lie in each other: a box is divided wherever one of those in it is.
    pub fn nest_distances(&mut self) {
        for i in (1..self.boxes.len()).rev() {
            let own = &self.boxes[i];
            let Some(parent) = own.parent.map(|p| p as usize) else { continue };
            let away = own.anchor().distance(self.boxes[parent].anchor()) / self.height_m;
            // A little more, so that rounding takes nothing away.
            let reach = (own.distance + away) * (1.0 + 1e-5);
            let parent = &mut self.boxes[parent];
            parent.distance = parent.distance.max(reach);
        }
    }

    /// What is drawn: what is seen nearest comes first, so that among many trees it hides what is behind it before that is drawn.
    pub fn parts(&self) -> Vec<BuiltPart> {
        let mut parts = vec![];
        // Where each box vanishes; parents stand before their children.
        let mut vanishes: Vec<Option<From>> = vec![None; self.boxes.len()];
        for (number, own) in self.boxes.iter().enumerate() {
            if let Some(parent) = own.parent.map(|p| p as usize) {
                vanishes[number] = if self.shows(parent) { Some(self.from(parent)) } else { vanishes[parent] };
            }
            if !self.is_there(number) {
                continue;
            }
            let opens = self.opens(number);
            let near = opens.then(|| self.from(number));
            let facing = Facing::Own { cosines: self.arrangement.cosines() };
            let seen = Seen { facing, ..self.seen(own.anchor(), near, vanishes[number]) };
            parts.extend(self.pictures(number).map(|part| BuiltPart::still(part).seen(seen)));
            if opens && !own.divided {
                let far = if self.shows(number) { Some(self.from(number)) } else { vanishes[number] };
                let leaves = self.leaves.iter().filter(|(of, _)| *of as usize == number);
                let seen = self.seen(own.anchor(), None, far);
                parts.extend(leaves.map(|(_, part)| BuiltPart::still(part.clone()).seen(seen)));
            }
        }
        parts.sort_by(|a, b| a.seen.vanishes[0].total_cmp(&b.seen.vanishes[0]));
        parts
    }

    /// Representative distances: all in leaves, all in the finest boxes, then for each coarser depth one at which as few boxes as possible
    /// fade, and the whole crown in one.
    pub fn levels(&self) -> Vec<Level> {
        let whole = self.boxes.first().map_or(1.0, |own| own.distance);
        let level = |name: &str, distance| Level { name: name.to_owned(), distance };
        let finest = self.boxes.iter().filter(|own| !own.divided).map(|own| own.distance);
        // Just behind the last of the leaves.
        let no_leaves = 1.001 * (1.0 + self.band) * finest.clone().fold(0.0, f32::max);
        let mut levels = vec![];
        if !self.leaves.is_empty() {
            levels.push(level("leaves", 0.5 * finest.fold(f32::MAX, f32::min)));
        }
        if self.boxes.len() > 1 {
            levels.push(level("finest boxes", no_leaves));
        }
        for depth in (1..self.atlases.len()).rev() {
            let Some([near, far]) = self.shown_at(depth) else { continue };
            // Of many places between the depths, the first of those where the fewest boxes fade.
            let places = (0..32).map(|i| near * (far / near).powf(i as f32 / 31.0));
            let Some(distance) = places.min_by_key(|distance| self.fading_at(*distance)) else { continue };
            if levels.last().is_none_or(|finer| 1.05 * finer.distance < distance) {
                levels.push(level(&format!("boxes of depth {depth}"), distance));
            }
        }
        levels.push(level("one box", 1.5 * whole.max(no_leaves)));
        levels
    }

    /// From which to which distance most boxes of a depth show; `None` where none does.
    fn shown_at(&self, depth: usize) -> Option<[f32; 2]> {
        let middle = |depth: usize| {
            let mut distances: Vec<f32> =
                self.boxes.iter().filter(|own| own.depth as usize == depth).map(|own| own.distance).collect();
            distances.sort_by(f32::total_cmp);
            distances.get(distances.len() / 2).copied()
        };
        let ends = [middle(depth)?, middle(depth - 1)?];
        (ends[0] > 0.0 && ends[0] < ends[1]).then_some(ends)
    }

    fn fading_at(&self, distance: f32) -> usize {
        let fades = |own: &&LeafBox| (own.distance * (1.0 - self.band)..own.distance * (1.0 + self.band)).contains(&distance);
        self.boxes.iter().filter(fades).count()
    }

    fn from(&self, number: usize) -> From {
        (self.boxes[number].anchor(), self.boxes[number].distance)
    }

    /// Whether its pictures have come, if it has any.
    fn is_there(&self, number: usize) -> bool {
        self.boxes[number].depth < self.atlases.len() as u32
    }

    /// Whether there are pictures to see instead of what it is divided into.
    fn shows(&self, number: usize) -> bool {
        self.is_there(number) && !self.boxes[number].cards.is_empty()
    }

    /// Whether what it is divided into has come.
    fn opens(&self, number: usize) -> bool {
        let own = &self.boxes[number];
        if own.divided { own.depth + 1 < self.atlases.len() as u32 } else { !self.leaves.is_empty() }
    }

    fn seen(&self, anchor: Vec3, near: Option<From>, far: Option<From>) -> Seen {
        let (near_at, near_m) = near.unwrap_or((anchor, 0.0));
        let (far_at, far_m) = far.unwrap_or((near_at, f32::MAX));
        // What has no near end is measured from one place only.
        let near_at = if near.is_none() { far_at } else { near_at };
        Seen { vanish_anchor: (far_at != near_at).then_some(far_at), ..Seen::between(near_at, near_m, far_m, self.band) }
    }

    /// The pictures of a box, if it has any.
    fn pictures(&self, number: usize) -> Option<Part> {
        let own = &self.boxes[number];
        let atlas = &self.atlases[own.depth as usize];
        let material = Material {
            name: format!("boxes_{}", own.depth),
            texture: Some(atlas.color.clone()),
            normal_texture: atlas.normals.clone(),
            wrap: Wrap::Clamp,
            alpha_cutoff: Some(ALPHA_CUTOFF),
            two_sided: self.arrangement != Arrangement::Axes,
            ..Material::default()
        };
        let mut surface = Surface::default();
        own.cards.iter().for_each(|card| surface.append(card.surface()));
        (!own.cards.is_empty()).then(|| Part { name: format!("box_{number}"), surface, material, crown_center: None })
    }
}

impl BoxCard {
    fn surface(&self) -> Surface {
        let [a, b, c, d] = self.corners;
        let [low, high] = self.uvs;
        let normal = (c - a).cross(d - b).normalize_or(Vec3::Z);
        Surface {
            mesh: PolyMesh { positions: vec![a, b, c, d], triangles: vec![], quads: vec![[0, 1, 2, 3]] },
            normals: vec![normal; 4],
            uvs: vec![Vec2::new(low.x, high.y), high, Vec2::new(high.x, low.y), low],
            ..Surface::default()
        }
    }
}
