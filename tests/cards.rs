//! Cards drawn: those that turn, their normal maps and light, octahedral impostors, and pictures for stand-ins taken by the device.

mod common;

use std::f32::consts::FRAC_PI_2;
use std::sync::{Arc, LazyLock};

use common::props::*;
use common::{software_gpu, software_renderer};
use glam::{Vec2, Vec3};
use image::{Rgba, RgbaImage};
use sphereboard::Seed;
use sphereboard::geom::Bounds;
use sphereboard::metrics::{flip, over, silhouette, silhouette_iou};
use sphereboard::model::reference::Asked;
use sphereboard::model::{Material, Part};
use sphereboard::raster::{Layer, View, to_linear};
use sphereboard::render::{
    Background, Camera, GpuCapture, Picture, Projection, Renderer, Shot, Show, Stage, Stand, Tree, WindParams,
};
use sphereboard::repr::card::{Card, captured, cut_out, window_around};
use sphereboard::repr::{BuiltPart, BuiltTree, Capture, Drawn, Facing, Octahedral, Scope, Seen, SoftwareCapture, TreeSource};

#[test]
fn a_turned_card_faces_whoever_sees_it_and_the_sun() {
    let Some(mut renderer) = software_renderer() else { return };
    let card = |upright| BuiltPart {
        part: tall([0.3, 0.5, 0.2]),
        drawn: Drawn::Turned { pivot: Vec3::Y * 5.0, upright },
        seen: Seen::default(),
    };
    let upright = renderer.upload_built(&built(vec![card(true)])).unwrap();
    let wholly = renderer.upload_built(&built(vec![card(false)])).unwrap();
    let level = area_px(&take(&mut renderer, &shot_from(0.0, 0.0, 40.0, 200), &upright)) as f32;
    for (azimuth, elevation, turn) in
        [(0.0, 0.0, 0.0), (130.0, 0.0, 0.0), (250.0, 0.0, 77.0), (15.0, 60.0, 10.0), (15.0, 90.0, 0.0)]
    {
        let shot = shot_from(azimuth, elevation, 40.0, 200);
        let mut area = |tree| {
            let instances = [turned_by(turn)];
            area_px(&renderer.picture(&shot, &[Stand { tree, instances: &instances }]).unwrap()) as f32
        };
        let (cylinder, sphere) = (area(&upright), area(&wholly));
        assert!((sphere / level - 1.0).abs() < 0.03, "{sphere} of {level} from {azimuth}, {elevation}");
        let expected = level * elevation.to_radians().cos();
        assert!((cylinder - expected).abs() < 0.04 * level, "{cylinder} instead of {expected} from {azimuth}, {elevation}");
    }
    // Its shadow is as wide from wherever the sun shines.
    for sun in [0.0f32, 45.0, 90.0, 200.0] {
        let mut shot = shot_from(0.0, 90.0, 60.0, 256);
        let (sin, cos) = sun.to_radians().sin_cos();
        (shot.stage, shot.background, shot.toward_sun) = (Stage::Lit, Background::Sky, Vec3::new(sin, 1.0, cos));
        let picture = take(&mut renderer, &shot, &upright);
        let bare = renderer.picture(&shot, &[Stand { tree: &upright, instances: &[] }]).unwrap();
        let is_dark = |(p, bare): (&Rgba<u8>, &Rgba<u8>)| f32::from(p.0[1]) < 0.8 * f32::from(bare.0[1]);
        let dark = picture.color.pixels().zip(bare.color.pixels()).filter(|pair| is_dark(*pair)).count() as f32;
        // The ground is 65 m away.
        let px_per_m = shot.camera.px_per_m(256)[1] * 0.5 / 65.0;
        assert!((dark / (px_per_m * px_per_m) / 60.0 - 1.0).abs() < 0.15, "shadow of {} m² at {sun}", dark / px_per_m.powi(2));
    }
}

