//! The tree itself, every branch and every leaf: what all others are measured by (Rebollo fig. 1, She fig. 1).

use super::{BuiltPart, BuiltTree, Job, Representation, Scope, SourceKind};
use crate::Result;
use crate::params::ParamSpec;

/// Full geometry.
pub struct Geometry;

impl Representation for Geometry {
    fn id(&self) -> &'static str {
        "geometry"
    }

    fn name(&self) -> &'static str {
        "Full geometry"
    }

    fn citation(&self) -> &'static str {
        "Rebollo et al. 2007, fig. 1; She et al. 2018, fig. 1"
    }

    fn scopes(&self) -> &'static [Scope] {
        &[Scope::Tree, Scope::Foliage, Scope::Wood]
    }

    fn accepts(&self) -> &'static [SourceKind] {
        SourceKind::ALL
    }

    fn specs(&self) -> Vec<ParamSpec> {
        vec![]
    }

    fn build(&self, job: &Job) -> Result<BuiltTree> {
        let parts = job.source.parts(job.scope).into_iter().cloned().map(BuiltPart::still).collect();
        Ok(BuiltTree { growth: job.source.growth(), ..BuiltTree::new(job.source.box_of_all()?, parts) })
    }
}
