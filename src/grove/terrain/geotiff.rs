//! GeoTIFF (OGC 19-008r4): one band of heights, its pixel size, its place and its coordinate system.

use std::io::Cursor;

use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;

use crate::{Result, Warning};

use super::survey::{Georeference, Survey, degree_m};
use super::{TerrainParams, check_sides, refused};

/// What is no height on Earth, metres: files that forget to declare their marker use ±9999, ±32768 or ±3.4e38.
const HEIGHTS_M: std::ops::RangeInclusive<f32> = -12_000.0..=9_500.0;

/// The coordinate system's kind: 2 is longitude and latitude.
const MODEL_TYPE: u16 = 1024;
/// 2 where the tie point is the middle of a pixel, otherwise its corner.
const RASTER_TYPE: u16 = 1025;
/// The number of a geographic system, or of a projected one.
const GEOGRAPHIC: u16 = 2048;
const PROJECTED: u16 = 3072;
/// Units of the plane and of heights.
const PLANE_UNIT: u16 = 3076;
const HEIGHT_UNIT: u16 = 4099;

/// A file's first picture as measured heights.
///
/// # Errors
/// [`crate::Error::Ground`] for what cannot be decoded, more than one band, sizes and places that cannot be.
pub fn read(bytes: &[u8], params: &TerrainParams) -> Result<Survey> {
    let wrong = |error: tiff::TiffError| refused("a TIFF that can be decoded", error.to_string());
    let mut limits = Limits::default();
    (limits.decoding_buffer_size, limits.intermediate_buffer_size) = (1 << 30, 1 << 30);
    let mut file = Decoder::new(Cursor::new(bytes)).map_err(wrong)?.with_limits(limits);
    let (columns, rows) = file.dimensions().map_err(wrong)?;
    check_sides(columns, rows)?;
    let kind = file.colortype().map_err(wrong)?;
    if !matches!(kind, ColorType::Gray(_) | ColorType::Multiband { num_samples: 1, .. }) {
        return Err(refused("one band of heights", format!("{kind:?}")));
    }
    let keys = file.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).unwrap_or_default();
    let key = |id: u16| keys.chunks_exact(4).skip(1).find(|entry| entry[0] == id && entry[1] == 0).map(|entry| entry[3]);
    let nodata: Option<f64> =
        file.get_tag_ascii_string(Tag::GdalNodata).ok().and_then(|text| text.trim_matches(['\0', ' ', '\n']).parse().ok());
    let place = Place::read(&mut file, &key);
    let samples = file.read_image().map_err(wrong)?;
    let to_m = unit_m(key(HEIGHT_UNIT));
    let heights = heights(samples, nodata.map(|v| v as f32), to_m as f32)?;
    let Some(place) = place? else {
        let step_m = params.ground_width_m / f64::from((columns - 1).max(1));
        let mut survey = Survey::new([columns, rows], [step_m; 2], heights);
        let told = format!("the TIFF does not say how large its ground is; taken as {} m wide", params.ground_width_m);
        survey.warnings.push(Warning::new("ground-without-place", told));
        return Ok(survey);
    };
    place.survey([columns, rows], heights, &key)
}

/// Pixel size and the map coordinates of the first pixel's middle.
struct Place {
    pixel: [f64; 2],
    first: [f64; 2],
}

