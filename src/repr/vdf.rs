//! VDF, the predecessor that LoDF is measured against (Remolar et al. 2003, its 11, and 2004, its 5, as told in Rebollo §II and VI): one hierarchy of
//! leaves, of which a front is shown; a change of level walks the whole front, and all leaves shown are sent again.
//!
//! Rebollo only cites it; this is our reading. It gets the same care as LoDF: the same collapses, arrays of numbers, no allocation
//! in a change of level. A node has its corners and the numbers of its parent and its two children, 28 bytes: 1.62 times the original.

use glam::Vec3;

use super::lodf::foliage;
use super::lodf::simplify::{Collapse, Corner};
use super::lodf::{LeafShape, LodfParams, method};
use super::{BuiltTree, Job, Representation, Scope, SourceKind, TreeSource};
use crate::Result;
use crate::geom::PolyMesh;
use crate::params::{ParamSet, ParamSpec};

/// A leaf of any level. [`Node::NONE`] stands for no parent and for no children.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Node {
    /// Its corners: original · 8 + corner · 2 + whether the normal is turned round.
    pub corners: [u32; 4],
    /// Who replaces it.
    pub parent: u32,
    /// Whom it replaces: the one whose picture it wears first.
    pub children: [u32; 2],
}

impl Node {
    /// No node.
    pub const NONE: u32 = u32::MAX;
}

/// All leaves of all levels as one hierarchy. Node `n + i` was made by collapse `i` of `n` originals.
#[derive(Debug, Clone, PartialEq)]
pub struct Hierarchy {
    nodes: Vec<Node>,
    originals: usize,
    /// Middle and radius of a sphere around each node's whole family, for views: those of a parent hold those of its children.
    spheres: Vec<(Vec3, f32)>,
}

/// Which nodes are shown: no two of one family line, and of each line one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Front {
    nodes: Vec<u32>,
    /// The next one, kept so that a change allocates nothing.
    spare: Vec<u32>,
}

impl Hierarchy {
    /// Of the collapses of a foliage's leaves.
    pub fn new(mesh: &PolyMesh, collapses: &[Collapse]) -> Self {
        let originals = mesh.polygon_count();
        let code = |c: Corner| c.leaf << 3 | u32::from(c.corner) << 1 | u32::from(c.turned);
        let node = |corners: [Corner; 4], children| Node { corners: corners.map(code), parent: Node::NONE, children };
        let mut nodes: Vec<Node> = (0..originals as u32)
            .map(|leaf| node([0, 1, 2, 3].map(|corner| Corner { leaf, corner, turned: false }), [Node::NONE; 2]))
            .collect();
        let mut spheres: Vec<_> = (0..originals as u32).map(|leaf| around(&foliage::places(mesh, leaf))).collect();
        for collapse in collapses {
            let children = [collapse.heir, collapse.absorbed];
            for child in children {
                nodes[child as usize].parent = nodes.len() as u32;
            }
            let [a, b] = children.map(|child| spheres[child as usize]);
            spheres.push(enclosing(a, b));
            nodes.push(node(collapse.corners, children));
        }
        Self { nodes, originals, spheres }
    }

    /// Leaves of all levels.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Bytes of everything in here.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.spheres[..])
    }

    /// The original.
    pub fn finest(&self) -> Front {
        Front { nodes: (0..self.originals as u32).collect(), spare: Vec::with_capacity(self.originals) }
    }

    /// What a node looks like.
    pub fn shape(&self, node: u32) -> LeafShape {
        let mut wears = node;
        while self.nodes[wears as usize].children[0] != Node::NONE {
            wears = self.nodes[wears as usize].children[0];
        }
        let corner = |code: u32| Corner { leaf: code >> 3, corner: (code >> 1 & 3) as u8, turned: code & 1 == 1 };
        LeafShape { corners: self.nodes[node as usize].corners.map(corner), wears }
    }

    /// Moves a front to the level after `collapses` collapses.
    pub fn set_uniform(&self, front: &mut Front, collapses: usize) {
        let end = (self.originals + collapses) as u32;
        self.walk(front, |node| node < end);
    }

    /// Moves a front so that each family is as coarse as `collapses` says for its sphere. It has to ask no more of a sphere than of any that
    /// lies in it, as what falls with the distance of the sphere's nearest point does.
    pub fn set_variable(&self, front: &mut Front, collapses: impl Fn((Vec3, f32)) -> f32) {
        self.walk(front, |node| match (node as usize).checked_sub(self.originals) {
            None => true,
            Some(made) => (made as f32) < collapses(self.spheres[node as usize]),
        });
    }

    /// Walks the front: where the parent may be shown it is, once, and what may not be shown is split.
    fn walk(&self, front: &mut Front, may: impl Fn(u32) -> bool) {
        front.spare.clear();
        for &node in &front.nodes {
            let (mut at, mut first) = (node, true);
            loop {
                let parent = self.nodes[at as usize].parent;
                if parent == Node::NONE || !may(parent) {
                    break;
                }
                // Of all that come to the parent, the one that came from the first of each pair shows it.
                first &= self.nodes[parent as usize].children[0] == at;
                at = parent;
            }
            if at == node {
                self.split(node, &may, &mut front.spare);
            } else if first {
                front.spare.push(at);
            }
        }
        std::mem::swap(&mut front.nodes, &mut front.spare);
    }

    fn split(&self, node: u32, may: &impl Fn(u32) -> bool, out: &mut Vec<u32>) {
        let children = self.nodes[node as usize].children;
        if children[0] == Node::NONE || may(node) {
            out.push(node);
            return;
        }
        children.into_iter().for_each(|child| self.split(child, may, out));
    }
}

