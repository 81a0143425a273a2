//! How light each texel of a far picture is: leaves that lie deep among others are dark under almost any sun, those on one side of a tuft
//! under some. Neither shows in a picture without light on a smooth surface, and the crown looks flat.
//!
//! The pictures of one tree are maps of what is hidden from each of their stands (Williams 1978): taken for suns, they tell how light every
//! leaf is under each of them. What the renderer makes of a card's texel (shaders/shared/shade.wgsl: a crown for an ellipsoid) is then brought
//! as near to that as a colour and a normal can. Ours. Metres; linear light.

use glam::{Mat4, Vec3, Vec4};
use rayon::prelude::*;

use super::tone::{GROUND, SKY, SUN, THROUGH, WRAP};
use crate::geom::Bounds;
use crate::raster::{self, View, to_linear, to_srgb};

/// How deep sunlight gets among leaves before e times as much is left outside, heights of the tree. Less than the renderer has it for true
/// leaves (0.03): pictures of a few hundred pixels miss some of what hides them.
const AMONG_LEAVES: f32 = 0.02;
/// How far wood may lie behind what hides it and be lit all the same, heights.
const BARE: f32 = 0.02;
/// As shaders/shared/shade.wgsl has them: how far sunlight gets into a crown that a card stands for, and how deep the leaves and the wood lie
/// that it shows, heights; how much of the sky wood and leaves see.
const LIGHT_REACHES: f32 = 0.3;
const LEAVES_LIE: f32 = 0.14;
const WOOD_LIES: f32 = 0.35;
const OPEN: [f32; 2] = [0.55, 0.75];
/// What counts for how the normal is turned: a normal that is only slightly better is not worth leaving the true one.
const TRUE_NORMAL: f32 = 0.1;
/// What the colour is multiplied by at least and at most.
const WITHIN: (f32, f32) = (0.2, 1.5);

/// What is known of a tree from all sides.
pub(super) struct Shade<'a> {
    pub views: &'a [View],
    pub taken: &'a [raster::Capture],
    /// For each pixel whether it shows foliage, 0 to 255.
    pub leaves: &'a [Vec<u8>],
    pub bounds: Bounds,
}

/// What is seen at a texel: the means of its pixels.
struct Texel {
    place: Vec3,
    /// How much of it is foliage, 0..=1.
    leaf: f32,
    /// Of direct light, from each view's side.
    light: Vec<f32>,
}

