//! Materials and textures (glTF 2.0, 3.8–3.9): the base colour, what is cut out, and how the texture lies on the surface.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Affine2, Mat2, Vec2};
use image::RgbaImage;
use rayon::prelude::*;

use super::schema::{Document, Material as Source, TextureUse};
use super::{Bytes, named};
use crate::model::import::Warnings;
use crate::model::import::folder::{Folder, shortened};
use crate::model::import::picture::{self, PixelBudget};
use crate::model::{Material, Wrap};
use crate::raster::ALPHA_CUTOFF;

/// The cut-off of `MASK` without one (specification, 3.9.4).
const DEFAULT_CUTOFF: f32 = 0.5;

const CLAMP_TO_EDGE: u64 = 33_071;
const MIRRORED_REPEAT: u64 = 33_648;

/// The bytes of an image, or why they cannot be had.
type Fetched<'b> = Result<Cow<'b, [u8]>, String>;

/// A texture, mirrored across and down or not.
type Unfolded = (usize, bool, bool);

/// A texture and what its alpha channel says.
struct Picture {
    image: Arc<RgbaImage>,
    /// No texel is transparent at all.
    solid: bool,
    /// A share of it that nobody would overlook is transparent.
    cut_out: bool,
}

/// The materials of a file, with their pictures decoded.
pub struct Materials<'a> {
    document: &'a Document,
    pictures: BTreeMap<usize, Picture>,
    unfolded: BTreeMap<Unfolded, Arc<RgbaImage>>,
    nothing: Source,
}

impl<'a> Materials<'a> {
    /// Decodes the pictures that base colours use.
    pub fn read(document: &'a Document, bytes: &Bytes, folder: &Folder, warnings: &mut Warnings) -> Self {
        let uses = document.materials.iter().filter_map(texture_use);
        let mut used: Vec<usize> = uses.filter_map(|used| image_of(document, used.index)).collect();
        used.sort_unstable();
        used.dedup();
        let mut budget = PixelBudget::default();
        let encoded: Vec<(usize, Fetched)> = used
            .into_iter()
            .map(|image| {
                let bytes = encoded(document, bytes, folder, image);
                (image, bytes.and_then(|bytes| budget.admit(&bytes).map(|()| bytes)))
            })
            .collect();
        let open = |bytes: Cow<[u8]>| {
            let image = picture::decode(&bytes)?;
            let (solid, cut_out) = (image.pixels().all(|p| p[3] == 255), picture::has_cut_outs(&image));
            Ok(Picture { image: Arc::new(image), solid, cut_out })
        };
        let decoded: Vec<(usize, Result<Picture, String>)> =
            encoded.into_par_iter().map(|(image, bytes)| (image, bytes.and_then(open))).collect();
        let mut pictures = BTreeMap::new();
        for (image, decoded) in decoded {
            match decoded {
                Ok(picture) => drop(pictures.insert(image, picture)),
                Err(why) => {
                    let name = document.images.get(image).map_or_else(String::new, |image| shortened(&image.name));
                    warnings.missing_texture(&named(&name, "texture", image), &why);
                }
            }
        }
        Self { document, pictures, unfolded: BTreeMap::new(), nothing: Source::default() }
    }

    /// Which texture coordinates the material wants, and what is done to them.
    pub fn placement(&self, material: Option<usize>) -> Option<(u32, Affine2)> {
        let used = texture_use(self.source(material))?;
        self.pictures.get(&image_of(self.document, used.index)?)?;
        let Some(transform) = &used.extensions.transform else { return Some((used.tex_coord, Affine2::IDENTITY)) };
        // KHR_texture_transform: translation · rotation · scale, the rotation counter-clockwise where v points down.
        let (sin, cos) = transform.rotation.sin_cos();
        let turn = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
        let scale = Mat2::from_diagonal(transform.scale.unwrap_or([1.0, 1.0]).into());
        let set = transform.tex_coord.unwrap_or(used.tex_coord);
        Some((set, Affine2::from_mat2_translation(turn * scale, transform.offset.into())))
    }

