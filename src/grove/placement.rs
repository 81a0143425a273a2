//! Where trees stand: blue noise (no two nearer than a distance, otherwise by chance), thinned by clearings and cliffs, with a species, a
//! turn and a size for each. Metres.
//!
//! Darts are thrown into a grid whose cells hold one point each (Bridson 2007), every third row of cells at a time: rows three apart
//! cannot disturb each other, so threads share the work and every dart is keyed by its cell and round. In the first rounds only a few
//! cells throw, which keeps the grid from showing.

use std::f32::consts::TAU;

use fastnoise_lite::FastNoiseLite;
use glam::Vec3;
use rayon::prelude::*;

use super::Planted;
use super::terrain::fractal;
use crate::geom::HeightField;
use crate::seed::Draws;
use crate::{Error, Result, Seed, Warning};

crate::params! {
    /// How trees are planted.
    pub struct PlantingParams {
        /// Smallest distance between two trees over the one that an even spread would give each: 0.3 is nearly chance, 0.8 a plantation.
        evenness: f64 = 0.6, in 0.3..=0.8, unit "", source "ours: crowns touch here and there, as in woods that grew by themselves";
        /// How much like grows beside like; 0 mixes the species at every place as their shares say.
        species_clumping: f64 = 0.6, in 0.0..=1.0, unit "", source "ours: stands of one species with others among them";
        /// Share of the ground that is left open, in clearings.
        clearings: f64 = 0.15, in 0.0..=0.95, unit "", source "ours: a grove, not a plantation";
        /// From one clearing, or one stand of a species, to the next, about.
        clearing_m: f64 = 80.0, in 2.0..=10_000.0, unit "m", source "ours: a few crowns wide";
        /// Sizes vary by up to this share of a tree's own to either side, those near it most often.
        size_spread: f64 = 0.3, in 0.0..=0.9, unit "", source "She §3.5: trees are copied and scaled; the share is ours";
        /// No trees where the ground is steeper.
        steepest_deg: f64 = 45.0, in 0.0..=90.0, unit "°", source "ours: soil does not hold on steeper slopes";
    }
}

/// Trees that a scene may have: they take half a gigabyte.
pub const MOST_TREES: u64 = 1 << 22;

/// What a tree takes while it is placed and once it stands: its cells and its lot, [`Planted`], an instance on the device.
pub const BYTES_PER_TREE: u64 = 44 + 16 + 24 + 32;

/// Rounds of darts before the distance is found to be too large.
const ROUNDS: u32 = 48;

/// Cells of the grid that any number of trees may take: for those that stand close together on a small part of the ground.
const MOST_CELLS: usize = 500_000;

/// What placement knows of a species.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeciesSize {
    /// What the scene calls it; variants of a species are called the same.
    pub name: String,
    /// Other names that an inventory may use.
    pub also: Vec<String>,
    /// Share of the trees, over the sum of all shares.
    pub share: f64,
    /// Height, metres.
    pub height_m: f32,
    /// Width of the crown, metres.
    pub crown_width_m: f32,
    /// Radius of the trunk where it leaves the ground, metres.
    pub trunk_radius_m: f32,
}

/// Points, and what a user should know of them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scattered {
    /// X and Z, metres.
    pub points: Vec<[f32; 2]>,
    /// No two are nearer, metres.
    pub apart_m: f32,
    /// What a user should know.
    pub warnings: Vec<Warning>,
}

/// Refuses more trees than memory should hold.
///
/// # Errors
/// [`Error::TooManyTrees`], with the memory that they would take.
pub fn check_number(trees: u64) -> Result<()> {
    if trees <= MOST_TREES {
        return Ok(());
    }
    Err(Error::TooManyTrees { asked: trees, gb: trees as f64 * BYTES_PER_TREE as f64 / 1e9, most: MOST_TREES })
}

