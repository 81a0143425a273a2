//! Where exhibits are drawn and timed: a tree, a device, and what methods have built so far.

use std::rc::Rc;
use std::time::{Duration, Instant};

use image::RgbImage;

use crate::compare::cost::TREE_PASSES;
use crate::compare::{Figures, Seen, Stage, Sun, View};
use crate::gpu::layout::Instance;
use crate::raster::{PngEffort, png_with};
use crate::render::{Camera, FOV_Y_RAD, Renderer, Shot, Stand, Tree};
use crate::repr::{self, BuiltTree, Order, Settings, TreeSource};
use crate::{Result, files};

use super::extraction::{self, Measured};
use super::{Panel, Request};

/// The light of all pictures: from the viewer's right, behind him.
const SUN: Sun = Sun { azimuth_deg: 40.0, elevation_deg: 45.0 };
/// Time for the frames of one measurement; three at least.
const TIMED: Duration = Duration::from_millis(300);
/// Most frames of one measurement.
const MOST_FRAMES: usize = 31;
/// Folder of the pictures beside the page.
const FOLDER: &str = "papers";

/// The tree, the device, and what was built.
pub struct Bench<'a> {
    /// Draws.
    pub renderer: &'a mut Renderer,
    /// What is asked for.
    pub request: &'a Request<'a>,
    /// Where the tree stands.
    pub stage: Stage,
    /// By method and settings.
    built: Vec<(String, Rc<BuiltTree>)>,
    /// What changes of level cost, which two exhibits show.
    extracted: Option<Rc<Vec<Measured>>>,
}

impl<'a> Bench<'a> {
    /// A bench on which nothing is built yet.
    ///
    /// # Errors
    /// [`EmptyModel`](crate::Error::EmptyModel).
    pub fn new(renderer: &'a mut Renderer, request: &'a Request<'a>) -> Result<Self> {
        Ok(Self { renderer, request, stage: Stage { bounds: request.source.box_of_all()? }, built: vec![], extracted: None })
    }

    /// The tree.
    pub fn source(&self) -> &'a TreeSource {
        self.request.source
    }

    /// What a method makes of the tree, each time the same.
    ///
    /// # Errors
    /// Those of [`repr::build`].
    pub fn built(&mut self, method: &str, settings: &Settings) -> Result<Rc<BuiltTree>> {
        let key = format!("{method} {settings:?}");
        if let Some((_, built)) = self.built.iter().find(|(known, _)| *known == key) {
            return Ok(built.clone());
        }
        let order = Order { method, trunk: None, settings, seed: self.request.seed };
        let built = Rc::new(repr::build(&order, self.request.source, self.request.capture)?);
        self.built.push((key, built.clone()));
        Ok(built)
    }

    /// What changes of level cost; measured once.
    pub fn extracted(&mut self) -> Rc<Vec<Measured>> {
        let seed = self.request.seed;
        let measure = || {
            let (surface, forest) = extraction::taxus(seed);
            Rc::new(extraction::extraction(&surface, &forest, 3))
        };
        self.extracted.get_or_insert_with(measure).clone()
    }

    /// What a method makes of the tree by its own settings, and the same on the device.
    ///
    /// # Errors
    /// As [`Bench::built`], and those of [`Renderer::upload_built`].
    pub fn uploaded(&mut self, method: &str) -> Result<(Rc<BuiltTree>, Tree)> {
        let built = self.built(method, &Settings::default())?;
        let tree = self.renderer.upload_built(&built)?;
        Ok((built, tree))
    }

    /// What is seen of a tree that is `height_px` pixels high; `level` as [`Stage::shot`] has it.
    ///
    /// # Errors
    /// Those of [`Renderer::picture`].
    pub fn look(&mut self, tree: &Tree, view: View, height_px: f32, level: Option<f32>) -> Result<Seen> {
        let shot = self.stage.shot(view, height_px, SUN, level);
        self.stage.see(self.renderer, tree, &shot)
    }

    /// Two of them, the second held against the first.
    ///
    /// # Errors
    /// As [`Figures::of`].
    pub fn figures(&self, truth: &Seen, test: &Seen) -> Result<Figures> {
        Figures::of(truth, test, self.stage.height_m())
    }

    /// Keeps a picture beside the page.
    ///
    /// # Errors
    /// Those of [`files`].
    pub fn panel(&self, name: &str, caption: String, picture: &RgbImage) -> Result<Panel> {
        let folder = self.request.folder.join(FOLDER);
        let _folder = files::ready_folder(&folder)?;
        let bytes = png_with(&image::DynamicImage::from(picture.clone()).into_rgba8(), PngEffort::Small)?;
        files::write_whole(&folder.join(format!("{name}.png")), &bytes)?;
        Ok(Panel { file: format!("{FOLDER}/{name}.png"), caption, size_px: picture.dimensions().into() })
    }

    /// Milliseconds of the passes that trees are to blame for, one tree; median.
    ///
    /// # Errors
    /// Those of [`Renderer::timed`].
    pub fn tree_ms(&mut self, tree: &Tree, view: View, height_px: f32) -> Result<f64> {
        let shot = self.stage.shot(view, height_px, SUN, None);
        let stands = [Stand { tree, instances: &[Instance::IDENTITY] }];
        median_ms(|| {
            let passes = self.renderer.timed(&shot, &stands)?;
            Ok(passes.iter().filter(|(pass, _)| TREE_PASSES.contains(pass)).map(|(_, ms)| ms).sum())
        })
    }

    /// Milliseconds of whole frames, waited for; median.
    ///
    /// # Errors
    /// Those of [`Renderer::frame`].
    pub fn frame_ms(&mut self, shot: &Shot, stands: &[Stand]) -> Result<f64> {
        median_ms(|| {
            let begun = Instant::now();
            self.renderer.frame(shot, stands)?;
            Ok(begun.elapsed().as_secs_f64() * 1e3)
        })
    }
}

/// The median of what `frame` gives; what the first gives, in which drivers compile, does not count.
fn median_ms(mut frame: impl FnMut() -> Result<f64>) -> Result<f64> {
    frame()?;
    let (begun, mut found) = (Instant::now(), vec![]);
    while found.len() < 3 || begun.elapsed() < TIMED && found.len() < MOST_FRAMES {
        found.push(frame()?);
    }
    found.sort_by(f64::total_cmp);
    Ok(found[found.len() / 2])
}

/// So many trees in rows, about twice as many across as deep, `step_m` apart.
pub fn in_rows(step_m: f32, count: usize) -> Vec<Instance> {
    let across = ((2 * count) as f32).sqrt().round().max(1.0) as usize;
    let middle = |n: usize| 0.5 * (n - 1) as f32;
    let place = |i: usize| {
        let (x, z) = ((i % across) as f32 - middle(across), middle(count.div_ceil(across)) - (i / across) as f32);
        Instance { position: [x * step_m, 0.0, z * step_m], id: i as u32, ..Instance::IDENTITY }
    };
    (0..count).map(place).collect()
}

/// A tree as in She's fig. 15 and 16: nearly as tall as the picture.
pub fn one_tree(tree: &Tree, size_px: [u32; 2]) -> Shot {
    let bounds = tree.bounds().unwrap_or(crate::geom::Bounds { min: glam::Vec3::ZERO, max: glam::Vec3::ONE });
    let distance_m = 1.15 * 0.5 * bounds.size().y / (0.5 * FOV_Y_RAD).tan() + 0.5 * bounds.size().z;
    Shot::new(Camera::orbit(bounds.center(), 0.35, 0.08, distance_m), size_px)
}
