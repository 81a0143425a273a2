//! From the bytes of a GLB file back to a [`TreeModel`]. Nothing in the file is believed before it is checked.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use gltf::binary::Glb;
use gltf::json;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::material::AlphaMode;
use gltf::json::mesh::Semantic;
use gltf::json::texture::WrappingMode;
use gltf::json::validation::Checked::Valid;
use gltf::json::{Accessor, Index, Node, Root};
use image::codecs::png::PngDecoder;
use image::{DynamicImage, ImageDecoder, Limits, RgbaImage};
use serde::de::DeserializeOwned;

use super::{Extras, MAX_TEXTURE_PX, MeshExtras, Part};
use crate::geom::{PolyMesh, Surface};
use crate::model::import::picture::PixelBudget;
use crate::model::{self, About, ModelCrown, TreeModel, Trunk, Wrap};
use crate::raster::to_srgb;
use crate::{Error, Result};

/// Reads a model that [`write`](super::write()) wrote.
///
/// # Errors
/// [`Error::BrokenGlb`] for bytes that are no sound GLB file, [`Error::ForeignGlb`] for a sound one without our extras or that
/// another program has rearranged, [`Error::GlbVersion`] for one of another version of ours.
pub fn read(bytes: &[u8]) -> Result<TreeModel> {
    let file = Reader::open(bytes)?;
    let about = about(&file.root.extras)?;
    let mut model = TreeModel { crowns: Vec::new(), trunk: None, about };
    for &child in file.tree()?.children.as_deref().unwrap_or_default() {
        file.part(child, &mut model)?;
    }
    model.check().map_err(broken)?;
    Ok(model)
}

/// What the file says of the model.
fn about(extras: &json::Extras) -> Result<About> {
    #[derive(serde::Deserialize)]
    struct Version {
        format: u32,
    }
    let Version { format } = ours(extras)?;
    if format == About::FORMAT { ours(extras) } else { Err(Error::GlbVersion { found: format, known: About::FORMAT }) }
}

/// An open file: the JSON tree and the bytes that it points into.
pub(super) struct Reader<'a> {
    root: Root,
    bytes: &'a [u8],
    /// Bytes of vertices and corners that may still be read: a file that names the same ones again and again would stand for a far larger one.
    left: Cell<usize>,
    /// The pictures read so far, by texture.
    pictures: RefCell<BTreeMap<usize, Arc<RgbaImage>>>,
    /// And how many pixels more there may be.
    pixels: RefCell<PixelBudget>,
}

impl<'a> Reader<'a> {
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self> {
        let declared = bytes.get(8..12).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
        if !bytes.starts_with(b"glTF") || declared.is_none() {
            return Err(broken("it does not begin with a GLB header"));
        }
        if declared.map(|length| length as usize) != Some(bytes.len()) {
            return Err(broken(format!("its header declares {} bytes, but it has {}", declared.unwrap_or(0), bytes.len())));
        }
        let glb = Glb::from_slice(bytes).map_err(|e| broken(e.to_string()))?;
        let root = Root::from_slice(&glb.json).map_err(|e| broken(e.to_string()))?;
        match glb.bin {
            Some(std::borrow::Cow::Borrowed(bytes)) => {
                Ok(Self { root, bytes, left: Cell::new(bytes.len()), pictures: RefCell::default(), pixels: RefCell::default() })
            }
            _ => Err(broken("it has no binary chunk")),
        }
    }

    /// What the file says of itself.
    pub(super) fn about<A: DeserializeOwned>(&self) -> Result<A> {
        ours(&self.root.extras)
    }

    /// All nodes, whatever scene they are in.
    pub(super) fn nodes(&self) -> &[Node] {
        &self.root.nodes
    }

    /// What a node says of itself.
    pub(super) fn says<S: DeserializeOwned>(&self, node: &Node) -> Result<S> {
        ours(&node.extras)
    }

