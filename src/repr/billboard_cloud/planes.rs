//! Planes for leaves (Décoret et al. 2003, §3; clustered by place first, as Behrendt et al. 2005 do), metres.
//!
//! A leaf fits a plane when none of its corners lies farther from it than the bound. The crown is cut into clumps by k-means; in each,
//! greedily, the plane onto which most leaf area is projected of the leaves that fit is taken, until all leaves are taken or there are
//! planes enough. Candidates are the planes of leaves drawn at random (Lacewell et al. 2006). Then each leaf goes to the plane nearest to its
//! corners and each plane into the middle of its leaves (Lloyd), a few times.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::Seed;
use crate::seed::Draws;

/// A leaf as the clustering sees it.
#[derive(Debug, Clone)]
pub struct Leaf {
    /// At least three.
    pub corners: Vec<Vec3>,
    /// Middle of the corners.
    pub center: Vec3,
    /// Unit length; which side does not matter.
    pub normal: Vec3,
    /// Of all its polygons.
    pub area_m2: f32,
}

impl Leaf {
    /// Mean of the squared distances of its corners, m².
    fn off(&self, plane: &Plane) -> f32 {
        self.corners.iter().map(|p| plane.distance(*p).powi(2)).sum::<f32>() / self.corners.len().max(1) as f32
    }

    fn fits(&self, plane: &Plane, bound_m: f32) -> bool {
        // The first test alone throws most out.
        plane.distance(self.center).abs() <= bound_m && self.corners.iter().all(|p| plane.distance(*p).abs() <= bound_m)
    }
}

/// The points p with `normal` · p = `offset_m`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Unit length.
    pub normal: Vec3,
    /// Distance from the origin.
    pub offset_m: f32,
}

impl Plane {
    /// How far `p` lies before it.
    pub fn distance(&self, p: Vec3) -> f32 {
        self.normal.dot(p) - self.offset_m
    }
}

/// A plane and the leaves, by number and rising, that are drawn on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    /// Where they are drawn.
    pub plane: Plane,
    /// At least one.
    pub leaves: Vec<u32>,
}

/// Planes for one clump; a clump with more wastes little picture, one with fewer keeps leaves nearer to their places.
const PLANES_OF_CLUMP: usize = 20;

/// Leaves of a clump that candidates are judged by; all of them where there are not more.
const JUDGES: usize = 2048;

/// Planes tried for each that is taken.
const CANDIDATES: usize = 128;

/// How often leaves and planes are fitted to each other.
const ROUNDS: usize = 3;

/// The bound grows by this factor until no more than that share of a clump's leaf area is left out.
const WIDER: f32 = 1.4;
const LEFT_OUT: f32 = 0.05;

/// Distributes all leaves over at most `most` planes, such that each fits its plane by `bound_m` where there are planes enough; else by as
/// little more as need be.
pub fn sheets(leaves: &[Leaf], most: usize, bound_m: f32, seed: Seed) -> Vec<Sheet> {
    let most = most.clamp(1, leaves.len().max(1));
    let clumps = clumps(leaves, most.div_ceil(PLANES_OF_CLUMP), seed);
    let shares = shares(&clumps.iter().map(Vec::len).collect::<Vec<_>>(), most);
    let of_clump = |(number, clump): (usize, &Vec<u32>)| {
        let planes = planes(leaves, clump, shares[number], bound_m, &mut seed.keyed("cloud_planes", number as u64));
        fitted(leaves, clump, planes)
    };
    clumps.par_iter().enumerate().flat_map(of_clump).collect()
}

