//! A grown tree: the surfaces of a skeleton, with its bark and leaf pictures on them, metres (issue "Reference trees").

use std::path::Path;
use std::sync::Arc;

use image::RgbaImage;
use serde::{Deserialize, Serialize};

use super::import::picture::{self, PixelBudget};
use super::{About, Material, Part, Wrap, bounds};
use crate::plant::mesh::{BarkKind, LeafKind, LeafParams, Sheet, WoodParams, bark, blades, foliage, leaves, wood};
use crate::plant::presets::Preset;
use crate::plant::{DeriveParams, Skeleton, draw};
use crate::raster::{ALPHA_CUTOFF, to_linear};
use crate::{Error, Result, Seed, files};

/// Colour of blades drawn by outline, sRGB.
const BLADE: [u8; 3] = [88, 124, 52];

/// Most bytes of a picture file.
const MOST_PICTURE_BYTES: u64 = 256 << 20;

/// The pictures that a grown tree wears.
#[derive(Debug, Clone)]
pub struct Clothing {
    /// Opaque, and it tiles.
    pub bark: Arc<RgbaImage>,
    /// Leaves or twigs with alpha, their foot in the middle of the lower edge.
    pub leaf: Arc<RgbaImage>,
    /// How the leaf picture is divided.
    pub sheet: Sheet,
}

crate::params! {
    /// What a tree wears for which nobody gives pictures.
    pub struct ClothingParams {
        /// What one leaf quad shows; a preset has its own.
        leaf_kind: LeafKind = LeafKind::Oval, unit "", source "ours: pointed ovals are the commonest leaves";
        /// What the bark looks like; a preset has its own.
        bark_kind: BarkKind = BarkKind::Furrowed, unit "", source "ours: most old trees have furrows";
    }
}

/// Reads a picture for bark or leaves from a file: PNG, JPEG or WebP, sRGB with straight alpha.
///
/// # Errors
/// Those of [`files::read_whole`], and [`Error::Picture`] for a file that is no picture or too large.
pub fn open_picture(path: &Path) -> Result<RgbaImage> {
    let bytes = files::read_whole(path, MOST_PICTURE_BYTES)?;
    let decoded = PixelBudget::default().admit(&bytes).and_then(|()| picture::decode(&bytes));
    decoded.map_err(|what| Error::Picture { path: path.to_owned(), what })
}

impl Clothing {
    /// Pictures of our own making.
    pub fn painted(bark_kind: BarkKind, leaf_kind: LeafKind, seed: Seed) -> Self {
        let (bark, leaf) = rayon::join(|| bark::picture(bark_kind, seed), || foliage::picture(leaf_kind, seed));
        Self { bark: Arc::new(bark), leaf: Arc::new(leaf), sheet: foliage::SHEET }
    }
}

/// A grown tree as a renderer or a file takes it.
#[derive(Debug, Clone)]
pub struct GrownTree {
    /// `wood`, then `leaves`, then `blades` (what the L-system draws by outline); any may be missing, not all.
    pub parts: Vec<Part>,
    /// The bone that each leaf was, by number: leaf `i` is quad `i` of the part `leaves`.
    pub leaf_bones: Vec<u32>,
}

/// A preset, grown up, in its own clothing; everything by default.
///
/// # Errors
/// [`Error::Internal`], which the tests rule out.
pub fn grow_preset(preset: &Preset, seed: Seed) -> Result<GrownTree> {
    dress_preset(preset, &preset_skeleton(preset, None, seed)?, seed)
}

/// The bones of a preset at an age in its own units, or grown up.
///
/// # Errors
/// Those of [`Grammar::derive`](crate::plant::grammar::Grammar::derive) for an age that it does not take.
pub fn preset_skeleton(preset: &Preset, age: Option<f64>, seed: Seed) -> Result<Skeleton> {
    let grammar = preset.grammar()?;
    let age = age.or(grammar.initial_age()).unwrap_or_default();
    let chain = grammar.derive(age, &DeriveParams::default(), seed, &mut |_| {})?;
    draw(&chain, &grammar, grammar.turtle(), seed, age)
}

/// Bones in a preset's clothing.
///
/// # Errors
/// As [`GrownTree::new`].
pub fn dress_preset(preset: &Preset, skeleton: &Skeleton, seed: Seed) -> Result<GrownTree> {
    let clothing = Clothing::painted(preset.bark, preset.leaf, seed);
    GrownTree::new(skeleton, &clothing, &WoodParams::default(), &LeafParams::default(), seed)
}

/// What rides in a grown tree's `extras.sphereboard` beside the geometry.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GrownAbout {
    /// Version of these extras: [`About::FORMAT`].
    pub format: u32,
    /// Always `grown`: tells this file from a model of a photograph.
    pub kind: String,
    /// Name and version of the program that grew it.
    pub program: String,
    /// Preset, or file name of the L-system without its folder.
    pub system: String,
    /// Age it was grown to.
    pub age: f64,
    /// Seed of every random number.
    pub seed: u64,
    /// Leaf quads.
    pub leaves: usize,
    /// Height of its bounding box.
    pub height_m: f64,
    /// Every effective parameter by name.
    pub parameters: serde_json::Map<String, serde_json::Value>,
}

impl GrownTree {
    /// The surfaces of a skeleton in that clothing.
    ///
    /// # Errors
    /// [`Error::NothingGrew`] when the skeleton has neither wood nor leaves.
    pub fn new(
        skeleton: &Skeleton,
        clothing: &Clothing,
        wood_params: &WoodParams,
        leaf_params: &LeafParams,
        seed: Seed,
    ) -> Result<Self> {
        let (trunk, crown) =
            rayon::join(|| wood::wood(skeleton, wood_params, seed), || leaves::leaves(skeleton, clothing.sheet, leaf_params, seed));
        let bark =
            Material { name: "bark".to_owned(), texture: Some(clothing.bark.clone()), wrap: Wrap::Repeat, ..Material::default() };
        let leaf = Material {
            name: "leaf".to_owned(),
            texture: Some(clothing.leaf.clone()),
            wrap: Wrap::Clamp,
            alpha_cutoff: Some(ALPHA_CUTOFF),
            two_sided: true,
            ..Material::default()
        };
        let part = |name: &str, surface, material| Part { name: name.to_owned(), surface, material, crown_center: None };
        let [r, g, b] = BLADE.map(to_linear);
        let blade = Material { name: "blade".to_owned(), factor: [r, g, b, 1.0], two_sided: true, ..Material::default() };
        let outlined = blades::blades(skeleton);
        let mut parts = vec![part("wood", trunk, bark), part("leaves", crown.surface, leaf), part("blades", outlined, blade)];
        parts.retain(|part| part.surface.mesh.polygon_count() > 0);
        if parts.is_empty() {
            return Err(Error::NothingGrew);
        }
        Ok(Self { parts, leaf_bones: crown.bones })
    }

    /// Height of the box around it, metres.
    pub fn height_m(&self) -> f64 {
        bounds(&self.parts).map_or(0.0, |b| f64::from(b.size().y))
    }

    /// What the file says of the tree.
    pub fn about(&self, system: &str, age: f64, seed: Seed, parameters: serde_json::Map<String, serde_json::Value>) -> GrownAbout {
        GrownAbout {
            format: About::FORMAT,
            kind: "grown".to_owned(),
            program: About::this_program(),
            system: system.to_owned(),
            age,
            seed: seed.0,
            leaves: self.leaf_bones.len(),
            height_m: self.height_m(),
            parameters,
        }
    }
}
