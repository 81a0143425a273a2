//! A scene on the device, driven through and timed: every part's measurement.

use std::path::PathBuf;
use std::time::Instant;

use serde::{Deserialize, Serialize};
use sphereboard::compare::peak_mb;
use sphereboard::gpu::{AdapterChoice, Gpu};
use sphereboard::grove::culling::{self, Chosen};
use sphereboard::grove::drive::{Grove, shot};
use sphereboard::grove::stock::Stock;
use sphereboard::grove::trail::Trail;
use sphereboard::grove::{Scene, SceneFile, lay_out, stock};
use sphereboard::params::ParamValue;
use sphereboard::render::{Camera, CullParams, Picture, Renderer, Shot};
use sphereboard::repr::SoftwareCapture;
use sphereboard::{Error, Result};

/// What was measured of one drive.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Row {
    pub job: String,
    pub method: String,
    pub trees: usize,
    /// Batch, levels, culling where they are not as usual.
    pub how: String,
    pub frames: usize,
    pub median_ms: f64,
    pub p99_ms: f64,
    pub seen: usize,
    pub near: usize,
    pub triangles: u64,
    pub draws: u64,
    pub bytes_per_tree: f64,
    pub memory_mb: f64,
    /// Seconds to grow and build the species; then to place the trees and put all onto the device.
    pub species_s: f64,
    pub start_s: f64,
    /// Mean FLIP over the pixels of trees, against geometry; not a number where it was not asked.
    pub flip: f64,
    /// Who culls, and milliseconds of a frame's culling by the processor and by the device.
    pub culling: String,
    pub cpu_cull_ms: f64,
    pub compute_cull_ms: f64,
    pub adapter: String,
}

impl Row {
    pub fn fps(&self) -> f64 {
        1e3 / self.median_ms
    }
}

/// A moment of a drive.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Moment {
    pub how: String,
    pub time_s: f32,
    pub ms: f64,
    pub trees: usize,
    pub near: usize,
    pub triangles: u64,
    pub draws: u64,
}

/// How a drive is made.
#[derive(Debug, Clone, Default)]
pub struct How {
    pub name: String,
    pub cull: CullParams,
    /// Every tree at its finest level.
    pub no_levels: bool,
    /// Every tree is drawn, wherever it is.
    pub no_culling: bool,
}

/// Frames before the first that counts.
const WARM: usize = 3;
/// Fewer frames than these have no median, if it does not take ten times the drive's time to draw them.
const LEAST: usize = 7;

pub struct Site {
    pub renderer: Renderer,
    pub scene: Scene,
    pub grove: Grove,
    culling: Chosen,
    species_s: f64,
    start_s: f64,
}

/// Half a minute for a drive, unless told.
fn seconds() -> f64 {
    std::env::var("GROVE_SECONDS").ok().and_then(|text| text.parse().ok()).unwrap_or(30.0)
}

pub fn renderer() -> Result<Renderer> {
    let choice = std::env::var("GROVE_ADAPTER").unwrap_or_else(|_| "auto".to_owned());
    let Ok(choice) = choice.parse::<AdapterChoice>();
    Renderer::new(Gpu::open(&choice)?)
}

pub fn grown(file: &SceneFile) -> Result<Vec<Stock>> {
    stock::stock(&file.species, file.stand_in(&file.method), &SoftwareCapture::new(), &|_| ())
}

impl Site {
    pub fn open(file: &SceneFile) -> Result<Self> {
        let begun = Instant::now();
        let stock = grown(file)?;
        Self::planted(renderer()?, file, &stock, begun.elapsed().as_secs_f64())
    }

    pub fn planted(renderer: Renderer, file: &SceneFile, stock: &[Stock], species_s: f64) -> Result<Self> {
        let begun = Instant::now();
        let sizes: Vec<_> = stock.iter().map(|stock| stock.size.clone()).collect();
        let (mut renderer, mut scene) = (renderer, lay_out(file, &sizes, &mut |_| ())?);
        let mut grove = Grove::plant(&renderer, &scene, stock)?;
        renderer.gpu.wait()?;
        let start_s = begun.elapsed().as_secs_f64();
        let culling = culling::choose(&mut renderer, &mut grove, &mut scene)?;
        Ok(Self { renderer, scene, grove, culling, species_s, start_s })
    }

