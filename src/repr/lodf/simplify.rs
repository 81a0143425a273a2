//! Simplification of foliage: the *leaf collapse*, two leaves → one whose four corners are corners of the two (Rebollo §IV, fig. 2).
//!
//! Rebollo only cites the algorithm (FSA, its reference 24: Remolar et al. 2002); this is our reading of it. Pairs go least cost first. The cost of a
//! pair is told by how far its leaves are apart, how differently they are turned and how much less one leaf over both would cover, times the
//! area that they stand for: small leaves side by side go first, and what was collapsed often waits. The leaf that replaces them has about the area
//! of all leaves that it stands for, so that the crown keeps its cover. One of the two, the *heir*, lends its picture; so a change of
//! level can be drawn as the heir growing over the other, which shrinks. Lengths in metres.

use std::cell::Cell;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::Vec3;
use rayon::prelude::*;

use super::grid::Grid;

/// A corner of an original leaf, and whether the normal there has to be turned round to lie on the face of who uses it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Corner {
    /// Number of the original leaf.
    pub leaf: u32,
    /// Which of its corners, 0 to 3.
    pub corner: u8,
    /// Its normal is turned round.
    pub turned: bool,
}

/// Two leaves become one. The leaf that collapse `i` of a foliage of `n` leaves makes has the number `n + i`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Collapse {
    /// Who lends the new leaf its picture.
    pub heir: u32,
    /// Who goes.
    pub absorbed: u32,
    /// The new leaf: corner `k` wears what corner `k` of the heir wore.
    pub corners: [Corner; 4],
}

/// An original leaf: its corners in order, and the normals there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blade {
    /// Places of the corners, metres; a triangle has its last corner twice.
    pub corners: [Vec3; 4],
    /// Unit normals at the corners.
    pub normals: [Vec3; 4],
}

/// Most original leaves of a cluster: what 13 bits number.
pub const MOST_LEAVES: u32 = 1 << 13;

/// How much a quarter turn between two leaves counts, as the square of a distance in reaches. Leaves turned across one another cover both
/// ways, which one leaf cannot: of birch at half its leaves, 84 % of the cover is left with 1, 95 % with 30, 98 % with 100.
const TURN: f32 = 100.0;
/// How much it counts that two leaves lie so near that one over both covers less, as TURN.
const LACK: f32 = 100.0;
/// How large a collapsed leaf is aimed to be, as a share of the leaves that it stands for: a little more, since what is aimed at is seldom
/// had in full.
const GROWTH: f32 = 1.2;
/// How many rings of cells are searched for a partner before a leaf is put off until the cells are larger.
const RINGS: i32 = 2;
/// Fewer leaves than these are compared with all others.
const FEW: usize = 64;

/// Collapses of `blades`, in order, until `until` leaves are left or no two of those left may be joined. Leaves with a corner that is no
/// finite number stay as they are.
pub fn simplify(blades: &[Blade], until: usize) -> Vec<Collapse> {
    let mut work = Work::new(blades);
    work.run(blades, until.max(1));
    work.collapses
}

/// A leaf that is there at the moment.
#[derive(Debug, Clone, Copy)]
struct Active {
    corners: [Corner; 4],
    places: [Vec3; 4],
    center: Vec3,
    /// Unit normal; zero where it has no area.
    normal: Vec3,
    /// What it covers now.
    area: f32,
    /// What the originals that it stands for covered.
    cover: f32,
    /// Half of its longer diagonal.
    reach: f32,
    /// Originals that it stands for.
    count: u32,
}

/// Twice the area, along the normal.
fn area_vector([a, b, c, d]: [Vec3; 4]) -> Vec3 {
    (c - a).cross(d - b)
}

impl Active {
    fn new(corners: [Corner; 4], places: [Vec3; 4], cover: Option<f32>, count: u32) -> Self {
        let vector = area_vector(places);
        let area = 0.5 * vector.length();
        let [a, b, c, d] = places;
        Self {
            corners,
            places,
            center: 0.25 * (a + b + c + d),
            normal: vector.normalize_or_zero(),
            area,
            cover: cover.unwrap_or(area),
            reach: 0.5 * a.distance(c).max(b.distance(d)),
            count,
        }
    }

    /// What it costs to join the two.
    fn cost(&self, other: &Self) -> f32 {
        let turned = 1.0 - self.normal.dot(other.normal).abs();
        let size = self.reach.min(other.reach);
        let distance = self.center.distance(other.center);
        let cover = self.cover + other.cover;
        let lack = wanting(self.area.max(other.area), cover, distance);
        cover * (distance * distance + (TURN * turned + LACK * lack * lack) * size * size)
    }

    /// No partner that far away costs less.
    fn least_cost(&self, distance: f32) -> f32 {
        self.cover * distance * distance
    }
}

