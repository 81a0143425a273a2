//! The command line on good and bad input: every message of issue 2's list, what is written and what is not.

use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use image::{GrayImage, Rgb, RgbImage};
use tempfile::TempDir;

const OAK: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/photos/oak.jpg");
const OAK_MASK: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/photos/oak.crown.png");

/// Runs `sphereboard` with `args`.
fn sphereboard<S: AsRef<std::ffi::OsStr>>(args: impl IntoIterator<Item = S>) -> Output {
    Command::cargo_bin("sphereboard").unwrap().args(args).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// A folder with inputs, and an output folder inside it that does not exist yet.
struct Place {
    folder: TempDir,
}

impl Place {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    fn file(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    fn picture(&self, name: &str, width: u32, height: u32, color: impl Fn(u32, u32) -> [u8; 3]) -> PathBuf {
        let path = self.folder.path().join(name);
        RgbImage::from_fn(width, height, |x, y| Rgb(color(x, y))).save(&path).unwrap();
        path
    }

    /// Runs `model` on `photo` with `more` options; expects failure with `code`, one line with every one of `words`, no output, and no
    /// trace of the output folder. Code 1 adds a second line that counts the failures.
    fn refuses(&self, photo: &Path, more: &[&str], code: i32, words: &[&str]) {
        let (photo, out) = (photo.to_str().unwrap(), self.out());
        let output = sphereboard([&["model", photo, "--out", out.to_str().unwrap()], more].concat());
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{message}");
        let lines: Vec<&str> = message.lines().collect();
        for word in words {
            assert!(lines[0].contains(word), "{word:?} is missing in: {message}");
        }
        match code {
            1 => assert_eq!(lines[1..], [format!("1 of 1 failed: {photo}")], "{message}"),
            _ => assert!(lines.len() == 1 && lines[0].starts_with("sphereboard: "), "{message}"),
        }
        assert!(!out.exists(), "nothing is written");
    }
}

#[test]
fn a_photograph_becomes_a_model_and_its_report() {
    let place = Place::new();
    let (out, drawings) = (place.out(), place.folder.path().join("drawings"));
    let output = sphereboard(["model", OAK, "--out", out.to_str().unwrap(), "--json", "--debug-dir", drawings.to_str().unwrap()]);
    assert!(output.status.success(), "{}", stderr(&output));
    // The preview is there where an adapter is.
    assert_eq!(names_in(&out)[..2], ["oak.glb", "oak.json"]);
    assert!(names_in(&drawings).len() >= 6, "{:?}", names_in(&drawings));
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((summary["done"].as_u64(), summary["failed"].as_u64()), (Some(1), Some(0)));
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("oak.json")).unwrap()).unwrap();
    for part in ["parameters", "counts", "stages_ms", "warnings", "seed"] {
        assert!(!report[part].is_null(), "{part} is missing in {report:#}");
    }
    let stages: Vec<&str> = report["stages_ms"].as_array().unwrap().iter().map(|row| row["stage"].as_str().unwrap()).collect();
    assert_eq!(stages, sphereboard::model::pipeline::STAGES);
    let all: f64 = report["stages_ms"].as_array().unwrap().iter().map(|row| row["ms"].as_f64().unwrap()).sum();
    let total = report["total_ms"].as_f64().unwrap();
    assert!((0.9 * total..=total).contains(&all), "the stages take {all} ms of {total} ms");
    assert!(report["warnings"].to_string().contains("height-guessed"), "{report:#}");
    assert!(std::fs::metadata(out.join("oak.glb")).unwrap().len() <= 1_000_000);
}

