//! What representations are built from: a true tree, or the model of a photograph.

use std::borrow::Cow;
use std::path::Path;

use glam::Vec3;

use crate::geom::Bounds;
use crate::model::grown::{dress_preset, preset_skeleton};
use crate::model::import::{self, Imported};
use crate::model::reference::{Asked, ReferenceTree};
use crate::model::{Growth, Material, Part, TreeModel};
use crate::plant::Skeleton;
use crate::plant::presets::{PRESETS, Preset, preset};
use crate::{Error, Result, Seed, Warning, files};

use super::{Scope, file};

/// A tree to stand for; metres, +Y up, foot at the origin.
#[derive(Debug, Clone)]
pub enum TreeSource {
    /// A tree in full, grown here or imported.
    Reference(Box<ReferenceTree>),
    /// A sphere-board of a photograph.
    Model {
        /// Its name.
        name: String,
        /// The model.
        model: Box<TreeModel>,
        /// Its crowns and trunk as parts.
        parts: Vec<Part>,
    },
}

/// What a source is, as far as methods ask.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SourceKind {
    /// A true tree with the bones it was grown on.
    Grown,
    /// A true tree from a file, without bones.
    Imported,
    /// The model of a photograph.
    Model,
}

impl SourceKind {
    /// All of them.
    pub const ALL: &'static [Self] = &[Self::Grown, Self::Imported, Self::Model];

    /// True trees.
    pub const REFERENCE: &'static [Self] = &[Self::Grown, Self::Imported];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Grown => "a grown tree",
            Self::Imported => "an imported tree",
            Self::Model => "a photograph's model",
        }
    }
}

/// The model file that a user names where a preset might stand as well.
///
/// # Errors
/// [`Error::UnknownTree`] where there is no such file, which names the presets; those of [`import::open`].
pub fn open_model(text: &str) -> Result<Imported> {
    import::open(Path::new(text)).map_err(|error| match error {
        Error::NoSuchFile { .. } => {
            let known = PRESETS.iter().map(|p| p.name).collect::<Vec<_>>().join(", ");
            Error::UnknownTree { known, found: text.to_owned() }
        }
        other => other,
    })
}

/// Refuses what `sphereboard bake` wrote: it looks like a tree, but a stand-in for it would stand for cards and boxes.
fn refuse_built(path: &Path) -> Result<()> {
    // What cannot be read is told by whoever reads it next.
    let Some(read) = files::read_whole(path, u64::MAX).ok().and_then(|bytes| file::read(&bytes)) else { return Ok(()) };
    Err(match read {
        Ok((built, origin)) => Error::AlreadyBuilt { path: path.to_owned(), method: built.method, source_name: origin.source },
        Err(cause) => Error::InFile { path: path.to_owned(), cause: Box::new(cause) },
    })
}

impl TreeSource {
    /// What a user names: a preset, grown here with its bones, or the file of a model. `asked` says which materials of a file are wood or
    /// foliage.
    ///
    /// # Errors
    /// [`Error::UnknownTree`] for neither, [`Error::AlreadyBuilt`] for what a method has built of a tree, those of [`import::open`] and [`ReferenceTree::new`].
    pub fn open(text: &str, asked: &Asked, seed: Seed) -> Result<(Self, Vec<Warning>)> {
        if let Some(preset) = preset(text) {
            return Self::grown(preset, None, asked, seed);
        }
        let path = Path::new(text);
        refuse_built(path)?;
        let imported = open_model(text)?;
        let name = path.file_stem().map_or_else(|| "tree".to_owned(), |stem| stem.to_string_lossy().into_owned());
        if let Some(model) = imported.tree_model {
            return Ok((Self::model(name, model), imported.warnings));
        }
        let inside = |cause| Error::InFile { path: path.to_owned(), cause: Box::new(cause) };
        let tree = ReferenceTree::new(name, imported.parts, asked).map_err(inside)?;
        let warnings = imported.warnings.into_iter().chain(tree.warnings.iter().cloned()).collect();
        Ok((Self::reference(tree), warnings))
    }

    /// A preset with its bones, at an age or grown up.
    ///
    /// # Errors
    /// Those of [`preset_skeleton`], [`dress_preset`] and [`ReferenceTree::new`].
    pub fn grown(preset: &Preset, age: Option<f64>, asked: &Asked, seed: Seed) -> Result<(Self, Vec<Warning>)> {
        let skeleton = preset_skeleton(preset, age, seed)?;
        let parts = dress_preset(preset, &skeleton, seed)?.parts;
        let mut tree = ReferenceTree::new(preset.name.to_owned(), parts, asked)?;
        tree.skeleton = Some(skeleton);
        let warnings = tree.warnings.clone();
        Ok((Self::reference(tree), warnings))
    }

