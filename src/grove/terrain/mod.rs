//! Ground for a grove: rolling hills from a seed, a grey picture of heights, or a GeoTIFF with its place on the Earth. Metres.

mod geotiff;
mod survey;

use std::path::Path;

use fastnoise_lite::{FastNoiseLite, FractalType, NoiseType};
use image::{DynamicImage, ImageFormat, ImageReader};
use rayon::prelude::*;

use survey::Survey;
pub use survey::{Georeference, degree_m};

use crate::geom::{HeightField, MOST_POINTS};
use crate::{Error, Result, Seed, Warning, files};

crate::params! {
    /// The ground that trees stand on.
    pub struct TerrainParams {
        /// From west to east: of hills, and of a picture of heights. A GeoTIFF says its own.
        ground_width_m: f64 = 346.0, in 2.0..=100_000.0, unit "m", source "ours: with the next two She §3.5's 31,832 triangles; 540 junipers then stand 11 m apart";
        /// From north to south, of hills; a picture's follows from its shape.
        ground_depth_m: f64 = 184.0, in 2.0..=100_000.0, unit "m", source "ours: see ground_width_m";
        /// Distance between neighbouring points of hills; made larger where a side would have more than 4096 of them.
        ground_step_m: f64 = 2.0, in 0.05..=1000.0, unit "m", source "ours: see ground_width_m";
        /// About how far the highest point lies above the lowest one; of a picture, white above black. 0 is level ground.
        relief_m: f64 = 16.0, in 0.0..=9000.0, unit "m", source "ours: hills that hide some of the trees, as in She fig. 19";
        /// From one hill to the next, about.
        hill_m: f64 = 150.0, in 1.0..=100_000.0, unit "m", source "ours: two hills in sight";
        /// Layers of ever smaller hills, each half as wide as the one before.
        octaves: u32 = 5, in 1..=10, unit "", source "ours: the smallest as wide as five steps";
        /// Height of a layer's hills over those of the layer before.
        roughness: f64 = 0.4, in 0.0..=0.9, unit "", source "ours: rolling meadows; 0.6 is broken ground";
    }
}

/// Ground, and where on the Earth it lies.
#[derive(Debug, Clone, PartialEq)]
pub struct Terrain {
    /// Heights.
    pub field: HeightField,
    /// Its place on the Earth, when a file has told.
    pub georeference: Option<Georeference>,
    /// What a user should know.
    pub warnings: Vec<Warning>,
}

/// A file of heights may have this many bytes.
const MOST_BYTES: u64 = 1 << 30;

/// Heights that a file may hold along a side, before neighbouring ones are averaged down to [`MOST_POINTS`].
const MOST_SAMPLES: u32 = 4 * MOST_POINTS;

/// Rolling hills around the origin: fractal noise (fBm over OpenSimplex2).
///
/// # Errors
/// Those of [`HeightField::new`].
pub fn hills(params: &TerrainParams, seed: Seed) -> Result<HeightField> {
    let size = [params.ground_width_m, params.ground_depth_m];
    let coarsest = size.iter().fold(0.0, |a: f64, b| a.max(*b)) / f64::from(MOST_POINTS - 1);
    let step_m = params.ground_step_m.max(coarsest);
    let [columns, rows] = size.map(|side| 1 + ((side / step_m).round() as u32).clamp(1, MOST_POINTS - 1));
    let [west, north] = [columns, rows].map(|points| -0.5 * f64::from(points - 1) * step_m);
    let noise = fractal(seed, "grove-hills", params.hill_m, params.octaves, params.roughness);
    let height = |index: usize| {
        let (column, row) = (index % columns as usize, index / columns as usize);
        let (x, z) = (west + column as f64 * step_m, north + row as f64 * step_m);
        // The noise keeps within ±1, and mostly within ±0.6.
        (params.relief_m * 0.8 * f64::from(noise.get_noise_2d(x as f32, z as f32))) as f32
    };
    let heights = (0..columns as usize * rows as usize).into_par_iter().map(height).collect();
    HeightField::new(columns, rows, step_m as f32, west as f32, north as f32, heights)
}

