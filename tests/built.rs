//! Built trees drawn: parts that come and go with distance and side, in any order, and every method from above and from inside.

mod common;

use std::f32::consts::FRAC_PI_2;
use std::sync::{Arc, LazyLock};

use common::props::*;
use common::software_renderer;
use glam::{Vec2, Vec3};
use image::{Rgba, RgbaImage};
use sphereboard::Seed;
use sphereboard::gpu::layout::Instance;
use sphereboard::metrics::{flip, over};
use sphereboard::model::reference::Asked;
use sphereboard::model::{Material, glb};
use sphereboard::plant::presets::preset;
use sphereboard::render::{Background, Camera, Projection, Renderer, Shot, Stage, Stand, Tree, WindParams};
use sphereboard::repr::{
    self, BuiltPart, BuiltTree, Drawn, Facing, Fade, METHODS, Order, REFERENCE_FOCAL_PX, Representation, Seen, Settings,
    SoftwareCapture, TreeSource,
};

#[test]
fn a_part_comes_and_goes_with_its_size_in_the_picture() {
    let Some(mut renderer) = software_renderer() else { return };
    let seen = Seen { anchor: Vec3::Y * 5.0, appears: [4.0, 6.0], vanishes: [10.0, 14.0], ..Seen::default() };
    let part = BuiltPart::still(tall([0.2, 0.5, 0.1])).seen(seen);
    let fading = renderer.upload_built(&built(vec![part.clone()])).unwrap();
    let whole = renderer.upload(&[part.part]).unwrap();
    for heights in [3.0, 4.5, 5.0, 5.5, 7.0, 9.9, 11.0, 13.0, 14.5] {
        for scale in [1.0, 2.5] {
            let mut shot = shot_from(0.0, 0.0, 1.0, 256);
            let distance = scale * metres(heights, &shot);
            shot.camera = Camera::orbit(Vec3::Y * 5.0 * scale, 0.0, 0.0, distance);
            let instance = Instance { scale, ..Instance::IDENTITY };
            let mut parallel = shot.clone();
            let Projection::Perspective { fov_y_rad, .. } = shot.camera.projection else { panic!("perspective") };
            let half_height_m = distance * (0.5 * fov_y_rad).tan();
            parallel.camera.projection = Projection::Orthographic { half_height_m, near_m: 0.1, far_m: 1000.0 };
            for shot in [&shot, &parallel] {
                let mut area = |tree| area_px(&renderer.picture(shot, &[Stand { tree, instances: &[instance] }]).unwrap()) as f32;
                let found = area(&fading) / area(&whole);
                assert!((found - seen.share_at(heights)).abs() < 0.04, "{found} at {heights}, scale {scale}");
            }
        }
    }
}

#[test]
fn fades_by_alpha_raise_the_cutoff() {
    let Some(mut renderer) = software_renderer() else { return };
    // Alpha grows from left to right.
    let ramp = RgbaImage::from_fn(32, 4, |x, _| Rgba([90, 130, 50, (8 * x + 4) as u8]));
    let mut part = tall([1.0; 3]);
    part.material = Material { texture: Some(Arc::new(ramp)), alpha_cutoff: Some(0.2), ..part.material };
    let seen = Seen { anchor: Vec3::Y * 5.0, vanishes: [8.0, 24.0], fade: Fade::Alpha, ..Seen::default() };
    let tree = renderer.upload_built(&built(vec![BuiltPart::still(part).seen(seen)])).unwrap();
    for heights in [6.0, 12.0, 16.0, 20.0] {
        let mut shot = shot_from(0.0, 0.0, 1.0, 512);
        shot.camera = Camera::orbit(Vec3::Y * 5.0, 0.0, 0.0, metres(heights, &shot));
        let picture = take(&mut renderer, &shot, &tree);
        let px_per_m = REFERENCE_FOCAL_PX / (heights * HEIGHT_M);
        let row: Vec<usize> = (0..512).filter(|x| picture.depth_m[256 * 512 + x].is_finite()).collect();
        let cutoff = 1.0 - seen.share_at(heights) * 0.8;
        // The left edge of what is there, metres from the card's.
        let left = (row[0] as f32 - 256.0) / px_per_m + 3.0;
        assert!((left / 6.0 - cutoff).abs() < 0.02 + 1.5 / (6.0 * px_per_m), "{left} at {heights}: cutoff {cutoff}");
    }
}

