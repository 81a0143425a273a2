//! What a frame shows: trees that stand one by one, a crowd of them, ground.

use glam::Vec3;

use super::crowd::{Crowd, CullParams};
use super::terrain::Terrain;
use super::tree::Tree;
use super::wind::Sway;
use super::{Camera, scene};
use crate::geom::Bounds;
use crate::gpu::layout;

/// A tree and where it stands, as often as it stands there.
#[derive(Debug, Clone, Copy)]
pub struct Stand<'a> {
    /// What is drawn.
    pub tree: &'a Tree,
    /// Where.
    pub instances: &'a [layout::Instance],
}

/// All that is drawn.
#[derive(Debug, Default)]
pub struct World<'a> {
    /// Trees one by one.
    pub stands: &'a [Stand<'a>],
    /// Many of them.
    pub crowd: Option<&'a mut Crowd>,
    /// What they stand on; `None` for the level meadow of the backdrop.
    pub ground: Option<&'a Terrain>,
    /// How the crowd is culled.
    pub cull: CullParams,
    /// Culls the crowd instead of the picture's camera: then the picture looks at what another saw from outside (Truelsen fig. 27).
    pub frozen: Option<Camera>,
}

impl<'a> From<&'a [Stand<'a>]> for World<'a> {
    fn from(stands: &'a [Stand<'a>]) -> Self {
        Self { stands, ..Self::default() }
    }
}

impl<'a, const N: usize> From<&'a [Stand<'a>; N]> for World<'a> {
    fn from(stands: &'a [Stand<'a>; N]) -> Self {
        Self::from(&stands[..])
    }
}

impl<'a> From<&'a Vec<Stand<'a>>> for World<'a> {
    fn from(stands: &'a Vec<Stand<'a>>) -> Self {
        Self::from(&stands[..])
    }
}

impl World<'_> {
    /// The box around all trees, wherever the wind may push them; `of_tree` is the box of a tree.
    pub(super) fn bounds(&self, of_tree: impl Fn(&Tree) -> Option<Bounds>, sway: Sway) -> Option<Bounds> {
        let crowd = self.crowd.as_ref().and_then(|crowd| Some((crowd.bounds()?, Vec3::splat(sway.reach_m(crowd.tallest_m())))));
        let crowd = crowd.map(|(bounds, reach)| Bounds { min: bounds.min - reach, max: bounds.max + reach });
        let all = scene_bounds(self.stands, of_tree, sway).into_iter().chain(crowd);
        all.reduce(|a, b| Bounds { min: a.min.min(b.min), max: a.max.max(b.max) })
    }
}

/// What a frame draws, the trees of a crowd that are drawn by themselves among the others.
#[derive(Debug)]
pub(super) struct Placed<'a> {
    /// Trees one by one.
    pub stands: &'a [Stand<'a>],
    /// How many of those, the first, cast shadows: the others are a crowd's, which casts them all.
    pub casters: usize,
    /// Many of them.
    pub crowd: Option<&'a Crowd>,
    /// What they stand on.
    pub ground: Option<&'a Terrain>,
}

impl Placed<'_> {
    /// Where the level ground lies that goes on to the horizon.
    pub fn ground_m(&self) -> f32 {
        let level = || ground(scene_bounds(self.stands, Tree::bounds, Sway::NONE));
        self.ground.map_or_else(level, Terrain::lowest_m)
    }
}

/// The box around everything placed, wherever the wind may push it; `of_tree` is the box of a tree.
fn scene_bounds(stands: &[Stand], of_tree: impl Fn(&Tree) -> Option<Bounds>, sway: Sway) -> Option<Bounds> {
    let boxed = stands.iter().filter_map(|stand| Some((of_tree(stand.tree)?, stand)));
    let corners = boxed.flat_map(|(bounds, stand)| {
        let reach = Vec3::splat(sway.reach_m(stand.tree.height_m()));
        let swayed = Bounds { min: bounds.min - reach, max: bounds.max + reach };
        stand.instances.iter().flat_map(move |instance| placed_corners(swayed, instance))
    });
    Bounds::of(corners)
}

/// The corners of a tree's box where an instance stands.
fn placed_corners(b: Bounds, instance: &layout::Instance) -> [Vec3; 8] {
    let at = |x, y, z| scene::placed_point(instance, Vec3::new(x, y, z));
    let at_height = |y| [at(b.min.x, y, b.min.z), at(b.max.x, y, b.min.z), at(b.min.x, y, b.max.z), at(b.max.x, y, b.max.z)];
    let ([a, b, c, d], [e, f, g, h]) = (at_height(b.min.y), at_height(b.max.y));
    [a, b, c, d, e, f, g, h]
}

/// Where the ground lies: at the origin, as trees stand; below what reaches far under it, as files do that centre their tree. A low twig or a
/// root may dip into the ground.
fn ground(scene: Option<Bounds>) -> f32 {
    scene.filter(|b| b.min.y < -0.1 * b.size().y).map_or(0.0, |b| b.min.y)
}
