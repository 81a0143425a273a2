//! GLB files: written and read back bit for bit, the same bytes every time, and no broken file does harm.
//!
//! The files are left in `target/tmp/glb/` for the Khronos validator (`tests/js/validate_glb.mjs`).

use std::f32::consts::{PI, TAU};
use std::path::PathBuf;

use glam::{DVec2, Vec2, Vec3};
use image::{Rgba, RgbaImage};
use proptest::prelude::*;
use sphereboard::geom::{PolyMesh, Surface};
use sphereboard::model::{About, Growth, GrowthProfile, ModelCrown, Profile, TreeModel, TrunkShape, glb};
use sphereboard::raster::Rect;
use sphereboard::{Error, Seed, files};

/// A sphere cut open along one meridian, where vertices stand double as they do on a chart's cuts: quads between, triangles at the poles.
fn sphere(center: Vec3, radius: f32, slices: u32, stacks: u32) -> Surface {
    let mut surface = Surface::default();
    for (stack, slice) in (0..=stacks).flat_map(|stack| (0..=slices).map(move |slice| (stack, slice))) {
        let (polar, azimuth) = (PI * stack as f32 / stacks as f32, TAU * (slice % slices) as f32 / slices as f32);
        let out = Vec3::new(polar.sin() * azimuth.sin(), polar.cos(), polar.sin() * azimuth.cos());
        surface.mesh.positions.push(center + radius * out);
        surface.normals.push(out.normalize());
        surface.uvs.push(Vec2::new(slice as f32 / slices as f32, stack as f32 / stacks as f32));
    }
    let corner = |stack, slice| stack * (slices + 1) + slice;
    for (stack, slice) in (0..stacks).flat_map(|stack| (0..slices).map(move |slice| (stack, slice))) {
        let quad = [corner(stack, slice), corner(stack + 1, slice), corner(stack + 1, slice + 1), corner(stack, slice + 1)];
        match stack {
            0 => surface.mesh.triangles.push([quad[0], quad[1], quad[2]]),
            _ if stack == stacks - 1 => surface.mesh.triangles.push([quad[0], quad[1], quad[3]]),
            _ => surface.mesh.quads.push(quad),
        }
    }
    surface
}

/// Leaves as noise: hard to compress, with gaps if asked.
fn noise(side: u32, gaps: bool) -> RgbaImage {
    RgbaImage::from_fn(side, side, |x, y| {
        let mut draws = Seed(5).keyed("leaves", u64::from(y * side + x));
        let light = draws.unit();
        let alpha = if gaps && draws.unit() < 0.1 { 0 } else { 255 };
        Rgba([(90.0 * light) as u8, (160.0 * light) as u8 + (draws.bits() % 16) as u8, (50.0 * light) as u8, alpha])
    })
}

fn about() -> About {
    let parameters = serde_json::json!({"outline_tolerance": 0.1 + 0.2, "detail": "medium", "tiny": 1e-300});
    About {
        format: About::FORMAT,
        program: About::this_program(),
        seed: u64::MAX,
        sources: vec!["Eiche im Sommer – “alt”.jpg".to_owned()],
        height_m: 1.0 / 3.0,
        height_guessed: true,
        parameters: parameters.as_object().expect("an object").clone(),
        feature_points: vec![Profile { azimuth_deg: 90.1, left_px: vec![DVec2::new(0.1, 7.0 / 11.0)], right_px: vec![] }],
        exemplar_window_px: Some(Rect { x: 1, y: 2, width: 3, height: 4 }),
        gap_fraction: 0.123_456_789_012_345_68,
        growth: Growth { profile: GrowthProfile::Needle, min_m: 0.01, max_m: 0.1 + 0.2, spacing_m: 1.0 / 7.0 },
    }
}

fn model(crowns: u32, side: u32) -> TreeModel {
    let crown = |number: u32| {
        let center = Vec3::new(number as f32, 5.0 + 0.1 * number as f32, -0.0);
        ModelCrown { surface: sphere(center, 2.5, 12, 8), texture: noise(side, number % 2 == 1), center }
    };
    let trunk = TrunkShape::guessed(Vec3::Y * 2.0, Vec3::Y * 5.0, 10.0).build();
    TreeModel { crowns: (0..crowns).map(crown).collect(), trunk: Some(trunk), about: about() }
}

