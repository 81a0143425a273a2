//! Foliage as a list of leaves: pairs of triangles joined to quads, and quads that cross in one place counted as one leaf.

use std::collections::HashMap;

use glam::Vec3;

use super::connect::Components;
use crate::geom::{PolyMesh, Surface};

/// One leaf, or one card with many painted on it: polygons of one foliage part, each list contiguous.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Leaf {
    /// Which of [`super::ReferenceTree::foliage`].
    pub part: u32,
    /// Its first quad in the part's mesh.
    pub first_quad: u32,
    /// How many quads it has: 1, or more for crossed sets and bent cards.
    pub quads: u32,
    /// Its first triangle in the part's mesh.
    pub first_triangle: u32,
    /// How many triangles it has beside its quads.
    pub triangles: u32,
}

/// Most triangles of one quad or quad-like piece of a crossed set, seen from two sides.
const CROSSED_TRIANGLES: usize = 4;
/// How near the middles of crossed pieces lie, in parts of their diagonal, and how alike their diagonals are.
const SAME_MIDDLE: f32 = 0.003;
const SAME_SIZE: f32 = 0.7;
/// Most pieces of a crossed set.
const MOST_PIECES: u32 = 8;
/// Largest angle between the two triangles of a quad.
const LARGEST_FOLD_COS: f32 = 0.5;

/// Joins pairs of triangles and puts the polygons of each leaf side by side. The surface stays what it was.
pub fn gathered(surface: &mut Surface, part: u32) -> Vec<Leaf> {
    let components = Components::of(&surface.mesh);
    let mut joined = Joined::default();
    for component in 0..components.count() {
        joined.add(surface, components.polygons(component));
    }
    let (leaf_of, count) = crossed(&joined, &surface.mesh);
    let mut leaves = Vec::with_capacity(count);
    let mut mesh = PolyMesh { positions: std::mem::take(&mut surface.mesh.positions), ..PolyMesh::default() };
    mesh.quads.reserve_exact(joined.quads.len());
    mesh.triangles.reserve_exact(joined.triangles.len());
    // Almost always the pieces of a leaf follow one another; sorting is stable, so that equal files give equal lists.
    let mut order: Vec<u32> = (0..leaf_of.len() as u32).collect();
    order.sort_by_key(|&piece| leaf_of[piece as usize]);
    for pieces in order.chunk_by(|&a, &b| leaf_of[a as usize] == leaf_of[b as usize]) {
        let (first_quad, first_triangle) = (mesh.quads.len() as u32, mesh.triangles.len() as u32);
        for &piece in pieces {
            mesh.quads.extend_from_slice(joined.quads_of(piece as usize));
            mesh.triangles.extend_from_slice(joined.triangles_of(piece as usize));
        }
        let (quads, triangles) = (mesh.quads.len() as u32 - first_quad, mesh.triangles.len() as u32 - first_triangle);
        leaves.push(Leaf { part, first_quad, quads, first_triangle, triangles });
    }
    surface.mesh = mesh;
    leaves
}

/// The polygons of all components after joining.
#[derive(Default)]
struct Joined {
    quads: Vec<[u32; 4]>,
    triangles: Vec<[u32; 3]>,
    /// Where each component's quads and triangles end.
    ends: Vec<(u32, u32)>,
}

impl Joined {
    fn add(&mut self, surface: &Surface, polygons: &[u32]) {
        let mesh = &surface.mesh;
        let mut waiting: Option<[u32; 3]> = None;
        for &polygon in polygons {
            match *mesh.polygon(polygon as usize) {
                [a, b, c] => {
                    let triangle = [a, b, c];
                    // A quad's two triangles follow one another in every file that was made of quads.
                    match waiting.take() {
                        Some(first) => match joined(surface, first, triangle) {
                            Some(quad) => self.quads.push(quad),
                            None => {
                                self.triangles.push(first);
                                waiting = Some(triangle);
                            }
                        },
                        None => waiting = Some(triangle),
                    }
                }
                [a, b, c, d] => self.quads.push([a, b, c, d]),
                _ => {}
            }
        }
        self.triangles.extend(waiting);
        self.ends.push((self.quads.len() as u32, self.triangles.len() as u32));
    }

    fn start(&self, piece: usize) -> (u32, u32) {
        piece.checked_sub(1).map_or((0, 0), |before| self.ends[before])
    }

    fn quads_of(&self, piece: usize) -> &[[u32; 4]] {
        &self.quads[self.start(piece).0 as usize..self.ends[piece].0 as usize]
    }

    fn triangles_of(&self, piece: usize) -> &[[u32; 3]] {
        &self.triangles[self.start(piece).1 as usize..self.ends[piece].1 as usize]
    }
}

