//! Crown-like meshes and exemplars for this floor's tests and for looking at what it makes.

use glam::Vec3;
use image::{Rgba, RgbaImage};

use crate::Seed;
use crate::geom::PolyMesh;
use crate::photo::Exemplar;
use crate::raster::Rect;

/// A closed ball of `rings` rows of quads with triangles at the poles, stretched vertically, its vertices disturbed; foot at y = 0.
pub fn lumpy_ball(rings: usize, stretch: f32) -> PolyMesh {
    crown_of_revolution(rings, |t| (t.sin(), -stretch * t.cos()), 0.05)
}

/// A cone-like conifer crown.
pub fn cone(rings: usize) -> PolyMesh {
    crown_of_revolution(rings, |t| ((0.5 * t).sin().min(1.0 - t / std::f32::consts::PI) * 1.2 + 0.02, -2.2 * t.cos()), 0.04)
}

/// Revolves `profile(t)` = (radius, height), t in 0..π from the bottom, and disturbs the points.
pub fn crown_of_revolution(rings: usize, profile: impl Fn(f32) -> (f32, f32), disturbance: f32) -> PolyMesh {
    let around = 2 * rings;
    let mut mesh = PolyMesh::default();
    let disturbed = |p: Vec3, item: usize| {
        let mut d = Seed(5).keyed("test-shape", item as u64);
        p + disturbance * p.x.hypot(p.z) * Vec3::new(d.signed() as f32, d.signed() as f32, d.signed() as f32)
    };
    let lift = 2.5;
    let (bottom, top) = (profile(0.0).1, profile(std::f32::consts::PI).1);
    mesh.positions.push(Vec3::Y * (bottom + lift));
    for r in 1..rings {
        let (radius, y) = profile(std::f32::consts::PI * r as f32 / rings as f32);
        for a in 0..around {
            let angle = std::f32::consts::TAU * (a as f32 + 0.5 * (r % 2) as f32) / around as f32;
            let p = Vec3::new(radius * angle.sin(), y + lift, radius * angle.cos());
            mesh.positions.push(disturbed(p, r * around + a));
        }
    }
    mesh.positions.push(Vec3::Y * (top + lift));
    let at = |r: usize, a: usize| (1 + (r - 1) * around + a % around) as u32;
    let last = mesh.positions.len() as u32 - 1;
    for a in 0..around {
        mesh.triangles.push([0, at(1, a + 1), at(1, a)]);
        mesh.triangles.push([last, at(rings - 1, a), at(rings - 1, a + 1)]);
    }
    for r in 1..rings - 1 {
        for a in 0..around {
            mesh.quads.push([at(r, a), at(r, a + 1), at(r + 1, a + 1), at(r + 1, a)]);
        }
    }
    mesh
}

/// Noise with a grain of two or three texels in foliage colours, one texel in twelve a gap.
pub fn leafy(side: u32) -> Exemplar {
    let value = |x: u32, y: u32| Seed(9).keyed("leafy", u64::from(y) << 32 | u64::from(x)).unit();
    let image = RgbaImage::from_fn(side, side, |x, y| {
        let v = 0.5 * value(x, y) + 0.5 * value(1000 + x / 3, y / 3);
        Rgba([
            (60.0 + 90.0 * v) as u8,
            (80.0 + 130.0 * v) as u8,
            (30.0 + 50.0 * v) as u8,
            if value(x / 2, 5000 + y / 2) < 1.0 / 12.0 { 0 } else { 255 },
        ])
    });
    Exemplar {
        image,
        window_px: Rect { x: 0, y: 0, width: side, height: side },
        scale: 1.0,
        gap_fraction: 1.0 / 12.0,
        delta_e: 0.0,
    }
}
