//! What a picture is to show: from where, how large, how far it is taken, in which light and wind.

use glam::Vec3;

use super::{Camera, GrowthParams, LightParams, WindParams};
use crate::gpu::layout;

crate::choices! {
    /// How far the picture is taken: She fig. 15 b to e.
    pub enum Stage {
        /// The surfaces as they are.
        Unshaped = "unshaped",
        /// With grown outlines.
        Reshaped = "reshaped",
        /// And smoothed edges.
        Antialiased = "antialiased",
        /// And light: sun, sky and shadows.
        Lit = "lit",
    }
}

crate::choices! {
    /// What stands behind the trees.
    pub enum Background {
        /// Sky above level ground.
        Sky = "sky",
        /// Nothing, black.
        Black = "black",
        /// Nothing, white.
        White = "white",
        /// Nothing at all: the picture is transparent there.
        Alpha = "alpha",
    }
}

crate::choices! {
    /// What is shown of the surfaces.
    pub enum Show {
        /// How they look.
        Picture = "picture",
        /// The edges of their triangles; as `picture` where the adapter cannot draw lines.
        Wireframe = "wireframe",
        /// Which way they face: red right, green up, blue towards +Z.
        Normals = "normals",
        /// From which distance on they are seen, as a hue: white from the nearest, then an octave of distance after the other.
        Levels = "levels",
    }
}

const _: () = assert!(Background::Sky as u32 == layout::Frame::SKY);

/// One picture to be taken.
#[derive(Debug, Clone)]
pub struct Shot {
    /// From where.
    pub camera: Camera,
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// How far it is taken.
    pub stage: Stage,
    /// What is shown of the surfaces.
    pub show: Show,
    /// What stands behind the trees.
    pub background: Background,
    /// Towards the sun, any length but zero.
    pub toward_sun: Vec3,
    /// How bright, and how far shadows fall.
    pub light: LightParams,
    /// The wind and the moment.
    pub wind: WindParams,
    /// How outlines grow.
    pub growth: GrowthParams,
    /// Draws every tree as if it were so many heights away, as [`repr::Seen`](crate::repr::Seen) has distances: one level of detail,
    /// wherever the viewer stands. `None` for the level that belongs there.
    pub level_distance: Option<f32>,
    /// Another viewer than the camera for the choice of levels.
    pub level_viewer: Option<LevelViewer>,
    /// Number of the frame: only [`GrowthKeys::Random`](super::GrowthKeys::Random) asks for it.
    pub frame: u32,
}

/// Who stands for the camera where levels of detail are chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelViewer {
    /// Where it stands, world space, metres.
    pub eye: Vec3,
    /// Everything counts as so many times as far away: more than 1 where the camera moves fast (Truelsen §9.2).
    pub farther: f32,
}

impl Shot {
    /// From where the distances are told by which levels are chosen.
    pub(crate) fn level_eye(&self) -> Vec3 {
        self.level_viewer.map_or(self.camera.eye, |viewer| viewer.eye)
    }

    /// [`Camera::heights`] of the picture; a told level is a first number with a second below 0.
    pub(crate) fn heights(&self) -> [f32; 2] {
        let farther = self.level_viewer.map_or(1.0, |viewer| viewer.farther);
        let own = || self.camera.heights(self.size_px[1]).map(|part| farther * part);
        self.level_distance.map_or_else(own, |told| [told, -1.0])
    }

    /// What surfaces show.
    pub(super) fn shading(&self) -> u32 {
        match (self.show, self.stage) {
            (Show::Normals, _) => layout::Frame::NORMALS,
            (Show::Levels, _) => layout::Frame::LEVELS,
            (_, Stage::Lit) => layout::Frame::LIT,
            _ => layout::Frame::BASE_COLOR,
        }
    }

    /// A lit picture under a sky in still air, as the parameters' defaults have it.
    pub fn new(camera: Camera, size_px: [u32; 2]) -> Self {
        Self {
            camera,
            size_px,
            stage: Stage::Lit,
            show: Show::Picture,
            background: Background::Sky,
            // From the upper right behind the viewer of the front.
            toward_sun: Vec3::new(0.454_5, std::f32::consts::FRAC_1_SQRT_2, 0.541_7),
            light: LightParams::default(),
            wind: WindParams::default(),
            growth: GrowthParams::default(),
            level_distance: None,
            level_viewer: None,
            frame: 0,
        }
    }
}