/// The quad of two triangles over a common edge, which becomes its diagonal between corners 0 and 2; `None` when they have none, or
/// are folded too much, or bend inward at a corner.
fn joined(surface: &Surface, p: [u32; 3], q: [u32; 3]) -> Option<[u32; 4]> {
    let at = |v: u32| surface.mesh.positions[v as usize];
    let uv = |v: u32| surface.uvs.get(v as usize);
    let same = |a: u32, b: u32| a == b || (at(a) == at(b) && uv(a) == uv(b));
    // The edge from corner k of `p` is walked the other way by `q`.
    let (k, apex) = (0..3).find_map(|k| {
        let (from, to) = (p[k], p[(k + 1) % 3]);
        (0..3).find(|&m| same(q[m], to) && same(q[(m + 1) % 3], from)).map(|m| (k, q[(m + 2) % 3]))
    })?;
    let quad = [p[k], apex, p[(k + 1) % 3], p[(k + 2) % 3]];
    let corner = |k: usize| {
        let [before, here, after] = [quad[(k + 3) % 4], quad[k], quad[(k + 1) % 4]].map(at);
        (after - here).cross(before - here)
    };
    let [one, two] = [corner(1), corner(3)];
    let flat = one.dot(two) >= LARGEST_FOLD_COS * one.length() * two.length();
    let convex = [corner(0), corner(2)].into_iter().all(|turn| turn.dot(one + two) > 0.0);
    (flat && convex).then_some(quad)
}

/// Which leaf each piece belongs to, and how many leaves there are: pieces of one size about one middle are one leaf.
fn crossed(joined: &Joined, mesh: &PolyMesh) -> (Vec<u32>, usize) {
    let mut sets = Sets::default();
    let mut leaf_of = Vec::with_capacity(joined.ends.len());
    let mut count = 0;
    for piece in 0..joined.ends.len() {
        let (quads, triangles) = (joined.quads_of(piece), joined.triangles_of(piece));
        let small = 2 * quads.len() + triangles.len() <= CROSSED_TRIANGLES && !quads.is_empty();
        let corners = || quads.iter().flatten().chain(triangles.iter().flatten()).map(|&v| mesh.positions[v as usize]);
        let found = if small {
            let middle = corners().sum::<Vec3>() / corners().count() as f32;
            let reach = corners().map(|p| p.distance(middle)).fold(0.0, f32::max);
            sets.place(Piece { middle, reach, leaf: count, pieces: 1 })
        } else {
            None
        };
        leaf_of.push(found.unwrap_or(count));
        count += u32::from(found.is_none());
    }
    (leaf_of, count as usize)
}

/// The first piece of a leaf.
struct Piece {
    middle: Vec3,
    /// From the middle to the farthest corner.
    reach: f32,
    leaf: u32,
    pieces: u32,
}

/// Leaves by the place of their middle.
#[derive(Default)]
struct Sets {
    /// Edge of a cell, set by the first leaf.
    cell: f32,
    cells: HashMap<[i32; 3], Vec<u32>>,
    pieces: Vec<Piece>,
}

/// Most leaves of one cell that are looked at: a million leaves in one place are no tree.
const MOST_IN_CELL: usize = 64;

impl Sets {
    /// The leaf that the piece belongs to; `None` when it begins a new one.
    fn place(&mut self, piece: Piece) -> Option<u32> {
        if self.cell == 0.0 {
            self.cell = (0.25 * piece.reach).max(f32::MIN_POSITIVE);
        }
        let near = 2.0 * SAME_MIDDLE * piece.reach;
        let cell = |p: Vec3| (p / self.cell).floor().as_ivec3().to_array();
        let (low, high) = (cell(piece.middle - near), cell(piece.middle + near));
        for x in low[0]..=high[0].min(low[0].saturating_add(1)) {
            for y in low[1]..=high[1].min(low[1].saturating_add(1)) {
                for z in low[2]..=high[2].min(low[2].saturating_add(1)) {
                    for &number in self.cells.get(&[x, y, z]).into_iter().flatten().take(MOST_IN_CELL) {
                        let other = &mut self.pieces[number as usize];
                        let alike = other.reach.min(piece.reach) >= SAME_SIZE * other.reach.max(piece.reach);
                        if alike && other.middle.distance(piece.middle) <= near && other.pieces < MOST_PIECES {
                            other.pieces += 1;
                            return Some(other.leaf);
                        }
                    }
                }
            }
        }
        self.cells.entry(cell(piece.middle)).or_default().push(self.pieces.len() as u32);
        self.pieces.push(piece);
        None
    }
}
