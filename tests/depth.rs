//! Depth against arithmetic: a ball of 590,000 triangles, whose facets lie within 0.04 mm of the sphere, drawn by both projections.
//!
//! The pictures and what [`metrics::difference`] says of them are left in `target/tmp/depth/`, where `sphereboard-tools check-depth` has
//! OpenImageIO read and compare them too.

mod common;

use std::f64::consts::{PI, TAU};
use std::fs;
use std::path::{Path, PathBuf};

use common::software_renderer;
use glam::{DVec3, Vec3};
use image::RgbaImage;
use serde_json::{Value, json};
use sphereboard::geom::Surface;
use sphereboard::gpu::layout::Instance;
use sphereboard::metrics;
use sphereboard::model::{Material, Part};
use sphereboard::raster::{exr_depth, png};
use sphereboard::render::{Background, Camera, Picture, Projection, Shot, Stage, Stand};

const CENTER: DVec3 = DVec3::new(0.3, 4.0, -0.2);
const RADIUS: f64 = 2.0;
/// Rows of facets; twice as many columns.
const ROWS: u32 = 384;
const SIZE_PX: [u32; 2] = [360, 240];

/// Largest relative error of a depth.
const TOLERANCE: f64 = 1e-4;
/// Cosine between the line of sight and the surface's normal under which a facet's distance from the sphere, seen at a slant, would count.
const GRAZING: f64 = 0.1;

fn ball() -> Part {
    let mut surface = Surface::default();
    for (row, column) in (0..=ROWS).flat_map(|row| (0..=2 * ROWS).map(move |column| (row, column))) {
        let (around, down) = (TAU * f64::from(column) / f64::from(2 * ROWS), PI * f64::from(row) / f64::from(ROWS));
        let normal = DVec3::new(around.sin() * down.sin(), down.cos(), around.cos() * down.sin());
        surface.mesh.positions.push((CENTER + RADIUS * normal).as_vec3());
        surface.normals.push(normal.as_vec3());
    }
    let at = |row: u32, column: u32| row * (2 * ROWS + 1) + column;
    for row in 0..ROWS {
        let quad = |c| [at(row, c), at(row + 1, c), at(row + 1, c + 1), at(row, c + 1)];
        surface.mesh.quads.extend((0..2 * ROWS).map(quad));
    }
    Part { name: "ball".to_owned(), surface, material: Material::default(), crown_center: None }
}

/// Where a pixel's line of sight begins and where it goes; one unit of it is one metre of distance from the viewer's plane.
fn ray(camera: &Camera, x: u32, y: u32) -> (DVec3, DVec3) {
    let [width, height] = SIZE_PX.map(f64::from);
    let [right, up, backward] = camera.axes.map(Vec3::as_dvec3);
    let (across, along) = (2.0 * (f64::from(x) + 0.5) / width - 1.0, 1.0 - 2.0 * (f64::from(y) + 0.5) / height);
    let on_plane = |half: f64| right * (across * half * width / height) + up * (along * half);
    let eye = camera.eye.as_dvec3();
    match camera.projection {
        Projection::Perspective { fov_y_rad, .. } => (eye, on_plane((0.5 * f64::from(fov_y_rad)).tan()) - backward),
        Projection::Orthographic { half_height_m, .. } => (eye + on_plane(f64::from(half_height_m)), -backward),
    }
}

/// Distance to the sphere from the viewer's plane and the cosine at which the line of sight meets it; `None` where it passes by.
fn true_depth(camera: &Camera, x: u32, y: u32) -> Option<(f64, f64)> {
    let (from, along) = ray(camera, x, y);
    let to_center = CENTER - from;
    let (a, half_b) = (along.length_squared(), along.dot(to_center));
    let root = half_b * half_b - a * (to_center.length_squared() - RADIUS * RADIUS);
    let depth = (root >= 0.0).then(|| (half_b - root.sqrt()) / a)?;
    let normal = (from + depth * along - CENTER) / RADIUS;
    Some((depth, -normal.dot(along) / along.length()))
}

/// How far from the sphere a pixel's line of sight passes it by, metres.
fn passes_by(camera: &Camera, x: u32, y: u32) -> f64 {
    let (from, along) = ray(camera, x, y);
    (CENTER - from).cross(along).length() / along.length() - RADIUS
}

