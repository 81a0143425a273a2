//! The order of simplification: half-edge collapses, least quadric error first (Garland & Heckbert 1997, as Rebollo §III has it done by
//! QSlim), all the way down. No vertex is made or moved: each goes to one that stays.
//!
//! Three rules beside the error (ours): no triangle turns over; a texture's seam collapses along itself; and what stands in a piece stays
//! connected to it. A branch's foot is never collapsed, and a branch that is down to a tetrahedron goes as a whole, once nothing stands in it.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use super::nearest::{Corners, nearest_on, share_of_sight};
use super::wood::{Joint, Wood};

/// One step of the simplification.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Each vertex that goes, and the one that it goes to.
    pub moves: Vec<(u32, u32)>,
    /// Triangles left.
    pub triangles: usize,
    /// How far the mesh is from what it was: the largest mean distance, so far, of a vertex from the planes that it stands for, but for a
    /// branch no more than it is thick: where that is less than a pixel, nobody sees where it is. Metres.
    pub error_m: f32,
}

/// No triangle turns by more than this cosine says in a step.
const LEAST_COSINE: f32 = 0.2;

/// How much a triangle may stretch its texture where a seam ends.
const MOST_STRETCH: f32 = 4.0;

/// How much the edge of an open mesh counts, beside its triangles.
const EDGE_WEIGHT: f64 = 4.0;

/// How much the width that a collapse adds counts, beside its distance from planes.
const SWELL_WEIGHT: f32 = 1.0;

/// The least weight that a sum is divided by, metres: slivers weigh next to nothing.
const LEAST_WEIGHT: f64 = 1e-6;

/// The sum of squared distances from planes, each weighted by the square root of its triangle's area, as meshoptimizer has it: by
/// area itself, all twigs would go before a trunk loses a corner.
#[derive(Debug, Clone, Copy)]
struct Quadric {
    square: DMat3,
    linear: DVec3,
    constant: f64,
    weight: f64,
}

impl Quadric {
    /// Of no planes. A matrix's default would be the identity: three planes through the origin.
    const NONE: Self = Self { square: DMat3::ZERO, linear: DVec3::ZERO, constant: 0.0, weight: 0.0 };

    fn of_plane(at: DVec3, normal: DVec3, weight: f64) -> Self {
        let offset = -normal.dot(at);
        let square = DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
        Self { square: square * weight, linear: normal * (offset * weight), constant: offset * offset * weight, weight }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            square: self.square + other.square,
            linear: self.linear + other.linear,
            constant: self.constant + other.constant,
            weight: self.weight + other.weight,
        }
    }

    /// Mean distance of a point from the planes, metres.
    fn mean_m(&self, p: Vec3) -> f32 {
        let p = p.as_dvec3();
        let sum = (p.dot(self.square * p) + 2.0 * self.linear.dot(p) + self.constant).max(0.0);
        (sum / self.weight.max(LEAST_WEIGHT)).sqrt() as f32
    }
}

/// All collapses of a mesh, in order. The mesh is used up.
pub fn steps(wood: Wood) -> Vec<Step> {
    let mut collapser = Collapser::new(wood);
    let mut steps: Vec<Step> = vec![];
    while let Some(Reverse(next)) = collapser.queue.pop() {
        if collapser.stamps[next.from as usize] != next.stamp {
            continue;
        }
        let beside = collapser.wood.neighbours(next.from).binary_search(&next.to).is_ok();
        if !beside || collapser.cost(next.from, next.to) > next.cost || collapser.may(next.from, next.to).is_none() {
            // What was allowed, or cheap, when it was queued no longer is: the last of a piece costs the piece.
            collapser.queue_best(next.from);
            continue;
        }
        let (moves, error_m) = collapser.collapse(next.from, next.to);
        let error_m = steps.last().map_or(0.0, |last| last.error_m).max(error_m);
        steps.push(Step { moves, triangles: collapser.triangles, error_m });
    }
    steps
}

/// A collapse that waits for its turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Waiting {
    /// How far the surface is off then, metres. The bits of a number that is not negative rise with it.
    cost: u32,
    from: u32,
    to: u32,
    stamp: u32,
}

/// What a collapse does to the vertices of a place.
type Moves = Vec<(u32, u32)>;