/// Leaves a file for the validator.
fn keep(name: &str, bytes: &[u8]) {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("glb");
    std::fs::create_dir_all(&folder).unwrap();
    files::write_whole(&folder.join(name), bytes).unwrap();
}

/// Equality of every bit: `==` would call 0 and −0 the same.
fn assert_same(a: &TreeModel, b: &TreeModel) {
    assert_eq!(a, b);
    assert_eq!(format!("{a:?}"), format!("{b:?}"));
}

#[test]
fn a_model_survives_its_file_bit_for_bit() {
    let bare = TreeModel { trunk: None, ..model(1, 1) };
    for (name, model) in [("one_crown", model(1, 64)), ("three_crowns", model(3, 32)), ("no_trunk", bare)] {
        let bytes = glb::write(&model).unwrap();
        let again = glb::read(&bytes).unwrap();
        assert_same(&again, &model);
        assert_eq!(glb::write(&again).unwrap(), bytes, "{name}: the same bytes again");
        keep(&format!("{name}.glb"), &bytes);
    }
}

#[test]
fn many_vertices_need_wide_indices() {
    for (slices, wide) in [(254, false), (255, true)] {
        let mut model = model(1, 4);
        // 65,535 and 65,792 vertices.
        model.crowns[0].surface = sphere(Vec3::Y * 5.0, 2.0, slices, 256);
        let bytes = glb::write(&model).unwrap();
        assert_same(&glb::read(&bytes).unwrap(), &model);
        let wide_component = String::from_utf8_lossy(&bytes).contains("\"componentType\":5125");
        assert_eq!(wide_component, wide, "{slices} slices");
        keep(&format!("indices_{slices}.glb"), &bytes);
    }
}

#[test]
fn a_default_model_stays_below_a_megabyte() {
    let mut model = model(1, 512);
    model.crowns[0].surface = sphere(Vec3::Y * 6.0, 3.0, 47, 47);
    model.crowns[0].texture = noise(512, true);
    assert_eq!(model.crowns[0].surface.mesh.polygon_count(), 2209);
    let bytes = glb::write(&model).unwrap();
    assert!(bytes.len() <= 1_000_000, "{} bytes with the noisiest of leaves", bytes.len());
    keep("default_size.glb", &bytes);
}

#[test]
fn a_model_that_breaks_a_promise_is_not_written() {
    let broken = |damage: fn(&mut TreeModel)| {
        let mut model = model(1, 4);
        damage(&mut model);
        glb::write(&model).unwrap_err().to_string()
    };
    assert!(broken(|m| m.crowns.clear()).contains("no crown"));
    assert!(broken(|m| m.crowns[0].surface.mesh = PolyMesh::default()).contains("no polygons"));
    assert!(broken(|m| m.crowns[0].surface.mesh.positions[3].y = f32::NAN).contains("not finite"));
    assert!(broken(|m| m.crowns[0].surface.mesh.quads[0][1] = 999).contains("beyond the 117 vertices"));
    assert!(broken(|m| m.crowns[0].surface.normals[0] *= 1.01).contains("unit length"));
    assert!(broken(|m| m.crowns[0].surface.uvs.truncate(116)).contains("116"));
    assert!(broken(|m| m.crowns[0].texture = RgbaImage::new(0, 0)).contains("texture"));
    assert!(broken(|m| m.about.height_m = f64::INFINITY).contains("not finite"));
}

#[test]
fn other_files_are_refused_by_name() {
    let bytes = glb::write(&model(1, 4)).unwrap();
    let refused = |bytes: &[u8]| glb::read(bytes).unwrap_err();
    assert!(matches!(refused(b""), Error::BrokenGlb { .. }));
    assert!(matches!(refused(b"\x89PNG\r\n\x1a\n and more"), Error::BrokenGlb { .. }));
    let cut = refused(&bytes[..bytes.len() - 4]);
    assert!(cut.to_string().contains(&format!("declares {} bytes, but it has {}", bytes.len(), bytes.len() - 4)), "{cut}");
    // Replacements keep the lengths, so that only their meaning changes.
    let patched = |from: &str, to: &str| {
        assert_eq!(from.len(), to.len());
        let at = bytes.windows(from.len()).position(|w| w == from.as_bytes()).unwrap_or_else(|| panic!("{from} is in the file"));
        let mut patched = bytes.clone();
        patched[at..at + to.len()].copy_from_slice(to.as_bytes());
        refused(&patched)
    };
    assert!(matches!(patched("\"format\":2", "\"format\":7"), Error::GlbVersion { found: 7, known: 2 }));
    assert!(matches!(patched("\"sphereboard\"", "\"squareboard\""), Error::ForeignGlb { .. }));
    assert!(matches!(patched("\"quads\":72", "\"quads\":71"), Error::ForeignGlb { .. }));
    assert!(matches!(patched("\"count\":117", "\"count\":999"), Error::BrokenGlb { .. }));
    assert!(matches!(patched("\"scene\":0", "\"scene\":9"), Error::ForeignGlb { .. } | Error::BrokenGlb { .. }));
}

