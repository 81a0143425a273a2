//! The glTF document in the making: meshes, materials and pictures become JSON objects and the bytes they point into.

use std::collections::BTreeMap;

use gltf::binary::Glb;
use gltf::json;
use gltf::json::accessor::{ComponentType, GenericComponentType, Type};
use gltf::json::buffer::Target;
use gltf::json::material::{AlphaCutoff, AlphaMode, NormalTexture, PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor};
use gltf::json::texture::{MagFilter, MinFilter, WrappingMode};
use gltf::json::validation::{Checked::Valid, USize64};
use gltf::json::{Index, Material, Mesh, Node, Root};
use image::{DynamicImage, RgbaImage};
use serde::Serialize;

use super::{Extras, MeshExtras, Part};
use crate::geom::{Bounds, Surface};
use crate::model::Wrap;
use crate::raster::{self, PngEffort};
use crate::{Error, Result};

/// How a surface looks, as the file says it.
pub(super) struct Look {
    /// Multiplies the texture: linear light, straight alpha.
    pub factor: [f32; 4],
    /// What is on it.
    pub texture: Option<Index<json::Texture>>,
    /// Which way its small parts face.
    pub normal_texture: Option<Index<json::Texture>>,
    /// Texels of less alpha are not there; `None` for an opaque surface.
    pub alpha_cutoff: Option<f32>,
    /// Whether its back is seen.
    pub two_sided: bool,
}

impl Default for Look {
    fn default() -> Self {
        Self { factor: [1.0; 4], texture: None, normal_texture: None, alpha_cutoff: None, two_sided: false }
    }
}

/// A file in the making: the JSON tree and the bytes that it points into.
#[derive(Default)]
pub(super) struct Writer {
    root: Root,
    bytes: Vec<u8>,
    /// The samplers so far.
    samplers: Vec<(Wrap, Index<json::texture::Sampler>)>,
}

impl Writer {
    /// A mesh with its node.
    pub(super) fn part(&mut self, name: &str, surface: &Surface, part: Part, material: Index<Material>) -> Result<Index<Node>> {
        let mesh = &surface.mesh;
        let own = MeshExtras { part, triangles: mesh.triangles.len(), quads: mesh.quads.len() };
        let mesh = self.mesh(name, surface, material)?;
        self.root.meshes[mesh.value()].extras = extras(&own)?;
        Ok(self.root.push(Node { name: Some(name.to_owned()), mesh: Some(mesh), ..Node::default() }))
    }

    /// A mesh of one material; with tangents where that has a normal texture.
    pub(super) fn mesh(&mut self, name: &str, surface: &Surface, material: Index<Material>) -> Result<Index<Mesh>> {
        let bumpy = self.root.materials[material.value()].normal_texture.is_some();
        let primitive = json::mesh::Primitive {
            attributes: self.attributes(surface, bumpy),
            indices: Some(self.indices(surface)),
            material: Some(material),
            mode: Valid(json::mesh::Mode::Triangles),
            targets: None,
            extensions: None,
            extras: None,
        };
        let primitives = vec![primitive];
        Ok(self.root.push(Mesh { name: Some(name.to_owned()), primitives, weights: None, extensions: None, extras: None }))
    }

    /// A node that shows `mesh`, with what is said of it.
    pub(super) fn node(&mut self, name: &str, mesh: Index<Mesh>, says: &impl Serialize) -> Result<Index<Node>> {
        Ok(self.root.push(Node { name: Some(name.to_owned()), mesh: Some(mesh), extras: extras(says)?, ..Node::default() }))
    }

    /// A node as it is.
    pub(super) fn push_node(&mut self, node: Node) -> Index<Node> {
        self.root.push(node)
    }

    /// What an extension says of a node.
    pub(super) fn extend_node(&mut self, node: Index<Node>, extension: &str, says: serde_json::Value) {
        let says = json::extensions::scene::Node { others: [(extension.to_owned(), says)].into_iter().collect() };
        self.root.nodes[node.value()].extensions = Some(says);
    }

    /// Who does not know that extension cannot show the file.
    pub(super) fn require(&mut self, extension: &str) {
        self.root.extensions_used.push(extension.to_owned());
        self.root.extensions_required.push(extension.to_owned());
    }

    /// A node over others.
    pub(super) fn group(&mut self, name: &str, children: Vec<Index<Node>>) -> Index<Node> {
        self.root.push(Node { name: Some(name.to_owned()), children: Some(children), ..Node::default() })
    }

