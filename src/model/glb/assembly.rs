//! Parts in levels of detail, each with what is said of it in the node's `extras.sphereboard`: written, and read back bit for bit.
//!
//! The scene that viewers show has one node `tree` with the finest level's parts. Where there are several levels, it has one node per
//! level instead: the finest names the others by `MSFT_lod`, and each of these is also a scene of its own, so that programs that know
//! nothing of the extension show one level and can choose another. A part in several levels has a node in each, and one mesh. Parts that
//! a plain viewer would show wrongly stand in a last scene, where only we look for them; something else may stand for them in the levels.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use glam::Vec3;
use gltf::json::{Index, Material, Mesh, Node};

use super::write::Pictures;
use super::writer::{Look, Writer};
use super::{MAX_TEXTURE_PX, read::Reader};
use crate::geom::Surface;
use crate::model::Part;
use crate::{Error, Result};

/// What a file is made of.
#[derive(Debug)]
pub struct Assembly<'a, S> {
    /// Its parts.
    pub pieces: Vec<Piece<'a, S>>,
    /// Its levels of detail, finest first; at least one.
    pub tiers: Vec<Tier>,
}

/// A part with what is said of it.
#[derive(Debug)]
pub struct Piece<'a, S> {
    /// The part.
    pub part: &'a Part,
    /// What is said of it; a struct.
    pub says: S,
    /// What a program that knows only glTF shows of it.
    pub plainly: Plainly,
}

/// What a program that knows only glTF shows of a part.
#[derive(Debug, Clone, PartialEq)]
pub enum Plainly {
    /// The part.
    Itself,
    /// Nothing.
    Nothing,
    /// This, in the part's material. The part's normal texture is not in tangent space, and not glTF's.
    Other(Surface),
}

/// A level of detail.
#[derive(Debug, Clone)]
pub struct Tier {
    /// What it is called.
    pub name: String,
    /// Down to which share of the screen it is meant, 0 to 1.
    pub covers: f32,
    /// Its parts, by number.
    pub pieces: Vec<usize>,
}

/// What a node says of itself.
#[derive(Serialize, Deserialize)]
#[serde(tag = "role", rename_all = "kebab-case")]
enum Says<S> {
    /// It is a part.
    Part {
        number: usize,
        triangles: usize,
        quads: usize,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        crown_center: Option<Vec3>,
        #[serde(flatten)]
        says: S,
    },
    /// It shows the normal texture of a part.
    Normals { of: usize },
    /// It stands for a part.
    StandsFor { part: usize },
}

/// Writes a file. `about` becomes its `extras.sphereboard`. Same assembly, same bytes.
///
/// # Errors
/// [`Error::Internal`] when a part breaks a promise ([`Part::check`]), or a picture is larger than [`MAX_TEXTURE_PX`].
pub fn write_assembly<S: Serialize>(assembly: &Assembly<S>, about: &impl Serialize, program: &str) -> Result<Vec<u8>> {
    for Piece { part, .. } in &assembly.pieces {
        let sizes = [&part.material.texture, &part.material.normal_texture].into_iter().flatten().map(|image| image.dimensions());
        let fit = sizes.flat_map(|(w, h)| [w, h]).all(|side| (1..=MAX_TEXTURE_PX).contains(&side));
        let checked = part.check().and_then(|()| if fit { Ok(()) } else { Err(format!("a picture beyond {MAX_TEXTURE_PX} px")) });
        checked.map_err(|what| Error::Internal { stage: "model::glb", what: format!("{}: {what}", part.name) })?;
    }
    let mut file = Writer::default();
    let materials = assembly.pieces.iter().map(|piece| (piece.part.name.as_str(), &piece.part.material));
    let pictures = Pictures::write(&mut file, materials)?;
    let mut written = Vec::new();
    for piece in &assembly.pieces {
        written.push(Written::write(&mut file, piece, &pictures)?);
    }
    let mut levels = Vec::new();
    let mut seen = vec![false; written.len()];
    for tier in &assembly.tiers {
        let mut nodes = Vec::new();
        for &number in &tier.pieces {
            let (piece, written) = (&assembly.pieces[number], &written[number]);
            match written.other {
                Some(mesh) => nodes.push(file.node(&piece.part.name, mesh, &Says::<S>::StandsFor { part: number })?),
                None if piece.plainly == Plainly::Itself => {
                    seen[number] = true;
                    nodes.push(file.node(&piece.part.name, written.mesh, &piece.said(number))?);
                }
                None => {}
            }
        }
        levels.push((tier, nodes));
    }
    let mut unseen = Vec::new();
    for (number, (piece, written)) in assembly.pieces.iter().zip(&written).enumerate().filter(|(number, _)| !seen[*number]) {
        unseen.push(file.node(&piece.part.name, written.mesh, &piece.said(number))?);
        if let Some(mesh) = written.normals {
            unseen.push(file.node(&format!("{} normals", piece.part.name), mesh, &Says::<S>::Normals { of: number })?);
        }
    }
    scenes(&mut file, levels, unseen)?;
    file.bytes(about, program)
}

