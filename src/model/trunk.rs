//! The trunk: a closed tube of rings from the ground into the crown (She table 1: 16 triangles and 24 quads), metres.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::Trunk;
use crate::geom::{PolyMesh, Surface};
use crate::photo::TrunkCues;

/// Corners of every ring: with four rings, 24 quads and two caps of 8 triangles, as in She table 1.
const SIDES: u32 = 8;

/// Height of the ring above the root flare, as a fraction of the visible trunk.
const FLARE_HEIGHT: f32 = 0.12;

/// Widths of the four rings as fractions of the measured one: ours, as trunks flare at the ground and taper into the crown.
const WIDTHS: [f32; 4] = [1.4, 1.03, 0.9, 0.6];

/// A trunk width where none was measured, as a fraction of the tree's height: ours, slender park trees are near it.
const GUESSED_WIDTH: f64 = 1.0 / 25.0;

/// Bark where none was seen: ours, the grey brown of the sample photographs' trunks.
const GUESSED_BARK: [u8; 3] = [104, 90, 75];

/// Where a trunk stands and how thick it is. Its foot is the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrunkShape {
    /// Where it enters the crown, middle of its width.
    pub neck: Vec3,
    /// Where it ends, inside the crown.
    pub tip: Vec3,
    /// Width between foot and neck.
    pub width_m: f32,
    /// Bark colour, 8-bit sRGB.
    pub bark: [u8; 3],
}

impl TrunkShape {
    /// The trunk that a photograph shows: leaning as it leans there, ending half way to `crown_center`, so that the disturbed
    /// surface of the crown hides its end.
    pub fn seen(cues: &TrunkCues, metres_per_px: f64, crown_center: Vec3) -> Self {
        let across = (cues.neck_px - cues.foot_px) * metres_per_px;
        let neck = Vec3::new(across.x as f32, -across.y as f32, 0.0);
        Self { neck, tip: neck.midpoint(crown_center), width_m: (cues.width_px * metres_per_px) as f32, bark: cues.bark }
    }

    /// A likely trunk where none is visible, from the origin to `crown_base` and on into the crown.
    pub fn guessed(crown_base: Vec3, crown_center: Vec3, height_m: f64) -> Self {
        let width_m = (height_m * GUESSED_WIDTH) as f32;
        Self { neck: crown_base, tip: crown_base.midpoint(crown_center), width_m, bark: GUESSED_BARK }
    }

    /// The closed surface. Rings are level, so the foot lies on the ground whatever the lean.
    ///
    /// A shape that makes no sense (no width, a neck below the ground, as of a crown that reaches it) gets the least one that
    /// does: the result is always closed, outward and upright.
    pub fn build(&self) -> Trunk {
        let sound = |v: Vec3| if v.is_finite() { v } else { Vec3::ZERO };
        let width = if self.width_m.is_finite() { self.width_m.max(1e-3) } else { 1e-3 };
        let (mut neck, mut tip) = (sound(self.neck), sound(self.tip));
        neck.y = neck.y.max(width);
        tip.y = tip.y.max(neck.y + width);
        let rings = [Vec3::ZERO, neck * FLARE_HEIGHT, neck, tip];
        Trunk { surface: tube(&rings, &WIDTHS.map(|w| 0.5 * w * width)), bark: self.bark }
    }
}