    /// Makes the first of these nodes the finest level of detail of the tree, the others those that may take its place: `MSFT_lod`, with
    /// the share of the screen down to which each is meant.
    pub(super) fn levels(&mut self, nodes: &[Index<Node>], covers: &[f32]) -> Result<()> {
        let [finest, coarser @ ..] = nodes else { return Ok(()) };
        let ids: Vec<u32> = coarser.iter().map(|node| node.value() as u32).collect();
        self.extend_node(*finest, "MSFT_lod", serde_json::json!({ "ids": ids }));
        self.root.nodes[finest.value()].extras =
            Some(serde_json::value::to_raw_value(&serde_json::json!({ "MSFT_screencoverage": covers })).map_err(internal)?);
        self.root.extensions_used.push("MSFT_lod".to_owned());
        Ok(())
    }

    /// A scene; the first is the one that is shown.
    pub(super) fn scene(&mut self, name: Option<&str>, nodes: Vec<Index<Node>>) {
        let scene = self.root.push(json::Scene { name: name.map(str::to_owned), nodes, extensions: None, extras: None });
        self.root.scene.get_or_insert(scene);
    }

    fn attributes(
        &mut self,
        surface: &Surface,
        bumpy: bool,
    ) -> BTreeMap<json::validation::Checked<json::mesh::Semantic>, Index<json::Accessor>> {
        use json::mesh::Semantic::{Colors, Normals, Positions, Tangents, TexCoords};
        let floats = |values: &mut dyn Iterator<Item = f32>| values.flat_map(f32::to_le_bytes).collect::<Vec<_>>();
        let positions = &surface.mesh.positions;
        let count = positions.len();
        let bytes = floats(&mut positions.iter().flat_map(|p| p.to_array()));
        let position = self.accessor(&bytes, Target::ArrayBuffer, ComponentType::F32, Type::Vec3, count);
        if let Some(Bounds { min, max }) = surface.mesh.bounds() {
            let accessor = &mut self.root.accessors[position.value()];
            (accessor.min, accessor.max) = (Some(serde_json::json!(min.to_array())), Some(serde_json::json!(max.to_array())));
        }
        let bytes = floats(&mut surface.normals.iter().flat_map(|n| n.to_array()));
        let normal = self.accessor(&bytes, Target::ArrayBuffer, ComponentType::F32, Type::Vec3, count);
        let mut attributes = BTreeMap::from([(Valid(Positions), position), (Valid(Normals), normal)]);
        if !surface.uvs.is_empty() {
            let bytes = floats(&mut surface.uvs.iter().flat_map(|t| t.to_array()));
            let uv = self.accessor(&bytes, Target::ArrayBuffer, ComponentType::F32, Type::Vec2, count);
            attributes.insert(Valid(TexCoords(0)), uv);
        }
        if bumpy {
            let bytes = floats(&mut surface.tangents().iter().flat_map(|t| t.to_array()));
            let tangent = self.accessor(&bytes, Target::ArrayBuffer, ComponentType::F32, Type::Vec4, count);
            attributes.insert(Valid(Tangents), tangent);
        }
        if !surface.colors.is_empty() {
            let bytes = floats(&mut surface.colors.iter().flatten().copied());
            let color = self.accessor(&bytes, Target::ArrayBuffer, ComponentType::F32, Type::Vec4, count);
            attributes.insert(Valid(Colors(0)), color);
        }
        attributes
    }

    /// The corners of all triangles, 16 bits each where they fit (65,535 itself means "restart" to some hardware).
    fn indices(&mut self, surface: &Surface) -> Index<json::Accessor> {
        let corners: Vec<u32> = surface.mesh.triangulated().flatten().collect();
        let (bytes, kind): (Vec<u8>, _) = if surface.mesh.positions.len() < 65_536 {
            (corners.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect(), ComponentType::U16)
        } else {
            (corners.iter().flat_map(|&i| i.to_le_bytes()).collect(), ComponentType::U32)
        };
        self.accessor(&bytes, Target::ElementArrayBuffer, kind, Type::Scalar, corners.len())
    }

    fn accessor(
        &mut self,
        bytes: &[u8],
        target: Target,
        component: ComponentType,
        kind: Type,
        count: usize,
    ) -> Index<json::Accessor> {
        let view = self.view(bytes, Some(target));
        self.access(view, component, kind, count)
    }

    /// Values that are neither vertices nor corners.
    pub(super) fn list(&mut self, bytes: &[u8], component: ComponentType, kind: Type, count: usize) -> Index<json::Accessor> {
        let view = self.view(bytes, None);
        self.access(view, component, kind, count)
    }