    fn shots(&self, frames: usize, how: &How) -> Vec<Shot> {
        let step_s = self.scene.path.length_s() / frames.saturating_sub(1).max(1) as f32;
        let mut trail = Trail::default();
        let one = |number: usize| {
            let time_s = number as f32 * step_s;
            let look = self.scene.path.at(time_s);
            let mut shot = shot(&self.scene, look, time_s, trail.follow(look.eye, time_s, &self.scene.file.levels), number as u32);
            if how.no_levels {
                shot.level_distance = Some(0.0);
            }
            shot
        };
        (0..frames).map(one).collect()
    }

    /// From high enough above that all trees are before the camera, which is how culling is turned off.
    fn above(&self) -> Camera {
        let bounds = self.scene.ground.bounds();
        Camera::orbit(bounds.center(), 0.0, 1.57, 2.0 * bounds.size().length() + 100.0)
    }

    fn culls(&self, how: &How) -> (CullParams, Option<Camera>) {
        let cull = CullParams { culling: self.culling.by, ..how.cull.clone() };
        if how.no_culling { (CullParams { least_px: 0.0, ..cull }, Some(self.above())) } else { (cull, None) }
    }

    /// Milliseconds of a frame.
    pub fn frame_ms(&mut self, shot: &Shot, how: &How) -> Result<f64> {
        let (cull, frozen) = self.culls(how);
        let begun = Instant::now();
        self.renderer.frame(shot, self.grove.world(&cull, frozen))?;
        Ok(begun.elapsed().as_secs_f64() * 1e3)
    }

    pub fn picture(&mut self, share: f32) -> Result<Picture> {
        let how = How::default();
        let shots = self.shots(100, &how);
        self.renderer.picture(&shots[((share * 100.0) as usize).min(99)], self.grove.world(&how.cull, None))
    }

    /// Drives along the whole path, in as many frames as the time allows and the scene has at most.
    pub fn drive(&mut self, job: &str, how: &How) -> Result<(Row, Vec<Moment>)> {
        in_turns(job, std::slice::from_mut(self), std::slice::from_ref(how)).map(|mut drives| drives.swap_remove(0))
    }

    /// Mean milliseconds of a few frames spread over the path, which tell how many fit.
    fn probe(&mut self, how: &How) -> Result<f64> {
        let probes = self.shots(5, how);
        self.frame_ms(&probes[2], how)?;
        let (mut probed, begun) = (vec![], Instant::now());
        for shot in &probes {
            probed.push(self.frame_ms(shot, how)?);
            if begun.elapsed().as_secs_f64() > seconds() {
                break;
            }
        }
        Ok(probed.iter().sum::<f64>() / probed.len() as f64)
    }

    fn moment(&mut self, shot: &Shot, time_s: f32, how: &How) -> Result<Moment> {
        let ms = self.frame_ms(shot, how)?;
        self.grove.tally(&mut self.renderer)?;
        let (counted, crowd) = (self.renderer.counted(), self.grove.crowd());
        let (trees, near) = (crowd.trees_seen(), crowd.trees_near());
        Ok(Moment { how: how.name.clone(), time_s, ms, trees, near, triangles: counted.triangles, draws: counted.draws })
    }

