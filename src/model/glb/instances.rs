//! Many trees in one GLB file: `EXT_mesh_gpu_instancing`. Each kind of tree is written once; a node for each of its parts in each batch says
//! where its copies stand, in flat lists of TRANSLATION, ROTATION and SCALE that the parts of a batch share: 40 bytes for each tree.

use glam::{Quat, Vec3};
use gltf::json::{Index, Material, Mesh, Node};
use serde::Serialize;

use super::Plainly;
use super::write::Pictures;
use super::writer::{Look, Writer};
use crate::geom::Surface;
use crate::model::Part;
use crate::{Error, Result};

/// What a file is made of. Nothing in it moves the lists: copies stand where they say, in the file's own space.
#[derive(Debug)]
pub struct Instanced<'a> {
    /// Kinds of trees: each the name of its mesh's nodes, and its parts as a program that knows only glTF shows them.
    pub kinds: Vec<Kind<'a>>,
    /// Where copies stand.
    pub batches: Vec<Batch>,
    /// The ground, once, in a colour: linear light.
    pub ground: Option<(Surface, [f32; 3])>,
}

/// One kind of tree.
#[derive(Debug)]
pub struct Kind<'a> {
    /// What nodes are called after.
    pub name: String,
    /// What it consists of.
    pub parts: Vec<(&'a Part, Plainly)>,
}

impl<'a> Kind<'a> {
    /// The parts that are there for a program that knows only glTF.
    pub fn shown(&self) -> impl Iterator<Item = &(&'a Part, Plainly)> {
        self.parts.iter().filter(|(_, plainly)| *plainly != Plainly::Nothing)
    }

    /// Triangles of a tree.
    pub fn triangles(&self) -> usize {
        let surface = |(part, plainly): &(&'a Part, Plainly)| match plainly {
            Plainly::Other(surface) => surface.mesh.triangulated().count(),
            _ => part.surface.mesh.triangulated().count(),
        };
        self.shown().map(surface).sum()
    }
}

/// Copies of one kind that stand near one another, so that a viewer can leave out all at once.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Batch {
    /// Which of [`Instanced::kinds`].
    pub kind: usize,
    /// What the nodes are called, after the kind's name.
    pub name: String,
    /// Foot, metres; turn about the vertical, radians; times the kind's size.
    pub copies: Vec<(Vec3, f32, f32)>,
}

/// The extension that the files need: without it one tree of each batch would stand in the middle.
pub const EXTENSION: &str = "EXT_mesh_gpu_instancing";

/// Writes a file. `about` becomes its `extras.sphereboard`. Same trees, same bytes.
///
/// # Errors
/// [`Error::Internal`] when a part breaks a promise ([`Part::check`]), a batch is of no kind, or the file would be larger than 4 GiB.
pub fn write_instances(grove: &Instanced, about: &impl Serialize, program: &str) -> Result<Vec<u8>> {
    let internal = |what: String| Error::Internal { stage: "model::glb", what };
    let parts = || grove.kinds.iter().flat_map(|kind| &kind.parts);
    for (part, _) in parts() {
        part.check().map_err(|what| internal(format!("{}: {what}", part.name)))?;
    }
    let mut file = Writer::default();
    let mut roots = vec![];
    if let Some((surface, [r, g, b])) = &grove.ground {
        let material = file.material("ground", &Look { factor: [*r, *g, *b, 1.0], ..Look::default() });
        let mesh = file.mesh("ground", surface, material)?;
        roots.push(file.node_of("ground", mesh));
    }
    let pictures = Pictures::write(&mut file, parts().map(|(part, _)| (part.name.as_str(), &part.material)))?;
    let mut meshes = vec![];
    for kind in &grove.kinds {
        let mesh = |(part, plainly): &(&Part, Plainly)| mesh_of(&mut file, part, plainly, &pictures);
        meshes.push(kind.shown().map(mesh).collect::<Result<Vec<_>>>()?);
    }
    for batch in grove.batches.iter().filter(|batch| !batch.copies.is_empty()) {
        let (Some(kind), Some(meshes)) = (grove.kinds.get(batch.kind), meshes.get(batch.kind)) else {
            return Err(internal(format!("a batch is of kind {}, but there are {}", batch.kind, grove.kinds.len())));
        };
        let lists = Lists::write(&mut file, batch);
        for (mesh, (part, _)) in meshes.iter().zip(kind.shown()) {
            let node = file.node_of(&format!("{} {} {}", kind.name, part.name, batch.name), *mesh);
            file.extend_node(node, EXTENSION, serde_json::json!({ "attributes": lists.0 }));
            roots.push(node);
        }
    }
    if grove.batches.iter().any(|batch| !batch.copies.is_empty()) {
        file.require(EXTENSION);
    }
    let grove = file.group("grove", roots);
    file.scene(None, vec![grove]);
    file.bytes(about, program)
}

fn mesh_of(file: &mut Writer, part: &Part, plainly: &Plainly, pictures: &Pictures) -> Result<Index<Mesh>> {
    let look = pictures.look(&part.material);
    match plainly {
        Plainly::Other(surface) => {
            let plain: Index<Material> = file.material(&part.material.name, &Look { normal_texture: None, ..look });
            file.mesh(&part.name, surface, plain)
        }
        _ => {
            let material = file.material(&part.material.name, &look);
            file.mesh(&part.name, &part.surface, material)
        }
    }
}

/// A batch's lists, as the extension names them.
struct Lists(serde_json::Value);

impl Lists {
    fn write(file: &mut Writer, batch: &Batch) -> Self {
        let turn = |yaw: &f32| Quat::from_rotation_y(*yaw).to_array();
        let translation = file.vectors(batch.copies.iter().map(|(at, ..)| at.to_array()));
        let rotation = file.vectors(batch.copies.iter().map(|(_, yaw, _)| turn(yaw)));
        let scale = file.vectors(batch.copies.iter().map(|(.., scale)| [*scale; 3]));
        let [translation, rotation, scale] = [translation, rotation, scale].map(|list| list.value());
        Self(serde_json::json!({ "TRANSLATION": translation, "ROTATION": rotation, "SCALE": scale }))
    }
}

impl Writer {
    /// A list of vectors of 3 or 4 numbers that is no mesh's.
    fn vectors<const N: usize>(&mut self, values: impl ExactSizeIterator<Item = [f32; N]>) -> Index<gltf::json::Accessor> {
        use gltf::json::accessor::{ComponentType, Type};
        let count = values.len();
        let bytes: Vec<u8> = values.flatten().flat_map(f32::to_le_bytes).collect();
        let kind = if N == 3 { Type::Vec3 } else { Type::Vec4 };
        self.list(&bytes, ComponentType::F32, kind, count)
    }

    /// A node that shows `mesh`.
    fn node_of(&mut self, name: &str, mesh: Index<Mesh>) -> Index<Node> {
        self.push_node(Node { name: Some(name.to_owned()), mesh: Some(mesh), ..Node::default() })
    }
}