/// Fractal noise between -1 and 1 whose widest bumps are about `size_m` apart.
pub(super) fn fractal(seed: Seed, stage: &str, size_m: f64, octaves: u32, gain: f64) -> FastNoiseLite {
    let mut noise = FastNoiseLite::with_seed(seed.keyed(stage, 0).bits() as i32);
    noise.set_noise_type(Some(NoiseType::OpenSimplex2));
    noise.set_frequency(Some((1.0 / size_m) as f32));
    noise.set_fractal_type(Some(FractalType::FBm));
    noise.set_fractal_octaves(Some(octaves as i32));
    noise.set_fractal_gain(Some(gain as f32));
    noise
}

/// Ground from a file: a TIFF, with its own sizes where it is a GeoTIFF, or any other grey picture, black lowest.
///
/// # Errors
/// [`Error::InFile`] around [`Error::Ground`] for what is no picture of heights; those of reading.
pub fn open(path: &Path, params: &TerrainParams) -> Result<Terrain> {
    let bytes = files::read_whole(path, MOST_BYTES)?;
    read(&bytes, params).map_err(|cause| Error::InFile { path: path.to_owned(), cause: Box::new(cause) })
}

/// As [`open`], from a file's bytes.
///
/// # Errors
/// [`Error::Ground`].
pub fn read(bytes: &[u8], params: &TerrainParams) -> Result<Terrain> {
    match image::guess_format(bytes) {
        Ok(ImageFormat::Tiff) => geotiff::read(bytes, params)?,
        Ok(format) => picture(bytes, format, params)?,
        Err(_) => return Err(refused("a grey picture (16-bit PNG) or a GeoTIFF", "something else".to_owned())),
    }
    .into_terrain()
}

/// A grey picture as heights from 0 (black) to `relief_m` (white).
fn picture(bytes: &[u8], format: ImageFormat, params: &TerrainParams) -> Result<Survey> {
    let mut limits = image::Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(MOST_SAMPLES), Some(MOST_SAMPLES));
    // Declared sizes first: nothing is allocated for a picture that is too large.
    let reader = || {
        let mut reader = ImageReader::with_format(std::io::Cursor::new(bytes), format);
        reader.limits(limits.clone());
        reader
    };
    let wrong = |error: image::ImageError| refused("a picture that can be decoded", error.to_string());
    let (columns, rows) = reader().into_dimensions().map_err(wrong)?;
    check_sides(columns, rows)?;
    let decoded = reader().decode().map_err(wrong)?;
    let eight_bits = matches!(decoded, DynamicImage::ImageLuma8(_) | DynamicImage::ImageLumaA8(_));
    if decoded.color().has_color() {
        return Err(refused("a grey picture, black lowest", "a coloured one".to_owned()));
    }
    let to_m = params.relief_m / f64::from(u16::MAX);
    let heights = decoded.into_luma16().into_raw().into_iter().map(|v| (f64::from(v) * to_m) as f32).collect();
    let step_m = params.ground_width_m / f64::from((columns - 1).max(1));
    let mut survey = Survey::new([columns, rows], [step_m; 2], heights);
    if eight_bits {
        survey
            .warnings
            .push(Warning::new("terraced-ground", "the heights have 8 bits only, so slopes come in steps; save them with 16"));
    }
    Ok(survey)
}

/// Refuses sizes before anything is allocated for them.
fn check_sides(columns: u32, rows: u32) -> Result<()> {
    if [columns, rows].iter().all(|side| (2..=MOST_SAMPLES).contains(side)) {
        return Ok(());
    }
    Err(refused(&format!("2 to {MOST_SAMPLES} heights a side"), format!("{columns} × {rows}")))
}

