//! Cones, seams and leaves of hand-made skeletons.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Mat2, Quat, Vec2, Vec3, Vec3Swizzles as _};

use super::limbs::limbs;
use super::wood::{wood, wood_within};
use super::{BarkKind, LeafKind, LeafParams, WoodParams, bark, foliage, leaves};
use crate::Seed;
use crate::geom::{PolyMesh, Surface, Topology};
use crate::plant::{Bone, BoneKind, Skeleton};

/// A bone on the end of another, or on the ground, turned about its parent's x axis.
fn grow(skeleton: &mut Skeleton, parent: Option<u32>, turn_rad: f32, length_m: f32, radii: (f32, f32), depth: u32) -> u32 {
    let (start, frame) = parent.map_or((Vec3::ZERO, Quat::IDENTITY), |p| {
        let under = &skeleton.bones[p as usize];
        (under.end(), under.orientation)
    });
    skeleton.bones.push(Bone {
        parent,
        kind: if depth == 0 { BoneKind::Trunk } else { BoneKind::Branch },
        start,
        orientation: frame * Quat::from_rotation_x(turn_rad),
        length_m,
        start_radius_m: radii.0,
        end_radius_m: radii.1,
        depth,
        tint: 0,
    });
    skeleton.bones.len() as u32 - 1
}

/// A trunk of three bones that bends, with a branch of two from its first joint, and a leaf at the branch's end.
fn sapling() -> Skeleton {
    let mut s = Skeleton::default();
    let foot = grow(&mut s, None, 0.0, 2.0, (0.3, 0.25), 0);
    let branch = grow(&mut s, Some(foot), 0.9, 1.0, (0.12, 0.08), 1);
    let twig = grow(&mut s, Some(branch), 0.2, 0.6, (0.08, 0.02), 1);
    let middle = grow(&mut s, Some(foot), 0.3, 1.5, (0.25, 0.2), 0);
    grow(&mut s, Some(middle), -0.2, 1.5, (0.2, 0.02), 0);
    let end = s.bones[twig as usize].end();
    s.bones.push(Bone {
        parent: Some(twig),
        kind: BoneKind::Leaf,
        start: end,
        orientation: Quat::IDENTITY,
        length_m: 0.2,
        start_radius_m: 0.05,
        end_radius_m: 0.05,
        depth: 2,
        tint: 0,
    });
    s
}

fn straight() -> WoodParams {
    WoodParams { root_flare: 0.0, ..WoodParams::default() }
}

/// The vertices of polygons that hang together.
fn components(mesh: &PolyMesh) -> usize {
    let mut root: Vec<usize> = (0..mesh.positions.len()).collect();
    fn find(root: &mut [usize], mut v: usize) -> usize {
        while root[v] != v {
            root[v] = root[root[v]];
            v = root[v];
        }
        v
    }
    for polygon in mesh.polygons() {
        for pair in polygon.windows(2) {
            let (a, b) = (find(&mut root, pair[0] as usize), find(&mut root, pair[1] as usize));
            root[a] = b;
        }
    }
    (0..root.len()).filter(|&v| find(&mut root, v) == v).count()
}

#[test]
fn bones_of_one_bracket_depth_make_one_branch() {
    assert_eq!(limbs(&sapling()), [vec![0, 3, 4], vec![1, 2]]);
}

#[test]
fn a_fork_of_brackets_goes_on_in_its_thickest_arm_and_a_sharp_turn_does_not() {
    let mut s = Skeleton::default();
    let foot = grow(&mut s, None, 0.0, 2.0, (0.3, 0.25), 0);
    let arms = [(0.5, 0.1), (-0.5, 0.2), (1.8, 0.24)].map(|(turn, radius)| grow(&mut s, Some(foot), turn, 1.0, (radius, 0.02), 1));
    assert_eq!(limbs(&s), [vec![foot, arms[1]], vec![arms[0]], vec![arms[2]]]);
}