#[test]
fn a_side_is_seen_from_its_side_alone_and_turns_with_its_tree() {
    let Some(mut renderer) = software_renderer() else { return };
    let seen = |both_sides| Seen {
        anchor: Vec3::Y * 5.0,
        facing: Facing::Toward { axis: Vec3::Z, cosines: [0.3, 0.7], level: true, both_sides },
        ..Seen::default()
    };
    let ball = ball(Vec3::Y * 5.0, Vec3::splat(2.0), [0.3; 3]);
    let whole = renderer.upload(std::slice::from_ref(&ball)).unwrap();
    for both_sides in [false, true] {
        let seen = seen(both_sides);
        let tree = renderer.upload_built(&built(vec![BuiltPart::still(ball.clone()).seen(seen)])).unwrap();
        for turn in [0.0, 70.0] {
            for azimuth in [0.0, 50.0, 62.0, 90.0, 180.0, 235.0, 310.0f32] {
                let shot = shot_from(azimuth, 25.0, 30.0, 256);
                let mut area = |tree| {
                    let instances = [turned_by(turn)];
                    area_px(&renderer.picture(&shot, &[Stand { tree, instances: &instances }]).unwrap()) as f32
                };
                let found = area(&tree) / area(&whole);
                let (sin, cos) = (azimuth - turn).to_radians().sin_cos();
                let expected = seen.share_toward(Vec3::new(sin, 0.4, cos).normalize());
                assert!((found - expected).abs() < 0.05, "{found} instead of {expected} at {azimuth}, turned by {turn}");
            }
        }
    }
}

