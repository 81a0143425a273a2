//! Light, shadow, wind and mips, measured in pictures of simple trees.

mod common;

use std::f32::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use common::software_renderer;
use glam::{Vec2, Vec3};
use image::{Rgba, RgbaImage};
use sphereboard::geom::Surface;
use sphereboard::gpu::layout::Instance;
use sphereboard::model::{Material, Part, Wrap};
use sphereboard::render::{Background, Camera, Picture, Projection, Renderer, Shot, Stage, Stand, WindParams};

/// Where the ball hangs, and its radius, metres.
const HUNG: Vec3 = Vec3::new(0.0, 4.0, 0.0);
const RADIUS: f32 = 1.0;

/// A ball in the air whose texture goes round it; a crown when `texture` is given, bare and solid otherwise.
fn ball(texture: Option<RgbaImage>) -> Part {
    const ROUND: u32 = 32;
    const UP: u32 = 16;
    let mut surface = Surface::default();
    for row in 0..=UP {
        for column in 0..=ROUND {
            let (u, v) = (column as f32 / ROUND as f32, row as f32 / UP as f32);
            let ((sa, ca), (se, ce)) = ((TAU * u).sin_cos(), (PI * (0.5 - v)).sin_cos());
            let normal = Vec3::new(sa * ce, se, ca * ce);
            surface.mesh.positions.push(HUNG + RADIUS * normal);
            surface.normals.push(normal);
            surface.uvs.push(Vec2::new(u, v));
        }
    }
    let at = |row: u32, column: u32| row * (ROUND + 1) + column;
    for row in 0..UP {
        surface.mesh.quads.extend((0..ROUND).map(|c| [at(row, c), at(row + 1, c), at(row + 1, c + 1), at(row, c + 1)]));
    }
    let crown_center = texture.is_some().then_some(HUNG);
    let material = match texture {
        Some(texture) => {
            Material { texture: Some(Arc::new(texture)), wrap: Wrap::Clamp, alpha_cutoff: Some(0.5), ..Material::default() }
        }
        None => Material { factor: [0.4, 0.4, 0.4, 1.0], ..Material::default() },
    };
    Part { name: "ball".to_owned(), surface, material, crown_center }
}

/// An upright strip, seen from both sides, from `bottom` to `top` metres; its texture stands upright on it.
fn strip(half_width: f32, bottom: f32, top: f32, texture: Option<RgbaImage>) -> Part {
    const ROWS: u32 = 24;
    let mut surface = Surface::default();
    for row in 0..=ROWS {
        let up = row as f32 / ROWS as f32;
        for side in [-1.0, 1.0] {
            surface.mesh.positions.push(Vec3::new(side * half_width, bottom + up * (top - bottom), 0.0));
            surface.normals.push(Vec3::Z);
            surface.uvs.push(Vec2::new(0.5 + 0.5 * side, 1.0 - up));
        }
    }
    surface.mesh.quads.extend((0..ROWS).map(|r| [2 * r, 2 * r + 1, 2 * r + 3, 2 * r + 2]));
    let material = Material { texture: texture.map(Arc::new), two_sided: true, wrap: Wrap::Clamp, ..Material::default() };
    Part { name: "strip".to_owned(), surface, material, crown_center: None }
}

/// Leaves: a picture of which about the given share is there, in specks of `speck` texels, all of one colour.
fn leaves(share: u32, speck: u32) -> RgbaImage {
    RgbaImage::from_fn(512, 512, |x, y| {
        let mut h = (x / speck).wrapping_mul(0x9E37_79B1) ^ (y / speck).wrapping_mul(0x85EB_CA77);
        h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
        h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
        Rgba([90, 130, 50, if (h ^ (h >> 15)) % 100 < share { 255 } else { 0 }])
    })
}

fn sun(azimuth_deg: f32, elevation_deg: f32) -> Vec3 {
    let ((sa, ca), (se, ce)) = (azimuth_deg.to_radians().sin_cos(), elevation_deg.to_radians().sin_cos());
    Vec3::new(sa * ce, se, ca * ce)
}

