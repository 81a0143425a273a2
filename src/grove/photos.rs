//! A folder of photographs as the species of a grove: each becomes a model as `sphereboard model` makes it, and is planted where an
//! inventory names it.

use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::scene::SpeciesEntry;
use super::stock::{StandIn, Stock, of_source};
use crate::model::TreeModel;
use crate::model::pipeline::{self, ModelParams, Request, View};
use crate::photo::{DecodeParams, Hints, decode};
use crate::repr::{Capture, TreeSource};
use crate::{Error, Result, Seed, Warning};

/// Endings of files that may be photographs.
const ENDINGS: [&str; 7] = ["jpg", "jpeg", "png", "webp", "tif", "tiff", "bmp"];

/// What came of a folder.
#[derive(Debug, Default)]
pub struct Modelled {
    /// One kind of tree for each photograph that could be modelled, in order of their names.
    pub stock: Vec<Stock>,
    /// Those that could not, and why.
    pub failed: Vec<Warning>,
}

/// The photographs in a folder, in order of their names. Other files are left alone, among them what this program has drawn beside photographs.
///
/// # Errors
/// [`Error::Photos`] for a folder that cannot be read or holds none.
pub fn find(folder: &Path) -> Result<Vec<PathBuf>> {
    let refused = |found: String| Error::Photos { folder: folder.to_owned(), found };
    let entries = fs::read_dir(folder).map_err(|cause| refused(cause.to_string()))?;
    let is_photo = |path: &PathBuf| {
        let known = path.extension().is_some_and(|own| ENDINGS.iter().any(|ending| own.eq_ignore_ascii_case(ending)));
        let drawn = path.file_stem().is_some_and(|stem| stem.to_string_lossy().contains('.'));
        known && !drawn && path.is_file()
    };
    let mut photos: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_photo).collect();
    photos.sort();
    // A species is numbered by 16 bits, and each takes a texture.
    match photos.len() {
        0 => Err(refused("none".to_owned())),
        many if many > MOST => Err(refused(format!("{many} of them"))),
        _ => Ok(photos),
    }
}

/// So many photographs a grove may have: each has textures of its own.
pub const MOST: usize = 4096;

/// Models every photograph of `photos` and builds what stands for it. One that fails does not stop the others. `told` hears of each that is done.
///
/// # Errors
/// [`Error::Photos`] where none could be modelled, with the reason of the first.
pub fn stock<'a>(
    photos: &[PathBuf],
    by: impl Into<StandIn<'a>>,
    seed: Seed,
    capture: &dyn Capture,
    told: &(dyn Fn(&str) + Sync),
) -> Result<Modelled> {
    let by = by.into();
    let one = |path: &PathBuf| {
        let made = modelled(path, seed).and_then(|(model, warnings)| {
            let source = TreeSource::model(name_of(path), model);
            let entry = SpeciesEntry::new(name_of(path));
            let made = of_source(&source, &entry, 1.0, (by, None), seed, capture)?;
            let mut size = made.size;
            size.also.push(path.file_name().unwrap_or_default().to_string_lossy().into_owned());
            Ok(Stock { size, warnings: warnings.into_iter().chain(made.warnings).collect(), built: made.built })
        });
        told(&name_of(path));
        made.map_err(|cause| {
            let (name, why) = (path.display().to_string(), cause.to_string());
            Warning::new("photo-failed", if why.contains(&name) { why } else { format!("{name}: {why}") })
        })
    };
    let all: Vec<_> = photos.par_iter().map(one).collect();
    let mut modelled = Modelled::default();
    for made in all {
        match made {
            Ok(stock) => modelled.stock.push(stock),
            Err(why) => modelled.failed.push(why),
        }
    }
    match modelled.failed.first() {
        Some(first) if modelled.stock.is_empty() => {
            let folder = photos[0].parent().unwrap_or(Path::new("")).to_owned();
            Err(Error::Photos { folder, found: format!("none that can be modelled ({})", first.message) })
        }
        _ => Ok(modelled),
    }
}

