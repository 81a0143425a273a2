use super::*;
use crate::geom::PolyMesh;
use image::Rgba;
use std::f32::consts::{FRAC_PI_2, PI};

/// A square of 2 m in the plane z = `z`, facing +Z, its texture upright.
fn square(z: f32) -> Surface {
    let mesh = PolyMesh {
        positions: [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, z)).to_vec(),
        triangles: vec![],
        quads: vec![[0, 1, 2, 3]],
    };
    let uvs = [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)].map(|(u, v)| Vec2::new(u, v)).to_vec();
    Surface { normals: vec![Vec3::Z; 4], mesh, uvs, ..Surface::default() }
}

fn view(azimuth_rad: f32, elevation_rad: f32) -> View {
    View {
        axes: View::axes_from(azimuth_rad, elevation_rad),
        center: Vec3::ZERO,
        half_size_m: Vec2::ONE,
        slab_m: View::ALL,
        width_px: 4,
        height_px: 4,
    }
}

fn red() -> Material<'static> {
    Material { factor: [1.0, 0.0, 0.0, 1.0], ..Material::default() }
}

#[test]
fn the_picture_is_upright_and_texels_fall_on_their_pixels() {
    let mut texture = RgbaImage::from_pixel(4, 4, Rgba([0, 0, 0, 255]));
    texture.put_pixel(2, 1, Rgba([255, 0, 0, 255]));
    texture.put_pixel(1, 2, Rgba([0, 0, 0, 0]));
    let c = render(&[(&square(0.25), Material { texture: Some(&texture), ..Material::default() })], &view(0.0, 0.0), None).unwrap();
    assert!(c.color.get_pixel(2, 1)[0] > 200 && c.color.get_pixel(1, 1)[0] < 120 && c.color.get_pixel(0, 0)[0] == 0);
    assert!(c.coverage.get_pixel(1, 2)[0] < 120, "the hole of the texture is a hole of the picture");
    assert_eq!(c.coverage.get_pixel(3, 3)[0], 255);
    assert!((c.depth_m[5] - 0.25).abs() < 1e-6);
    assert_eq!(c.normal[5], Vec3::Z);
}

#[test]
fn views_turn_the_right_way_and_faces_have_one_side() {
    for (azimuth, expected) in [(0.0, Vec3::Z), (FRAC_PI_2, Vec3::X), (PI, -Vec3::Z)] {
        assert!((view(azimuth, 0.0).axes[2] - expected).length() < 1e-6);
    }
    assert!((view(0.3, FRAC_PI_2).axes[2] - Vec3::Y).length() < 1e-6);
    let seen = |azimuth, two_sided| {
        let c = render(&[(&square(0.0), Material { two_sided, ..red() })], &view(azimuth, 0.0), None).unwrap();
        (c.coverage.get_pixel(1, 1)[0], c.normal[5].z)
    };
    assert_eq!(seen(0.0, false), (255, 1.0));
    assert_eq!(seen(PI, false), (0, 0.0));
    assert_eq!(seen(PI, true), (255, -1.0));
}

#[test]
fn the_nearer_surface_hides_the_other_whatever_the_order() {
    let (near, far) = (square(0.5), square(-0.5));
    let green = Material { factor: [0.0, 1.0, 0.0, 1.0], ..Material::default() };
    for surfaces in [[(&near, red()), (&far, green)], [(&far, green), (&near, red())]] {
        let c = render(&surfaces, &view(0.0, 0.0), None).unwrap();
        assert_eq!(c.color.get_pixel(1, 1).0, [255, 0, 0, 255]);
    }
}

#[test]
fn a_fine_chequerboard_from_afar_is_even_grey() {
    let texture = RgbaImage::from_fn(256, 256, |x, y| {
        let v = 255 * ((x + y) % 2) as u8;
        Rgba([v, v, v, 255])
    });
    let c = render(&[(&square(0.0), Material { texture: Some(&texture), ..Material::default() })], &view(0.0, 0.0), None).unwrap();
    let half = to_srgb(0.5);
    assert!(c.color.pixels().all(|p| p[0].abs_diff(half) <= 2), "half the light is sRGB {half}");
}

#[test]
fn light_follows_the_normal() {
    let lit = |sun: Vec3| {
        let light = Light { toward_sun: sun, ambient: 0.25 };
        to_linear(render(&[(&square(0.0), red())], &view(0.0, 0.0), Some(&light)).unwrap().color.get_pixel(1, 1)[0])
    };
    assert!((lit(Vec3::Z) - 1.0).abs() < 0.01 && (lit(Vec3::X) - 0.25).abs() < 0.01 && (lit(-Vec3::Z) - 0.25).abs() < 0.01);
}

#[test]
fn nothing_degenerate_panics() {
    let empty = Surface::default();
    let c = render(&[(&empty, red())], &view(0.0, 0.0), None).unwrap();
    assert!(c.coverage.pixels().all(|p| p[0] == 0));
    let mut odd = square(0.0);
    odd.mesh.positions[0] = Vec3::NAN;
    odd.mesh.positions[1] = odd.mesh.positions[2];
    render(&[(&odd, red())], &view(0.0, 0.0), None).unwrap();
    let texture = RgbaImage::new(0, 0);
    render(&[(&square(0.0), Material { texture: Some(&texture), ..red() })], &view(0.0, 0.0), None).unwrap();
    let mut stray = square(0.0);
    stray.mesh.quads[0][0] = 9;
    assert!(matches!(render(&[(&stray, red())], &view(0.0, 0.0), None), Err(Error::Surface { .. })));
    assert!(matches!(render(&[], &View { width_px: 0, ..view(0.0, 0.0) }, None), Err(Error::View { .. })));
    assert!(matches!(render(&[], &View { half_size_m: Vec2::NAN, ..view(0.0, 0.0) }, None), Err(Error::View { .. })));
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let texture = RgbaImage::from_fn(16, 16, |x, y| Rgba([(x * 16) as u8, (y * 16) as u8, (x * y) as u8, (255 - 9 * x) as u8]));
    let drawn = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let big = View { width_px: 90, height_px: 70, ..view(0.4, 0.7) };
        pool.install(|| {
            render(&[(&square(0.1), Material { texture: Some(&texture), ..Material::default() })], &big, None).unwrap().color
        })
    };
    assert_eq!(drawn(1), drawn(3));
}
