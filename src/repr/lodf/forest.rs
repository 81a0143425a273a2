//! The structure of LoDF (Rebollo §IV-A, fig. 2–6): a forest of binary trees, one cluster of leaves per root.
//!
//! Each cluster lists its leaves in the order in which collapses consume them, the heir of a collapse before the one that it absorbs, the
//! root last. After `c` collapses the first `2 c` are gone (`Init_group` = 2 c) and those made by later collapses are not there yet; what is left is
//! shown, as many as `Active_leaves`. Inside a cluster, leaves are numbered: originals first, then in the order in which they are made. So
//! a leaf is shown if its place is `2 c` or later and its number less than `originals + c`: no `next` links are needed, and of
//! `2 n − 1` places at most half are passed over. (The printed links visit leaves that do not exist: `printed.rs` shows it.)
//!
//! Originals, their corners included, stay in the mesh that they came from; this holds only what is added to it.

use glam::Vec3;

use super::simplify::{Collapse, Corner};

/// A leaf made by a collapse: 8 bytes of corners where Rebollo has 16, since a cluster's originals take 13 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Made {
    /// Original of the cluster · 8 + corner · 2 + turned.
    corners: [u16; 4],
    /// The original of the cluster whose picture it wears.
    wears: u16,
}

/// Leaves of a part in clusters, with every level of detail between the original and one leaf a cluster.
#[derive(Debug, Clone, PartialEq)]
pub struct Forest {
    /// Where the originals of each cluster begin in `members`; one more entry than clusters.
    first: Vec<u32>,
    /// Numbers of the originals in the part, cluster after cluster, rising in each.
    members: Vec<u32>,
    /// Each cluster's leaves in the order in which they are consumed: `2 n − 1` for `n` originals.
    order: Vec<u16>,
    /// Each cluster's made leaves in order: `n − 1`.
    made: Vec<Made>,
    /// The cluster of each collapse, in order (`Changed_groups`).
    changed: Vec<u32>,
}

/// A leaf that may be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LeafShape {
    /// Its corners.
    pub corners: [Corner; 4],
    /// The original whose texture coordinates it wears, corner by corner.
    pub wears: u32,
}

/// A leaf by its cluster and its number inside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct LeafId {
    /// Its cluster.
    pub cluster: u32,
    /// Its number there: originals first, then as they are made.
    pub number: u16,
}

impl Forest {
    /// Of the collapses of `leaves` originals, as [`super::simplify::simplify`] gives them.
    ///
    /// # Panics
    /// When they are not such.
    pub fn new(leaves: usize, collapses: &[Collapse]) -> Self {
        let root = roots(leaves, collapses);
        // Clusters are numbered by their first original (fig. 4).
        let mut cluster_of_root = vec![u32::MAX; root.len()];
        let mut sizes: Vec<u32> = vec![];
        let mut cluster_of = Vec::with_capacity(leaves);
        for root in &root[..leaves] {
            let cluster = &mut cluster_of_root[*root as usize];
            if *cluster == u32::MAX {
                *cluster = sizes.len() as u32;
                sizes.push(0);
            }
            sizes[*cluster as usize] += 1;
            cluster_of.push(*cluster);
        }
        let mut first = vec![0];
        first.extend(sizes.iter().scan(0, |end, size| {
            *end += size;
            Some(*end)
        }));
        let mut members = vec![0; leaves];
        let mut number = Vec::with_capacity(root.len());
        let mut filled = vec![0u32; sizes.len()];
        for (leaf, &cluster) in cluster_of.iter().enumerate() {
            let at = &mut filled[cluster as usize];
            members[(first[cluster as usize] + *at) as usize] = leaf as u32;
            number.push(*at as u16);
            *at += 1;
        }
        let mut wears: Vec<u16> = number.clone();
        let clusters = sizes.len();
        let mut forest = Self {
            order: vec![0; 2 * leaves - clusters],
            made: vec![Made { corners: [0; 4], wears: 0 }; leaves - clusters],
            changed: Vec::with_capacity(collapses.len()),
            first,
            members,
        };
        let mut done = vec![0u32; clusters];
        for collapse in collapses {
            let cluster = cluster_of_root[root[collapse.heir as usize] as usize];
            let c = &mut done[cluster as usize];
            let order = forest.order_start(cluster) + 2 * *c as usize;
            let [heir, absorbed] = [collapse.heir, collapse.absorbed].map(|leaf| leaf as usize);
            forest.order[order] = number[heir];
            forest.order[order + 1] = number[absorbed];
            let corner = |at: Corner| number[at.leaf as usize] << 3 | u16::from(at.corner) << 1 | u16::from(at.turned);
            let made = forest.made_start(cluster) + *c as usize;
            forest.made[made] = Made { corners: collapse.corners.map(corner), wears: wears[heir] };
            wears.push(wears[heir]);
            number.push((sizes[cluster as usize] + *c) as u16);
            forest.changed.push(cluster);
            *c += 1;
        }
        for cluster in 0..clusters as u32 {
            let end = forest.order_start(cluster + 1);
            forest.order[end - 1] = 2 * (sizes[cluster as usize] as u16 - 1);
        }
        forest
    }

    /// Original leaves.
    pub fn leaves(&self) -> usize {
        self.members.len()
    }

    /// Clusters: as many leaves as the coarsest level has.
    pub fn clusters(&self) -> usize {
        self.first.len() - 1
    }

    /// The cluster of each collapse, in order (`Changed_groups`, fig. 6).
    pub fn changed_groups(&self) -> &[u32] {
        &self.changed
    }

