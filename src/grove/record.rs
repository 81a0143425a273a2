//! What a drive through a grove leaves behind: a line for each frame in `frames.csv` as it is drawn, and what they come to in
//! `summary.json`, on a page, and as plots.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::json;

use super::against::Against;
use super::culling::Chosen;
use super::drive::{Frame, Grove};
use super::scene::Scene;
use crate::compare::peak_mb;
use crate::model::About;
use crate::render::CullParams;
use crate::{Error, Result};

/// Milliseconds until the first frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Started {
    /// Growing or reading the species, and building what stands for them.
    pub species_ms: f64,
    /// Raising the ground and finding a place for every tree.
    pub places_ms: f64,
    /// Putting all of it onto the device.
    pub device_ms: f64,
}

/// On what and how a drive was made.
pub struct Setting {
    /// Adapter and driver.
    pub adapter: String,
    /// The command line.
    pub command: String,
    /// Who culls.
    pub culling: Chosen,
    /// What came before the first frame.
    pub started: Started,
}

/// A species in the scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OfSpecies {
    /// Its name.
    pub name: String,
    /// Height of its model, metres.
    pub height_m: f32,
    /// How many stand there.
    pub trees: usize,
    /// Names of its levels, nearest first.
    pub levels: Vec<String>,
}

/// What the frames of a drive come to.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Version of the program.
    pub program: String,
    /// Of the program.
    pub commit: &'static str,
    /// Adapter and driver.
    pub adapter: String,
    /// The command line.
    pub command: String,
    /// Why the drive ended before its path did; nothing where it did not.
    pub broken_off: Option<String>,
    /// The scene's title.
    pub title: String,
    /// What stands for each tree.
    pub method: String,
    /// Of ground and planting.
    pub seed: u64,
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// Trees of the scene.
    pub trees: usize,
    /// Triangles of the ground.
    pub ground_triangles: usize,
    /// Bytes on the device of a placed tree, beyond what its species holds.
    pub bytes_per_tree: f64,
    /// Most memory that the process held, megabytes; nothing where the system does not tell.
    pub memory_mb: Option<f64>,
    /// Who culls, and what both would take.
    pub culling: Chosen,
    /// Milliseconds until the first frame.
    pub started: Started,
    /// Duration of the path, seconds.
    pub path_s: f32,
    /// Frames.
    pub frames: usize,
    /// Milliseconds of a frame: median, and what 99 % took at most.
    pub median_ms: f64,
    /// See `median_ms`.
    pub p99_ms: f64,
    /// Frames a second, of the median.
    pub fps: f64,
    /// Median milliseconds before anything was given to the device.
    pub cpu_ms: f64,
    /// Each pass: its name, median milliseconds, and what 99 % took at most.
    pub passes_ms: Vec<(String, f64, f64)>,
    /// Median trees in the picture, and of those drawn by themselves.
    pub trees_seen: f64,
    /// See `trees_seen`.
    pub trees_near: f64,
    /// Median triangles of trees.
    pub triangles: f64,
    /// Most draw calls of a frame.
    pub most_draws: u64,
    /// Bytes sent to the device in all frames.
    pub uploaded_bytes: u64,
    /// What grows there.
    pub species: Vec<OfSpecies>,
    /// Beside the same drive with another method, where that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub against: Option<Against>,
    /// Every effective parameter.
    pub parameters: serde_json::Value,
}

/// A drive that has ended: what the page shows.
#[derive(Debug, Clone)]
pub struct Drive {
    /// What it comes to.
    pub summary: Summary,
    /// Its frames.
    pub frames: Vec<Frame>,
}

/// Passes that a frame may have, in their order: their columns are there even where a first frame leaves one out. Time in any other is
/// counted under the last.
pub const PASSES: [&str; 7] = ["culling", "shadow map", "backdrop", "trees", "growth", "composite", "other"];

impl Frame {
    /// Milliseconds of each of [`PASSES`].
    pub fn passes_ms(&self) -> [f64; PASSES.len()] {
        let mut sums = [0.0; PASSES.len()];
        for (name, ms) in &self.passes {
            sums[PASSES.iter().position(|pass| pass == name).unwrap_or(PASSES.len() - 1)] += ms;
        }
        sums
    }
}

/// While it is being written; a drive that was killed leaves that behind.
const UNFINISHED: &str = "frames.csv.part";

/// Writes a drive down.
pub struct Recorder<'a> {
    folder: PathBuf,
    scene: &'a Scene,
    setting: &'a Setting,
    species: Vec<OfSpecies>,
    csv: BufWriter<File>,
    frames: Vec<Frame>,
}

impl<'a> Recorder<'a> {
    /// Begins `frames.csv` in `folder`, which exists; it has that name once it is whole.
    ///
    /// # Errors
    /// [`Error::Write`] when it cannot be written to.
    pub fn new(folder: &Path, scene: &'a Scene, grove: &Grove, setting: &'a Setting) -> Result<Self> {
        let mut trees = vec![0; scene.species.len()];
        scene.planted.iter().for_each(|tree| trees[usize::from(tree.species)] += 1);
        let of_one = |((species, levels), trees): ((&super::placement::SpeciesSize, Vec<&str>), usize)| OfSpecies {
            name: species.name.clone(),
            height_m: species.height_m,
            trees,
            levels: levels.into_iter().map(str::to_owned).collect(),
        };
        let species: Vec<OfSpecies> = scene.species.iter().zip(grove.levels()).zip(trees).map(of_one).collect();
        let file = folder.join(UNFINISHED);
        let csv = File::create(&file).map_err(|cause| Error::Write { path: file, cause })?;
        let mut recorder = Self { folder: folder.to_owned(), scene, setting, species, csv: BufWriter::new(csv), frames: vec![] };
        let header = recorder.header();
        recorder.write(&header)?;
        Ok(recorder)
    }

