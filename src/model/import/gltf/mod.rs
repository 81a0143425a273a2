//! Any sane glTF 2.0 file, binary or not, of any exporter to [`Part`]s in metres and world space. Nothing in the file is believed
//! before it is checked, and no file makes us hold much more than its own length.

mod bytes;
mod geometry;
mod material;
mod schema;

use std::collections::BTreeMap;

use glam::{DMat4, DQuat, DVec3};
use serde_json::Value;

use super::Warnings;
use super::folder::{Folder, shortened};
use crate::model::{Part, Wrap};
use crate::{Error, Result};

use bytes::{Bytes, Elements};
use geometry::Geometry;
use material::Materials;
use schema::{Document, Instancing, Node};

/// How many vertices and corners a file may stand for beyond one per byte of its own: meshes that stand in many places need some.
const MORE_VERTICES: usize = 8_000_000;

/// Extensions that change nothing that is read here, or that are read. A file may require them.
const READ: [&str; 5] =
    ["KHR_texture_transform", "KHR_mesh_quantization", "EXT_texture_webp", "EXT_mesh_gpu_instancing", "KHR_lights_punctual"];

/// Extensions without which the file says nothing to us, and what its owner can do.
const NOT_READ: [(&str, &str); 4] = [
    ("KHR_draco_mesh_compression", "export it without Draco compression"),
    ("EXT_meshopt_compression", "export it without meshopt compression (gltfpack: leave out -c and -cc)"),
    ("KHR_meshopt_compression", "export it without meshopt compression (gltfpack: leave out -c and -cc)"),
    ("KHR_texture_basisu", "export it with PNG, JPEG or WebP textures instead of KTX2 (gltfpack: leave out -tc)"),
];

/// From how many meshes in their places those of one material become one part.
const MOST_PARTS: usize = 64;

/// What makes surfaces look alike: material, whether there is a texture, how wide it is (twice, when mirrored), how it goes on.
type Looks = (Option<usize>, bool, Option<u32>, Wrap);

/// An open file.
pub struct File<'a> {
    document: Document,
    binary: Option<&'a [u8]>,
    length: usize,
}

impl<'a> File<'a> {
    /// Takes the file apart, without reading its meshes yet.
    ///
    /// # Errors
    /// [`Error::BrokenModel`] for damaged bytes, [`Error::GltfExtension`] for a file that cannot be understood without an extension.
    pub fn open(bytes: &'a [u8]) -> Result<Self> {
        let (json, binary) = chunks(bytes)?;
        let mut document: Document = serde_json::from_slice(json).map_err(|e| broken(format!("its JSON cannot be read ({e})")))?;
        if !document.asset.version.starts_with("2.") {
            return Err(broken(format!("it is of version “{}” instead of 2.0", shortened(&document.asset.version))));
        }
        for name in &document.extensions_required {
            let cosmetic = name.starts_with("KHR_materials_") || READ.contains(&name.as_str());
            if !cosmetic {
                let known = NOT_READ.iter().find(|(known, _)| known == name);
                let remedy = known.map_or("export it without that extension", |(_, remedy)| remedy);
                return Err(Error::GltfExtension { name: shortened(name), remedy });
            }
        }
        document.compare_images();
        Ok(Self { document, binary, length: bytes.len() })
    }

    /// What the file says of itself under `extras.sphereboard`.
    pub fn own_extras(&self) -> Option<&Value> {
        self.document.extras.get("sphereboard")
    }

