//! A mesh that collapses: places (vertices that stand at one point, whatever their texture coordinates), the triangles round them, and the
//! pieces that hang together, branches of a tree each standing in another.

use std::collections::BTreeMap;

use glam::Vec3;
use rayon::prelude::*;

use super::nearest::{Corners, nearest_on, share_of_sight};
use crate::geom::{Bounds, Surface};

/// A piece stands in another: its foot, a place of its own, lies inside the other or within reach of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// The piece that it stands in.
    pub parent: u32,
    /// The place of its foot.
    pub place: u32,
    /// Where that is.
    pub at: Vec3,
    /// How far from the other's surface it may lie, outside, metres: about how thick the piece is there.
    pub reach_m: f32,
}

/// The mesh.
#[derive(Debug, Clone)]
pub struct Wood<'a> {
    /// Vertices.
    pub surface: &'a Surface,
    /// Where each place is.
    pub places: Vec<Vec3>,
    /// The place of each vertex.
    pub place_of: Vec<u32>,
    /// Corners as vertices; those of a triangle that is gone mean nothing.
    pub triangles: Vec<[u32; 3]>,
    /// Which triangles are still there.
    pub alive: Vec<bool>,
    /// The triangles round each place; empty for one that is gone.
    pub around: Vec<Vec<u32>>,
    /// The piece of each place.
    pub piece_of: Vec<u32>,
    /// The triangles of each piece, gone ones too.
    pub pieces: Vec<Vec<u32>>,
    /// How many triangles of each piece are there.
    pub left: Vec<usize>,
    /// What each piece stands in; `None` for a trunk.
    pub joints: Vec<Option<Joint>>,
    /// The pieces that stand in each.
    pub children: Vec<Vec<u32>>,
}

