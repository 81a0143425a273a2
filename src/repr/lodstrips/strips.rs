//! LodStrips (Ramos & Chover 2004; Rebollo §III): triangle strips, for each vertex the one that it collapses to, and a record of what every
//! collapse changes in the strips. A change of level touches only the strips that it changes, and can be taken back.
//!
//! Vertices are numbered such that the first to go comes last: a level uses the first so many. Collapse by collapse, entries of strips
//! are replaced; entries that then repeat are left out in pairs, so that no triangle turns over.

use ::meshopt::{optimize_vertex_cache_strip, stripify};

use super::collapse::{Step, steps};
use super::wood::Wood;
use crate::geom::{PolyMesh, Surface};

/// Ends a strip in the lists of the simplifier's library.
const RESTART: u32 = u32::MAX;

/// No vertex.
pub const NONE: u32 = u32::MAX;

/// A mesh in all its levels of detail. Level 0 is all of it, each step takes a place or a piece away.
#[derive(Debug, Clone, PartialEq)]
pub struct Lodstrips {
    /// Vertices; those that stay longest first. Its triangles are level 0.
    pub surface: Surface,
    /// The vertices of all strips at level 0, one strip after the other.
    pub entries: Vec<u32>,
    /// Where each strip begins in `entries`, and the end.
    pub starts: Vec<u32>,
    /// What each vertex collapses to; [`NONE`] for those that stay.
    pub targets: Vec<u32>,
    /// What each level is.
    pub levels: Vec<LevelOf>,
    /// Where the entries that are replaced when a vertex goes begin in `changes`, for the last vertex first, and the end.
    pub change_starts: Vec<u32>,
    /// Places of entries.
    pub changes: Vec<u32>,
}

/// A level of detail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelOf {
    /// Its vertices are the first so many.
    pub vertices: u32,
    /// Its triangles.
    pub triangles: u32,
    /// How far it is from level 0, metres.
    pub error_m: f32,
}

impl Lodstrips {
    /// Simplifies a surface all the way down.
    pub fn of(surface: &Surface) -> Self {
        let wood = Wood::of(surface);
        let moves = Removal::of(&wood, &steps(wood.clone()));
        let count = surface.mesh.positions.len();
        // The k-th vertex to go gets the k-th number from the end.
        let mut number = vec![NONE; count];
        moves.order.iter().enumerate().for_each(|(k, (vertex, _))| number[*vertex as usize] = (count - 1 - k) as u32);
        let mut free = 0;
        for new in number.iter_mut().filter(|new| **new == NONE) {
            *new = free;
            free += 1;
        }
        let mut targets = vec![NONE; count];
        moves.order.iter().for_each(|(vertex, target)| targets[number[*vertex as usize] as usize] = number[*target as usize]);
        let triangles: Vec<[u32; 3]> = wood.triangles.iter().map(|t| t.map(|v| number[v as usize])).collect();
        let (entries, starts) = strips(&triangles, count);
        let (change_starts, changes) = record(&entries, &targets, moves.order.len());
        let levels = moves.levels.iter().map(|(gone, triangles, error_m)| LevelOf {
            vertices: (count - gone) as u32,
            triangles: *triangles as u32,
            error_m: *error_m,
        });
        Self {
            levels: levels.collect(),
            surface: renumbered(surface, &number, triangles),
            entries,
            starts,
            targets,
            change_starts,
            changes,
        }
    }

    /// The first level with at most so many triangles; the last when all have more.
    pub fn level_with(&self, triangles: usize) -> usize {
        self.levels.partition_point(|level| level.triangles as usize > triangles).min(self.levels.len().saturating_sub(1))
    }

    /// Bytes of all that a renderer keeps: vertices as [`Stats`](crate::repr::Stats) counts them, entries, targets, the record.
    pub fn bytes(&self) -> usize {
        let numbers = self.entries.len() + self.starts.len() + self.targets.len() + self.change_starts.len() + self.changes.len();
        32 * self.surface.mesh.positions.len() + 4 * numbers
    }