    /// The surfaces of its scene.
    ///
    /// # Errors
    /// [`Error::BrokenModel`] where the file contradicts itself.
    pub fn parts(&self, folder: &Folder, warnings: &mut Warnings) -> Result<Vec<Part>> {
        let document = &self.document;
        let bytes = Bytes::fetch(document, self.binary, folder);
        let left = self.length.saturating_add(MORE_VERTICES).min(u32::MAX as usize);
        let mut spent = Spent { left, length: self.length };
        let mut materials = Materials::read(document, &bytes, folder, warnings);
        let mut parts: Vec<Part> = Vec::new();
        let placed = self.placed(&bytes, &mut spent, warnings)?;
        // A tree of ten thousand nodes, one for each leaf, is to become a surface of leaves and not ten thousand surfaces.
        let gather = placed.len() > MOST_PARTS;
        let mut gathered: BTreeMap<Looks, usize> = BTreeMap::new();
        for placed in placed {
            let mesh = pick(&document.meshes, placed.mesh, "mesh")?;
            for (number, primitive) in mesh.primitives.iter().enumerate() {
                let geometry = Geometry { document, bytes: &bytes, primitive };
                let placement = materials.placement(primitive.material);
                let Some(mut surface) = geometry.surface(placed.world, placement, &mut spent, warnings)? else { continue };
                let material = materials.dressed(primitive.material, &mut surface.uvs, warnings);
                if gather {
                    let next = parts.len();
                    let looks =
                        (primitive.material, surface.uvs.is_empty(), material.texture.as_ref().map(|t| t.width()), material.wrap);
                    let part = *gathered.entry(looks).or_insert(next);
                    if part < next {
                        parts[part].surface.append(surface);
                        continue;
                    }
                }
                let own = if placed.name.is_empty() { &mesh.name } else { placed.name };
                let mut name = named(&shortened(own), "mesh", placed.mesh);
                if mesh.primitives.len() > 1 {
                    name = format!("{name}.{number}");
                }
                parts.push(Part { name, surface, material, crown_center: None });
            }
        }
        Ok(parts)
    }

    /// Every place where a mesh stands, in the order of the scene's nodes, depth first. Without recursion: a file may nest as deep as
    /// it likes.
    fn placed(&self, bytes: &Bytes, spent: &mut Spent, warnings: &mut Warnings) -> Result<Vec<Placed<'_>>> {
        let nodes = &self.document.nodes;
        if nodes.is_empty() {
            // A library of meshes without a scene.
            return Ok((0..self.document.meshes.len()).map(|mesh| Placed { mesh, world: DMat4::IDENTITY, name: "" }).collect());
        }
        let mut open: Vec<(usize, DMat4)> = self.roots(warnings)?.into_iter().rev().map(|node| (node, DMat4::IDENTITY)).collect();
        let mut reached = vec![false; nodes.len()];
        let mut placed = Vec::new();
        while let Some((number, parent)) = open.pop() {
            let node = pick(nodes, number, "node")?;
            if std::mem::replace(&mut reached[number], true) {
                return Err(broken(format!("node {number} stands below itself or below two others")));
            }
            let world = parent * local(node);
            open.extend(node.children.iter().rev().map(|&child| (child, world)));
            let Some(mesh) = node.mesh else { continue };
            if node.skin.is_some() {
                // Specification, 3.7.3.3: the joints place a skinned mesh, not its node; at rest they leave it where it is.
                warnings.add("skin-at-rest", "the file has a skeleton with skin; it is read in its pose of rest".to_owned());
                placed.push(Placed { mesh, world: DMat4::IDENTITY, name: &node.name });
            } else if let Some(instancing) = &node.extensions.instancing {
                let places = self.instances(instancing, bytes, spent)?;
                placed.extend(places.into_iter().map(|place| Placed { mesh, world: world * place, name: &node.name }));
            } else {
                placed.push(Placed { mesh, world, name: &node.name });
            }
        }
        Ok(placed)
    }

    /// The nodes that the scene begins with: of the default scene, else the first, else all that stand below no other.
    fn roots(&self, warnings: &mut Warnings) -> Result<Vec<usize>> {
        let scenes = &self.document.scenes;
        if scenes.len() > 1 {
            let number = self.document.scene.unwrap_or(0);
            warnings.add("several-scenes", format!("the file has {} scenes; only number {number} is read", scenes.len()));
        }
        if scenes.is_empty() {
            let mut below = vec![false; self.document.nodes.len()];
            let children = self.document.nodes.iter().flat_map(|node| &node.children);
            children.for_each(|&child| below.get_mut(child).into_iter().for_each(|below| *below = true));
            return Ok((0..below.len()).filter(|&node| !below[node]).collect());
        }
        Ok(pick(scenes, self.document.scene.unwrap_or(0), "scene")?.nodes.clone())
    }

    /// The places of `EXT_mesh_gpu_instancing`, relative to their node.
    fn instances(&self, instancing: &Instancing, bytes: &Bytes, spent: &mut Spent) -> Result<Vec<DMat4>> {
        let mut read = |name: &str| {
            let accessor = instancing.attributes.get(name);
            accessor.map(|&accessor| spent.elements(bytes, &self.document, accessor)).transpose()
        };
        let (translations, rotations, scales) = (read("TRANSLATION")?, read("ROTATION")?, read("SCALE")?);
        let lengths = || [&translations, &rotations, &scales].into_iter().flatten().map(Elements::len);
        let count = lengths().min().unwrap_or(0);
        spent.vertices(count)?;
        let vector = |elements: &Option<Elements>, k: usize, rest: [f64; 4]| {
            elements.as_ref().map_or(rest, |e| e.vector::<4>(k, 0.0).map(f64::from))
        };
        let place = |k: usize| {
            let ([tx, ty, tz, _], turn) = (vector(&translations, k, [0.0; 4]), vector(&rotations, k, [0.0, 0.0, 0.0, 1.0]));
            let [sx, sy, sz, _] = vector(&scales, k, [1.0; 4]);
            placement([tx, ty, tz], turn, [sx, sy, sz])
        };
        Ok((0..count).map(place).collect())
    }
}