/// `count` points of blue noise over the ground, where `open` lets them.
///
/// # Errors
/// Those of [`check_number`].
pub fn scatter(
    ground: &HeightField,
    count: u64,
    evenness: f64,
    seed: Seed,
    open: &(impl Fn(f32, f32) -> bool + Sync),
) -> Result<Scattered> {
    check_number(count)?;
    let share = open_share(ground, open);
    if count == 0 {
        return Ok(Scattered::default());
    }
    let [width, depth] = ground.size_m().map(f64::from);
    // Where hardly anything is open, the look at it may have missed all of it.
    let area_m2 = width * depth * share.max(1e-3);
    // Darts settle at 0.7 points to a square of the distance, so up to 0.8 there is room for all. The grid has 2 cells to that square.
    let mut apart_m = evenness.clamp(0.3, 0.8) * (area_m2 / count as f64).sqrt();
    let mut best = Darts::thrown(ground, apart_m, count as usize, seed, open);
    // Nearer to each other, until they fit, or until the grid would take more memory than the trees may.
    while best.count < count as usize && best.cells() < 24 * count as usize + MOST_CELLS {
        apart_m *= 0.8;
        best = Darts::thrown(ground, apart_m, count as usize, seed, open);
    }
    let mut scattered = Scattered { points: best.chosen(count as usize, seed), apart_m: apart_m as f32, warnings: vec![] };
    let found = scattered.points.len() as u64;
    if found < count {
        let told =
            format!("only {found} of {count} trees found a place; lower --clearings, raise --steepest-deg, or widen the ground");
        scattered.warnings.push(Warning::new("trees-without-place", told));
    }
    Ok(scattered)
}

/// Which share of the ground is open, by a look at 128 × 128 places.
fn open_share(ground: &HeightField, open: &(impl Fn(f32, f32) -> bool + Sync)) -> f64 {
    const SIDE: u32 = 128;
    let [width, depth] = ground.size_m();
    let at = |index: u32, from: f32, size: f32| from + (index as f32 + 0.5) / SIDE as f32 * size;
    let is_open = |index: &u32| open(at(index % SIDE, ground.west_m, width), at(index / SIDE, ground.north_m, depth));
    (0..SIDE * SIDE).into_par_iter().filter(is_open).count() as f64 / f64::from(SIDE * SIDE)
}

/// A grid of cells, each of which holds one point or none.
struct Darts {
    /// Cells to a row.
    columns: usize,
    /// Points, not a number where a cell is empty; row by row.
    rows: Vec<Vec<[f32; 2]>>,
    /// How many there are.
    count: usize,
}

const EMPTY: [f32; 2] = [f32::NAN; 2];

impl Darts {
    /// Throws until `enough` points stand `apart_m` from each other, or rounds are used up.
    fn thrown(ground: &HeightField, apart_m: f64, enough: usize, seed: Seed, open: &(impl Fn(f32, f32) -> bool + Sync)) -> Self {
        // The diagonal of a cell is the distance, so no two points share one.
        let cell_m = apart_m / 2f64.sqrt();
        let [columns, rows] = ground.size_m().map(|side| (f64::from(side) / cell_m).ceil().max(1.0) as usize);
        let mut darts = Self { columns, rows: vec![vec![EMPTY; columns]; rows], count: 0 };
        let board = Board { ground, seed, cell_m, apart_m: apart_m as f32, open };
        for round in 0..ROUNDS {
            let before = darts.count;
            for phase in 0..3 {
                let rows = &darts.rows;
                let thrown: Vec<(Vec<[f32; 2]>, usize)> =
                    (phase..rows.len()).into_par_iter().step_by(3).map(|row| board.throw(rows, row, round)).collect();
                for (index, (row, hits)) in thrown.into_iter().enumerate() {
                    darts.rows[phase + 3 * index] = row;
                    darts.count += hits;
                }
            }
            let settled = round > 16 && darts.count == before;
            if darts.count >= enough || settled {
                break;
            }
        }
        darts
    }

    /// Cells of the grid.
    fn cells(&self) -> usize {
        self.columns * self.rows.len()
    }

    /// `count` of the points, drawn by lot, row by row.
    fn chosen(&self, count: usize, seed: Seed) -> Vec<[f32; 2]> {
        let cells = self.rows.iter().flatten().enumerate().filter(|(_, point)| !point[0].is_nan());
        if self.count <= count {
            return cells.map(|(_, point)| *point).collect();
        }
        let mut lots: Vec<(u64, usize)> = cells.map(|(cell, _)| (seed.keyed("grove-lot", cell as u64).bits(), cell)).collect();
        lots.select_nth_unstable(count);
        lots.truncate(count);
        lots.par_sort_unstable_by_key(|(_, cell)| *cell);
        lots.into_iter().map(|(_, cell)| self.rows[cell / self.columns][cell % self.columns]).collect()
    }
}

