//! `sphereboard compare` on good and bad input: what is refused and how, runs that are killed and go on, the chain that it recommends,
//! photographs.

mod common;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use common::software_gpu;
use serde_json::Value;
use tempfile::TempDir;

const PHOTO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/photos/oak.jpg");
const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/oak.glb");

fn sphereboard(args: &[&str]) -> Output {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("sphereboard"));
    command.args(args).output().unwrap()
}

/// A comparison of few small pictures on the software driver.
fn args<'a>(source: &'a str, out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["compare", source, "--out", out, "--size-px", "64", "--adapter", "software"], more].concat()
}

/// Expects a refusal with all `words` in one line.
fn refuses(args: &[&str], words: &[&str]) {
    let output = sphereboard(args);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
    let last = message.lines().last().unwrap_or_default();
    assert!(words.iter().all(|word| last.contains(word)), "{args:?}: expected {words:?} in {message:?}");
    assert!(!message.contains("panicked"), "{message}");
}

fn succeeds(args: &[&str]) -> Output {
    let output = sphereboard(args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

fn report(folder: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join("report.json")).unwrap()).unwrap()
}

/// A folder with a true tree, whose file it is, and a place for results.
fn place() -> (TempDir, PathBuf, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let grown = folder.path().join("birch.glb");
    succeeds(&["grow", "birch", "--age", "8", "--out", grown.to_str().unwrap()]);
    let out = folder.path().join("out");
    (folder, grown, out)
}

#[test]
fn mistakes_are_one_sentence_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(path("views.txt"), "0 0\n# top\n10 north\n").unwrap();
    std::fs::write(path("file"), "").unwrap();
    let out = path("out");
    let (views, below_file) = (path("views.txt"), path("file/out"));
    for (source, out, more, words) in [
        (MODEL, &out, &["--methods", "billboard,cardboard"][..], &["cardboard", "sphere-board"][..]),
        (MODEL, &out, &["--views", &views], &["views.txt", "line 3", "10 north"]),
        (MODEL, &out, &["--views", "/nowhere/views.txt"], &["/nowhere/views.txt"]),
        (MODEL, &out, &["--size-px", "8"], &["size-px", "32", "1024"]),
        (MODEL, &out, &["--size-px", "NaN"], &["size-px", "NaN"]),
        (MODEL, &out, &["--max-flip", "nan"], &["max-flip", "nan"]),
        (MODEL, &out, &["--max-flip", "-1"], &["max-flip", "-1"]),
        (MODEL, &out, &["--cost", "money"], &["cost", "money", "triangles"]),
        (MODEL, &out, &["--profile", "long"], &["profile", "long", "quick"]),
        (MODEL, &out, &["--texture-budget-mb", "0"], &["texture-budget-mb", "0"]),
        (MODEL, &out, &["--chain", "chain.obj"], &["--chain", "*.glb"]),
        (MODEL, &out, &["--chain", MODEL], &["oak.glb"]),
        ("yggdrasil", &out, &[], &["yggdrasil", "oak"]),
        (MODEL, &below_file, &[], &["file/out"]),
    ] {
        let all: Vec<&str> = if more.contains(&"--size-px") {
            [&["compare", source, "--out", out.as_str(), "--adapter", "software"], more].concat()
        } else {
            args(source, out, more)
        };
        refuses(&all, words);
        assert!(!Path::new(out).join("report.html").exists());
    }
    refuses(&["compare", MODEL, PHOTO, "--out", &out, "--chain", &path("c.glb")], &["2 sources", "--chain"]);
}

#[test]
fn a_tree_without_leaves_has_a_report_too() {
    if software_gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (pole, out) = (folder.path().join("pole.obj"), folder.path().join("out"));
    let corners = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0 9 0\n";
    std::fs::write(&pole, format!("{corners}f 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n")).unwrap();
    succeeds(&args(pole.to_str().unwrap(), out.to_str().unwrap(), &[]));
    let found = report(&out);
    let methods = found["methods"].as_array().unwrap();
    assert!(methods.iter().any(|run| run["method"] == "billboard" && run["refused"].is_null()));
    // What builds leaves only says so in its own row.
    for run in methods.iter().filter(|run| !run["refused"].is_null()) {
        assert!(run["refused"].as_str().unwrap().len() > 20, "{run}");
    }
}

