//! The bone tree that a turtle leaves behind (Truelsen §6.1, fig. 20–21): plain data, in metres, parents before their children.

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
    /// The turtle's frame: local +Y is its heading, local +Z its up (for a leaf: the normal of its upper side).
    pub orientation: Quat,
    /// From begin to end along the heading, metres.
    pub length_m: f32,
    /// Radius at its begin, metres.
    pub start_radius_m: f32,
    /// Radius at its end, metres.
    pub end_radius_m: f32,
    /// How many brackets are open round it.
    pub depth: u32,
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

/// All bones of one plant; a bone's parent always stands before it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Skeleton {
    /// In the order of the chain that they were read from.
    pub bones: Vec<Bone>,
}