    /// Level 0, ready to go to others.
    pub fn extraction(&self) -> Extraction<'_> {
        let strips = self.starts.windows(2).map(|ends| packed(&self.entries[ends[0] as usize..ends[1] as usize])).collect();
        Extraction { model: self, gone: 0, entries: self.entries.clone(), strips, touched: vec![false; self.starts.len() - 1] }
    }
}

/// The strips of one level.
#[derive(Debug, Clone)]
pub struct Extraction<'a> {
    model: &'a Lodstrips,
    /// Vertices that are gone: the last so many.
    gone: usize,
    /// All entries with their present vertices.
    entries: Vec<u32>,
    /// Each strip as it is drawn.
    strips: Vec<Vec<u32>>,
    touched: Vec<bool>,
}

impl Extraction<'_> {
    /// Goes to a level, finer or coarser, and says how many strips that changed.
    pub fn go_to(&mut self, level: usize) -> usize {
        let model = self.model;
        let count = model.surface.mesh.positions.len();
        let wanted = model.levels.get(level).map_or(self.gone, |level| count - level.vertices as usize);
        while self.gone != wanted {
            let forth = self.gone < wanted;
            let last = if forth { self.gone } else { self.gone - 1 };
            let vertex = (count - 1 - last) as u32;
            let now = if forth { model.targets[vertex as usize] } else { vertex };
            let range = model.change_starts[last] as usize..model.change_starts[last + 1] as usize;
            for &entry in &model.changes[range] {
                self.entries[entry as usize] = now;
                let strip = model.starts.partition_point(|start| *start <= entry) - 1;
                self.touched[strip] = true;
            }
            self.gone = if forth { last + 1 } else { last };
        }
        let touched: Vec<usize> = (0..self.touched.len()).filter(|strip| self.touched[*strip]).collect();
        for &strip in &touched {
            self.strips[strip] = packed(&self.entries[model.starts[strip] as usize..model.starts[strip + 1] as usize]);
            self.touched[strip] = false;
        }
        touched.len()
    }

    /// The strips as they are drawn, empty ones too.
    pub fn strips(&self) -> &[Vec<u32>] {
        &self.strips
    }

    /// Their triangles, without those that have two corners in one place.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let positions = &self.model.surface.mesh.positions;
        let solid = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| positions[v as usize]);
            a != b && b != c && c != a
        };
        self.strips.iter().flat_map(|strip| triangles_of(strip)).filter(solid).collect()
    }
}

/// The triangles of a strip, every other one turned, without those that have a corner twice.
pub fn triangles_of(strip: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    let turned = |(k, t): (usize, &[u32])| if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] };
    strip.windows(3).enumerate().map(turned).filter(|[a, b, c]| a != b && b != c && c != a)
}

/// A strip of the same triangles with fewer entries.
///
/// Where a pair of entries comes twice in a row, the triangles over both have corners twice, and one pair may go: an even number, so that
/// what follows keeps its side. So may pairs at the begin, and anything at the end, that no triangle has.
pub fn packed(strip: &[u32]) -> Vec<u32> {
    let mut packed: Vec<u32> = Vec::with_capacity(strip.len());
    for &entry in strip {
        packed.push(entry);
        if let [.., a, b, c, d] = packed[..]
            && a == c
            && b == d
        {
            packed.truncate(packed.len() - 2);
        }
    }
    let flat = |t: &[u32]| t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
    let Some(last) = packed.windows(3).rposition(|t| !flat(t)) else { return vec![] };
    packed.truncate(last + 3);
    let first = packed.windows(3).position(|t| !flat(t)).unwrap_or(0);
    packed.drain(..first - first % 2);
    packed
}

/// Vertices in the order in which they go.
struct Removal {
    /// Each vertex with the one it goes to.
    order: Vec<(u32, u32)>,
    /// For each level how many are gone, how many triangles there are, and the error.
    levels: Vec<(usize, usize, f32)>,
}

