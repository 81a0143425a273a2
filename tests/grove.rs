//! `sphereboard grove` on good and bad input: what is refused and how, what stands after it, that the same seed drives the same way, that
//! what nobody sees costs nothing, and that a drive whose device is lost keeps what it has.

mod common;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use common::{software_gpu, software_renderer};
use sphereboard::Error;
use sphereboard::grove::culling::Chosen;
use sphereboard::grove::drive::{self, Grove};
use sphereboard::grove::record::{Recorder, Setting, Started};
use sphereboard::grove::scene::SpeciesEntry;
use sphereboard::grove::{SceneFile, lay_out, page, stock};
use sphereboard::repr::SoftwareCapture;
use tempfile::TempDir;

const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/oak.glb");

fn sphereboard(args: &[&str]) -> Output {
    Command::new(assert_cmd::cargo::cargo_bin!("sphereboard")).args(args).output().unwrap()
}

/// A small drive past billboards of a small tree on the software driver; what `more` says again counts.
fn args<'a>(out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let mut all = vec!["grove", "--out", out, "--adapter", "software"];
    // Who culls faster is another matter from run to run.
    let usual = [["--species", MODEL], ["--method", "billboard"], ["--size", "96x64"], ["--frames", "4"], ["--pictures", "1"]];
    let usual = usual.into_iter().chain([["--culling", "cpu"]]).collect::<Vec<_>>();
    all.extend(usual.iter().filter(|[flag, _]| !more.contains(flag)).flatten());
    all.extend(more);
    all
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A place to work in.
struct Place(TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap())
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().to_owned()
    }

    fn file(&self, name: &str, text: &str) -> String {
        std::fs::write(self.path(name), text).unwrap();
        self.path(name)
    }

    /// Drives to the folder `out`; gives what was said.
    fn drives(&self, out: &str, more: &[&str]) -> String {
        let out = self.path(out);
        let output = sphereboard(&args(&out, more));
        assert!(output.status.success(), "{more:?}: {}", told(&output));
        told(&output)
    }

    /// The drive's columns whose names pass, line by line.
    fn columns(&self, out: &str, wanted: impl Fn(&str) -> bool) -> Vec<Vec<String>> {
        let mut reader = csv::Reader::from_path(Path::new(&self.path(out)).join("frames.csv")).unwrap();
        let header = reader.headers().unwrap().clone();
        let line = |line: csv::StringRecord| {
            header.iter().zip(&line).filter(|(name, _)| wanted(name)).map(|(_, value)| value.to_owned()).collect()
        };
        reader.records().map(|record| line(record.unwrap())).collect()
    }
}