/// From the front, ten metres of height in the picture.
fn shot(stage: Stage, background: Background) -> Shot {
    let camera = parallel(Vec3::new(0.0, 5.0, 0.0), 0.0, 5.0);
    Shot { stage, background, toward_sun: sun(30.0, 45.0), ..Shot::new(camera, [256, 256]) }
}

fn parallel(target: Vec3, elevation_rad: f32, half_height_m: f32) -> Camera {
    let camera = Camera::orbit(target, 0.0, elevation_rad, 50.0);
    Camera { projection: Projection::Orthographic { half_height_m, near_m: 1.0, far_m: 120.0 }, ..camera }
}

/// Straight down on the ground about the foot, 20 m to a side: x is right, z is down in the picture.
fn from_above(toward_sun: Vec3) -> Shot {
    Shot { camera: parallel(Vec3::ZERO, FRAC_PI_2, 10.0), toward_sun, ..shot(Stage::Lit, Background::Sky) }
}

fn take(renderer: &mut Renderer, shot: &Shot, parts: &[Part]) -> Picture {
    let tree = renderer.upload(parts).unwrap();
    renderer.picture(shot, &[Stand { tree: &tree, instances: &[Instance::IDENTITY] }]).unwrap()
}

fn brightness(picture: &Picture, x: u32, y: u32) -> f32 {
    picture.color.get_pixel(x, y).0[..3].iter().map(|&v| f32::from(v)).sum::<f32>() / 3.0
}

/// Mean brightness round a place on the ground of [`from_above`], within half a metre.
fn ground_at(picture: &Picture, x_m: f32, z_m: f32) -> f32 {
    let px = |m: f32| (12.8 * (m + 10.0)) as u32;
    let near: Vec<_> = (0..144).map(|i| brightness(picture, px(x_m) + i % 12 - 6, px(z_m) + i / 12 - 6)).collect();
    near.iter().sum::<f32>() / near.len() as f32
}

#[test]
fn a_shadow_falls_on_the_side_away_from_the_sun_and_moves_with_it() {
    let Some(mut renderer) = software_renderer() else { return };
    for azimuth in [0.0, 70.0, 160.0, 290.0] {
        for crown in [ball(None), ball(Some(leaves(100, 4)))] {
            let toward_sun = sun(azimuth, 40.0);
            // With a thin trunk, so that the ball is not the middle of what the sun sees.
            let picture = take(&mut renderer, &from_above(toward_sun), &[crown, strip(0.05, 0.0, 3.0, None)]);
            let shadow = HUNG - toward_sun * (HUNG.y / toward_sun.y);
            let (dark, bright) = (ground_at(&picture, shadow.x, shadow.z), ground_at(&picture, -shadow.x, -shadow.z));
            assert!(dark < 0.75 * bright, "sun at {azimuth}: {dark} in the shadow, {bright} opposite");
        }
    }
}

#[test]
fn gaps_of_a_crown_let_the_sun_through() {
    let Some(mut renderer) = software_renderer() else { return };
    let toward_sun = sun(90.0, 60.0);
    let shadow = HUNG - toward_sun * (HUNG.y / toward_sun.y);
    let at = |renderer: &mut Renderer, share| {
        let picture = take(renderer, &from_above(toward_sun), &[ball(Some(leaves(share, 32)))]);
        ground_at(&picture, shadow.x, shadow.z)
    };
    let (closed, half, open) = (at(&mut renderer, 100), at(&mut renderer, 50), at(&mut renderer, 0));
    assert!(closed + 0.2 * (open - closed) < half && half < open - 0.2 * (open - closed), "{closed} {half} {open}");
}

#[test]
fn a_shadow_begins_at_the_foot_of_what_casts_it() {
    let Some(mut renderer) = software_renderer() else { return };
    let toward_sun = sun(0.0, 45.0);
    let mut shot = from_above(toward_sun);
    shot.camera = parallel(Vec3::ZERO, FRAC_PI_2, 0.5);
    let picture = take(&mut renderer, &shot, &[strip(0.2, 0.0, 6.0, None)]);
    // 256 pixels a metre; the strip is a line along x, its shadow runs up the picture.
    let lit = brightness(&picture, 128, 200);
    for behind in [15, 30, 60] {
        let found = brightness(&picture, 128, 128 - behind);
        assert!(found < 0.7 * lit, "{behind} px behind the foot: {found} of {lit}");
    }
}