impl Front {
    /// The leaves shown.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }
}

/// A sphere around points.
fn around(points: &[Vec3]) -> (Vec3, f32) {
    let middle = points.iter().sum::<Vec3>() / points.len() as f32;
    (middle, points.iter().map(|p| p.distance(middle)).fold(0.0, f32::max))
}

/// The smallest sphere around two, a little more for what rounding takes.
fn enclosing(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let apart = a.0.distance(b.0);
    if apart + b.1 <= a.1 {
        return a;
    }
    if apart + a.1 <= b.1 {
        return b;
    }
    let radius = 0.5 * (apart + a.1 + b.1);
    (a.0 + (b.0 - a.0) * ((radius - a.1) / apart.max(1e-20)), radius * (1.0 + 1e-5))
}

/// View-dependent multiresolution foliage.
pub struct Vdf;

impl Representation for Vdf {
    fn id(&self) -> &'static str {
        "vdf"
    }

    fn name(&self) -> &'static str {
        "View-dependent foliage"
    }

    fn citation(&self) -> &'static str {
        "Remolar et al. 2003 and 2004, as told by Rebollo et al. 2007, §II and VI"
    }

    fn scopes(&self) -> &'static [Scope] {
        &[Scope::Foliage]
    }

    fn partner(&self) -> &'static str {
        "lodstrips"
    }

    fn accepts(&self) -> &'static [SourceKind] {
        SourceKind::REFERENCE
    }

    fn specs(&self) -> Vec<ParamSpec> {
        LodfParams::specs()
    }

    fn refuses(&self, source: &TreeSource) -> Option<String> {
        source.in_leaf().err()
    }

    fn build(&self, job: &Job) -> Result<BuiltTree> {
        // Drawn like LoDF's, with every leaf sent again whenever one changes.
        method::built(job, &job.settings.read()?, true)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Seed;
    use crate::repr::lodf::{Forest, LeafId, Resolution, simplify::simplify};

    fn sorted(mut shapes: Vec<LeafShape>) -> Vec<LeafShape> {
        shapes.sort_unstable_by_key(|shape| (shape.wears, shape.corners.map(|c| (c.leaf, c.corner))));
        shapes
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn the_front_shows_what_lodf_shows(leaves in 1usize..250, seed in any::<u64>(), walk in proptest::collection::vec(0.0f32..1.0, 1..8)) {
            let surface = foliage::synthetic(leaves, Seed(seed));
            let collapses = simplify(&foliage::blades(&surface), leaves.div_ceil(30));
            let hierarchy = Hierarchy::new(&surface.mesh, &collapses);
            let forest = Forest::new(leaves, &collapses);
            let (mut front, mut resolution) = (hierarchy.finest(), Resolution::finest(&forest));
            for share in walk {
                let index = (share * collapses.len() as f32) as usize;
                hierarchy.set_uniform(&mut front, index);
                resolution.set_uniform(&forest, leaves - index);
                let ours = front.nodes().iter().map(|node| hierarchy.shape(*node)).collect();
                let theirs = (0..forest.clusters() as u32).flat_map(|cluster| {
                    forest.shown(cluster, resolution.collapsed(cluster)).map(|number| forest.shape(LeafId { cluster, number })).collect::<Vec<_>>()
                }).collect();
                prop_assert_eq!(sorted(ours), sorted(theirs));
            }
        }

        #[test]
        fn a_front_that_follows_a_view_shows_every_family_once(leaves in 2usize..200, eyes in proptest::collection::vec(any::<[i8; 3]>(), 1..6)) {
            let surface = foliage::synthetic(leaves, Seed(9));
            let collapses = simplify(&foliage::blades(&surface), leaves.div_ceil(30));
            let hierarchy = Hierarchy::new(&surface.mesh, &collapses);
            let mut front = hierarchy.finest();
            for eye in eyes {
                let eye = 0.1 * Vec3::from(eye.map(f32::from));
                hierarchy.set_variable(&mut front, |(middle, radius)| collapses.len() as f32 * ((eye.distance(middle) - radius) / 8.0).clamp(0.0, 1.0));
                let mut covered = vec![0; leaves];
                for &node in front.nodes() {
                    let mut below = vec![node];
                    while let Some(node) = below.pop() {
                        match hierarchy.nodes()[node as usize].children {
                            [Node::NONE, _] => covered[node as usize] += 1,
                            children => below.extend(children),
                        }
                    }
                }
                prop_assert!(covered.iter().all(|count| *count == 1), "{covered:?}");
            }
        }
    }
}
