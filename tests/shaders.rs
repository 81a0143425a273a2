//! Every shader assembles and is valid WGSL, its entry points are named as agreed, and each struct that it shares with Rust has the
//! same fields at the same offsets there (DESIGN §6).

use std::collections::BTreeSet;

use bytemuck::Zeroable;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{Module, TypeInner};
use sphereboard::gpu::{SHADERS, assemble, layout};

/// The passes: every text that is not a shared piece.
fn passes() -> impl Iterator<Item = &'static str> {
    SHADERS.iter().map(|(name, _)| *name).filter(|name| !name.starts_with("shared/"))
}

fn parsed(name: &str) -> Module {
    let text = assemble(name).unwrap_or_else(|what| panic!("{name}: {what}"));
    naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)))
}

#[test]
fn every_shader_is_valid_and_its_entry_points_are_named_as_agreed() {
    for name in passes() {
        let module = parsed(name);
        let checked = Validator::new(ValidationFlags::all(), Capabilities::all()).validate(&module);
        assert!(checked.is_ok(), "{name}: {:?}", checked.err());
        assert!(!module.entry_points.is_empty(), "{name} does nothing");
        for entry in &module.entry_points {
            let stage = match entry.stage {
                naga::ShaderStage::Vertex => "vs_",
                naga::ShaderStage::Fragment => "fs_",
                _ => "cs_",
            };
            assert!(entry.name.starts_with(stage), "{name}: entry point {} should begin with {stage}", entry.name);
        }
    }
}

#[test]
fn every_file_of_the_shader_folder_is_in_the_table_and_every_shared_piece_is_used() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let mut files = BTreeSet::new();
    for (folder, prefix) in [(folder.clone(), ""), (folder.join("shared"), "shared/")] {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|e| e == "wgsl") {
                files.insert(format!("{prefix}{}", path.file_stem().unwrap().to_str().unwrap()));
            }
        }
    }
    let table: BTreeSet<String> = SHADERS.iter().map(|(name, _)| (*name).to_owned()).collect();
    assert_eq!(files, table);
    for shared in table.iter().filter(|name| name.starts_with("shared/")) {
        let import = format!("#import {shared}\n");
        assert!(SHADERS.iter().any(|(_, text)| text.contains(&import)), "{shared} is imported nowhere");
    }
    assert!(assemble("no_such_pass").is_err());
}

#[test]
fn shaders_take_every_shared_number_from_rust() {
    for (name, value) in layout::SHARED_NUMBERS {
        let line = format!("const {name}: u32 = {{{name}}};");
        let user = SHADERS.iter().find(|(_, text)| text.contains(&line)).unwrap_or_else(|| panic!("no shader asks for {name}"));
        let pass = passes().find(|pass| assemble(pass).unwrap().contains(&format!("const {name}: u32 = {value}u;")));
        assert!(pass.is_some(), "{} is in no pass", user.0);
    }
    // So far nothing else stands in braces by itself.
    assert!(passes().all(|pass| !assemble(pass).unwrap().contains(" = {")));
}

#[test]
fn no_step_of_growth_smoothing_or_culling_needs_more_storage_buffers_than_every_adapter_has() {
    for name in ["growth", "smooth", "cull"] {
        let module = parsed(name);
        let checked = Validator::new(ValidationFlags::all(), Capabilities::all()).validate(&module).unwrap();
        let group = |variable: &naga::GlobalVariable| variable.binding.as_ref().map(|binding| binding.group);
        for (i, entry) in module.entry_points.iter().enumerate() {
            let info = checked.get_entry_point(i);
            let used = module.global_variables.iter().filter(|(v, _)| !info[*v].is_empty());
            let groups: BTreeSet<u32> = used.filter_map(|(_, v)| group(v)).collect();
            // A layout binds all that its groups have; the frame's has the crowns too.
            let bound = module.global_variables.iter().filter(|(_, v)| group(v).is_some_and(|g| groups.contains(&g)));
            let buffers = bound.filter(|(_, v)| matches!(v.space, naga::AddressSpace::Storage { .. })).count();
            let unseen = usize::from(name == "smooth");
            assert!(buffers + unseen <= 8, "{name}: {} binds {buffers} storage buffers", entry.name);
        }
    }
}

/// A struct of Rust: its size and each field's name, offset and size. Naming a field that is not there, or leaving one out, does not
/// compile.
macro_rules! rust_struct {
    ($name:ident { $($field:ident),+ $(,)? }) => {{
        let value = layout::$name::zeroed();
        let layout::$name { $($field: _),+ } = value;
        let fields = vec![$((stringify!($field), std::mem::offset_of!(layout::$name, $field), size_of_val(&value.$field))),+];
        (stringify!($name), size_of::<layout::$name>(), fields)
    }};
}

/// A struct's name and size, and the name, offset and size of each of its fields.
type Layout = (&'static str, usize, Vec<(&'static str, usize, usize)>);

