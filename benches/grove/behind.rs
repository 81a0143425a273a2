//! Twice as many trees, all of the new ones behind the camera: frames of both scenes in turns, so that a busy machine slows both alike.

use sphereboard::Result;
use sphereboard::grove::SceneFile;
use sphereboard::grove::path::Key;
use sphereboard::grove::scene::SpeciesEntry;

use crate::site::{How, Row, Site, keep, quantile};

const TURNS: usize = 101;

pub fn run(job: &str) -> Result<()> {
    let file = SceneFile { method: "billboard".to_owned(), trees: 20_000, size_px: [640, 360], ..SceneFile::default() };
    let mut file = SceneFile { species: vec![SpeciesEntry::new("birch")], ..file };
    (file.terrain.ground_width_m, file.terrain.ground_depth_m, file.terrain.ground_step_m) = (1200.0, 1200.0, 12.0);
    file.terrain.relief_m = 0.0;
    file.key = vec![Key { time_s: 0.0, eye: [0.0, 12.0, -100.0].into(), target: [0.0, 8.0, -200.0].into() }];
    let (mut whole, mut half) = (Site::open(&file)?, Site::open(&file)?);
    half.scene.planted.retain(|tree| tree.position.z < -100.0);
    let stock = crate::site::grown(&file)?;
    half.grove = sphereboard::grove::drive::Grove::plant(&half.renderer, &half.scene, &stock)?;
    // The same number again, behind.
    let mut planted = half.scene.planted.clone();
    planted.extend(whole.scene.planted.iter().filter(|tree| tree.position.z > 40.0).take(planted.len()));
    whole.scene.planted = planted;
    whole.grove = sphereboard::grove::drive::Grove::plant(&whole.renderer, &whole.scene, &stock)?;
    let (shot, how) = (half.middle(), How::default());
    let mut ratios = vec![];
    let mut sent = [vec![], vec![]];
    let mut rows = [Row::default(), Row::default()];
    for turn in 0..TURNS + 4 {
        // A camera that moves a little, so that culling is part of it.
        let mut shot = shot.clone();
        shot.camera.eye.x += 0.01 * turn as f32;
        let [a, b] = [half.frame_ms(&shot, &how)?, whole.frame_ms(&shot, &how)?];
        if turn >= 4 {
            ratios.push(b / a);
            sent[0].push(half.renderer.uploaded_bytes());
            sent[1].push(whole.renderer.uploaded_bytes());
        }
    }
    for (row, site) in rows.iter_mut().zip([&mut half, &mut whole]) {
        site.grove.tally(&mut site.renderer)?;
        let info = &site.renderer.gpu.info;
        row.job = job.to_owned();
        row.method = file.method.clone();
        row.trees = site.scene.planted.len();
        row.frames = TURNS;
        row.seen = site.grove.crowd().trees_seen();
        row.draws = site.renderer.counted().draws;
        row.adapter = format!("{}, {} {}", info.name, info.driver, info.driver_info);
    }
    rows[0].how = if sent[0] == sent[1] { "the same bytes".to_owned() } else { "other bytes".to_owned() };
    rows[1].how = format!("{:.4}", quantile(ratios, 0.5));
    keep(job, &rows)
}
