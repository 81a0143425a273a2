//! A tree in boxes as a folder of files, coarse to fine (Lluch04 §1, §5; DESIGN §5): an index, the pictures of one box for all leaves, the
//! wood, the pictures of every further depth, and last the leaves.
//!
//! Any number of files from the first on is a tree: boxes whose finer ones have not come are seen however near. A last file that has come
//! only in part counts as not come; anything else that is not as the index says is refused.
//!
//! Colours are WebP, lossy beside alpha in eight steps, the cutoff between two of them; normals are lossy WebP; geometry is GLB.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use image::{ImageFormat, RgbaImage};
use serde::{Deserialize, Serialize};
use webp_animation::{Encoder, EncoderOptions, EncodingConfig};

use super::atlas::Atlas;
use super::crown::{BoxCard, Crown, LeafBox};
use super::planes::Arrangement;
use super::{BoxHierarchy, Representation as _};
use crate::geom::Bounds;
use crate::model::About;
use crate::model::glb::MAX_TEXTURE_PX;
use crate::repr::file::{self, Origin};
use crate::repr::{BuiltPart, BuiltTree};
use crate::{Error, Result, Warning, files};

/// Version of what we write.
const FORMAT: u32 = 1;
/// The file to begin with.
const INDEX: &str = "index.json";
/// Most bytes of a file.
const MOST_BYTES: u64 = 2 << 30;
/// Qualities of WebP, 0 to 100: more does not show at the distances at which a texel is a pixel wide.
const COLOR_QUALITY: f32 = 60.0;
const NORMAL_QUALITY: f32 = 50.0;
/// Steps of alpha: an even number, so that none lies on the cutoff.
const ALPHA_STEPS: u32 = 8;

/// What [`write_stream`] writes: names and bytes, in the order in which they are to be sent.
#[derive(Debug, Clone)]
pub struct Stream(pub Vec<(String, Vec<u8>)>);

/// What has come of a stream.
#[derive(Debug, Clone)]
pub struct Received {
    /// Its boxes, as far as they have come.
    pub crown: Crown,
    /// Around the tree, metres.
    pub bounds: Bounds,
    /// The wood, if it has come.
    pub wood: Option<BuiltTree>,
    /// Files that have come, and how many there are, with the index.
    pub files: [usize; 2],
}

