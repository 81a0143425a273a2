//! The scenes of the bars, as they come with the program.

use sphereboard::Result;
use sphereboard::grove::SceneFile;
use sphereboard::grove::against::tree_flip;
use sphereboard::grove::scene::preset;

use crate::site::{How, Row, Site, keep};

pub struct Bar {
    pub preset: &'static str,
    /// Instead of the scene's.
    pub trees: Option<u64>,
    pub paper: &'static str,
    /// Least frames a second without and with a GPU.
    pub fps: [Option<f64>; 2],
}

const fn bar(preset: &'static str, paper: &'static str, fps: [Option<f64>; 2]) -> Bar {
    Bar { preset, trees: None, paper, fps }
}

pub const BARS: [Bar; 8] = [
    bar("she-540", "22 fps (Quadro K4000)", [Some(22.0), Some(300.0)]),
    Bar { trees: Some(50), ..bar("she-fig18", "–", [None; 2]) },
    Bar { trees: Some(100), ..bar("she-fig18", "–", [None; 2]) },
    Bar { trees: Some(150), ..bar("she-fig18", "20 fps", [Some(20.0), None]) },
    bar("lluch-200", "15 fps (GeForce 2 MX)", [Some(30.0), None]),
    bar("truelsen-10k", "20–50 fps (Radeon X800)", [Some(10.0), Some(200.0)]),
    bar("rebollo-100", "40 % fewer polygons", [None; 2]),
    bar("million", "– (75,000 named as others' record)", [Some(2.0), Some(60.0)]),
];

impl Bar {
    pub fn job(&self) -> String {
        self.trees.map_or_else(|| self.preset.to_owned(), |trees| format!("{}:{trees}", self.preset))
    }
}

pub fn run(job: &str, name: &str, trees: Option<u64>) -> Result<()> {
    let mut file = preset(name)?;
    file.trees = trees.unwrap_or(file.trees);
    let mut site = Site::open(&file)?;
    let mut rows = vec![site.drive(job, &How::default())?.0];
    if name == "rebollo-100" {
        // Against all leaves: how many triangles are saved, what that gains, and what is seen of it.
        let shares = [0.2, 0.5, 0.8];
        let ours = shares.map(|share| site.picture(share));
        drop(site);
        file.method = "geometry".to_owned();
        let mut whole = Site::open(&file)?;
        rows.push(whole.drive(job, &How::default())?.0);
        let theirs = shares.map(|share| whole.picture(share));
        let mut bare = Site::open(&SceneFile { trees: 0, ..file })?;
        let mut errors = vec![];
        for ((ours, theirs), share) in ours.into_iter().zip(theirs).zip(shares) {
            errors.push(tree_flip(&theirs?.color, &ours?.color, &bare.picture(share)?.color)?);
        }
        rows[0].flip = errors.iter().sum::<f64>() / errors.len() as f64;
    }
    keep(job, &rows)
}

/// The bar's row, and those beside it.
pub fn rows(bar: &Bar) -> Vec<Row> {
    crate::site::recalled(&bar.job())
}