fn refused(expected: &str, found: String) -> Error {
    Error::Ground { expected: expected.to_owned(), found, remedy: "give another file, or leave it out for hills from a seed" }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageBuffer, Luma};
    use proptest::prelude::*;

    fn png(width: u32, height: u32, value: impl Fn(u32, u32) -> u16) -> Vec<u8> {
        let mut out = std::io::Cursor::new(vec![]);
        let image = ImageBuffer::<Luma<u16>, _>::from_fn(width, height, |x, y| Luma([value(x, y)]));
        image.write_to(&mut out, ImageFormat::Png).unwrap();
        out.into_inner()
    }

    #[test]
    fn the_default_ground_has_the_triangles_of_the_paper() {
        let field = hills(&TerrainParams::default(), Seed(1)).unwrap();
        assert_eq!(field.triangles(), 31_832);
        let high = field.bounds().size().y;
        assert!((8.0..24.0).contains(&high), "{high}");
        assert_eq!(field, hills(&TerrainParams::default(), Seed(1)).unwrap());
        assert_ne!(field, hills(&TerrainParams::default(), Seed(2)).unwrap());
        let huge = TerrainParams { ground_width_m: 100_000.0, ground_depth_m: 2.0, ground_step_m: 0.05, ..Default::default() };
        assert_eq!(hills(&huge, Seed(1)).unwrap().columns, MOST_POINTS);
    }

    #[test]
    fn a_picture_is_ground_with_white_highest_and_its_top_in_the_north() {
        let params = TerrainParams { ground_width_m: 40.0, relief_m: 100.0, ..Default::default() };
        let terrain = read(&png(5, 3, |x, y| if (x, y) == (4, 0) { u16::MAX } else { 0 }), &params).unwrap();
        let field = terrain.field;
        assert_eq!((field.columns, field.rows, field.step_m, field.west_m, field.north_m), (5, 3, 10.0, -20.0, -10.0));
        assert_eq!(field.height_at(20.0, -10.0), Some(100.0));
        assert_eq!(field.height_at(20.0, 10.0), Some(0.0));
        assert!(terrain.warnings.is_empty() && terrain.georeference.is_none());
    }

    #[test]
    fn pictures_that_are_no_heights_are_refused() {
        let told = |bytes: &[u8]| read(bytes, &TerrainParams::default()).unwrap_err().to_string();
        assert!(told(b"hello").contains("expected a grey picture"));
        assert!(told(&png(1, 9, |_, _| 0)).contains("1 × 9"));
        let mut coloured = std::io::Cursor::new(vec![]);
        image::RgbImage::new(4, 4).write_to(&mut coloured, ImageFormat::Png).unwrap();
        assert!(told(&coloured.into_inner()).contains("coloured"));
        // A header that promises 4 billion × 4 billion pixels, and a file cut short.
        let mut vast = png(4, 4, |_, _| 0);
        vast[16..24].fill(0x7f);
        assert!(read(&vast, &TerrainParams::default()).is_err());
        let whole = png(64, 64, |x, y| (x * y) as u16);
        assert!(read(&whole[..whole.len() / 2], &TerrainParams::default()).is_err());
    }

    #[test]
    fn too_fine_a_picture_is_averaged_down() {
        let terrain = read(&png(MOST_POINTS + 10, 4, |_, _| u16::MAX), &TerrainParams::default()).unwrap();
        assert!(terrain.field.columns <= MOST_POINTS);
        assert!((terrain.field.size_m()[0] - 346.0).abs() < 0.5);
        assert!(terrain.field.heights_m.iter().all(|h| (h - 16.0).abs() < 1e-3));
        assert_eq!(terrain.warnings[0].code, "ground-averaged");
    }

    proptest! {
        #[test]
        fn damaged_files_are_errors_not_panics(at in 0usize..400, byte in any::<u8>(), tiff in any::<bool>()) {
            let mut bytes = if tiff { geotiff::tests::sample() } else { png(9, 9, |x, y| (x * 7000 + y) as u16) };
            let at = at % bytes.len();
            bytes[at] = byte;
            if let Ok(terrain) = read(&bytes, &TerrainParams::default()) {
                prop_assert!(terrain.field.heights_m.iter().all(|h| h.is_finite()));
            }
        }
    }
}