#[test]
fn wood_that_may_be_off_has_fewer_polygons_and_is_as_wide() {
    let s = sapling();
    let within = |error_m: f32| wood_within(&s, &straight(), Seed(1), [error_m, 0.5 * error_m]);
    assert_eq!(within(0.0), wood(&s, &straight(), Seed(1)));
    let (fine, mut last) = (within(0.0).mesh, usize::MAX);
    for error_m in [0.0, 0.005, 0.02, 0.08] {
        let coarse = within(error_m).mesh;
        assert!(coarse.polygon_count() < last, "{error_m} m: {} polygons, {last} before", coarse.polygon_count());
        last = coarse.polygon_count();
        let (a, b) = (fine.bounds().unwrap(), coarse.bounds().unwrap());
        assert!((a.min - b.min).abs().max((a.max - b.max).abs()).max_element() < 0.31 + error_m, "{error_m} m: {a:?}, {b:?}");
        // Every corner lies as near to an axis as the branch is thick there.
        let off = |p: &Vec3| fine.positions.iter().map(|q| p.distance(*q)).fold(f32::MAX, f32::min);
        assert!(coarse.positions.iter().all(|p| off(p) < 0.1 + error_m), "{error_m} m");
    }
    // The branch of 0.24 m has gone, the trunk is a prism of three sides.
    let trunk = within(1.0).mesh;
    assert_eq!((components(&Surface { mesh: trunk.clone(), ..Surface::default() }.welded()), trunk.quads.len()), (1, 3));
    let half_width = trunk.positions.iter().filter(|p| p.y < 0.01).map(|p| p.xz().length()).fold(0.0, f32::max);
    assert!(half_width > 0.3 && half_width < 0.37, "{half_width}: wide enough on the average");
}

#[test]
fn every_branch_is_closed_faces_outward_and_shares_its_rings() {
    for params in [straight(), WoodParams::default(), WoodParams { bark_sides: 3, ..straight() }] {
        let surface = wood(&sapling(), &params, Seed(1));
        let mesh = surface.welded();
        let topology = Topology::of(&mesh);
        assert!(topology.closed && topology.manifold && topology.oriented, "{topology:?}");
        assert_eq!((components(&mesh), topology.euler), (2, 4), "two branches, each like a sphere");
        assert!(mesh.signed_volume() > 0.3, "{}", mesh.signed_volume());
        let outward = |t: [u32; 3]| {
            let [a, b, c] = t.map(|v| surface.mesh.positions[v as usize]);
            let face = (b - a).cross(c - a).normalize();
            // The ring round a flat foot belongs to the flaring trunk above it.
            face.y < -0.99 || t.iter().all(|&v| surface.normals[v as usize].dot(face) > 0.0)
        };
        assert!(surface.mesh.triangulated().all(outward), "normals agree with faces");
    }
}

#[test]
fn cones_have_the_radii_of_their_bones() {
    let mut s = Skeleton::default();
    let foot = grow(&mut s, None, 0.0, 2.0, (0.3, 0.2), 0);
    grow(&mut s, Some(foot), 0.0, 2.0, (0.2, 0.1), 0);
    let surface = wood(&s, &straight(), Seed(1));
    for (height, radius) in [(0.0, 0.3), (2.0, 0.2), (4.0, 0.1)] {
        let ring = surface.mesh.positions.iter().filter(|p| (p.y - height).abs() < 1e-4 && p.xz().length() > 0.0);
        let radii: Vec<f32> = ring.map(|p| p.xz().length()).collect();
        assert!(radii.len() >= 7 && radii.iter().all(|r| (r - radius).abs() < 1e-4), "at {height}: {radii:?}");
    }
    let bounds = surface.mesh.bounds().unwrap();
    assert!(bounds.min.y == 0.0 && (bounds.max.y - 4.1).abs() < 1e-4, "flat foot, half-sphere on top: {bounds:?}");
    let flared = wood(&s, &WoodParams::default(), Seed(1)).mesh.bounds().unwrap();
    assert!(flared.size().x > 1.3 * bounds.size().x && flared.min.y == 0.0, "roots widen the foot: {flared:?}");
}