impl Removal {
    /// The moves of `steps`, and those of vertices that no triangle has any more: to another of the same place.
    fn of(wood: &Wood, steps: &[Step]) -> Self {
        let mut triangles = wood.triangles.clone();
        let mut of_vertex: Vec<Vec<u32>> = vec![vec![]; wood.place_of.len()];
        triangles.iter().zip(0..).for_each(|(t, number)| t.iter().for_each(|&v| of_vertex[v as usize].push(number)));
        let mut at_place: Vec<Vec<u32>> = vec![vec![]; wood.places.len()];
        wood.place_of.iter().zip(0..).for_each(|(place, vertex)| at_place[*place as usize].push(vertex));
        let mut removal = Self { order: vec![], levels: vec![(0, triangles.len(), 0.0)] };
        let mut gone = vec![false; wood.place_of.len()];
        for step in steps {
            let mut bare: Vec<u32> = vec![];
            for &(vertex, target) in &step.moves {
                gone[vertex as usize] = true;
                removal.order.push((vertex, target));
                for triangle in std::mem::take(&mut of_vertex[vertex as usize]) {
                    let corners = triangles[triangle as usize].map(|v| if v == vertex { target } else { v });
                    triangles[triangle as usize] = corners;
                    let [a, b, c] = corners.map(|v| wood.place_of[v as usize]);
                    if a != b && b != c && c != a {
                        of_vertex[target as usize].push(triangle);
                        continue;
                    }
                    for v in corners {
                        of_vertex[v as usize].retain(|t| *t != triangle);
                        bare.push(v);
                    }
                }
            }
            bare.sort_unstable();
            bare.dedup();
            for vertex in bare.into_iter().filter(|&v| of_vertex[v as usize].is_empty()) {
                let others = &at_place[wood.place_of[vertex as usize] as usize];
                let other = others.iter().copied().find(|&v| v != vertex && !of_vertex[v as usize].is_empty());
                if let Some(target) = other.filter(|_| !gone[vertex as usize]) {
                    gone[vertex as usize] = true;
                    removal.order.push((vertex, target));
                }
            }
            removal.levels.push((removal.order.len(), step.triangles, step.error_m));
        }
        removal
    }
}

/// Triangles as strips: entries, and where each begins.
fn strips(triangles: &[[u32; 3]], vertices: usize) -> (Vec<u32>, Vec<u32>) {
    let (mut entries, mut starts) = (vec![], vec![0]);
    let mut close = |strip: &[u32]| {
        if !strip.is_empty() {
            entries.extend_from_slice(strip);
            starts.push(entries.len() as u32);
        }
    };
    if triangles.is_empty() {
        return (vec![], starts);
    }
    let ordered = optimize_vertex_cache_strip(triangles.as_flattened(), vertices);
    match stripify(&ordered, vertices, RESTART) {
        Ok(strips) => strips.split(|entry| *entry == RESTART).for_each(&mut close),
        // It only fails for want of memory; a triangle is a strip too.
        Err(_) => triangles.iter().for_each(|t| close(t)),
    }
    (entries, starts)
}

/// The entries that change when a vertex goes, the last vertex first.
fn record(entries: &[u32], targets: &[u32], gone: usize) -> (Vec<u32>, Vec<u32>) {
    let mut places: Vec<Vec<u32>> = vec![vec![]; targets.len()];
    entries.iter().zip(0..).for_each(|(vertex, entry)| places[*vertex as usize].push(entry));
    let (mut starts, mut changes) = (vec![0], vec![]);
    for vertex in (0..targets.len()).rev().take(gone) {
        let moved = std::mem::take(&mut places[vertex]);
        changes.extend_from_slice(&moved);
        starts.push(changes.len() as u32);
        places[targets[vertex] as usize].extend(moved);
    }
    (starts, changes)
}

fn renumbered(surface: &Surface, number: &[u32], triangles: Vec<[u32; 3]>) -> Surface {
    fn of<T: Copy>(all: &[T], number: &[u32]) -> Vec<T> {
        let mut order: Vec<(u32, T)> = number.iter().copied().zip(all.iter().copied()).collect();
        order.sort_unstable_by_key(|(new, _)| *new);
        order.into_iter().map(|(_, value)| value).collect()
    }
    Surface {
        mesh: PolyMesh { positions: of(&surface.mesh.positions, number), triangles, quads: vec![] },
        normals: of(&surface.normals, number),
        uvs: of(&surface.uvs, number),
        colors: of(&surface.colors, number),
    }
}