impl Place {
    /// From a pixel scale and a tie point, or from a matrix that neither turns nor shears; `None` where the file has neither.
    fn read(file: &mut Decoder<Cursor<&[u8]>>, key: &impl Fn(u16) -> Option<u16>) -> Result<Option<Self>> {
        let scale = file.get_tag_f64_vec(Tag::ModelPixelScaleTag).ok();
        let tie = file.get_tag_f64_vec(Tag::ModelTiepointTag).ok();
        let matrix = file.get_tag_f64_vec(Tag::ModelTransformationTag).ok();
        let (pixel, tied, at) = match (scale.as_deref(), tie.as_deref(), matrix.as_deref()) {
            (Some([sx, sy, ..]), Some([i, j, _, x, y, ..]), _) => ([*sx, *sy], [*i, *j], [*x, *y]),
            (_, _, Some([sx, a, _, x, b, sy, _, y, ..])) => {
                if [*a, *b].iter().any(|turn| turn.abs() > 1e-9 * sx.abs()) {
                    return Err(refused("heights whose rows run from west to east", "a turned or sheared map".to_owned()));
                }
                ([*sx, -*sy], [0.0; 2], [*x, *y])
            }
            _ => return Ok(None),
        };
        let sound = pixel.iter().all(|p| p.is_finite() && *p > 0.0) && tied.iter().chain(&at).all(|v| v.is_finite());
        if !sound {
            return Err(refused("pixels larger than 0 at a place on the map", format!("{pixel:?} at {at:?}")));
        }
        // The tie point is a pixel's corner unless pixels are points.
        let middle = if key(RASTER_TYPE) == Some(2) { 0.0 } else { 0.5 };
        let first = [at[0] + (middle - tied[0]) * pixel[0], at[1] - (middle - tied[1]) * pixel[1]];
        Ok(Some(Self { pixel, first }))
    }

    /// The heights at this place.
    fn survey(&self, [columns, rows]: [u32; 2], heights: Vec<f32>, key: &impl Fn(u16) -> Option<u16>) -> Result<Survey> {
        let half = [0.5 * f64::from(columns - 1) * self.pixel[0], 0.5 * f64::from(rows - 1) * self.pixel[1]];
        let origin = [self.first[0] + half[0], self.first[1] - half[1]];
        let geographic = key(MODEL_TYPE) == Some(2);
        if geographic && !(origin[0].abs() <= 540.0 && origin[1].abs() <= 90.0) {
            return Err(refused("a longitude and a latitude in degrees", format!("{origin:?}")));
        }
        let unit_m = if geographic { degree_m(origin[1]) } else { [unit_m(key(PLANE_UNIT)); 2] };
        // 32767 stands for a system that the registry does not have.
        let epsg = key(if geographic { GEOGRAPHIC } else { PROJECTED }).filter(|epsg| *epsg != 32_767);
        let step_m = [self.pixel[0] * unit_m[0], self.pixel[1] * unit_m[1]];
        if !step_m.iter().all(|step| (1e-3..=1e4).contains(step)) {
            return Err(refused("heights 0.001 to 10000 m apart", format!("{:.4} × {:.4} m", step_m[0], step_m[1])));
        }
        let mut survey = Survey::new([columns, rows], step_m, heights);
        survey.georeference = Some(Georeference { origin, pixel: self.pixel, unit_m, geographic, epsg });
        Ok(survey)
    }
}

/// Metres to a unit by its number (EPSG): metres, international feet, US survey feet.
fn unit_m(number: Option<u16>) -> f64 {
    match number {
        Some(9002) => 0.3048,
        Some(9003) => 1200.0 / 3937.0,
        _ => 1.0,
    }
}