    fn access(
        &mut self,
        view: Index<json::buffer::View>,
        component: ComponentType,
        kind: Type,
        count: usize,
    ) -> Index<json::Accessor> {
        self.root.push(json::Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: USize64::from(count),
            component_type: Valid(GenericComponentType(component)),
            type_: Valid(kind),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
            extensions: None,
            extras: None,
        })
    }

    fn view(&mut self, bytes: &[u8], target: Option<Target>) -> Index<json::buffer::View> {
        let start = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.root.push(json::buffer::View {
            buffer: Index::new(0),
            byte_length: USize64::from(bytes.len()),
            byte_offset: Some(USize64::from(start)),
            byte_stride: None,
            name: None,
            target: target.map(Valid),
            extensions: None,
            extras: None,
        })
    }

    /// A texture, its picture a PNG file.
    pub(super) fn texture(&mut self, name: &str, picture: &[u8], wrap: Wrap) -> Index<json::Texture> {
        let view = self.view(picture, None);
        let source = self.root.push(json::Image {
            buffer_view: Some(view),
            mime_type: Some(json::image::MimeType("image/png".to_owned())),
            name: Some(name.to_owned()),
            uri: None,
            extensions: None,
            extras: None,
        });
        let sampler = Some(self.sampler(wrap));
        self.root.push(json::Texture { name: None, sampler, source, extensions: None, extras: None })
    }

    fn sampler(&mut self, wrap: Wrap) -> Index<json::texture::Sampler> {
        if let Some((_, sampler)) = self.samplers.iter().find(|(known, _)| *known == wrap) {
            return *sampler;
        }
        let mode = match wrap {
            Wrap::Clamp => WrappingMode::ClampToEdge,
            Wrap::Repeat => WrappingMode::Repeat,
        };
        let sampler = self.root.push(json::texture::Sampler {
            mag_filter: Some(Valid(MagFilter::Linear)),
            min_filter: Some(Valid(MinFilter::LinearMipmapLinear)),
            wrap_s: Valid(mode),
            wrap_t: Valid(mode),
            ..Default::default()
        });
        self.samplers.push((wrap, sampler));
        sampler
    }

    /// A surface that does not shine.
    pub(super) fn material(&mut self, name: &str, look: &Look) -> Index<Material> {
        let info = |index| json::texture::Info { index, tex_coord: 0, extensions: None, extras: None };
        let normal = |index| NormalTexture { index, scale: 1.0, tex_coord: 0, extensions: None, extras: None };
        self.root.push(Material {
            name: (!name.is_empty()).then(|| name.to_owned()),
            alpha_mode: Valid(if look.alpha_cutoff.is_some() { AlphaMode::Mask } else { AlphaMode::Opaque }),
            alpha_cutoff: look.alpha_cutoff.map(AlphaCutoff),
            double_sided: look.two_sided,
            normal_texture: look.normal_texture.map(normal),
            pbr_metallic_roughness: PbrMetallicRoughness {
                base_color_factor: PbrBaseColorFactor(look.factor),
                base_color_texture: look.texture.map(info),
                metallic_factor: StrengthFactor(0.0),
                roughness_factor: StrengthFactor(1.0),
                ..Default::default()
            },
            ..Material::default()
        })
    }

    /// The file: one root node `tree` over `parts`, with what `about` says of it.
    pub(super) fn finish(mut self, parts: Vec<Index<Node>>, about: &impl Serialize, program: &str) -> Result<Vec<u8>> {
        let tree = self.group("tree", parts);
        self.scene(None, vec![tree]);
        self.bytes(about, program)
    }

    /// The file, with what `about` says of it.
    pub(super) fn bytes(mut self, about: &impl Serialize, program: &str) -> Result<Vec<u8>> {
        self.root.extras = extras(about)?;
        self.root.asset.generator = Some(program.to_owned());
        let byte_length = USize64::from(self.bytes.len());
        self.root.push(json::Buffer { byte_length, name: None, uri: None, extensions: None, extras: None });
        let json = self.root.to_vec().map_err(internal)?;
        // The lengths in a GLB file are 32 bits wide.
        if u32::try_from(json.len() + self.bytes.len() + 64).is_err() {
            return Err(internal("the model is larger than the 4 GiB that a GLB file can hold"));
        }
        let header = gltf::binary::Header { magic: *b"glTF", version: 2, length: 0 };
        Glb { header, json: json.into(), bin: Some(self.bytes.into()) }.to_vec().map_err(internal)
    }
}

/// A texture as a PNG file, without its alpha channel when that says nothing.
pub(super) fn png(texture: &RgbaImage) -> Result<Vec<u8>> {
    if texture.pixels().all(|p| p[3] == 255) {
        raster::png_with(&DynamicImage::ImageRgba8(texture.clone()).into_rgb8(), PngEffort::Small)
    } else {
        raster::png_with(texture, PngEffort::Small)
    }
}

fn extras(value: &impl Serialize) -> Result<json::Extras> {
    serde_json::value::to_raw_value(&Extras { sphereboard: value }).map(Some).map_err(internal)
}

fn internal(cause: impl ToString) -> Error {
    Error::Internal { stage: "model::glb", what: cause.to_string() }
}
