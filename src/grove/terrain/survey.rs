//! Measured heights on their way to ground: gaps filled, too many averaged, points that lie wider apart one way than the other made square.

use crate::Result;
use crate::Warning;
use crate::geom::{HeightField, MOST_POINTS};

use super::{Terrain, refused};

/// Where the scene lies on the Earth.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Georeference {
    /// Map coordinates of the scene's origin: easting and northing, or longitude and latitude in degrees.
    pub origin: [f64; 2],
    /// Map units from one pixel of the file to the next, eastwards and southwards.
    pub pixel: [f64; 2],
    /// Metres to a map unit, eastwards and northwards.
    pub unit_m: [f64; 2],
    /// Coordinates are longitude and latitude.
    pub geographic: bool,
    /// The coordinate system's number in the EPSG registry, when the file tells.
    pub epsg: Option<u16>,
}

impl Georeference {
    /// X and Z in the scene of map coordinates, metres.
    pub fn to_scene(&self, [east, north]: [f64; 2]) -> [f32; 2] {
        [((east - self.origin[0]) * self.unit_m[0]) as f32, ((self.origin[1] - north) * self.unit_m[1]) as f32]
    }

    /// Map coordinates of a place in the scene.
    pub fn to_map(&self, [x, z]: [f32; 2]) -> [f64; 2] {
        [self.origin[0] + f64::from(x) / self.unit_m[0], self.origin[1] - f64::from(z) / self.unit_m[1]]
    }
}

/// Metres to a degree of longitude and of latitude, on a sphere of the Earth's mean radius; good to 0.6 %.
pub fn degree_m(latitude_deg: f64) -> [f64; 2] {
    const EARTH_M: f64 = 6_371_008.8;
    let degree = EARTH_M.to_radians();
    // At the poles a degree of longitude has no length, and nothing could be divided by it.
    [degree * latitude_deg.to_radians().cos().max(1e-3), degree]
}

/// Heights as a file has them; what is missing is no number.
pub struct Survey {
    columns: u32,
    rows: u32,
    /// Metres between neighbours, eastwards and southwards.
    step_m: [f64; 2],
    heights_m: Vec<f32>,
    /// Its place on the Earth.
    pub georeference: Option<Georeference>,
    /// What a user should know.
    pub warnings: Vec<Warning>,
}

impl Survey {
    /// `heights_m` row by row, as many as the sides say.
    pub fn new([columns, rows]: [u32; 2], step_m: [f64; 2], heights_m: Vec<f32>) -> Self {
        Self { columns, rows, step_m, heights_m, georeference: None, warnings: vec![] }
    }

    /// Ground around the origin.
    pub fn into_terrain(mut self) -> Result<Terrain> {
        if self.heights_m.len() != self.columns as usize * self.rows as usize {
            return Err(refused("a height for each point", format!("{} of them", self.heights_m.len())));
        }
        self.fill_gaps()?;
        self.average_down();
        let (columns, rows, step_m, heights) = self.squared();
        let [west, north] = [columns, rows].map(|points| (-0.5 * f64::from(points - 1) * step_m) as f32);
        let field = HeightField::new(columns, rows, step_m as f32, west, north, heights)?;
        Ok(Terrain { field, georeference: self.georeference, warnings: self.warnings })
    }

    /// Fills what is missing from what is known around it: averaged into ever coarser grids until nothing is missing, then taken from
    /// the next coarser one.
    fn fill_gaps(&mut self) -> Result<()> {
        let missing = self.heights_m.iter().filter(|h| h.is_nan()).count();
        if missing == 0 {
            return Ok(());
        }
        if missing == self.heights_m.len() {
            return Err(refused("heights", "none but missing ones".to_owned()));
        }
        fill(self.columns as usize, self.rows as usize, &mut self.heights_m);
        let share = 100.0 * missing as f64 / self.heights_m.len() as f64;
        let told = format!("{missing} heights are missing ({share:.2} %); they were filled in from those around them");
        self.warnings.push(Warning::new("ground-gaps", told));
        Ok(())
    }

    /// Averages whole blocks until both sides fit.
    fn average_down(&mut self) {
        let factor = self.columns.max(self.rows).div_ceil(MOST_POINTS);
        // A side that has no two blocks stays as it is.
        let by = [self.columns, self.rows].map(|side| if side / factor >= 2 { factor } else { 1 });
        if by == [1, 1] {
            return;
        }
        let (columns, rows) = (self.columns / by[0], self.rows / by[1]);
        let block = |index: u32| {
            let (column, row) = (index % columns * by[0], index / columns * by[1]);
            let across = (0..by[1]).flat_map(|j| (0..by[0]).map(move |i| (column + i, row + j)));
            let sum: f64 = across.map(|(i, j)| f64::from(self.heights_m[(j * self.columns + i) as usize])).sum();
            (sum / f64::from(by[0] * by[1])) as f32
        };
        let heights = (0..columns * rows).map(block).collect();
        let told = format!(
            "{} × {} heights are more than a side may have ({MOST_POINTS}); {} × {} of them each were averaged",
            self.columns, self.rows, by[0], by[1]
        );
        self.warnings.push(Warning::new("ground-averaged", told));
        // The ground stays as wide as it was.
        let step = |side: u32, left: u32, step_m: f64| step_m * f64::from(side - 1) / f64::from(left - 1);
        self.step_m = [step(self.columns, columns, self.step_m[0]), step(self.rows, rows, self.step_m[1])];
        (self.columns, self.rows, self.heights_m) = (columns, rows, heights);
    }