#[test]
fn mistakes_are_one_sentence_and_nothing_is_written() {
    let place = Place::new();
    let (out, file) = (place.path("out"), place.file("file", "no folder"));
    let damaged = place.file("damaged.glb", "glTF\u{2}\0\0\0and then nothing of the kind");
    let scene = place.file("scene.toml", "title = \"a\"\ntres = 7\n");
    let range = place.file("range.toml", "[planting]\nclearings = 2.0\n");
    let path = place.file("path.csv", "0,0,2,0,0,2,-9\n0,1,2,0,0,2,-9\n");
    let (inside, missing) = (format!("{file}/out"), place.path("missing.glb"));
    let refused: [(&str, &[&str], &[&str]); 18] = [
        (&out, &["--trees", "1000000000"], &["1000000000", "GB"]),
        (&out, &["--species", &missing], &["missing.glb"]),
        (&out, &["--species", &damaged], &["damaged.glb"]),
        (&out, &["--species", ""], &["--species"]),
        (&out, &["--method", "hologram"], &["hologram", "sphere-board"]),
        (&out, &["--preset", "sherwood"], &["sherwood", "she-540"]),
        (&out, &["--size", "0x0"], &["0x0"]),
        (&out, &["--size", "96"], &["96", "1440x810"]),
        (&out, &["--frames", "0"], &["frames", "0"]),
        (&out, &["--against", "hologram"], &["hologram", "sphere-board"]),
        (&out, &["--set", "size=3"], &["size", "texture_px"]),
        (&out, &["--set", "texture_px=3"], &["texture_px", "power of two"]),
        (&out, &["--method", "auto", "--set", "texture_px=64"], &["--set", "--method"]),
        (&out, &["--path", &path], &["path.csv", "line 2"]),
        (&out, &["--path", &missing], &["missing.glb"]),
        (&file, &[], &["file"]),
        (&inside, &[], &["file"]),
        (&out, &[&scene], &["line 2", "tres", "grove --help"]),
    ];
    let also: [(&str, &[&str], &[&str]); 1] = [(&out, &[&range], &["clearings"])];
    for (out, more, words) in refused.into_iter().chain(also) {
        let output = sphereboard(&args(out, more));
        let said = told(&output);
        let last = said.lines().last().unwrap_or_default();
        assert_eq!(output.status.code(), Some(2), "{more:?}: {said}");
        assert!(words.iter().all(|word| last.contains(word)), "{more:?}: expected {words:?} in {said:?}");
        assert!(!said.contains("panicked"), "{said}");
    }
    assert!(!Path::new(&out).exists());
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "no folder");
}

