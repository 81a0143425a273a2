use super::*;
use crate::grove::placement::SpeciesSize;
use proptest::prelude::*;

/// Species as large as presets about are, variants one after the other.
fn sizes(file: &SceneFile) -> Vec<SpeciesSize> {
    let size = |entry: &SpeciesEntry| {
        let height_m = crate::plant::presets::preset(&entry.source).map_or(10.0, |p| p.height_m as f32);
        let (share, name) = (entry.share / f64::from(entry.variants), entry.source.clone());
        let size =
            SpeciesSize { name, also: vec![], share, height_m, crown_width_m: 0.5 * height_m, trunk_radius_m: 0.02 * height_m };
        vec![size; entry.variants as usize]
    };
    file.species.iter().flat_map(size).collect()
}

fn laid_out(file: &SceneFile) -> Scene {
    lay_out(file, &sizes(file), &mut |_| {}).unwrap()
}

#[test]
fn every_preset_is_laid_out_whole() {
    for preset in PRESETS {
        let mut file = super::preset(preset.name).unwrap();
        for species in &file.species {
            assert!(crate::plant::presets::preset(&species.source).is_some(), "{}: {}", preset.name, species.source);
        }
        // The shape of the largest is seen with a hundredth of its trees, too.
        file.trees = file.trees.min(10_000);
        let scene = laid_out(&file);
        assert_eq!((scene.planted.len() as u64, &scene.warnings), (file.trees, &vec![]), "{}", preset.name);
        let kinds: std::collections::BTreeSet<u16> = scene.planted.iter().map(|t| t.species).collect();
        assert_eq!(kinds.len(), scene.species.len(), "{}: every species grows", preset.name);
        // The camera stays above ground and out of trunks.
        for step in 0..=1000 {
            let eye = scene.path.at(scene.path.length_s() * step as f32 / 1000.0).eye;
            if let Some(floor) = scene.ground.height_at(eye.x, eye.z) {
                assert!(eye.y > floor + 0.5, "{}: {eye}", preset.name);
                let near = scene.planted.iter().any(|t| {
                    (t.position - eye).with_y(0.0).length() < 2.0 && eye.y - floor < scene.species[t.species as usize].height_m
                });
                assert!(!near, "{}: {eye} in a tree", preset.name);
            }
        }
    }
    assert_eq!(laid_out(&super::preset("she-540").unwrap()).ground.triangles(), 31_832);
    assert_eq!(laid_out(&super::preset("she-fig18").unwrap()).ground.triangles(), 31_832);
    assert!(super::preset("she-541").unwrap_err().to_string().contains("she-540, she-fig18"));
}

