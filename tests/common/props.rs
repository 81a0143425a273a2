//! Trees made in code of boards and balls, and how tests look at them.

use std::f32::consts::{PI, TAU};

use glam::{Quat, Vec2, Vec3};
use sphereboard::geom::{Bounds, PolyMesh, Surface};
use sphereboard::gpu::layout::Instance;
use sphereboard::metrics::{silhouette, silhouette_iou};
use sphereboard::model::{Material, Part, Wrap};
use sphereboard::render::{Background, Camera, Picture, Projection, Renderer, Shot, Stage, Stand, Tree};
use sphereboard::repr::{BuiltPart, BuiltTree, REFERENCE_FOCAL_PX};

/// Height of the trees of these tests but the grown one, metres.
pub const HEIGHT_M: f32 = 10.0;

pub fn box_of_tree() -> Bounds {
    Bounds { min: Vec3::new(-3.0, 0.0, -3.0), max: Vec3::new(3.0, HEIGHT_M, 3.0) }
}

/// A rectangle that faces +Z, two-sided, its picture upright.
pub fn board(low: Vec2, high: Vec2, z: f32, color: [f32; 3]) -> Part {
    let positions =
        vec![Vec3::new(low.x, low.y, z), Vec3::new(high.x, low.y, z), Vec3::new(high.x, high.y, z), Vec3::new(low.x, high.y, z)];
    let surface = Surface {
        mesh: PolyMesh { positions, triangles: vec![], quads: vec![[0, 1, 2, 3]] },
        normals: vec![Vec3::Z; 4],
        uvs: vec![Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO],
        ..Surface::default()
    };
    let [r, g, b] = color;
    let material = Material { factor: [r, g, b, 1.0], two_sided: true, wrap: Wrap::Clamp, ..Material::default() };
    Part { name: "board".to_owned(), surface, material, crown_center: None }
}

/// A whole tree's rectangle.
pub fn tall(color: [f32; 3]) -> Part {
    board(Vec2::new(-3.0, 0.0), Vec2::new(3.0, HEIGHT_M), 0.0, color)
}

/// An ellipsoid.
pub fn ball(center: Vec3, radii: Vec3, color: [f32; 3]) -> Part {
    const ROUND: u32 = 48;
    const UP: u32 = 24;
    let mut surface = Surface::default();
    for row in 0..=UP {
        for column in 0..=ROUND {
            let (u, v) = (column as f32 / ROUND as f32, row as f32 / UP as f32);
            let ((sa, ca), (se, ce)) = ((TAU * u).sin_cos(), (PI * (0.5 - v)).sin_cos());
            let out = Vec3::new(sa * ce, se, ca * ce);
            surface.mesh.positions.push(center + radii * out);
            surface.normals.push((out / radii).normalize());
            surface.uvs.push(Vec2::new(u, v));
        }
    }
    let at = |row: u32, column: u32| row * (ROUND + 1) + column;
    for row in 0..UP {
        surface.mesh.quads.extend((0..ROUND).map(|c| [at(row, c), at(row + 1, c), at(row + 1, c + 1), at(row, c + 1)]));
    }
    let [r, g, b] = color;
    let material = Material { factor: [r, g, b, 1.0], alpha_cutoff: Some(0.5), ..Material::default() };
    Part { name: "ball".to_owned(), surface, material, crown_center: None }
}

/// Red, green and blue balls that hide one another: a tree that looks different from everywhere.
pub fn lumps() -> Vec<Part> {
    vec![
        ball(Vec3::new(0.0, 5.5, 0.0), Vec3::new(2.0, 3.5, 2.0), [0.1, 0.4, 0.1]),
        ball(Vec3::new(1.8, 4.0, 0.8), Vec3::splat(1.1), [0.6, 0.1, 0.1]),
        ball(Vec3::new(-1.2, 7.0, -1.4), Vec3::splat(1.3), [0.1, 0.1, 0.6]),
    ]
}

pub fn still(parts: &[Part]) -> BuiltTree {
    BuiltTree::new(box_of_tree(), parts.iter().cloned().map(BuiltPart::still).collect())
}

pub fn built(parts: Vec<BuiltPart>) -> BuiltTree {
    BuiltTree::new(box_of_tree(), parts)
}

pub fn shot_from(azimuth_deg: f32, elevation_deg: f32, distance_m: f32, side_px: u32) -> Shot {
    let camera = Camera::orbit(Vec3::Y * 0.5 * HEIGHT_M, azimuth_deg.to_radians(), elevation_deg.to_radians(), distance_m);
    Shot { stage: Stage::Unshaped, background: Background::Alpha, ..Shot::new(camera, [side_px, side_px]) }
}

/// The distance in metres at which the viewer of a picture stands so many heights from `anchor`, which is at the target.
pub fn metres(heights: f32, shot: &Shot) -> f32 {
    let Projection::Perspective { fov_y_rad, .. } = shot.camera.projection else { panic!("perspective") };
    heights * HEIGHT_M * (0.5 * shot.size_px[1] as f32 / (0.5 * fov_y_rad).tan()) / REFERENCE_FOCAL_PX
}

pub fn take(renderer: &mut Renderer, shot: &Shot, tree: &Tree) -> Picture {
    renderer.picture(shot, &[Stand { tree, instances: &[Instance::IDENTITY] }]).unwrap()
}

pub fn area_px(picture: &Picture) -> usize {
    picture.depth_m.iter().filter(|d| d.is_finite()).count()
}

pub fn iou(a: &Picture, b: &Picture) -> f64 {
    silhouette_iou(&silhouette(&a.color), &silhouette(&b.color)).unwrap()
}

pub fn turned_by(azimuth_deg: f32) -> Instance {
    let q = Quat::from_rotation_y(azimuth_deg.to_radians());
    Instance { rotation: q.to_array().map(|v| (v * 32767.0).round() as i16), ..Instance::IDENTITY }
}

/// Whether a picture has only numbers in it: a colour that is none would be black or white, a depth that is none fails.
pub fn is_sound(picture: &Picture) -> bool {
    picture.depth_m.iter().all(|d| !d.is_nan() && *d > 0.0)
}
