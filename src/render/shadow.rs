//! The sun's view of the trees: a depth map of what it meets first (Williams 1978), whose texels stay where they are when the viewer moves.

use glam::{Mat3, Mat4, Vec2, Vec3, Vec4};

use super::camera::Camera;
use super::targets::DEPTH;
use crate::Result;
use crate::geom::Bounds;
use crate::gpu::{Gpu, Target, target};
use crate::repr::REFERENCE_FOCAL_PX;

/// Sides of the map grow in steps of this factor, so that texels keep their size while a scene changes a little.
const STEP: f32 = 1.090_507_7; // ⁸√2

/// How far a wide map moves at once, as a share of the range.
const LEAP: f32 = 0.2;

/// Where the sun looks from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SunView {
    /// World space to the map: x and y within ±1, depth 1 nearest the sun and 0 farthest.
    pub clip_from_world: Mat4,
    /// Side of a texel, metres.
    pub texel_m: f32,
    /// Metres from depth 1 to depth 0.
    pub depth_m: f32,
}

impl SunView {
    /// The view along `toward_sun` (unit length) of everything in `casters` or, where that is wider, of what lies within `range_m` before
    /// the viewer, on a map of `size_px` texels a side.
    pub fn fit(toward_sun: Vec3, casters: Bounds, camera: &Camera, range_m: f32, size_px: u32) -> Self {
        let up = if toward_sun.y.abs() < 0.99 { Vec3::Y } else { Vec3::Z };
        let right = up.cross(toward_sun).normalize();
        let sun_from_world = Mat3::from_cols(right, toward_sun.cross(right), toward_sun).transpose();
        let corners = (0..8).map(|i| corner(casters, i)).map(|p| sun_from_world * p);
        let seen = Bounds::of(corners).expect("a box has corners");
        let size = seen.size();
        let wide = size.x.max(size.y) > 2.0 * range_m;
        // A wide map moves on in leaps, so that it stays as it is while the viewer moves a little.
        let leap = if wide { LEAP * range_m } else { 0.0 };
        // Two texels stay free round the edge, so that what lies outside finds no shadow there.
        let needed = if wide { 2.0 * range_m + leap } else { size.x.max(size.y).max(0.1) };
        let least = needed * size_px as f32 / (size_px as f32 - 6.0);
        let side = STEP.powf((least.ln() / STEP.ln()).ceil());
        let texel_m = side / size_px as f32;
        let focus = if wide { sun_from_world * (camera.eye - 0.8 * range_m * camera.axes[2]) } else { seen.center() };
        let raster_m = texel_m * (leap / texel_m).max(1.0).floor();
        let center = (focus.truncate() / raster_m).round() * raster_m;
        let depth_m = 1.01 * size.z.max(0.1);
        let scale = Vec2::splat(2.0 / side).extend(1.0 / depth_m);
        let offset = Vec3::new(center.x, center.y, seen.max.z + 0.005 * size.z - depth_m);
        let clip_from_sun = Mat4::from_cols(Vec4::X * scale.x, Vec4::Y * scale.y, Vec4::Z * scale.z, (-offset * scale).extend(1.0));
        Self { clip_from_world: clip_from_sun * Mat4::from_mat3(sun_from_world), texel_m, depth_m }
    }

    /// How far away, in metres of the picture for which distances are told, trees look as large as they are on the map.
    pub fn level_m(&self) -> f32 {
        REFERENCE_FOCAL_PX * self.texel_m
    }

    /// Whether anything of a sphere may be on the map.
    pub fn sees(&self, center: Vec3, radius_m: f32, size_px: u32) -> bool {
        let reach = 1.0 + 2.0 * radius_m / (self.texel_m * size_px as f32);
        let p = self.clip_from_world.transform_point3(center);
        p.x.abs() <= reach && p.y.abs() <= reach
    }
}

fn corner(b: Bounds, i: u8) -> Vec3 {
    let pick = |bit: u8, low: f32, high: f32| if i & bit == 0 { low } else { high };
    Vec3::new(pick(1, b.min.x, b.max.x), pick(2, b.min.y, b.max.y), pick(4, b.min.z, b.max.z))
}

/// The depth map on the device: group 2 of everything that is lit.
#[derive(Debug)]
pub struct SunMap {
    /// Side, pixels.
    pub size_px: u32,
    /// The depth, drawn into by the casters.
    pub depth: Target,
    /// What the shaders bind.
    pub group: wgpu::BindGroup,
    /// Its layout.
    pub layout: wgpu::BindGroupLayout,
}

