//! Growth against its twin, fig. 13 worked through, and what must hold for every picture.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use image::{Rgba, RgbaImage};

use super::*;
use crate::geom::{PolyMesh, Surface};
use crate::gpu::layout::{GrowthFrame, Instance};
use crate::gpu::read_texture;
use crate::gpu::testing::software_gpu;
use crate::model::{Material, Part, Wrap};
use crate::render::world::Placed;
use crate::render::*;

/// A renderer on the software driver; `None`, said aloud, where there is none.
fn renderer() -> Option<Renderer> {
    software_gpu().map(|gpu| Renderer::new(gpu).unwrap())
}

/// A lumpy ball of leaves with gaps.
fn crown(center: Vec3, radius: f32) -> Part {
    let (across, down) = (24, 16);
    let (mut mesh, mut uvs) = (PolyMesh::default(), vec![]);
    for j in 0..=down {
        for i in 0..=across {
            let (u, v) = (i as f32 / across as f32, j as f32 / down as f32);
            let ((st, ct), (sp, cp)) = ((u * std::f32::consts::TAU).sin_cos(), (v * std::f32::consts::PI).sin_cos());
            let lumps = 1.0 + 0.12 * (5.0 * u * std::f32::consts::TAU).sin() * sp * (9.0 * v).cos();
            mesh.positions.push(center + radius * lumps * Vec3::new(st * sp, cp * 1.3, ct * sp));
            uvs.push(Vec2::new(u, v));
        }
    }
    for j in 0..down {
        for i in 0..across {
            let [a, b] = [j * (across + 1) + i, (j + 1) * (across + 1) + i];
            mesh.quads.push([a, b, b + 1, a + 1]);
        }
    }
    let normals = mesh.positions.iter().map(|p| (*p - center).normalize_or(Vec3::Y)).collect();
    let leaves = RgbaImage::from_fn(96, 64, |x, y| {
        let hash = super::scrambled(x / 3 + 1000 * (y / 3));
        Rgba([(hash & 127) as u8, 90 + (hash >> 8 & 127) as u8, (hash >> 16 & 63) as u8, if hash >> 28 == 0 { 0 } else { 255 }])
    });
    let material = Material { texture: Some(Arc::new(leaves)), wrap: Wrap::Clamp, alpha_cutoff: Some(0.5), ..Material::default() };
    Part {
        name: "crown".to_owned(),
        surface: Surface { mesh, normals, uvs, ..Surface::default() },
        material,
        crown_center: Some(center),
    }
}

fn tree() -> Vec<Part> {
    vec![crown(Vec3::new(-0.6, 4.0, 0.4), 1.5), crown(Vec3::new(1.2, 2.6, -0.4), 1.1)]
}

fn shot(azimuth: f32, elevation: f32, distance: f32, size_px: [u32; 2], stage: Stage) -> Shot {
    let camera = Camera::orbit(Vec3::new(0.3, 3.0, 0.0), azimuth, elevation, distance);
    Shot { stage, toward_sun: Vec3::Y, ..Shot::new(camera, size_px) }
}

fn instances() -> Vec<Instance> {
    let at = |x, z, scale| Instance { position: [x, 0.0, z], scale, ..Instance::IDENTITY };
    vec![at(0.0, 0.0, 1.0), at(1.8, -3.0, 1.3), at(-3.0, 1.5, 0.7)]
}

/// The trees' temporary pictures as they are on the device.
fn pictures_of(renderer: &Renderer) -> TreePictures {
    let targets = renderer.targets.as_ref().unwrap();
    let read = |target: &Target| read_texture(&renderer.gpu, &target.texture).unwrap();
    let words = |bytes: Vec<u8>| bytes.chunks_exact(4).map(|b| b.try_into().unwrap()).collect::<Vec<[u8; 4]>>();
    TreePictures {
        color: words(read(&targets.tree_color)),
        depth: words(read(&targets.tree_depth)).into_iter().map(f32::from_le_bytes).collect(),
        id: words(read(&targets.tree_id)).into_iter().map(u32::from_le_bytes).collect(),
    }
}

fn draw_growing(renderer: &mut Renderer, shot: &Shot, stands: &[Stand], growing: &GrowthInput) {
    let sun = renderer.sun_view(shot, &stands.into()).unwrap();
    renderer.draw_growing(shot, &Placed { stands, casters: stands.len(), crowd: None, ground: None }, growing, sun).unwrap();
}

/// Draws twice, without and with growth, and compares with the twin. Returns how many pixels grew.
fn compare(renderer: &mut Renderer, tree: &Tree, shot: &Shot) -> usize {
    compare_placed(renderer, shot, &[Stand { tree, instances: &instances() }])
}

