use super::super::culling::Chosen;
use super::*;
use crate::grove::against::{Against, Compared};
use crate::grove::record::{OfSpecies, Started};
use crate::render::Counted;

fn frame(number: usize) -> Frame {
    Frame {
        time_s: 0.5 * number as f32,
        ms: 10.0 + number as f64,
        cpu_ms: 0.5,
        // A first frame may leave out what later ones have, and one may have what nobody knows.
        passes: if number == 0 { vec![("trees", 3.0)] } else { vec![("shadow map", 2.0), ("trees", 4.0), ("sparks", 0.25)] },
        counted: Counted { draws: 7, triangles: 12_345 },
        trees: 20,
        near: 3,
        shown: vec![vec![5, 6], vec![7, 2]],
        uploaded_bytes: 96,
    }
}

fn drive(title: &str, frames: usize) -> Drive {
    let species = |name: &str, far: &str| OfSpecies {
        name: name.to_owned(),
        height_m: 9.5,
        trees: 1000,
        levels: vec!["near".to_owned(), far.to_owned()],
    };
    let summary = Summary {
        program: "sphereboard 0".to_owned(),
        commit: "unknown",
        adapter: "none".to_owned(),
        command: "sphereboard grove --out x".to_owned(),
        broken_off: None,
        title: title.to_owned(),
        method: "billboard".to_owned(),
        seed: 7,
        size_px: [64, 48],
        trees: 2000,
        ground_triangles: 8,
        bytes_per_tree: 20.0,
        memory_mb: None,
        culling: Chosen { cpu_ms: Some(1.25), compute_ms: Some(7.5), ..Chosen::default() },
        started: Started::default(),
        path_s: 60.0,
        frames,
        median_ms: 12.0,
        p99_ms: 14.0,
        fps: 83.3,
        cpu_ms: 0.5,
        passes_ms: [("shadow map", 2.0), ("trees", 4.0), ("other", 0.25)].map(|(name, ms)| (name.to_owned(), ms, ms)).into(),
        trees_seen: 20.0,
        trees_near: 3.0,
        triangles: 12_345.0,
        most_draws: 7,
        uploaded_bytes: 96,
        species: vec![species("oak", "far"), species("<birch>", "flat")],
        against: Some(Against {
            method: "geometry".to_owned(),
            median_ms: 30.0,
            fps: 33.3,
            triangles: 98_765.0,
            gain: 2.5,
            saved: 8.0,
            flip: Some(0.0432),
            pictures: vec![Compared { frame: 1, flip: 0.0432, file: "frames/frame_00001_geometry.png".to_owned() }],
        }),
        parameters: json!({ "terrain": TerrainParams::default(), "planting": PlantingParams::default(), "camera": CameraParams::default(),
            "stage": StageParams { wind_m_s: 3.0, ..StageParams::default() }, "culling": CullParams::default(), "levels": FollowParams::default() }),
    };
    Drive { summary, frames: (0..frames).map(frame).collect() }
}

fn written(drive: &Drive) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let pictures = [Picture { file: "frames/frame_00001.png".to_owned(), frame: 1 }];
    let video = Video { file: "drive.webp".to_owned(), frames: 4, times: 2.5 };
    let page = write(folder.path(), drive, &pictures, Some(&video)).unwrap();
    let html = std::fs::read_to_string(page).unwrap();
    (folder, html)
}

#[test]
fn the_page_holds_plots_figures_and_parameters_and_fetches_nothing() {
    let (folder, html) = written(&drive("Two species", 12));
    // Slashes are escaped.
    for words in [
        "83.3",
        "2,000",
        "sphereboard grove --out x",
        "unknown",
        "frame_00001.png",
        "frame_00001_geometry.png",
        "2.50",
        "8.00",
        "0.0432",
        "drive.webp",
        "the processor culls: 1.25 ms a frame by the processor, 7.50 ms by the device",
        "<td class=\"text good\">3 m&#x2f;s</td>",
    ] {
        assert!(html.contains(words), "{words}");
    }
    for address in ["http:", "https:", "src=\"//", "@import", "fetch("] {
        assert!(!html.contains(address), "{address}");
    }
    for name in ["frame-time", "levels", "triangles", "draws"] {
        let svg = std::fs::read_to_string(folder.path().join(format!("plots/{name}.svg"))).unwrap();
        assert!(roxmltree::Document::parse(&svg).is_ok() && html.contains(&format!("id=\"{name}\"")), "{name}");
    }
    let table = TerrainParams::specs().len() + StageParams::specs().len() + CullParams::specs().len();
    assert!(html.matches("class=\"text meaning\"").count() > table);
    // A title or a species cannot leave its place.
    let (_, html) = written(&drive("</title><script>alert(1)", 3));
    assert!(!html.contains("<script>alert") && !html.contains("<birch>"));
}

#[test]
fn levels_of_one_name_count_together_and_odd_passes_are_told() {
    let drive = drive("", 12);
    let names = level_names(&drive.summary);
    assert_eq!(names, ["near", "far", "flat"]);
    let moments = moments(&drive, &names);
    assert_eq!(moments[3].levels, [12.0, 6.0, 2.0]);
    let of = |name: &str| PASSES.iter().position(|pass| *pass == name).unwrap();
    assert_eq!((moments[0].passes_ms[of("shadow map")], moments[0].passes_ms[of("trees")]), (0.0, 3.0));
    assert_eq!((moments[1].passes_ms[of("shadow map")], moments[1].passes_ms[of("other")]), (2.0, 0.25));
}

#[test]
fn long_drives_are_thinned_and_short_ones_stand() {
    let names = level_names(&drive("", 1).summary);
    for frames in [0, 1, 2, MOST_MOMENTS, MOST_MOMENTS + 1, 5000] {
        let drive = drive("", frames);
        let found = moments(&drive, &names);
        assert!(found.len() <= MOST_MOMENTS && (found.len() > MOST_MOMENTS / 2 || found.len() == frames), "{frames}");
        written(&drive);
    }
}