/// All structs that are shared through buffers.
fn rust_structs() -> Vec<Layout> {
    vec![
        rust_struct!(Frame {
            clip_from_world,
            world_from_clip,
            sun_clip_from_world,
            eye,
            time_s,
            toward_sun,
            shading,
            sun_color,
            shadow_texel_m,
            sky_color,
            ground_m,
            ground_color,
            background,
            size_px,
            px_per_m,
            lean,
            flutter_m,
            sun_depth_m,
            backward,
            layer,
            heights,
            haze,
            level_eye,
            sun_level_m,
        }),
        rust_struct!(Placed { position, turn_and_scale }),
        rust_struct!(CullLook { planes, eye, near_m, px_per_m, sway, least_px, for_sun, pad }),
        rust_struct!(CullGroup { seen, facing, height_m, radius_m, center_m }),
        rust_struct!(CullSpan { at, tree, count_and_tests }),
        rust_struct!(CullBlock { list, first_span, kept_low, kept_high, before }),
        rust_struct!(CullList { first_block, blocks, kept }),
        rust_struct!(CullCall { corners, trees, first_corner, base_vertex, first_tree, list }),
        rust_struct!(CaptureView { clip_from_object, far_m, deep_m, pad }),
        rust_struct!(GrowthFrame {
            size_px,
            px_per_m,
            depth_units,
            orthographic,
            tips,
            inner,
            random,
            frame,
            corners,
            tile_count,
            alike,
        }),
        rust_struct!(Counts { grown, instances, first_vertex, first_instance, roots }),
        rust_struct!(Smoothed { pixels, instances, first_vertex, first_instance, tiles }),
        rust_struct!(GrownPlace { pixel, depth }),
        rust_struct!(GrownColor { red_green, blue_coverage }),
        rust_struct!(GrowingCrown { limb_x, min_units, limb_y, max_units, gap_m, first, count, pad }),
        rust_struct!(Material {
            factor,
            crown_center,
            alpha_cutoff,
            grows,
            pad,
            crown_reach,
            tree_height_m,
            tree_foot_m,
            pad2,
            tree_center,
            pad3,
            tree_half,
            pad4,
        }),
        rust_struct!(Presence {
            anchor,
            grid,
            appears,
            vanishes,
            axis,
            radius_m,
            pivot,
            pad,
            vanish_anchor,
            pad2,
            cosines,
            rises,
            sinks,
            pad3,
        }),
    ]
}

#[test]
fn shared_structs_have_the_same_fields_at_the_same_places_in_rust_and_wgsl() {
    for (name, size, fields) in rust_structs() {
        let mut seen = 0;
        for pass in passes() {
            let module = parsed(pass);
            let sizes = {
                let mut layouter = naga::proc::Layouter::default();
                layouter.update(module.to_ctx()).unwrap();
                layouter
            };
            let Some((_, ty)) = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name)) else { continue };
            let TypeInner::Struct { members, span } = &ty.inner else { panic!("{pass}: {name} is no struct") };
            let found: Vec<_> =
                members.iter().map(|m| (m.name.as_deref().unwrap_or(""), m.offset as usize, sizes[m.ty].size as usize)).collect();
            assert_eq!(found, fields, "{pass}: {name}");
            assert_eq!(*span as usize, size, "{pass}: size of {name}");
            seen += 1;
        }
        assert!(seen > 0, "no shader knows {name}");
    }
}

/// Vertex attributes as Rust declares them, against the inputs of `vs_main`.
#[test]
fn vertex_attributes_are_what_the_mesh_shader_takes() {
    let module = parsed("mesh");
    let entry = module.entry_points.iter().find(|e| e.name == "vs_main").unwrap();
    let TypeInner::Struct { members, .. } = &module.types[entry.function.arguments[0].ty].inner else { panic!("no struct") };
    let declared = [layout::Vertex::LAYOUT, layout::Instance::LAYOUT];
    let attributes: Vec<_> = declared.iter().flat_map(|l| l.attributes).collect();
    assert_eq!(members.len(), attributes.len());
    for (member, attribute) in members.iter().zip(attributes) {
        let Some(naga::Binding::Location { location, .. }) = member.binding else { panic!("{:?} has no location", member.name) };
        assert_eq!(location, attribute.shader_location);
        let components = match &module.types[member.ty].inner {
            TypeInner::Vector { size, .. } => *size as usize,
            _ => 1,
        };
        let expected = match attribute.format {
            wgpu::VertexFormat::Float32x2 | wgpu::VertexFormat::Uint32x2 => 2,
            wgpu::VertexFormat::Float32x3 => 3,
            wgpu::VertexFormat::Float32x4 | wgpu::VertexFormat::Snorm16x4 => 4,
            other => panic!("{other:?} is not counted here"),
        };
        assert_eq!(components, expected, "{:?}", member.name);
    }
}