/// A mesh in its place.
struct Placed<'a> {
    mesh: usize,
    world: DMat4,
    name: &'a str,
}

/// What a file may still make us hold.
pub struct Spent {
    left: usize,
    length: usize,
}

impl Spent {
    /// Takes note of vertices or corners before memory is allocated for them.
    fn vertices(&mut self, count: usize) -> Result<()> {
        self.left = self.left.checked_sub(count).ok_or_else(|| {
            broken("its meshes repeat one another into more vertices than can be held; export it with fewer copies")
        })?;
        Ok(())
    }

    /// An accessor; one that has to be copied or made up counts.
    fn elements<'b>(&mut self, bytes: &'b Bytes, document: &Document, accessor: usize) -> Result<Elements<'b>> {
        let about = pick(&document.accessors, accessor, "accessor")?;
        if about.buffer_view.is_none() || about.sparse.is_some() {
            self.vertices(about.count)?;
        }
        bytes.elements(document, accessor, self.length)
    }
}

/// The JSON and the binary chunk of a GLB file; all of a glTF file is JSON.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>)> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), None));
    }
    let number = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let (Some(version), Some(declared)) = (number(4), number(8)) else { return Err(broken("it ends within its header")) };
    if version != 2 {
        return Err(broken(format!("it is of version {version} instead of 2")));
    }
    if declared as usize > bytes.len() {
        return Err(broken(format!("its header declares {declared} bytes, but it has {}", bytes.len())));
    }
    let (mut json, mut binary, mut at) = (None, None, 12);
    while let (Some(length), Some(kind)) = (number(at), bytes.get(at + 4..at + 8)) {
        let end = (at + 8).checked_add(length as usize);
        let chunk = end.and_then(|end| bytes.get(at + 8..end));
        let chunk = chunk.ok_or_else(|| broken(format!("a chunk of {length} bytes reaches beyond its end")))?;
        match kind {
            b"JSON" => drop(json.get_or_insert(chunk)),
            b"BIN\0" => drop(binary.get_or_insert(chunk)),
            _ => {}
        }
        at += 8 + chunk.len();
    }
    json.map(|json| (json, binary)).ok_or_else(|| broken("it has no JSON chunk"))
}

/// A node's place relative to its parent.
fn local(node: &Node) -> DMat4 {
    match &node.matrix {
        Some(matrix) => DMat4::from_cols_array(matrix),
        None => {
            let rotation = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
            placement(node.translation.unwrap_or_default(), rotation, node.scale.unwrap_or([1.0; 3]))
        }
    }
}

fn placement(translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3]) -> DMat4 {
    let rotation = DQuat::from_array(rotation);
    let unit = if rotation.is_finite() && rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
    DMat4::from_scale_rotation_translation(DVec3::from_array(scale), unit, DVec3::from_array(translation))
}

/// The element of that number, if the file has it.
fn pick<'a, T>(list: &'a [T], number: usize, what: &str) -> Result<&'a T> {
    list.get(number).ok_or_else(|| broken(format!("it names {what} {number}, but has {} of them", list.len())))
}

/// What something is called: its own name, else its kind and number.
fn named(name: &str, kind: &str, number: usize) -> String {
    if name.is_empty() { format!("{kind} {number}") } else { name.to_owned() }
}

fn broken(what: impl Into<String>) -> Error {
    Error::BrokenModel { format: "glTF", what: what.into() }
}