    /// That a node stands where we put it.
    pub(super) fn check_unmoved(&self, node: &Node) -> Result<()> {
        if node.matrix.is_some() || node.translation.is_some() || node.rotation.is_some() || node.scale.is_some() {
            return Err(foreign("a part of the tree has been moved"));
        }
        Ok(())
    }

    /// A mesh in its material, as a part without name or crown.
    pub(super) fn dressed(&self, mesh: Index<json::Mesh>, triangles: usize, quads: usize) -> Result<model::Part> {
        let primitive = self.primitive(mesh)?;
        let surface = self.surface(primitive, triangles, quads)?;
        let about = self.get(primitive.material.ok_or_else(|| foreign("a mesh has no material"))?)?;
        let looks = &about.pbr_metallic_roughness;
        let color = looks.base_color_texture.as_ref().map(|info| info.index);
        let normals = about.normal_texture.as_ref().map(|info| info.index);
        let picture = |texture: Option<Index<json::Texture>>| texture.map(|texture| self.shared_texture(texture)).transpose();
        let material = model::Material {
            name: about.name.clone().unwrap_or_default(),
            factor: looks.base_color_factor.0,
            texture: picture(color)?,
            normal_texture: picture(normals)?,
            wrap: color.or(normals).map_or(Ok(Wrap::Repeat), |texture| self.wrap(texture))?,
            alpha_cutoff: match about.alpha_mode {
                Valid(AlphaMode::Mask) => Some(about.alpha_cutoff.unwrap_or_default().0),
                _ => None,
            },
            two_sided: about.double_sided,
        };
        Ok(model::Part { name: String::new(), surface, material, crown_center: None })
    }

    /// The base colour texture of a mesh, if it has one.
    pub(super) fn base_texture(&self, mesh: Index<json::Mesh>) -> Result<Option<Arc<RgbaImage>>> {
        let Some(material) = self.primitive(mesh)?.material else { return Ok(None) };
        let info = self.get(material)?.pbr_metallic_roughness.base_color_texture.as_ref();
        info.map(|info| self.shared_texture(info.index)).transpose()
    }

    fn primitive(&self, mesh: Index<json::Mesh>) -> Result<&json::mesh::Primitive> {
        match self.get(mesh)?.primitives.as_slice() {
            [primitive] => Ok(primitive),
            primitives => Err(foreign(format!("a mesh has {} primitives instead of one", primitives.len()))),
        }
    }

    /// A picture that several may use.
    fn shared_texture(&self, index: Index<json::Texture>) -> Result<Arc<RgbaImage>> {
        let source = self.get(index)?.source.value();
        if let Some(known) = self.pictures.borrow().get(&source) {
            return Ok(known.clone());
        }
        let picture = Arc::new(self.texture(index)?);
        self.pictures.borrow_mut().insert(source, picture.clone());
        Ok(picture)
    }

    fn wrap(&self, texture: Index<json::Texture>) -> Result<Wrap> {
        let sampler = self.get(texture)?.sampler.map(|sampler| self.get(sampler)).transpose()?;
        let clamps = sampler.is_some_and(|sampler| sampler.wrap_s == Valid(WrappingMode::ClampToEdge));
        Ok(if clamps { Wrap::Clamp } else { Wrap::Repeat })
    }

    /// The only node of the scene.
    fn tree(&self) -> Result<&Node> {
        let scene = self.root.scene.and_then(|s| self.root.get(s)).ok_or_else(|| foreign("it has no scene"))?;
        match scene.nodes.as_slice() {
            [tree] => self.get(*tree),
            nodes => Err(foreign(format!("its scene has {} root nodes instead of one", nodes.len()))),
        }
    }

