//! The union of convex solids without what lies inside (constructive solid geometry on triangles): both surfaces are cut along their
//! intersection, and what lies within the other is left out. Ours: the crates that do it have another licence, or leave cracks.
//!
//! Whether an edge passes through a triangle is decided by signs of volumes that are taken in one order whoever asks, and every point of
//! the intersection is one vertex, named by its edge and its triangle: neighbours agree on it, and the result is closed.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::primitive::Solid;

/// A surface whose triangles remember which solid they are of.
#[derive(Debug, Clone, Default)]
pub(super) struct Joined {
    pub solid: Solid,
    /// Number of the solid, one per triangle.
    pub of: Vec<usize>,
}

/// The surface of all `solids` together; each is convex.
pub(super) fn union(solids: &[Solid]) -> Joined {
    let planes: Vec<Vec<Plane>> = solids.iter().map(planes).collect();
    let mut joined = Joined::default();
    for (number, solid) in solids.iter().enumerate() {
        let next = Joined { solid: solid.clone(), of: vec![number; solid.triangles.len()] };
        joined = if number == 0 { next } else { two(&joined, &planes[..number], &next, &planes[number]) };
    }
    joined
}

/// A plane with what lies beyond it.
type Plane = (DVec3, f64);

fn planes(solid: &Solid) -> Vec<Plane> {
    let plane = |t: &[usize; 3]| {
        let [a, b, c] = t.map(|v| solid.positions[v]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        (normal, normal.dot(a))
    };
    solid.triangles.iter().map(plane).collect()
}

/// How far a place lies outside a convex solid, negative inside.
fn outside_one(planes: &[Plane], p: DVec3) -> f64 {
    planes.iter().map(|(normal, at)| normal.dot(p) - at).fold(f64::NEG_INFINITY, f64::max)
}

/// The same of several.
fn outside(solids: &[Vec<Plane>], p: DVec3) -> f64 {
    solids.iter().map(|planes| outside_one(planes, p)).fold(f64::INFINITY, f64::min)
}

fn two(a: &Joined, a_planes: &[Vec<Plane>], b: &Joined, b_planes: &Vec<Plane>) -> Joined {
    let cuts = Cuts::between(&a.solid, &b.solid);
    let mut joined = Joined::default();
    joined.solid.positions = a.solid.positions.iter().chain(&b.solid.positions).chain(&cuts.points).copied().collect();
    let beyond_b = |p: DVec3| outside_one(b_planes, p);
    let beyond_a = |p: DVec3| outside(a_planes, p);
    joined.keep(&a.solid, &a.of, 0, &cuts.on[0], &beyond_b);
    joined.keep(&b.solid, &b.of, a.solid.positions.len(), &cuts.on[1], &beyond_a);
    // Vertices of either come before the new ones, which the cuts number from 0.
    joined
}

/// Where two surfaces meet.
struct Cuts {
    points: Vec<DVec3>,
    /// Per surface, per triangle that is cut: segments between points.
    on: [BTreeMap<usize, Cut>; 2],
    /// How many vertices come before the points.
    first: usize,
}

/// What cuts a triangle.
#[derive(Default, Clone)]
struct Cut {
    /// Numbers of vertices in the joined surface.
    segments: Vec<[usize; 2]>,
    /// Those that lie on the triangle's edges, with the edge's first corner (0 to 2).
    on_edge: BTreeMap<usize, usize>,
}

/// An edge of one surface and a triangle of the other.
type Name = (usize, [usize; 2], usize);

impl Cuts {
    fn between(a: &Solid, b: &Solid) -> Self {
        let first = a.positions.len() + b.positions.len();
        let mut cuts = Self { points: vec![], on: [BTreeMap::new(), BTreeMap::new()], first };
        let mut names: BTreeMap<Name, usize> = BTreeMap::new();
        let boxes = |solid: &Solid| -> Vec<[DVec3; 2]> {
            let around = |t: &[usize; 3]| {
                let [p, q, r] = t.map(|v| solid.positions[v]);
                [p.min(q).min(r), p.max(q).max(r)]
            };
            solid.triangles.iter().map(around).collect()
        };
        let (a_boxes, b_boxes) = (boxes(a), boxes(b));
        for (s, s_box) in a_boxes.iter().enumerate() {
            for (t, t_box) in b_boxes.iter().enumerate() {
                if s_box[0].cmpgt(t_box[1]).any() || t_box[0].cmpgt(s_box[1]).any() {
                    continue;
                }
                let mut met = vec![];
                cuts.through(&mut names, 0, (a, s), (b, t), &mut met);
                cuts.through(&mut names, 1, (b, t), (a, s), &mut met);
                if let [p, q] = met[..] {
                    cuts.on[0].entry(s).or_default().segments.push([p, q]);
                    cuts.on[1].entry(t).or_default().segments.push([p, q]);
                }
            }
        }
        cuts
    }

    /// The edges of triangle `s` of one surface that pass through triangle `t` of the other.
    fn through(
        &mut self,
        names: &mut BTreeMap<Name, usize>,
        side: usize,
        one: (&Solid, usize),
        other: (&Solid, usize),
        met: &mut Vec<usize>,
    ) {
        let ((one, s), (other, t)) = (one, other);
        let corners = other.triangles[t];
        for k in 0..3 {
            let (u, v) = (one.triangles[s][k], one.triangles[s][(k + 1) % 3]);
            let edge = [u.min(v), u.max(v)];
            let Some(point) = crossing(edge.map(|v| one.positions[v]), corners, &other.positions, side) else { continue };
            let number = *names.entry((side, edge, t)).or_insert_with(|| {
                self.points.push(point);
                self.first + self.points.len() - 1
            });
            met.push(number);
            self.on[side].entry(s).or_default().on_edge.insert(number, k);
        }
    }
}

/// Where a segment of surface `side` passes through a triangle of the other.
fn crossing([p, q]: [DVec3; 2], corners: [usize; 3], positions: &[DVec3], side: usize) -> Option<DVec3> {
    let at = corners.map(|v| positions[v]);
    let (from, to) = (volume(at[0], at[1], at[2], p), volume(at[0], at[1], at[2], q));
    if (from > 0.0) == (to > 0.0) {
        return None;
    }
    // Whichever triangle asks, an edge is taken from its lower vertex; and of two edges, the first surface's comes first.
    let left = |k: usize| {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let (low, high) = (positions[a.min(b)], positions[a.max(b)]);
        let positive = if side == 0 { volume(p, q, low, high) } else { volume(low, high, p, q) } > 0.0;
        positive == (a < b)
    };
    let lefts = [left(0), left(1), left(2)];
    (lefts[0] == lefts[1] && lefts[1] == lefts[2]).then(|| p.lerp(q, from / (from - to)))
}

fn volume(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> f64 {
    (b - a).cross(c - a).dot(d - a)
}

impl Joined {
    /// Adds what of a surface lies beyond the other, its vertices numbered from `first`.
    fn keep(&mut self, solid: &Solid, of: &[usize], first: usize, cuts: &BTreeMap<usize, Cut>, beyond: &dyn Fn(DVec3) -> f64) {
        for (t, corners) in solid.triangles.iter().enumerate() {
            let corners = corners.map(|v| v + first);
            let pieces = match cuts.get(&t) {
                Some(cut) => divided(corners, cut, &self.solid.positions),
                None => vec![corners],
            };
            for piece in pieces {
                // Vertices on the cut say nothing; of the others and the middle, whichever is surest.
                let at = piece.map(|v| self.solid.positions[v]);
                let middle = (at[0] + at[1] + at[2]) / 3.0;
                let own = (0..3).filter(|&k| corners.contains(&piece[k])).map(|k| at[k]);
                let surest = own.chain([middle]).map(beyond).fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
                if surest >= 0.0 {
                    self.solid.triangles.push(piece);
                    self.of.push(of[t]);
                }
            }
        }
    }
}

/// A triangle divided along its cuts, the same way round.
fn divided(corners: [usize; 3], cut: &Cut, positions: &[DVec3]) -> Vec<[usize; 3]> {
    let [a, b, c] = corners.map(|v| positions[v]);
    let right = (b - a).normalize_or(DVec3::X);
    let up = (b - a).cross(c - a).cross(right).normalize_or(DVec3::Y);
    let flat = |v: usize| DVec2::new((positions[v] - a).dot(right), (positions[v] - a).dot(up));
    let mut net = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let (mut handles, mut vertices) = (BTreeMap::new(), BTreeMap::new());
    let points = corners.iter().copied().chain(cut.on_edge.keys().copied()).chain(cut.segments.iter().flatten().copied());
    for v in points {
        let p = flat(v);
        if let (false, Ok(handle)) = (handles.contains_key(&v), net.insert(Point2::new(p.x, p.y))) {
            handles.insert(v, handle);
            vertices.entry(handle.index()).or_insert(v);
        }
    }
    // Every edge as a chain through the points on it, then the cuts.
    let mut lines = Vec::new();
    for k in 0..3 {
        let (from, to) = (corners[k], corners[(k + 1) % 3]);
        let mut chain: Vec<usize> = cut.on_edge.iter().filter(|(_, edge)| **edge == k).map(|(v, _)| *v).collect();
        chain.sort_by(|p, q| {
            positions[*p].distance_squared(positions[from]).total_cmp(&positions[*q].distance_squared(positions[from]))
        });
        chain.push(to);
        let mut last = from;
        for v in chain {
            lines.push([last, v]);
            last = v;
        }
    }
    lines.extend(&cut.segments);
    for line in lines {
        if let [Some(&p), Some(&q)] = line.map(|v| handles.get(&v)) {
            if p != q && net.can_add_constraint(p, q) {
                net.add_constraint(p, q);
            }
        }
    }
    // Slivers between a straight edge and the chain along it are of no triangle.
    let on = |v: usize, k: usize| v == corners[k] || v == corners[(k + 1) % 3] || cut.on_edge.get(&v) == Some(&k);
    let faces = net.inner_faces().filter_map(|face| {
        let [p, q, r] = face.vertices().map(|v| vertices.get(&v.fix().index()).copied());
        Some([p?, q?, r?])
    });
    faces.filter(|piece| !(0..3).any(|k| piece.iter().all(|&v| on(v, k)))).collect()
}