#[test]
fn same_seed_same_bytes_on_one_thread_or_many() {
    let place = Place::new();
    let glb = |name: &str, more: &[&str]| {
        let out = place.folder.path().join(name);
        let output =
            sphereboard([&["model", OAK, "--detail", "low", "--no-preview", "--out", out.to_str().unwrap()], more].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        std::fs::read(out.join("oak.glb")).unwrap()
    };
    let one = glb("one", &["--threads", "1"]);
    assert!(one == glb("many", &["--threads", "4"]), "the number of threads shows in the bytes");
    assert!(one != glb("other", &["--seed", "2"]), "the seed does not show in the bytes");
}

#[test]
fn segment_writes_masks_of_the_photographs_size() {
    let place = Place::new();
    let out = place.out();
    let output = sphereboard(["segment", OAK, "--out", out.to_str().unwrap(), "--pixels"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(names_in(&out), ["oak.json", "oak.mask.png", "oak.pixels.png", "oak.tree.png"]);
    let photo = image::open(OAK).unwrap();
    for name in ["oak.mask.png", "oak.tree.png"] {
        let mask = image::open(out.join(name)).unwrap().into_luma8();
        assert_eq!(mask.dimensions(), (photo.width(), photo.height()));
        assert!(mask.pixels().all(|p| p.0[0] == 0 || p.0[0] == 255));
    }
}

#[test]
fn many_photographs_and_one_renderer_do_not_wait_for_each_other() {
    let place = Place::new();
    let names = ["oak", "lime", "lime_evening", "birch", "spruce", "juniper"];
    let photos = names.map(|name| OAK.replace("oak", name));
    let out = place.out();
    let mut command = Command::cargo_bin("sphereboard").unwrap();
    command.args(["model", "--detail", "low", "--texture-size", "256", "--threads", "2", "--out"]).arg(&out).args(photos);
    let output = command.timeout(std::time::Duration::from_secs(240)).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(names.iter().all(|name| out.join(format!("{name}.glb")).exists()));
}

#[test]
fn one_failure_does_not_stop_the_others() {
    let place = Place::new();
    let bad = place.file("bad.jpg", b"not a picture");
    let out = place.out();
    let output =
        sphereboard(["model", bad.to_str().unwrap(), OAK, "--detail", "low", "--no-preview", "--out", out.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("1 of 2 failed") && stderr(&output).contains("bad.jpg"), "{}", stderr(&output));
    assert_eq!(names_in(&out), ["oak.glb", "oak.json"]);
}

#[test]
fn files_that_are_no_photographs_are_refused() {
    let place = Place::new();
    let jpeg = std::fs::read(OAK).unwrap();
    place.refuses(&place.file("text.jpg", b"hello"), &[], 1, &["expected a JPEG, PNG, WebP, TIFF or BMP picture", "text"]);
    place.refuses(&place.file("empty.png", b""), &[], 1, &["empty"]);
    place.refuses(&place.file("cut.jpg", &jpeg[..jpeg.len() / 3]), &[], 1, &["cut.jpg", "ends early"]);
    place.refuses(&place.folder.path().join("missing.jpg"), &[], 1, &["missing.jpg"]);
    place.refuses(&place.picture("dot.png", 1, 1, |_, _| [0, 200, 0]), &[], 1, &["1×1"]);
    place.refuses(&place.file("huge.png", &huge_png_header()), &[], 1, &["100000×100000", "--max-megapixels"]);
}

#[test]
fn photographs_without_a_crown_are_refused() {
    let place = Place::new();
    place.refuses(
        &place.picture("sky.png", 320, 240, |_, y| [90 + (y / 4) as u8, 150, 230]),
        &[],
        1,
        &["sky.png", "nothing but sky", "--mask"],
    );
    let bricks =
        place.picture("bricks.png", 320, 240, |x, y| if (x / 16 + y / 8) % 2 == 0 { [150, 60, 40] } else { [170, 80, 60] });
    place.refuses(&bricks, &["--method", "hsv"], 1, &["15°", "orange", "--hue -15..45"]);
    match sphereboard::files::shared_folder() {
        Some(shared) => place.refuses(&shared.join("photos/single/leafless_tree_negative.jpg"), &[], 1, &["leafless"]),
        None => eprintln!("SKIPPED: the leafless tree needs ../shared"),
    }
}

#[test]
fn hints_that_do_not_fit_the_picture_are_refused() {
    let place = Place::new();
    let oak = Path::new(OAK);
    let small = place.folder.path().join("small.png");
    GrayImage::from_pixel(20, 20, image::Luma([255])).save(&small).unwrap();
    place.refuses(oak, &["--mask", small.to_str().unwrap()], 1, &["20×20"]);
    let text = place.file("text.png", b"hello");
    place.refuses(oak, &["--mask", text.to_str().unwrap()], 1, &["oak.jpg", "--mask", "text.png", "holds text"]);
    place.refuses(oak, &["--rect", "5000,0,10,10"], 1, &["--rect"]);
    place.refuses(oak, &["--include", "0,99999"], 1, &["--include"]);
    place.refuses(oak, &["--hue", "150..90"], 2, &["--hue", "150..90"]);
    place.refuses(oak, &["--rect", "1,2,3"], 2, &["--rect"]);
    place.refuses(oak, &["--height-m", "-3"], 2, &["--height-m"]);
    place.refuses(oak, &["--height-m", "tall"], 2, &["--height-m", "tall"]);
    place.refuses(oak, &["--detail", "ultra"], 2, &["--detail", "medium"]);
    place.refuses(oak, &["--texture-size", "500"], 2, &["--texture-size"]);
    place.refuses(oak, &["--no-such-option"], 2, &["--no-such-option"]);
}

#[test]
fn mistakes_in_the_arguments_are_one_sentence() {
    let place = Place::new();
    let oak = Path::new(OAK);
    for (option, value, expected) in [
        ("--include", "-1,5", "X,Y, two whole numbers"),
        ("--exclude", "5", "X,Y, two whole numbers"),
        ("--rect", "-5,0,10,10", "X,Y,W,H, four whole numbers"),
        ("--hue", "340..20", "reds across 0 are -20..20"),
        ("--hue", "green", "LO..HI, two angles in °"),
        ("--seed", "-1", "a whole number from 0 to 18446744073709551615"),
        ("--seed", "1.5", "a whole number from 0"),
        ("--threads", "0", "a whole number from 1 to 1024"),
        ("--threads", "-4", "a whole number from 1 to 1024"),
        ("--disturb", "-0.5", "0 to 3"),
        ("--front-angle-deg", "90", "5 to 80°"),
        ("--height-m", "NaN", "0.05 to 200 m"),
    ] {
        place.refuses(oak, &[option, value], 2, &[option, expected, &format!("but is {value};")]);
    }
    place.refuses(oak, &["--height-m", ""], 2, &["--height-m must be 0.05 to 200 m, but is empty"]);
    place.refuses(oak, &["--seed", "1", "--seed", "2"], 2, &["--seed <N> was given more than once"]);
    place.refuses(oak, &["--seed"], 2, &["--seed <N> needs a value"]);
    place.refuses(oak, &["--json=yes"], 2, &["--json", "takes no value"]);
    place.refuses(oak, &["--detial", "low"], 2, &["--detial", "perhaps --detail"]);
    place.refuses(oak, &["--views", "a.jpg@0"], 2, &["--views", "cannot be used together"]);
    for (args, expected) in [
        (&["model", OAK][..], "--out <DIR> must be given, but is missing; `sphereboard model --help`"),
        (&["model", "--out", "x"], "PHOTO... must be given"),
        (&["segment"], "--out <DIR> and PHOTO... must be given"),
        (&["segment", OAK, OAK, "--out", "x"], "oak.jpg was given twice; give it once"),
        (&["segment", OAK, "--out", OAK], "expected a folder for the results"),
        (&["segment", "", "--out", "x"], "expected the name of a photograph"),
        (&["modle", OAK], "but found modle; write for example"),
    ] {
        let output = sphereboard(args);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains(expected) && message.lines().count() == 1, "{message}");
    }
}

#[test]
fn of_several_views_the_one_at_fault_is_named() {
    let place = Place::new();
    let bad = place.file("bad.jpg", b"not a picture");
    let views = [format!("{OAK}@0"), format!("{}@90", bad.display())];
    let output = sphereboard(["model", "--out", place.out().to_str().unwrap(), "--views", &views[0], &views[1]]);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.starts_with(&format!("{}: expected a JPEG", bad.display())), "{message}");
    let sky = place.picture("sky.png", 320, 240, |_, y| [90 + (y / 4) as u8, 150, 230]);
    let views = [format!("{OAK}@0"), format!("{}@90", sky.display())];
    let output = sphereboard(["model", "--out", place.out().to_str().unwrap(), "--views", &views[0], &views[1]]);
    let message = stderr(&output);
    assert!(message.starts_with(&format!("{}: the picture shows nothing but sky", sky.display())), "{message}");
}

#[test]
fn inputs_are_not_overwritten() {
    let place = Place::new();
    let folder = place.folder.path().to_str().unwrap();
    let photo = place.file("oak.jpg", &std::fs::read(OAK).unwrap());
    let photo = photo.to_str().unwrap();
    let mask_bytes = std::fs::read(OAK_MASK).unwrap();
    let mask = place.file("oak.mask.png", &mask_bytes);
    let drawing = place.file("oak.1-mask.png", &mask_bytes);
    let out = place.out();
    let segment = ["segment", photo, "--mask", mask.to_str().unwrap(), "--out", folder];
    let out = out.to_str().unwrap();
    let model = ["model", photo, "--detail", "low", "--mask", drawing.to_str().unwrap(), "--out", out, "--debug-dir", folder];
    for (args, code, input) in [(&segment[..], 2, &mask), (&model, 1, &drawing)] {
        let output = sphereboard(args);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{message}");
        assert!(message.contains("would be overwritten") && message.contains(input.to_str().unwrap()), "{message}");
    }
    assert_eq!(names_in(place.folder.path()), ["oak.1-mask.png", "oak.jpg", "oak.mask.png"]);
    assert!(std::fs::read(mask).unwrap() == mask_bytes && std::fs::read(drawing).unwrap() == mask_bytes);
}

#[cfg(unix)]
#[test]
fn file_names_need_not_be_unicode() {
    use std::os::unix::ffi::OsStrExt;
    let place = Place::new();
    let photo = place.folder.path().join(std::ffi::OsStr::from_bytes(b"oak\xff.jpg"));
    if std::fs::copy(OAK, &photo).is_err() {
        eprintln!("SKIPPED: this file system takes only Unicode names");
        return;
    }
    for command in ["model", "segment"] {
        let out = place.out();
        let args = [command.as_ref(), photo.as_os_str(), "--json".as_ref(), "--out".as_ref(), out.as_os_str()];
        let output = sphereboard(args);
        assert!(output.status.success(), "{}", stderr(&output));
        let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(summary["photos"][0]["stem"], "oak\u{fffd}");
    }
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_is_no_failure() {
    let place = Place::new();
    for more in [&["--json"][..], &[]] {
        let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin!("sphereboard"))
            .args(["segment", OAK, "--out", place.out().to_str().unwrap()])
            .args(more)
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        assert!(!stderr(&output).contains("panicked"), "{}", stderr(&output));
    }
}

#[test]
fn a_mask_drawn_by_hand_replaces_the_segmentation() {
    let place = Place::new();
    let out = place.out();
    let output = sphereboard(["segment", OAK, "--mask", OAK_MASK, "--out", out.to_str().unwrap()]);
    assert!(output.status.success(), "{}", stderr(&output));
    let mask = |path: &Path| sphereboard::raster::Mask::from_gray(&image::open(path).unwrap().into_luma8());
    // A crown is of one piece: leaves that hang by themselves in the photograph are not part of it.
    assert!(mask(&out.join("oak.mask.png")).iou(&mask(Path::new(OAK_MASK)).largest_piece()) > 0.97);
}

#[test]
fn a_point_inside_the_crown_can_be_taken_out() {
    let place = Place::new();
    let out = place.out();
    let inside = |more: &[&str]| {
        let output = sphereboard([&["segment", OAK, "--out", out.to_str().unwrap()], more].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let mask = image::open(out.join("oak.mask.png")).unwrap().into_luma8();
        (mask.get_pixel(470, 580).0[0] == 255, std::fs::read_to_string(out.join("oak.json")).unwrap())
    };
    assert!(inside(&[]).0);
    assert!(!inside(&["--exclude", "470,580"]).0);
    let (_, report) = inside(&["--include", "20,1280"]);
    assert!(report.contains("hint-not-met"), "{report}");
}

#[test]
fn masks_go_to_their_photographs_in_order() {
    let place = Place::new();
    let out = place.out();
    let spruce = OAK.replace("oak", "spruce");
    let spruce_mask = OAK_MASK.replace("oak", "spruce");
    let run = |masks: &[&str]| {
        let masks = masks.iter().flat_map(|mask| ["--mask", mask]);
        sphereboard(["segment", OAK, &spruce, "--out", out.to_str().unwrap()].into_iter().chain(masks))
    };
    assert!(run(&[OAK_MASK, &spruce_mask]).status.success());
    let mask = |path: &Path| sphereboard::raster::Mask::from_gray(&image::open(path).unwrap().into_luma8());
    assert!(mask(&out.join("spruce.mask.png")).iou(&mask(Path::new(&spruce_mask))) > 0.97);
    let refused = run(&[OAK_MASK]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        stderr(&refused).contains("1 mask was given for 2 photographs; give --mask once per photograph"),
        "{}",
        stderr(&refused)
    );
}

#[test]
fn two_views_of_one_tree_become_one_model() {
    let place = Place::new();
    let out = place.out();
    let views = [format!("{OAK}@0"), format!("{}@90", OAK.replace("oak", "spruce"))];
    let output =
        sphereboard(["model", "--detail", "low", "--no-preview", "--out", out.to_str().unwrap(), "--views", &views[0], &views[1]]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(names_in(&out), ["oak.glb", "oak.json"]);
    for wrong in ["oak.jpg", "oak.jpg@", "@90", "oak.jpg@999"] {
        let output = sphereboard(["model", "--out", out.to_str().unwrap(), "--views", wrong]);
        assert_eq!(output.status.code(), Some(2), "{wrong}");
        assert!(stderr(&output).contains("--views must be PHOTO@DEG"), "{}", stderr(&output));
    }
}

#[test]
fn a_crown_cut_by_the_frame_is_modelled_with_a_warning() {
    let place = Place::new();
    let oak = image::open(OAK).unwrap().into_rgb8();
    let cut = place.folder.path().join("cut.png");
    image::imageops::crop_imm(&oak, oak.width() / 2 - 20, 0, oak.width() / 2, oak.height()).to_image().save(&cut).unwrap();
    let out = place.out();
    let output = sphereboard(["model", cut.to_str().unwrap(), "--detail", "low", "--out", out.to_str().unwrap()]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(std::fs::read_to_string(out.join("cut.json")).unwrap().contains("crown-cut-by-frame"));
}

#[test]
fn equal_stems_are_refused_before_any_work() {
    let place = Place::new();
    let other = place.file("oak.png", b"");
    let out = place.out();
    let output = sphereboard(["model", OAK, other.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("oak.*"), "{}", stderr(&output));
    assert!(!out.exists());
}

#[test]
fn output_that_cannot_be_written_is_said_before_any_work() {
    let place = Place::new();
    let file = place.file("file", b"");
    let output = sphereboard(["model", OAK, "--out", file.join("below").to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("cannot write"), "{}", stderr(&output));
}

/// A full disk, made as a tiny file system of our own where the system lets us.
#[test]
fn a_full_disk_leaves_nothing_behind() {
    let place = Place::new();
    let out = place.folder.path().join("disk");
    std::fs::create_dir(&out).unwrap();
    let script = format!(
        "mount -t tmpfs -o size=64k tmpfs {0} && {{ {1} model {2} --detail low --out {0}; echo code $?; ls -A {0}; }}",
        out.display(),
        assert_cmd::cargo::cargo_bin!("sphereboard").display(),
        OAK,
    );
    let output = std::process::Command::new("unshare").args(["--user", "--map-root-user", "--mount", "sh", "-c", &script]).output();
    let Some(output) = output.ok().filter(|o| String::from_utf8_lossy(&o.stdout).contains("code")) else {
        eprintln!("SKIPPED: a full disk needs `unshare` and the right to mount a tmpfs");
        return;
    };
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "code 1", "{}", stderr(&output));
    assert!(stderr(&output).contains("cannot write") && stderr(&output).contains("free space"), "{}", stderr(&output));
}

/// Watches both files through a whole run: each is the old one or the new one at every moment. (`files::tests` stops a run between
/// staging and renaming, where no clock hits.)
#[test]
fn every_look_during_a_run_finds_the_old_file_or_the_new_one() {
    let place = Place::new();
    let out = place.out();
    let args = ["model", OAK, "--detail", "low", "--texture-size", "64", "--out", out.to_str().unwrap()];
    assert!(sphereboard(args).status.success());
    let new = std::fs::read(out.join("oak.glb")).unwrap();
    let whole_json =
        |bytes: &[u8]| serde_json::from_slice::<serde_json::Value>(bytes).is_ok_and(|report| report["counts"].is_object());
    let old = b"\"old\"";
    let names = ["oak.glb", "oak.json"];
    for name in names {
        std::fs::write(out.join(name), old).unwrap();
        // A second name of the old file: written over in place, it would change too.
        std::fs::hard_link(out.join(name), place.folder.path().join(name)).unwrap();
    }
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin!("sphereboard"))
        .args(args)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let mut running = true;
    while running {
        // One more look after the end.
        running = child.try_wait().unwrap().is_none();
        let [glb, json] = names.map(|name| std::fs::read(out.join(name)).unwrap());
        assert!(glb == old || glb == new, "the model has {} bytes", glb.len());
        assert!(json == old || whole_json(&json), "the report has {} bytes", json.len());
        assert!(running || glb == new && json != old);
    }
    assert!(child.wait().unwrap().success());
    assert!(names.iter().all(|name| std::fs::read(place.folder.path().join(name)).unwrap() == old), "written over in place");
}

/// A killed run leaves the old files, and what it staged is swept by a later run.
#[cfg(unix)]
#[test]
fn a_killed_run_leaves_the_old_files() {
    let place = Place::new();
    let out = place.out();
    std::fs::create_dir(&out).unwrap();
    for name in ["oak.glb", "oak.json", ".sphereboard-left.part"] {
        std::fs::write(out.join(name), b"old").unwrap();
    }
    let left = std::fs::File::options().write(true).open(out.join(".sphereboard-left.part")).unwrap();
    left.set_modified(std::time::SystemTime::now() - std::time::Duration::from_secs(7200)).unwrap();
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin!("sphereboard"))
        .args(["model", OAK, "--out", out.to_str().unwrap()])
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    while out.join(".sphereboard-left.part").exists() {
        assert!(child.try_wait().unwrap().is_none(), "the run has ended and swept nothing");
    }
    child.kill().unwrap();
    // The kill may lose the race against a fast run, but not against the sweep, which comes before any work.
    if !child.wait().unwrap().success() {
        assert_eq!(["oak.glb", "oak.json"].map(|name| std::fs::read(out.join(name)).unwrap()), [b"old", b"old"]);
    }
}

/// The head of a PNG that claims 100,000 × 100,000 pixels: signature, IHDR with its checksum, and nothing else.
fn huge_png_header() -> Vec<u8> {
    let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
    bytes.extend(100_000u32.to_be_bytes());
    bytes.extend(100_000u32.to_be_bytes());
    bytes.extend([8, 2, 0, 0, 0]);
    let crc = bytes[12..].iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 })
    });
    bytes.extend((!crc).to_be_bytes());
    bytes
}