/// What a file holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum Holds {
    Colors(u32),
    Normals(u32),
    Wood,
    Leaves,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Listed {
    holds: Holds,
    bytes: u64,
    /// FNV-1a, 32 bits.
    check: u32,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Index {
    stream: String,
    format: u32,
    program: String,
    origin: Origin,
    /// Smallest and largest corner of the tree, metres.
    bounds: [Vec3; 2],
    band: f32,
    arrangement: Arrangement,
    boxes: Vec<LeafBox>,
    /// The box of each part in the file of leaves.
    leaf_boxes: Vec<u32>,
    /// In the order of the stream, behind the index.
    files: Vec<Listed>,
}

impl Holds {
    fn name(self) -> String {
        match self {
            Self::Colors(depth) => format!("colors_{depth}.webp"),
            Self::Normals(depth) => format!("normals_{depth}.webp"),
            Self::Wood => "wood.glb".to_owned(),
            Self::Leaves => "leaves.glb".to_owned(),
        }
    }
}

impl Stream {
    /// Of a crown in boxes, of the tree with these bounds, and of what another method has built of its wood.
    ///
    /// # Errors
    /// [`Error::Internal`] when a picture cannot be encoded or a part breaks a promise.
    pub fn of(crown: &Crown, bounds: Bounds, wood: Option<&BuiltTree>, origin: &Origin) -> Result<Self> {
        let mut listed: Vec<(Holds, Vec<u8>)> = vec![];
        for (depth, atlas) in (0..).zip(&crown.atlases) {
            listed.push((Holds::Colors(depth), webp(&stepped(&atlas.color), COLOR_QUALITY)?));
            if let Some(normals) = &atlas.normals {
                listed.push((Holds::Normals(depth), webp(normals, NORMAL_QUALITY)?));
            }
            if let Some(wood) = wood.filter(|_| depth == 0) {
                listed.push((Holds::Wood, file::write(wood, origin)?));
            }
        }
        if !crown.leaves.is_empty() {
            let parts = crown.leaves.iter().map(|(_, part)| BuiltPart::still(part.clone())).collect();
            let leaves = BuiltTree { method: BoxHierarchy.id().to_owned(), ..BuiltTree::new(bounds, parts) };
            listed.push((Holds::Leaves, file::write(&leaves, origin)?));
        }
        let index = Index {
            stream: BoxHierarchy.id().to_owned(),
            format: FORMAT,
            program: About::this_program(),
            origin: origin.clone(),
            bounds: [bounds.min, bounds.max],
            band: crown.band,
            arrangement: crown.arrangement,
            boxes: crown.boxes.clone(),
            leaf_boxes: crown.leaves.iter().map(|(number, _)| *number).collect(),
            files: listed
                .iter()
                .map(|(holds, bytes)| Listed { holds: *holds, bytes: bytes.len() as u64, check: check(bytes) })
                .collect(),
        };
        let index =
            serde_json::to_vec(&index).map_err(|e| Error::Internal { stage: "repr::box_hierarchy", what: e.to_string() })?;
        let rest = listed.into_iter().map(|(holds, bytes)| (holds.name(), bytes));
        Ok(Self([(INDEX.to_owned(), index)].into_iter().chain(rest).collect()))
    }

    /// Bytes of the colour pictures together.
    pub fn color_bytes(&self) -> usize {
        self.0.iter().filter(|(name, _)| name.starts_with("colors")).map(|(_, bytes)| bytes.len()).sum()
    }

    /// What has come, given its files by name: `None` for one that has not.
    ///
    /// # Errors
    /// [`Error::BrokenBoxStream`] for files that are not as the index says, and when nothing to draw has come.
    pub fn received(file: impl Fn(&str) -> Result<Option<Vec<u8>>>) -> Result<Received> {
        let wrong = |what: &str| broken(INDEX, what);
        let bytes = file(INDEX)?.ok_or_else(|| wrong("is missing"))?;
        let index: Index = serde_json::from_slice(&bytes).map_err(|e| wrong(&format!("cannot be read ({e})")))?;
        if index.stream != BoxHierarchy.id() || index.format != FORMAT {
            return Err(wrong("is of another kind or version"));
        }
        let [min, max] = index.bounds;
        let bounds = Bounds { min, max };
        let height_m = BuiltTree::new(bounds, vec![]).height_m();
        check_boxes(&index).map_err(|what| wrong(&what))?;
        let Index { band, arrangement, boxes, leaf_boxes, files, .. } = index;
        let crown = Crown { height_m, band, arrangement, boxes, atlases: vec![], leaves: vec![] };
        let mut received = Received { crown, bounds, wood: None, files: [1, files.len() + 1] };
        for listed in files {
            let name = listed.holds.name();
            let Some(bytes) = file(&name)?.filter(|bytes| bytes.len() as u64 >= listed.bytes) else { break };
            if bytes.len() as u64 > listed.bytes || check(&bytes) != listed.check {
                return Err(broken(&name, "is damaged or of another stream"));
            }
            received.take(listed.holds, &bytes, &leaf_boxes).map_err(|what| broken(&name, &what))?;
            received.files[0] += 1;
        }
        received.built()?.check().map_err(|what| wrong(&format!("makes no tree: {what}")))?;
        Ok(received)
    }
}

impl Received {
    fn take(&mut self, holds: Holds, bytes: &[u8], leaf_boxes: &[u32]) -> std::result::Result<(), String> {
        let built = |bytes| file::read(bytes).ok_or("is no tree of ours")?.map(|(built, _)| built).map_err(|e| e.to_string());
        match holds {
            Holds::Colors(depth) if depth as usize == self.crown.atlases.len() => {
                self.crown.atlases.push(Atlas { color: Arc::new(picture(bytes)?), normals: None });
            }
            Holds::Normals(depth) => {
                let atlas = self.crown.atlases.get_mut(depth as usize).ok_or("comes before its colours")?;
                let normals = picture(bytes)?;
                if normals.dimensions() != atlas.color.dimensions() {
                    return Err("is of another size than its colours".to_owned());
                }
                atlas.normals = Some(Arc::new(normals));
            }
            Holds::Colors(_) => return Err("comes in the wrong order".to_owned()),
            Holds::Wood => self.wood = Some(built(bytes)?),
            Holds::Leaves => {
                let parts = built(bytes)?.parts;
                if parts.len() != leaf_boxes.len() {
                    return Err(format!("holds {} parts instead of {}", parts.len(), leaf_boxes.len()));
                }
                self.crown.leaves = leaf_boxes.iter().copied().zip(parts.into_iter().map(|built| built.part)).collect();
            }
        }
        Ok(())
    }

    /// The tree, as far as it has come.
    ///
    /// # Errors
    /// [`Error::BrokenBoxStream`] when nothing to draw has come.
    pub fn built(&self) -> Result<BuiltTree> {
        if self.crown.atlases.is_empty() {
            return Err(broken(&Holds::Colors(0).name(), "is missing"));
        }
        let crown = &self.crown;
        let foliage = BuiltTree {
            method: BoxHierarchy.id().to_owned(),
            levels: crown.levels(),
            ..BuiltTree::new(self.bounds, crown.parts())
        };
        let mut tree = match &self.wood {
            Some(wood) => foliage.joined(wood.clone()),
            None => foliage,
        };
        let [come, all] = self.files;
        if come < all {
            let message = format!("{come} of {all} files of the stream have come; the tree is coarser than it might be");
            tree.warnings.push(Warning::new("cut-stream", message));
        }
        Ok(tree)
    }
}

/// Writes a stream into a folder, which is made if need be; what it held of another stream no longer counts.
///
/// # Errors
/// [`Error::Write`] and those of [`files::ready_folder`].
pub fn write_stream(folder: &Path, stream: &Stream) -> Result<()> {
    let _folder = files::ready_folder(folder)?;
    let named: Vec<_> = stream.0.iter().map(|(name, bytes)| (folder.join(name), bytes.clone())).collect();
    files::write_all(&named)
}

/// Reads what has come of a stream into a folder.
///
/// # Errors
/// [`Error::BrokenBoxStream`], and those of [`files::read_whole`] but for files that are not there.
pub fn read_stream(folder: &Path) -> Result<Received> {
    Stream::received(|name| match files::read_whole(&folder.join(name), MOST_BYTES) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(Error::NoSuchFile { .. }) => Ok(None),
        Err(error) => Err(error),
    })
}