    /// Adds the crown or trunk of one node to `model`.
    fn part(&self, node: Index<Node>, model: &mut TreeModel) -> Result<()> {
        let node = self.get(node)?;
        self.check_unmoved(node)?;
        let mesh = self.get(node.mesh.ok_or_else(|| foreign("a part of the tree has no mesh"))?)?;
        let own: MeshExtras = ours(&mesh.extras)?;
        let [primitive] = mesh.primitives.as_slice() else {
            return Err(foreign(format!("a mesh has {} primitives instead of one", mesh.primitives.len())));
        };
        let surface = self.surface(primitive, own.triangles, own.quads)?;
        let material = self.get(primitive.material.ok_or_else(|| foreign("a mesh has no material"))?)?;
        let looks = &material.pbr_metallic_roughness;
        match own.part {
            Part::Crown { center } => {
                let info = looks.base_color_texture.as_ref().ok_or_else(|| foreign("a crown has no texture"))?;
                let texture = self.texture(info.index)?;
                model.crowns.push(ModelCrown { surface, texture, center });
            }
            Part::Trunk {} if model.trunk.is_some() => return Err(foreign("it has two trunks")),
            Part::Wood {} | Part::Leaves {} => return Err(foreign("it is a grown tree, not a model of a photograph")),
            Part::Trunk {} => {
                let [r, g, b, _] = looks.base_color_factor.0;
                model.trunk = Some(Trunk { surface, bark: [r, g, b].map(to_srgb) });
            }
        }
        Ok(())
    }

    fn surface(&self, primitive: &json::mesh::Primitive, triangles: usize, quads: usize) -> Result<Surface> {
        let find = |semantic| primitive.attributes.get(&Valid(semantic)).copied();
        let needed = |semantic: Semantic, name| find(semantic).ok_or_else(|| foreign(format!("a mesh has no {name}")));
        let positions = self.floats(needed(Semantic::Positions, "POSITION")?, Type::Vec3)?;
        let normals = self.floats(needed(Semantic::Normals, "NORMAL")?, Type::Vec3)?;
        let uvs = find(Semantic::TexCoords(0)).map_or(Ok(Vec::new()), |uv| self.floats(uv, Type::Vec2))?;
        let colors = find(Semantic::Colors(0)).map_or(Ok(Vec::new()), |color| self.floats(color, Type::Vec4))?;
        let corners = self.corners(primitive.indices.ok_or_else(|| foreign("a mesh has no indices"))?)?;
        let positions = positions.chunks_exact(3).map(Vec3::from_slice).collect();
        Ok(Surface {
            mesh: polygons(positions, &corners, triangles, quads)?,
            normals: normals.chunks_exact(3).map(Vec3::from_slice).collect(),
            uvs: uvs.chunks_exact(2).map(Vec2::from_slice).collect(),
            colors: colors.as_chunks::<4>().0.to_vec(),
        })
    }