    /// Columns, rows, step and heights of a grid of squares over the same ground, interpolated where it was none.
    fn squared(&mut self) -> (u32, u32, f64, Vec<f32>) {
        let [dx, dy] = self.step_m;
        if (dx / dy - 1.0).abs() < 1e-3 {
            return (self.columns, self.rows, dx, std::mem::take(&mut self.heights_m));
        }
        let size = [f64::from(self.columns - 1) * dx, f64::from(self.rows - 1) * dy];
        let coarsest = size[0].max(size[1]) / f64::from(MOST_POINTS - 1);
        let step_m = dx.min(dy).max(coarsest);
        let [columns, rows] = size.map(|side| 1 + ((side / step_m).round() as u32).clamp(1, MOST_POINTS - 1));
        let at = |index: u32, left: u32, side: u32| f64::from(index) / f64::from(left - 1) * f64::from(side - 1);
        let height = |index: u32| {
            let (u, v) = (at(index % columns, columns, self.columns), at(index / columns, rows, self.rows));
            let (column, row) = ((u as usize).min(self.columns as usize - 2), (v as usize).min(self.rows as usize - 2));
            let (u, v) = ((u - column as f64) as f32, (v - row as f64) as f32);
            let first = row * self.columns as usize + column;
            let h = |offset: usize| self.heights_m[first + offset];
            let below = self.columns as usize;
            let (upper, lower) = (h(0) + u * (h(1) - h(0)), h(below) + u * (h(below + 1) - h(below)));
            upper + v * (lower - upper)
        };
        (columns, rows, step_m, (0..columns * rows).map(height).collect())
    }
}

/// Fills what is no number; at least one has to be.
fn fill(columns: usize, rows: usize, heights: &mut [f32]) {
    if heights.iter().all(|h| !h.is_nan()) {
        return;
    }
    let (half_columns, half_rows) = (columns.div_ceil(2), rows.div_ceil(2));
    let mean = |index: usize| {
        let (i, j) = (index % half_columns * 2, index / half_columns * 2);
        let four = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)].into_iter().filter(|&(i, j)| i < columns && j < rows);
        let known = four.map(|(i, j)| heights[j * columns + i]).filter(|h| !h.is_nan());
        let (sum, count) = known.fold((0.0, 0.0f32), |(sum, count), h| (sum + h, count + 1.0));
        // Nothing known gives 0 / 0, which is what is missing.
        sum / count
    };
    let mut coarse: Vec<f32> = (0..half_columns * half_rows).map(mean).collect();
    fill(half_columns, half_rows, &mut coarse);
    for (index, height) in heights.iter_mut().enumerate().filter(|(_, h)| h.is_nan()) {
        *height = coarse[index / columns / 2 * half_columns + index % columns / 2];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_take_the_height_of_what_is_around_them() {
        let mut heights: Vec<f32> = (0..20).flat_map(|_| (0..20).map(|x| x as f32)).collect();
        for row in 5..9 {
            heights[row * 20 + 10..row * 20 + 13].fill(f32::NAN);
        }
        let terrain = Survey::new([20, 20], [1.0; 2], heights).into_terrain().unwrap();
        assert!(terrain.warnings[0].message.starts_with("12 heights are missing (3.00 %)"), "{:?}", terrain.warnings);
        let filled = terrain.field.heights_m[6 * 20 + 11];
        assert!((8.0..14.0).contains(&filled), "{filled}");
        assert!(Survey::new([2, 2], [1.0; 2], vec![f32::NAN; 4]).into_terrain().is_err());
    }

    #[test]
    fn oblong_pixels_become_squares_over_the_same_ground() {
        // A plane stays one: 3 m apart eastwards, 2 m southwards, rising 1 in 3 to the east.
        let heights = (0..7).flat_map(|_| (0..11).map(|x| x as f32)).collect();
        let field = Survey::new([11, 7], [3.0, 2.0], heights).into_terrain().unwrap().field;
        assert_eq!(field.step_m, 2.0);
        assert_eq!(field.size_m(), [30.0, 12.0]);
        for x in [-15.0f32, -3.5, 0.0, 14.0] {
            assert!((field.height_at(x, 1.0).unwrap() - (x + 15.0) / 3.0).abs() < 1e-4);
        }
    }

    #[test]
    fn the_map_and_the_scene_find_each_other() {
        let unit_m = degree_m(52.0);
        let map = Georeference { origin: [13.4, 52.0], pixel: [1e-4; 2], unit_m, geographic: true, epsg: Some(4326) };
        let [x, z] = map.to_scene([13.41, 52.01]);
        assert!((x - 684.6).abs() < 1.0 && (z + 1111.9).abs() < 1.0, "{x} {z}");
        let [lon, lat] = map.to_map([x, z]);
        assert!((lon - 13.41).abs() < 1e-6 && (lat - 52.01).abs() < 1e-6);
    }
}