#[test]
fn a_sector_is_seen_from_its_azimuths_and_elevations_alone() {
    let Some(mut renderer) = software_renderer() else { return };
    let axis = Vec3::new(0.6, 0.0, 0.8);
    let seen = Seen {
        anchor: Vec3::Y * 5.0,
        facing: Facing::Sector { axis, cosines: [0.3, 0.7], rises: [0.1, 0.3], sinks: [0.6, 0.8] },
        ..Seen::default()
    };
    let ball = ball(Vec3::Y * 5.0, Vec3::splat(2.0), [0.3; 3]);
    let whole = renderer.upload(std::slice::from_ref(&ball)).unwrap();
    let tree = renderer.upload_built(&built(vec![BuiltPart::still(ball).seen(seen)])).unwrap();
    for azimuth in [37.0, 95.0, 180.0f32] {
        for elevation in [0.0, 11.0, 30.0, 44.0, 70.0f32] {
            let shot = shot_from(azimuth, elevation, 30.0, 256);
            let mut area = |tree| area_px(&take(&mut renderer, &shot, tree)) as f32;
            let found = area(&tree) / area(&whole);
            let ((sin, cos), (rise, level)) = (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
            let expected = seen.share_toward(Vec3::new(sin * level, rise, cos * level));
            assert!((found - expected).abs() < 0.05, "{found} instead of {expected} from {azimuth}, {elevation}");
        }
    }
}

/// A tree whose near and far levels, sides and instances fade into one another, parts in any order.
fn fading_tree(renderer: &Renderer, order: &[usize]) -> Tree {
    let anchor = Vec3::Y * 5.0;
    let mut parts: Vec<BuiltPart> =
        lumps().into_iter().map(|part| BuiltPart::still(part).seen(Seen::between(anchor, 0.0, 6.0, 0.9))).collect();
    parts.push(BuiltPart {
        part: board(Vec2::new(-2.5, 1.0), Vec2::new(2.5, 9.0), 0.1, [0.5, 0.4, 0.1]),
        drawn: Drawn::Turned { pivot: Vec3::ZERO, upright: true },
        seen: Seen::between(anchor, 9.0, f32::MAX, 0.8),
    });
    parts.push(BuiltPart::still(tall([0.1, 0.4, 0.5])).seen(Seen {
        anchor,
        facing: Facing::Toward { axis: Vec3::Z, cosines: [0.0, 1.0], level: false, both_sides: true },
        ..Seen::default()
    }));
    renderer.upload_built(&built(order.iter().map(|i| parts[*i].clone()).collect())).unwrap()
}

#[test]
fn the_order_of_parts_and_instances_never_shows() {
    let Some(mut renderer) = software_renderer() else { return };
    let at = |i: u32| Instance {
        position: [4.0 * (i % 4) as f32 - 6.0, 0.0, -7.0 * (i / 4) as f32],
        scale: 0.7 + 0.05 * i as f32,
        ..turned_by(40.0 * i as f32)
    };
    let instances: Vec<Instance> = (0..12).map(at).collect();
    let shuffled: Vec<Instance> = (0..12).map(|i| at((7 * i + 5) % 12)).collect();
    let (one, other) = (fading_tree(&renderer, &[0, 1, 2, 3, 4]), fading_tree(&renderer, &[3, 1, 4, 0, 2]));
    let shot = Shot { stage: Stage::Lit, background: Background::Sky, ..shot_from(20.0, 12.0, 40.0, 256) };
    let first = renderer.picture(&shot, &[Stand { tree: &one, instances: &instances }]).unwrap();
    let second = renderer.picture(&shot, &[Stand { tree: &other, instances: &shuffled }]).unwrap();
    assert!(first.depth_m == second.depth_m && first.color == second.color);
}

/// What every method of the table makes of a young tree, or of a photograph's model where it takes no other.
static ROWS: LazyLock<Vec<(&str, BuiltTree)>> = LazyLock::new(|| {
    let young = TreeSource::grown(preset("birch").unwrap(), Some(8.0), &Asked::default(), Seed(3)).unwrap().0;
    let oak = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/oak.glb")).unwrap();
    let sources = [young, TreeSource::model("oak".to_owned(), glb::read(&oak).unwrap())];
    let (settings, capture) = (Settings::default(), SoftwareCapture::new());
    let row = |method: &&'static dyn Representation| {
        let order = Order { method: method.id(), trunk: None, settings: &settings, seed: Seed(3) };
        let built = sources.iter().find_map(|source| repr::build(&order, source, &capture).ok());
        (method.id(), built.unwrap_or_else(|| panic!("{} takes neither", method.id())))
    };
    METHODS.iter().map(row).collect()
});

#[test]
fn the_order_of_a_methods_parts_never_shows() {
    let Some(mut renderer) = software_renderer() else { return };
    assert!(ROWS.iter().any(|(_, tree)| tree.parts.iter().any(|part| matches!(part.drawn, Drawn::Forest(_)))));
    // No method need fade by alpha: these rows are asked to as well.
    let by_alpha = ROWS.iter().filter(|(_, tree)| tree.levels.len() > 1).map(|(id, tree)| {
        let mut tree = tree.clone();
        tree.parts.iter_mut().for_each(|part| part.seen.fade = Fade::Alpha);
        (*id, tree)
    });
    for (id, tree) in ROWS.iter().cloned().chain(by_alpha) {
        let mut turned = tree.clone();
        turned.parts.reverse();
        turned.parts.rotate_left(tree.parts.len() / 3);
        let [one, other] = [&tree, &turned].map(|tree| renderer.upload_built(tree).unwrap());
        // In the midst of the first band in which something fades, and where all of it is seen.
        let ends = tree.parts.iter().map(|part| part.seen.vanishes).filter(|[from, to]| *to < 1e3 && from < to);
        let fading = ends.map(|[from, to]| 0.5 * (from + to)).reduce(f32::min);
        for level_distance in [Some(tree.levels[0].distance), fading].into_iter().flatten() {
            let camera = Camera::orbit(tree.bounds.center(), 0.4, 0.3, 2.5 * tree.height_m());
            // Unshaped, since how an outline grows is drawn by the number of its crown.
            let (stage, background) = (Stage::Unshaped, Background::Alpha);
            let shot = Shot { stage, background, level_distance: Some(level_distance), ..Shot::new(camera, [160; 2]) };
            let [a, b] = [&one, &other].map(|tree| take(&mut renderer, &shot, tree));
            let moved = a.depth_m.iter().zip(&b.depth_m).filter(|(a, b)| a != b).count();
            let unlike = flip(&over(&a.color, [0; 3]), &over(&b.color, [0; 3])).unwrap();
            println!("{id} at {level_distance}: {moved} of {} px, {unlike:?}", area_px(&a));
            // Where levels that fade into each other share a plane, both are as near, and the one drawn first shows.
            assert!(area_px(&a) > 50 && moved * 500 <= area_px(&a), "{id} at {level_distance}: {moved} px of {}", area_px(&a));
            assert!(unlike.mean < 0.03, "{id} at {level_distance}: {unlike:?}");
        }
    }
}

