//! Materials and textures (glTF 2.0, 3.8–3.9): the base colour, what is cut out, the normals of small things, and how the textures lie
//! on the surface.

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
    /// Normal textures whose slopes count more or less, by the address of the picture, which lives as long, and the bits of how much.
    scaled: BTreeMap<(usize, u32), Arc<RgbaImage>>,
    nothing: Source,
}

impl<'a> Materials<'a> {
    /// Decodes the pictures that base colours and normals use.
    pub fn read(document: &'a Document, bytes: &Bytes, folder: &Folder, warnings: &mut Warnings) -> Self {
        let images =
            |uses: Vec<&TextureUse>| uses.into_iter().filter_map(|used| image_of(document, used.index)).collect::<Vec<_>>();
        let colors = images(document.materials.iter().filter_map(texture_use).collect());
        let mut used = images(document.materials.iter().filter_map(|material| material.normal_texture.as_ref()).collect());
        used.extend(&colors);
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
                    let name = named(&name, "texture", image);
                    if colors.contains(&image) {
                        warnings.missing_texture(&name, &why);
                    } else {
                        warnings
                            .add("missing-texture", format!("the normal texture {name} {why}; its surfaces are drawn without it"));
                    }
                }
            }
        }
        Self { document, pictures, unfolded: BTreeMap::new(), scaled: BTreeMap::new(), nothing: Source::default() }
    }

    /// Which texture coordinates the material wants, and what is done to them.
    pub fn placement(&self, material: Option<usize>) -> Option<(u32, Affine2)> {
        let used = self.lying(self.source(material))?;
        let Some(transform) = &used.extensions.transform else { return Some((used.tex_coord, Affine2::IDENTITY)) };
        // KHR_texture_transform: translation · rotation · scale, the rotation counter-clockwise where v points down.
        let (sin, cos) = transform.rotation.sin_cos();
        let turn = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
        let scale = Mat2::from_diagonal(transform.scale.unwrap_or([1.0, 1.0]).into());
        let set = transform.tex_coord.unwrap_or(used.tex_coord);
        Some((set, Affine2::from_mat2_translation(turn * scale, transform.offset.into())))
    }

    /// The texture that says how all lie on the surface: the base colour's, else the normals', whichever can be had.
    fn lying<'m>(&self, material: &'m Source) -> Option<&'m TextureUse> {
        let uses = [texture_use(material), material.normal_texture.as_ref()];
        uses.into_iter()
            .flatten()
            .find(|used| image_of(self.document, used.index).is_some_and(|image| self.pictures.contains_key(&image)))
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
        let lies = if uvs.is_empty() { None } else { self.lying(source).cloned() };
        let normals = source.normal_texture.clone();
        let picture = used.and_then(|texture| self.pictures.get(&image_of(self.document, texture)?));
        let (solid, cut_out) = picture.map_or((true, false), |picture| (picture.solid, picture.cut_out));
        // Of both, the mirroring of the one that lies there first: they share their coordinates.
        let folds = lies.as_ref().map_or([false; 2], |lies| self.folds(lies.index, uvs));
        let wrap = lies.as_ref().map(|lies| self.wrap(lies.index, folds, uvs));
        let texture = used.and_then(|texture| self.picture(texture, folds));
        let normal_texture = normals.zip(lies).and_then(|(normals, lies)| self.normals(&normals, &lies, folds, &name, warnings));
        uvs.iter_mut().for_each(|uv| *uv *= Vec2::from(folds.map(|folded| if folded { 0.5 } else { 1.0 })));
        let mut dressed =
            Material { name, factor, texture, normal_texture, wrap: wrap.unwrap_or(Wrap::Repeat), alpha_cutoff: None, two_sided };
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

    /// Along which axes a texture is mirrored where the surface goes beyond 0..1.
    fn folds(&self, texture: usize, uvs: &[Vec2]) -> [bool; 2] {
        let picture = image_of(self.document, texture).and_then(|image| self.pictures.get(&image));
        let Some(picture) = picture else { return [false; 2] };
        let fits = |px: u32| 2 * px <= crate::model::glb::MAX_TEXTURE_PX;
        let mirrors = [picture.image.width(), picture.image.height()].map(fits);
        let modes = self.modes(texture);
        [0, 1].map(|axis| beyond(uvs, axis) && modes[axis] == Some(MIRRORED_REPEAT) && mirrors[axis])
    }

    /// How a texture goes on outside 0..1. Within, the mode matters to the texels of the rim only.
    fn wrap(&self, texture: usize, folds: [bool; 2], uvs: &[Vec2]) -> Wrap {
        let modes = self.modes(texture);
        let clamps = |axis: usize| modes[axis] == Some(CLAMP_TO_EDGE);
        let repeats = (0..2).any(|axis| beyond(uvs, axis) && !clamps(axis));
        let folded = folds[0] || folds[1];
        if !folded && !repeats && (clamps(0) || clamps(1)) { Wrap::Clamp } else { Wrap::Repeat }
    }

    fn modes(&self, texture: usize) -> [Option<u64>; 2] {
        let sampler = self.document.textures.get(texture).and_then(|texture| self.document.samplers.get(texture.sampler?));
        sampler.map_or([None; 2], |sampler| [sampler.wrap_s, sampler.wrap_t])
    }

    /// The picture of a texture, with its mirror images where it is folded.
    fn picture(&mut self, texture: usize, [across, down]: [bool; 2]) -> Option<Arc<RgbaImage>> {
        let image = image_of(self.document, texture)?;
        let picture = self.pictures.get(&image)?.image.clone();
        if !across && !down {
            return Some(picture);
        }
        let unfolded = self.unfolded.entry((image, across, down));
        Some(unfolded.or_insert_with(|| Arc::new(picture::unfolded(&picture, across, down))).clone())
    }

    /// The normal texture, where it lies as `lies` does.
    fn normals(
        &mut self,
        used: &TextureUse,
        lies: &TextureUse,
        folds: [bool; 2],
        name: &str,
        warnings: &mut Warnings,
    ) -> Option<Arc<RgbaImage>> {
        let picture = self.picture(used.index, folds)?;
        let lie = |used: &TextureUse| (used.tex_coord, used.extensions.transform.clone().unwrap_or_default());
        if lie(used) != lie(lies) {
            let message = format!("the normal texture of the material {name} lies otherwise than its colours; it is left out");
            warnings.add("normals-elsewhere", message);
            return None;
        }
        let scale = used.scale.filter(|scale| scale.is_finite()).unwrap_or(1.0);
        if scale == 1.0 {
            return Some(picture);
        }
        let key = (Arc::as_ptr(&picture) as usize, scale.to_bits());
        Some(self.scaled.entry(key).or_insert_with(|| Arc::new(picture::steeper(&picture, scale))).clone())
    }

    fn source(&self, material: Option<usize>) -> &Source {
        material.and_then(|number| self.document.materials.get(number)).unwrap_or(&self.nothing)
    }
}

/// Whether the surface has coordinates outside 0..1.
fn beyond(uvs: &[Vec2], axis: usize) -> bool {
    uvs.iter().any(|uv| !(-1e-4..=1.0001).contains(&uv[axis]))
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