struct Collapser<'a> {
    wood: Wood<'a>,
    quadrics: Vec<Quadric>,
    queue: BinaryHeap<Reverse<Waiting>>,
    /// Counted up whenever what waits for a place is out of date.
    stamps: Vec<u32>,
    /// Feet of branches that are still there.
    locked: Vec<bool>,
    /// Places that would have been collapsed but for what stands in their piece, by piece.
    held: Vec<BTreeSet<u32>>,
    /// How often what each piece stands in winds round its foot.
    windings: Vec<f32>,
    triangles: usize,
}

impl<'a> Collapser<'a> {
    fn new(wood: Wood<'a>) -> Self {
        let mut locked = vec![false; wood.places.len()];
        wood.joints.iter().flatten().for_each(|joint| locked[joint.place as usize] = true);
        let mut collapser = Self {
            quadrics: quadrics(&wood),
            queue: BinaryHeap::new(),
            stamps: vec![0; wood.places.len()],
            locked,
            held: vec![BTreeSet::new(); wood.pieces.len()],
            windings: wood.joints.par_iter().map(|joint| joint.map_or(0.0, |joint| wood.winding(joint.parent, joint.at))).collect(),
            triangles: wood.triangles.len(),
            wood,
        };
        (0..collapser.wood.places.len() as u32).for_each(|place| collapser.queue_best(place));
        collapser
    }

    /// Puts the cheapest collapse of a place that may be done into the queue.
    fn queue_best(&mut self, from: u32) {
        self.stamps[from as usize] += 1;
        if self.locked[from as usize] || self.wood.around[from as usize].is_empty() {
            return;
        }
        let mut choices: Vec<(u32, u32)> = self.wood.neighbours(from).into_iter().map(|to| (self.cost(from, to), to)).collect();
        choices.sort_unstable();
        if let Some((cost, to)) = choices.into_iter().find(|(_, to)| self.may(from, *to).is_some()) {
            let stamp = self.stamps[from as usize];
            self.queue.push(Reverse(Waiting { cost, from, to, stamp }));
        }
    }

    /// What collapsing `from` into its neighbour `to` does to vertices; `None` where it may not be done.
    fn may(&mut self, from: u32, to: u32) -> Option<Moves> {
        if self.locked[from as usize] || !self.keeps_surface(from, to) {
            return None;
        }
        let piece = self.wood.piece_of[from as usize];
        if self.ends(from, to) {
            // The last of a piece goes whole, or stays.
            let free = self.wood.joints[piece as usize].is_some() && self.wood.children[piece as usize].is_empty();
            if !free {
                self.held[piece as usize].insert(from);
                return None;
            }
            return Some(vec![]);
        }
        if !self.turns_no_triangle(from, to) {
            return None;
        }
        let moves = self.moves(from, to)?;
        if !self.keeps_joints(from, to) {
            self.held[piece as usize].insert(from);
            return None;
        }
        Some(moves)
    }

    /// Whether this is the collapse after which nothing solid is left of a piece.
    fn ends(&self, from: u32, to: u32) -> bool {
        let left = self.wood.left[self.wood.piece_of[from as usize] as usize];
        let sharing = self.wood.around[from as usize].iter().filter(|&&t| self.wood.corners(t).contains(&to)).count();
        // A closed piece of four triangles is a tetrahedron; with one vertex less it would be flat.
        left <= sharing || (left == 4 && sharing == 2 && self.wood.around[from as usize].len() == 3)
    }

    /// What a collapse costs: [`Waiting::cost`].
    fn cost(&self, from: u32, to: u32) -> u32 {
        let off_m = self.quadrics[from as usize].mean_m(self.wood.places[to as usize]);
        let cost_m = if self.ends(from, to) {
            let piece = self.wood.piece_of[from as usize];
            // Half the side of the square that it covers: a thin one is missed less than a thick one of its length.
            off_m.max(0.5 * (self.length_m(piece) * self.wood.thickness_m[piece as usize]).sqrt())
        } else {
            off_m + SWELL_WEIGHT * self.swell_m(from, to)
        };
        cost_m.to_bits()
    }