/// As `sphereboard model` does without options. What it says of a height that was guessed is left out: the inventory says how high.
fn modelled(path: &Path, seed: Seed) -> Result<(TreeModel, Vec<Warning>)> {
    let photo = decode::decode(path, &DecodeParams::default())?;
    let view = View { photo, hints: Hints::default(), azimuth_rad: 0.0 };
    let request = Request {
        views: std::slice::from_ref(&view),
        params: &ModelParams::default(),
        height_is_given: false,
        seed,
        sources: path.file_name().map(|name| name.to_string_lossy().into_owned()).into_iter().collect(),
    };
    let run = pipeline::run(&request, &|_| ()).map_err(|error| match error {
        Error::InView { cause, .. } => *cause,
        other => other,
    })?;
    let warnings = run.warnings.into_iter().filter(|warning| warning.code != "height-guessed").collect();
    Ok((run.model, warnings))
}

/// What an inventory may call it.
fn name_of(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grove::{SceneFile, lay_out};
    use crate::repr::SoftwareCapture;

    const PHOTOS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/photos");

    /// A folder with two small photographs, one file that is none, and a picture that shows no tree.
    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for name in ["oak", "spruce"] {
            let photo = image::open(format!("{PHOTOS}/{name}.jpg")).unwrap();
            photo.thumbnail(400, 400).save(folder.path().join(format!("{name}.jpg"))).unwrap();
        }
        image::RgbImage::from_pixel(60, 60, image::Rgb([90, 140, 220])).save(folder.path().join("sky.png")).unwrap();
        fs::write(folder.path().join("README.md"), "none").unwrap();
        fs::write(folder.path().join("oak.tree.png"), "drawn, not taken").unwrap();
        folder
    }

    #[test]
    fn photographs_stand_where_the_inventory_says_and_as_high_and_one_that_fails_is_told() {
        let folder = folder();
        let photos = find(folder.path()).unwrap();
        assert_eq!(photos.iter().map(|path| name_of(path)).collect::<Vec<_>>(), ["oak", "sky", "spruce"]);
        let modelled = stock(&photos, "sphere-board", Seed(1), &SoftwareCapture::new(), &|_| ()).unwrap();
        assert_eq!((modelled.stock.len(), modelled.failed.len()), (2, 1));
        assert!(modelled.failed[0].message.contains("sky.png"), "{}", modelled.failed[0].message);

        let list = folder.path().join("trees.csv");
        fs::write(&list, "x,y,photo,height\n-10,5,oak.jpg,20\n10,5,spruce,7\n20,-8,OAK.JPG,\n").unwrap();
        let sizes: Vec<_> = modelled.stock.iter().map(|stock| stock.size.clone()).collect();
        let file = SceneFile { inventory: Some(list), ..SceneFile::default() };
        let scene = lay_out(&file, &sizes, &mut |_| ()).unwrap();
        let stands: Vec<_> = scene.planted.iter().map(|tree| (tree.species, tree.position.x, tree.position.z)).collect();
        assert_eq!(stands, [(0, -10.0, -5.0), (1, 10.0, -5.0), (0, 20.0, 8.0)]);
        let height = |tree: usize| scene.planted[tree].scale * sizes[usize::from(scene.planted[tree].species)].height_m;
        assert!((height(0) - 20.0).abs() < 1e-3 && (height(1) - 7.0).abs() < 1e-3 && scene.planted[2].scale == 1.0);
    }

    #[test]
    fn a_folder_without_photographs_and_one_of_which_none_shows_a_tree_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(find(folder.path()).unwrap_err().to_string().contains("photograph"));
        assert!(find(&folder.path().join("none")).is_err());
        fs::write(folder.path().join("broken.jpg"), "no picture").unwrap();
        let photos = find(folder.path()).unwrap();
        let told = stock(&photos, "auto", Seed(1), &SoftwareCapture::new(), &|_| ()).unwrap_err().to_string();
        assert!(told.contains("broken.jpg"), "{told}");
    }
}
