//! A grove in a GLB file, and our picture of it, are left in `target/tmp/grove_export/` for the Khronos validator and three.js
//! (`tests/js/`), which must see the same trees in the same places.

mod common;

use std::path::PathBuf;

use glam::Vec3;
use sphereboard::grove::drive::Grove;
use sphereboard::grove::export::{ExportParams, export};
use sphereboard::grove::path::Key;
use sphereboard::grove::scene::{SceneFile, SpeciesEntry, lay_out};
use sphereboard::grove::stock;
use sphereboard::raster::png;
use sphereboard::render::{Background, Camera, CullParams, Shot, Stage, World};
use sphereboard::repr::SoftwareCapture;
use sphereboard::{files, params::ParamSet};

#[test]
fn a_grove_and_our_picture_of_it_are_left_for_other_programs() {
    let Some(mut renderer) = common::software_renderer() else { return };
    // The model of a photograph, and grown trees as crossed cards.
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/oak.glb");
    let [eye, target] = [Vec3::new(-6.0, 9.0, 62.0), Vec3::new(0.0, 3.0, 0.0)];
    let mut file = SceneFile {
        method: "crossed-planes".to_owned(),
        trees: 60,
        key: vec![Key { time_s: 0.0, eye, target }],
        species: vec![SpeciesEntry::new(model), SpeciesEntry { variants: 2, ..SpeciesEntry::new("spruce") }],
        ..SceneFile::default()
    };
    for (name, value) in [("ground_width_m", "90"), ("ground_depth_m", "70"), ("ground_step_m", "2"), ("relief_m", "5")] {
        file.terrain.set(name, value).unwrap();
    }
    let [first, second] = [0, 1].map(|of| {
        let method = ["geometry", "crossed-planes"][of];
        stock::stock(&file.species[of..=of], method, &SoftwareCapture::new(), &|_| ()).unwrap()
    });
    let stock: Vec<_> = first.into_iter().chain(second).collect();
    let sizes: Vec<_> = stock.iter().map(|stock| stock.size.clone()).collect();
    let scene = lay_out(&file, &sizes, &mut |_| ()).unwrap();
    let params = ExportParams { export_cell_m: 30.0, ..ExportParams::default() };
    let export = export(&scene, &stock, &params).unwrap();
    assert!(export.trees == scene.planted.len() && export.trees > 40 && export.warnings.is_empty(), "{} trees", export.trees);

    let (size_px, fov_y_rad) = ([900, 500], 0.6);
    let mut grove = Grove::plant(&renderer, &scene, &stock).unwrap();
    let shot = Shot {
        stage: Stage::Unshaped,
        background: Background::Alpha,
        level_distance: Some(params.export_distance as f32),
        ..Shot::new(Camera::looking(eye, target, fov_y_rad), size_px)
    };
    // Trees alone: silhouettes over ground would be alike wherever they stood.
    let world = World { ground: None, ..grove.world(&CullParams::default(), None) };
    let picture = renderer.picture(&shot, world).unwrap().color;
    let seen = picture.pixels().filter(|p| p[3] > 128).count();
    assert!((20_000..400_000).contains(&seen), "{seen} pixels of trees");

    let shots = serde_json::json!({ "shots": [{
        "name": "grove", "size_px": size_px, "eye": eye.to_array(), "target": target.to_array(), "distance_m": eye.distance(target),
        "fov_deg": fov_y_rad.to_degrees(), "hide": ["ground"],
    }]});
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("grove_export");
    std::fs::create_dir_all(&folder).unwrap();
    let text = serde_json::to_vec_pretty(&shots).unwrap();
    let all = [("grove.glb", export.glb), ("grove.ours.png", png(&picture).unwrap()), ("shots.json", text)];
    files::write_all(&all.map(|(name, bytes)| (folder.join(name), bytes))).unwrap();
}