/// As [`compare`], of trees that stand elsewhere.
fn compare_placed(renderer: &mut Renderer, shot: &Shot, stands: &[Stand]) -> usize {
    let input = GrowthInput::new(shot, stands, &[], &renderer.growth.twigs);
    draw_growing(renderer, shot, stands, &GrowthInput { tiles: vec![], ..input.clone() });
    let before = pictures_of(renderer);
    draw_growing(renderer, shot, stands, &input);
    let after = pictures_of(renderer);
    let twin = Twin { input: &input, pictures: &before };
    let expected = twin.pictures();
    let differ = |i: &usize| after.depth[*i] != expected.depth[*i] || after.id[*i] != expected.id[*i];
    let wrong: Vec<usize> = (0..after.depth.len()).filter(differ).collect();
    assert!(wrong.is_empty(), "{} pixels differ, the first at {} of {:?}", wrong.len(), wrong[0], shot.size_px);
    let grown = twin.grown();
    for pixel in &grown {
        let i = pixel.at[1] as usize * shot.size_px[0] as usize + pixel.at[0] as usize;
        let far = after.color[i].iter().zip(expected.color[i]).map(|(a, b)| a.abs_diff(b)).max().unwrap();
        assert!(far <= if pixel.coverage == 16 { 0 } else { 2 }, "{pixel:?}: {:?} and {:?}", after.color[i], expected.color[i]);
    }
    grown.len()
}

#[test]
fn the_device_grows_the_same_pixels_as_the_twin() {
    let Some(mut renderer) = renderer() else { return };
    let tree = renderer.upload(&tree()).unwrap();
    let mut grown = 0;
    for (azimuth, elevation, distance, size_px) in
        [(0.0, 0.1, 14.0, [320, 200]), (1.1, 0.5, 9.0, [173, 97]), (2.9, -0.2, 30.0, [257, 64]), (4.0, 1.57, 5.0, [90, 130])]
    {
        for stage in [Stage::Reshaped, Stage::Antialiased] {
            let plain = shot(azimuth, elevation, distance, size_px, stage);
            for profile in [GrowthChoice::Needle, GrowthChoice::Broadleaf] {
                let growth = GrowthParams { growth: profile, growth_max_m: 0.6, ..GrowthParams::default() };
                grown += compare(&mut renderer, &tree, &Shot { growth, ..plain.clone() });
            }
            let paper = GrowthParams {
                growth_keys: GrowthKeys::Random,
                growth_edges: GrowthEdges::Outer,
                growth_roots: GrowthRoots::Sides,
                growth_max_m: 0.4,
                ..GrowthParams::default()
            };
            grown += compare(&mut renderer, &tree, &Shot { growth: paper, frame: 7, ..plain });
        }
    }
    let mut parallel = shot(0.4, 0.2, 12.0, [211, 160], Stage::Reshaped);
    parallel.camera.projection = Projection::Orthographic { half_height_m: 4.0, near_m: 1.0, far_m: 40.0 };
    grown += compare(&mut renderer, &tree, &parallel);
    assert!(grown > 5000, "{grown}");
}

/// Flat bars across the picture, two metres high and one apart, as one crown.
fn bars(count: usize) -> Part {
    let mut mesh = PolyMesh::default();
    for bar in 0..count as u32 {
        let y = 3.0 * bar as f32;
        mesh.positions.extend([[-99.0, y], [99.0, y], [99.0, y + 2.0], [-99.0, y + 2.0]].map(|[x, y]| Vec3::new(x, y, 0.0)));
        mesh.quads.push([0, 1, 2, 3].map(|i| 4 * bar + i));
    }
    let normals = vec![Vec3::Y; mesh.positions.len()]; // turned from the viewer, as outlines are
    let uvs = vec![Vec2::ZERO; mesh.positions.len()];
    let surface = Surface { mesh, normals, uvs, ..Surface::default() };
    Part { name: "bars".to_owned(), surface, material: Material::default(), crown_center: Some(Vec3::new(0.0, 90.0, 0.0)) }
}

