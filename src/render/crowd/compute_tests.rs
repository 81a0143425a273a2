//! The device finds the same trees in the same order as the processor does.

use bytemuck::pod_collect_to_vec;
use glam::Vec3;

use super::cull::{Candidates, MOST_CANDIDATES};
use super::tests::{brightness, crowd_of, renderer, shot, trees, world};
use super::{Batch, Crowd, CullParams, Culling, Standing};
use crate::Error;
use crate::gpu::{Gpu, layout, read_buffer};
use crate::render::drawer::PassKind;
use crate::render::{Background, Camera, LevelViewer, LightParams, Renderer, Shot, Stage, WindParams, World};

fn params(culling: Culling) -> CullParams {
    CullParams { culling, ..CullParams::default() }
}

/// Culled so by a camera that stands still elsewhere, where one is given.
fn seen_by(crowd: &mut Crowd, culling: Culling, frozen: Option<Camera>) -> World<'_> {
    World { cull: params(culling), frozen, ..world(crowd, Batch::Indirect) }
}

/// What the last frame's lists held.
fn lists(gpu: &Gpu, crowd: &Crowd, kind: PassKind) -> Vec<Vec<u32>> {
    let device = usize::from(kind == PassKind::Shadow);
    let all: Vec<u32> = pod_collect_to_vec(&read_buffer(gpu, crowd.device[device].lists.get()).unwrap());
    let groups = crowd.shapes.iter().map(|shape| shape.groups.len()).sum::<usize>();
    let of_list = |(room, count): (&std::ops::Range<u32>, &u32)| all[room.start as usize..(room.start + count) as usize].to_vec();
    crowd.lists(kind).iter().zip(&crowd.counts[device]).take(groups).map(of_list).collect()
}

/// Shots that differ in all that decides what is seen.
fn shots() -> Vec<(Shot, Option<Camera>)> {
    let plain = shot();
    let above = Shot { camera: Camera::orbit(Vec3::ZERO, 0.3, 1.3, 400.0), ..shot() };
    let away = Shot { camera: Camera::orbit(Vec3::new(4000.0, 0.0, 0.0), 1.5, 0.0, 10.0), ..shot() };
    let projection = crate::render::Projection::Orthographic { half_height_m: 60.0, near_m: 1.0, far_m: 500.0 };
    let flat = Shot { camera: Camera { projection, ..plain.camera }, ..shot() };
    let light = LightParams { shadow_range_m: 90.0, ..LightParams::default() };
    let lit = Shot { stage: Stage::Lit, background: Background::Sky, light, ..shot() };
    let windy = Shot { wind: WindParams { wind: 9.0, ..WindParams::default() }, ..lit.clone() };
    let told = Shot { level_distance: Some(9.0), ..shot() };
    let hurried = LevelViewer { eye: Vec3::new(90.0, 5.0, 0.0), farther: 1.4 };
    let hurried = Shot { level_viewer: Some(hurried), ..lit.clone() };
    let frozen = Some(plain.camera);
    vec![(plain, None), (above, frozen), (away, None), (flat, None), (lit, None), (windy, None), (told, None), (hurried, None)]
}

fn assert_alike(renderer: &mut Renderer, trees: &[Standing], what: &str) {
    let mut crowd = crowd_of(renderer, trees);
    for (number, (shot, frozen)) in shots().into_iter().enumerate() {
        let mut told = |culling| {
            let picture = renderer.picture(&shot, seen_by(&mut crowd, culling, frozen)).unwrap();
            renderer.tally(&mut crowd).unwrap();
            let kinds = [PassKind::Temporary, PassKind::Shadow].map(|kind| lists(&renderer.gpu, &crowd, kind));
            (picture, kinds, crowd.trees_seen(), [crowd.shown(0), crowd.shown(1)], crowd.counted_of(true).triangles)
        };
        let (here, there) = (told(Culling::Cpu), told(Culling::Compute));
        assert_eq!(here.1, there.1, "{what}, shot {number}");
        assert_eq!((here.2, &here.3, here.4), (there.2, &there.3, there.4), "{what}, shot {number}");
        assert!(here.0.color == there.0.color && here.0.depth_m == there.0.depth_m, "{what}, shot {number}");
    }
}