    /// Writes a frame down.
    ///
    /// # Errors
    /// [`Error::Write`] when the disk is full.
    pub fn keep(&mut self, frame: &Frame) -> Result<()> {
        let Frame { time_s, ms, cpu_ms, counted, trees, near, shown, uploaded_bytes, .. } = frame;
        let mut text = format!("{},{time_s:.3},{ms:.3},{cpu_ms:.3}", self.frames.len());
        frame.passes_ms().iter().for_each(|ms| text += &format!(",{ms:.3}"));
        text += &format!(",{},{},{trees},{near},{uploaded_bytes}", counted.triangles, counted.draws);
        shown.iter().flatten().for_each(|count| text += &format!(",{count}"));
        self.write(&(text + "\n"))?;
        self.frames.push(frame.clone());
        Ok(())
    }

    /// A line, at once: what was drawn is kept whatever comes next.
    fn write(&mut self, line: &str) -> Result<()> {
        let written = self.csv.write_all(line.as_bytes()).and_then(|()| self.csv.flush());
        written.map_err(|cause| Error::Write { path: self.folder.join(UNFINISHED), cause })
    }

    fn header(&self) -> String {
        let mut text = "frame,time_s,ms,cpu_ms".to_owned();
        PASSES.iter().for_each(|pass| text += &format!(",{}_ms", pass.replace(' ', "_")));
        text += ",triangles,draws,trees,near,uploaded_bytes";
        for (number, species) in self.species.iter().enumerate() {
            let quoted = |level: &String| format!("{number} {}: {level}", species.name).replace('"', "\"\"");
            species.levels.iter().for_each(|level| text += &format!(",\"{}\"", quoted(level)));
        }
        text + "\n"
    }

    /// Ends; `broken_off` says why before the path did.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn finish(self, grove: &Grove, broken_off: Option<String>) -> Result<Drive> {
        let summary = self.summary(grove, broken_off);
        let whole = self.folder.join("frames.csv");
        // Windows renames no file that is open.
        drop(self.csv);
        std::fs::rename(self.folder.join(UNFINISHED), &whole).map_err(|cause| Error::Write { path: whole, cause })?;
        Ok(Drive { summary, frames: self.frames })
    }

    fn summary(&self, grove: &Grove, broken_off: Option<String>) -> Summary {
        let of = |value: &dyn Fn(&Frame) -> f64, share: f64| quantile(self.frames.iter().map(value).collect(), share);
        let used = |pass: &usize| self.frames.iter().any(|frame| frame.passes_ms()[*pass] > 0.0);
        let pass = |pass: usize, share: f64| of(&|frame: &Frame| frame.passes_ms()[pass], share);
        let median_ms = of(&|frame: &Frame| frame.ms, 0.5);
        let file = &self.scene.file;
        let trees = self.scene.planted.len();
        // As it was asked for, whatever was chosen then.
        let asked = CullParams { culling: self.setting.culling.asked, ..file.culling.clone() };
        Summary {
            program: About::this_program(),
            commit: env!("SPHEREBOARD_COMMIT"),
            adapter: self.setting.adapter.clone(),
            command: self.setting.command.clone(),
            broken_off,
            title: file.title.clone(),
            method: file.method.clone(),
            seed: file.seed,
            size_px: file.size_px,
            trees,
            ground_triangles: self.scene.ground.triangles(),
            bytes_per_tree: grove.crowd().device_bytes() as f64 / trees.max(1) as f64,
            memory_mb: peak_mb(),
            culling: self.setting.culling.clone(),
            started: self.setting.started,
            path_s: self.scene.path.length_s(),
            frames: self.frames.len(),
            median_ms,
            p99_ms: of(&|frame: &Frame| frame.ms, 0.99),
            fps: if median_ms > 0.0 { 1e3 / median_ms } else { 0.0 },
            cpu_ms: of(&|frame: &Frame| frame.cpu_ms, 0.5),
            passes_ms: (0..PASSES.len()).filter(used).map(|i| (PASSES[i].to_owned(), pass(i, 0.5), pass(i, 0.99))).collect(),
            trees_seen: of(&|frame: &Frame| frame.trees as f64, 0.5),
            trees_near: of(&|frame: &Frame| frame.near as f64, 0.5),
            triangles: of(&|frame: &Frame| frame.counted.triangles as f64, 0.5),
            most_draws: self.frames.iter().map(|frame| frame.counted.draws).max().unwrap_or(0),
            uploaded_bytes: self.frames.iter().map(|frame| frame.uploaded_bytes).sum(),
            species: self.species.clone(),
            against: None,
            parameters: json!({ "terrain": file.terrain, "planting": file.planting, "camera": file.camera, "stage": file.stage,
                "culling": asked, "levels": file.levels }),
        }
    }
}

impl Summary {
    /// In a sentence.
    pub fn sentence(&self) -> String {
        let s = if self.trees == 1 { "" } else { "s" };
        format!(
            "{} tree{s}, {} × {}: {:.1} frames a second (median {:.1} ms, 99 % within {:.1} ms), {:.0} of them in the picture",
            self.trees, self.size_px[0], self.size_px[1], self.fps, self.median_ms, self.p99_ms, self.trees_seen
        )
    }
}

/// The value that this share of `values` does not exceed; 0 of none.
pub(super) fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values.get(((share * values.len() as f64).ceil() as usize).saturating_sub(1).min(last)).copied().unwrap_or(0.0)
}
