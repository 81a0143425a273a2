//! What the drawer of leaves shows, and how little it sends.

use std::sync::Arc;

use image::RgbaImage;

use super::{Camera, Renderer, Shot, Stand};
use crate::Seed;
use crate::gpu::layout::Instance;
use crate::gpu::testing::software_gpu;
use crate::model::{Material, Part};
use crate::repr::lodf::{Detail, LeafForest, Zones, foliage};
use crate::repr::{BuiltPart, BuiltTree, Drawn, Seen};

fn part(leaves: usize) -> Part {
    let texture =
        RgbaImage::from_fn(8, 8, |x, y| image::Rgba([40 + 20 * x as u8, 140, 10 * y as u8, if x == y { 0 } else { 255 }]));
    let material = Material { texture: Some(Arc::new(texture)), two_sided: true, alpha_cutoff: Some(0.5), ..Material::default() };
    Part { name: "leaves".to_owned(), surface: foliage::synthetic(leaves, Seed(4)), material, crown_center: None }
}

fn built(part: &Part, detail: Detail) -> BuiltTree {
    let leaves = part.surface.mesh.polygon_count();
    let forest = LeafForest { detail, ..LeafForest::of(&part.surface, leaves / 40) };
    let drawn = BuiltPart { part: part.clone(), drawn: Drawn::Forest(Arc::new(forest)), seen: Seen::default() };
    BuiltTree::new(part.surface.mesh.bounds().unwrap(), vec![drawn])
}

const DETAIL: Detail = Detail { near: 1.0, far: 5.0, least: 0.0, zones: Zones::Uniform };

fn shot(distance: f32) -> Shot {
    Shot::new(Camera::orbit(glam::Vec3::new(0.0, 6.0, 0.0), 0.4, 0.2, distance), [160, 160])
}

#[test]
fn at_either_end_leaves_look_as_plain_surfaces_do() {
    let Some(gpu) = software_gpu() else { return };
    let mut renderer = Renderer::new(gpu).unwrap();
    let part = part(800);
    let tree = built(&part, DETAIL);
    let forest = renderer.upload_built(&tree).unwrap();
    let Drawn::Forest(levels) = &tree.parts[0].drawn else { panic!("a forest") };
    // Distances of the picture of 160 rows count as 1080/160 as far.
    for (distance, leaves, at) in [(9.0f32, 800, 0.0), (40.0, 20, 100.0)] {
        let plain = Part { surface: levels.surface_at(&part.surface, at), ..part.clone() };
        let plain = renderer.upload_built(&BuiltTree::new(tree.bounds, vec![BuiltPart::still(plain)])).unwrap();
        let shot = Shot { camera: Camera { ..shot(if leaves == 800 { 1.2 } else { distance }).camera }, ..shot(distance) };
        let of = |renderer: &mut Renderer, tree| {
            renderer.picture(&shot, &[Stand { tree, instances: &[Instance::IDENTITY] }]).unwrap().color
        };
        let ours = of(&mut renderer, &forest);
        assert_eq!(renderer.leaves_shown(), leaves);
        let theirs = of(&mut renderer, &plain);
        let differ = ours.pixels().zip(theirs.pixels()).filter(|(a, b)| (0..3).any(|c| a.0[c].abs_diff(b.0[c]) > 2)).count();
        assert!(differ < 60, "{differ} pixels differ at {distance} m");
    }
}

#[test]
fn a_step_of_the_viewer_sends_little_and_standing_still_nothing() {
    let Some(gpu) = software_gpu() else { return };
    let mut renderer = Renderer::new(gpu).unwrap();
    let part = part(4000);
    let near = Detail { near: 1.0, far: 60.0, ..DETAIL };
    let tree = renderer.upload_built(&built(&part, near)).unwrap();
    let places = [0.0, 30.0].map(|x| Instance { position: [x, 0.0, 0.0], ..Instance::IDENTITY });
    let mut sent = |distance: f32| {
        renderer.frame(&shot(distance), &[Stand { tree: &tree, instances: &places }]).unwrap();
        (renderer.sent_bytes(), renderer.leaves_shown())
    };
    let (first, before) = sent(40.0);
    assert!(first > 2 * 4 * 4000, "both trees get their lists: {first}");
    let (still, _) = sent(40.0);
    assert_eq!(still, 0, "nobody moves");
    let (step, after) = sent(40.5);
    let changed = before - after;
    assert!(changed > 0 && step <= 8 + (changed * (2 * 4 + 16) * 8) as u64, "{step} bytes for {changed} collapses");
    assert!(step < first / 4, "{step} of {first}");
}