    fn row(&self, job: &str, how: &How, moments: &[Moment]) -> Row {
        let info = &self.renderer.gpu.info;
        let of = |value: &dyn Fn(&Moment) -> f64, share| quantile(moments.iter().map(value).collect(), share);
        Row {
            job: job.to_owned(),
            method: self.scene.file.method.clone(),
            trees: self.scene.planted.len(),
            how: how.name.clone(),
            frames: moments.len(),
            median_ms: of(&|m| m.ms, 0.5),
            p99_ms: of(&|m| m.ms, 0.99),
            seen: of(&|m| m.trees as f64, 0.5) as usize,
            near: of(&|m| m.near as f64, 0.5) as usize,
            triangles: of(&|m| m.triangles as f64, 0.5) as u64,
            draws: moments.iter().map(|m| m.draws).max().unwrap_or(0),
            bytes_per_tree: self.grove.crowd().device_bytes() as f64 / self.scene.planted.len().max(1) as f64,
            memory_mb: peak_mb().unwrap_or(f64::NAN),
            species_s: self.species_s,
            start_s: self.start_s,
            flip: f64::NAN,
            culling: self.culling.by.show(),
            cpu_cull_ms: self.culling.cpu_ms.unwrap_or(f64::NAN),
            compute_cull_ms: self.culling.compute_ms.unwrap_or(f64::NAN),
            adapter: format!("{}, {} {}", info.name, info.driver, info.driver_info),
        }
    }

    /// One shot in the middle of the path.
    pub fn middle(&self) -> Shot {
        self.shots(3, &How::default()).swap_remove(1)
    }
}

/// Drives along the same path in several ways, frame by frame in turns, so that a busy machine slows all alike.
pub fn in_turns(job: &str, sites: &mut [Site], hows: &[How]) -> Result<Vec<(Row, Vec<Moment>)>> {
    let most = sites[0].scene.file.frames as usize;
    let probed = sites.iter_mut().zip(hows).map(|(site, how)| site.probe(how)).collect::<Result<Vec<_>>>()?;
    let mean_ms = probed.iter().sum::<f64>() / probed.len() as f64;
    let frames = ((1e3 * seconds() / mean_ms) as usize).clamp(LEAST.min(most), most);
    // The slowest are seen in three places.
    let slow = mean_ms * LEAST as f64 > 1e4 * seconds();
    let numbers: Vec<usize> = if slow { (1..frames).step_by(2).take(3).collect() } else { (0..frames).collect() };
    let step_s = sites[0].scene.path.length_s() / frames.saturating_sub(1).max(1) as f32;
    let shots: Vec<Vec<Shot>> = sites.iter().zip(hows).map(|(site, how)| site.shots(frames, how)).collect();
    let mut moments = vec![vec![]; sites.len()];
    let warm = (0..if slow { 0 } else { WARM }).map(|_| (0, false));
    for (number, counts) in warm.chain(numbers.into_iter().map(|number| (number, true))) {
        for (((site, how), shots), moments) in sites.iter_mut().zip(hows).zip(&shots).zip(&mut moments) {
            let moment = site.moment(&shots[number], number as f32 * step_s, how)?;
            if counts {
                moments.push(moment);
            }
        }
    }
    Ok(sites.iter().zip(hows).zip(moments).map(|((site, how), moments)| (site.row(job, how, &moments), moments)).collect())
}

pub fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let rank = ((share * values.len() as f64).ceil() as usize).clamp(1, values.len().max(1)) - 1;
    values.get(rank).copied().unwrap_or(f64::NAN)
}

/// Where what was measured waits for the report.
pub fn kept(name: &str) -> PathBuf {
    PathBuf::from("target/render-bench/grove").join(format!("{}.csv", name.replace(':', "-")))
}

pub fn keep<T: Serialize>(name: &str, rows: &[T]) -> Result<()> {
    let path = kept(name);
    let failed = |what: &dyn std::fmt::Display| Error::Internal { stage: "the bench", what: what.to_string() };
    std::fs::create_dir_all(path.parent().expect("it has a folder")).map_err(|e| failed(&e))?;
    let mut writer = csv::Writer::from_writer(vec![]);
    rows.iter().try_for_each(|row| writer.serialize(row)).map_err(|e| failed(&e))?;
    sphereboard::files::write_whole(&path, &writer.into_inner().map_err(|e| failed(&e))?)
}

/// What was kept under that name; nothing where it was never measured.
pub fn recalled<T: for<'de> Deserialize<'de>>(name: &str) -> Vec<T> {
    let Ok(reader) = csv::Reader::from_path(kept(name)) else { return vec![] };
    reader.into_deserialize().filter_map(std::result::Result::ok).collect()
}