/// Samples of any kind as metres; what is missing is no number.
fn heights(samples: DecodingResult, nodata: Option<f32>, to_m: f32) -> Result<Vec<f32>> {
    fn all<T: Copy>(values: Vec<T>, as_f32: impl Fn(T) -> f32) -> Vec<f32> {
        values.into_iter().map(as_f32).collect()
    }
    let mut heights = match samples {
        DecodingResult::U8(values) => all(values, f32::from),
        DecodingResult::U16(values) => all(values, f32::from),
        DecodingResult::U32(values) => all(values, |v| v as f32),
        DecodingResult::I8(values) => all(values, f32::from),
        DecodingResult::I16(values) => all(values, f32::from),
        DecodingResult::I32(values) => all(values, |v| v as f32),
        DecodingResult::F32(values) => values,
        DecodingResult::F64(values) => all(values, |v| v as f32),
        other => {
            let kind = format!("{other:?}").chars().take_while(char::is_ascii_alphanumeric).collect();
            return Err(refused("heights of 8, 16 or 32 bits, or floating point", kind));
        }
    };
    for height in &mut heights {
        let metres = *height * to_m;
        *height = if nodata == Some(*height) || !HEIGHTS_M.contains(&metres) { f32::NAN } else { metres };
    }
    Ok(heights)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::grove::terrain;
    use tiff::encoder::{TiffEncoder, colortype};

    /// 6 × 5 heights, 20 m apart in UTM zone 33 north, one of them missing.
    pub fn sample() -> Vec<u8> {
        write(
            &[20.0, 20.0, 0.0],
            &[0.0, 0.0, 0.0, 500_000.0, 5_800_000.0, 0.0],
            &[1, 1, 0, 2, MODEL_TYPE, 0, 1, 1, PROJECTED, 0, 1, 32_633],
        )
    }

    fn write(scale: &[f64], tie: &[f64], keys: &[u16]) -> Vec<u8> {
        let mut heights: Vec<f32> = (0..30).map(|i| 100.0 + i as f32).collect();
        heights[8] = -32_768.0;
        let mut out = Cursor::new(vec![]);
        let mut file = TiffEncoder::new(&mut out).unwrap();
        let mut image = file.new_image::<colortype::Gray32Float>(6, 5).unwrap();
        image.encoder().write_tag(Tag::ModelPixelScaleTag, scale).unwrap();
        image.encoder().write_tag(Tag::ModelTiepointTag, tie).unwrap();
        image.encoder().write_tag(Tag::GeoKeyDirectoryTag, keys).unwrap();
        image.encoder().write_tag(Tag::GdalNodata, "-32768").unwrap();
        image.write_data(&heights).unwrap();
        out.into_inner()
    }

    #[test]
    fn place_size_and_gaps_are_kept() {
        let terrain = terrain::read(&sample(), &TerrainParams::default()).unwrap();
        let map = terrain.georeference.unwrap();
        assert_eq!((map.epsg, map.geographic), (Some(32_633), false));
        // The tie point is the first pixel's corner, so the middle of 6 × 5 pixels lies 3 and 2.5 of them from it.
        assert_eq!(map.origin, [500_060.0, 5_799_950.0]);
        let field = &terrain.field;
        assert_eq!((field.columns, field.rows, field.step_m), (6, 5, 20.0));
        let [x, z] = map.to_scene([500_010.0, 5_799_990.0]);
        assert_eq!((x, z), (field.west_m, field.north_m), "the first pixel's middle");
        assert_eq!(field.height_at(x, z), Some(100.0));
        assert!((101.0..120.0).contains(&field.heights_m[8]) && terrain.warnings[0].code == "ground-gaps");
    }

    #[test]
    fn degrees_become_metres_and_squares() {
        let arc = 1.0 / 3600.0;
        let keys = [1, 1, 0, 3, MODEL_TYPE, 0, 1, 2, RASTER_TYPE, 0, 1, 2, GEOGRAPHIC, 0, 1, 4326];
        let bytes = write(&[arc, arc, 0.0], &[0.0, 0.0, 0.0, 7.0, 60.0, 0.0], &keys);
        let terrain = terrain::read(&bytes, &TerrainParams::default()).unwrap();
        let [width, depth] = terrain.field.size_m();
        assert!((width - 5.0 * 15.44).abs() < 9.0 && (depth - 4.0 * 30.89).abs() < 9.0, "{width} {depth}");
        assert!(terrain.georeference.is_some_and(|map| map.geographic && map.epsg == Some(4326)));
    }

    #[test]
    fn places_that_cannot_be_are_refused() {
        for scale in [[0.0, 20.0, 0.0], [f64::NAN, 1.0, 0.0], [-5.0, 5.0, 0.0], [1e9, 1e9, 0.0]] {
            let bytes = write(&scale, &[0.0, 0.0, 0.0, 1.0, 1.0, 0.0], &[1, 1, 0, 0]);
            assert!(terrain::read(&bytes, &TerrainParams::default()).is_err(), "{scale:?}");
        }
    }
}
