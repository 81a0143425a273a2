//! What a drive through a grove leaves behind: a line for each frame in `frames.csv` as it is drawn, and what they come to in
//! `summary.json`.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::json;

use super::drive::{FollowParams, Frame, Grove};
use super::scene::Scene;
use crate::model::About;
use crate::render::CullParams;
use crate::{Error, Result, files};

/// On what and how a drive was made.
pub struct Setting<'a> {
    /// Adapter and driver.
    pub adapter: String,
    /// The command line.
    pub command: String,
    /// How trees were culled.
    pub cull: &'a CullParams,
    /// How levels followed.
    pub follow: &'a FollowParams,
}

/// What the frames of a drive come to.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Version of the program.
    pub program: String,
    /// Adapter and driver.
    pub adapter: String,
    /// The command line.
    pub command: String,
    /// The scene's title.
    pub title: String,
    /// What stands for each tree.
    pub method: String,
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// Trees of the scene.
    pub trees: usize,
    /// Triangles of the ground.
    pub ground_triangles: usize,
    /// Bytes on the device of a placed tree, beyond what its species holds.
    pub bytes_per_tree: f64,
    /// Frames.
    pub frames: usize,
    /// Milliseconds of a frame: median, and what 99 % took at most.
    pub median_ms: f64,
    /// See `median_ms`.
    pub p99_ms: f64,
    /// Frames a second, of the median.
    pub fps: f64,
    /// Median milliseconds of each pass.
    pub passes_ms: Vec<(String, f64)>,
    /// Median milliseconds before anything was given to the device.
    pub cpu_ms: f64,
    /// Median trees in the picture, and of those drawn by themselves.
    pub trees_seen: f64,
    /// See `trees_seen`.
    pub trees_near: f64,
    /// Median triangles of trees.
    pub triangles: f64,
    /// Most draw calls of a frame.
    pub most_draws: u64,
    /// Names of the levels of each species.
    pub levels: Vec<(String, Vec<String>)>,
    /// Every effective parameter.
    pub parameters: serde_json::Value,
}

/// Writes a drive down.
pub struct Recorder<'a> {
    folder: PathBuf,
    scene: &'a Scene,
    setting: &'a Setting<'a>,
    levels: Vec<(String, Vec<String>)>,
    csv: Option<BufWriter<File>>,
    frames: Vec<Frame>,
}

/// While it is being written; the whole file has its name without that.
const UNFINISHED: &str = "frames.csv.part";

impl<'a> Recorder<'a> {
    /// Begins in `folder`, which exists.
    ///
    /// # Errors
    /// [`Error::Write`] when it cannot be written to.
    pub fn new(folder: &Path, scene: &'a Scene, grove: &Grove, setting: &'a Setting<'a>) -> Result<Self> {
        let names = |levels: &Vec<&str>| levels.iter().map(|name| (*name).to_owned()).collect();
        let levels = scene.species.iter().zip(&grove.levels()).map(|(species, levels)| (species.name.clone(), names(levels))).collect();
        let csv = File::create(folder.join(UNFINISHED)).map_err(|cause| written(folder, cause))?;
        Ok(Self { folder: folder.to_owned(), scene, setting, levels, csv: Some(BufWriter::new(csv)), frames: vec![] })
    }

    /// Writes a frame down.
    ///
    /// # Errors
    /// [`Error::Write`] when the disk is full.
    pub fn keep(&mut self, frame: &Frame) -> Result<()> {
        let folder = self.folder.clone();
        let mut text = String::new();
        if self.frames.is_empty() {
            text = self.header(frame);
        }
        let Frame { time_s, ms, cpu_ms, passes, counted, trees, near, shown, uploaded_bytes } = frame;
        text += &format!("{},{time_s:.3},{ms:.3},{cpu_ms:.3}", self.frames.len());
        passes.iter().for_each(|(_, ms)| text += &format!(",{ms:.3}"));
        text += &format!(",{},{},{trees},{near},{uploaded_bytes}", counted.triangles, counted.draws);
        shown.iter().flatten().for_each(|count| text += &format!(",{count}"));
        text.push('\n');
        let csv = self.csv.as_mut().ok_or_else(|| Error::Internal { stage: "grove::record", what: "already finished".to_owned() })?;
        // Each line at once: what was drawn is kept whatever comes next.
        csv.write_all(text.as_bytes()).and_then(|()| csv.flush()).map_err(|cause| written(&folder, cause))?;
        self.frames.push(frame.clone());
        Ok(())
    }

