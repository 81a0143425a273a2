//! The painter: back to front, sky, hedge, lawn, then the tree, leaf by leaf.
//!
//! Everything is drawn in a design of 600×800 units, y down; the canvas scales it to its height and centres it.

mod canvas;
mod foliage;
mod scene;
mod wood;

use image::{GrayImage, RgbImage};
use imageproc::region_labelling::{Connectivity, connected_components};
use sphereboard::Seed;
use sphereboard::raster::Mask;

use canvas::Canvas;

/// Towards the light, which comes from the upper left and a little from behind the painter; y is down, z towards him.
const LIGHT: glam::DVec3 = glam::DVec3::new(-0.58, -0.62, 0.53);

/// What is painted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Species {
    /// A broad crown of leaf clumps on a short trunk.
    Oak,
    /// A cone of drooping branches almost down to the ground.
    Spruce,
}

impl Species {
    /// The word in the file's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Oak => "oak",
            Self::Spruce => "spruce",
        }
    }
}

/// A picture and the truth about it.
pub struct Painting {
    /// sRGB pixels.
    pub image: RgbImage,
    /// The crown: the largest patch of leaves, holes filled.
    pub crown: Mask,
    /// Where the sky shows through: a subset of `crown`.
    pub gaps: Mask,
}

/// Paints one tree.
pub fn paint(species: Species, seed: Seed, width: u32, height: u32) -> Painting {
    let mut canvas = Canvas::new(width, height);
    scene::sky(&mut canvas, seed);
    scene::hedge(&mut canvas, seed);
    scene::lawn(&mut canvas, seed);
    let leaves = match species {
        Species::Oak => foliage::oak(seed),
        Species::Spruce => foliage::spruce(seed),
    };
    scene::cast_shadow(&mut canvas, seed, species);
    // Some of the leaves are behind the limbs.
    let behind = leaves.len() * 3 / 10;
    leaves[..behind].iter().for_each(|leaf| canvas.leaf(leaf));
    wood::paint(&mut canvas, seed, species);
    leaves[behind..].iter().for_each(|leaf| canvas.leaf(leaf));
    scene::grass_at_the_foot(&mut canvas, seed, species);
    let (crown, gaps) = crown_and_gaps(&canvas.leaf_mask(), &canvas.solid_mask());
    Painting { image: canvas.develop(seed), crown, gaps }
}

/// The largest component of the leaves with its holes filled, and the holes where nothing `solid` is.
fn crown_and_gaps(leaves: &Mask, solid: &Mask) -> (Mask, Mask) {
    let largest = |labels: &image::ImageBuffer<image::Luma<u32>, Vec<u32>>| {
        let mut sizes = vec![0usize; labels.iter().max().map_or(0, |&m| m as usize) + 1];
        labels.iter().filter(|&&l| l != 0).for_each(|&l| sizes[l as usize] += 1);
        (0..sizes.len()).max_by_key(|&l| (sizes[l], std::cmp::Reverse(l))).unwrap_or(0) as u32
    };
    let black = image::Luma([0u8]);
    let patches = connected_components(&leaves.to_gray(), Connectivity::Eight, black);
    let crown = largest(&patches);
    // Surround the picture with one pixel of "outside", so that all of the outside is one component, number that of its corner.
    let outside = GrayImage::from_fn(leaves.width() + 2, leaves.height() + 2, |x, y| {
        let inside = x.checked_sub(1).zip(y.checked_sub(1)).and_then(|(x, y)| patches.get_pixel_checked(x, y));
        image::Luma([if inside.is_some_and(|l| l[0] == crown && crown != 0) { 0 } else { 255 }])
    });
    let outside = connected_components(&outside, Connectivity::Four, black);
    let beyond = outside.get_pixel(0, 0)[0];
    let filled = Mask::from_fn(leaves.width(), leaves.height(), |x, y| outside.get_pixel(x + 1, y + 1)[0] != beyond);
    let gaps = filled.zip(solid, |crown, solid| crown && !solid);
    (filled, gaps)
}
