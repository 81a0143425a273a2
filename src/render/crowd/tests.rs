use super::*;
use crate::geom::Bounds;

/// A species that tall, in two groups: near and far.
pub fn shape(height_m: f32) -> Shape {
    let half = 0.3 * height_m;
    Shape {
        groups: vec![Seen::between(Vec3::ZERO, 0.0, 10.0, 0.2), Seen::between(Vec3::ZERO, 10.0, f32::MAX, 0.2)],
        reach: Bounds { min: Vec3::new(-half, 0.0, -half), max: Vec3::new(half, height_m, half) },
        radius_m: half + 0.5 * height_m,
        height_m,
        grows: false,
        alone: false,
    }
}

/// A tree of a species that stands there.
pub fn standing(species: u16, x: f32, z: f32) -> Standing {
    (species, layout::Placed::new([x, 0.1 * x, z], 0.7 * x, 1.0 + 0.001 * z.abs()))
}

use std::sync::Arc;

use glam::Quat;
use image::{Rgba, RgbaImage};

use crate::geom::{PolyMesh, Surface};
use crate::gpu::testing::software_gpu;
use crate::model::{Material, Part};
use crate::render::{Background, Batch, Picture, Renderer, Stand, World};
use crate::repr::{BuiltPart, BuiltTree, Drawn};

/// A card of that colour from the ground up, with slanted sides, so that it is seen how it is turned.
fn card(half: f32, height: f32, color: [u8; 4]) -> Part {
    let corners = [(-half, 0.0), (0.6 * half, 0.0), (half, height), (-half, 0.8 * height)];
    let mut mesh = PolyMesh { positions: corners.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(), ..PolyMesh::default() };
    mesh.triangles = vec![[0, 1, 2], [0, 2, 3]];
    let normals = vec![Vec3::Z; 4];
    let surface = Surface { mesh, normals, uvs: vec![glam::Vec2::ZERO; 4], ..Surface::default() };
    let texture = Some(Arc::new(RgbaImage::from_pixel(2, 2, Rgba(color))));
    let material = Material { texture, two_sided: true, ..Material::default() };
    Part { name: "card".to_owned(), surface, material, crown_center: None }
}

/// A tree of three levels: a card that stands, one that turns, and a smaller one far off.
fn species(height: f32) -> BuiltTree {
    let levels = [(0.0, 8.0, [200, 60, 30, 255]), (8.0, 20.0, [40, 180, 60, 255]), (20.0, f32::MAX, [60, 80, 220, 255])];
    let parts = levels.into_iter().enumerate().map(|(i, (near, far, color))| BuiltPart {
        drawn: if i == 1 { Drawn::Turned { pivot: Vec3::ZERO, upright: true } } else { Drawn::Still },
        seen: Seen::between(Vec3::new(0.0, 0.5 * height, 0.0), near, far, 0.25),
        part: card(0.3 * height, height, color),
    });
    let half = 0.3 * height;
    let bounds = Bounds { min: Vec3::new(-half, 0.0, -half), max: Vec3::new(half, height, half) };
    BuiltTree::new(bounds, parts.collect())
}

pub fn trees() -> Vec<Standing> {
    let at = |i: u32| ((i * 7919) % 601) as f32 - 300.0;
    (0..500u32)
        .map(|i| {
            ((i % 2) as u16, layout::Placed::new([at(i), 0.02 * at(i), at(3 * i + 1)], 0.1 * i as f32, 0.7 + 0.001 * i as f32))
        })
        .collect()
}

pub fn shot() -> Shot {
    let camera = Camera::orbit(Vec3::new(20.0, 2.0, -30.0), 0.6, 0.1, 60.0);
    Shot { background: Background::Black, stage: Stage::Antialiased, ..Shot::new(camera, [240, 160]) }
}

pub fn renderer() -> Option<Renderer> {
    software_gpu().map(|gpu| Renderer::new(gpu).unwrap())
}

/// The trees as a crowd, and a picture of it.
pub fn crowd_of(renderer: &mut Renderer, trees: &[Standing]) -> Crowd {
    let species = [6.0, 9.0].map(|height| renderer.upload_built(&species(height)).unwrap());
    renderer.plant(species.into(), trees).unwrap()
}

pub fn world(crowd: &mut Crowd, batch: Batch) -> World<'_> {
    World { crowd: Some(crowd), cull: CullParams { batch, least_px: 0.0, ..CullParams::default() }, ..World::default() }
}

fn one_by_one(renderer: &mut Renderer, shot: &Shot, trees: &[Standing]) -> Picture {
    let species = [6.0, 9.0].map(|height| renderer.upload_built(&species(height)).unwrap());
    let of = |which: u16| trees.iter().filter(move |(species, _)| *species == which).map(|(_, placed)| placed.instance(0));
    let instances: [Vec<_>; 2] = [of(0).collect(), of(1).collect()];
    let stands = [0, 1].map(|i| Stand { tree: &species[i], instances: &instances[i] });
    renderer.picture(shot, &stands).unwrap()
}

/// Pixels that differ by more than a shade.
fn unlike(a: &Picture, b: &Picture) -> usize {
    a.color.pixels().zip(b.color.pixels()).filter(|(a, b)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > 6)).count()
}