    /// How much wider a collapse makes the surface, along the longest edge there: planes do not tell a web across a branch's bend from a
    /// branch, as they go on without end.
    fn swell_m(&self, from: u32, to: u32) -> f32 {
        let area = |[a, b, c]: Corners| 0.5 * (b - a).cross(c - a).length();
        let edge = |[a, b, c]: Corners| a.distance(b).max(b.distance(c)).max(c.distance(a));
        let (mut more_m2, mut longest_m) = (0.0, 0.0f32);
        for &triangle in &self.wood.around[from as usize] {
            more_m2 -= area(self.wood.points(triangle));
            if let Some(corners) = self.moved(triangle, from, to) {
                more_m2 += area(corners);
                longest_m = longest_m.max(edge(corners));
            }
        }
        if more_m2 > 0.0 { more_m2 / longest_m } else { 0.0 }
    }

    /// How far what is left of a branch reaches from its foot.
    fn length_m(&self, piece: u32) -> f32 {
        let foot = self.wood.joints[piece as usize].map_or(Vec3::ZERO, |joint| joint.at);
        self.wood.triangles_of(piece).flat_map(|t| self.wood.points(t)).map(|p| p.distance(foot)).fold(0.0, f32::max)
    }

    /// An error as it is told of a piece: of a branch, no more than it is thick.
    fn told_m(&self, piece: u32, error_m: f32) -> f32 {
        let branch = self.wood.joints[piece as usize].is_some();
        if branch { error_m.min(self.wood.thickness_m[piece as usize]) } else { error_m }
    }

    /// The link condition: the surface stays one (Dey et al. 1999); edges of open meshes collapse along themselves.
    fn keeps_surface(&self, from: u32, to: u32) -> bool {
        let corners = self.wood.around[from as usize].iter().flat_map(|&t| self.wood.corners(t));
        let mut near: Vec<u32> = corners.filter(|&place| place != from).collect();
        near.sort_unstable();
        let far = self.wood.neighbours(to);
        let (mut edge, mut common, mut open, mut simple) = (0, 0, false, true);
        // A neighbour comes once for each triangle over the edge to it.
        for same in near.chunk_by(|a, b| a == b) {
            open |= same.len() == 1;
            simple &= same.len() <= 2;
            edge += if same[0] == to { same.len() } else { 0 };
            common += usize::from(far.binary_search(&same[0]).is_ok());
        }
        simple && common == edge && (edge == 1 || !open)
    }

    /// Where each vertex of a place goes: along its own triangles, or, where a seam ends, to the vertex with the nearest texture.
    fn moves(&self, from: u32, to: u32) -> Option<Moves> {
        let wood = &self.wood;
        let mine = |place: u32| {
            let corners = wood.around[place as usize].iter().flat_map(|&t| wood.triangles[t as usize]);
            let mut all: Vec<u32> = corners.filter(|&v| wood.place_of[v as usize] == place).collect();
            all.sort_unstable();
            all.dedup();
            all
        };
        let theirs = mine(to);
        let along = |vertex: u32| {
            let own = wood.around[from as usize].iter().map(|&t| wood.triangles[t as usize]).filter(|t| t.contains(&vertex));
            own.flatten().filter(|&v| wood.place_of[v as usize] == to).min()
        };
        mine(from)
            .into_iter()
            .map(|vertex| Some((vertex, along(vertex).or_else(|| self.nearest_texture(vertex, &theirs))?)))
            .collect()
    }

    fn nearest_texture(&self, vertex: u32, theirs: &[u32]) -> Option<u32> {
        let (uvs, surface) = (&self.wood.surface.uvs, &self.wood.surface.mesh);
        if uvs.len() != surface.positions.len() {
            return theirs.first().copied();
        }
        let (at, uv) = (surface.positions[vertex as usize], uvs[vertex as usize]);
        let place = self.wood.place_of[vertex as usize];
        let own = self.wood.around[place as usize].iter().map(|&t| self.wood.triangles[t as usize]).filter(|t| t.contains(&vertex));
        let others = own.flatten().filter(|&v| v != vertex);
        let density =
            others.map(|v| uvs[v as usize].distance(uv) / surface.positions[v as usize].distance(at).max(1e-9)).fold(0.0, f32::max);
        let target =
            theirs.iter().copied().min_by(|a, b| uvs[*a as usize].distance(uv).total_cmp(&uvs[*b as usize].distance(uv)))?;
        let length = surface.positions[target as usize].distance(at);
        (uvs[target as usize].distance(uv) <= MOST_STRETCH * density * length).then_some(target)
    }