#[test]
fn normal_maps_lean_as_gltf_has_it_and_the_same_way_from_behind() {
    let Some(mut renderer) = software_renderer() else { return };
    let leaning = Vec3::new(0.48, 0.6, 0.64);
    let texel = Rgba([leaning.x, leaning.y, leaning.z, 1.0].map(|v| (255.0 * (0.5 + 0.5 * v)).round() as u8));
    let mut part = tall([0.5; 3]);
    part.material.normal_texture = Some(Arc::new(RgbaImage::from_pixel(4, 4, texel)));
    // The same mirrored: u runs to the left, and so does red.
    let mut mirrored = part.clone();
    mirrored.surface.uvs.iter_mut().for_each(|uv| uv.x = 1.0 - uv.x);
    for (part, right) in [(part, 1.0), (mirrored, -1.0)] {
        let tree = renderer.upload(&[part]).unwrap();
        for (azimuth, elevation) in [(0.0, 0.0), (40.0, 20.0), (300.0, 50.0), (180.0, 0.0), (200.0, 30.0)] {
            let shot = Shot { show: Show::Normals, ..shot_from(azimuth, elevation, 40.0, 64) };
            let picture = take(&mut renderer, &shot, &tree);
            let shown = picture.color.get_pixel(32, 32).0;
            let found = Vec3::from([shown[0], shown[1], shown[2]].map(|v| 2.0 * to_linear(v) - 1.0));
            let front = if (90.0..270.0).contains(&azimuth) { -1.0 } else { 1.0 };
            let expected = leaning * Vec3::new(right, 1.0, front);
            assert!((found - expected).length() < 0.03, "{found} instead of {expected} from {azimuth}, {elevation}");
        }
    }
}

static BIRCH: LazyLock<TreeSource> = LazyLock::new(|| TreeSource::open("birch", &Asked::default(), Seed(1)).unwrap().0);

/// A picture of the whole birch from an azimuth, on a card through its axis.
fn birch_card(azimuth_rad: f32, longest_px: u32) -> Part {
    let axes = View::axes_from(azimuth_rad, 0.0);
    let window = window_around(BIRCH.points(Scope::Tree), axes).unwrap();
    let card = Card { name: "card".to_owned(), axes, window, plane: 0.0, size_px: Card::size_px(window, longest_px) };
    captured(&SoftwareCapture::new(), &BIRCH.parts(Scope::Tree), &[card]).unwrap().remove(0).unwrap()
}

/// The birch in full, as a billboard, as crossed planes.
fn birches(renderer: &Renderer) -> [Tree; 3] {
    let bounds = BIRCH.box_of_all().unwrap();
    let upload = |parts| renderer.upload_built(&BuiltTree::new(bounds, parts)).unwrap();
    let full = BIRCH.parts(Scope::Tree).into_iter().cloned().map(BuiltPart::still).collect();
    let (front, side) = (birch_card(0.0, 384), birch_card(FRAC_PI_2, 384));
    let turned =
        BuiltPart { part: front.clone(), drawn: Drawn::Turned { pivot: Vec3::ZERO, upright: true }, seen: Seen::default() };
    [upload(full), upload(vec![turned]), upload(vec![BuiltPart::still(front), BuiltPart::still(side)])]
}

fn birch_shot(azimuth_deg: f32, elevation_deg: f32, side_px: u32) -> Shot {
    let bounds = BIRCH.box_of_all().unwrap();
    let (azimuth, elevation) = (azimuth_deg.to_radians(), elevation_deg.to_radians());
    let camera = Camera::orbit(Vec3::Y * bounds.center().y, azimuth, elevation, 3.2 * bounds.size().y);
    Shot { background: Background::Alpha, ..Shot::new(camera, [side_px, side_px]) }
}