#[test]
fn what_faces_the_sun_does_not_shadow_itself() {
    let Some(mut renderer) = software_renderer() else { return };
    for crown in [ball(None), ball(Some(leaves(100, 4)))] {
        let mut shot = shot(Stage::Lit, Background::Black);
        shot.camera = parallel(HUNG, 0.0, 1.2);
        shot.toward_sun = sun(20.0, 20.0);
        let picture = take(&mut renderer, &shot, &[crown]);
        // Within 0.8 of the radius brightness changes slowly: a speck of shadow would be a step.
        let inside = |x: u32, y: u32| Vec2::new(x as f32 - 128.0, y as f32 - 128.0).length() < 0.8 * 106.0;
        for (x, y) in (0..255).flat_map(|y| (0..255).map(move |x| (x, y))).filter(|&(x, y)| inside(x, y)) {
            let step = (brightness(&picture, x, y) - brightness(&picture, x + 1, y)).abs();
            assert!(step < 6.0, "{step} at {x} {y}");
        }
    }
}

#[test]
fn without_light_a_surface_shows_its_texture() {
    let Some(mut renderer) = software_renderer() else { return };
    let colors = [[200, 30, 90], [12, 180, 60], [255, 255, 255], [0, 0, 0], [77, 78, 79], [5, 90, 250]];
    let texture = RgbaImage::from_fn(8, 96, |_, y| {
        let [r, g, b] = colors[y as usize / 16];
        Rgba([r, g, b, 255])
    });
    let picture = take(&mut renderer, &shot(Stage::Unshaped, Background::Sky), &[strip(2.0, 0.0, 10.0, Some(texture))]);
    for (i, color) in colors.iter().enumerate() {
        let found = picture.color.get_pixel(128, (256.0 * (i as f32 + 0.5) / 6.0) as u32).0;
        assert!((0..3).all(|c| found[c].abs_diff(color[c]) <= 1), "{found:?} instead of {color:?}");
    }
}

#[test]
fn no_wind_is_the_same_to_the_byte_at_any_time() {
    let Some(mut renderer) = software_renderer() else { return };
    let parts = [ball(Some(leaves(60, 8))), strip(0.2, 0.0, 4.0, None)];
    let still = take(&mut renderer, &shot(Stage::Lit, Background::Sky), &parts);
    let wind = WindParams { wind: 0.0, wind_from_deg: 33.0, time: 7.3 };
    let later = take(&mut renderer, &Shot { wind, ..shot(Stage::Lit, Background::Sky) }, &parts);
    assert!(still.color == later.color && still.depth_m == later.depth_m);
    let wind = WindParams { wind: 9.0, ..WindParams::default() };
    let blown = take(&mut renderer, &Shot { wind, ..shot(Stage::Lit, Background::Sky) }, &parts);
    assert!(still.color != blown.color);
}

#[test]
fn wind_bends_the_top_with_it_and_leaves_the_foot() {
    let Some(mut renderer) = software_renderer() else { return };
    let strip = [strip(0.5, 0.0, 9.0, None)];
    // Mean column of what is there in a row, metres.
    let place = |picture: &Picture, height_m: f32| {
        let y = (25.6 * (10.0 - height_m)) as u32;
        let there: Vec<f32> = (0..256).filter(|x| picture.depth_m[(y * 256 + x) as usize].is_finite()).map(|x| x as f32).collect();
        (there.iter().sum::<f32>() / there.len() as f32 - 127.5) / 25.6
    };
    let mut swing = vec![];
    for time in [0.0, 0.7, 1.9, 3.1, 55.5] {
        let wind = WindParams { wind: 10.0, time, ..WindParams::default() };
        let picture = take(&mut renderer, &Shot { wind, ..shot(Stage::Unshaped, Background::Black) }, &strip);
        let (foot, half, top) = (place(&picture, 0.1), place(&picture, 4.5), place(&picture, 8.5));
        assert!(foot.abs() < 0.021, "the foot stays: {foot}");
        assert!(half > 0.01 && top > 2.0 * half && top < 1.0, "it leans to the right, away from the wind: {half} {top}");
        swing.push(top);
    }
    assert!(swing.iter().any(|t| (t - swing[0]).abs() > 0.05), "it swings: {swing:?}");
}

