use std::collections::BTreeMap;

use super::*;
use crate::Seed;
use crate::geom::Topology;
use crate::texture::flat::FlatMesh;
use crate::texture::synth::{FrontChoice, SynthParams, synthesize};
use crate::texture::test_shapes::{cone, leafy, lumpy_ball};

fn atlas_of(mesh: &PolyMesh, size: u32, side: u32) -> Atlas {
    let params = BakeParams { texture_size: PowerOfTwo(size), ..BakeParams::default() };
    let synth = SynthParams { front: FrontChoice::Synth, ..SynthParams::default() };
    let exemplar = leafy(side);
    let density = texels_per_m(mesh, &params).unwrap();
    let texture = synthesize(mesh, &exemplar, density, &[], &synth, Seed(1)).unwrap();
    bake(mesh, mesh.bounds().unwrap().center(), &texture, &exemplar, &params).unwrap()
}

#[test]
fn the_charted_surface_is_the_closed_mesh_again_and_stays_in_the_image() {
    for mesh in [lumpy_ball(16, 1.3), lumpy_ball(6, 0.5), cone(14)] {
        let atlas = atlas_of(&mesh, 128, 48);
        assert!(Topology::of(&atlas.surface.welded()).is_sphere());
        assert!(atlas.surface.uvs.iter().all(|uv| uv.min_element() >= 0.0 && uv.max_element() <= 1.0));
        assert!(atlas.surface.mesh.positions.len() < mesh.positions.len() * 5 / 4 + 24, "few vertices stand double");
    }
}

#[test]
fn no_polygon_is_smeared_or_turned_over_in_the_chart() {
    for mesh in [lumpy_ball(24, 1.0), lumpy_ball(24, 1.8), cone(24)] {
        let flat = FlatMesh::of(&mesh).unwrap();
        let chart = Chart::of(&mesh, &flat, mesh.bounds().unwrap().center()).unwrap();
        let area = |c: &[Vec2; 4]| 0.5 * ((c[1] - c[0]).perp_dot(c[2] - c[0]) + (c[2] - c[0]).perp_dot(c[3] - c[0]));
        let density = |p: usize| f64::from(area(&chart.corners[p]) / flat.flats[p].area) * flat.area / 4.0;
        let turned = (0..mesh.polygon_count()).filter(|&p| density(p) <= 0.0).count();
        assert_eq!(turned, 0, "of {}", mesh.polygon_count());
        let total: f64 = (0..mesh.polygon_count()).map(|p| f64::from(area(&chart.corners[p]))).sum();
        assert!((total - 4.0).abs() < 0.05, "the chart is covered once: {total}");
    }
}

#[test]
fn seams_vanish_and_the_grain_stays() {
    let atlas = atlas_of(&lumpy_ball(32, 1.2), 512, 96);
    assert!(atlas.seam_before > atlas.seam_after, "{} {}", atlas.seam_before, atlas.seam_after);
    assert!(atlas.seam_after <= 1.10 && atlas.contrast >= 0.85, "{} {}", atlas.seam_after, atlas.contrast);
}

#[test]
fn both_sides_of_a_cut_show_the_same_even_in_coarser_mip_levels() {
    let atlas = atlas_of(&lumpy_ball(24, 1.2), 256, 64);
    // The mean over an 8×8 block, mip level 3, round a texture coordinate: what lies there is turned half round on the other side.
    let mean = |uv: Vec2| {
        let corner = (256.0 * uv).round().as_ivec2();
        let texel = |i: i32| {
            *atlas.image.get_pixel((corner.x - 4 + i % 8).clamp(0, 255) as u32, (corner.y - 4 + i / 8).clamp(0, 255) as u32)
        };
        (0..64).map(texel).map(|p| Vec3::new(p[0].into(), p[1].into(), p[2].into())).sum::<Vec3>() / 64.0
    };
    let mut twins: BTreeMap<[u32; 3], Vec<Vec2>> = BTreeMap::new();
    for (p, uv) in atlas.surface.mesh.positions.iter().zip(&atlas.surface.uvs) {
        twins.entry(p.to_array().map(f32::to_bits)).or_default().push(*uv);
    }
    let cut: Vec<&Vec<Vec2>> = twins.values().filter(|t| t.len() > 1).collect();
    assert!(cut.len() > 10);
    let difference = |a: &[Vec2], b: &[Vec2]| (mean(a[0]) - mean(b[b.len() - 1])).length();
    let same: f32 = cut.iter().map(|t| difference(t, t)).sum();
    let other: f32 = cut.iter().zip(cut.iter().skip(3)).map(|(a, b)| difference(a, b)).sum();
    assert!(same < 0.35 * other, "{same} against {other} by chance");
}

#[test]
fn gaps_stay_as_frequent_as_in_the_exemplar() {
    let exemplar = leafy(96);
    let expected = exemplar.image.pixels().filter(|p| p[3] < 128).count() as f64 / f64::from(96 * 96);
    let atlas = atlas_of(&lumpy_ball(24, 1.2), 256, 96);
    assert!((atlas.gap_fraction - expected).abs() < 0.35 * expected, "{} for {expected}", atlas.gap_fraction);
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let drawn = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| atlas_of(&lumpy_ball(12, 1.2), 128, 40).image)
    };
    assert_eq!(drawn(1), drawn(3));
}

#[test]
fn odd_inputs_are_refused_or_survived() {
    let exemplar = leafy(2);
    let params = BakeParams { texture_size: PowerOfTwo(64), ..BakeParams::default() };
    let synth = SynthParams::default();
    assert!(matches!(synthesize(&PolyMesh::default(), &exemplar, 5.0, &[], &synth, Seed(1)), Err(Error::Untexturable { .. })));
    let mut broken = lumpy_ball(4, 1.0);
    assert!(synthesize(&broken, &exemplar, f64::NAN, &[], &synth, Seed(1)).is_err());
    assert!(matches!(synthesize(&broken, &leafy(1), 5.0, &[], &synth, Seed(1)), Err(Error::Exemplar { .. })));
    // Far more texels per polygon than the exemplar has, an octahedron, a centre outside.
    atlas_of(&lumpy_ball(2, 1.0), 128, 3);
    let texture = synthesize(&broken, &exemplar, 1e6, &[], &synth, Seed(1)).unwrap();
    bake(&broken, Vec3::splat(50.0), &texture, &exemplar, &params).unwrap();
    assert!(bake(&lumpy_ball(5, 1.0), Vec3::ZERO, &texture, &exemplar, &params).is_err());
    let size = BakeParams { texture_size: PowerOfTwo(100), ..params };
    assert!(matches!(bake(&broken, Vec3::ZERO, &texture, &exemplar, &size), Err(Error::Parameter { .. })));
    broken.quads.push([0, 1, 2, 999]);
    assert!(matches!(synthesize(&broken, &exemplar, 5.0, &[], &synth, Seed(1)), Err(Error::Untexturable { .. })));
}