/// Mean colour of what is there, CIELAB (D65).
fn mean_lab(picture: &RgbaImage) -> Vec3 {
    let there: Vec<Vec3> =
        picture.pixels().filter(|p| p.0[3] >= 128).map(|p| Vec3::from([p.0[0], p.0[1], p.0[2]].map(to_linear))).collect();
    let c = there.iter().sum::<Vec3>() / there.len() as f32;
    let xyz = [
        c.dot(Vec3::new(0.4124, 0.3576, 0.1805)) / 0.9505,
        c.dot(Vec3::new(0.2126, 0.7152, 0.0722)),
        c.dot(Vec3::new(0.0193, 0.1192, 0.9505)) / 1.089,
    ];
    let [x, y, z] = xyz.map(|t: f32| if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 });
    Vec3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
}

#[test]
fn cards_are_lit_like_the_tree_that_they_were_taken_of() {
    let Some(mut renderer) = software_renderer() else { return };
    let trees = birches(&renderer);
    let mut unlike = [0.0f32; 2];
    let suns = [(0.0, 40.0), (60.0, 30.0), (120.0, 40.0), (180.0, 25.0), (270.0, 25.0), (40.0, 75.0)];
    for (azimuth, elevation) in suns {
        for view in [0.0, 90.0] {
            let toward_sun = View::axes_from(f32::to_radians(azimuth), f32::to_radians(elevation))[2];
            let shot = Shot { toward_sun, ..birch_shot(view, 5.0, 200) };
            let [full, turned, crossed] = trees.each_ref().map(|tree| mean_lab(&take(&mut renderer, &shot, tree).color));
            let differences = [(turned - full).length(), (crossed - full).length()];
            println!("sun {azimuth} {elevation} view {view}: {full} {differences:?}");
            assert!(differences.iter().all(|d| *d < 10.0), "{differences:?} with the sun at {azimuth}, {elevation}");
            unlike.iter_mut().zip(differences).for_each(|(sum, d)| *sum += d / (2 * suns.len()) as f32);
        }
    }
    assert!(unlike.iter().all(|d| *d < 5.0), "mean ΔE {unlike:?}");
}

#[test]
fn near_and_far_sway_together() {
    let Some(mut renderer) = software_renderer() else { return };
    let trees = birches(&renderer);
    let silhouettes = |renderer: &mut Renderer, wind: f64, time: f64| {
        let wind = WindParams { wind, time, ..WindParams::default() };
        let shot = Shot { stage: Stage::Unshaped, wind, ..birch_shot(0.0, 0.0, 240) };
        trees.each_ref().map(|tree| take(renderer, &shot, tree))
    };
    // Thin foliage falls between pixels: compared are blocks of them.
    let iou = |a: &Picture, b: &Picture| {
        let blocks = |p: &Picture| silhouette(&image::imageops::thumbnail(&p.color, 60, 60));
        silhouette_iou(&blocks(a), &blocks(b)).unwrap()
    };
    let still = silhouettes(&mut renderer, 0.0, 0.0);
    for time in [0.0, 1.3, 4.1] {
        let blown = silhouettes(&mut renderer, 14.0, time);
        for card in [1, 2] {
            let (calm, windy) = (iou(&still[0], &still[card]), iou(&blown[0], &blown[card]));
            let unmoved = iou(&blown[0], &still[card]);
            println!("{card} at {time}: {calm:.3} still, {windy:.3} blown, {unmoved:.3} had it not followed");
            assert!(
                windy > calm - 0.08 && windy > unmoved + 0.03,
                "{card} at {time}: {windy} blown, {calm} still, {unmoved} unmoved"
            );
        }
    }
}

