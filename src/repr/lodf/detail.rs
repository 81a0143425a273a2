//! How many leaves a view asks for: of the whole crown (Rebollo algorithm 1), or of each cluster (algorithm 4, `MostDetailedZone`).
//!
//! Distances are in heights of the tree and as in the picture of [`REFERENCE_FOCAL_PX`](crate::repr::REFERENCE_FOCAL_PX), like those of
//! [`Seen`](crate::repr::Seen): what counts is how large the tree is in the picture.

use glam::Vec3;

use super::forest::Forest;

crate::choices! {
    /// What decides how fine a zone of a crown is.
    pub enum Zones {
        /// The distance of the whole tree: one level for all of it.
        Uniform = "uniform",
        /// The distance of each cluster: what is near the viewer is finer.
        Distance = "distance",
        /// The size of each cluster in the picture: leaves are about as large in the picture, wherever they are.
        Size = "size",
        /// As by distance, and finer at the crown's outline than before its middle.
        Silhouette = "silhouette",
    }
}

/// How much detail is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detail {
    /// D_MIN: nearer, every leaf is shown.
    pub near: f32,
    /// D_MAX: farther, no fewer leaves are shown.
    pub far: f32,
    /// Share of the leaves that is shown there (N_LEAVES_MIN), 0 to 1.
    pub least: f32,
    /// By what.
    pub zones: Zones,
}

/// Who looks, in the tree's own space, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewer {
    /// From where; for a parallel projection, from far away.
    pub eye: Vec3,
    /// A thing `d` metres away is `x + y · d` heights of the tree away in the picture for which distances are told.
    pub heights: [f32; 2],
}

impl Viewer {
    /// At `eye`, with the lens for which distances are told.
    pub fn at(eye: Vec3, tree_height_m: f32) -> Self {
        Self { eye, heights: [0.0, 1.0 / tree_height_m.max(1e-6)] }
    }

    /// How far away a point is, in heights.
    pub fn distance(&self, point: Vec3) -> f32 {
        self.heights[0] + self.heights[1] * self.eye.distance(point)
    }
}

/// A crown as zones are told by.
#[derive(Debug, Clone, PartialEq)]
pub struct Crown {
    /// Middle of the foliage.
    pub center: Vec3,
    /// Half its size, metres.
    pub half: Vec3,
    /// Middle and radius of every cluster.
    pub spheres: Vec<(Vec3, f32)>,
}

/// A level of detail: of all, or of each cluster.
#[derive(Debug, Clone, PartialEq)]
pub enum Wanted {
    /// So many collapses of the whole, the last one in part: a place between two entries of `Changed_groups`.
    Uniform(f32),
    /// So many in each cluster.
    Variable(Vec<f32>),
}

/// Of the crown's middle, how much less detail than at its outline.
const MIDDLE: f32 = 0.6;

impl Detail {
    /// Algorithm 1: the share of leaves at a distance, linear between D_MIN and D_MAX. What is no number counts as near.
    pub fn share(&self, distance: f32) -> f32 {
        let way = (distance - self.near) / (self.far - self.near).max(1e-6);
        if way.is_nan() { 1.0 } else { 1.0 - (1.0 - self.least) * way.clamp(0.0, 1.0) }
    }

    /// The distance at which just that share is shown.
    pub fn distance_of(&self, share: f32) -> f32 {
        self.near + (self.far - self.near) * ((1.0 - share) / (1.0 - self.least).max(1e-6)).clamp(0.0, 1.0)
    }

    /// What a viewer asks for.
    pub fn wanted(&self, forest: &Forest, crown: &Crown, anchor: Vec3, viewer: &Viewer) -> Wanted {
        if self.zones == Zones::Uniform {
            return Wanted::Uniform(collapses(forest, self.share(viewer.distance(anchor))));
        }
        let of_cluster = |(cluster, sphere): (u32, &(Vec3, f32))| {
            let size = forest.size(cluster) as f32;
            (size - (self.zone(crown, sphere.0, viewer) * size).max(1.0)).clamp(0.0, size - 1.0)
        };
        Wanted::Variable((0..).zip(&crown.spheres).map(of_cluster).collect())
    }

    /// Share of a cluster's leaves by where it is.
    fn zone(&self, crown: &Crown, center: Vec3, viewer: &Viewer) -> f32 {
        let distance = viewer.distance(center);
        match self.zones {
            Zones::Uniform | Zones::Distance => self.share(distance),
            Zones::Size => {
                let apparent = self.near / distance.max(1e-6);
                if apparent.is_nan() { 1.0 } else { (apparent * apparent).clamp(self.least, 1.0) }
            }
            Zones::Silhouette => {
                let out = (center - crown.center) / crown.half.max(Vec3::splat(1e-6));
                let toward = (viewer.eye - crown.center).normalize_or(Vec3::Z);
                // 1 at the outline, where what lies outward is across the view; 0 before or behind the middle.
                let limb = (out - out.dot(toward) * toward).length().min(1.0);
                self.least + (self.share(distance) - self.least) * (1.0 - MIDDLE * (1.0 - limb * limb))
            }
        }
    }
}

/// How many collapses leave that share of the leaves, or as few as there may be.
pub fn collapses(forest: &Forest, share: f32) -> f32 {
    let share = if share.is_nan() { 1.0 } else { share.clamp(0.0, 1.0) };
    ((1.0 - share) * forest.leaves() as f32).min(forest.changed_groups().len() as f32)
}