#[test]
fn every_method_stands_from_above_and_from_inside() {
    let Some(mut renderer) = software_renderer() else { return };
    for (id, built) in ROWS.iter() {
        let (tree, middle, high) = (renderer.upload_built(built).unwrap(), built.bounds.center(), built.height_m());
        // Upright cards are lines from straight above and below.
        let upright = built.parts.iter().all(|BuiltPart { part, drawn, .. }| match drawn {
            Drawn::Turned { upright, .. } => *upright,
            Drawn::Still => !part.surface.normals.is_empty() && part.surface.normals.iter().all(|n| n.y.abs() < 0.1),
            Drawn::Forest(_) | Drawn::Octahedral(_) => false,
        });
        for (place, elevation, heights) in
            [("above", FRAC_PI_2, 3.0), ("aslant", 1.2, 3.0), ("below", -0.6, 3.0), ("beside", 0.0, 3.0), ("inside", 0.3, 0.02)]
        {
            for azimuth in [0.0, 0.8, FRAC_PI_2] {
                let camera = Camera::orbit(middle, azimuth, elevation, heights * high);
                let parallel = Projection::Orthographic { half_height_m: 0.8 * high, near_m: -9.0 * high, far_m: 9.0 * high };
                for camera in [camera, Camera { projection: parallel, ..camera }] {
                    let shot = Shot { stage: Stage::Lit, background: Background::Alpha, ..Shot::new(camera, [96; 2]) };
                    let picture = take(&mut renderer, &shot, &tree);
                    let perspective = matches!(camera.projection, Projection::Perspective { .. });
                    assert!(!perspective || is_sound(&picture), "{id} from {place}");
                    let hidden = (upright && place == "above") || (place == "inside" && perspective);
                    assert!(hidden || area_px(&picture) > 30, "{id} from {place}, {azimuth}: {} px", area_px(&picture));
                }
            }
        }
    }
}

#[test]
fn a_still_camera_gives_the_same_bytes_and_sends_nothing_twice() {
    let Some(mut renderer) = software_renderer() else { return };
    let tree = fading_tree(&renderer, &[0, 1, 2, 3, 4]);
    let instances = [Instance::IDENTITY, Instance { position: [8.0, 0.0, -9.0], ..turned_by(30.0) }];
    let stands = [Stand { tree: &tree, instances: &instances }];
    let wind = |time| WindParams { wind: 0.0, time, ..WindParams::default() };
    let shot = Shot { stage: Stage::Lit, background: Background::Sky, wind: wind(0.0), ..shot_from(20.0, 12.0, 30.0, 200) };
    let first = renderer.picture(&shot, &stands).unwrap();
    assert!(renderer.uploaded_bytes() >= 64);
    let later = renderer.picture(&Shot { wind: wind(9.7), ..shot.clone() }, &stands).unwrap();
    assert_eq!(renderer.uploaded_bytes(), 0);
    assert!(first.depth_m == later.depth_m && first.color == later.color);
    let aside = [instances[0], Instance { position: [9.0, 0.0, -9.0], ..instances[1] }];
    renderer.picture(&shot, &[Stand { tree: &tree, instances: &aside }]).unwrap();
    assert!(renderer.uploaded_bytes() > 0);
}