/// Views from `grid`² directions of `parts`, as a part.
fn octahedral(parts: &[Part], grid: u32, frame_px: u32) -> BuiltPart {
    let impostor = Octahedral { grid, center: Vec3::Y * 5.0, radius_m: 5.0 };
    let (mut color, mut normal) =
        (RgbaImage::new(grid * frame_px, grid * frame_px), RgbaImage::new(grid * frame_px, grid * frame_px));
    let parts: Vec<&Part> = parts.iter().collect();
    for (i, j) in (0..grid * grid).map(|k| (k % grid, k / grid)) {
        let toward = impostor.direction(i, j);
        let axes = View::axes_from(toward.x.atan2(toward.z), toward.y.clamp(-1.0, 1.0).asin());
        let view = View {
            axes,
            center: impostor.center,
            half_size_m: Vec2::splat(impostor.radius_m),
            slab_m: View::ALL,
            width_px: frame_px,
            height_px: frame_px,
        };
        let taken = SoftwareCapture::new().take(&parts, &[view]).unwrap().remove(0);
        image::imageops::replace(&mut color, &cut_out(&taken).unwrap(), i64::from(i * frame_px), i64::from(j * frame_px));
        // What is not there gets the depth of its surroundings, so that lines of sight past an outline still find what stands out there.
        let side = frame_px as usize;
        let mut depth = Layer::from_fn(side, side, |x, y| {
            let depth_m = taken.depth_m[y * side + x];
            Vec3::X.with_x(if depth_m.is_finite() { depth_m } else { 0.0 }).extend(f32::from(u8::from(depth_m.is_finite())))
        });
        depth.bleed();
        let frame = RgbaImage::from_fn(frame_px, frame_px, |x, y| {
            let at = y as usize * side + x as usize;
            let n = axes.map(|axis| axis.dot(taken.normal[at]));
            let [x, y] = [n[0], n[1]].map(|along| along / (1.0 + n[2].max(0.0)));
            // Blue: all of it foliage.
            Rgba([x, y, 1.0, depth.texels[at].x / impostor.radius_m].map(|v| (255.0 * (0.5 + 0.5 * v)).round() as u8))
        });
        image::imageops::replace(&mut normal, &frame, i64::from(i * frame_px), i64::from(j * frame_px));
    }
    let mut part = board(Vec2::new(-5.0, 0.0), Vec2::new(5.0, 10.0), 0.0, [1.0; 3]);
    part.material = Material {
        texture: Some(Arc::new(color)),
        normal_texture: Some(Arc::new(normal)),
        alpha_cutoff: Some(0.5),
        ..part.material
    };
    BuiltPart { part, drawn: Drawn::Octahedral(impostor), seen: Seen::default() }
}

#[test]
fn an_octahedral_impostor_looks_like_what_it_was_taken_of() {
    let Some(mut renderer) = software_renderer() else { return };
    let solid = renderer.upload_built(&still(&lumps())).unwrap();
    let impostor = renderer.upload_built(&built(vec![octahedral(&lumps(), 8, 96)])).unwrap();
    for (azimuth, elevation, distance, turn) in [
        (0.0, 0.0, 30.0, 0.0),
        (33.0, 10.0, 30.0, 0.0),
        (140.0, 35.0, 30.0, 25.0),
        (250.0, 62.0, 18.0, 0.0),
        (0.0, 90.0, 30.0, 0.0),
        (77.0, 20.0, 12.0, 190.0),
    ] {
        for show in [Show::Picture, Show::Normals] {
            let shot = Shot { show, ..shot_from(azimuth, elevation, distance, 200) };
            let instances = [turned_by(turn)];
            let [truth, found] =
                [&solid, &impostor].map(|tree| renderer.picture(&shot, &[Stand { tree, instances: &instances }]).unwrap());
            let overlap = iou(&truth, &found);
            let off: Vec<f32> = truth
                .depth_m
                .iter()
                .zip(&found.depth_m)
                .filter(|(a, b)| a.is_finite() && b.is_finite())
                .map(|(a, b)| (a - b).abs())
                .collect();
            let depth_m = off.iter().sum::<f32>() / off.len() as f32;
            let unlike = flip(&over(&truth.color, [0; 3]), &over(&found.color, [0; 3])).unwrap();
            println!("{azimuth} {elevation} {distance} {show:?}: IoU {overlap:.3}, depth {depth_m:.3} m, {unlike:?}");
            assert!(overlap > 0.94, "{overlap} from {azimuth}, {elevation}");
            assert!(depth_m < 0.2, "{depth_m} m from {azimuth}, {elevation}");
            // Very near, the pictures are stretched.
            assert!(unlike.mean < 1.6 / f64::from(distance), "{unlike:?} from {azimuth}, {elevation}");
        }
    }
}