/// The leaves of each clump, rising: k-means of their middles, begun as k-means++ does (Arthur & Vassilvitskii 2007).
fn clumps(leaves: &[Leaf], count: usize, seed: Seed) -> Vec<Vec<u32>> {
    let mut draws = seed.keyed("cloud_clumps", 0);
    let Some(first) = leaves.get(draws.below(leaves.len())) else { return vec![] };
    let mut means = vec![first.center];
    let mut nearest_m2: Vec<f32> = leaves.iter().map(|leaf| leaf.center.distance_squared(means[0])).collect();
    while means.len() < count {
        let sum: f64 = nearest_m2.iter().map(|d| f64::from(*d)).sum();
        let mut left = draws.unit() * sum;
        let past = |d: &f32| {
            left -= f64::from(*d);
            left < 0.0
        };
        let Some(next) = nearest_m2.iter().position(past) else { break };
        means.push(leaves[next].center);
        let to_new = leaves.iter().map(|leaf| leaf.center.distance_squared(leaves[next].center));
        nearest_m2.iter_mut().zip(to_new).for_each(|(old, new)| *old = old.min(new));
    }
    let nearest = |means: &[Vec3]| -> Vec<usize> {
        let of = |leaf: &Leaf| least(means.iter().map(|mean| mean.distance_squared(leaf.center)));
        leaves.par_iter().map(of).collect()
    };
    for _ in 0..10 {
        let mut sums = vec![(DVec3::ZERO, 0.0); means.len()];
        for (leaf, mean) in leaves.iter().zip(nearest(&means)) {
            sums[mean].0 += leaf.center.as_dvec3();
            sums[mean].1 += 1.0;
        }
        means.iter_mut().zip(&sums).filter(|(_, (_, n))| *n > 0.0).for_each(|(mean, (sum, n))| *mean = (sum / n).as_vec3());
    }
    let mut clumps = vec![vec![]; means.len()];
    (0u32..).zip(nearest(&means)).for_each(|(leaf, mean)| clumps[mean].push(leaf));
    clumps.retain(|clump| !clump.is_empty());
    clumps
}

/// `most` planes shared out by numbers of leaves, at least one each.
fn shares(leaves: &[usize], most: usize) -> Vec<usize> {
    let all: usize = leaves.iter().sum();
    let spare = most.saturating_sub(leaves.len());
    let (mut seen, mut given) = (0, 0);
    let share = |count: &usize| {
        seen += count;
        let until = spare * seen / all.max(1);
        1 + until - std::mem::replace(&mut given, until)
    };
    leaves.iter().map(share).collect()
}

/// At most `most` planes for a clump.
fn planes(leaves: &[Leaf], clump: &[u32], most: usize, bound_m: f32, draws: &mut Draws) -> Vec<Plane> {
    let stride = clump.len().div_ceil(JUDGES).max(1);
    let judges: Vec<&Leaf> = clump.iter().step_by(stride).map(|&leaf| &leaves[leaf as usize]).collect();
    let all_m2: f32 = judges.iter().map(|leaf| leaf.area_m2).sum();
    let mut bound_m = bound_m;
    loop {
        let (planes, left_m2) = greedy(&judges, most, bound_m, draws);
        if left_m2 <= LEFT_OUT * all_m2 || !bound_m.is_finite() {
            return planes;
        }
        bound_m *= WIDER;
    }
}

/// The planes that greed finds, and the leaf area that it leaves out.
fn greedy(judges: &[&Leaf], most: usize, bound_m: f32, draws: &mut Draws) -> (Vec<Plane>, f32) {
    let mut left: Vec<&Leaf> = judges.to_vec();
    let mut planes = vec![];
    while planes.len() < most && !left.is_empty() {
        let candidate = |_| {
            let leaf = left[draws.below(left.len())];
            let plane = Plane { normal: leaf.normal, offset_m: leaf.normal.dot(leaf.center) };
            let fitting = left.iter().filter(|leaf| leaf.fits(&plane, bound_m));
            (fitting.map(|leaf| leaf.area_m2 * leaf.normal.dot(plane.normal).abs()).sum::<f32>(), plane)
        };
        let best = (0..CANDIDATES).map(candidate).reduce(|a, b| if b.0 > a.0 { b } else { a });
        let Some((_, plane)) = best else { break };
        planes.push(plane);
        let before = left.len();
        left.retain(|leaf| !leaf.fits(&plane, bound_m));
        if left.len() == before {
            // Not even the leaf that it was taken from: the bound is too narrow for a leaf that is not flat.
            break;
        }
    }
    (planes, left.iter().map(|leaf| leaf.area_m2).sum())
}

/// Every leaf of a clump on its nearest plane; planes without leaves are gone.
fn fitted(leaves: &[Leaf], clump: &[u32], planes: Vec<Plane>) -> Vec<Sheet> {
    let mut sheets: Vec<Sheet> = planes.into_iter().map(|plane| Sheet { plane, leaves: vec![] }).collect();
    for _ in 0..ROUNDS {
        sheets.iter_mut().for_each(|sheet| sheet.leaves.clear());
        for &leaf in clump {
            let nearest = least(sheets.iter().map(|sheet| leaves[leaf as usize].off(&sheet.plane)));
            sheets[nearest].leaves.push(leaf);
        }
        sheets.retain(|sheet| !sheet.leaves.is_empty());
        for sheet in &mut sheets {
            let mean = |(sum, n): (f64, f64), leaf: &u32| {
                let area = f64::from(leaves[*leaf as usize].area_m2.max(f32::MIN_POSITIVE));
                (sum + area * f64::from(sheet.plane.normal.dot(leaves[*leaf as usize].center)), n + area)
            };
            let (sum, area) = sheet.leaves.iter().fold((0.0, 0.0), mean);
            sheet.plane.offset_m = (sum / area) as f32;
        }
    }
    sheets
}