/// How much of `cover` cannot be had of two leaves `distance` apart, the larger of which has that area: moved by its own side, a leaf sweeps
/// as much again.
fn wanting(area: f32, cover: f32, distance: f32) -> f32 {
    let side = area.sqrt();
    let needed = side * (cover / area.max(1e-12) - 1.0).max(0.0);
    (1.0 - distance / needed.max(1e-9)).max(0.0)
}

/// Costs are never negative, so that their bits sort as they do.
type Entry = Reverse<(u32, u32, u32)>;

struct Work {
    active: Vec<Option<Active>>,
    alive: usize,
    collapses: Vec<Collapse>,
    queue: BinaryHeap<Entry>,
    grid: Grid,
    /// Found nobody near; asked again when the cells are larger.
    waiting: Vec<u32>,
}

impl Work {
    fn new(blades: &[Blade]) -> Self {
        let active = |(leaf, blade): (usize, &Blade)| {
            let corner = |corner| Corner { leaf: leaf as u32, corner, turned: false };
            let active = Active::new([0, 1, 2, 3].map(corner), blade.corners, None, 1);
            (blade.corners.iter().all(|p| p.is_finite()) && active.area.is_finite() && active.center.is_finite()).then_some(active)
        };
        let active: Vec<_> = blades.iter().enumerate().map(active).collect();
        let mut work = Self {
            alive: active.iter().flatten().count(),
            active,
            collapses: vec![],
            queue: BinaryHeap::new(),
            grid: Grid::default(),
            waiting: vec![],
        };
        work.spread();
        work
    }

    /// Makes cells as large as suits those that are left, and finds each a partner.
    fn spread(&mut self) {
        let there = self.active.iter().zip(0u32..).filter_map(|(leaf, number)| leaf.as_ref().map(|leaf| (number, leaf.center)));
        self.grid = Grid::of(there);
        // Whoever is in the queue has a partner; without a queue nobody has.
        let asking: Vec<u32> = if self.queue.is_empty() {
            (0..self.active.len() as u32).filter(|&leaf| self.active[leaf as usize].is_some()).collect()
        } else {
            std::mem::take(&mut self.waiting)
        };
        self.waiting.clear();
        let found: Vec<_> = asking.par_iter().map(|&leaf| (leaf, self.partner(leaf))).collect();
        for (leaf, partner) in found {
            self.enqueue(leaf, partner);
        }
    }

    fn enqueue(&mut self, leaf: u32, partner: Option<(f32, u32)>) {
        match partner {
            Some((cost, partner)) => self.queue.push(Reverse((cost.to_bits(), leaf, partner))),
            None => self.waiting.push(leaf),
        }
    }

    /// The cheapest partner of `leaf` near it.
    fn partner(&self, leaf: u32) -> Option<(f32, u32)> {
        let me = self.active[leaf as usize].as_ref()?;
        let best: Cell<Option<(f32, u32)>> = Cell::new(None);
        let mut look = |other: u32| {
            let Some(it) = self.active[other as usize].as_ref().filter(|_| other != leaf) else { return false };
            // Nearly always it is too far away, which is told at once.
            let least = me.cover * me.center.distance_squared(it.center);
            if best.get().is_some_and(|(cost, _)| least > cost) {
                return true;
            }
            let cost = me.cost(it);
            let better = best.get().is_none_or(|best| cost.total_cmp(&best.0).then(other.cmp(&best.1)).is_lt());
            if better && cost.is_finite() && me.count + it.count <= MOST_LEAVES {
                best.set(Some((cost, other)));
            }
            true
        };
        if self.alive <= FEW {
            self.grid.all().for_each(|other| {
                look(other);
            });
            return best.get();
        }
        for ring in 0..=RINGS {
            self.grid.ring(me.center, ring, &mut look);
            // What lies in the next ring is at least `ring` cells away.
            if best.get().is_some_and(|(cost, _)| cost <= me.least_cost(ring as f32 * self.grid.cell_m)) {
                break;
            }
        }
        best.get()
    }

    fn run(&mut self, blades: &[Blade], until: usize) {
        let mut spread_at = self.alive;
        while self.alive > until {
            let Some(Reverse((_, leaf, partner))) = self.queue.pop() else {
                // Cells grow with what is left; when they have, and still nobody finds anybody, that was all.
                if self.waiting.is_empty() || spread_at == self.alive {
                    return;
                }
                spread_at = self.alive;
                self.spread();
                continue;
            };
            if self.active[leaf as usize].is_none() {
                continue;
            }
            if self.active[partner as usize].is_none() {
                let again = self.partner(leaf);
                self.enqueue(leaf, again);
                continue;
            }
            let made = self.collapse(blades, leaf, partner);
            if 2 * self.alive < spread_at || self.alive == FEW {
                spread_at = self.alive;
                self.spread();
            } else {
                self.grid.add(made, self.active[made as usize].expect("just made").center);
            }
            let partner = self.partner(made);
            self.enqueue(made, partner);
        }
    }