#[test]
fn an_octahedral_impostor_casts_the_shadow_of_what_it_was_taken_of() {
    let Some(mut renderer) = software_renderer() else { return };
    let solid = renderer.upload_built(&still(&lumps())).unwrap();
    let impostor = renderer.upload_built(&built(vec![octahedral(&lumps(), 8, 96)])).unwrap();
    for toward_sun in [Vec3::new(0.6, 1.0, 0.3), Vec3::new(-0.5, 0.8, -0.9), Vec3::new(-1.0, 0.4, 0.2)] {
        let mut shot = shot_from(25.0, 40.0, 45.0, 220);
        (shot.stage, shot.background, shot.toward_sun) = (Stage::Lit, Background::Sky, toward_sun);
        let [truth, found] = [&solid, &impostor].map(|tree| take(&mut renderer, &shot, tree));
        let unlike = flip(&over(&truth.color, [0; 3]), &over(&found.color, [0; 3])).unwrap();
        println!("{toward_sun}: {unlike:?}");
        assert!(unlike.mean < 0.04, "{unlike:?} with the sun at {toward_sun}");
    }
}

#[test]
fn from_everywhere_something_is_drawn_and_nothing_is_no_number() {
    let Some(mut renderer) = software_renderer() else { return };
    let facing = Facing::Toward { axis: Vec3::Z, cosines: [0.0, 0.5], level: true, both_sides: true };
    let turned = |upright| Drawn::Turned { pivot: Vec3::Y * 5.0, upright };
    let mut mapped = tall([0.4; 3]);
    mapped.material.normal_texture = Some(Arc::new(RgbaImage::from_pixel(1, 1, Rgba([128, 128, 255, 255]))));
    mapped.material.alpha_cutoff = Some(0.5);
    let mut across = mapped.clone();
    across.surface.mesh.positions.iter_mut().for_each(|p| *p = Vec3::new(p.z, p.y, -p.x));
    across.surface.normals = vec![Vec3::X; 4];
    let trees = [
        ("crossed", built(vec![BuiltPart::still(mapped.clone()), BuiltPart::still(across.clone())])),
        ("upright", built(vec![BuiltPart { part: mapped.clone(), drawn: turned(true), seen: Seen::default() }])),
        ("turned", built(vec![BuiltPart { part: mapped.clone(), drawn: turned(false), seen: Seen::default() }])),
        ("facing", built(vec![BuiltPart::still(mapped).seen(Seen { facing, ..Seen::default() }), BuiltPart::still(across)])),
        ("octahedral", built(vec![octahedral(&lumps(), 4, 32)])),
    ]
    .map(|(name, tree)| (name, renderer.upload_built(&tree).unwrap()));
    let middle = Vec3::Y * 5.0;
    let looking = |eye: Vec3, target: Vec3| {
        let back = (eye - target).normalize();
        let camera = Camera::orbit(target, back.x.atan2(back.z), back.y.asin(), (eye - target).length());
        Camera { eye, ..camera }
    };
    let cameras = [
        ("straight above", looking(Vec3::Y * 40.0, Vec3::ZERO), false),
        ("edge-on", looking(Vec3::new(40.0, 5.0, 0.0), middle), false),
        ("below", looking(Vec3::new(10.0, -20.0, 10.0), middle), false),
        ("inside", looking(Vec3::new(0.7, 5.2, 1.4), middle), true),
        ("at the pivot", looking(middle, middle + Vec3::NEG_Z), true),
        ("behind the near plane", looking(Vec3::new(0.0, 5.0, 0.004), middle), true),
    ];
    for (name, tree) in &trees {
        for (place, camera, near) in &cameras {
            let parallel = Projection::Orthographic { half_height_m: 8.0, near_m: -50.0, far_m: 100.0 };
            for camera in [*camera, Camera { projection: parallel, ..*camera }] {
                let shot = Shot { camera, stage: Stage::Lit, ..shot_from(0.0, 0.0, 10.0, 96) };
                let picture = take(&mut renderer, &shot, tree);
                let perspective = matches!(camera.projection, Projection::Perspective { .. });
                assert!(!perspective || is_sound(&picture), "{name} from {place}");
                // An upright card is a line from straight above, and who stands in a plane sees past it.
                let hidden = (*place == "straight above" && *name != "turned" && *name != "octahedral") || (*near && perspective);
                assert!(hidden || area_px(&picture) > 50, "{name} from {place}: {} px", area_px(&picture));
            }
        }
    }
}