    fn turns_no_triangle(&self, from: u32, to: u32) -> bool {
        let target = self.wood.places[to as usize];
        self.wood.around[from as usize].iter().filter(|&&t| !self.wood.corners(t).contains(&to)).all(|&t| {
            let (corners, points) = (self.wood.corners(t), self.wood.points(t));
            let moved = [0, 1, 2].map(|k| if corners[k] == from { target } else { points[k] });
            let [before, after] = [points, moved].map(|[a, b, c]| (b - a).cross(c - a));
            after.dot(before) > LEAST_COSINE * after.length() * before.length() && after.length_squared() > 0.0
        })
    }

    /// Whether all that stands in the piece, near the place, still would: inside it, or within reach.
    fn keeps_joints(&self, from: u32, to: u32) -> bool {
        self.joints_near(from).all(|(child, joint)| {
            let winding = self.windings[child as usize] + self.winds_more(from, to, joint.at);
            winding.abs() > 0.5 || self.reaches(from, to, joint)
        })
    }

    /// What stands in the piece of a place where its triangles are; a collapse of it changes nothing for the others.
    fn joints_near(&self, place: u32) -> impl Iterator<Item = (u32, &Joint)> {
        let (wood, at) = (&self.wood, self.wood.places[place as usize]);
        let reach = wood.neighbours(place).iter().map(|&next| wood.places[next as usize].distance(at)).fold(0.0, f32::max);
        let children = wood.children[wood.piece_of[place as usize] as usize].iter();
        let joints = children.filter_map(|&child| Some((child, wood.joints[child as usize].as_ref()?)));
        joints.filter(move |(_, joint)| joint.at.distance(at) <= reach + joint.reach_m)
    }

    /// A triangle of `from` once that is where `to` is; `None` where it is gone then.
    fn moved(&self, triangle: u32, from: u32, to: u32) -> Option<Corners> {
        let (corners, points, target) = (self.wood.corners(triangle), self.wood.points(triangle), self.wood.places[to as usize]);
        let gone = corners.contains(&from) && corners.contains(&to);
        (!gone).then(|| [0, 1, 2].map(|k| if corners[k] == from { target } else { points[k] }))
    }

    /// How much more often the surface winds round a point after a collapse.
    fn winds_more(&self, from: u32, to: u32, at: Vec3) -> f32 {
        let change = |&t: &u32| {
            let after = self.moved(t, from, to).map_or(0.0, |corners| share_of_sight(corners, at));
            after - share_of_sight(self.wood.points(t), at)
        };
        self.wood.around[from as usize].iter().map(change).sum()
    }

    fn reaches(&self, from: u32, to: u32, joint: &Joint) -> bool {
        let mut left = self.wood.triangles_of(joint.parent).filter_map(|t| self.moved(t, from, to));
        left.any(|corners| nearest_on(corners, joint.at).distance(joint.at) <= joint.reach_m)
    }

    /// Does it. What vertices went where, and how far the new mesh is off there, metres.
    fn collapse(&mut self, from: u32, to: u32) -> (Moves, f32) {
        if self.ends(from, to) {
            return self.remove(self.wood.piece_of[from as usize]);
        }
        let moves = self.moves(from, to).unwrap_or_default();
        let winds: Vec<(u32, f32)> =
            self.joints_near(from).map(|(child, joint)| (child, self.winds_more(from, to, joint.at))).collect();
        winds.into_iter().for_each(|(child, more)| self.windings[child as usize] += more);
        let target = |v: u32| moves.iter().find(|(vertex, _)| *vertex == v).map_or(v, |(_, target)| *target);
        let touched = self.wood.neighbours(from);
        for triangle in std::mem::take(&mut self.wood.around[from as usize]) {
            if self.wood.corners(triangle).contains(&to) {
                self.bury(triangle);
            } else {
                self.wood.triangles[triangle as usize] = self.wood.triangles[triangle as usize].map(target);
                self.wood.around[to as usize].push(triangle);
            }
        }
        let off_m = self.quadrics[from as usize].mean_m(self.wood.places[to as usize]);
        let sum = self.quadrics[from as usize].plus(self.quadrics[to as usize]);
        self.quadrics[to as usize] = sum;
        self.stamps[from as usize] += 1;
        touched.into_iter().for_each(|place| self.queue_best(place));
        (moves, self.told_m(self.wood.piece_of[to as usize], off_m))
    }

