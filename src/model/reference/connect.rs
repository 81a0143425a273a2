//! Which polygons hang together: those that share an edge, wherever their vertices stand doubled (at seams, or in every triangle).

use rayon::prelude::*;

use crate::geom::PolyMesh;

/// The connected components of a mesh, numbered by their first polygon.
pub struct Components {
    /// The polygons of all components, one component after the other, each in the order of the mesh.
    polygons: Vec<u32>,
    /// Where each component begins in `polygons`, and the end.
    starts: Vec<u32>,
}

impl Components {
    /// Finds them; in about a second per ten million triangles when the mesh is a plain list of leaves.
    pub fn of(mesh: &PolyMesh) -> Self {
        let owners = lone_polygons(mesh).unwrap_or_else(|| joined_by_edges(mesh));
        Self::grouped(&owners)
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The polygons of one of them.
    pub fn polygons(&self, component: usize) -> &[u32] {
        &self.polygons[self.starts[component] as usize..self.starts[component + 1] as usize]
    }

    /// From the component of every polygon, where components are numbered by their first polygon.
    fn grouped(owners: &[u32]) -> Self {
        let count = owners.iter().max().map_or(0, |last| *last as usize + 1);
        let mut starts = vec![0u32; count + 1];
        owners.iter().for_each(|&owner| starts[owner as usize + 1] += 1);
        (0..count).for_each(|k| starts[k + 1] += starts[k]);
        let mut next = starts.clone();
        let mut polygons = vec![0u32; owners.len()];
        for (polygon, &owner) in owners.iter().enumerate() {
            polygons[next[owner as usize] as usize] = polygon as u32;
            next[owner as usize] += 1;
        }
        Self { polygons, starts }
    }
}

/// The components of a mesh that lists one leaf after the other, each a quad or two triangles over vertices of its own, as most
/// programs write leaves; `None` for any other mesh.
fn lone_polygons(mesh: &PolyMesh) -> Option<Vec<u32>> {
    let of_triangles = mesh.triangles.chunks(2).map(|pair| match pair {
        [a, b] if a.iter().filter(|v| b.contains(v)).count() == 2 => Some(corner_range(a.iter().chain(b))),
        _ => None,
    });
    let of_quads = mesh.quads.iter().map(|quad| Some(corner_range(quad.iter())));
    let mut free = 0;
    for range in of_triangles.chain(of_quads) {
        let (_, last) = range.filter(|(first, _)| *first >= free)?;
        free = last.checked_add(1)?;
    }
    let pairs = mesh.triangles.len() as u32 / 2;
    let owners =
        (0..mesh.triangles.len() as u32).map(|triangle| triangle / 2).chain((0..mesh.quads.len() as u32).map(|quad| pairs + quad));
    Some(owners.collect())
}

fn corner_range<'a>(corners: impl Iterator<Item = &'a u32>) -> (u32, u32) {
    corners.fold((u32::MAX, 0), |(low, high), &corner| (low.min(corner), high.max(corner)))
}

/// The component of every polygon, through the edges that polygons share in place.
fn joined_by_edges(mesh: &PolyMesh) -> Vec<u32> {
    let places = places(mesh);
    let mut edges: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * mesh.triangles.len() + 4 * mesh.quads.len());
    for (number, polygon) in mesh.polygons().enumerate() {
        for (k, &corner) in polygon.iter().enumerate() {
            let [a, b] = [corner, polygon[(k + 1) % polygon.len()]].map(|corner| places[corner as usize]);
            edges.push((a.min(b), a.max(b), number as u32));
        }
    }
    edges.par_sort_unstable();
    let mut forest: Vec<u32> = (0..mesh.polygon_count() as u32).collect();
    for pair in edges.windows(2) {
        let ((a, b, p), (c, d, q)) = (pair[0], pair[1]);
        if (a, b) == (c, d) {
            let (p, q) = (root(&mut forest, p), root(&mut forest, q));
            // The lower number stays, so that a root is its component's first polygon.
            forest[p.max(q) as usize] = p.min(q);
        }
    }
    let mut numbers = vec![0; forest.len()];
    let mut count = 0;
    for polygon in 0..forest.len() as u32 {
        let first = root(&mut forest, polygon);
        if first == polygon {
            numbers[polygon as usize] = count;
            count += 1;
        } else {
            numbers[polygon as usize] = numbers[first as usize];
        }
    }
    numbers
}

fn root(forest: &mut [u32], mut at: u32) -> u32 {
    while forest[at as usize] != at {
        forest[at as usize] = forest[forest[at as usize] as usize];
        at = forest[at as usize];
    }
    at
}

/// One number per place: vertices that stand at the same point have the same.
fn places(mesh: &PolyMesh) -> Vec<u32> {
    // Adding zero makes −0 the 0 that it equals.
    let key = |(vertex, p): (usize, &glam::Vec3)| (p.to_array().map(|c| (c + 0.0).to_bits()), vertex as u32);
    let mut sorted: Vec<([u32; 3], u32)> = mesh.positions.par_iter().enumerate().map(key).collect();
    sorted.par_sort_unstable();
    let mut places = vec![0; sorted.len()];
    let mut place = 0;
    for (k, (at, vertex)) in sorted.iter().enumerate() {
        if k > 0 && sorted[k - 1].0 != *at {
            place += 1;
        }
        places[*vertex as usize] = place;
    }
    places
}