#[test]
fn wrong_files_are_told_by_line_with_what_was_expected() {
    let told = |text: &str| SceneFile::parse(text).unwrap_err().to_string();
    let has = |text: &str, parts: &[&str]| {
        let told = told(text);
        assert!(parts.iter().all(|part| told.contains(part)), "{text}: {told}");
    };
    has("seed = 1\ntreees = 5\n", &["line 2", "treees", "trees"]);
    has("trees = \"many\"\n", &["line 1", "many"]);
    has("trees = -1\n", &["line 1"]);
    has("trees = 1000000000\n", &["116 GB", "1000000000"]);
    has("size_px = [8, 600]\n", &["16 to 8192 px", "8 × 600"]);
    has("seed = 1\n[terrain]\nrelief_m = -4\n", &["line", "relief-m must be 0 to 9000 m", "-4"]);
    has("[planting]\nevennes = 0.5\n", &["evennes", "evenness"]);
    has("seed = 1\n[levels]\nslack_m = 2.0\ncoarser = 11\n", &["line 4", "coarser must be 0.1 to 10", "11"]);
    has("[levels]\n\nhaste_m_s = \"fast\"\n", &["line 3", "haste-m-s must be 0 to 10000 m/s", "fast"]);
    has("[levels]\nslack = 1.0\n", &["line 2", "slack", "slack_m, coarser, haste_m_s"]);
    has("[culling]\nleast_px = -1\n", &["line 2", "least-px must be 0 to 100 px", "-1"]);
    has("[culling]\nleast_px = 1\nbatch = \"all\"\n", &["line 3", "batch", "naive, vbo, indirect", "all"]);
    has("[culling]\nreshape_px = nan\n", &["line 2", "reshape-px must be 1 to 4096 px", "nan"]);
    has("[settings.slices]\nlevel = \"on\"\nlevels = 3\n", &["levels", "groups"]);
    has("[settings.magic]\n", &["magic", "sphere-board"]);
    has("settings = 3\n", &["line 1"]);
    has("levels = 3\n", &["line 1", "a table of parameters"]);
    has("species = []\n", &["1 to 64", "0 of them"]);
    has("[[species]]\nsource = \"oak\"\nshare = 0\n", &["more than 0"]);
    has("[[species]]\nsource = \"oak\"\nshare = nan\n", &["0 to 1000000"]);
    has("[[species]]\nshare = 1.0\n", &["source"]);
    has("method = \"magic\"\n", &["magic", "sphere-board"]);
    has("frames = 0\n", &["1 to 1000000"]);
    has("key = [{ time_s = 0.0, eye = [0.0, 0.0], target = [0.0, 0.0, 0.0] }]\n", &["line 1"]);
    has("\0", &["line 1"]);
}

#[test]
fn levels_and_culling_are_the_scenes_own() {
    let text = "[levels]\nslack_m = 0\ncoarser = 2.5\n[culling]\nreshape_px = 100\nbatch = \"vbo\"\n";
    let file = SceneFile::parse(text).unwrap();
    assert_eq!((file.levels.slack_m, file.levels.coarser, file.levels.haste_m_s), (0.0, 2.5, FollowParams::default().haste_m_s));
    assert_eq!((file.culling.reshape_px, file.culling.batch), (100.0, crate::render::Batch::Vbo));
    assert_eq!(file.culling.least_px, CullParams::default().least_px);
    let mut file = SceneFile::parse("method = \"slices\"\n[settings.slices]\ngroups = 4\nlevel = \"on\"\n").unwrap();
    file.set(&Settings::default().with("groups", 5)).unwrap();
    let settings = Settings::default().with("groups", 4).with("level", "on").with("groups", 5);
    assert_eq!(file.stand_in("slices").settings, &settings);
    assert_eq!(file.stand_in("billboard").settings, Settings::none());
    assert!(SceneFile::default().set(&settings).unwrap_err().to_string().contains("--method"));
}

#[test]
fn no_trees_one_key_and_a_path_under_ground() {
    let file =
        SceneFile::parse("trees = 0\nkey = [{ time_s = 3.0, eye = [0.0, -50.0, 9.0], target = [0.0, 0.0, 0.0] }]\n").unwrap();
    let scene = laid_out(&file);
    assert!(scene.planted.is_empty());
    let eye = scene.path.at(1.0).eye;
    assert!(eye.y > scene.ground.height_at(eye.x, eye.z).unwrap() + 0.5, "{eye}");
    assert_eq!(scene.warnings[0].code, "path-raised");
}