    fn header(&self, frame: &Frame) -> String {
        let mut text = "frame,time_s,ms,cpu_ms".to_owned();
        frame.passes.iter().for_each(|(pass, _)| text += &format!(",{}_ms", pass.replace(' ', "_")));
        text += ",triangles,draws,trees,near,uploaded_bytes";
        for (number, (species, levels)) in self.levels.iter().enumerate() {
            levels.iter().for_each(|level| text += &format!(",\"{number} {species}: {}\"", level.replace('"', "'")));
        }
        text + "\n"
    }

    /// Ends; gives a sentence with what it came to.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn finish(mut self, grove: &Grove) -> Result<String> {
        self.csv = None;
        let part = self.folder.join(UNFINISHED);
        std::fs::rename(&part, self.folder.join("frames.csv")).map_err(|cause| written(&self.folder, cause))?;
        let summary = self.summary(grove);
        let json = serde_json::to_string_pretty(&summary)
            .map_err(|cause| Error::Internal { stage: "grove::record", what: cause.to_string() })?;
        files::write_whole(&self.folder.join("summary.json"), json.as_bytes())?;
        Ok(format!(
            "{} trees, {} × {}: {:.1} frames a second (median {:.1} ms, 99 % within {:.1} ms), {:.0} trees in the picture",
            summary.trees, summary.size_px[0], summary.size_px[1], summary.fps, summary.median_ms, summary.p99_ms, summary.trees_seen
        ))
    }

    fn summary(&self, grove: &Grove) -> Summary {
        let of = |value: &dyn Fn(&Frame) -> f64, share: f64| quantile(self.frames.iter().map(value).collect(), share);
        let passes = self.frames.first().map_or(vec![], |frame| frame.passes.iter().map(|(pass, _)| *pass).collect());
        let pass_ms = |i: usize| of(&|frame: &Frame| frame.passes.get(i).map_or(0.0, |(_, ms)| *ms), 0.5);
        let median_ms = of(&|frame: &Frame| frame.ms, 0.5);
        let file = &self.scene.file;
        let trees = self.scene.planted.len();
        let Setting { cull, follow, .. } = self.setting;
        Summary {
            program: About::this_program(),
            adapter: self.setting.adapter.clone(),
            command: self.setting.command.clone(),
            title: file.title.clone(),
            method: file.method.clone(),
            size_px: file.size_px,
            trees,
            ground_triangles: self.scene.ground.triangles(),
            bytes_per_tree: grove.crowd().device_bytes() as f64 / trees.max(1) as f64,
            frames: self.frames.len(),
            median_ms,
            p99_ms: of(&|frame: &Frame| frame.ms, 0.99),
            fps: if median_ms > 0.0 { 1e3 / median_ms } else { 0.0 },
            passes_ms: passes.iter().enumerate().map(|(i, pass)| ((*pass).to_owned(), pass_ms(i))).collect(),
            cpu_ms: of(&|frame: &Frame| frame.cpu_ms, 0.5),
            trees_seen: of(&|frame: &Frame| frame.trees as f64, 0.5),
            trees_near: of(&|frame: &Frame| frame.near as f64, 0.5),
            triangles: of(&|frame: &Frame| frame.counted.triangles as f64, 0.5),
            most_draws: self.frames.iter().map(|frame| frame.counted.draws).max().unwrap_or(0),
            levels: self.levels.clone(),
            parameters: json!({ "terrain": file.terrain, "planting": file.planting, "camera": file.camera, "stage": file.stage,
                "culling": cull, "levels": follow }),
        }
    }
}

/// The value that this share of `values` does not exceed; 0 of none.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values.get(((share * values.len() as f64).ceil() as usize).saturating_sub(1).min(last)).copied().unwrap_or(0.0)
}

fn written(folder: &Path, cause: std::io::Error) -> Error {
    Error::Write { path: folder.join("frames.csv"), cause }
}