/// How unlike the two scales of the texture on a triangle are: the ratio of the singular values of its map.
fn stretch(surface: &Surface, t: [u32; 3]) -> f32 {
    let [a, b, c] = t.map(|v| surface.mesh.positions[v as usize]);
    let [p, q, r] = t.map(|v| surface.uvs[v as usize]);
    let x = (b - a).normalize();
    let y = (c - a).reject_from(x);
    let flat = Mat2::from_cols(Vec2::new((b - a).length(), 0.0), Vec2::new((c - a).dot(x), y.length()));
    let map = Mat2::from_cols(q - p, r - p) * flat.inverse();
    let (sum, det) = (map.x_axis.length_squared() + map.y_axis.length_squared(), map.determinant().abs());
    let root = (sum * sum - 4.0 * det * det).max(0.0).sqrt();
    ((sum + root) / (sum - root).max(1e-12)).sqrt()
}

#[test]
fn bark_is_not_stretched_along_branches() {
    let surface = wood(&sapling(), &straight(), Seed(1));
    let mut worst: Vec<f32> =
        surface.mesh.quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).map(|t| stretch(&surface, t)).collect();
    worst.sort_by(f32::total_cmp);
    // Half-spheres, and a long cone that ends in a tenth of its girth, bear the greatest.
    assert!(worst[worst.len() / 2] < 1.35, "median {}", worst[worst.len() / 2]);
    assert!(worst[worst.len() * 9 / 10] < 3.0, "90 % {}", worst[worst.len() * 9 / 10]);
    let turns = |uv: &Vec2| (uv.x - surface.uvs[0].x).abs();
    let round = surface.uvs.iter().take(40).map(turns).fold(0.0, f32::max).ceil();
    assert!((round * 0.7 / (TAU * 0.3) - 1.0).abs() < 0.3, "a whole number of tiles round the trunk: {round}");
}

#[test]
fn a_leaf_is_a_quad_with_its_foot_on_its_bone() {
    let still = LeafParams { leaf_size_jitter: 0.0, leaf_turn_jitter_deg: 0.0, ..LeafParams::default() };
    let s = sapling();
    let found = leaves::leaves(&s, foliage::SHEET, &still, Seed(1));
    assert_eq!((found.bones.as_slice(), found.surface.mesh.quads.as_slice()), (&[5u32][..], &[[0, 1, 2, 3]][..]));
    let [a, b, c, d] = [0, 1, 2, 3].map(|i| found.surface.mesh.positions[i]);
    assert!((a.midpoint(b) - s.bones[5].start).length() < 1e-6 && (c.midpoint(d) - s.bones[5].end()).length() < 1e-6);
    assert!(((b - a).length() - 0.1).abs() < 1e-6 && (b - a).cross(d - a).normalize().dot(Vec3::Z) > 0.999);
    assert!(found.surface.uvs[0].y > found.surface.uvs[3].y, "the foot is at the lower edge of its picture");
    assert_eq!(found.surface.uvs.iter().fold(Vec2::ZERO, |s, t| s + *t) / 4.0 % 0.5, Vec2::splat(0.25), "one cell of the picture");
    assert!(found.surface.normals.iter().all(|n| n.is_normalized() && n.z > 0.0));
}

#[test]
fn jitter_stays_within_its_bounds_and_follows_the_seed() {
    let mut s = Skeleton::default();
    for _ in 0..200 {
        s.bones.push(Bone { start: Vec3::ZERO, ..sapling().bones[5] });
    }
    let of = |seed| leaves::leaves(&s, foliage::SHEET, &LeafParams::default(), Seed(seed)).surface;
    assert_eq!(of(3), of(3));
    assert_ne!(of(3).mesh.positions, of(4).mesh.positions);
    let lengths: Vec<f32> = of(3).mesh.positions.chunks(4).map(|q| (q[3] - q[0]).length()).collect();
    assert!(
        lengths.iter().all(|l| (0.149..0.251).contains(l))
            && lengths.iter().any(|l| *l < 0.16)
            && lengths.iter().any(|l| *l > 0.24)
    );
}