impl Shade<'_> {
    /// Brings the light of the leaves into `small`, which is picture `number` with each texel the mean of `by` × `by` pixels.
    pub fn cast_on(&self, small: &mut raster::Capture, number: usize, by: u32) {
        let width = small.color.width();
        let found = |(at, normal): (usize, &Vec3)| {
            let texel = self.texel(number, at as u32 % width, at as u32 / width, by)?;
            Some(self.worn(number, &texel, *normal))
        };
        let found: Vec<Option<(f32, Vec3)>> = small.normal.par_iter().enumerate().map(found).collect();
        let texels = small.color.pixels_mut().zip(&mut small.normal).zip(found);
        for ((color, normal), (tint, bent)) in texels.filter_map(|(texel, found)| Some((texel, found?))) {
            color.0[..3].iter_mut().for_each(|c| *c = to_srgb((tint * to_linear(*c)).min(1.0)));
            *normal = bent;
        }
    }

    /// What the pixels of a texel show; `None` for nothing.
    fn texel(&self, number: usize, x: u32, y: u32, by: u32) -> Option<Texel> {
        let (view, taken) = (&self.views[number], &self.taken[number]);
        let mut texel = Texel { place: Vec3::ZERO, leaf: 0.0, light: vec![0.0; self.views.len()] };
        let mut covered = 0.0;
        for (i, j) in (0..by * by).map(|k| (by * x + k % by, by * y + k / by)) {
            let at = (j * view.width_px + i) as usize;
            let weight = f32::from(taken.coverage.as_raw()[at]) / 255.0;
            if weight <= 0.0 || !taken.depth_m[at].is_finite() {
                continue;
            }
            let place = place(view, i, j, taken.depth_m[at]);
            let leaf = f32::from(self.leaves[number][at]) / 255.0;
            covered += weight;
            texel.place += weight * place;
            texel.leaf += weight * leaf;
            for (other, light) in texel.light.iter_mut().enumerate() {
                let behind_m = if other == number { 0.0 } else { self.behind_m(other, place) };
                *light += weight * self.sun_on(leaf, behind_m, taken.normal[at], self.views[other].axes[2]);
            }
        }
        texel.light.iter_mut().for_each(|light| *light /= covered);
        (covered > 0.0).then(|| Texel { place: texel.place / covered, leaf: texel.leaf / covered, ..texel })
    }

    /// Sunlight on something that lies so far behind what the sun sees.
    fn sun_on(&self, leaf: f32, behind_m: f32, normal: Vec3, toward_sun: Vec3) -> f32 {
        let height_m = self.bounds.height_m();
        let among = (-behind_m.max(0.0) / (AMONG_LEAVES * height_m)).exp();
        let bare = f32::from(u8::from(behind_m < BARE * height_m));
        let [on_leaf, on_wood] = facing(normal, toward_sun);
        leaf * among * on_leaf + (1.0 - leaf) * bare * on_wood
    }

    /// How far a place lies behind what a view shows there.
    fn behind_m(&self, number: usize, place: Vec3) -> f32 {
        let View { axes: [right, up, toward], center, half_size_m, width_px, height_px, .. } = self.views[number];
        let aside = place - center;
        let x = (0.5 + 0.5 * aside.dot(right) / half_size_m.x) * width_px as f32;
        let y = (0.5 - 0.5 * aside.dot(up) / half_size_m.y) * height_px as f32;
        if !(0.0..width_px as f32).contains(&x) || !(0.0..height_px as f32).contains(&y) {
            return 0.0;
        }
        let slack_m = 2.0 * half_size_m.x / width_px as f32;
        self.taken[number].depth_m[y as usize * width_px as usize + x as usize] - aside.dot(toward) - slack_m
    }

    /// By what the colour is multiplied, and the normal, with which a card's texel is as light as what it shows under the same suns.
    fn worn(&self, number: usize, texel: &Texel, normal: Vec3) -> (f32, Vec3) {
        let suns = || texel.light.iter().zip(self.views).map(|(light, view)| (*light, view.axes[2]));
        let reaching: Vec<f32> = suns().map(|(_, sun)| self.reaching_card(number, texel, sun)).collect();
        // Light on leaves is linear in the normal n: reaching · (WRAP · t + t n · sun) / (1 + WRAP). Least squares for t and t n.
        let (mut squares, mut sums) =
            (Mat4::from_diagonal(Vec4::splat(TRUE_NORMAL)), TRUE_NORMAL * Vec4::new(1.0, normal.x, normal.y, normal.z));
        for ((light, sun), reaching) in suns().zip(&reaching) {
            let row = reaching / (1.0 + WRAP) * Vec4::new(WRAP, sun.x, sun.y, sun.z);
            squares += Mat4::from_cols(row.x * row, row.y * row, row.z * row, row.w * row);
            sums += light * row;
        }
        let [_, x, y, z] = (squares.inverse() * sums).to_array();
        let bent = Vec3::new(x, y, z).normalize_or(normal);
        let ambient = |n: Vec3| (GROUND + (SKY - GROUND) * (0.5 + 0.5 * n.y)) * (OPEN[0] + (OPEN[1] - OPEN[0]) * texel.leaf);
        let (mut there, mut card) = (0.0, 0.0);
        for ((light, sun), reaching) in suns().zip(&reaching) {
            let [on_leaf, on_wood] = facing(bent, sun);
            there += SUN * light + ambient(normal);
            card += SUN * reaching * (texel.leaf * on_leaf + (1.0 - texel.leaf) * on_wood) + ambient(bent);
        }
        ((there / card).clamp(WITHIN.0, WITHIN.1), bent)
    }

    /// Sunlight that the renderer lets reach a card's texel: `sun_at_card` of shaders/shared/shade.wgsl.
    fn reaching_card(&self, number: usize, texel: &Texel, toward_sun: Vec3) -> f32 {
        let (half, height_m) = (0.5 * self.bounds.size(), self.bounds.height_m());
        let wide = 0.5 * (half.x + half.z);
        let half = Vec3::new(wide, half.y, wide).max(Vec3::splat(1e-4));
        let at = (texel.place - self.bounds.center()) / half;
        let seer = self.views[number].axes[2] / half;
        let out = way_out(at, seer).max(0.0);
        let through = |deep: f32| {
            let way_m = way_out(at + (out - deep * height_m) * seer, toward_sun / half);
            (-way_m.max(0.0) / (LIGHT_REACHES * height_m)).exp()
        };
        texel.leaf * through(LEAVES_LIE) + (1.0 - texel.leaf) * through(WOOD_LIES)
    }
}

