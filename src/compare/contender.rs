//! Who takes part in a comparison: the methods, and what somebody else has made of the same tree (`--extra`).

use std::path::{Path, PathBuf};

use crate::repr::file::{self, Origin};
use crate::repr::limits::{self, BudgetParams};
use crate::repr::{self, BuiltPart, BuiltTree, Capture, Order, Representation, Settings, TreeSource, tabled};
use crate::{Error, Result, Seed, Warning, files};

/// A row of the comparison.
pub enum Contender {
    /// A method of [`repr::METHODS`].
    Method(&'static dyn Representation),
    /// Another program's stand-in, or one that `sphereboard bake` wrote; by the stem of its file's name.
    Extra {
        /// What it is called in the report.
        id: String,
        /// Its file.
        path: PathBuf,
    },
}

/// What contenders are built with.
pub struct Workshop<'a> {
    /// The tree.
    pub source: &'a TreeSource,
    /// Of every random number.
    pub seed: Seed,
    /// Takes pictures for methods.
    pub capture: &'a dyn Capture,
    /// What a built tree may take.
    pub budget: BudgetParams,
}

impl Contender {
    /// The methods of these ids and then the stand-ins in these files, each under a name of its own.
    ///
    /// # Errors
    /// [`Error::UnknownMethod`].
    pub fn all(methods: &[String], extras: &[PathBuf]) -> Result<Vec<Self>> {
        let mut all: Vec<Self> = methods.iter().map(|id| repr::method(id).map(Self::Method)).collect::<Result<_>>()?;
        for path in extras {
            let stem = path.file_stem().map_or_else(|| "extra".to_owned(), |stem| stem.to_string_lossy().into_owned());
            // The name is a folder's, too.
            let plain: String = stem.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect();
            // `truth` is the folder of the true tree's pictures.
            let taken = |id: &str| id == super::pictures::TRUTH_FOLDER || all.iter().any(|other| other.id() == id);
            let id = (1..).map(|i| if i == 1 { plain.clone() } else { format!("{plain}-{i}") }).find(|id| !taken(id));
            all.push(Self::Extra { id: id.expect("numbers do not end"), path: path.clone() });
        }
        Ok(all)
    }

    /// The word for it in files and tables.
    pub fn id(&self) -> &str {
        match self {
            Self::Method(method) => method.id(),
            Self::Extra { id, .. } => id,
        }
    }

    /// What it is called, and where it comes from.
    pub fn told(&self) -> (String, String) {
        match self {
            Self::Method(method) => (method.name().to_owned(), method.citation().to_owned()),
            Self::Extra { path, .. } => (format!("Stand-in of {}", path.display()), "given with --extra".to_owned()),
        }
    }

    /// Every effective parameter.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`].
    pub fn parameters(&self) -> Result<Vec<(String, String)>> {
        let Self::Method(method) = self else { return Ok(vec![]) };
        Ok(tabled(*method, &Settings::default())?.into_iter().map(|(name, value)| (name.to_owned(), value)).collect())
    }

    /// Builds or reads it.
    ///
    /// # Errors
    /// Those of [`repr::build`] and [`limits::check_textures`]; of a file those of `read`.
    pub fn build(&self, shop: &Workshop) -> Result<BuiltTree> {
        let built = match self {
            Self::Method(method) => {
                let order = Order { method: method.id(), trunk: None, settings: &Settings::default(), seed: shop.seed };
                repr::build(&order, shop.source, shop.capture)?
            }
            Self::Extra { id, path } => BuiltTree { method: id.clone(), ..read(path, shop.source)? },
        };
        limits::check_textures(&built, &shop.budget)?;
        Ok(built)
    }

    /// The bytes of its GLB file.
    ///
    /// # Errors
    /// Those of [`file::write`] and [`files::read_whole`].
    pub fn disk_bytes(&self, built: &BuiltTree, shop: &Workshop) -> Result<usize> {
        match self {
            Self::Method(method) => {
                let order = Order { method: method.id(), trunk: None, settings: &Settings::default(), seed: shop.seed };
                Ok(file::write(built, &Origin::of(&order, shop.source.name())?)?.len())
            }
            Self::Extra { path, .. } => Ok(files::read_whole(path, u64::MAX)?.len()),
        }
    }
}

/// A share of the true tree's height within which a stand-in's box has to be where the tree's is.
const STANDS_WITHIN: f32 = 0.25;

/// Somebody else's stand-in for `source`, as it is in the file: with its levels where we wrote it, else all of it always seen. It is neither
/// scaled nor moved.
///
/// # Errors
/// Those of [`repr::open_model`], and [`Error::OtherTree`] for one that does not stand where the tree stands.
pub fn read(path: &Path, source: &TreeSource) -> Result<BuiltTree> {
    let truth = source.box_of_all()?;
    let own = file::read(&files::read_whole(path, u64::MAX)?).transpose()?;
    let built = match own {
        Some((built, _)) => built,
        None => {
            let imported = repr::open_model(&path.to_string_lossy())?;
            let points = imported.parts.iter().flat_map(|part| part.surface.mesh.positions.iter().copied());
            let bounds = crate::geom::Bounds::of(points).ok_or_else(|| Error::EmptyModel { why: String::new() })?;
            let growth = imported.tree_model.as_ref().map(|model| model.about.growth);
            let parts = imported.parts.into_iter().map(BuiltPart::still).collect();
            BuiltTree { growth, warnings: imported.warnings, ..BuiltTree::new(bounds, parts) }
        }
    };
    let off = (built.bounds.min - truth.min).abs().max((built.bounds.max - truth.max).abs()).max_element();
    if off > STANDS_WITHIN * truth.size().max_element() {
        let told = |b: crate::geom::Bounds| format!("{:.2} to {:.2} m", b.min, b.max);
        return Err(Error::OtherTree { path: path.to_owned(), expected: told(truth), found: told(built.bounds) });
    }
    // Its distances are told in heights of the tree that it stands for.
    let mut built = BuiltTree { bounds: truth, ..built };
    if off > 0.05 * truth.size().max_element() {
        let words = format!("its box differs from the tree's by up to {off:.2} m");
        built.warnings.push(Warning::new("extra-elsewhere", words));
    }
    Ok(built)
}
