//! Each method alone on the same scene: birches on level ground that widens with their number, so that they stand equally dense, seen by
//! a camera that goes round in the middle. Image error is FLIP over the pixels of trees against `geometry`, in the picture of a hundred.

use sphereboard::Result;
use sphereboard::grove::SceneFile;
use sphereboard::grove::against::tree_flip;
use sphereboard::grove::scene::SpeciesEntry;
use sphereboard::render::Picture;

use crate::site::{How, Row, Site, grown, keep, renderer};

pub const TREES: [u64; 7] = [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000];
/// Of these a picture is taken.
pub const PICTURED: u64 = 100;
/// A frame that takes longer ends it: ten times as many trees would tell no more.
const SLOWEST_MS: f64 = 1000.0;

fn scene(method: &str, trees: u64) -> SceneFile {
    let mut file = SceneFile {
        method: method.to_owned(),
        trees,
        size_px: [640, 360],
        frames: 60,
        path: "orbit".to_owned(),
        ..SceneFile::default()
    };
    file.species = vec![SpeciesEntry::new("birch")];
    let side = (40.0 * trees as f64).sqrt().max(60.0);
    (file.terrain.ground_width_m, file.terrain.ground_depth_m) = (side, side);
    file.terrain.ground_step_m = side / 60.0;
    file.terrain.relief_m = 0.0;
    file.planting.clearings = 0.0;
    (file.camera.camera_radius_m, file.camera.camera_overview_m) = (40.0, 14.0);
    file
}

fn pictured(file: &SceneFile) -> Result<Picture> {
    Site::open(file)?.picture(0.0)
}

pub fn run(job: &str, method: &str) -> Result<()> {
    let stock = grown(&scene(method, 1))?;
    let mut rows: Vec<Row> = vec![];
    for trees in TREES {
        let mut site = Site::planted(renderer()?, &scene(method, trees), &stock, 0.0)?;
        let (mut row, _) = site.drive(job, &How::default())?;
        if trees == PICTURED {
            let (truth, empty) = (pictured(&scene("geometry", trees))?, pictured(&scene("geometry", 0))?);
            row.flip = tree_flip(&truth.color, &site.picture(0.0)?.color, &empty.color)?;
        }
        eprintln!("  {trees} trees: {:.1} ms", row.median_ms);
        rows.push(row);
        keep(job, &rows)?;
        if rows.last().is_some_and(|row| row.median_ms > SLOWEST_MS) {
            break;
        }
    }
    Ok(())
}
