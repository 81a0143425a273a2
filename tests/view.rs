//! The window under Xvfb: opened, driven by real key presses, its pictures looked at, resized, hidden, closed.

mod common;

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use common::{skip, software_gpu};
use image::RgbaImage;

/// An X server without a screen, stopped when dropped.
struct Screen {
    server: Child,
    display: String,
}

impl Screen {
    fn open() -> Option<Self> {
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1024x768x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .ok()?;
        let mut number = String::new();
        BufReader::new(server.stdout.take()?).read_line(&mut number).ok()?;
        Some(Self { server, display: format!(":{}", number.trim()) })
    }

    /// What `xdotool` prints, if it succeeds.
    fn tell(&self, arguments: &[&str]) -> Option<String> {
        let output = Command::new("xdotool").args(arguments).env("DISPLAY", &self.display).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    }

    fn press(&self, key: &str) {
        self.tell(&["key", key]).unwrap_or_else(|| panic!("xdotool cannot press {key}"));
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Tries until `ready` gives something.
fn wait_for<T>(what: &str, mut ready: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + Duration::from_secs(60);
    loop {
        match ready() {
            Some(found) => return found,
            None => assert!(Instant::now() < end, "{what} did not come within a minute"),
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// The picture of that number, once it is there. Files are renamed into place, so it is whole.
fn screenshot(folder: &Path, number: usize) -> RgbaImage {
    let path = folder.join(format!("sphereboard-{number:03}.png"));
    wait_for(&path.display().to_string(), || path.exists().then_some(()));
    image::open(path).unwrap().into_rgba8()
}

/// A model of our own sample.
fn model(folder: &Path) -> PathBuf {
    let photo = Path::new(env!("CARGO_MANIFEST_DIR")).join("photos/oak.jpg");
    let made = Command::new(env!("CARGO_BIN_EXE_sphereboard")).arg("model").arg(photo).arg("--out").arg(folder).status().unwrap();
    assert!(made.success());
    folder.join("oak.glb")
}

#[test]
fn a_window_opens_follows_the_keys_saves_pictures_and_closes() {
    if software_gpu().is_none() {
        return;
    }
    let Some(screen) = Screen::open() else { return skip("no Xvfb") };
    if screen.tell(&["version"]).is_none() {
        return skip("no xdotool");
    }
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let mut viewer = Command::new(env!("CARGO_BIN_EXE_sphereboard"))
        .arg("view")
        .arg(model(folder.path()))
        .args(["--adapter", "software", "--size", "320x240", "--seconds", "120", "--screenshots"])
        .arg(folder.path())
        .env("DISPLAY", &screen.display)
        .env_remove("WAYLAND_DISPLAY")
        .stderr(Stdio::inherit())
        .spawn()
        .unwrap();
    let window = wait_for("the window", || screen.tell(&["search", "--name", "ms a frame"]).filter(|id| !id.is_empty()));
    screen.tell(&["windowfocus", "--sync", &window]).expect("the window takes the focus");

    screen.press("p");
    let first = screenshot(folder.path(), 1);
    assert_eq!(first.dimensions(), (320, 240));
    screen.press("p");
    assert_eq!(screenshot(folder.path(), 2), first, "a still camera gives the same picture");
    // Each key must change the picture: another side, no light, smooth outline, edges, normals, black behind, on foot.
    let mut before = first;
    for (number, key) in ["Right", "3", "g", "f", "n", "b", "Tab"].into_iter().enumerate() {
        screen.press(key);
        screen.press("p");
        let after = screenshot(folder.path(), 3 + number);
        assert_ne!(after, before, "{key} changes nothing");
        before = after;
    }

    for size in [["1", "1"], ["500", "30"], ["400", "300"]] {
        screen.tell(&["windowsize", &window, size[0], size[1]]).expect("the window can be resized");
        std::thread::sleep(Duration::from_millis(200));
    }
    screen.tell(&["windowunmap", &window]).expect("the window can be hidden");
    screen.tell(&["windowmap", "--sync", &window]).expect("the window can be shown again");
    screen.tell(&["windowfocus", "--sync", &window]).expect("the window takes the focus again");
    screen.press("p");
    assert_eq!(screenshot(folder.path(), 10).dimensions(), (400, 300), "pictures follow the window's size");

    screen.press("Escape");
    let status = wait_for("the end", || viewer.try_wait().unwrap());
    assert!(status.success(), "{status}");
}

#[test]
fn without_a_screen_the_message_says_what_to_do() {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_sphereboard"))
        .arg("view")
        .arg(model(folder.path()))
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("a window cannot be opened") && message.contains("sphereboard render"), "{message}");
    assert_eq!(output.status.code(), Some(2));
}