#[test]
fn shadows_sway_with_their_trees() {
    let Some(mut renderer) = software_renderer() else { return };
    // A speck on the ground: the tree is as high as the ball hangs, not as high as the ball.
    let mut foot = ball(None);
    foot.surface.mesh.positions.iter_mut().for_each(|p| *p = 0.001 * (*p - HUNG) + 0.01 * Vec3::Y);
    let shadow_of = |renderer: &mut Renderer, wind: f64| {
        let mut shot = from_above(sun(0.0, 45.0));
        shot.wind = WindParams { wind, ..WindParams::default() };
        let picture = take(renderer, &shot, &[ball(None), foot.clone()]);
        // Mean column of the dark ground beyond the ball's own place.
        let bright = ground_at(&picture, 8.0, 8.0);
        let dark =
            (0..256).flat_map(|x| (40..100).map(move |y| (x, y))).filter(|&(x, y)| brightness(&picture, x, y) < 0.75 * bright);
        let columns: Vec<f32> = dark.map(|(x, _)| x as f32).collect();
        columns.iter().sum::<f32>() / columns.len() as f32
    };
    let (still, blown) = (shadow_of(&mut renderer, 0.0), shadow_of(&mut renderer, 12.0));
    assert!(blown > still + 0.5, "{still} {blown}");
}

#[test]
fn from_below_the_ground_is_not_there() {
    let Some(mut renderer) = software_renderer() else { return };
    let mut shot = shot(Stage::Lit, Background::Sky);
    shot.camera = Camera::orbit(HUNG, 0.3, -0.6, 12.0);
    let picture = take(&mut renderer, &shot, &[ball(None)]);
    assert!(picture.depth_m[..256].iter().chain(&picture.depth_m[255 * 256..]).all(|d| d.is_infinite()));
    assert!(picture.depth_m[128 * 256 + 128].is_finite(), "the crown hides nothing from there");
}

#[test]
fn a_crown_of_20_pixels_covers_what_it_covers_when_seen_large() {
    let Some(mut renderer) = software_renderer() else { return };
    const VIEWS: u32 = 12;
    for (share, speck) in [(30, 3), (50, 4), (70, 2), (90, 5), (98, 3)] {
        let tree = renderer.upload(&[ball(Some(leaves(share, speck)))]).unwrap();
        // Area of what is there, in pixels of the small picture, in which the ball is 20 pixels high.
        let mut covered = |side: u32, view: u32| {
            let mut shot = shot(Stage::Unshaped, Background::Alpha);
            let camera = Camera::orbit(HUNG, 0.52 * view as f32, 0.2, 50.0);
            let projection = Projection::Orthographic { half_height_m: 1.2, near_m: 1.0, far_m: 120.0 };
            (shot.camera, shot.size_px) = (Camera { projection, ..camera }, [side, side]);
            let picture = renderer.picture(&shot, &[Stand { tree: &tree, instances: &[Instance::IDENTITY] }]).unwrap();
            let alpha: f64 = picture.color.pixels().map(|p| f64::from(p.0[3]) / 255.0).sum();
            alpha * (24.0 / f64::from(side)).powi(2)
        };
        let pairs: Vec<_> = (0..VIEWS).map(|view| (covered(24, view), covered(24 * 24, view))).collect();
        let (small, large) = pairs.iter().fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1));
        assert!((small / large - 1.0f64).abs() < 0.05, "{share} % in specks of {speck}: {small:.1} px instead of {large:.1}");
        // A closed crown keeps its area in every view; of a thin one, pixels that are there or not show a random sample each time.
        let closed = share >= 90;
        assert!(!closed || pairs.iter().all(|(small, large)| (small / large - 1.0).abs() < 0.05), "{share} %: {pairs:.0?}");
    }
}