/// Where a pixel lies that is so far towards the viewer.
fn place(view: &View, x: u32, y: u32, depth_m: f32) -> Vec3 {
    let part = |i: u32, n: u32| 2.0 * (i as f32 + 0.5) / n as f32 - 1.0;
    let [right, up, toward] = view.axes;
    let (across, along) = (part(x, view.width_px) * view.half_size_m.x, part(y, view.height_px) * view.half_size_m.y);
    view.center + across * right - along * up + depth_m * toward
}

/// What of sunlight a leaf and wood of that normal throw back.
fn facing(normal: Vec3, toward_sun: Vec3) -> [f32; 2] {
    let cosine = normal.dot(toward_sun);
    [((cosine + WRAP) / (1.0 + WRAP)).max(0.0) + THROUGH, cosine.max(0.0)]
}

/// How far a ray goes on in the unit ball, in its own lengths; where it misses, to where it is nearest to the middle.
fn way_out(start: Vec3, along: Vec3) -> f32 {
    let (a, b) = (along.dot(along), start.dot(along));
    ((b * b - a * (start.dot(start) - 1.0)).max(0.0).sqrt() - b) / a
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{PolyMesh, Surface};
    use crate::model::{Material, Part};
    use crate::repr::{Capture as _, SoftwareCapture};

    #[test]
    fn the_renderer_lights_cards_as_is_reckoned_here() {
        let shader = include_str!("../../../shaders/shared/shade.wgsl");
        for (name, value) in [("LIGHT_REACHES", LIGHT_REACHES), ("LEAVES_LIE", LEAVES_LIE), ("WOOD_LIES", WOOD_LIES)] {
            assert!(shader.contains(&format!("const {name}: f32 = {value};")), "{name}");
        }
        assert!(shader.contains(&format!("mix({}, {}, leaf)", OPEN[0], OPEN[1])));
    }

    /// A square leaf, level, its normal upwards.
    fn leaf(middle: Vec3, half_m: f32) -> Part {
        let positions =
            [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)].map(|(x, z)| middle + half_m * Vec3::new(x, 0.0, z)).to_vec();
        let mesh = PolyMesh { positions, triangles: vec![], quads: vec![[0, 1, 2, 3]] };
        let material = Material { factor: [0.2, 0.6, 0.1, 1.0], two_sided: true, ..Material::default() };
        let surface = Surface { normals: vec![Vec3::Y; 4], mesh, ..Surface::default() };
        Part { name: "leaf".to_owned(), surface, material, crown_center: None }
    }

    #[test]
    fn what_lies_under_others_is_darker_and_leans_to_where_light_comes_in() {
        // A wide leaf, half of it under another one on the right.
        let leaves = [leaf(Vec3::ZERO, 1.0), leaf(Vec3::new(0.6, 1.0, 0.0), 0.5)];
        let parts: Vec<&Part> = leaves.iter().collect();
        let bounds = Bounds { min: Vec3::new(-1.0, -1.0, -1.0), max: Vec3::new(1.0, 1.0, 1.0) };
        let views: Vec<View> = [(0.0, 0.3), (0.0, 1.57), (1.57, 0.7), (-1.57, 0.7), (-1.57, 0.3), (3.1, 0.7)]
            .map(|(azimuth, up)| {
                let axes = View::axes_from(azimuth, up);
                View {
                    axes,
                    center: Vec3::ZERO,
                    half_size_m: glam::Vec2::splat(1.6),
                    slab_m: View::ALL,
                    width_px: 64,
                    height_px: 64,
                }
            })
            .to_vec();
        let taken = SoftwareCapture::new().take(&parts, &views).unwrap();
        let leaves = vec![vec![255; 64 * 64]; views.len()];
        let shade = Shade { views: &views, taken: &taken, leaves: &leaves, bounds };
        // Seen from the left: under the upper leaf, and out in the open.
        let (hidden, open) = (0.35, -0.8);
        let worn = |x: f32| {
            let place = Vec3::new(x, 0.0, 0.0);
            let light =
                views.iter().enumerate().map(|(k, view)| shade.sun_on(1.0, shade.behind_m(k, place), Vec3::Y, view.axes[2]));
            shade.worn(3, &Texel { place, leaf: 1.0, light: light.collect() }, Vec3::Y)
        };
        let ((dark, lean), (light, upright)) = (worn(hidden), worn(open));
        assert!(dark < 0.9 * light, "{dark} {light}");
        assert!(lean.x < upright.x - 0.1, "{lean} {upright}");
    }
}