#[test]
fn the_device_takes_the_pictures_that_the_software_rasteriser_takes() {
    let Some(gpu) = software_gpu() else { return };
    let device = GpuCapture::new(&gpu).unwrap();
    let parts = BIRCH.parts(Scope::Tree);
    let tilted = View::axes_from(0.7, 0.5);
    let [window, upright] = [tilted, View::axes_from(2.0, 0.0)].map(|axes| window_around(BIRCH.points(Scope::Tree), axes).unwrap());
    let slab = Bounds { min: upright.min, max: upright.max.with_z(0.3 * upright.max.z) };
    let views = [
        View::of_window(tilted, window, 150, 210),
        View { slab_m: View::ALL, ..View::of_window(tilted, window, 600, 90) },
        View::of_window(View::axes_from(2.0, 0.0), slab, 128, 256),
        View::of_window(
            View::axes_from(0.3, FRAC_PI_2),
            window_around(BIRCH.points(Scope::Tree), View::axes_from(0.3, FRAC_PI_2)).unwrap(),
            97,
            97,
        ),
    ];
    let (own, software) = (device.take(&parts, &views).unwrap(), SoftwareCapture::new().take(&parts, &views).unwrap());
    for (i, (own, software)) in own.iter().zip(&software).enumerate() {
        let covered = |c: &sphereboard::raster::Capture| c.coverage.pixels().map(|p| f64::from(p.0[0]) / 255.0).sum::<f64>();
        let (a, b) = (covered(own), covered(software));
        let unlike = flip(&over(&software.color, [255; 3]), &over(&own.color, [255; 3])).unwrap();
        let both = (0..own.normal.len()).filter(|i| own.coverage.as_raw()[*i] > 0 && software.coverage.as_raw()[*i] > 0);
        let angles: Vec<f32> =
            both.clone().map(|i| own.normal[i].dot(software.normal[i]).clamp(-1.0, 1.0).acos().to_degrees()).collect();
        let depths: Vec<f32> = both.map(|i| (own.depth_m[i] - software.depth_m[i]).abs()).collect();
        let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
        println!("{i}: covered {a:.0} and {b:.0}, {unlike:?}, normals {:.2}°, depth {:.4} m", mean(&angles), mean(&depths));
        assert!((a / b - 1.0).abs() < 0.01 && unlike.mean < 0.02, "{i}: covered {a} and {b}, {unlike:?}");
        assert!(mean(&angles) < 3.0 && mean(&depths) < 0.05, "{i}: {}°, {} m", mean(&angles), mean(&depths));
        assert!(
            own.coverage
                .pixels()
                .all(|p| (f32::from(p.0[0]) * 9.0 / 255.0).fract() < 0.06 || (f32::from(p.0[0]) * 9.0 / 255.0).fract() > 0.94)
        );
    }
    assert!(device.take(&[], &views).unwrap()[0].coverage.pixels().all(|p| p.0[0] == 0));
    assert!(device.take(&parts, &[View { width_px: 0, ..views[0] }]).is_err());
}
