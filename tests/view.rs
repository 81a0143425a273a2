//! The windows of `view` and `grove --interactive` under Xvfb: opened, driven by real key presses, their pictures looked at, resized, hidden,
//! closed.

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
            // Else it begins anew, and turns the program away, whenever the only xdotool has come and gone.
            .arg("-noreset")
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

    /// A screen, unless something is lacking for it, which is then said.
    fn or_skip() -> Option<Self> {
        software_gpu()?;
        let Some(screen) = Self::open() else {
            skip("no Xvfb");
            return None;
        };
        if screen.tell(&["version"]).is_none() {
            skip("no xdotool");
            return None;
        }
        Some(screen)
    }

    /// Runs the program with these arguments until its window has the keyboard; gives both.
    fn run(&self, arguments: &[&str], screenshots: &str, folder: &Path) -> (Child, String) {
        let program = Command::new(env!("CARGO_BIN_EXE_sphereboard"))
            .args(arguments)
            .args(["--adapter", "software", "--seconds", "300", screenshots])
            .arg(folder)
            .env("DISPLAY", &self.display)
            .env_remove("WAYLAND_DISPLAY")
            .stderr(Stdio::inherit())
            .spawn()
            .unwrap();
        let window = wait_for("the window", || self.tell(&["search", "--name", "ms a frame"]).filter(|id| !id.is_empty()));
        self.tell(&["windowfocus", "--sync", &window]).expect("the window takes the focus");
        (program, window)
    }

    /// Makes it small, low, larger, hides it and shows it again.
    fn resize_and_hide(&self, window: &str) {
        for size in [["1", "1"], ["500", "30"], ["400", "300"]] {
            self.tell(&["windowsize", window, size[0], size[1]]).expect("the window can be resized");
            std::thread::sleep(Duration::from_millis(200));
        }
        self.tell(&["windowunmap", window]).expect("the window can be hidden");
        self.tell(&["windowmap", "--sync", window]).expect("the window can be shown again");
        self.tell(&["windowfocus", "--sync", window]).expect("the window takes the focus again");
    }

    /// Waits until the window's title has `words` in it, and gives it.
    fn title_with(&self, window: &str, words: &str) -> String {
        wait_for(words, || self.tell(&["getwindowname", window]).filter(|title| title.contains(words)))
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
    let end = Instant::now() + Duration::from_secs(120);
    loop {
        match ready() {
            Some(found) => return found,
            None => assert!(Instant::now() < end, "{what} did not come within two minutes"),
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

/// A model of one of our own samples.
fn model(name: &str, folder: &Path) -> PathBuf {
    let photo = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("photos/{name}.jpg"));
    let made = Command::new(env!("CARGO_BIN_EXE_sphereboard")).arg("model").arg(photo).arg("--out").arg(folder).status().unwrap();
    assert!(made.success());
    folder.join(format!("{name}.glb"))
}

#[test]
fn a_window_opens_follows_the_keys_saves_pictures_and_closes() {
    let Some(screen) = Screen::or_skip() else { return };
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let tree = model("oak", folder.path());
    let arguments = ["view", tree.to_str().unwrap(), "--size", "320x240"];
    let (mut viewer, window) = screen.run(&arguments, "--screenshots", folder.path());

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

    screen.resize_and_hide(&window);
    screen.press("p");
    assert_eq!(screenshot(folder.path(), 10).dimensions(), (400, 300), "pictures follow the window's size");

    screen.press("Escape");
    let status = wait_for("the end", || viewer.try_wait().unwrap());
    assert!(status.success(), "{status}");
}

/// How many trees a grove's title says are in the picture.
fn trees(title: &str) -> usize {
    let words: Vec<&str> = title.split(' ').collect();
    let of = words.windows(4).position(|four| four[1] == "of" && four[3] == "trees").expect("the title counts trees");
    words[of].parse().unwrap()
}

#[test]
fn a_grove_is_flown_through_its_method_switched_and_its_culling_frozen() {
    let Some(screen) = Screen::or_skip() else { return };
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    // Northwards over the northern half, so that whenever the path is left there are trees behind.
    let path = folder.path().join("north.csv");
    std::fs::write(&path, "t,ex,ey,ez,tx,ty,tz\n0,0,40,0,0,5,-60\n20,0,40,-10,0,5,-70\n").unwrap();
    let scene = ["--preset", "she-540", "--trees", "30", "--method", "billboard", "--path", path.to_str().unwrap()];
    let arguments = [&["grove", "--size", "320x180", "--interactive"], &scene[..]].concat();
    let (mut program, window) = screen.run(&arguments, "--out", folder.path());
    let mut taken = 0;
    let mut picture = || {
        taken += 1;
        screen.press("c");
        screenshot(folder.path(), taken)
    };

    screen.title_with(&window, "following the path");
    assert!(picture() != picture(), "the path is followed");
    screen.press("p");
    screen.title_with(&window, "flying");
    let mut before = picture();
    assert_eq!(before.dimensions(), (320, 180));
    assert!(picture() == before, "nobody moves");
    // Each key must change the picture: levels, normals, edges, and as it was, while trees are near; forward, sideways, down, faster up.
    for key in ["l", "n", "o", "o", "w", "Left", "q", "shift+e"] {
        screen.press(key);
        let after = picture();
        assert!(after != before, "{key} changes nothing");
        before = after;
    }

    screen.press("f");
    let frozen = trees(&screen.title_with(&window, "culling frozen"));
    assert!(frozen < 30, "some trees are out of the picture");
    assert!(picture() == before, "frozen culling looks the same from where it was frozen");
    (0..12).for_each(|_| screen.press("shift+s"));
    screen.press("shift+e");
    let outside = picture();
    // While something moves, trees that the device culls are counted as at most so many.
    wait_for("frozen culling that does not follow the camera", || {
        (trees(&screen.tell(&["getwindowname", &window])?) == frozen).then_some(())
    });
    screen.press("f");
    assert!(picture() != outside, "trees come back");
    wait_for("more trees", || (trees(&screen.tell(&["getwindowname", &window])?) > frozen).then_some(()));

    let billboards = picture();
    screen.press("m");
    screen.title_with(&window, "; crossed-planes; flying");
    assert!(picture() != billboards, "another method looks different");
    screen.press("shift+m");
    screen.title_with(&window, "building billboard");
    screen.title_with(&window, "; billboard; flying");
    assert!(picture() == billboards, "and back");
    screen.press("p");
    screen.title_with(&window, "following the path");

    screen.resize_and_hide(&window);
    wait_for("a picture of the new size", || (picture().dimensions() == (400, 300)).then_some(()));
    screen.press("Escape");
    let status = wait_for("the end", || program.try_wait().unwrap());
    assert!(status.success(), "{status}");
}

#[test]
fn a_species_file_that_is_replaced_is_read_anew_and_a_damaged_one_is_not() {
    let Some(screen) = Screen::or_skip() else { return };
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let [oak, other] = ["oak", "juniper"].map(|name| std::fs::read(model(name, folder.path())).unwrap());
    let species = folder.path().join("tree.glb");
    std::fs::write(&species, &oak).unwrap();
    let planted = ["grove", "--trees", "20", "--species", species.to_str().unwrap(), "--size", "320x180", "--interactive"];
    let (mut program, window) = screen.run(&planted, "--out", folder.path());
    screen.press("p");
    screen.title_with(&window, "flying");
    screen.press("c");
    let before = screenshot(folder.path(), 1);

    std::fs::write(&species, &other[..other.len() / 2]).unwrap();
    screen.title_with(&window, "the old tree stays");
    screen.press("c");
    assert!(screenshot(folder.path(), 2) == before, "half a file changes nothing");
    std::fs::write(&species, &other).unwrap();
    screen.title_with(&window, "read anew");
    screen.press("c");
    assert!(screenshot(folder.path(), 3) != before, "another tree stands there");
    std::fs::remove_file(&species).unwrap();
    screen.press("Escape");
    let status = wait_for("the end", || program.try_wait().unwrap());
    assert!(status.success(), "{status}");
}

#[test]
fn without_a_screen_the_message_says_what_to_do() {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let tree = model("oak", folder.path());
    for arguments in [&["view", tree.to_str().unwrap()][..], &["grove", "--interactive"]] {
        let output = Command::new(env!("CARGO_BIN_EXE_sphereboard"))
            .args(arguments)
            .current_dir(folder.path())
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY")
            .output()
            .unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(message.contains("a window cannot be opened") && message.contains("sphereboard render"), "{message}");
        assert_eq!(output.status.code(), Some(2));
    }
}