/// Level rings round `centers` (rising), joined by quads and closed by fans of triangles.
fn tube(centers: &[Vec3; 4], radii: &[f32; 4]) -> Surface {
    let mut mesh = PolyMesh::default();
    let mut normals = Vec::new();
    for (ring, (&center, &radius)) in centers.iter().zip(radii).enumerate() {
        for side in 0..SIDES {
            // From +Z towards +X; the slope of the tube tilts the normal.
            let out = Vec2::from_angle(TAU * side as f32 / SIDES as f32);
            let out = Vec3::new(out.y, 0.0, out.x);
            mesh.positions.push(center + radius * out);
            normals.push(tilted(out, centers, radii, ring));
        }
    }
    let corner = |ring: u32, side: u32| ring * SIDES + side % SIDES;
    let top = centers.len() as u32 - 1;
    let (foot, tip) = (mesh.positions.len() as u32, mesh.positions.len() as u32 + 1);
    mesh.positions.extend([centers[0], centers[3]]);
    normals.extend([Vec3::NEG_Y, Vec3::Y]);
    for side in 0..SIDES {
        mesh.triangles.push([foot, corner(0, side + 1), corner(0, side)]);
        mesh.triangles.push([tip, corner(top, side), corner(top, side + 1)]);
        for ring in 0..top {
            mesh.quads.push([corner(ring, side), corner(ring, side + 1), corner(ring + 1, side + 1), corner(ring + 1, side)]);
        }
    }
    Surface { mesh, normals, ..Surface::default() }
}

/// The outward direction `out`, made perpendicular to the tube's wall between the rings around `ring`.
fn tilted(out: Vec3, centers: &[Vec3; 4], radii: &[f32; 4], ring: usize) -> Vec3 {
    let (below, above) = (ring.saturating_sub(1), (ring + 1).min(centers.len() - 1));
    let wall = (centers[above] + radii[above] * out) - (centers[below] + radii[below] * out);
    (out - wall * (out.dot(wall) / wall.length_squared())).normalize_or(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Topology;
    use glam::DVec2;
    use proptest::prelude::*;

    fn leaning() -> TrunkCues {
        TrunkCues { foot_px: DVec2::new(300.0, 790.0), neck_px: DVec2::new(320.0, 590.0), width_px: 30.0, bark: [90, 80, 70] }
    }

    #[test]
    fn a_leaning_trunk_stands_on_the_ground_and_reaches_into_the_crown() {
        let trunk = TrunkShape::seen(&leaning(), 0.01, Vec3::new(0.3, 5.0, 0.0)).build();
        let mesh = &trunk.surface.mesh;
        assert_eq!((mesh.triangles.len(), mesh.quads.len()), (16, 24), "She table 1");
        assert!(Topology::of(mesh).is_sphere() && mesh.signed_volume() > 0.0);
        let bounds = mesh.bounds().unwrap();
        assert_eq!(bounds.min.y, 0.0);
        assert!((bounds.max.y - 3.5).abs() < 1e-6, "half way from the neck at 2 m to the crown's centre at 5 m");
        let neck = mesh.positions[16..24].iter().sum::<Vec3>() / 8.0;
        assert!(neck.distance(Vec3::new(0.2, 2.0, 0.0)) < 1e-5, "{neck}");
        assert_eq!(trunk.bark, [90, 80, 70]);
    }

    #[test]
    fn a_guessed_trunk_is_slender() {
        let trunk = TrunkShape::guessed(Vec3::new(0.0, 2.0, 0.0), Vec3::new(0.0, 6.0, 0.0), 10.0).build();
        let width = trunk.surface.mesh.positions[8].distance(trunk.surface.mesh.positions[12]);
        assert!((width - 0.4).abs() < 0.03, "{width}");
    }

    proptest! {
        #[test]
        fn any_shape_is_closed_outward_and_upright(neck in prop::array::uniform3(any::<f32>()), tip in prop::array::uniform3(-20f32..20.0), width in -1f32..3.0) {
            let neck = Vec3::from(neck).clamp(Vec3::splat(-1e3), Vec3::splat(1e3));
            let surface = TrunkShape { neck, tip: tip.into(), width_m: width, bark: [0; 3] }.build().surface;
            prop_assert!(Topology::of(&surface.mesh).is_sphere());
            prop_assert!(surface.mesh.signed_volume() > 0.0);
            prop_assert!(surface.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-4));
            prop_assert!(surface.mesh.positions.iter().all(|p| p.is_finite() && p.y >= 0.0));
        }
    }
}
