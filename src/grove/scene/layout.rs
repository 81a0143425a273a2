//! Laying out: from a scene file and the sizes of its species to every tree's place and the camera's path.

use crate::geom::HeightField;
use crate::grove::path::{CameraParams, Path};
use crate::grove::placement::{Openness, SpeciesSize, plant, scatter};
use crate::grove::terrain::{self, Georeference, Terrain, TerrainParams};
use crate::grove::{Planted, inventory};
use crate::{Result, Seed, Warning};

use super::SceneFile;

/// Everything that stands somewhere, and the way past it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The file that it was laid out from, as it was then.
    pub file: SceneFile,
    /// The ground.
    pub ground: HeightField,
    /// Its place on the Earth, when a file has told.
    pub georeference: Option<Georeference>,
    /// What [`Planted::species`] counts.
    pub species: Vec<SpeciesSize>,
    /// The trees.
    pub planted: Vec<Planted>,
    /// The camera's path.
    pub path: Path,
    /// What a user should know.
    pub warnings: Vec<Warning>,
}

/// Lays a scene out. `species` are the file's, variants one after the other, with the sizes that they turned out to have; `progress` is
/// told what is being done.
///
/// # Errors
/// Those of [`SceneFile::check`], of the ground, the inventory and the path; [`crate::Error::TooManyTrees`].
pub fn lay_out(file: &SceneFile, species: &[SpeciesSize], progress: &mut dyn FnMut(&str)) -> Result<Scene> {
    file.check()?;
    let seed = Seed(file.seed);
    let list = match &file.inventory {
        Some(path) => {
            progress("reading the inventory");
            Some(inventory::open(path)?)
        }
        None => None,
    };
    progress("raising the ground");
    let Terrain { field: ground, georeference, mut warnings } = match &file.ground {
        Some(path) => terrain::open(path, &file.terrain)?,
        None => {
            let params = list.as_ref().map_or_else(|| file.terrain.clone(), |list| wide_enough(list, &file.terrain));
            Terrain { field: terrain::hills(&params, seed)?, georeference: None, warnings: vec![] }
        }
    };
    let mut path = path_of(file, &ground)?;
    let raised_m = path.keep_above(&ground, LEAST_CLEARANCE_M);
    if raised_m > 0.0 {
        let told = format!("the camera's path went under the ground; it was raised by up to {raised_m:.1} m");
        warnings.push(Warning::new("path-raised", told));
    }
    let planted = match list {
        Some(list) => {
            progress("planting the inventory");
            let frame = list.frame(georeference.as_ref(), ground.size_m());
            let (planted, told) = list.plant(&frame, &ground, species, &file.planting, seed);
            warnings.extend(told);
            planted
        }
        None if species.is_empty() => vec![],
        None => {
            progress("planting");
            let open = Openness::new(&ground, &file.planting, seed);
            let flight = Corridor::new(&path, &ground, species, &file.camera);
            let allowed = |x: f32, z: f32| !flight.holds(x, z) && open.allows(x, z);
            let scattered = scatter(&ground, file.trees, file.planting.evenness, seed, &allowed)?;
            warnings.extend(scattered.warnings);
            plant(&scattered.points, &ground, species, &file.planting, seed)
        }
    };
    Ok(Scene { file: file.clone(), ground, georeference, species: species.to_vec(), planted, path, warnings })
}

/// Nearer to the ground, the near plane would cut it open.
const LEAST_CLEARANCE_M: f32 = 0.6;

/// The path that a scene asks for.
fn path_of(file: &SceneFile, ground: &HeightField) -> Result<Path> {
    if !file.key.is_empty() {
        return Path::new(file.key.clone());
    }
    match file.path.as_str() {
        "tour" => Path::tour(ground, &file.camera),
        "orbit" => {
            let bounds = ground.bounds();
            let CameraParams { camera_radius_m, camera_overview_m, camera_length_s, .. } = file.camera;
            let around = 0.5 * bounds.size().x.hypot(bounds.size().z);
            let radius = if camera_radius_m > 0.0 { camera_radius_m as f32 } else { around };
            let middle = bounds.center();
            let floor = ground.height_at(middle.x, middle.z).unwrap_or(middle.y);
            Path::orbit(middle.with_y(floor), radius, camera_overview_m as f32, camera_length_s as f32)
        }
        other => Path::open(other.as_ref()),
    }
}

