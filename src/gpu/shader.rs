//! Shaders: one text per pass, with shared pieces pulled in by `#import <name>`, each once (textual, as a C header with guards; a
//! piece that says `#instead-of <name>` takes the place of another that is imported later), and numbers of Rust where their names stand in braces: `const TILE_PX: u32 = {TILE_PX};`. Text, not pipeline constants, since Mesa's
//! software driver makes a shader anew for each use of those.

use std::collections::BTreeSet;

use super::Gpu;
use super::layout::SHARED_NUMBERS;

/// Every WGSL text of `shaders/`, by path without the extension. Embedded, so that the program is one file.
pub const SHADERS: &[(&str, &str)] = &[
    ("shared/frame", include_str!("../../shaders/shared/frame.wgsl")),
    ("shared/screen", include_str!("../../shaders/shared/screen.wgsl")),
    ("shared/tile", include_str!("../../shaders/shared/tile.wgsl")),
    ("shared/id", include_str!("../../shaders/shared/id.wgsl")),
    ("shared/grown", include_str!("../../shaders/shared/grown.wgsl")),
    ("shared/outline", include_str!("../../shaders/shared/outline.wgsl")),
    ("growth", include_str!("../../shaders/growth.wgsl")),
    ("grown", include_str!("../../shaders/grown.wgsl")),
    ("shared/part", include_str!("../../shaders/shared/part.wgsl")),
    ("shared/place", include_str!("../../shaders/shared/place.wgsl")),
    ("shared/seen", include_str!("../../shaders/shared/seen.wgsl")),
    ("shared/many", include_str!("../../shaders/shared/many.wgsl")),
    ("cull", include_str!("../../shaders/cull.wgsl")),
    ("shared/corner", include_str!("../../shaders/shared/corner.wgsl")),
    ("shared/corner_of_many", include_str!("../../shaders/shared/corner_of_many.wgsl")),
    ("shared/presence", include_str!("../../shaders/shared/presence.wgsl")),
    ("shared/fade", include_str!("../../shaders/shared/fade.wgsl")),
    ("shared/shade", include_str!("../../shaders/shared/shade.wgsl")),
    ("shared/cast", include_str!("../../shaders/shared/cast.wgsl")),
    ("shared/sway", include_str!("../../shaders/shared/sway.wgsl")),
    ("shared/light", include_str!("../../shaders/shared/light.wgsl")),
    ("shared/shadow", include_str!("../../shaders/shared/shadow.wgsl")),
    ("shared/sky", include_str!("../../shaders/shared/sky.wgsl")),
    ("shared/leaves", include_str!("../../shaders/shared/leaves.wgsl")),
    ("leaves", include_str!("../../shaders/leaves.wgsl")),
    ("cast_leaves", include_str!("../../shaders/cast_leaves.wgsl")),
    ("shared/capture_view", include_str!("../../shaders/shared/capture_view.wgsl")),
    ("capture", include_str!("../../shaders/capture.wgsl")),
    ("capture_resolve", include_str!("../../shaders/capture_resolve.wgsl")),
    ("shared/octahedral", include_str!("../../shaders/shared/octahedral.wgsl")),
    ("impostor", include_str!("../../shaders/impostor.wgsl")),
    ("impostor_cast", include_str!("../../shaders/impostor_cast.wgsl")),
    ("cast", include_str!("../../shaders/cast.wgsl")),
    ("mesh", include_str!("../../shaders/mesh.wgsl")),
    ("mesh_of_many", include_str!("../../shaders/mesh_of_many.wgsl")),
    ("cast_of_many", include_str!("../../shaders/cast_of_many.wgsl")),
    ("impostor_of_many", include_str!("../../shaders/impostor_of_many.wgsl")),
    ("impostor_cast_of_many", include_str!("../../shaders/impostor_cast_of_many.wgsl")),
    ("shared/meadow", include_str!("../../shaders/shared/meadow.wgsl")),
    ("terrain", include_str!("../../shaders/terrain.wgsl")),
    ("backdrop", include_str!("../../shaders/backdrop.wgsl")),
    ("present", include_str!("../../shaders/present.wgsl")),
    ("smooth", include_str!("../../shaders/smooth.wgsl")),
    ("smoothed", include_str!("../../shaders/smoothed.wgsl")),
    ("composite", include_str!("../../shaders/composite.wgsl")),
];

/// A compiled shader text; entry points are always `vs_main`, `fs_main` or `cs_main`, with a suffix where one text holds several.
#[derive(Debug)]
pub struct Shader(pub wgpu::ShaderModule);

impl Shader {
    /// Compiles one of [`SHADERS`].
    pub fn load(gpu: &Gpu, name: &'static str) -> Self {
        Self::load_for(gpu, name, &VARIANTS.map(|_| 0))
    }

    /// The same for given values of [`VARIANTS`].
    pub fn load_for(gpu: &Gpu, name: &'static str, values: &[u32; VARIANTS.len()]) -> Self {
        let text = assemble_for(name, values).expect("a test assembles and validates every shader of the table");
        let source = wgpu::ShaderSource::Wgsl(text.into());
        Self(gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(name), source }))
    }
}

/// Numbers that stand in a shader's text as [`SHARED_NUMBERS`] do, but differ from pipeline to pipeline: what is known of a part and of a
/// picture. `render::pipelines` says what they mean.
pub const VARIANTS: [&str; 11] = [
    "PART_FADE",
    "PART_FACING",
    "PART_TURNED",
    "FOLIAGE",
    "CROWN",
    "NORMAL_MAPPED",
    "STAND_IN",
    "GROWING",
    "SHADING",
    "AIR",
    "WIND",
];

/// The text of a shader with its imports and numbers in place, all [`VARIANTS`] 0.
///
/// # Errors
/// The name that is in no row of [`SHADERS`].
pub fn assemble(name: &str) -> Result<String, String> {
    assemble_for(name, &VARIANTS.map(|_| 0))
}

/// The same for given values of [`VARIANTS`].
///
/// # Errors
/// The name that is in no row of [`SHADERS`].
pub fn assemble_for(name: &str, values: &[u32; VARIANTS.len()]) -> Result<String, String> {
    let mut text = String::new();
    include(name, &mut BTreeSet::new(), &mut text)?;
    let numbers = SHARED_NUMBERS.iter().copied().chain(VARIANTS.into_iter().zip(*values));
    Ok(numbers.fold(text, |text, (name, value)| text.replace(&format!("{{{name}}}"), &format!("{value}u"))))
}

fn include(name: &str, seen: &mut BTreeSet<String>, out: &mut String) -> Result<(), String> {
    if !seen.insert(name.to_owned()) {
        return Ok(());
    }
    let (_, text) = SHADERS.iter().find(|(known, _)| *known == name).ok_or_else(|| format!("there is no shader {name}"))?;
    for line in text.lines() {
        if let Some(import) = line.strip_prefix("#import ") {
            include(import.trim(), seen, out)?;
        } else if let Some(other) = line.strip_prefix("#instead-of ") {
            seen.insert(other.trim().to_owned());
        } else {
            out.push_str(line);
            out.push('\n');
        }
    }
    Ok(())
}