    fn bury(&mut self, triangle: u32) {
        let corners = self.wood.corners(triangle);
        corners.iter().for_each(|&place| self.wood.around[place as usize].retain(|t| *t != triangle));
        self.wood.alive[triangle as usize] = false;
        self.wood.left[self.wood.piece_of[corners[0] as usize] as usize] -= 1;
        self.triangles -= 1;
    }

    /// Takes a piece away: all of it goes to one vertex of its foot.
    fn remove(&mut self, piece: u32) -> (Moves, f32) {
        let triangles: Vec<u32> = self.wood.triangles_of(piece).collect();
        let mut vertices: Vec<u32> = triangles.iter().flat_map(|&t| self.wood.triangles[t as usize]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let place_of = |v: u32| self.wood.place_of[v as usize];
        let foot = self.wood.joints[piece as usize].map(|joint| joint.place);
        let target = vertices.iter().copied().find(|&v| Some(place_of(v)) == foot).unwrap_or(vertices[0]);
        let mut places: Vec<u32> = vertices.iter().map(|&v| place_of(v)).collect();
        places.sort_unstable();
        places.dedup();
        let error_m = self.told_m(piece, self.length_m(piece));
        triangles.into_iter().for_each(|t| self.bury(t));
        places.into_iter().for_each(|place| self.stamps[place as usize] += 1);
        if let Some(joint) = self.wood.joints[piece as usize].take() {
            self.wood.children[joint.parent as usize].retain(|child| *child != piece);
            // What it held in place may go now.
            let freed = std::mem::take(&mut self.held[joint.parent as usize]);
            freed.into_iter().for_each(|place| self.queue_best(place));
        }
        let moves = vertices.into_iter().filter(|&v| v != target).map(|v| (v, target)).collect();
        (moves, error_m)
    }
}

/// For each place the planes of its triangles, and at the edges of open meshes planes across them.
fn quadrics(wood: &Wood) -> Vec<Quadric> {
    let mut quadrics = vec![Quadric::NONE; wood.places.len()];
    let edge_is_open = |a: u32, b: u32| wood.around[a as usize].iter().filter(|&&t| wood.corners(t).contains(&b)).count() == 1;
    for triangle in 0..wood.triangles.len() as u32 {
        let (corners, points) = (wood.corners(triangle), wood.points(triangle).map(|p| p.as_dvec3()));
        let twice = (points[1] - points[0]).cross(points[2] - points[0]);
        let normal = twice.normalize_or_zero();
        let plane = Quadric::of_plane(points[0], normal, (0.5 * twice.length()).sqrt());
        corners.iter().for_each(|&place| quadrics[place as usize] = quadrics[place as usize].plus(plane));
        for k in 0..3 {
            let (a, b) = (k, (k + 1) % 3);
            if edge_is_open(corners[a], corners[b]) {
                let along = points[b] - points[a];
                let across = along.cross(normal).normalize_or_zero();
                let fence = Quadric::of_plane(points[a], across, EDGE_WEIGHT * along.length());
                [a, b].iter().for_each(|&k| quadrics[corners[k] as usize] = quadrics[corners[k] as usize].plus(fence));
            }
        }
    }
    quadrics
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadric_is_the_distance_from_its_planes_and_from_nothing_else() {
        let at = DVec3::new(3.0, -2.0, 5.0);
        let planes = [DVec3::X, DVec3::new(0.0, 0.6, 0.8)].map(|normal| Quadric::of_plane(at, normal, 0.25));
        let sum = planes.into_iter().fold(Quadric::NONE, Quadric::plus);
        assert!(sum.mean_m(at.as_vec3()) < 1e-6, "a point on all planes is off none");
        assert!(
            (sum.mean_m(at.as_vec3() + Vec3::X) - 0.5f32.sqrt()).abs() < 1e-6,
            "one metre from one plane of two that weigh the same"
        );
    }
}