#[test]
fn bones_that_make_no_sense_are_left_out() {
    let mut s = sapling();
    for broken in [f32::NAN, f32::INFINITY, 0.0, -1.0] {
        s.bones.push(Bone { length_m: broken, ..s.bones[1] });
        s.bones.push(Bone { length_m: broken, ..s.bones[5] });
        s.bones.push(Bone { start_radius_m: broken.min(0.0), end_radius_m: broken.min(0.0), ..s.bones[2] });
    }
    s.bones.push(Bone { parent: Some(99), start: Vec3::ONE, ..s.bones[1] });
    s.bones.push(Bone { orientation: Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0), ..s.bones[1] });
    let surface = wood(&s, &WoodParams::default(), Seed(1));
    assert!(
        surface.mesh.positions.iter().chain(&surface.normals).all(|p| p.is_finite()) && surface.uvs.iter().all(|t| t.is_finite())
    );
    assert_eq!(components(&surface.welded()), 3, "the one without a parent is drawn");
    assert_eq!(leaves::leaves(&s, foliage::SHEET, &LeafParams::default(), Seed(1)).bones, [5]);
    assert_eq!(wood(&Skeleton::default(), &WoodParams::default(), Seed(1)), Surface::default());
}

#[test]
fn a_bend_of_a_right_angle_keeps_its_girth() {
    let mut s = Skeleton::default();
    let foot = grow(&mut s, None, 0.0, 2.0, (0.1, 0.1), 0);
    grow(&mut s, Some(foot), FRAC_PI_2 - 0.3, 2.0, (0.1, 0.1), 0);
    let surface = wood(&s, &straight(), Seed(1));
    assert!(Topology::of(&surface.welded()).closed);
    assert!(surface.mesh.signed_volume() > 0.6 * 4.0 * 0.0314);
}

#[test]
fn pictures_follow_the_seed_and_leave_room_to_see_through() {
    let leaf = foliage::picture(LeafKind::Oval, Seed(1));
    assert_eq!(leaf, foliage::picture(LeafKind::Oval, Seed(1)));
    assert_ne!(leaf, foliage::picture(LeafKind::Oval, Seed(2)));
    let kinds = [
        LeafKind::Heart,
        LeafKind::Lobed,
        LeafKind::Birch,
        LeafKind::Narrow,
        LeafKind::Feather,
        LeafKind::Tuft,
        LeafKind::Spray,
        LeafKind::Yew,
        LeafKind::Scale,
        LeafKind::Oval,
    ];
    for kind in kinds {
        let picture = foliage::picture(kind, Seed(1));
        let part = picture.pixels().filter(|p| p[3] >= 128).count() as f32 / (picture.width() * picture.height()) as f32;
        assert!((0.05..0.6).contains(&part), "{kind:?} covers {part}");
        let (w, h) = picture.dimensions();
        assert!((0..w).all(|i| picture.get_pixel(i, 0)[3] == 0 && picture.get_pixel(0, i)[3] == 0), "{kind:?} touches its border");
        assert!((0..w * h).all(|i| picture.get_pixel(i % w, i / w).0[..3] != [0, 0, 0]), "{kind:?} has black under its alpha");
    }
}

#[test]
fn bark_tiles() {
    for kind in [BarkKind::Furrowed, BarkKind::White, BarkKind::Plated, BarkKind::Smooth, BarkKind::Stringy] {
        let picture = bark::picture(kind, Seed(1));
        let side = picture.width();
        let step = |a: (u32, u32), b: (u32, u32)| {
            let (p, q) = (picture.get_pixel(a.0, a.1), picture.get_pixel(b.0, b.1));
            (0..3).map(|c| f64::from(p[c].abs_diff(q[c]))).sum::<f64>()
        };
        let mean = |f: &dyn Fn(u32) -> f64| (0..side).map(f).sum::<f64>() / f64::from(side);
        let seam = mean(&|i| step((0, i), (side - 1, i)) + step((i, 0), (i, side - 1)));
        let inside = mean(&|i| step((200, i), (201, i)) + step((i, 200), (i, 201)));
        assert!(seam < 2.5 * inside + 3.0, "{kind:?}: {seam} across the seam, {inside} inside");
    }
}
