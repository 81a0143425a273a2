//! The true tree that stand-ins are judged against: wood, foliage as a list of leaves, and how they were told apart.
//!
//! Nothing is moved, turned or scaled; what looks wrong is said in a warning.

mod connect;
mod leaves;
mod split;

use std::path::Path;

use super::{Part, bounds, import};
use crate::geom::Bounds;
use crate::plant::Skeleton;
use crate::{Error, Result, Warning};

pub use connect::Components;
pub use leaves::Leaf;
pub use split::{Asked, By, Role};

/// A tree in full: every leaf, every branch.
#[derive(Debug, Clone)]
pub struct ReferenceTree {
    /// What it is called: its file's name without extension, or its preset.
    pub name: String,
    /// Trunk and branches.
    pub wood: Vec<Part>,
    /// Leaves: pairs of triangles are joined to quads, and the polygons of each leaf stand side by side.
    pub foliage: Vec<Part>,
    /// The leaves, in the order of their parts and polygons.
    pub leaves: Vec<Leaf>,
    /// Around all of it, metres.
    pub bounds: Bounds,
    /// The bones it was grown on, if it was grown here.
    pub skeleton: Option<Skeleton>,
    /// How wood and foliage were told apart: one line per surface.
    pub told: Vec<Told>,
    /// What a user should know.
    pub warnings: Vec<Warning>,
}

/// What one surface was taken for.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Told {
    /// The surface.
    pub part: String,
    /// Its material.
    pub material: String,
    /// What it is.
    pub role: Role,
    /// How that was told.
    pub by: By,
}

/// Higher than nearly any tree, and lower than any seedling worth a model, metres.
const HIGHEST_M: f32 = 60.0;
const LOWEST_M: f32 = 0.2;
/// How far from the origin the foot of a tree may stand, in heights, before it is said.
const ASTRAY: f32 = 0.05;

impl ReferenceTree {
    /// Reads a tree from any file that [`import::open`] reads.
    ///
    /// # Errors
    /// Those of [`import::open`] and [`ReferenceTree::new`].
    pub fn open(path: &Path, asked: &Asked) -> Result<Self> {
        let imported = import::open(path)?;
        let name = path.file_stem().map_or_else(|| "tree".to_owned(), |stem| stem.to_string_lossy().into_owned());
        let inside = |cause| Error::InFile { path: path.to_owned(), cause: Box::new(cause) };
        let mut tree = Self::new(name, imported.parts, asked).map_err(inside)?;
        tree.warnings.splice(0..0, imported.warnings);
        Ok(tree)
    }

    /// A tree of these surfaces.
    ///
    /// # Errors
    /// [`Error::EmptyModel`] without polygons, [`Error::UnknownMaterial`] when `asked` names a material that is not there.
    pub fn new(name: String, mut parts: Vec<Part>, asked: &Asked) -> Result<Self> {
        parts.retain(|part| part.surface.mesh.polygon_count() > 0);
        let bounds = bounds(&parts).ok_or_else(|| Error::EmptyModel { why: String::new() })?;
        let mut tree =
            Self { name, wood: vec![], foliage: vec![], leaves: vec![], bounds, skeleton: None, told: vec![], warnings: vec![] };
        for (part, role, by) in split::split(parts, asked)? {
            tree.told.push(Told { part: part.name.clone(), material: part.material.name.clone(), role, by });
            match role {
                Role::Wood => tree.wood.push(part),
                Role::Foliage => tree.foliage.push(part),
            }
        }
        for (part, number) in tree.foliage.iter_mut().zip(0..) {
            // A sphere-board's crown is one surface, not leaves.
            if part.crown_center.is_none() {
                tree.leaves.extend(leaves::gathered(&mut part.surface, number));
            }
        }
        tree.doubts();
        Ok(tree)
    }

    /// All quads of all leaves.
    pub fn leaf_quads(&self) -> usize {
        self.leaves.iter().map(|leaf| leaf.quads as usize).sum()
    }

    /// Wood, then foliage.
    pub fn parts(&self) -> impl Iterator<Item = &Part> {
        self.wood.iter().chain(&self.foliage)
    }

    /// Triangles of all parts, quads counted as two.
    pub fn triangle_count(&self) -> usize {
        self.parts().map(|part| part.surface.mesh.triangles.len() + 2 * part.surface.mesh.quads.len()).sum()
    }

    /// Says what looks wrong.
    fn doubts(&mut self) {
        let (size, low) = (self.bounds.size(), self.bounds.min);
        let mut say = |code: &str, message: String| self.warnings.push(Warning::new(code, message));
        if self.foliage.is_empty() {
            say("no-leaves", "no leaves were found; name their material with --leaves MATERIAL if there are any".to_owned());
        }
        if self.wood.is_empty() {
            say("no-wood", "no wood was found; name its material with --wood MATERIAL if there is any".to_owned());
        }
        if size.y > HIGHEST_M {
            say("units", format!("the tree is {:.1} m high, more than nearly any tree; its file may not be in metres", size.y));
        } else if size.y < LOWEST_M {
            say("units", format!("the tree is {:.3} m high, less than any tree; its file may not be in metres", size.y));
        }
        if low.y < -0.25 * size.y && low.z.abs() < ASTRAY * size.z {
            say(
                "lies",
                "the tree seems to lie on its back: glTF has +Y up, and the file may have been written with +Z up".to_owned(),
            );
            return;
        }
        if low.y.abs() > ASTRAY * size.y {
            let side = if low.y > 0.0 { "above" } else { "below" };
            say("foot", format!("the tree's lowest point lies {:.2} m {side} the ground at y = 0", low.y.abs()));
        }
        if let Some(aside) = foot_aside(&self.wood).filter(|aside| *aside > ASTRAY * size.y) {
            say("foot", format!("the foot of the trunk stands {aside:.2} m beside the origin"));
        }
    }
}

/// How far the lowest twentieth of the wood stands from the Y axis.
fn foot_aside(wood: &[Part]) -> Option<f32> {
    let all = bounds(wood)?;
    let positions = wood.iter().flat_map(|part| &part.surface.mesh.positions);
    let foot = Bounds::of(positions.copied().filter(|p| p.y <= all.min.y + ASTRAY * all.size().y))?;
    Some(foot.center().x.hypot(foot.center().z))
}
