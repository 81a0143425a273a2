//! The whole pipeline at its defaults, on the samples of `photos/` and, where they are, on real photographs.

use std::path::{Path, PathBuf};

use sphereboard::geom::Topology;
use sphereboard::model::glb;
use sphereboard::model::pipeline::{self, ModelParams, ModelRun, Request, View};
use sphereboard::photo::decode::{DecodeParams, decode};
use sphereboard::photo::{Hints, Photo};
use sphereboard::{Result, Seed, files};

fn decoded(path: &Path) -> Photo {
    decode(path, &DecodeParams::default()).expect("the photograph is readable")
}

fn model(photo: Photo) -> Result<ModelRun> {
    let views = [View { photo, hints: Hints::default(), azimuth_rad: 0.0 }];
    let params = ModelParams::default();
    let sources = vec!["photo.jpg".to_owned()];
    pipeline::run(&Request { views: &views, params: &params, height_is_given: false, seed: Seed(1), sources }, &|_| ())
}

fn sample(name: &str) -> ModelRun {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("photos/{name}.jpg"));
    model(decoded(&path)).expect("the samples can be modelled")
}

/// Seams at most 1.10, texel contrast at least 0.85 and the mean colour within ΔE2000 4 of the crown's: what issue 2 asks for.
fn assert_good_texture(name: &str, run: &ModelRun) {
    for atlas in &run.atlases {
        assert!(atlas.seam_after <= 1.10, "{name}: seam contrast {}", atlas.seam_after);
        assert!(atlas.contrast >= 0.85, "{name}: texel contrast {}", atlas.contrast);
        assert!(
            atlas.seam_before.is_finite() && atlas.contrast_before > 0.0,
            "{name}: {} {}",
            atlas.seam_before,
            atlas.contrast_before
        );
    }
    for exemplar in &run.exemplars {
        assert!(exemplar.delta_e <= 4.0, "{name}: ΔE2000 {}", exemplar.delta_e);
    }
}

#[test]
fn the_samples_become_closed_crowns_with_good_textures_that_survive_their_file() {
    for name in ["oak", "spruce"] {
        let run = sample(name);
        assert_good_texture(name, &run);
        for crown in &run.model.crowns {
            assert!(Topology::of(&crown.surface.welded()).is_sphere(), "{name}: merging equal positions closes the crown");
        }
        let bytes = glb::write(&run.model).unwrap();
        assert_eq!(glb::read(&bytes).unwrap(), run.model, "{name}");
    }
}

#[test]
fn real_photographs_become_good_textures_too() {
    let Some(shared) = files::shared_folder() else {
        println!("SKIPPED: ../shared is not there, so no real photographs are modelled");
        return;
    };
    // Small and different: a smooth and a coarse crown, three stems, open foliage, a conifer.
    let names = [
        "pairs/tdus_celtis_v6.png",
        "pairs/tdus_magnolia_three_s3.png",
        "pairs/tdus_styphnolobium_v3.png",
        "pairs/tdus_cedrus_deodara_hq.png",
        "single/picea_abies_200px.png",
        "single/sequoiadendron_giganteum_24.jpg",
    ];
    let paths: Vec<PathBuf> = names.iter().map(|name| shared.join("photos").join(name)).filter(|path| path.exists()).collect();
    if paths.len() < names.len() {
        println!("SKIPPED: {} photographs of ../shared/photos that are not there", names.len() - paths.len());
    }
    for path in paths {
        let run = model(decoded(&path)).expect("these have been modelled before");
        assert_good_texture(&path.display().to_string(), &run);
    }
}