#[test]
fn triangles_that_are_no_halves_of_quads_are_refused() {
    let model = model(1, 4);
    let mut bytes = glb::write(&model).unwrap();
    let halves = |[a, b, c, d]: [u32; 4]| [a, b, c, a, c, d].map(|i| (i as u16).to_le_bytes()).concat();
    let whole = halves(model.crowns[0].surface.mesh.quads[0]);
    let at = bytes.windows(12).position(|w| w == whole).expect("the indices are in the file");
    // The same triangle, begun at another corner.
    bytes[at + 6..at + 12].rotate_left(2);
    let error = glb::read(&bytes).unwrap_err();
    assert!(matches!(error, Error::ForeignGlb { .. }), "{error}");
}

#[test]
fn glb_files_of_other_programs_are_refused() {
    let Some(shared) = files::shared_folder() else {
        println!("SKIPPED: ../shared is not there, so no foreign GLB files are tried");
        return;
    };
    let bytes = std::fs::read(shared.join("meshes/eztree_ash_medium.glb")).unwrap();
    let error = glb::read(&bytes).unwrap_err();
    assert!(matches!(error, Error::ForeignGlb { .. }), "{error}");
}

/// Where a whole number stands in the JSON of a file, for putting other numbers there.
fn numbers(bytes: &[u8]) -> Vec<std::ops::Range<usize>> {
    let json = 20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let starts = (20..json).filter(|&i| bytes[i].is_ascii_digit() && matches!(bytes[i - 1], b':' | b',' | b'['));
    starts.map(|i| i..(i..json).find(|&k| !bytes[k].is_ascii_digit()).unwrap_or(json)).collect()
}

/// The file with another number in its JSON and the lengths mended.
fn with_number(bytes: &[u8], at: std::ops::Range<usize>, value: u64) -> Vec<u8> {
    let json = 20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let mut text = [&bytes[20..at.start], value.to_string().as_bytes(), &bytes[at.end..json]].concat();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut out =
        [b"glTF\x02\0\0\0\0\0\0\0", (text.len() as u32).to_le_bytes().as_slice(), b"JSON", &text, &bytes[json..]].concat();
    let length = out.len() as u32;
    out[8..12].copy_from_slice(&length.to_le_bytes());
    out
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn no_bytes_make_it_panic(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        end in prop::option::of(any::<prop::sample::Index>()),
        mend in any::<bool>(),
    ) {
        let mut bytes = glb::write(&model(1, 4)).unwrap();
        for (at, value) in edits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Some(end) = end {
            bytes.truncate(end.index(bytes.len()));
        }
        if mend && bytes.len() >= 12 {
            let length = bytes.len() as u32;
            bytes[8..12].copy_from_slice(&length.to_le_bytes());
        }
        if let Ok(model) = glb::read(&bytes) {
            prop_assert!(model.check().is_ok());
        }
    }

    #[test]
    fn no_number_makes_it_panic_or_allocate(which in any::<prop::sample::Index>(), value in prop_oneof![
        any::<u64>(), 0..300u64, Just(u64::from(u32::MAX)), Just(u64::MAX), Just(1 << 40), Just(u64::MAX / 12),
    ]) {
        let bytes = glb::write(&model(1, 4)).unwrap();
        let numbers = numbers(&bytes);
        let at = numbers[which.index(numbers.len())].clone();
        if let Ok(model) = glb::read(&with_number(&bytes, at, value)) {
            prop_assert!(model.check().is_ok());
        }
    }
}