    /// The model of a photograph.
    pub fn model(name: String, model: TreeModel) -> Self {
        let parts = model.parts();
        Self::Model { name, model: Box::new(model), parts }
    }

    /// A true tree.
    pub fn reference(tree: ReferenceTree) -> Self {
        Self::Reference(Box::new(tree))
    }

    /// What it is called.
    pub fn name(&self) -> &str {
        match self {
            Self::Reference(tree) => &tree.name,
            Self::Model { name, .. } => name,
        }
    }

    /// What it is.
    pub fn kind(&self) -> SourceKind {
        match self {
            Self::Reference(tree) if tree.skeleton.is_some() => SourceKind::Grown,
            Self::Reference(_) => SourceKind::Imported,
            Self::Model { .. } => SourceKind::Model,
        }
    }

    /// The bones of a grown tree.
    pub fn skeleton(&self) -> Option<&Skeleton> {
        match self {
            Self::Reference(tree) => tree.skeleton.as_ref(),
            Self::Model { .. } => None,
        }
    }

    /// The surfaces of what `scope` covers, wood first.
    pub fn parts(&self, scope: Scope) -> Vec<&Part> {
        let (wood, foliage): (Vec<&Part>, Vec<&Part>) = match self {
            Self::Reference(tree) => (tree.wood.iter().collect(), tree.foliage.iter().collect()),
            Self::Model { parts, .. } => parts.iter().partition(|part| part.crown_center.is_none()),
        };
        match scope {
            Scope::Tree => wood.into_iter().chain(foliage).collect(),
            Scope::Foliage => foliage,
            Scope::Wood => wood,
        }
    }

    /// Every vertex of what `scope` covers.
    pub fn points(&self, scope: Scope) -> impl Iterator<Item = Vec3> {
        self.parts(scope).into_iter().flat_map(|part| part.surface.mesh.positions.iter().copied())
    }

    /// The box around what `scope` covers; `None` where there is nothing of it.
    pub fn bounds(&self, scope: Scope) -> Option<Bounds> {
        Bounds::of(self.points(scope))
    }

    /// The box around all of it.
    ///
    /// # Errors
    /// [`Error::EmptyModel`] where there is nothing.
    pub fn box_of_all(&self) -> Result<Bounds> {
        self.bounds(Scope::Tree).ok_or_else(|| Error::EmptyModel { why: String::new() })
    }

    /// Where the trunk stands on its lowest twentieth, metres: what upright cards turn about and planes cross in. Of a tree without wood,
    /// under its middle.
    pub fn foot(&self) -> Vec3 {
        let scope = if self.bounds(Scope::Wood).is_some() { Scope::Wood } else { Scope::Tree };
        let low = |all: Bounds| Bounds::of(self.points(scope).filter(|p| p.y <= all.min.y + 0.05 * all.size().y));
        let middle = self.bounds(scope).and_then(low).map_or(Vec3::ZERO, |foot| foot.center());
        Vec3::new(middle.x, self.bounds(Scope::Tree).map_or(0.0, |all| all.foot_y()), middle.z)
    }

    /// Why no picture can be taken of it; `None` where one can.
    pub fn without_extent(&self) -> Option<String> {
        let seen = self.bounds(Scope::Tree).is_some_and(|all| all.size().is_finite() && all.size().max_element() > 1e-6);
        (!seen).then(|| "it has no extent of which a picture could be taken".to_owned())
    }

    /// The true tree whose leaves are known one by one.
    ///
    /// # Errors
    /// Why they are not.
    pub fn in_leaf(&self) -> Result<&ReferenceTree, String> {
        match self {
            Self::Reference(tree) if !tree.leaves.is_empty() => Ok(tree),
            _ => Err("it has no leaves; --leaves names their material if there are any".to_owned()),
        }
    }

    /// How outlines grow, where a photograph told.
    pub fn growth(&self) -> Option<Growth> {
        match self {
            Self::Reference(_) => None,
            Self::Model { model, .. } => Some(model.about.growth),
        }
    }
}

/// Whether foliage is shells rather than leaves: the crowns of a photograph's model. A slab out of one is a ring.
pub fn is_hollow(foliage: &[&Part]) -> bool {
    foliage.iter().any(|part| part.crown_center.is_some())
}

/// Foliage of which slabs are taken: a shell is then seen from inside too, or behind the trunk there would be nothing.
pub fn opened(foliage: Vec<&Part>) -> Vec<Cow<'_, Part>> {
    let open = |part: &Part| Part { material: Material { two_sided: true, ..part.material.clone() }, ..part.clone() };
    let is_hollow = is_hollow(&foliage);
    foliage.into_iter().map(|part| if is_hollow { Cow::Owned(open(part)) } else { Cow::Borrowed(part) }).collect()
}
