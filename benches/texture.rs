//! Texture synthesis against the crate `texture-synthesis` (0.8) for as many texels: a medium crown with a 512² atlas, and a 512² picture,
//! both from one 128² exemplar. The ratio of the two in one run is the figure that counts: at least 50.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::Vec3;
use image::{Rgba, RgbaImage};
use sphereboard::Seed;
use sphereboard::geom::PolyMesh;
use sphereboard::photo::Exemplar;
use sphereboard::raster::Rect;
use sphereboard::texture::{BakeParams, SynthParams, bake, synthesize, texels_per_m};

const SIDE: u32 = 128;

/// A closed ball of 2,178 polygons, disturbed.
fn crown() -> PolyMesh {
    let (rings, around) = (33usize, 66usize);
    let mut mesh = PolyMesh { positions: vec![Vec3::NEG_Y], ..PolyMesh::default() };
    for r in 1..rings {
        let (sin, cos) = (std::f32::consts::PI * r as f32 / rings as f32).sin_cos();
        for a in 0..around {
            let (s, c) = (std::f32::consts::TAU * a as f32 / around as f32).sin_cos();
            let scale = 1.0 + 0.03 * Seed(1).keyed("bench-crown", (r * around + a) as u64).signed() as f32;
            mesh.positions.push(scale * Vec3::new(sin * s, -cos, sin * c));
        }
    }
    mesh.positions.push(Vec3::Y);
    let at = |r: usize, a: usize| (1 + (r - 1) * around + a % around) as u32;
    let top = mesh.positions.len() as u32 - 1;
    for a in 0..around {
        mesh.triangles.extend([[0, at(1, a + 1), at(1, a)], [top, at(rings - 1, a), at(rings - 1, a + 1)]]);
        mesh.quads.extend((1..rings - 1).map(|r| [at(r, a), at(r, a + 1), at(r + 1, a + 1), at(r + 1, a)]));
    }
    mesh
}

/// Leaf-like noise of two scales.
fn foliage() -> RgbaImage {
    let noise = |x: u32, y: u32| Seed(2).keyed("bench-foliage", u64::from(y) << 32 | u64::from(x)).unit();
    RgbaImage::from_fn(SIDE, SIDE, |x, y| {
        let v = 0.4 * noise(x, y) + 0.6 * noise(9000 + x / 4, y / 4);
        Rgba([(50.0 + 100.0 * v) as u8, (70.0 + 150.0 * v) as u8, (30.0 + 60.0 * v) as u8, 255])
    })
}

fn texture(c: &mut Criterion) {
    let (mesh, image) = (crown(), foliage());
    let window_px = Rect { x: 0, y: 0, width: SIDE, height: SIDE };
    let exemplar = Exemplar { image: image.clone(), window_px, scale: 1.0, gap_fraction: 0.0, delta_e: 0.0 };
    let (synth, params) = (SynthParams::default(), BakeParams::default());
    let mut group = c.benchmark_group("texture-512");
    group.sample_size(10);
    group.bench_function("sphereboard", |b| {
        b.iter(|| {
            let density = texels_per_m(&mesh, &params).unwrap();
            let texture = synthesize(&mesh, &exemplar, density, &[], &synth, Seed(1)).unwrap();
            bake(&mesh, Vec3::ZERO, &texture, &exemplar, &params).unwrap()
        });
    });
    let mut png = std::io::Cursor::new(Vec::new());
    image.write_to(&mut png, image::ImageFormat::Png).unwrap();
    group.bench_function("crate-texture-synthesis", |b| {
        b.iter(|| {
            let source = texture_synthesis::ImageSource::Memory(png.get_ref());
            let size = texture_synthesis::Dims::square(params.texture_size.0);
            texture_synthesis::Session::builder().add_example(source).output_size(size).build().unwrap().run(None)
        });
    });
    group.finish();
}

criterion_group!(benches, texture);
criterion_main!(benches);