/// What a dart is thrown at.
struct Board<'a, F> {
    ground: &'a HeightField,
    seed: Seed,
    cell_m: f64,
    apart_m: f32,
    open: &'a F,
}

impl<F: Fn(f32, f32) -> bool + Sync> Board<'_, F> {
    /// One dart for each cell of a row that is still empty and takes part in this round: the row as it is then, and how many hit.
    fn throw(&self, rows: &[Vec<[f32; 2]>], index: usize, round: u32) -> (Vec<[f32; 2]>, usize) {
        // Ever more cells take part, from an eighth of them on.
        let part = (0.125 * f64::from(round + 1)).min(1.0);
        let (mut row, mut hits) = (rows[index].clone(), 0);
        let seed = Seed(self.seed.keyed("grove-dart", index as u64 ^ (u64::from(round) << 48)).bits());
        for column in 0..row.len() {
            if !row[column][0].is_nan() {
                continue;
            }
            let mut draws = seed.keyed("", column as u64);
            if draws.unit() >= part {
                continue;
            }
            let along = |cell: usize, from: f32, draw: f64| (f64::from(from) + (cell as f64 + draw) * self.cell_m) as f32;
            let at = [along(column, self.ground.west_m, draws.unit()), along(index, self.ground.north_m, draws.unit())];
            let bounds = self.ground.size_m();
            let inside = at[0] <= self.ground.west_m + bounds[0] && at[1] <= self.ground.north_m + bounds[1];
            if inside && self.is_free(rows, &row, index, column, at) && (self.open)(at[0], at[1]) {
                row[column] = at;
                hits += 1;
            }
        }
        (row, hits)
    }

    /// Whether no point stands too near. `row` is what row `index` has become.
    fn is_free(&self, rows: &[Vec<[f32; 2]>], row: &[[f32; 2]], index: usize, column: usize, at: [f32; 2]) -> bool {
        let columns = column.saturating_sub(2)..(column + 3).min(row.len());
        (index.saturating_sub(2)..(index + 3).min(rows.len())).all(|j| {
            let beside = if j == index { row } else { &rows[j] };
            // Distances to empty cells are not a number, which is not less than anything.
            let near = |p: &[f32; 2]| (p[0] - at[0]).powi(2) + (p[1] - at[1]).powi(2) < self.apart_m * self.apart_m;
            !beside[columns.clone()].iter().any(near)
        })
    }
}

/// Where trees may stand: off cliffs and out of clearings.
pub struct Openness<'a> {
    ground: &'a HeightField,
    noise: FastNoiseLite,
    /// Clearings are where the noise is lower.
    least: f32,
    /// Slopes whose normal rises less are too steep.
    upright: f32,
}

impl<'a> Openness<'a> {
    /// As the parameters say.
    pub fn new(ground: &'a HeightField, params: &PlantingParams, seed: Seed) -> Self {
        const SIDE: u16 = 96;
        let noise = fractal(seed, "grove-clearings", params.clearing_m, 5, 0.55);
        // The noise that this share of the ground stays below.
        let [width, depth] = ground.size_m();
        let at = |index: u16, from: f32, size: f32| from + (f32::from(index) + 0.5) / f32::from(SIDE) * size;
        let mut values: Vec<f32> = (0..SIDE * SIDE)
            .map(|i| noise.get_noise_2d(at(i % SIDE, ground.west_m, width), at(i / SIDE, ground.north_m, depth)))
            .collect();
        values.sort_by(f32::total_cmp);
        let rank = (params.clearings * values.len() as f64) as usize;
        let least = if rank == 0 { f32::NEG_INFINITY } else { values[rank.min(values.len() - 1)] };
        // Level ground is open whatever the angle.
        let upright = (params.steepest_deg.to_radians().cos() as f32).min(1.0 - 1e-6);
        Self { ground, noise, least, upright }
    }

    /// Whether a tree may stand here.
    pub fn allows(&self, x: f32, z: f32) -> bool {
        let dense = self.least == f32::NEG_INFINITY || self.noise.get_noise_2d(x, z) >= self.least;
        dense && self.ground.normal_at(x, z).is_some_and(|normal| normal.y >= self.upright)
    }
}