#[test]
fn files_beside_the_scene_are_found_and_an_inventory_widens_the_ground() {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..400).map(|i| format!("{},{}\n", 500_000 + 40 * (i % 20), 5_800_000 + 30 * (i / 20))).collect();
    std::fs::write(folder.path().join("trees.csv"), format!("x,y\n{rows}")).unwrap();
    std::fs::write(folder.path().join("path.csv"), "0,0,90,0,1,80,0\n9,50,90,0,51,80,0\n").unwrap();
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, "inventory = \"trees.csv\"\npath = \"path.csv\"\n").unwrap();
    let scene = laid_out(&SceneFile::open(&scene).unwrap());
    assert_eq!(scene.planted.len(), 400);
    assert!(scene.ground.size_m()[0] > 760.0 && scene.ground.triangles() < 80_000);
    assert_eq!(scene.path.length_s(), 9.0);
    assert_eq!(scene.warnings.iter().map(|w| w.code.as_str()).collect::<Vec<_>>(), ["inventory-centred"]);
    let missing = SceneFile { path: "nowhere.csv".to_owned(), ..Default::default() };
    assert!(lay_out(&missing, &sizes(&missing), &mut |_| {}).unwrap_err().to_string().contains("nowhere.csv"));
}

proptest! {
    #[test]
    fn any_text_is_a_scene_or_an_error(text in "(trees = |\\[terrain\\]\n|\\[\\[species\\]\\]\n|key = )?[\\PC\n=\\[\\]\".0-9]{0,120}") {
        let _ = SceneFile::parse(&text);
    }
}

/// A picture from above, light from the north-west, a dot for each tree in its species' colour: `GROVE_PICTURES=FOLDER`.
#[test]
#[ignore = "writes pictures to look at"]
fn pictures_from_above() {
    let folder = std::env::var("GROVE_PICTURES").expect("the folder to write to");
    for preset in PRESETS {
        let file = super::preset(preset.name).unwrap();
        let begun = std::time::Instant::now();
        let scene = laid_out(&file);
        println!("{}: {} trees in {:?}, path of {} s", preset.name, scene.planted.len(), begun.elapsed(), scene.path.length_s());
        from_above(&scene).save(format!("{folder}/{}.png", preset.name)).unwrap();
    }
}

fn from_above(scene: &Scene) -> image::RgbImage {
    const COLORS: [[u8; 3]; 8] =
        [[40, 90, 40], [120, 150, 50], [70, 130, 110], [160, 120, 40], [30, 60, 70], [150, 70, 90], [90, 160, 60], [60, 60, 120]];
    let [width, depth] = scene.ground.size_m();
    let px_per_m = 1400.0 / width.max(depth);
    let at = |x: f32, z: f32| [((x - scene.ground.west_m) * px_per_m) as i64, ((z - scene.ground.north_m) * px_per_m) as i64];
    let sun = glam::Vec3::new(-1.0, 1.5, -1.0).normalize();
    let mut picture = image::RgbImage::from_fn((width * px_per_m) as u32, (depth * px_per_m) as u32, |i, j| {
        let (x, z) = (scene.ground.west_m + i as f32 / px_per_m, scene.ground.north_m + j as f32 / px_per_m);
        let lit = scene.ground.normal_at(x, z).map_or(0.0, |normal| normal.dot(sun).max(0.0));
        image::Rgb([200.0, 190.0, 150.0].map(|c| (c * lit) as u8))
    });
    let mut dot = |[x, y]: [i64; 2], radius: f32, color: [u8; 3]| {
        let reach = radius.ceil() as i64;
        for (i, j) in (-reach..=reach).flat_map(|j| (-reach..=reach).map(move |i| (i, j))) {
            let (Ok(x), Ok(y)) = (u32::try_from(x + i), u32::try_from(y + j)) else { continue };
            if ((i * i + j * j) as f32) <= radius * radius && x < picture.width() && y < picture.height() {
                picture.put_pixel(x, y, image::Rgb(color));
            }
        }
    };
    for tree in &scene.planted {
        let size = &scene.species[tree.species as usize];
        dot(
            at(tree.position.x, tree.position.z),
            0.5 * size.crown_width_m * tree.scale * px_per_m,
            COLORS[tree.species as usize % 8],
        );
    }
    for step in 0..4000 {
        let eye = scene.path.at(scene.path.length_s() * step as f32 / 4000.0).eye;
        dot(at(eye.x, eye.z), 1.0, [220, 30, 30]);
    }
    picture
}