impl<'a> Wood<'a> {
    /// Welds equal points. Triangles that have two corners in one place are left out.
    pub fn of(surface: &'a Surface) -> Self {
        let mut number = BTreeMap::new();
        let mut places = vec![];
        let place_of: Vec<u32> = surface
            .mesh
            .positions
            .iter()
            .map(|p| {
                *number.entry((*p + Vec3::ZERO).to_array().map(f32::to_bits)).or_insert_with(|| {
                    places.push(*p);
                    places.len() as u32 - 1
                })
            })
            .collect();
        let solid = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| place_of[v as usize]);
            a != b && b != c && c != a
        };
        let triangles: Vec<[u32; 3]> = surface.mesh.triangulated().filter(solid).collect();
        let mut around = vec![vec![]; places.len()];
        for (triangle, number) in triangles.iter().zip(0u32..) {
            triangle.iter().for_each(|&v| around[place_of[v as usize] as usize].push(number));
        }
        let alive = vec![true; triangles.len()];
        let mut wood = Self {
            surface,
            places,
            place_of,
            triangles,
            alive,
            around,
            piece_of: vec![],
            pieces: vec![],
            left: vec![],
            joints: vec![],
            children: vec![],
        };
        wood.find_pieces();
        wood.joints = wood.find_joints();
        wood.children = vec![vec![]; wood.pieces.len()];
        for (joint, piece) in wood.joints.iter().zip(0u32..) {
            if let Some(joint) = joint {
                wood.children[joint.parent as usize].push(piece);
            }
        }
        wood
    }

    /// The places of a triangle's corners.
    pub fn corners(&self, triangle: u32) -> [u32; 3] {
        self.triangles[triangle as usize].map(|v| self.place_of[v as usize])
    }

    /// Where they are.
    pub fn points(&self, triangle: u32) -> Corners {
        self.corners(triangle).map(|place| self.places[place as usize])
    }

    /// The triangles of a piece that are there.
    pub fn triangles_of(&self, piece: u32) -> impl Iterator<Item = u32> {
        self.pieces[piece as usize].iter().copied().filter(|t| self.alive[*t as usize])
    }

    /// Places that share an edge with this one, rising.
    pub fn neighbours(&self, place: u32) -> Vec<u32> {
        let mut all: Vec<u32> = self.around[place as usize].iter().flat_map(|&t| self.corners(t)).filter(|&p| p != place).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    fn find_pieces(&mut self) {
        self.piece_of = vec![u32::MAX; self.places.len()];
        for seed in 0..self.places.len() {
            if self.piece_of[seed] != u32::MAX || self.around[seed].is_empty() {
                continue;
            }
            let piece = self.pieces.len() as u32;
            self.piece_of[seed] = piece;
            let (mut waiting, mut triangles) = (vec![seed as u32], vec![]);
            while let Some(place) = waiting.pop() {
                triangles.extend_from_slice(&self.around[place as usize]);
                for next in self.neighbours(place) {
                    if self.piece_of[next as usize] == u32::MAX {
                        self.piece_of[next as usize] = piece;
                        waiting.push(next);
                    }
                }
            }
            triangles.sort_unstable();
            triangles.dedup();
            self.left.push(triangles.len());
            self.pieces.push(triangles);
        }
    }

    /// How often a piece winds round a point: 1 or −1 inside it, 0 outside.
    pub fn winding(&self, piece: u32, at: Vec3) -> f32 {
        self.triangles_of(piece).map(|t| share_of_sight(self.points(t), at)).sum()
    }

    /// How far a point is from a piece's surface.
    pub fn gap_m(&self, piece: u32, at: Vec3) -> f32 {
        self.triangles_of(piece).map(|t| nearest_on(self.points(t), at).distance(at)).fold(f32::MAX, f32::min)
    }

    /// For every piece the largest other, larger than itself, that one of its ends is inside of, or within reach of.
    fn find_joints(&self) -> Vec<Option<Joint>> {
        let of = |piece: usize| Extent::of(self, piece as u32);
        let extents: &[Extent] = &(0..self.pieces.len()).into_par_iter().map(of).collect::<Vec<_>>();
        let larger = &|a: usize, b: usize| (extents[a].area_m2, b) > (extents[b].area_m2, a);
        let area = |a: &usize, b: &usize| extents[*a].area_m2.total_cmp(&extents[*b].area_m2);
        let joint = |piece: usize| {
            let ends = extents[piece].ends.map(|place| (place, self.places[place as usize], self.reach_m(place)));
            let near = |at: Vec3, reach_m: f32| {
                let near = move |other: &usize| *other != piece && larger(*other, piece) && extents[*other].near(at, reach_m);
                (0..extents.len()).filter(near)
            };
            let joint = |(place, at, reach_m): (u32, Vec3, f32), parent: usize| Joint { parent: parent as u32, place, at, reach_m };
            let inside = ends.iter().find_map(|&(place, at, reach_m)| {
                let parent = near(at, 0.0).filter(|parent| self.winding(*parent as u32, at).abs() > 0.5).max_by(area)?;
                Some(joint((place, at, reach_m), parent))
            });
            inside.or_else(|| {
                ends.iter().find_map(|&(place, at, reach_m)| {
                    let touches = |parent: &usize| self.gap_m(*parent as u32, at) <= reach_m;
                    Some(joint((place, at, reach_m), near(at, reach_m).filter(touches).max_by(area)?))
                })
            })
        };
        (0..self.pieces.len()).into_par_iter().map(joint).collect()
    }

    /// How far the mesh reaches round a place: as far as its farthest neighbour.
    fn reach_m(&self, place: u32) -> f32 {
        let at = self.places[place as usize];
        self.neighbours(place).iter().map(|&next| self.places[next as usize].distance(at)).fold(0.0, f32::max)
    }
}

/// How large a piece is and where it ends.
struct Extent {
    bounds: Bounds,
    area_m2: f32,
    /// Its first place, which is a branch's foot in our own meshes, and two that lie far apart.
    ends: [u32; 3],
}

impl Extent {
    fn of(wood: &Wood, piece: u32) -> Self {
        let mut places: Vec<u32> = wood.triangles_of(piece).flat_map(|t| wood.corners(t)).collect();
        places.sort_unstable();
        places.dedup();
        let at = |place: u32| wood.places[place as usize];
        let bounds = Bounds::of(places.iter().map(|&place| at(place))).unwrap_or(Bounds { min: Vec3::ZERO, max: Vec3::ZERO });
        let farthest = |from: Vec3| {
            let far = |a: u32, b: u32| if at(b).distance_squared(from) > at(a).distance_squared(from) { b } else { a };
            places.iter().copied().reduce(far).unwrap_or(0)
        };
        let one = farthest(bounds.center());
        let area = |t: u32| {
            let [a, b, c] = wood.points(t);
            0.5 * (b - a).cross(c - a).length()
        };
        Self {
            bounds,
            area_m2: wood.triangles_of(piece).map(area).sum(),
            ends: [places.first().copied().unwrap_or(0), one, farthest(at(one))],
        }
    }

    fn near(&self, p: Vec3, reach_m: f32) -> bool {
        (p - self.bounds.min).min_element() >= -reach_m && (self.bounds.max - p).min_element() >= -reach_m
    }
}