    /// The material for a surface with these texture coordinates (none: without texture). They change when the texture is mirrored.
    pub fn dressed(&mut self, material: Option<usize>, uvs: &mut [Vec2], warnings: &mut Warnings) -> Material {
        let source = self.source(material);
        let looks = &source.pbr_metallic_roughness;
        let older = source.extensions.specular_glossiness.as_ref();
        let factor = older.map_or(looks.base_color_factor, |older| older.diffuse_factor).unwrap_or([1.0; 4]);
        let name = material.map_or_else(String::new, |number| named(&shortened(&source.name), "material", number));
        let (cutoff, mode, two_sided) = (source.alpha_cutoff, source.alpha_mode.clone(), source.double_sided);
        let used = if uvs.is_empty() { None } else { texture_use(source).map(|used| used.index) };
        let picture = used.and_then(|texture| self.pictures.get(&image_of(self.document, texture)?));
        let (solid, cut_out) = picture.map_or((true, false), |picture| (picture.solid, picture.cut_out));
        let (texture, wrap) = used.and_then(|texture| self.texture(texture, uvs)).unzip();
        let mut dressed = Material {
            name,
            factor,
            texture,
            normal_texture: None,
            wrap: wrap.unwrap_or(Wrap::Repeat),
            alpha_cutoff: None,
            two_sided,
        };
        match mode.as_deref() {
            Some("MASK") => dressed.alpha_cutoff = Some(cutoff.filter(|c| c.is_finite()).unwrap_or(DEFAULT_CUTOFF)),
            // What blends with nothing is opaque: some exporters say BLEND of everything.
            Some("BLEND") if !solid || factor[3] < 1.0 => blend(&mut dressed, warnings),
            _ => {
                dressed.factor[3] = 1.0;
                if cut_out {
                    let message = format!(
                        "the material {} is opaque (alphaMode), though its texture has gaps; the gaps are drawn",
                        dressed.name
                    );
                    warnings.add("alpha-unused", message);
                }
            }
        }
        dressed
    }

    /// The picture of a texture, and how it goes on outside 0..1 where the surface has such coordinates.
    fn texture(&mut self, texture: usize, uvs: &mut [Vec2]) -> Option<(Arc<RgbaImage>, Wrap)> {
        let image = image_of(self.document, texture)?;
        let picture = self.pictures.get(&image)?.image.clone();
        let sampler = self.document.textures.get(texture)?.sampler.and_then(|sampler| self.document.samplers.get(sampler));
        let modes = sampler.map_or([None; 2], |sampler| [sampler.wrap_s, sampler.wrap_t]);
        let beyond = |axis: usize| uvs.iter().any(|uv| !(-1e-4..=1.0001).contains(&uv[axis]));
        // Within 0..1 the mode matters to the texels of the rim only.
        let leaves = [beyond(0), beyond(1)];
        let fits = |px: u32| 2 * px <= crate::model::glb::MAX_TEXTURE_PX;
        let mirrors = [picture.width(), picture.height()].map(fits);
        let [across, down] = [0, 1].map(|axis| leaves[axis] && modes[axis] == Some(MIRRORED_REPEAT) && mirrors[axis]);
        let clamps = |axis: usize| modes[axis] == Some(CLAMP_TO_EDGE);
        let repeats = (0..2).any(|axis| leaves[axis] && !clamps(axis));
        let wrap = if !repeats && (clamps(0) || clamps(1)) { Wrap::Clamp } else { Wrap::Repeat };
        if !across && !down {
            return Some((picture, wrap));
        }
        let halved = Vec2::new(if across { 0.5 } else { 1.0 }, if down { 0.5 } else { 1.0 });
        uvs.iter_mut().for_each(|uv| *uv *= halved);
        let unfolded = self.unfolded.entry((image, across, down));
        Some((unfolded.or_insert_with(|| Arc::new(picture::unfolded(&picture, across, down))).clone(), Wrap::Repeat))
    }

    fn source(&self, material: Option<usize>) -> &Source {
        material.and_then(|number| self.document.materials.get(number)).unwrap_or(&self.nothing)
    }
}

/// `BLEND` asks for sorting, which trees do without: it is cut out instead.
fn blend(material: &mut Material, warnings: &mut Warnings) {
    material.alpha_cutoff = Some(ALPHA_CUTOFF * material.factor[3].clamp(0.01, 1.0));
    warnings.add(
        "blend-as-mask",
        format!("the material {} is blended (alphaMode BLEND); it is drawn cut out where less than half opaque", material.name),
    );
}

fn texture_use(material: &Source) -> Option<&TextureUse> {
    let older = material.extensions.specular_glossiness.as_ref();
    older.map_or(&material.pbr_metallic_roughness.base_color_texture, |older| &older.diffuse_texture).as_ref()
}

/// The image of a texture: its WebP form when it has one. Of images with the same bytes, the first.
fn image_of(document: &Document, texture: usize) -> Option<usize> {
    let texture = document.textures.get(texture)?;
    let image = texture.extensions.webp.as_ref().map(|webp| webp.source).or(texture.source)?;
    Some(document.first_alike.get(image).copied().unwrap_or(image))
}

/// The bytes of an image, from its buffer view, its `data:` URI or its file.
fn encoded<'b>(document: &Document, bytes: &'b Bytes, folder: &Folder, image: usize) -> Fetched<'b> {
    let about = document.images.get(image).ok_or_else(|| "is not in the file".to_owned())?;
    match (&about.uri, about.buffer_view) {
        (_, Some(view)) => {
            bytes.view(document, view).map(|(bytes, _)| Cow::Borrowed(bytes)).map_err(|e| format!("cannot be had ({e})"))
        }
        (Some(uri), None) => folder.uri(uri).map(Cow::Owned),
        (None, None) => Err("has no bytes".to_owned()),
    }
}