fn broken(file: &str, what: &str) -> Error {
    Error::BrokenBoxStream { file: file.to_owned(), what: what.to_owned() }
}

/// What drawing relies on.
fn check_boxes(index: &Index) -> std::result::Result<(), String> {
    let sound = |card: &BoxCard| {
        let on_it = card.uvs.iter().all(|uv| uv.cmpge(glam::Vec2::ZERO).all() && uv.cmple(glam::Vec2::ONE).all());
        on_it && card.corners.iter().all(|at| at.is_finite())
    };
    let fits = |number: usize, own: &LeafBox| match own.parent {
        None => number == 0 && own.depth == 0,
        Some(parent) => {
            let parent = index.boxes[..number].get(parent as usize);
            parent.is_some_and(|p| p.divided && p.depth + 1 == own.depth && p.distance >= own.distance)
        }
    };
    for (number, own) in index.boxes.iter().enumerate() {
        let [low, high] = own.corners;
        let finite = low.is_finite() && high.is_finite() && own.distance.is_finite() && own.distance >= 0.0;
        if !finite || !low.cmple(high).all() || !own.cards.iter().all(sound) || !fits(number, own) {
            return Err(format!("holds the impossible box {number}"));
        }
    }
    let [low, high] = index.bounds;
    if index.boxes.is_empty() || !(low.is_finite() && high.is_finite()) || !(0.0..1.0).contains(&index.band) {
        return Err("holds no boxes, or an impossible tree".to_owned());
    }
    if index.leaf_boxes.iter().any(|number| *number as usize >= index.boxes.len()) {
        return Err("puts leaves into boxes that are not there".to_owned());
    }
    Ok(())
}

/// Alpha in few steps, half of them above the cutoff: what is there stays there.
fn stepped(picture: &RgbaImage) -> RgbaImage {
    let mut picture = picture.clone();
    picture.pixels_mut().for_each(|p| p.0[3] = (u32::from(p.0[3]) * ALPHA_STEPS / 256 * 255 / (ALPHA_STEPS - 1)) as u8);
    picture
}

fn webp(picture: &RgbaImage, quality: f32) -> Result<Vec<u8>> {
    let failed = |e: webp_animation::Error| Error::Internal { stage: "writing a WebP", what: format!("{e:?}") };
    let options = EncoderOptions { encoding_config: Some(EncodingConfig::new_lossy(quality)), ..EncoderOptions::default() };
    let mut encoder = Encoder::new_with_options(picture.dimensions(), options).map_err(failed)?;
    encoder.add_frame(picture.as_raw(), 0).map_err(failed)?;
    Ok(encoder.finalize(1).map_err(failed)?.to_vec())
}

fn picture(bytes: &[u8]) -> std::result::Result<RgbaImage, String> {
    let size = imagesize::blob_size(bytes).map_err(|e| format!("is no picture ({e})"))?;
    if size.width.max(size.height) > MAX_TEXTURE_PX as usize {
        return Err(format!("has {}×{} pixels, which is too many", size.width, size.height));
    }
    let decoded = image::load_from_memory_with_format(bytes, ImageFormat::WebP).map_err(|e| format!("cannot be decoded ({e})"))?;
    Ok(decoded.into_rgba8())
}

fn check(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0x811c_9dc5, |sum, byte| (sum ^ u32::from(*byte)).wrapping_mul(0x0100_0193))
}