/// Puts the nodes of the levels into scenes.
fn scenes(file: &mut Writer, mut levels: Vec<(&Tier, Vec<Index<Node>>)>, unseen: Vec<Index<Node>>) -> Result<()> {
    if let [(_, nodes)] = levels.as_mut_slice() {
        let tree = file.group("tree", std::mem::take(nodes));
        file.scene(None, vec![tree]);
    } else {
        let covers: Vec<f32> = levels.iter().map(|(tier, _)| tier.covers).collect();
        let named: Vec<_> = levels.iter().map(|(tier, _)| tier.name.clone()).collect();
        let groups: Vec<_> = levels.into_iter().map(|(tier, nodes)| file.group(&tier.name, nodes)).collect();
        for (number, (name, group)) in named.iter().zip(&groups).enumerate() {
            let root = if number == 0 { file.group("tree", vec![*group]) } else { *group };
            file.scene(Some(name), vec![root]);
        }
        file.levels(&groups, &covers)?;
    }
    if !unseen.is_empty() {
        let group = file.group("for sphereboard", unseen);
        file.scene(Some("for sphereboard"), vec![group]);
    }
    Ok(())
}

/// The meshes of a part.
struct Written {
    mesh: Index<Mesh>,
    /// What stands for it.
    other: Option<Index<Mesh>>,
    /// The same in its normal texture, where that is not glTF's.
    normals: Option<Index<Mesh>>,
}

impl Written {
    fn write<S>(file: &mut Writer, piece: &Piece<S>, pictures: &Pictures) -> Result<Self> {
        let (part, look) = (piece.part, pictures.look(&piece.part.material));
        let material = |file: &mut Writer, look: &Look| -> Index<Material> { file.material(&part.material.name, look) };
        let Plainly::Other(surface) = &piece.plainly else {
            let material = material(file, &look);
            return Ok(Self { mesh: file.mesh(&part.name, &part.surface, material)?, other: None, normals: None });
        };
        let plain = material(file, &Look { normal_texture: None, ..look });
        let bumps = look.normal_texture.map(|texture| Look { texture: Some(texture), normal_texture: None, ..look });
        let bumps = bumps.map(|look| material(file, &look));
        Ok(Self {
            mesh: file.mesh(&part.name, &part.surface, plain)?,
            other: Some(file.mesh(&part.name, surface, plain)?),
            normals: bumps.map(|material| file.mesh(&part.name, &part.surface, material)).transpose()?,
        })
    }
}

impl<S> Piece<'_, S> {
    fn said(&self, number: usize) -> Says<&S> {
        let mesh = &self.part.surface.mesh;
        let (triangles, quads, crown_center) = (mesh.triangles.len(), mesh.quads.len(), self.part.crown_center);
        Says::Part { number, triangles, quads, crown_center, says: &self.says }
    }
}

/// Reads what [`write_assembly`] wrote: what the file says of itself, and `parts` of it with what is said of each, in their order.
///
/// # Errors
/// [`Error::BrokenGlb`] for bytes that are no sound GLB file, [`Error::ForeignGlb`] for one without our extras or that another program
/// has rearranged.
pub fn read_assembly<A: DeserializeOwned, S: DeserializeOwned>(
    bytes: &[u8],
    parts: impl Fn(&A) -> usize,
) -> Result<(A, Vec<(Part, S)>)> {
    let file = Reader::open(bytes)?;
    let about: A = file.about()?;
    let mut found: Vec<Option<(Part, S)>> = Vec::new();
    let mut normals = Vec::new();
    // More parts than nodes cannot be.
    found.resize_with(parts(&about).min(file.nodes().len()), || None);
    for node in file.nodes() {
        file.check_unmoved(node)?;
        let Some(mesh) = node.mesh else { continue };
        match file.says::<Says<S>>(node)? {
            Says::Part { number, triangles, quads, crown_center, says } => {
                let place = found.get_mut(number).ok_or_else(|| super::read::foreign("it has more parts than it says"))?;
                // In several levels; the same mesh, since the file says so.
                if place.is_none() {
                    let name = node.name.clone().unwrap_or_default();
                    *place = Some((Part { name, crown_center, ..file.dressed(mesh, triangles, quads)? }, says));
                }
            }
            Says::Normals { of } => normals.push((of, mesh)),
            Says::StandsFor { .. } => {}
        }
    }
    let whole: Option<Vec<_>> = found.into_iter().collect();
    let mut whole =
        whole.filter(|all| all.len() == parts(&about)).ok_or_else(|| super::read::foreign("parts of it are missing"))?;
    for (of, mesh) in normals {
        if let Some((part, _)) = whole.get_mut(of) {
            part.material.normal_texture = file.base_texture(mesh)?;
        }
    }
    for (part, _) in &whole {
        part.check().map_err(|what| Error::BrokenGlb { what: format!("{}: {what}", part.name) })?;
    }
    Ok((about, whole))
}