#[test]
fn in_parallel_projection_nothing_depends_on_how_far_off_the_viewer_stands() {
    let Some(mut renderer) = renderer() else { return };
    let tree = renderer.upload(&tree()).unwrap();
    let stands = [Stand { tree: &tree, instances: &instances() }];
    let growth = GrowthParams { growth: GrowthChoice::None, ..GrowthParams::default() };
    let mut take = |away_m: f32, range_m: f32| {
        let mut shot =
            Shot { background: Background::Black, growth: growth.clone(), ..shot(0.4, 0.2, 12.0 + away_m, [211, 160], Stage::Lit) };
        let near_m = 1.0 + away_m;
        shot.camera.projection = Projection::Orthographic { half_height_m: 4.0, near_m, far_m: near_m + range_m };
        renderer.picture(&shot, &stands).unwrap().color
    };
    let near = take(0.0, 40.0);
    for (away_m, range_m) in [(10.0, 40.0), (0.0, 160.0)] {
        let other = take(away_m, range_m);
        let far = |(a, b): (&u8, &u8)| a.abs_diff(*b) > 2;
        let unlike = near.as_raw().iter().zip(other.as_raw()).filter(|pair| far(*pair)).count();
        assert!(unlike < near.as_raw().len() / 1000, "{away_m} m away over {range_m} m: {unlike} differ");
    }
}

#[test]
fn two_thirds_of_all_pixels_may_be_roots() {
    let Some(mut renderer) = renderer() else { return };
    let tree = renderer.upload(&[bars(60)]).unwrap();
    // A pixel is a metre, and the lowest bar begins with the lowest row.
    let size_px = [160, 180];
    let mut shot = shot(0.0, 0.0, 60.0, size_px, Stage::Reshaped);
    shot.camera.eye = Vec3::new(0.0, 90.0, 60.0);
    shot.camera.projection = Projection::Orthographic { half_height_m: 90.0, near_m: 1.0, far_m: 100.0 };
    shot.growth = GrowthParams { growth_min_m: 1.5, growth_max_m: 1.5, ..shot.growth };
    let stands = [Stand { tree: &tree, instances: &[Instance::IDENTITY] }];
    let input = GrowthInput::new(&shot, &stands, &[], &renderer.growth.twigs);
    let grown = compare_placed(&mut renderer, &shot, &stands);
    draw_growing(&mut renderer, &shot, &stands, &GrowthInput { tiles: vec![], ..input.clone() });
    let roots = Twin { input: &input, pictures: &pictures_of(&renderer) }.roots().len();
    let pixels = (size_px[0] * size_px[1]) as usize;
    assert!(roots > pixels * 6 / 10 && grown > pixels * 3 / 10, "{roots} roots and {grown} grown of {pixels} pixels");
}

#[test]
fn growth_is_as_long_in_metres_at_any_resolution() {
    let Some(mut renderer) = renderer() else { return };
    let tree = renderer.upload(&tree()).unwrap();
    let stands = [Stand { tree: &tree, instances: &[Instance::IDENTITY] }];
    let growth = GrowthParams { growth_max_m: 1.0, growth_min_m: 1.0, ..GrowthParams::default() };
    let mut share = |side: u32| {
        let shot = Shot { growth: growth.clone(), ..shot(0.0, 0.0, 12.0, [side; 2], Stage::Reshaped) };
        compare_placed(&mut renderer, &shot, &stands) as f64 / f64::from(side * side)
    };
    let (small, large) = (share(150), share(600));
    assert!((large / small - 1.0).abs() < 0.15, "{small} and {large} of the picture");
}

#[test]
fn where_there_are_too_many_crowns_the_nearest_grow() {
    let Some(renderer) = renderer() else { return };
    let tree = renderer.upload(&tree()).unwrap();
    // The nearest last, in the order of the list.
    let at = |i: usize| Instance { position: [(i % 7) as f32 - 3.0, 0.0, 0.01 * (i / 7) as f32 - 30.0], ..Instance::IDENTITY };
    let instances: Vec<_> = (0..2100).map(at).collect();
    let growth = GrowthParams { growth_max_m: 5.0, ..GrowthParams::default() };
    let shot = Shot { growth, ..shot(0.0, 0.0, 12.0, [300, 200], Stage::Reshaped) };
    let input = GrowthInput::new(&shot, &[Stand { tree: &tree, instances: &instances }], &[], &renderer.growth.twigs);
    let slots = &input.slots[0];
    assert!(input.crowns.len() <= growth::SLOTS && slots.iter().filter(|slot| **slot > 0).count() == (growth::SLOTS - 1) / 2);
    let (left_out, nearest) = (slots.iter().filter(|slot| **slot == 0), slots.iter().position(|slot| *slot == 1).unwrap());
    assert!(left_out.count() > 0 && nearest >= 2093, "the first slot went to {nearest}");
    assert!(slots[60..].iter().all(|slot| *slot > 0), "those left out are the farthest");
}

