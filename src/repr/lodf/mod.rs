//! LoDF, level of detail foliage (Rebollo et al. 2007): leaves that collapse pairwise, in clusters that change one by one.

#[cfg(test)]
mod cover_tests;
mod detail;
pub mod foliage;
mod forest;
mod grid;
pub(super) mod method;
#[cfg(test)]
mod printed;
mod resolution;
mod shown;
pub mod simplify;
#[cfg(test)]
mod simplify_tests;
pub mod storage;

use glam::Vec3;

pub use detail::{Crown, Detail, Viewer, Wanted, Zones, collapses};
pub use forest::{Forest, LeafId, LeafShape};
pub use method::{Lodf, LodfParams, plain_levels};
pub use resolution::{Change, Resolution};
pub use shown::{ClusterLevel, LISTED, Sent, Shown};

use crate::geom::{Bounds, Surface};

/// The foliage of a part with all its levels of detail: what is drawn as [`Drawn::Forest`](super::Drawn::Forest). The part holds the original.
#[derive(Debug, Clone, PartialEq)]
pub struct LeafForest {
    /// Leaves and clusters.
    pub forest: Forest,
    /// Where the clusters are.
    pub crown: Crown,
    /// From where the distance of the whole is measured.
    pub anchor: Vec3,
    /// How many leaves are shown from where.
    pub detail: Detail,
    /// All leaves shown are sent whenever any changes, as the predecessor does (§VI); else changed clusters only.
    pub resent: bool,
    /// Of each cluster's collapses in turn: how many of all are done when it is. Cluster after cluster.
    pub ends: Vec<u32>,
}

impl LeafForest {
    /// Simplifies a surface, every polygon of which is a leaf, until `clusters` leaves are left, with detail as by default.
    pub fn of(surface: &Surface, clusters: usize) -> Self {
        let blades = foliage::blades(surface);
        let forest = Forest::new(blades.len(), &simplify::simplify(&blades, clusters));
        let bounds = Bounds::of(surface.mesh.positions.iter().copied().filter(|p| p.is_finite()));
        let bounds = bounds.unwrap_or(Bounds { min: Vec3::ZERO, max: Vec3::ZERO });
        let crown = Crown {
            center: bounds.center(),
            half: 0.5 * bounds.size(),
            spheres: forest.spheres(|leaf| foliage::places(&surface.mesh, leaf)),
        };
        let ends = forest.ends();
        Self { forest, crown, anchor: bounds.center(), detail: LodfParams::default().detail(), resent: false, ends }
    }

    /// Of a cluster's collapses in turn: how many of all are done when it is.
    fn ends(&self, cluster: u32) -> &[u32] {
        let start = self.forest.made_start(cluster);
        &self.ends[start..start + self.forest.size(cluster) - 1]
    }

    /// Bytes of everything beside the original.
    pub fn bytes(&self) -> usize {
        self.forest.bytes() + size_of_val(&self.ends[..]) + size_of_val(&self.crown.spheres[..])
    }

    /// Bytes of the leaves of all levels and of one tree's lists on a device.
    pub fn device_bytes(&self) -> usize {
        /// Four corners, and what becomes of each.
        const LEAF: usize = 4 * (32 + 32);
        let of_tree = LISTED * (self.forest.leaves() + 2 * self.forest.clusters());
        LEAF * self.forest.all_leaves() + of_tree + size_of::<ClusterLevel>() * (self.forest.clusters() + 1)
    }

    /// How many leaves are shown of the whole at a distance, in heights.
    pub fn leaves_at(&self, distance: f32) -> usize {
        self.forest.leaves() - collapses(&self.forest, self.detail.share(distance)) as usize
    }

    /// The level of the whole at a distance, in heights, as a plain surface; `surface` is the original.
    pub fn surface_at(&self, surface: &Surface, distance: f32) -> Surface {
        let mut resolution = Resolution::finest(&self.forest);
        resolution.set_uniform(&self.forest, self.leaves_at(distance));
        foliage::surface_at(surface, &self.forest, &resolution)
    }

    /// What a viewer asks for.
    pub fn wanted(&self, viewer: &Viewer) -> Wanted {
        self.detail.wanted(&self.forest, &self.crown, self.anchor, viewer)
    }
}