    fn floats(&self, accessor: Index<Accessor>, kind: Type) -> Result<Vec<f32>> {
        let components = kind.multiplicity() as u64;
        let bytes = self.elements(accessor, &[ComponentType::F32], kind, components)?.0;
        Ok(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
    }

    fn corners(&self, accessor: Index<Accessor>) -> Result<Vec<u32>> {
        let (bytes, component) = self.elements(accessor, &[ComponentType::U16, ComponentType::U32], Type::Scalar, 1)?;
        Ok(match component {
            ComponentType::U16 => bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]]).into()).collect(),
            _ => bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect(),
        })
    }

    /// The bytes of an accessor and the kind of its components, which must be among `allowed`. They are a slice of the file, so
    /// that a count beyond the file is noticed before anything is allocated for it.
    fn elements(
        &self,
        index: Index<Accessor>,
        allowed: &[ComponentType],
        kind: Type,
        components: u64,
    ) -> Result<(&'a [u8], ComponentType)> {
        let accessor = self.get(index)?;
        let component = match &accessor.component_type {
            Valid(found) if allowed.contains(&found.0) => found.0,
            _ => return Err(foreign("an accessor has other components than ours")),
        };
        if accessor.type_ != Valid(kind) || accessor.sparse.is_some() || accessor.normalized {
            return Err(foreign("an accessor is of another type than ours"));
        }
        let view = accessor.buffer_view.ok_or_else(|| foreign("an accessor has no bytes"))?;
        let bytes = self.view(view)?;
        let start = accessor.byte_offset.map_or(0, |offset| offset.0);
        let length = accessor.count.0.checked_mul(components * component.size() as u64);
        let elements = length.and_then(|length| part_of(bytes, start, length));
        let elements = elements.ok_or_else(|| broken("an accessor reaches beyond its bytes"))?;
        let left = self.left.get().checked_sub(elements.len());
        self.left.set(left.ok_or_else(|| foreign("it uses the same vertices several times"))?);
        Ok((elements, component))
    }

    fn view(&self, index: Index<json::buffer::View>) -> Result<&'a [u8]> {
        let view = self.get(index)?;
        if view.buffer.value() != 0 || view.byte_stride.is_some() {
            return Err(foreign("its bytes are laid out in another way than ours"));
        }
        let start = view.byte_offset.map_or(0, |offset| offset.0);
        part_of(self.bytes, start, view.byte_length.0).ok_or_else(|| broken("a buffer view reaches beyond the file"))
    }

    fn texture(&self, index: Index<json::Texture>) -> Result<RgbaImage> {
        let image = self.get(self.get(index)?.source)?;
        let bytes = self.view(image.buffer_view.ok_or_else(|| foreign("a texture is not inside the file"))?)?;
        self.pixels.borrow_mut().admit(bytes).map_err(|why| broken(format!("a texture {why}")))?;
        let damaged = |e: image::ImageError| broken(format!("a texture cannot be decoded ({e})"));
        let mut limits = Limits::default();
        (limits.max_image_width, limits.max_image_height) = (Some(MAX_TEXTURE_PX), Some(MAX_TEXTURE_PX));
        let mut decoder = PngDecoder::with_limits(std::io::Cursor::new(bytes), limits.clone()).map_err(damaged)?;
        decoder.set_limits(limits).map_err(damaged)?;
        Ok(DynamicImage::from_decoder(decoder).map_err(damaged)?.into_rgba8())
    }

    fn get<T>(&self, index: Index<T>) -> Result<&T>
    where
        Root: json::root::Get<T>,
    {
        self.root.get(index).ok_or_else(|| broken("it refers to something that it does not hold"))
    }
}

/// The polygons of `corners`: triangles first, then quads, each split along its corners 0–2.
fn polygons(positions: Vec<Vec3>, corners: &[u32], triangles: usize, quads: usize) -> Result<PolyMesh> {
    let declared = quads.checked_mul(6).zip(triangles.checked_mul(3)).and_then(|(q, t)| q.checked_add(t));
    if declared != Some(corners.len()) {
        return Err(foreign("a mesh has other triangles than its extras say"));
    }
    let (single, paired) = corners.split_at(3 * triangles);
    let triangles = single.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    let quad = |c: &[u32]| if (c[0], c[2]) == (c[3], c[4]) { Some([c[0], c[1], c[2], c[5]]) } else { None };
    let quads: Option<_> = paired.chunks_exact(6).map(quad).collect();
    Ok(PolyMesh { positions, triangles, quads: quads.ok_or_else(|| foreign("the triangles of a mesh have been reordered"))? })
}

/// `bytes[start..start + length]`, if there is such a part.
fn part_of(bytes: &[u8], start: u64, length: u64) -> Option<&[u8]> {
    bytes.get(usize::try_from(start).ok()?..usize::try_from(start.checked_add(length)?).ok()?)
}

/// Our own part of the file's or a mesh's extras.
fn ours<T: DeserializeOwned>(extras: &json::Extras) -> Result<T> {
    let text = extras.as_ref().ok_or_else(|| foreign("it has no extras.sphereboard"))?.get();
    serde_json::from_str::<Extras<T>>(text)
        .map(|e| e.sphereboard)
        .map_err(|e| foreign(format!("its extras.sphereboard cannot be understood ({e})")))
}

fn broken(what: impl Into<String>) -> Error {
    Error::BrokenGlb { what: what.into() }
}

pub(super) fn foreign(what: impl Into<String>) -> Error {
    Error::ForeignGlb { what: what.into() }
}