#[test]
fn the_device_finds_whom_the_processor_finds() {
    let Some(mut renderer) = renderer() else { return };
    let many = trees();
    assert_alike(&mut renderer, &many, "many");
    assert_alike(&mut renderer, &many[..1], "one");
    assert_alike(&mut renderer, &[], "none");
    let of_one_species: Vec<Standing> = many.iter().map(|(_, placed)| (1, *placed)).collect();
    assert_alike(&mut renderer, &of_one_species, "of one species");
    let heap: Vec<Standing> = many
        .iter()
        .cycle()
        .take(3000)
        .map(|(species, placed)| {
            let [x, y, z] = placed.position;
            (*species, layout::Placed { position: [20.0 + 0.02 * x, y, -30.0 + 0.02 * z], ..*placed })
        })
        .collect();
    assert_alike(&mut renderer, &heap, "close together");
    // The picture is of something.
    let mut crowd = crowd_of(&mut renderer, &many);
    assert!(brightness(&renderer.picture(&shot(), seen_by(&mut crowd, Culling::Compute, None)).unwrap()) > 1.0);
}

#[test]
fn the_device_too_is_sent_nothing_by_a_still_camera_and_draws_nothing_more_for_trees_behind() {
    let Some(mut renderer) = renderer() else { return };
    let shot = shot();
    let few = trees();
    let behind = few.iter().map(|(species, placed)| {
        let at = shot.camera.eye + 2000.0 * shot.camera.axes[2] + Vec3::from(placed.position);
        (*species, layout::Placed { position: at.to_array(), ..*placed })
    });
    let many: Vec<Standing> = few.iter().copied().chain(behind).collect();
    let mut draws = |trees: &[Standing]| {
        let mut crowd = crowd_of(&mut renderer, trees);
        renderer.frame(&shot, seen_by(&mut crowd, Culling::Compute, None)).unwrap();
        renderer.tally(&mut crowd).unwrap();
        let (first, counted) = (renderer.uploaded_bytes(), renderer.counted());
        for _ in 0..2 {
            renderer.frame(&shot, seen_by(&mut crowd, Culling::Compute, None)).unwrap();
            assert_eq!(renderer.uploaded_bytes(), 0);
        }
        assert!(first > 0);
        (counted, crowd.trees_seen(), first)
    };
    let (few, many) = (draws(&few), draws(&many));
    assert!(few.0.draws > 0 && few.1 > 0);
    assert_eq!(few, many);
}

#[test]
fn more_candidates_than_the_adapter_takes_are_refused_in_a_sentence() {
    let Some(mut renderer) = renderer() else { return };
    let mut crowd = crowd_of(&mut renderer, &trees());
    renderer.frame(&shot(), seen_by(&mut crowd, Culling::Compute, None)).unwrap();
    let (culler, gpu) = (renderer.culler.as_ref().unwrap(), &renderer.gpu);
    let too_many = Candidates { count: MOST_CANDIDATES + 1, ..Candidates::default() };
    let look = bytemuck::Zeroable::zeroed();
    let refused = crowd.device[0].ask(gpu, (culler, &crowd.places), &crowd.species, (look, &too_many)).unwrap_err();
    assert!(matches!(refused, Error::ShaderRoom { .. }), "{refused}");
    assert!(refused.to_string().contains("4295 MB") && refused.to_string().contains("--culling"), "{refused}");
    // What is left behind asks nothing.
    assert_eq!(crowd.device[0].asking.as_ref().unwrap().counts(gpu, 3).unwrap(), [0; 3]);
}

#[test]
fn more_workgroups_than_a_row_holds_are_culled_too() {
    let Some(mut renderer) = renderer() else { return };
    // Of each tree all three levels are candidates: it is asked for each, in 65,535 workgroups of 64 and more.
    let across = 1200;
    let trees: Vec<Standing> = (0..across * across)
        .map(|i| (0, layout::Placed::new([(i % across) as f32 * 0.2, 0.0, (i / across) as f32 * 0.2], 0.0, 1.0)))
        .collect();
    let mut crowd = crowd_of(&mut renderer, &trees);
    let camera = Camera::orbit(Vec3::new(120.0, 3.0, 120.0), 0.6, 0.5, 300.0);
    let shot = Shot { camera, size_px: [64, 48], ..shot() };
    let mut told = |culling| {
        let cull = CullParams { least_px: 0.0, ..params(culling) };
        renderer.frame(&shot, World { cull, ..world(&mut crowd, Batch::Indirect) }).unwrap();
        renderer.tally(&mut crowd).unwrap();
        (lists(&renderer.gpu, &crowd, PassKind::Temporary), crowd.trees_seen())
    };
    let (here, there) = (told(Culling::Cpu), told(Culling::Compute));
    assert!(here.1 > 1_000_000);
    assert!(here == there);
}