#[test]
fn a_crowd_looks_as_its_trees_do_one_by_one() {
    let Some(mut renderer) = renderer() else { return };
    let mut crowd = crowd_of(&mut renderer, &trees());
    let told = Shot { level_distance: Some(9.0), ..shot() };
    let aside = Shot { level_viewer: Some(super::super::LevelViewer { eye: Vec3::new(90.0, 5.0, 0.0), farther: 1.4 }), ..shot() };
    let above = Shot { camera: Camera::orbit(Vec3::ZERO, 0.3, 1.3, 400.0), ..shot() };
    for shot in [shot(), told, aside, above] {
        let expected = one_by_one(&mut renderer, &shot, &trees());
        for batch in [Batch::Indirect, Batch::Vbo, Batch::Naive] {
            let seen = renderer.picture(&shot, world(&mut crowd, batch)).unwrap();
            let covered = seen.depth_m.iter().filter(|d| d.is_finite()).count();
            // Their turns are rounded to 16 bits in another way.
            let wrong = unlike(&seen, &expected);
            assert!(covered > 100 && wrong * 100 <= covered, "{batch:?}: {wrong} of {covered} pixels differ");
        }
    }
}

/// Mean of all bytes of colour.
pub fn brightness(picture: &Picture) -> f64 {
    picture.color.pixels().flat_map(|p| p.0).map(f64::from).sum::<f64>() / picture.depth_m.len() as f64
}

#[test]
fn a_crowd_casts_shadows_and_its_map_stays_while_it_shows_the_same() {
    let Some(mut renderer) = renderer() else { return };
    let lit = Shot { stage: Stage::Lit, background: Background::Sky, ..shot() };
    let mut crowd = crowd_of(&mut renderer, &trees());
    let seen = renderer.picture(&lit, world(&mut crowd, Batch::Indirect)).unwrap();
    // Shadows are of the level that the map can show, and so a little unlike those that trees cast one by one.
    let expected = one_by_one(&mut renderer, &lit, &trees());
    let alike = brightness(&seen) / brightness(&expected);
    assert!((alike - 1.0).abs() < 0.02, "{alike}");
    // The picture of single trees has used the map; then it is drawn anew, and then it stays.
    let mut again = || renderer.picture(&lit, world(&mut crowd, Batch::Indirect)).unwrap();
    assert!(again().color == seen.color && again().color == seen.color);
}

#[test]
fn what_stands_behind_the_viewer_costs_nothing_and_a_still_camera_sends_nothing() {
    let Some(mut renderer) = renderer() else { return };
    let shot = shot();
    let few = trees();
    let backward = shot.camera.axes[2];
    let behind = few.iter().map(|(species, placed)| {
        let at = shot.camera.eye + 2000.0 * backward + Vec3::from(placed.position);
        (*species, layout::Placed { position: at.to_array(), ..*placed })
    });
    let many: Vec<Standing> = few.iter().copied().chain(behind).collect();
    let mut costs = |trees: &[Standing]| {
        let mut crowd = crowd_of(&mut renderer, trees);
        renderer.frame(&shot, world(&mut crowd, Batch::Indirect)).unwrap();
        let first = (renderer.counted(), renderer.uploaded_bytes());
        renderer.frame(&shot, world(&mut crowd, Batch::Indirect)).unwrap();
        assert_eq!(renderer.uploaded_bytes(), 0, "a still camera");
        assert_eq!(renderer.counted(), first.0);
        first
    };
    let (few, many) = (costs(&few), costs(&many));
    assert!(few.0.draws > 0 && few.1 > 0);
    assert_eq!(few, many);
}

#[test]
fn draws_do_not_grow_with_the_number_of_trees() {
    let Some(mut renderer) = renderer() else { return };
    let mut draws = |trees: &[Standing], batch| {
        let mut crowd = crowd_of(&mut renderer, trees);
        renderer.frame(&Shot { stage: Stage::Lit, ..shot() }, world(&mut crowd, batch)).unwrap();
        assert!(crowd.device_bytes() <= 32 * trees.len() as u64 + 4096, "{} bytes", crowd.device_bytes());
        renderer.counted().draws
    };
    // Two species of three parts, seen and in the sun's map.
    assert!(draws(&trees(), Batch::Indirect) <= 12);
    assert!(draws(&trees(), Batch::Naive) > 100);
    assert_eq!(draws(&[], Batch::Indirect), 0);
}

#[test]
fn a_tree_of_no_species_is_refused_and_places_keep_their_turn_and_scale() {
    let Some(renderer) = renderer() else { return };
    let tree = renderer.upload_built(&species(5.0)).unwrap();
    assert!(renderer.plant(vec![tree], &[standing(1, 0.0, 0.0)]).unwrap_err().to_string().contains("species 1"));
    for yaw in [0.0, 1.0, -2.9, 3.1, 7.0, 300.0] {
        let placed = layout::Placed::new([1.0, 2.0, 3.0], yaw, 1.25);
        let apart = Quat::from_rotation_y(yaw).angle_between(Quat::from_rotation_y(placed.yaw_rad()));
        assert!(apart < 3e-3 && placed.scale() == 1.25, "{yaw}: {apart}");
    }
}