#[test]
fn killed_twice_a_run_goes_on_and_finds_what_an_undisturbed_one_finds() {
    if software_gpu().is_none() {
        return;
    }
    let (folder, grown, out) = place();
    let (grown, out) = (grown.to_str().unwrap(), out.to_str().unwrap());
    let more = ["--methods", "billboard,crossed-planes,slices"];
    let lines = || std::fs::read_to_string(Path::new(out).join("finished.jsonl")).map_or(0, |text| text.lines().count());
    for finished in [1, 2] {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("sphereboard"));
        let mut child = command.args(args(grown, out, &more)).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        while lines() < finished && child.try_wait().unwrap().is_none() {
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        child.kill().unwrap(); // SIGKILL
        child.wait().unwrap();
        assert!(lines() >= finished);
    }
    succeeds(&args(grown, out, &more));
    let undisturbed = folder.path().join("undisturbed");
    succeeds(&args(grown, undisturbed.to_str().unwrap(), &more));
    let cells = |folder: &Path| std::fs::read_to_string(folder.join("cells.csv")).unwrap();
    assert_eq!(cells(Path::new(out)), cells(&undisturbed));
    // Another seed is another comparison.
    let other = [&more[..], &["--seed", "2"]].concat();
    refuses(&args(grown, out, &other), &["another comparison", "--anew"]);
    succeeds(&args(grown, out, &[&other[..], &["--anew"]].concat()));
    assert_eq!(report(Path::new(out))["identity"]["seed"], 2);
    // So is another version's.
    let known = Path::new(out).join("identity.json");
    let text = std::fs::read_to_string(&known).unwrap().replace("sphereboard ", "sphereboard 99.");
    std::fs::write(&known, text).unwrap();
    refuses(&args(grown, out, &other), &["another comparison", "--anew"]);
}

#[test]
fn the_chain_is_written_as_one_file_and_one_for_each_link_and_can_be_drawn() {
    if software_gpu().is_none() {
        return;
    }
    let (_folder, grown, out) = place();
    // For the Khronos validator too.
    let kept = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("compare");
    std::fs::create_dir_all(&kept).unwrap();
    let chain = kept.join("chain.glb");
    let extra = kept.join("boards.glb");
    let bake =
        |method, out: &Path| succeeds(&["bake", grown.to_str().unwrap(), "--method", method, "--out", out.to_str().unwrap()]);
    bake("sphere-board", &extra);
    let more = ["--methods", "billboard,meshopt", "--cost", "triangles", "--max-flip", "0.3", "--chain", chain.to_str().unwrap()];
    let extras = ["--extra", extra.to_str().unwrap(), "--extra", "/nowhere/none.glb"];
    let output = succeeds(&args(grown.to_str().unwrap(), out.to_str().unwrap(), &[&more[..], &extras].concat()));
    let found = report(&out);
    let links = found["chain"]["links"].as_array().unwrap();
    assert!(!links.is_empty() && links[0]["from_distance"] == 0.0);
    let written = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(written.lines().filter(|line| line.ends_with(".glb")).count(), links.len() + 1, "{written}");
    let pictures = |file: &Path| {
        let picture = out.join("chain.png");
        let drawn =
            ["render", file.to_str().unwrap(), "--size", "64x64", "--adapter", "software", "--out", picture.to_str().unwrap()];
        succeeds(&drawn);
        image::open(picture).unwrap()
    };
    for file in written.lines().filter(|line| line.ends_with(".glb")) {
        pictures(Path::new(file));
    }
    let methods = found["methods"].as_array().unwrap();
    let of = |id: &str| methods.iter().find(|run| run["method"] == id).unwrap();
    assert!(of("boards")["levels"].as_array().unwrap().len() > 1, "a file of ours has its levels");
    assert!(of("none")["refused"].as_str().unwrap().contains("/nowhere/none.glb"));
}

#[test]
fn a_photograph_is_the_truth_of_its_own_view() {
    if software_gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    succeeds(&args(PHOTO, out.to_str().unwrap(), &["--methods", "sphere-board,billboard,meshopt"]));
    let found = report(&out);
    let entries = found["elevations"].as_array().unwrap();
    let own: Vec<&Value> = entries.iter().filter(|entry| entry["photographed"] == true).collect();
    assert!(own.iter().any(|entry| entry["method"] == "sphere-board") && own.len() < entries.len());
    for entry in own {
        let error = &entry["error"];
        let [flip, silhouette] = ["flip", "silhouette"].map(|id| error[id].as_f64().unwrap());
        assert!(flip > 0.0 && flip < 0.5 && silhouette < 0.4, "the picture and the photograph overlap: {entry}");
    }
    // What needs a true tree says so.
    let meshopt = found["methods"].as_array().unwrap().iter().find(|run| run["method"] == "meshopt").unwrap();
    assert!(meshopt["refused"].as_str().unwrap().contains("a photograph's model"));
}