#[test]
fn neighbours_of_one_kind_grow_unlike_each_other() {
    let Some(renderer) = renderer() else { return };
    let tree = renderer.upload(&tree()).unwrap();
    let instances = [Instance { id: 1, ..Instance::IDENTITY }, Instance { id: 2, ..Instance::IDENTITY }];
    let shot = shot(0.0, 0.0, 12.0, [300, 200], Stage::Reshaped);
    let limbs = |instances: &[Instance]| {
        let input = GrowthInput::new(&shot, &[Stand { tree: &tree, instances }], &[], &renderer.growth.twigs);
        input.crowns[1..].iter().map(|c| input.limbs[c.first as usize..][..c.count as usize].to_vec()).collect::<Vec<_>>()
    };
    let all = limbs(&instances);
    assert_eq!(all.len(), 4);
    assert!(all[0] != all[2] && all[1] != all[3]);
    assert_eq!(all[2..], limbs(&instances[1..]), "whatever stands beside it");
}

#[test]
fn a_still_camera_gives_identical_frames_and_growth_none_is_unshaped() {
    let Some(mut renderer) = renderer() else { return };
    let tree = renderer.upload(&tree()).unwrap();
    let stands = [Stand { tree: &tree, instances: &instances() }];
    let mut take = |shot: &Shot| renderer.picture(shot, &stands).unwrap().color;
    let first = shot(0.3, 0.1, 12.0, [200, 150], Stage::Reshaped);
    let steady = take(&first);
    assert_eq!(steady, take(&Shot { frame: 9, ..first.clone() }));
    let random = GrowthParams { growth_keys: GrowthKeys::Random, ..GrowthParams::default() };
    let flickering = Shot { growth: random, ..first.clone() };
    assert_ne!(take(&flickering), take(&Shot { frame: 9, ..flickering.clone() }));
    let none = GrowthParams { growth: GrowthChoice::None, ..GrowthParams::default() };
    let unshaped = take(&Shot { stage: Stage::Unshaped, ..first.clone() });
    assert_eq!(take(&Shot { growth: none, ..first.clone() }), unshaped);
    assert_ne!(steady, unshaped);
    let far = |stage| shot(0.3, 0.1, 400.0, [200, 150], stage);
    assert_eq!(take(&far(Stage::Reshaped)), take(&far(Stage::Unshaped)), "below a pixel nothing grows");
}

/// A crown of slot 1 that grows exactly `length` sixteenths of a pixel, straight up in the picture, everywhere.
fn plain_input(size_px: [u32; 2], length: f32) -> GrowthInput {
    let frame = GrowthFrame {
        size_px,
        px_per_m: [1.0, 0.0],
        depth_units: 100.0,
        orthographic: 1,
        tips: 0,
        inner: 1,
        random: 0,
        frame: 0,
        corners: 0,
        tile_count: 0,
        alike: [0.0; 2],
    };
    let units = length / 256.0;
    let none =
        GrowingCrown { limb_x: [0.0; 3], min_units: 0.0, limb_y: [0.0; 3], max_units: 0.0, gap_m: 1.0, first: 0, count: 1, pad: 0 };
    let crown = GrowingCrown { min_units: units, max_units: units, ..none };
    GrowthInput { frame, crowns: vec![none, crown], limbs: vec![64 << 16], tiles: vec![], tree_tiles: vec![], slots: vec![] }
}

/// A picture drawn in letters: `.` is empty, `#` a crown at depth 0.5, `n` one nearer, `b` barely deeper.
fn drawn(rows: &[&str]) -> TreePictures {
    let pixels: Vec<char> = rows.iter().flat_map(|row| row.chars()).collect();
    let depth = |c: &char| match c {
        '.' => 0.0,
        'n' => 0.75,
        'b' => 0.498,
        _ => 0.5,
    };
    TreePictures {
        color: (0..pixels.len()).map(|i| [i as u8, 0, 0, 255]).collect(),
        depth: pixels.iter().map(depth).collect(),
        id: pixels.iter().map(|c| if *c == '.' { 0 } else { 1 << 20 }).collect(),
    }
}

fn grown_in(rows: &[&str], length: f32, change: impl Fn(&mut GrowthFrame)) -> Vec<([i32; 2], [i32; 2])> {
    let mut input = plain_input([rows[0].len() as u32, rows.len() as u32], length);
    change(&mut input.frame);
    let pictures = drawn(rows);
    Twin { input: &input, pictures: &pictures }.grown().iter().map(|p| (p.at, p.root)).collect()
}