/// Makes trees of points: each has a species, a turn, a size, and its foot in the ground.
pub fn plant(
    points: &[[f32; 2]],
    ground: &HeightField,
    species: &[SpeciesSize],
    params: &PlantingParams,
    seed: Seed,
) -> Vec<Planted> {
    let stands = Stands::new(species, params, seed);
    let tree = |(index, &[x, z]): (usize, &[f32; 2])| {
        let mut draws = seed.keyed("grove-tree", index as u64);
        let kind = stands.species_at(x, z, &mut draws);
        // Two draws together: sizes near the species' own are the most frequent.
        let scale = 1.0 + params.size_spread * 0.5 * (draws.signed() + draws.signed());
        let foot = foot_at(ground, x, z, species.get(kind)?.trunk_radius_m * scale as f32)?;
        Some(Planted { species: kind as u16, position: foot, yaw_rad: turn(&mut draws), scale: scale as f32 })
    };
    points.par_iter().enumerate().filter_map(tree).collect()
}

/// A turn about the vertical, radians, 0 to 2π without 2π.
pub(super) fn turn(draws: &mut Draws) -> f32 {
    // The last double below 1 is 1 as a float.
    (draws.unit() as f32).min(1.0 - f32::EPSILON) * TAU
}

/// Where the foot of a trunk goes so that none of it hangs over the slope: as deep as the lowest ground under its rim. `None` off the ground.
pub fn foot_at(ground: &HeightField, x: f32, z: f32, trunk_radius_m: f32) -> Option<Vec3> {
    // With eight, a crease between two looks left a sixteenth of the radius of air under the rim.
    const AROUND: u16 = 32;
    let middle = ground.height_at(x, z)?;
    let normal = ground.normal_at(x, z)?;
    // The triangle under it exactly, and the ones beside it by looking around.
    let by_slope = middle - trunk_radius_m * normal.x.hypot(normal.z) / normal.y.max(1e-3);
    let rim = |i: u16| {
        let (sin, cos) = (TAU * f32::from(i) / f32::from(AROUND)).sin_cos();
        ground.height_at(x + trunk_radius_m * sin, z + trunk_radius_m * cos).unwrap_or(middle)
    };
    let lowest = if normal.y == 1.0 && trunk_radius_m < 1e-3 { middle } else { (0..AROUND).map(rim).fold(middle, f32::min) };
    Some(Vec3::new(x, lowest.min(by_slope), z))
}

/// Which species grows where.
pub(super) struct Stands {
    /// Logarithm of the share, and the noise that decides where the species stands, by species.
    species: Vec<(f64, FastNoiseLite)>,
    clumping: f64,
}

impl Stands {
    pub(super) fn new(species: &[SpeciesSize], params: &PlantingParams, seed: Seed) -> Self {
        // Variants of a species share its name and so its stands: the same tree does not stand beside itself more than by chance.
        let noise = |name: &str| fractal(seed, &format!("grove-stand {name}"), params.clearing_m, 2, 0.5);
        let species = species.iter().map(|s| (s.share.max(0.0).ln(), noise(&s.name))).collect();
        Self { species, clumping: params.species_clumping }
    }

    /// The Gumbel-max trick: the largest of log share + a Gumbel number is a species drawn by share; noise in place of a part of the
    /// chance makes neighbours alike.
    pub(super) fn species_at(&self, x: f32, z: f32, draws: &mut Draws) -> usize {
        if self.species.len() < 2 {
            return 0;
        }
        let mut best = (f64::NEG_INFINITY, 0);
        for (index, (log_share, noise)) in self.species.iter().enumerate() {
            let gumbel = -(-draws.unit().max(1e-300).ln()).ln();
            let by_place = if self.clumping > 0.0 { 8.0 * f64::from(noise.get_noise_2d(x, z)) } else { 0.0 };
            let score = log_share + (1.0 - 0.5 * self.clumping) * gumbel + self.clumping * by_place;
            if score > best.0 {
                best = (score, index);
            }
        }
        best.1
    }
}

#[cfg(test)]
#[path = "placement_tests.rs"]
mod tests;