/// The number of the least, the first of equals.
fn least(values: impl Iterator<Item = f32>) -> usize {
    values.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(number, _)| number)
}

/// How far leaves are moved onto their planes, and which share of their area is moved farther than a bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Misfit {
    /// Root of the mean of the squared distances of corners, weighted by leaf area.
    pub rms_m: f32,
    /// Share of the leaf area of which a corner lies farther from its plane than the bound.
    pub beyond: f32,
}

impl Misfit {
    /// Of these sheets.
    pub fn of(leaves: &[Leaf], sheets: &[Sheet], bound_m: f32) -> Self {
        let (mut squares, mut beyond, mut area) = (0.0, 0.0, 0.0);
        for sheet in sheets {
            for leaf in sheet.leaves.iter().map(|&leaf| &leaves[leaf as usize]) {
                let m2 = f64::from(leaf.area_m2);
                squares += m2 * f64::from(leaf.off(&sheet.plane));
                beyond += if leaf.fits(&sheet.plane, bound_m) { 0.0 } else { m2 };
                area += m2;
            }
        }
        let area = f64::max(area, f64::MIN_POSITIVE);
        Self { rms_m: (squares / area).sqrt() as f32, beyond: (beyond / area) as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Leaves of 10 cm scattered close to the planes x = −1, 0 and 2.
    fn three_layers() -> Vec<Leaf> {
        let leaf = |number: u64| {
            let mut draws = Seed(5).keyed("layers", number);
            let mut signed = || draws.signed() as f32;
            let center = Vec3::new([-1.0, 0.0, 2.0][number as usize % 3] + 0.02 * signed(), signed(), signed());
            let corner = |y: f32, z: f32| center + 0.05 * Vec3::new(0.0, y, z);
            let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            Leaf { corners, center, normal: Vec3::X, area_m2: 0.01 }
        };
        (0..300).map(leaf).collect()
    }

    #[test]
    fn layers_are_found_and_no_leaf_is_lost() {
        let leaves = three_layers();
        let sheets = sheets(&leaves, 20, 0.05, Seed(1));
        let mut offsets: Vec<f32> = sheets.iter().map(|sheet| sheet.plane.offset_m * sheet.plane.normal.x).collect();
        offsets.sort_by(f32::total_cmp);
        assert_eq!(offsets.len(), 3);
        assert!(offsets.iter().zip([-1.0, 0.0, 2.0]).all(|(found, own)| (found - own).abs() < 0.01), "{offsets:?}");
        let mut all: Vec<u32> = sheets.iter().flat_map(|sheet| sheet.leaves.clone()).collect();
        all.sort_unstable();
        assert_eq!(all, (0..300).collect::<Vec<_>>());
        let misfit = Misfit::of(&leaves, &sheets, 0.05);
        assert!(misfit.beyond == 0.0 && misfit.rms_m < 0.03, "{misfit:?}");
    }

    #[test]
    fn too_few_planes_take_all_leaves_all_the_same() {
        let leaves = three_layers();
        for most in [1, 2] {
            let sheets = sheets(&leaves, most, 0.05, Seed(1));
            assert_eq!((sheets.len(), sheets.iter().map(|sheet| sheet.leaves.len()).sum::<usize>()), (most, 300));
            assert!(Misfit::of(&leaves, &sheets, 0.05).beyond > 0.3);
        }
        assert!(sheets(&[], 5, 0.1, Seed(1)).is_empty());
        assert_eq!(sheets(&leaves[..1], 500, 0.1, Seed(1)).len(), 1);
        assert_eq!(shares(&[10, 1, 1], 6), [3, 1, 2]);
    }

    #[test]
    fn a_leaf_that_is_no_number_does_not_hang() {
        let leaf = Leaf { corners: vec![Vec3::NAN; 3], center: Vec3::NAN, normal: Vec3::X, area_m2: 1.0 };
        assert_eq!(sheets(&[leaf], 5, 0.1, Seed(1)).len(), 1);
    }
}