/// Hills that reach as far as an inventory does, except for the farthest hundredth of its rows: one wrong place is no reason for a desert.
fn wide_enough(list: &inventory::Inventory, params: &TerrainParams) -> TerrainParams {
    let size_m = [params.ground_width_m as f32, params.ground_depth_m as f32];
    let frame = list.frame(None, size_m);
    let reach = |axis: usize| {
        let mut far: Vec<f32> = list.entries.iter().map(|entry| frame.to_scene(entry.at)[axis].abs()).collect();
        let most = (far.len() * 99 / 100).min(far.len().saturating_sub(1));
        if far.is_empty() { 0.0 } else { f64::from(*far.select_nth_unstable_by(most, f32::total_cmp).1) }
    };
    // A tenth more, and a few crowns.
    let side = |axis: usize, least: f64| (2.2 * reach(axis) + 20.0).clamp(least, 100_000.0);
    let (width, depth) = (side(0, params.ground_width_m), side(1, params.ground_depth_m));
    let growth = (width * depth / params.ground_width_m / params.ground_depth_m).sqrt();
    let ground_step_m = (params.ground_step_m * growth).clamp(0.05, 1000.0);
    TerrainParams { ground_width_m: width, ground_depth_m: depth, ground_step_m, ..params.clone() }
}

/// Where no tree is planted since the camera flies there as low as trees are high.
struct Corridor {
    /// North-west corner, metres.
    from: [f32; 2],
    cell_m: f32,
    columns: usize,
    taken: Vec<bool>,
}

impl Corridor {
    fn new(path: &Path, ground: &HeightField, species: &[SpeciesSize], camera: &CameraParams) -> Self {
        const MOST_CELLS: f32 = 2048.0;
        let clear = camera.camera_clear_m as f32;
        let size = ground.size_m();
        let cell_m = (size[0].max(size[1]) / MOST_CELLS).max(0.5);
        let [columns, rows] = size.map(|side| (side / cell_m).ceil() as usize + 1);
        let mut corridor = Self {
            from: [ground.west_m, ground.north_m],
            cell_m,
            columns,
            taken: vec![false; if clear > 0.0 { columns * rows } else { 0 }],
        };
        let highest = species.iter().map(|s| s.height_m).fold(0.0, f32::max) * 1.5;
        // As many looks as cells lie on the way, though no more than are worth waiting for.
        let keys = path.keys();
        let way: f32 = keys.windows(2).map(|pair| pair[0].eye.distance(pair[1].eye)).sum();
        let looks = (2.0 * way / cell_m.max(0.5 * clear)).clamp(1.0, 200_000.0);
        for look in 0..=looks as u32 {
            let eye = path.at(look as f32 / looks * path.length_s()).eye;
            let low = ground.height_at(eye.x, eye.z).is_some_and(|floor| eye.y - floor < highest);
            if low && clear > 0.0 {
                corridor.take(eye.x, eye.z, clear, rows);
            }
        }
        corridor
    }

    fn take(&mut self, x: f32, z: f32, radius_m: f32, rows: usize) {
        let reach = (radius_m / self.cell_m).ceil() as i64;
        let [column, row] = [x - self.from[0], z - self.from[1]].map(|v| (v / self.cell_m) as i64);
        for j in (row - reach).max(0)..=(row + reach).min(rows as i64 - 1) {
            for i in (column - reach).max(0)..=(column + reach).min(self.columns as i64 - 1) {
                let away = ((i - column) as f32).hypot((j - row) as f32) * self.cell_m;
                self.taken[j as usize * self.columns + i as usize] |= away <= radius_m;
            }
        }
    }

    fn holds(&self, x: f32, z: f32) -> bool {
        let [column, row] = [x - self.from[0], z - self.from[1]].map(|v| (v / self.cell_m) as usize);
        self.taken.get(row * self.columns + column).copied().unwrap_or(false)
    }
}