fn left() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("depth");
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Leaves two files and what we say of their differences.
fn leave(name: &str, files: [(&str, Vec<u8>); 2], found: metrics::Difference, threshold: f64, relative: Option<f64>) {
    let folder = left();
    let names = files.map(|(file, bytes)| {
        fs::write(folder.join(file), bytes).unwrap();
        file.to_owned()
    });
    let row: Value = json!({"files": names, "threshold": threshold, "ours": found, "largest_relative": relative});
    fs::write(folder.join(name).with_extension("json"), row.to_string()).unwrap();
}

/// Compares a picture of the ball with the sphere, pixel by pixel.
fn check(name: &str, camera: Camera, picture: &Picture) {
    let (mut ours, mut truth) = (vec![f32::INFINITY; picture.depth_m.len()], vec![f32::INFINITY; picture.depth_m.len()]);
    let (mut seen, mut on_the_rim, mut worst) = (0, 0, 0.0f64);
    for (i, &depth) in picture.depth_m.iter().enumerate() {
        let (x, y) = (i as u32 % SIZE_PX[0], i as u32 / SIZE_PX[0]);
        match true_depth(&camera, x, y) {
            Some((there, slant)) if slant >= GRAZING => {
                let error = (f64::from(depth) / there - 1.0).abs();
                assert!(error <= TOLERANCE, "{name}: {depth} m at {x}, {y}, where the sphere is {there} m away");
                (ours[i], truth[i]) = (depth, there as f32);
                worst = worst.max(error);
                seen += 1;
            }
            Some(_) => on_the_rim += 1,
            // The facets lie inside the sphere: beside it there is nothing at all, once corners have been moved onto the grid that the
            // rasteriser counts in, 1/256 px or finer.
            None if passes_by(&camera, x, y) > 1e-3 * RADIUS => {
                assert!(depth == f32::INFINITY, "{name}: {depth} m at {x}, {y}, beside the sphere");
            }
            None => on_the_rim += 1,
        }
    }
    println!("{name}: {seen} pixels, largest relative error {worst:.1e}");
    assert!(seen > 8_000 && on_the_rim < seen / 50, "{seen} pixels of the ball, {on_the_rim} on its rim");
    let found = metrics::difference(&ours, &truth, 1, 1e-4).unwrap();
    let files = [format!("{name}.exr"), format!("{name}_sphere.exr")];
    let bytes = [exr_depth(SIZE_PX, &ours).unwrap(), exr_depth(SIZE_PX, &truth).unwrap()];
    let [a, b] = bytes;
    leave(name, [(&files[0], a), (&files[1], b)], found, 1e-4, Some(TOLERANCE));
}

#[test]
fn the_depth_of_a_ball_is_that_of_a_sphere_by_both_projections() {
    let Some(mut renderer) = software_renderer() else { return };
    let tree = renderer.upload(&[ball()]).unwrap();
    let perspective = Camera::orbit(CENTER.as_vec3() + Vec3::new(0.9, -0.3, 0.1), 0.7, 0.3, 12.0);
    let near = Camera::orbit(CENTER.as_vec3(), -2.0, -0.4, 5.0);
    let far_m = 400.0;
    let parallel = Projection::Orthographic { half_height_m: 2.6, near_m: 0.5, far_m };
    let cameras =
        [("perspective", perspective), ("perspective_near", near), ("parallel", Camera { projection: parallel, ..perspective })];
    for (name, camera) in cameras {
        let shot = Shot { stage: Stage::Unshaped, background: Background::Alpha, ..Shot::new(camera, SIZE_PX) };
        let picture = renderer.picture(&shot, &[Stand { tree: &tree, instances: &[Instance::IDENTITY] }]).unwrap();
        check(name, camera, &picture);
    }
}

/// What our own comparison says of two pictures, for OpenImageIO to repeat; needs no device.
#[test]
fn two_pictures_are_left_with_our_figures_of_them() {
    let wave = |x: u32, y: u32, shift: u32| {
        let v = |a: u32, b: u32| ((x * a + y * b + shift * (x / 7 + y / 5)) % 256) as u8;
        image::Rgba([v(3, 1), v(1, 5), v(7, 2), if (x + shift) % 31 < 25 { 255 } else { v(2, 2) }])
    };
    let [a, b] = [0, 3].map(|shift| RgbaImage::from_fn(97, 53, |x, y| wave(x, y, shift)));
    let threshold = 0.1;
    let found = metrics::difference_of_pictures(&a, &b, threshold).unwrap();
    assert!(found.over > 0 && found.mean > 0.0);
    let files = [("wave_a.png", png(&a).unwrap()), ("wave_b.png", png(&b).unwrap())];
    leave("wave", files, found, threshold, None);
}
