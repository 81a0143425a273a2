//! What building may take: a budget for pictures, counted by common code from what was built, and a bound on the source, so that a tree
//! too large for any memory is refused with a sentence before work is spent on it.

use crate::params::{Kind, ParamSpec};
use crate::{Error, Result};

use super::{BuiltTree, Scope, Stats, TreeSource, method};

/// Memory that building takes per triangle of the source, bytes, beside the pictures: the source itself, a copy of it, and what is sorted
/// and captured.
pub const BYTES_PER_TRIANGLE: usize = 600;

/// Most triangles of a source: about 12 GB by [`BYTES_PER_TRIANGLE`], ten times a tree of a million leaves.
pub const MOST_TRIANGLES: usize = 20_000_000;

crate::params! {
    /// What a built tree may take.
    pub struct BudgetParams {
        /// Most megabytes that the pictures of a built tree may take on the device, uncompressed, with all their smaller sizes.
        texture_budget_mb: f64 = 256.0, in 0.01..=65536.0, unit "MB", source "ours: a forest of ten kinds in the memory of a common GPU";
    }
}

/// Refuses a source that would take more memory than there is.
///
/// # Errors
/// [`Error::TreeTooLarge`].
pub fn check_source(source: &TreeSource) -> Result<()> {
    let triangles = |mesh: &crate::geom::PolyMesh| mesh.triangles.len() + 2 * mesh.quads.len();
    let found: usize = source.parts(Scope::Tree).iter().map(|part| triangles(&part.surface.mesh)).sum();
    if found <= MOST_TRIANGLES {
        return Ok(());
    }
    let gb = (found / 1_000_000 * BYTES_PER_TRIANGLE).div_ceil(1000);
    Err(Error::TreeTooLarge { source_name: source.name().to_owned(), found, most: MOST_TRIANGLES, gb })
}

/// Refuses a built tree whose pictures take more than the budget.
///
/// # Errors
/// [`Error::TextureBudget`] names the parameters to lower.
pub fn check_textures(built: &BuiltTree, budget: &BudgetParams) -> Result<()> {
    let found_mb = Stats::of_all(built).texture_bytes as f64 / 1e6;
    if found_mb <= budget.texture_budget_mb {
        return Ok(());
    }
    let specs = method(&built.method).map(|method| method.specs()).unwrap_or_default();
    let named = |wanted: &dyn Fn(&&ParamSpec) -> bool| specs.iter().filter(wanted).map(|spec| spec.name).collect::<Vec<_>>();
    // Sizes of pictures count twice, so they come first; then numbers of things.
    let sizes = named(&|spec| spec.unit == "px");
    let counts = named(&|spec| spec.unit != "px" && matches!(spec.kind, Kind::Whole { .. }));
    let lower = [sizes, counts].concat();
    let remedy = if lower.is_empty() {
        "use smaller textures in the source, or raise --texture-budget-mb".to_owned()
    } else {
        format!("lower {} with --set, or raise --texture-budget-mb", lower.join(" or "))
    };
    Err(Error::TextureBudget { method: built.method.clone(), found_mb, budget_mb: budget.texture_budget_mb, remedy })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;
    use image::RgbaImage;

    use super::*;
    use crate::geom::Bounds;
    use crate::model::{Material, Part};
    use crate::repr::BuiltPart;

    #[test]
    fn the_budget_counts_shared_pictures_once_and_names_what_to_lower() {
        let texture = Some(Arc::new(RgbaImage::new(512, 512)));
        let material = Material { texture, ..Material::default() };
        let part = Part { name: "card".to_owned(), surface: Default::default(), material, crown_center: None };
        let parts = vec![BuiltPart::still(part.clone()), BuiltPart::still(part)];
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
        let built = BuiltTree { method: "octahedral".to_owned(), ..BuiltTree::new(bounds, parts) };
        let budget = |texture_budget_mb| BudgetParams { texture_budget_mb };
        // 512² texels of 4 bytes and a third more: 1.398 MB, once.
        assert!(check_textures(&built, &budget(1.399)).is_ok());
        let message = check_textures(&built, &budget(1.397)).unwrap_err().to_string();
        for word in ["octahedral", "1.4 MB", "frame_px", "grid", "--texture-budget-mb"] {
            assert!(message.contains(word), "{message}");
        }
    }
}