#[test]
fn none_one_and_odd_trees_are_driven_past() {
    if software_gpu().is_none() {
        return;
    }
    let place = Place::new();
    for trees in ["0", "1"] {
        place.drives(trees, &["--trees", trees, "--frames", if trees == "0" { "1" } else { "4" }]);
        let summary = std::fs::read_to_string(Path::new(&place.path(trees)).join("summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
        assert_eq!(summary["trees"].to_string(), trees);
        assert!(Path::new(&place.path(trees)).join("report.html").exists());
    }
    // Two hundred that stand, one that is no number, one on another continent.
    let mut rows = "x,y,height\n".to_owned();
    (0..200).for_each(|i| rows += &format!("{},{},9\n", i % 20 * 6 - 60, i / 20 * 6 - 30));
    rows += "NaN,3,9\n9000000,3,9\n";
    place.file("trees.csv", &rows);
    let scene = place.file("scene.toml", "inventory = \"trees.csv\"\nframes = 2\n");
    let said = place.drives("list", &[&scene]);
    assert!(said.contains("202") && said.contains("off the ground") || said.contains("ground"), "{said}");
    let seen = place.columns("list", |name| name == "trees");
    assert!(seen.iter().all(|line| line[0].parse::<usize>().unwrap() <= 200), "{seen:?}");
}

#[test]
fn the_same_seed_drives_the_same_way() {
    if software_gpu().is_none() {
        return;
    }
    let place = Place::new();
    for out in ["a", "b"] {
        place.drives(out, &["--trees", "150", "--video"]);
    }
    let steady = |name: &str| !name.ends_with("ms");
    let first = place.columns("a", steady);
    assert!(first.len() == 4 && first[0].len() > 6, "{first:?}");
    assert_eq!(first, place.columns("b", steady));
    let picture = |out: &str| std::fs::read(Path::new(&place.path(out)).join("frames/frame_00002.png")).unwrap();
    assert!(picture("a") == picture("b"), "the pictures differ");
    // The device sees what the processor does; left alone, whoever is faster culls, and both are told.
    let said = [("c", "compute"), ("d", "auto")].map(|(out, culling)| {
        place.drives(out, &["--trees", "150", "--culling", culling]);
        assert!(picture(out) == picture("a"), "{culling}");
        let shown = |name: &str| ["trees", "near", "triangles"].contains(&name) || name.contains(": ");
        assert_eq!(place.columns(out, shown), place.columns("a", shown), "{culling}");
        let summary = std::fs::read_to_string(Path::new(&place.path(out)).join("summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
        assert!(["cpu_ms", "compute_ms"].iter().all(|ms| summary["culling"][ms].as_f64().unwrap() > 0.0), "{summary}");
        assert_eq!([&summary["culling"]["asked"], &summary["parameters"]["culling"]["culling"]], [culling; 2]);
        summary["culling"].clone()
    });
    assert_eq!(said[0]["by"], "compute");
    let faster = said[1]["compute_ms"].as_f64() < said[1]["cpu_ms"].as_f64();
    assert_eq!(said[1]["by"], if faster { "compute" } else { "cpu" });
    let left = |out: &str| {
        let files = std::fs::read_dir(place.path(out)).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        files.collect::<std::collections::BTreeSet<_>>()
    };
    let all = ["drive.webp", "frames", "frames.csv", "plots", "report.html", "summary.json"];
    assert_eq!(left("a"), all.map(str::to_owned).into());
}

#[test]
fn a_drive_is_held_against_another_method() {
    if software_gpu().is_none() {
        return;
    }
    let place = Place::new();
    place.drives("out", &["--trees", "40", "--pictures", "2", "--against", "crossed-planes", "--set", "texture_px=64"]);
    let summary = std::fs::read_to_string(Path::new(&place.path("out")).join("summary.json")).unwrap();
    let against = serde_json::from_str::<serde_json::Value>(&summary).unwrap()["against"].clone();
    assert_eq!((against["method"].as_str(), against["saved"].as_f64()), (Some("crossed-planes"), Some(2.0)), "{against}");
    let flip = against["flip"].as_f64().unwrap();
    assert!(flip > 0.01 && flip < 0.6 && against["gain"].as_f64().unwrap() > 0.0, "{against}");
    let pictures = against["pictures"].as_array().unwrap();
    assert!(
        pictures.len() == 2
            && pictures.iter().all(|one| Path::new(&place.path("out")).join(one["file"].as_str().unwrap()).exists())
    );
    let page = std::fs::read_to_string(Path::new(&place.path("out")).join("report.html")).unwrap();
    assert!(page.contains("Beside crossed-planes") && page.contains("_crossed-planes.png"));
    // Against itself nothing is gained and nothing seen; without pictures nothing is said of what is seen.
    place.drives("same", &["--trees", "5", "--against", "billboard"]);
    place.drives("blind", &["--trees", "5", "--against", "billboard", "--pictures", "0"]);
    let against = |out: &str| {
        let summary = std::fs::read_to_string(Path::new(&place.path(out)).join("summary.json")).unwrap();
        serde_json::from_str::<serde_json::Value>(&summary).unwrap()["against"].clone()
    };
    assert_eq!((against("same")["saved"].as_f64(), against("same")["flip"].as_f64()), (Some(1.0), Some(0.0)));
    assert!(against("blind")["flip"].is_null());
}

/// Rows of trees before a camera that looks north, and `behind` as many again far behind it.
fn scene_with(place: &Place, behind: i32, keys: &str) -> String {
    let mut rows = "x,y,height\n".to_owned();
    // Northings grow to the north.
    (0..60).for_each(|i| rows += &format!("{},{},9\n", i % 12 * 8 - 44, 25 + i / 12 * 8));
    (0..60 * behind).for_each(|i| rows += &format!("{},{},9\n", i % 12 * 8 - 44, -700 - i / 12 * 8));
    place.file(&format!("trees{behind}.csv"), &rows);
    let ground = "[terrain]\nground_width_m = 2000.0\nground_depth_m = 2000.0\nground_step_m = 40.0\nrelief_m = 0.0\n";
    place.file(&format!("behind{behind}.toml"), &format!("inventory = \"trees{behind}.csv\"\n{ground}{keys}"))
}

#[test]
fn what_stands_behind_the_viewer_costs_nothing() {
    if software_gpu().is_none() {
        return;
    }
    for culling in ["cpu", "compute"] {
        behind_costs_nothing(culling);
    }
}

fn behind_costs_nothing(culling: &str) {
    let place = Place::new();
    let keys = "[[key]]\ntime_s = 0.0\neye = [-5.0, 4.0, 0.0]\ntarget = [-5.0, 4.0, -50.0]\n\
                [[key]]\ntime_s = 9.0\neye = [9.0, 4.0, -4.0]\ntarget = [9.0, 4.0, -50.0]\n";
    for behind in [0, 1, 2] {
        let scene = scene_with(&place, behind, keys);
        place.drives(&format!("out{behind}"), &[&scene, "--frames", "5", "--culling", culling]);
    }
    let cost = |name: &str| ["triangles", "draws", "trees", "near", "uploaded_bytes"].contains(&name) || name.contains(": ");
    let alone = place.columns("out0", cost);
    let number = |text: &String| text.parse::<u64>().unwrap();
    assert!(alone.iter().all(|line| number(&line[2]) > 30) && alone.iter().any(|line| number(&line[4]) > 0), "{alone:?}");
    assert_eq!(alone, place.columns("out1", cost));
    assert_eq!(alone, place.columns("out2", cost));
}

#[test]
fn a_still_camera_sends_nothing() {
    if software_gpu().is_none() {
        return;
    }
    let place = Place::new();
    let scene = scene_with(&place, 0, "[[key]]\ntime_s = 0.0\neye = [-5.0, 4.0, 0.0]\ntarget = [-5.0, 4.0, -50.0]\n");
    for culling in ["cpu", "compute"] {
        place.drives(culling, &[&scene, "--method", "sphere-board", "--culling", culling]);
        assert_eq!(place.columns(culling, |name| name == "uploaded_bytes"), vec![vec!["0"]; 4]);
        assert!(place.columns(culling, |name| name == "trees").iter().all(|line| line[0].parse::<usize>().unwrap() > 30));
    }
}

#[test]
fn a_drive_whose_device_is_lost_keeps_its_frames() {
    let Some(mut renderer) = software_renderer() else { return };
    let folder = Place::new();
    let file = SceneFile {
        species: vec![SpeciesEntry::new(MODEL)],
        method: "billboard".to_owned(),
        size_px: [64, 48],
        trees: 30,
        frames: 20,
        ..SceneFile::default()
    };
    let stock = stock::stock(&file.species, file.method.as_str(), &SoftwareCapture::new(), &|_| ()).unwrap();
    let sizes: Vec<_> = stock.iter().map(|stock| stock.size.clone()).collect();
    let scene = lay_out(&file, &sizes, &mut |_| ()).unwrap();
    let mut grove = Grove::plant(&renderer, &scene, &stock).unwrap();
    let setting =
        Setting { adapter: "a".to_owned(), command: "c".to_owned(), culling: Chosen::default(), started: Started::default() };
    let out = PathBuf::from(folder.path(""));
    let mut recorder = Recorder::new(&out, &scene, &grove, &setting).unwrap();
    let device = renderer.gpu.device.clone();
    let driven = drive::drive(&mut renderer, &mut grove, &scene, &mut |number, frame| {
        recorder.keep(&frame).unwrap();
        // Each line is there at once, for whoever kills the program.
        assert_eq!(std::fs::read_to_string(out.join("frames.csv.part")).unwrap().lines().count(), number as usize + 2);
        if number == 6 {
            device.destroy();
        }
        true
    });
    assert!(matches!(driven, Err(Error::Device { .. })), "{driven:?}");
    let drive = recorder.finish(&grove, Some("the device was lost".to_owned())).unwrap();
    let page = page::write(&out, &drive, &[], None).unwrap();
    assert_eq!(std::fs::read_to_string(out.join("frames.csv")).unwrap().lines().count(), 1 + 7);
    assert!(std::fs::read_to_string(page).unwrap().contains("broken off after 7 frames"));
    assert!(!out.join("frames.csv.part").exists());
}