#[test]
fn fig_13b_four_of_sixteen_configurations_are_roots() {
    let types = |corners| {
        let open = |bits: u32| [0, 1, 2, 3].map(|i| bits >> i & 1 == 1);
        (0..16).filter_map(|bits| Some((bits, axis_of(open(bits), corners)?))).collect::<Vec<_>>()
    };
    // Bits R, T, L, B; octants 0 R, 2 T, 4 L, 6 B.
    assert_eq!(types(false), [(1, 0), (2, 2), (4, 4), (8, 6)]);
    assert_eq!(types(true), [(1, 0), (2, 2), (3, 1), (4, 4), (6, 3), (8, 6), (9, 7), (12, 5)]);
}

#[test]
fn fig_13c_each_type_grows_in_three_directions() {
    for axis in [0, 2, 4, 6] {
        let ways: std::collections::BTreeSet<_> = (0..256).map(|direction| sides_of(axis, direction)).collect();
        assert_eq!(ways.len(), 3, "{ways:?}");
        assert!(ways.iter().all(|sides| sides[0] == axis as usize / 2), "all lead off the outline first: {ways:?}");
    }
    // To the top right from a root of type T: up, right, up, ...
    let path: Vec<_> = (1..=4).map(|i| offset_of(sides_of(2, 32), i)).collect();
    assert_eq!(path, [[0, -1], [1, -1], [1, -2], [2, -2]]);
}

#[test]
fn only_pixels_with_one_open_side_grow_and_whole_pixels_only() {
    let rows = ["......", "......", "..###.", "..###.", "..###."];
    // The middle of the top and of the sides; not the corners. Sides lead level, since up is no direction of theirs but aslant.
    let grown = grown_in(&rows, 31.0, |_| ());
    let above: Vec<_> = grown.iter().filter(|(_, root)| root[1] == 2).collect();
    assert_eq!(above, [&([3, 1], [3, 2])], "31 sixteenths are one whole pixel");
    assert!(grown_in(&rows, 15.0, |_| ()).is_empty(), "below a pixel nothing grows");
    assert_eq!(grown_in(&rows, 31.0, |frame| frame.tips = 1).iter().filter(|(_, root)| root[1] == 2).count(), 2);
}

#[test]
fn where_growths_meet_the_nearest_then_the_shorter_then_the_lower_root_wins() {
    // Root L at (3, 1) grows aslant to (2, 1), (2, 0); root T at (1, 2) up to (1, 1), (1, 0).
    let winner = |rows: &[&str], at: [i32; 2]| {
        let grown = grown_in(rows, 64.0, |_| ());
        grown.iter().find(|(pixel, _)| *pixel == at).map(|(_, root)| *root)
    };
    let rows = [".......", ".......", ".......", "###.###", "###.###", "###.###"];
    // Between two walls: both reach (3, 4) in one step; the lower root is the left one.
    assert_eq!(winner(&rows, [3, 4]), Some([2, 4]));
    let near = [".......", ".......", ".......", "###.nnn", "###.nnn", "###.nnn"];
    assert_eq!(winner(&near, [3, 4]), Some([4, 4]), "the nearer");
    let wide = [".......", ".......", ".......", "##..###", "##..###", "##..###"];
    assert_eq!(winner(&wide, [3, 4]), Some([4, 4]), "the shorter");
    assert_eq!(winner(&wide, [2, 4]), Some([1, 4]), "the shorter");
}

#[test]
fn outlines_before_deeper_crowns_grow_and_those_before_barely_deeper_ones_do_not() {
    let deep = ["######", "######", "######", "#nnnn#", "#nnnn#", "#nnnn#"];
    let over = |rows: &[&str], inner| grown_in(rows, 16.0, |frame| frame.inner = inner).len();
    assert!(over(&deep, 1) >= 2, "the nearer crown grows over the deeper");
    assert_eq!(over(&deep, 0), 0, "as in the paper");
    let level = ["bbbbbb", "bbbbbb", "bbbbbb", "b####b", "b####b", "b####b"];
    assert_eq!(over(&level, 1), 0);
}

#[test]
fn a_corner_follows_the_direction_of_the_sides_beside_it() {
    // Up and to the left, from a corner open above and to the right: upward first, as the roots of type T beside it end.
    let path: Vec<_> = (1..=4).map(|i| offset_of(sides_of(1, 96), i)).collect();
    assert_eq!(path, [[0, -1], [-1, -1], [-1, -2], [-2, -2]]);
    assert_eq!(sides_of(1, 96), sides_of(2, 96));
    for axis in [1, 3, 5, 7] {
        let open = [axis as usize / 2, (axis as usize).div_ceil(2) % 4];
        assert!((0..256).all(|direction| open.contains(&sides_of(axis, direction)[0])));
    }
}