    fn collapse(&mut self, blades: &[Blade], one: u32, two: u32) -> u32 {
        let take = |active: &mut Vec<Option<Active>>, leaf: u32| active[leaf as usize].take().expect("both are there");
        let (a, b) = (take(&mut self.active, one), take(&mut self.active, two));
        // The larger one lends its picture: it grows the less.
        let first = (a.area, Reverse(one)) >= (b.area, Reverse(two));
        let ((heir, h), (absorbed, o)) = if first { ((one, a), (two, b)) } else { ((two, b), (one, a)) };
        let joined = joined(&h, &o, blades);
        self.collapses.push(Collapse { heir, absorbed, corners: joined.corners });
        self.active.push(Some(joined));
        self.alive -= 1;
        self.active.len() as u32 - 1
    }
}

/// The leaf that replaces `heir` and `other`: of all that have each corner from the heir or the matching one of the other, however the
/// other is laid against it, the one that covers most nearly as much, where they were, as flat and as little stretched.
fn joined(heir: &Active, other: &Active, blades: &[Blade]) -> Active {
    let cover = heir.cover + other.cover;
    let aim = Aim::new(heir, other, GROWTH * cover);
    let mut best = (f32::INFINITY, 0, 0);
    for laid in 0..8 {
        for mask in 1..15u32 {
            let fault = aim.fault(chosen(&heir.places, &other.places, laid, mask));
            if fault < best.0 {
                best = (fault, laid, mask);
            }
        }
    }
    let (_, laid, mask) = best;
    let places = chosen(&heir.places, &other.places, laid, mask);
    let mut corners = chosen(&heir.corners, &other.corners, laid, mask);
    let face = area_vector(places);
    for corner in &mut corners {
        let normal = blades[corner.leaf as usize].normals[usize::from(corner.corner)];
        corner.turned = normal.dot(face) < 0.0;
    }
    Active::new(corners, places, Some(cover), heir.count + other.count)
}

/// Corner `k` of the heir where bit `k` of `mask` is 0, else that of the other which lies there when it is turned by `laid & 3` corners,
/// and before that mirrored for `laid & 4`.
fn chosen<T: Copy>(heir: &[T; 4], other: &[T; 4], laid: u32, mask: u32) -> [T; 4] {
    std::array::from_fn(|k| {
        if mask >> k & 1 == 0 {
            return heir[k];
        }
        let turned = (k as u32 + laid) & 3;
        other[(if laid & 4 == 0 { turned } else { 3 - turned }) as usize]
    })
}

/// What a new leaf should be like.
struct Aim {
    center: Vec3,
    normal: Vec3,
    area: f32,
    /// From the foot to the tip of the heir's picture.
    up: Vec3,
}

impl Aim {
    fn new(heir: &Active, other: &Active, area: f32) -> Self {
        let weight = if heir.cover + other.cover > 0.0 { other.cover / (heir.cover + other.cover) } else { 0.5 };
        let side = if heir.normal.dot(other.normal) < 0.0 { -1.0 } else { 1.0 };
        let normal = ((1.0 - weight) * heir.normal + side * weight * other.normal).normalize_or_zero();
        let [a, b, c, d] = heir.places;
        let up = (c + d - a - b).normalize_or_zero();
        Self { center: heir.center.lerp(other.center, weight), normal, area: area.max(1e-12), up }
    }

    /// How far a leaf of these corners is from it; infinite for none.
    fn fault(&self, places: [Vec3; 4]) -> f32 {
        let vector = area_vector(places);
        let area = 0.5 * vector.length();
        let [a, b, c, d] = places;
        if area <= 1e-6 * self.area {
            return 1e6 + self.center.distance_squared(0.25 * (a + b + c + d)) / self.area;
        }
        let face = vector / (2.0 * area);
        let size = self.area.sqrt();
        // Folded or bent inward at a corner: the turns must all go one way.
        let turn = |p: Vec3, q: Vec3, r: Vec3| (q - p).cross(r - q).dot(face);
        let least_turn = turn(a, b, c).min(turn(b, c, d)).min(turn(c, d, a)).min(turn(d, a, b));
        let bent = (0.1 - least_turn / area).max(0.0);
        let warp = (b - a).dot(face).abs().max((c - b).dot(face).abs()) / size;
        let longest = [(a, b), (b, c), (c, d), (d, a)].into_iter().map(|(p, q)| p.distance_squared(q)).fold(0.0, f32::max);
        let stretch = (longest / area).max(1.0).ln();
        let shift = self.center.distance(0.25 * (a + b + c + d)) / size;
        let lean = 1.0 - self.up.dot((c + d - a - b).normalize_or_zero());
        let ratio = (area / self.area).ln();
        10.0 * ratio * ratio
            + 4.0 * bent
            + 0.3 * warp
            + 0.02 * stretch
            + 0.1 * shift
            + 0.1 * lean
            + 0.1 * (1.0 - face.dot(self.normal).abs())
    }
}
