//! The bone tree that a turtle leaves behind (Truelsen §6.1, fig. 20–21): plain data, in metres, parents before their children.

use std::ops::Range;

use glam::{Quat, Vec3};

/// What a bone stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoneKind {
    /// Of the main axis: no bracket is open.
    Trunk,
    /// Inside at least one bracket.
    Branch,
    /// A leaf: `length_m` is the length of its blade, `start_radius_m` half its width.
    Leaf,
}

/// One straight piece of wood, or one leaf.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bone {
    /// The bone that this one stands on, by number; `None` for a root.
    pub parent: Option<u32>,
    /// What it stands for.
    pub kind: BoneKind,
    /// Where it begins, object space.
    pub start: Vec3,
    /// The turtle's frame: local +Y is its heading, local +Z its up (for a leaf: the normal of its upper side), local −X its left.
    pub orientation: Quat,
    /// From begin to end along the heading, metres.
    pub length_m: f32,
    /// Radius at its begin, metres.
    pub start_radius_m: f32,
    /// Radius at its end, metres; 0 for a leaf.
    pub end_radius_m: f32,
    /// How many brackets are open round it.
    pub depth: u32,
    /// Counted up by `'` (the colour index of Prusinkiewicz & Lindenmayer 1990); 0 where no grammar asks for it.
    pub tint: u16,
}

impl Bone {
    /// Where it ends.
    pub fn end(&self) -> Vec3 {
        self.start + self.heading() * self.length_m
    }

    /// Its direction, a unit vector.
    pub fn heading(&self) -> Vec3 {
        self.orientation * Vec3::Y
    }
}

/// A flat shape between `{` and `}`: a blade or a petal drawn by its outline.
#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    /// The bone that it stands on.
    pub parent: Option<u32>,
    /// Its corners in the order of the chain, at least three.
    pub corners: Vec<Vec3>,
    /// How many brackets are open round it.
    pub depth: u32,
    /// As [`Bone::tint`].
    pub tint: u16,
}

/// What one pair of brackets holds, branches inside it included.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Branch {
    /// The branch that it grows from, by number; `None` for the whole plant, which is branch 0.
    pub parent: Option<u32>,
    /// How many brackets are open round its own modules.
    pub level: u32,
    /// Its bones, by number.
    pub bones: Range<u32>,
    /// Its polygons, by number.
    pub polygons: Range<u32>,
}

/// All bones of one plant; a bone's parent always stands before it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Skeleton {
    /// In the order of the chain that they were read from.
    pub bones: Vec<Bone>,
    /// In the order of the chain.
    pub polygons: Vec<Polygon>,
    /// In the order of their opening brackets, parents first; may be empty in a skeleton that no turtle made.
    pub branches: Vec<Branch>,
}

impl Skeleton {
    /// Grown without another derivation (Truelsen §3.1.3, fig. 9): wood becomes `factor` times as long; directions, radii and the
    /// sizes of leaves and polygons stay.
    ///
    /// A `factor` that is negative or not finite changes nothing.
    pub fn grown(&self, factor: f32) -> Self {
        let factor = if factor.is_finite() && factor >= 0.0 { factor } else { 1.0 };
        let mut grown = self.clone();
        for i in 0..grown.bones.len() {
            let Bone { parent, kind, start, length_m, .. } = self.bones[i];
            grown.bones[i].start = moved(self, &grown, parent, start, factor);
            grown.bones[i].length_m = if kind == BoneKind::Leaf { length_m } else { length_m * factor };
        }
        for i in 0..grown.polygons.len() {
            let Polygon { parent, corners, .. } = &self.polygons[i];
            let Some(first) = corners.first() else { continue };
            let shift = moved(self, &grown, *parent, *first, factor) - *first;
            grown.polygons[i].corners.iter_mut().for_each(|corner| *corner += shift);
        }
        grown
    }
}

/// Where a point that stands on `parent` comes to lie: its distance from the parent's end, which a jump leaves, grows as well.
fn moved(old: &Skeleton, new: &Skeleton, parent: Option<u32>, point: Vec3, factor: f32) -> Vec3 {
    let end = |skeleton: &Skeleton| parent.and_then(|p| skeleton.bones.get(p as usize)).map_or(Vec3::ZERO, Bone::end);
    end(new) + (point - end(old)) * factor
}