impl SunMap {
    /// A map of that size.
    pub fn new(gpu: &Gpu, size_px: u32) -> Self {
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("shadow.layout"),
            entries: &[
                entry(
                    0,
                    wgpu::BindingType::Texture {
                        sample_type: wgpu::TextureSampleType::Depth,
                        view_dimension: wgpu::TextureViewDimension::D2,
                        multisampled: false,
                    },
                ),
                entry(1, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison)),
            ],
        });
        let (depth, group) = map(gpu, &layout, size_px);
        Self { size_px, depth, group, layout }
    }

    /// Makes the map anew where another size is wanted; at most what the device allows.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) when memory runs out; the old map stays.
    pub fn resize(&mut self, gpu: &Gpu, size_px: u32) -> Result<()> {
        let size_px = size_px.min(gpu.device.limits().max_texture_dimension_2d);
        if size_px != self.size_px {
            (self.depth, self.group) = gpu.guarded(|| map(gpu, &self.layout, size_px))?;
            self.size_px = size_px;
        }
        Ok(())
    }
}

fn entry(binding: u32, ty: wgpu::BindingType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::FRAGMENT, ty, count: None }
}

fn map(gpu: &Gpu, layout: &wgpu::BindGroupLayout, size_px: u32) -> (Target, wgpu::BindGroup) {
    let depth = target(gpu, "shadow.depth", [size_px; 2], DEPTH);
    let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("shadow.sampler"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        compare: Some(wgpu::CompareFunction::GreaterEqual),
        ..Default::default()
    });
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("shadow.group"),
        layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&depth.view) },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&sampler) },
        ],
    });
    (depth, group)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SIZE: u32 = 1024;

    fn sun(azimuth: f32, elevation: f32) -> Vec3 {
        Vec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos())
    }

    proptest! {
        #[test]
        fn all_casters_are_on_the_map_with_a_free_edge(
            azimuth in 0f32..6.3, elevation in -0.2f32..1.57, at in prop::array::uniform3(-80f32..80.0), size in prop::array::uniform3(0f32..30.0),
        ) {
            let casters = Bounds { min: Vec3::from(at), max: Vec3::from(at) + Vec3::from(size) };
            let view = SunView::fit(sun(azimuth, elevation), casters, &Camera::orbit(Vec3::ZERO, 0.0, 0.0, 9.0), 500.0, SIZE);
            for i in 0..8 {
                let p = view.clip_from_world.transform_point3(corner(casters, i));
                prop_assert!(p.truncate().abs().max_element() < 1.0 - 2.0 / SIZE as f32, "{p}");
                prop_assert!((0.0..=1.0).contains(&p.z), "{p}");
            }
        }

        #[test]
        fn texels_stay_where_they_are_when_the_viewer_moves(azimuth in 0f32..6.3, elevation in 0.1f32..1.5, moved in prop::array::uniform3(-9f32..9.0)) {
            let casters = Bounds { min: Vec3::new(-2000.0, 0.0, -2000.0), max: Vec3::new(2000.0, 20.0, 2000.0) };
            let mut camera = Camera::orbit(Vec3::ZERO, 1.0, 0.2, 30.0);
            let before = SunView::fit(sun(azimuth, elevation), casters, &camera, 100.0, SIZE);
            camera.eye += Vec3::from(moved);
            let after = SunView::fit(sun(azimuth, elevation), casters, &camera, 100.0, SIZE);
            prop_assert_eq!((before.texel_m, before.depth_m), (after.texel_m, after.depth_m));
            let texels = 0.5 * SIZE as f32 * (after.clip_from_world - before.clip_from_world).w_axis.truncate().truncate();
            prop_assert!((texels - texels.round()).abs().max_element() < 0.02, "{texels}");
        }
    }

    #[test]
    fn nearer_to_the_sun_is_more_depth() {
        let casters = Bounds { min: Vec3::ZERO, max: Vec3::splat(10.0) };
        let view = SunView::fit(Vec3::Y, casters, &Camera::orbit(Vec3::ZERO, 0.0, 0.0, 9.0), 100.0, SIZE);
        let depth = |y: f32| view.clip_from_world.transform_point3(Vec3::new(5.0, y, 5.0)).z;
        assert!((view.depth_m * (depth(8.0) - depth(3.0)) - 5.0).abs() < 1e-3, "metres of depth are metres of height");
    }
}