    /// Numbers of the originals of a cluster in their part, rising.
    pub fn members(&self, cluster: u32) -> &[u32] {
        &self.members[self.first[cluster as usize] as usize..self.first[cluster as usize + 1] as usize]
    }

    /// Originals of a cluster.
    pub fn size(&self, cluster: u32) -> usize {
        self.members(cluster).len()
    }

    /// Numbers of a cluster's leaves in the order in which they are consumed.
    pub fn order(&self, cluster: u32) -> &[u16] {
        &self.order[self.order_start(cluster)..self.order_start(cluster + 1)]
    }

    fn order_start(&self, cluster: u32) -> usize {
        2 * self.first[cluster as usize] as usize - cluster as usize
    }

    /// Where a cluster's made leaves begin among all of them.
    pub(super) fn made_start(&self, cluster: u32) -> usize {
        self.first[cluster as usize] as usize - cluster as usize
    }

    /// The leaves that a cluster shows after `collapsed` collapses, in the order in which they will be consumed: the first is the heir of the
    /// next collapse and the second what it absorbs.
    pub fn shown(&self, cluster: u32, collapsed: usize) -> impl Iterator<Item = u16> {
        let end = (self.size(cluster) + collapsed) as u16;
        self.order(cluster)[2 * collapsed..].iter().copied().filter(move |&number| number < end)
    }

    /// The leaf that the next collapse makes, with its heir and what it absorbs; `None` where one leaf is left.
    pub fn next(&self, cluster: u32, collapsed: usize) -> Option<[u16; 3]> {
        match self.order(cluster)[2 * collapsed..] {
            [heir, absorbed, _, ..] => Some([heir, absorbed, (self.size(cluster) + collapsed) as u16]),
            _ => None,
        }
    }

    /// What a leaf looks like.
    pub fn shape(&self, LeafId { cluster, number }: LeafId) -> LeafShape {
        let members = self.members(cluster);
        let Some(made) = usize::from(number).checked_sub(members.len()) else {
            let leaf = members[usize::from(number)];
            return LeafShape { corners: [0, 1, 2, 3].map(|corner| Corner { leaf, corner, turned: false }), wears: leaf };
        };
        let Made { corners, wears } = self.made[self.made_start(cluster) + made];
        let corner =
            |code: u16| Corner { leaf: members[usize::from(code >> 3)], corner: (code >> 1 & 3) as u8, turned: code & 1 == 1 };
        LeafShape { corners: corners.map(corner), wears: members[usize::from(wears)] }
    }

    /// Whose picture a leaf wears: that original's place among the members of all clusters.
    pub fn wearer(&self, LeafId { cluster, number }: LeafId) -> usize {
        let local = match usize::from(number).checked_sub(self.size(cluster)) {
            None => number,
            Some(made) => self.made[self.made_start(cluster) + made].wears,
        };
        self.first[cluster as usize] as usize + usize::from(local)
    }

    /// Of each cluster's collapses in turn, cluster after cluster: how many of all collapses are done when it is.
    pub fn ends(&self) -> Vec<u32> {
        let mut ends = vec![0; self.made.len()];
        let mut done = vec![0; self.clusters()];
        for (&cluster, end) in self.changed.iter().zip(1..) {
            let nth = &mut done[cluster as usize];
            ends[self.made_start(cluster) + *nth] = end;
            *nth += 1;
        }
        ends
    }

    /// A number for every leaf of the forest: originals of all clusters and what is made of them, cluster after cluster.
    pub fn flat(&self, LeafId { cluster, number }: LeafId) -> u32 {
        self.order_start(cluster) as u32 + u32::from(number)
    }

    /// Leaves of all levels.
    pub fn all_leaves(&self) -> usize {
        self.order.len()
    }

    /// How many collapses of each cluster are among the first `index` of all.
    pub fn collapsed_at(&self, index: usize) -> Vec<u16> {
        let mut collapsed = vec![0; self.clusters()];
        for &cluster in &self.changed[..index.min(self.changed.len())] {
            collapsed[cluster as usize] += 1;
        }
        collapsed
    }

    /// Middle and radius of what each cluster's originals cover, with `corners` of each.
    pub fn spheres(&self, corners: impl Fn(u32) -> [Vec3; 4]) -> Vec<(Vec3, f32)> {
        let sphere = |cluster| {
            let points = || self.members(cluster).iter().flat_map(|&leaf| corners(leaf)).filter(|p| p.is_finite());
            let middle = points().sum::<Vec3>() / points().count().max(1) as f32;
            (middle, points().map(|p| p.distance(middle)).fold(0.0, f32::max))
        };
        (0..self.clusters() as u32).map(sphere).collect()
    }

    /// Bytes of everything in here.
    pub fn bytes(&self) -> usize {
        let Self { first, members, order, made, changed } = self;
        size_of_val(&first[..])
            + size_of_val(&members[..])
            + size_of_val(&order[..])
            + size_of_val(&made[..])
            + size_of_val(&changed[..])
    }
}

/// The last leaf that each leaf ends up in.
fn roots(leaves: usize, collapses: &[Collapse]) -> Vec<u32> {
    let mut root: Vec<u32> = (0..(leaves + collapses.len()) as u32).collect();
    for (i, collapse) in collapses.iter().enumerate().rev() {
        let end = root[leaves + i];
        root[collapse.heir as usize] = end;
        root[collapse.absorbed as usize] = end;
    }
    root
}
